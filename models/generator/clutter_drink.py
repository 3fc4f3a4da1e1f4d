"""Mug, cans."""

import numpy as np

from .canvas import Canvas
from .mesh import Model
from .shapes import tube, turned


def mug_print():
    c = Canvas(256, 96, 1024, 512, "#ece7dc")
    c.text(128, 55, "good morning", 22, "brush", "#20343c", "c")
    return c.image()


def mug():
    model = Model("mug")
    model.images["mug.jpg"] = mug_print()
    model.material("glaze", image="mug.jpg", ks=0.05, ns=350)
    model.material("inside", kd=(0.78, 0.76, 0.71), ks=0.05, ns=350)
    model.material("coffee", kd=(0.02, 0.009, 0.004), ks=0.04, ns=800)
    outer = [(0, 0.003), (0.029, 0.003), (0.030, 0), (0.0345, 0), (0.0405, 0.006), (0.041, 0.096),
             (0.0385, 0.096)]
    inner = [(0.0375, 0.096), (0.0375, 0.07)]
    wall = turned(outer + inner + [(0.0365, 0.008), (0, 0.008)],
                  [0, 0.001, 0.001, 0.002, 0.006, 0.0013, 0.0013, 0.0, 0.001, 0.006, 0], "glaze",
                  seg=48, bevel_seg=3)
    model.add("body", wall)
    t = np.radians(np.linspace(-98, 98, 17))
    path = np.column_stack([0.036 + 0.030 * np.cos(t), 0 * t, 0.05 + 0.031 * np.sin(t)])
    handle = tube(path, 0.0055, "inside", seg=12).scaled(1, 1.25, 1)
    model.add("handle", handle)
    model.add("coffee", turned([(0, 0.06), (0.0372, 0.06), (0.0372, 0.072), (0, 0.072)], 0, "coffee",
                               seg=32))
    return model
