"""Folding carton of pasta: printed board with a picture window and closing flaps."""

from .mesh import Model
from .pasta_print import draw_atlas, RECTS, SHEET
from .shapes import box

SIZE = (0.14, 0.06, 0.20)
FLAP = 0.0007


def rect(name):
    """Texture rectangle (u0, v0, u1, v1) of a part of the sheet, given in mm from the top left."""
    x, y, w, h = RECTS[name]
    width, height = SHEET
    return (x / width, 1 - (y + h) / height, (x + w) / width, 1 - y / height)


def build():
    model = Model("pasta_box")
    model.material("board", image="pasta.jpg", ks=0.04, ns=50)
    faces = {name: rect(name) for name in RECTS if name not in ("flap", "tab")}
    x, y, z = SIZE
    model.add("box", box((x, y, z - FLAP), 0.001, "board", seg=1, uv=faces))
    # The outer flap lies on the top, its tongue shows at the front edge.
    r = rect("flap")
    edge = {
        "front": (r[0], r[1], r[2], r[1] + 0.002), "back": (r[0], r[3] - 0.002, r[2], r[3]),
        "left": (r[0], r[1], r[0] + 0.002, r[3]), "right": (r[2] - 0.002, r[1], r[2], r[3])
    }
    flap = box((x - 0.003, 0.045, FLAP + 0.0002), 0.0003, "board",
               uv={"top": r, "bottom": r, **edge})
    model.add("flap", flap.moved(y=0.0065, z=z - FLAP - 0.0002))
    model.images["pasta.jpg"] = draw_atlas()
    return model
