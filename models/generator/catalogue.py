"""All models by name."""

from . import carton, clutter_books, clutter_drink, detergent_bottle, pasta_box, room

MODELS = {
    "book_stack": clutter_books.book_stack,
    "detergent_bottle": detergent_bottle.build,
    "mug": clutter_drink.mug,
    "orange_juice_carton": carton.build,
    "pasta_box": pasta_box.build,
    "room_desk": room.build,
}
