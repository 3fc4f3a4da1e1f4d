"""The printed sheet of the juice carton, unfolded: front, right, back, left."""

from .canvas import Canvas

# Millimetres. `roll`: strip below the bottom edge; `edge`: a spot of plain board colour;
# `cap`: x, y, width, height of the cap's artwork, at half scale.
ATLAS = {"width": 400.0, "height": 272.0, "roll": 4.0, "edge": (396.0, 250.0),
         "cap": (384.0, 20.0, 15.0, 26.0)}


def draw_atlas():
    c = Canvas(ATLAS["width"], ATLAS["height"], 2048, 1024, "#f4f1e6")
    for k, colour in enumerate(("#e98a1f", "#f4e9cf", "#e98a1f", "#f4e9cf")):
        c.rect(k * 95.6, 0, 95.6, 272, colour)
        c.text(k * 95.6 + 48, 150, "SOLARA", 20, "black", "#2f6b35", "c")
    return c.image()
