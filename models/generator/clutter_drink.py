"""Mug and two cans."""

import math

import numpy as np

from .canvas import Canvas, linear, picture
from .food import basil, tomato
from .mesh import Model, join
from .noise import rng
from .prints import ean13, halftone, nutrition, recycling
from .relief import Relief
from .shapes import tube, turned
from .surfaces import mottled


def pull_ring(mat, r):
    """Flattened ring with its nose and rivet, lying on a lid; the nose points to the front."""
    t = np.linspace(0, 2 * math.pi, 20, endpoint=False)
    ring = tube(np.column_stack([r * np.cos(t), 1.15 * r * np.sin(t), 0 * t]), r * 0.2, mat, seg=8,
                closed=True)
    nose = tube([(0, -0.9 * r, 0), (0, -1.9 * r, 0)], 0.62 * r, mat, seg=10).scaled(1, 1, 0.25)
    rivet = turned([(0, -0.002), (0.3 * r, -0.002), (0.3 * r, 0.0012), (0, 0.0014)],
                   [0, 0, 0.0005, 0], mat, seg=12)
    return join(ring.scaled(1, 1, 0.55), nose, rivet.moved(y=-1.5 * r))


def mug_print():
    """256 x 96 mm around the mug: stoneware glaze, speckles, a drawn harbour."""
    c = Canvas(256, 120, 1024, 512, "#dcd5c6")
    random = rng(601)
    c.rect(0, 0, 256, 18, "#2f5566")
    c.curve([(0, 18), (30, 20), (70, 17), (120, 21), (170, 17.5), (215, 20), (256, 18), (256, 0),
             (0, 0)], "#2f5566", closed=True)
    for k in range(3):
        c.curve([(x, 84 + 6 * k + 2.4 * math.sin(x / 7 + 2 * k)) for x in range(-6, 264, 6)], None,
                "#2f5566", 1.0)
    for x, s in ((62, 1.0), (128, 1.35), (196, 0.9)):
        c.poly([(x - 17 * s, 74), (x + 17 * s, 74), (x + 12 * s, 82), (x - 12 * s, 82)], "#b5452f")
        c.poly([(x, 71), (x, 71 - 34 * s), (x + 15 * s, 71)], "#2f5566")
        c.poly([(x - 1.5, 71), (x - 1.5, 71 - 27 * s), (x - 12 * s, 71)], "#d9a441")
    for _ in range(900):
        c.circle(random.uniform(0, 256), random.uniform(0, 120), random.uniform(0.1, 0.5),
                 (0.32, 0.22, 0.14, random.uniform(0.15, 0.6)))
    return picture(mottled(c.array(), 602, 0.8, 2.0))


def mug():
    model = Model("mug")
    model.images["mug.jpg"] = mug_print()
    model.material("glaze", image="mug.jpg", ks=0.05, ns=350)
    model.material("inside", kd=(0.68, 0.64, 0.55), ks=0.05, ns=350)
    model.material("coffee", kd=(0.035, 0.014, 0.006), ks=0.04, ns=800)
    outer = [(0, 0.003), (0.029, 0.003), (0.030, 0), (0.0345, 0), (0.0405, 0.006), (0.041, 0.096),
             (0.0385, 0.096)]
    inner = [(0.0375, 0.07), (0.0365, 0.008), (0, 0.008)]
    wall = turned(outer + inner, [0, 0.001, 0.001, 0.002, 0.006, 0.0013, 0.0013, 0.001, 0.006, 0],
                  "glaze", seg=40, bevel_seg=3)
    r, z = np.hypot(wall.p[:, 0], wall.p[:, 1]), wall.p[:, 2]
    wall.uv[:, 1] = z / 0.12 + 0.14
    wall.mats = [
        "inside" if np.all(r[list(f)] < 0.0392) and np.all(z[list(f)] > 0.006) else "glaze"
        for f in wall.faces
    ]
    t = np.radians(np.linspace(-100, 100, 15))
    path = np.column_stack([0.037 + 0.029 * np.cos(t), 0 * t, 0.05 + 0.031 * np.sin(t)])
    model.add("body", wall)
    model.add("handle", tube(path, 0.0052, "inside", seg=12).scaled(1, 1.35, 1))
    model.add("coffee",
              turned([(0, 0.06), (0.0373, 0.06), (0.0373, 0.074), (0, 0.074)], 0, "coffee", seg=32))
    return model


def tomato_print():
    """232 x 100 mm around a tin."""
    c = Canvas(232, 100, 1024, 512, "#f3ead2")
    c.rect(0, 0, 232, 100, linear(0, 0, 0, 100, (0, "#b8301f"), (0.62, "#a3271a"), (1, "#7d1b14")))
    r = Relief(560, 900)
    for k, (x, y, s) in enumerate(
        ((260, 300, 170), (640, 310, 165), (450, 360, 190), (160, 440, 110), (750, 440, 115))):
        r.put(x, y, s * 1.1, tomato(s, 610 + k), 40 * k)
    basil(r, 450, 190, 150, 620)
    fruit = r.picture(2, ambient=0.6)
    for x in (58, 174):
        c.ellipse(x, 34, 45, 25, "#f3ead2", "#d9a441", 1.4)
        c.ellipse(x, 34, 42.5, 22.6, None, "#2f6b35", 0.6)
        c.text(x, 37, "Ortolana", 19, "lobster", "#2f6b35", "c", bold=True)
        c.text(x, 46.5, "POMODORI PELATI", 5.4, "heavy", "#a3271a", "c", tracking=0.5)
        c.text(x, 22, "dal 1908", 4, "serif", "#7d1b14", "c", italic=True)
        c.paste(fruit, x - 33, 55, 66, 41)
        c.text(x + 30, 94, "400 g e", 6, "black", "#f3ead2")
    c.rect(104, 0, 24, 100, "#f3ead2")
    c.rect(218, 0, 14, 100, "#f3ead2")
    c.rect(0, 0, 6, 100, "#f3ead2")
    with c.at(107, 96, -90):
        nutrition(c, 0, 0, 52, [("Energy", "98 kJ", "392 kJ"), ("Fat", "0.2 g", "0.8 g"),
                                ("Carbohydrate", "3.6 g", "14 g"), ("Protein", "1.1 g", "4.4 g"),
                                ("Salt", "0.05 g", "0.2 g")], size=1.9, head="#a3271a",
                  per=("100 g", "400 g"))
        c.paragraph(56, 4, 36,
                    "Whole peeled tomatoes in juice. After opening move to a bowl and chill.", 2.4)
        recycling(c, 82, 16, 3.6, "#2f6b35", "40", "FE")
    with c.at(220, 92, -90):
        ean13(c, 0, 0, 32, 10, "805432109876")
        c.text(40, 6, "BB 03 2029  L 118", 3.4, "mono", "#333333")
    for y in (2, 97):
        c.rect(0, y, 232, 1, "#d9a441")
    return picture(mottled(c.array() * 0.96, 621, 1.4, 1.4))


def can_tomato():
    model = Model("can_tomato")
    model.images["label.jpg"] = tomato_print()
    model.material("label", image="label.jpg", ks=0.04, ns=90)
    model.material("tin", kd=(0.42, 0.41, 0.39), ks=0.35, ns=140)
    r, h = 0.037, 0.110
    base = [(0, 0.003), (r - 0.003, 0.003), (r - 0.002, 0), (r + 0.0008, 0), (r + 0.0008, 0.003),
            (r - 0.0006, 0.0042), (r - 0.0006, 0.006)]
    lid = [(a, h - b) for a, b in base[::-1]]
    tin = turned(base + lid, [0, 0.001, 0.0008, 0.0009, 0.0008, 0.0005, 0] +
                 [0, 0.0005, 0.0008, 0.0009, 0.0008, 0.001, 0], "tin", seg=40)
    ribs = [(r - 0.0004, 0.0055)]
    for k in range(13):
        ribs.append((r - 0.0001 - (0.0007 if k % 4 == 2 else 0), 0.032 + 0.046 * k / 12))
    ribs.append((r - 0.0004, h - 0.0055))
    inner = [(r - 0.003, 0.0055), (r - 0.003, h - 0.0055)]
    ring = turned(inner[:1] + ribs + inner[1:] + inner[:1], [0] + [0.002] * len(ribs) + [0, 0],
                  "label", seg=40, bevel_seg=1)
    ring.uv[:, 0] -= 0.25  # one of the two emblems in front
    ring.uv[:, 1] = (ring.p[:, 2] - 0.005) / 0.1
    rings = [
        turned([(q, h - 0.0035), (q + 0.0012, h - 0.0022), (q + 0.0024, h - 0.0035),
                (q, h - 0.0035)], [0, 0.001, 0, 0], "tin", seg=32, bevel_seg=1)
        for q in (0.012, 0.024)
    ]
    model.add("tin", tin)
    model.add("label", ring)
    model.add("lid", pull_ring("tin", 0.0095).moved(y=0.012, z=h - 0.0016), *rings)
    return model


def soda_print():
    """208 x 110 mm around a drinks can."""
    c = Canvas(208, 110, 1024, 512, "#1c6f6a")
    c.rect(0, 0, 208, 110, linear(0, 0, 0, 110, (0, "#2f9a8c"), (0.55, "#1c6f6a"), (1, "#104748")))
    for x in (0, 104, 208):
        halftone(c, x - 52, 30, 104, 80, 2.6, lambda u, v: 0.8 * v * (1 - abs(2 * u - 1)),
                 (0.95, 0.9, 0.55, 0.35), 30)
    for x in (52, 156):
        c.curve([(x - 52, 78), (x - 20, 60), (x + 18, 84), (x + 52, 62), (x + 52, 90),
                 (x + 10, 104), (x - 30, 84), (x - 52, 100)], "#e9d64f", closed=True)
        with c.at(x, 56, -12):
            c.text(1.2, 1.4, "Zitro!", 42, "brush", (0, 0.1, 0.1, 0.5), "c")
            c.text(0, 0, "Zitro!", 42, "brush", "#f7f3df", "c", stroke="#104748", width=1.2)
        c.text(x, 75, "SPARKLING LIME & MINT", 5.6, "black", "#104748", "c", tracking=0.4)
        c.text(x - 30, 22, "330 ml", 6, "black", "#e9d64f", "c")
        c.text(x + 32, 22, "zero sugar", 6, "hand", "#e9d64f", "c")
        for k, (dx, dy, r) in enumerate(((-34, 40, 7), (36, 38, 8), (30, 94, 10), (-38, 96, 8))):
            c.circle(x + dx, dy, r, "#8fbf4a", "#dcebb0", 0.9)
            for j in range(8):
                a = math.pi * j / 4 + k
                c.line(x + dx, dy, x + dx + r * 0.8 * math.cos(a), dy + r * 0.8 * math.sin(a),
                       "#dcebb0", 0.7)
    with c.at(98, 104, -90):
        c.rect(0, 0, 92, 12, (0.06, 0.25, 0.25, 0.6))
        c.paragraph(
            2, 3.4, 52,
            "Carbonated water, lime juice 4 %, mint extract, citric acid. Serve ice cold. "
            "Per can: 25 kJ, 6 kcal, salt 0.02 g.", 2.2, fill="#e6efe6")
        ean13(c, 58, 1, 32, 10, "541234567890")
    random = rng(630)
    for _ in range(420):  # cold mist
        x, y, r = random.uniform(0, 208), random.uniform(0, 110), random.uniform(0.2, 0.9)
        c.circle(x, y, r, (0.9, 0.97, 0.95, 0.28))
        c.circle(x - 0.2 * r, y - 0.3 * r, 0.4 * r, (1, 1, 1, 0.5))
    return picture(mottled(c.array() * 0.93, 631, 0.8, 0.8))


def can_soda():
    model = Model("can_soda")
    model.images["print.jpg"] = soda_print()
    model.material("print", image="print.jpg", ks=0.12, ns=160)
    model.material("metal", kd=(0.45, 0.45, 0.46), ks=0.4, ns=180)
    model.material("dark", kd=(0.02, 0.02, 0.02), ks=0.02, ns=10)
    lower = [(0, 0.011), (0.018, 0.008), (0.0235, 0.0), (0.0255, 0.0), (0.0325, 0.0105)]
    upper = [(0.0330, 0.0130), (0.0330, 0.0985), (0.0275, 0.1105)]
    rim = [(0.0268, 0.1130), (0.0278, 0.1150), (0.0262, 0.1150), (0.0250, 0.1105), (0, 0.1112)]
    model.add(
        "bottom",
        turned(lower + [(0.0330, 0.0130), (0, 0.0131)], [0, 0.004, 0.001, 0.001, 0.004, 0, 0],
               "metal", seg=40))
    wall = turned([(0, 0.0129)] + upper + [(0, 0.1106)], [0, 0.0008, 0.01, 0.0004, 0], "print",
                  seg=40, bevel_seg=4)
    wall.uv[:, 0] -= 0.25
    wall.uv[:, 1] = (wall.p[:, 2] - 0.012) / 0.1
    model.add("wall", wall)
    model.add(
        "lid",
        turned([(0, 0.110), (0.0272, 0.1102)] + rim, [0, 0.0004, 0.0006, 0.0008, 0.0007, 0.0015, 0],
               "metal", seg=40))
    mouth = turned([(0, 0.1110), (0.0085, 0.1110), (0.0085, 0.11135), (0, 0.11135)], 0, "dark",
                   seg=20).scaled(1, 1.15, 1)
    model.add("opener", mouth.moved(y=-0.0125), pull_ring("metal", 0.0072).moved(y=0.006, z=0.1122))
    return model
