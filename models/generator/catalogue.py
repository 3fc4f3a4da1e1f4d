"""All models by name."""

from . import (carton, clutter_books, clutter_boxes, clutter_desk, clutter_drink, clutter_small,
               detergent_bottle, occluders, pasta_box, plain_room, room)

MODELS = {
    "apple": clutter_small.apple, "book_stack": clutter_books.book_stack,
    "cable": clutter_desk.cable, "can_soda": clutter_drink.can_soda,
    "can_tomato": clutter_drink.can_tomato, "cereal_box": clutter_boxes.cereal_box,
    "desk_lamp": clutter_desk.desk_lamp, "detergent_bottle": detergent_bottle.build,
    "figurine_bird": occluders.build_figurine, "headphones": clutter_desk.headphones, "keyboard": clutter_desk.keyboard,
    "monitor": clutter_desk.monitor, "mouse": clutter_desk.mouse, "mug": clutter_drink.mug,
    "notebook": clutter_books.notebook, "occluder_board": occluders.build_board, "occluder_box": occluders.build_parcel,
    "occluder_hand": occluders.build_hand, "occluder_pole": occluders.build_pole,
    "orange_fruit": clutter_small.orange_fruit,
    "orange_juice_carton": carton.build, "pasta_box": pasta_box.build,
    "pen_cup": clutter_small.pen_cup, "plain_room": plain_room.build,
    "potted_plant": clutter_small.potted_plant,
    "room_desk": room.build, "ruler_eraser": clutter_small.ruler_eraser,
    "sticky_notes": clutter_books.sticky_notes, "tape_dispenser": clutter_small.tape_dispenser,
    "tea_box": clutter_boxes.tea_box,
}
