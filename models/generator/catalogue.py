"""All models by name."""

from . import carton, clutter_books, clutter_drink, room

MODELS = {
    "book_stack": clutter_books.book_stack,
    "mug": clutter_drink.mug,
    "orange_juice_carton": carton.build,
    "room_desk": room.build,
}
