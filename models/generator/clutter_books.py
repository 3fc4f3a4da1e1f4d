"""Stack of books."""

from .canvas import Canvas
from .mesh import Model
from .shapes import box


def book_stack():
    model = Model("book_stack")
    c = Canvas(300, 300, 1024, 1024, "#b8a88a")
    model.images["covers.jpg"] = c.image()
    model.material("cover", image="covers.jpg", ks=0.04, ns=60)
    z = 0.0
    for k, (w, d, h, turn) in enumerate(((0.24, 0.17, 0.03, 3), (0.21, 0.15, 0.024, -6),
                                         (0.19, 0.13, 0.018, 9))):
        model.add(f"book{k}", box((w, d, h), 0.0012, "cover").rotated("z", turn).moved(z=z))
        z += h
    return model
