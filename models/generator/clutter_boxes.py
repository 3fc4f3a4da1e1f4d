"""Printed folding boxes: cereal and tea."""

import math

from .canvas import Canvas, linear, picture
from .food import berry, flake, grain_of, heap
from .mesh import Model
from .noise import rng
from .prints import ean13, halftone, nutrition, recycling, seal, stamp, sunburst
from .relief import leaf
from .shapes import box
from .surfaces import mottled


def sheet_rects(x, y, z):
    """Unfolded box in mm: front, right, back, left in a strip, top and bottom above it."""
    return {
        "front": (0, y, x, z), "right": (x, y, y, z), "back": (x + y, y, x, z),
        "left": (2 * x + y, y, y, z), "top": (0, 0, x, y), "bottom": (x + y, 0, x, y)
    }


def printed_box(name, size_mm, draw, px, material):
    x, y, z = size_mm
    rects = sheet_rects(x, y, z)
    width, height = 2 * (x + y), y + z
    c = Canvas(width, height, *px)
    draw(c, rects)
    model = Model(name)
    model.images[f"{name}.jpg"] = picture(mottled(c.array() * 0.955, 700 + x, 1.6, 1.6))
    model.material("board", image=f"{name}.jpg", **material)
    uv = {
        k: (a / width, 1 - (b + h) / height, (a + w) / width, 1 - b / height)
        for k, (a, b, w, h) in rects.items()
    }
    model.add("box", box((x / 1000, y / 1000, (z - 0.6) / 1000), 0.0012, "board", seg=2, uv=uv))
    a = uv["top"]
    cut = 0.72
    u = {"top": (a[0], a[1], a[2], a[1] + (a[3] - a[1]) * cut)}
    lip = {
        k: (a[0] + 0.01, a[1] + 0.01, a[2] - 0.01, a[1] + 0.02)
        for k in ("front", "back", "left", "right", "bottom")
    }
    flap = box(((x - 2.6) / 1000, y * cut / 1000, 0.0009), 0.0004, "board", uv={**u, **lip})
    model.add("flap", flap.moved(y=-y * (1 - cut) / 2000 + 0.0005, z=(z - 0.9) / 1000))
    return model


CEREAL_ROWS = [("Energy", "1 590 kJ", "636 kJ"), ("", "377 kcal", "151 kcal"),
               ("Fat", "3.9 g", "1.6 g"), ("- of which saturates", "0.7 g", "0.3 g"),
               ("Carbohydrate", "72 g", "29 g"), ("- of which sugars", "14 g", "5.6 g"),
               ("Fibre", "8.2 g", "3.3 g"), ("Protein", "9.4 g", "3.8 g"),
               ("Salt", "0.6 g", "0.2 g")]


def bowl_art():
    r = heap(760, 1080, lambda g, k: flake(g.uniform(58, 84), k), 150, 110, 710, "#8a5a26", 9)
    random = rng(711)
    for k in range(14):
        r.put(random.uniform(40, 1040), random.uniform(60, 700), 62,
              berry(random.uniform(40, 54), 712 + k), 60)
    r.put(620, 260, 190, leaf(170, 80, 30, 730), 110)
    r.put(610, 265, 190, leaf(160, 76, 130, 731), 112)
    return r.picture(2, depth=40, ambient=0.62)


def draw_cereal(c, rects):
    art = bowl_art()
    for name in ("front", "back", "right", "left", "top", "bottom"):
        x, y, w, h = rects[name]
        c.rect(x, y, w, h, linear(x, y, x, y + h, (0, "#6a4b8a"), (0.55, "#8b6aa8"),
                                  (1, "#e9c98f")))
    for name in ("front", "back"):
        x, y, w, h = rects[name]
        mid = x + w / 2
        with c.clipped(x, y, w, h):
            sunburst(c, mid, y + 100, 320, 44, (1, 0.95, 0.85, 0.10))
            halftone(c, x, y + 130, w, 80, 3, lambda u, v: 0.8 * v, (1, 0.93, 0.75, 0.35))
            if name == "front":
                c.ellipse(mid, y + 218, 112, 74, (0.2, 0.1, 0.15, 0.4))
                c.ellipse(mid, y + 212, 110, 72, "#f4efe4")
                c.cr.save()
                c.cr.translate(mid, y + 200)
                c.cr.scale(100, 55)
                c.cr.arc(0, 0, 1, 0, 2 * math.pi)
                c.cr.restore()
                c.cr.save()
                c.cr.clip()
                c.paste(art, mid - 102, y + 143, 204, 116)
                c.cr.restore()
                c.ellipse(mid, y + 200, 100, 55, None, (0.25, 0.15, 0.1, 0.4), 2)
                c.ellipse(mid, y + 200, 102, 57, None, "#fbf8f0", 3)
    x, y, w, h = rects["front"]
    mid = x + w / 2
    with c.at(mid, y + 62, -5):
        for dx, fill in ((1.4, (0.15, 0.05, 0.2, 0.5)), (0, "#fdf3d8")):
            c.text(dx, dx, "Hullaba", 51, "lobster", fill, "c", bold=True,
                   stroke=None if dx else "#4a2f66", width=3)
            c.text(dx, 36 + dx, "Loops & Flakes", 23, "brush", fill if dx else "#f3c25a", "c")
    c.text(x + 8, y + 14, "WHOLE GRAIN", 6.2, "black", "#fdf3d8", tracking=0.5)
    c.text(x + w - 8, y + 14, "with wild blueberries", 6.4, "hand", "#fdf3d8", "r")
    seal(c, x + w - 28, y + 125, 19, "HIGH IN FIBRE", "8 g\nFIBRE", "PER 100 GRAMS", fill="#c8452e")
    c.text(x + 8, y + h - 8, "375 g e", 11, "black", "#4a2f66")
    c.text(x + w - 8, y + h - 8, "serving suggestion", 4, "sans", "#4a2f66", "r", italic=True)
    x, y, w, h = rects["back"]
    c.rect(x + 10, y + 58, w - 20, h - 74, (0.99, 0.96, 0.9, 0.96), r=6)
    c.text(x + w / 2, y + 40, "The great breakfast maze", 15, "brush", "#fdf3d8", "c")
    random = rng(740)
    n, cell = 15, 8.8
    x0, y0 = x + w / 2 - n * cell / 2, y + 72
    for r in range(n):
        for k in range(n):
            if random.uniform(0, 1) < 0.5:
                c.line(x0 + k * cell, y0 + r * cell, x0 + (k + 1) * cell, y0 + r * cell, "#4a2f66",
                       1.3)
            else:
                c.line(x0 + k * cell, y0 + r * cell, x0 + k * cell, y0 + (r + 1) * cell, "#4a2f66",
                       1.3)
    c.rect(x0, y0, n * cell, n * cell, None, "#4a2f66", 1.6)
    c.paragraph(
        x + 20, y + 220, w - 40,
        "Help the blueberry to the bowl! Then turn the box: on the side you will find three "
        "more puzzles, a riddle about a clock and the answer to last month's crossword.", 5.2,
        "round", fill="#4a2f66")
    for name in ("right", "left"):
        x, y, w, h = rects[name]
        c.text(x + w / 2, y + 22, "Hullaba", 15, "lobster", "#fdf3d8", "c", bold=True)
        c.rect(x + 4, y + 34, w - 8, h - 42, "#fbf6ea", r=3)
        if name == "right":
            b = nutrition(c, x + 6, y + 38, w - 12, CEREAL_ROWS, per=("100 g", "40 g"), size=2.7,
                          head="#4a2f66")
            b = c.paragraph(
                x + 6, b + 6, w - 12,
                "Ingredients: whole oats 48 %, wheat, maize, cane sugar, freeze-dried "
                "blueberries 6 %, barley "
                "malt, salt, vitamins (niacin, B6, B2, B1, folic acid).", 3.0, "sans",
                fill="#3a2c40")
            ean13(c, x + 7, y + h - 40, w - 14, 26, "760221134455")
        else:
            for k in range(4):
                yy = y + 48 + 48 * k
                c.circle(x + w / 2, yy + 10, 14, ("#e9c98f", "#8b6aa8", "#c8452e", "#6a8a4b")[k])
                c.text(x + w / 2, yy + 15, "?!&#"[k], 20, "black", "#fbf6ea", "c")
                c.paragraph(x + 7, yy + 30, w - 14,
                            ("What has hands but cannot clap?", "Count the flakes on the front.",
                             "Which loop is the odd one out?", "Rhyme a word with orange.")[k], 3.4,
                            "round")
            recycling(c, x + w / 2, y + h - 22, 6, "#4a2f66", "21", "PAP")
    x, y, w, h = rects["top"]
    c.text(x + w / 2, y + h * 0.62, "Hullaba", 26, "lobster", "#fdf3d8", "c", bold=True)
    stamp(c, x + w - 60, y + h - 7, "BB 02 2028 L77", 4.5, 741, "#f4ead0")


def cereal_box():
    return printed_box("cereal_box", (190, 60, 280), draw_cereal, (2048, 1024),
                       {"ks": 0.04, "ns": 70})


def draw_tea(c, rects):
    art = heap(
        500, 700, lambda g, k: grain_of(
            g.uniform(50, 110), g.uniform(9, 16), g.uniform(0, 360), k,
            *(("#4d4a26", "#23210f"), ("#5a3d22", "#2a1a0e"), ("#7a8a45", "#3b4a1e"))[k % 3]), 420,
        60, 750, "#2c2412", 5).picture(2, depth=20, ambient=0.7)
    for name, (x, y, w, h) in rects.items():
        c.rect(x, y, w, h, "#20463f")
        for k in range(int(h / 4) + 1):
            for j in range(int(w / 4) + 1):
                c.circle(x + 4 * j + 2 * (k % 2), y + 4 * k, 0.45, (0.85, 0.75, 0.45, 0.35))
    for name in ("front", "back"):
        x, y, w, h = rects[name]
        mid = x + w / 2
        c.rect(x + 5, y + 5, w - 10, h - 10, "#efe5c9", "#c9a24d", 1.0, r=2)
        c.rect(x + 7, y + 7, w - 14, h - 14, None, "#20463f", 0.4, r=1)
        c.text(mid, y + 22, "Kirsehan", 15, "lobster", "#20463f", "c", bold=True)
        c.text(mid, y + 28.5, "TEA MERCHANTS · EST. 1887", 3.2, "heavy", "#a3672a", "c",
               tracking=0.4)
        if name == "front":
            with c.clipped(x + 14, y + 33, w - 28, 34, 3):
                c.paste(art, x + 14, y + 33, w - 28, (w - 28) * 500 / 700)
            c.rect(x + 14, y + 33, w - 28, 34, None, "#c9a24d", 0.8, r=3)
            c.text(mid, y + 77, "MOUNTAIN GREEN", 9.2, "display", "#20463f", "c", bold=True,
                   tracking=1)
            c.text(mid, y + 83, "with lemon verbena", 5, "serif", "#a3672a", "c", italic=True)
            c.text(mid, y + 89, "20 bags · 40 g e", 3.6, "heavy", "#20463f", "c")
        else:
            c.paragraph(
                x + 14, y + 37, w - 28,
                "Grown above the mist line, withered in bamboo trays and rolled by hand. "
                "One bag per cup, water "
                "just off the boil, two to three minutes: the liquor is pale gold and smells "
                "of hay and lemon.", 3.5, "serif", fill="#2a3a34")
            ean13(c, x + 14, y + 68, 34, 20, "690112358132")
            recycling(c, x + w - 28, y + 76, 5, "#20463f", "21", "PAP")
    for name in ("right", "left"):
        x, y, w, h = rects[name]
        c.rect(x + 4, y + 5, w - 8, h - 10, "#efe5c9", "#c9a24d", 0.8, r=2)
        for k, (t, word) in enumerate(
            (("80 °C", "water"), ("2–3 min", "patience"), ("1 bag", "per cup"))):
            yy = y + 20 + 24 * k
            c.text(x + w / 2, yy, t, 7.4, "slab", "#20463f", "c", bold=True)
            c.text(x + w / 2, yy + 6, word, 4.4, "serif", "#a3672a", "c", italic=True)
            c.line(x + 12, yy + 10, x + w - 12, yy + 10, "#c9a24d", 0.4)
    for name in ("top", "bottom"):
        x, y, w, h = rects[name]
        c.text(x + w / 2, y + h * 0.5, "Kirsehan", 17, "lobster", "#e2c980", "c", bold=True)
        c.text(x + w / 2, y + h * 0.66, "MOUNTAIN GREEN", 4, "heavy", "#e2c980", "c", tracking=0.5)


def tea_box():
    return printed_box("tea_box", (110, 62, 95), draw_tea, (1024, 512), {"ks": 0.04, "ns": 80})
