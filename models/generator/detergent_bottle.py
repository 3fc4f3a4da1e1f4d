"""Moulded bottle with a through-handle; all but textureless, one small label."""

import numpy as np

from .canvas import Canvas, linear, picture
from .implicit import smooth_max, smooth_min, split_views, surface_net
from .mesh import Model
from .prints import ean13
from .shapes import turned
from .surfaces import mottled

SHOULDER = 0.205  # where the neck begins
NECK_X = 0.018
# The texture shows the bottle from the front, from the back and from the side (y, z).
SHEET = (512, 512)
VIEW = (0.17, 0.26)  # metres covered by a view
BASE = "#c9d6d3"


def superellipse(x, y, a, b, power):
    return ((np.abs(x) / a)**power + (np.abs(y) / b)**power)**(1 / power)


def profile(z):
    """Half width, half depth and middle of the cross section at the height z."""
    knots = np.array([0.0, 0.02, 0.06, 0.10, 0.14, 0.17, 0.19, 0.205, 0.24])
    width = np.array([0.069, 0.0735, 0.0748, 0.0735, 0.071, 0.066, 0.056, 0.040, 0.02])
    depth = np.array([0.040, 0.0437, 0.0448, 0.0437, 0.0415, 0.0385, 0.0335, 0.026, 0.02])
    middle = np.array([0.0, 0.0, 0.0, 0.0, 0.0, 0.001, 0.005, 0.011, 0.018])

    def smooth(values):
        offsets = np.linspace(-0.015, 0.015, 7)
        return sum(np.interp(z + o, knots, values) for o in offsets) / 7

    return smooth(width), smooth(depth), smooth(middle)


def body(p):
    """Negative inside: lofted superellipses, with the grip hole and a waist about the label."""
    x, y, z = p.T
    a, b, m = profile(z)
    d = (superellipse(x - m, y, a, b, 3.0) - 1) * b
    d = smooth_max(d, -z, 0.012)
    d = smooth_max(d, z - SHOULDER, 0.016)
    neck = np.maximum(np.hypot(x - NECK_X, y) - 0.019, np.abs(z - 0.2) - 0.026)
    d = smooth_min(d, neck, 0.014)
    # The grip: an upright slot through the bottle near its left side.
    across, along = x + 0.0355 + 0.08 * (z - 0.14), np.clip(z, 0.112, 0.162)
    slot = np.sqrt(across**2 + (z - along)**2) - 0.0115
    d = smooth_max(d, -slot, 0.017)
    # Base panel pressed in a little on both faces.
    panel = np.maximum(superellipse(x - 0.006, z - 0.058, 0.047, 0.043, 5.0) - 1, 0)
    face = np.abs(y) - (b - 0.0014 + 6 * panel * 0.01)
    return smooth_max(d, face, 0.004)


def texture():
    c = Canvas(VIEW[0] * 2000, VIEW[1] * 1000 * 2, 1024, 2048, BASE)
    w, h = VIEW[0] * 1000, VIEW[1] * 1000
    label(c, w / 2 + 6, h - 58)
    # The mould line on the side view.
    c.rect(w / 2 - 0.22, h, 0.44, h, (0.36, 0.42, 0.42, 0.5))
    c.rect(w / 2 + 0.22, h, 0.25, h, (1, 1, 1, 0.4))
    c.text(w * 1.5, h - 14, "2 PE-HD", 4, "heavy", (0.3, 0.4, 0.4, 0.25), "c")
    array = mottled(c.array(), 91, ink=0.5, paper=0.8)
    return picture(array).resize((512, 1024), 1)


def label(c, x, y):
    """Oval-cornered sticker, 76 x 62 mm about (x, y)."""
    with c.clipped(x - 38, y - 31, 76, 62, 8):
        c.rect(x - 38, y - 31, 76, 62, linear(x, y - 31, x, y + 31, (0, "#2b7f8f"), (1, "#1b4f6b")))
        for k in range(14):
            px, py, r = x - 34 + (k * 37) % 70, y - 26 + (k * 53) % 50, 1.5 + (k * 7) % 5
            c.circle(px, py, r, (1, 1, 1, 0.10), (1, 1, 1, 0.35), 0.3)
        c.curve([(x - 40, y + 14), (x - 12, y + 6), (x + 14, y + 15), (x + 40, y + 5),
                 (x + 40, y + 33), (x - 40, y + 33)], "#f2f4ee", closed=True)
    c.text(x, y - 4, "Brisa", 27, "lobster", "#f6f7f0", "c", bold=True)
    c.text(x, y + 3, "SEA BREEZE", 5.0, "black", "#bfe3e4", "c", tracking=0.8)
    c.text(x - 32, y + 20.5, "40 washes", 6.4, "black", "#1b4f6b")
    c.text(x - 32, y + 25.5, "1.6 L e · liquid laundry care", 3.1, "medium", "#1b4f6b")
    ean13(c, x + 12, y + 15, 21, 12, "590123412345")


def cap():
    profile_rz = [(0, 0.212), (0.0215, 0.212), (0.0215, 0.220), (0.0196, 0.222), (0.0185, 0.247),
                  (0.0165, 0.25), (0.0150, 0.2485), (0, 0.2475)]
    return turned(profile_rz, [0, 0.001, 0.001, 0.001, 0.002, 0.0012, 0.001, 0], "cap", seg=40,
                  bevel_seg=3).moved(x=NECK_X)


def build():
    model = Model("detergent_bottle")
    model.images["bottle.png"] = texture()
    model.material("plastic", image="bottle.png", ks=0.04, ns=140)
    model.material("cap", kd=(0.02, 0.16, 0.25), ks=0.04, ns=220)
    skin = surface_net(body, (-0.08, -0.05, -0.005), (0.08, 0.05, 0.235), 0.0053, "plastic")
    model.add("bottle", split_views(skin, VIEW))
    model.add("cap", cap())
    return model
