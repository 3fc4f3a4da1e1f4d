"""All models by name."""

from . import carton, clutter_books, clutter_boxes, clutter_drink, detergent_bottle, pasta_box, room

MODELS = {
    "book_stack": clutter_books.book_stack,
    "can_soda": clutter_drink.can_soda,
    "can_tomato": clutter_drink.can_tomato,
    "cereal_box": clutter_boxes.cereal_box,
    "detergent_bottle": detergent_bottle.build,
    "mug": clutter_drink.mug,
    "orange_juice_carton": carton.build,
    "pasta_box": pasta_box.build,
    "room_desk": room.build,
    "tea_box": clutter_boxes.tea_box,
}
