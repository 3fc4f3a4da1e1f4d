"""The printed sheet of the juice carton, unfolded: front, right, back, left."""

import math
from functools import lru_cache

from .canvas import Canvas, linear, mix, picture, radial
from .noise import rng
from .prints import (bin_mark, droplets, ean13, estimated_sign, halftone, intake, matrix_code,
                     nutrition, recycling, ring_text, seal, stamp, sunburst)
from .relief import Relief, ball, citrus_slice, leaf
from .surfaces import mottled

# Millimetres. `roll`: strip below the bottom edge; `edge`: a spot of plain board colour;
# `cap`: x, y, width, height of the cap's artwork, at half scale.
ATLAS = {
    "width": 400.0, "height": 272.0, "roll": 4.0, "edge": (396.0, 250.0),
    "cap": (384.0, 20.0, 15.0, 26.0)
}
PANEL, FOOT, FOLD, RIDGE, TOP = 95.57, 268.0, 90.0, 27.0, 7.0
GREEN, LEAF, ORANGE, DEEP = "#1f5a36", "#6a9f3c", "#ee8d22", "#d9690f"
CREAM, PALE, INK = "#fbf1da", "#f7dfae", "#3a2c1c"

NUTRITION = [("Energy", "188 kJ", "470 kJ"), ("", "45 kcal", "112 kcal"), ("Fat", "0.1 g", "0.3 g"),
             ("- of which saturates", "0 g", "0 g"), ("Carbohydrate", "10.1 g", "25 g"),
             ("- of which sugars", "8.9 g", "22 g"), ("Fibre", "0.4 g", "1.0 g"),
             ("Protein", "0.7 g", "1.8 g"), ("Salt", "0 g", "0 g"), ("Vitamin C", "32 mg", "80 mg"),
             ("Folate", "20 µg", "50 µg")]


@lru_cache(maxsize=None)
def art(name):
    """Small cut-outs that several panels use."""
    if name == "slice":
        return single(citrus_slice(215, 51), 220)
    if name == "orange":
        return single(ball(150, "#f59c22", "#df720f", 52, pores=1.3, stem=(0.25, 0.5)), 160)
    return single(leaf(250, 120, 45, 53), 190)


def fruit_group():
    """Whole orange, halves and leaves, 1500 x 1240 working pixels."""
    r = Relief(1240, 1560)
    r.put(1130, 420, 330, ball(300, "#f3971f", "#dd6f0d", 31, pores=1.5, stem=(-0.3, 0.5)))
    r.put(470, 430, 380, ball(350, "#f59c22", "#df720f", 32, pores=1.5, stem=(0.28, 0.6)), 60)
    for x, y, length, width, degrees, seed in ((560, 240, 330, 140, 34, 33),
                                               (565, 240, 300, 125, 140, 34), (1040, 270, 300, 120,
                                                                               62, 35)):
        r.put(x, y, 345, leaf(length, width, degrees, seed), 330)
    r.put(1010, 860, 380, citrus_slice(345, 36), 320)
    r.put(380, 900, 320, citrus_slice(285, 37, turn=0.6), 330)
    r.put(690, 1050, 200, leaf(300, 120, 8, 38), 420)
    r.put(690, 1050, 200, leaf(260, 110, 196, 39), 420)
    return r.picture(2)


def single(shape, half):
    r = Relief(2 * half, 2 * half)
    r.put(half, half, half, shape)
    return r.picture(2)


def logo(c, x, y, w, ink=GREEN, halo="#fdf8ea"):
    """Word mark with a rising sun; (x, y) is the centre of the baseline."""
    s = w / 80
    with c.clipped(x - 20 * s, y - 44 * s, 40 * s, 24.5 * s):
        sunburst(c, x, y - 19.5 * s, 20 * s, 26, (0.95, 0.62, 0.12, 1), 0, 0.5)
        c.circle(x, y - 19.5 * s, 13.6 * s, halo)
        c.circle(x, y - 19.5 * s, 12.2 * s,
                 linear(x, y - 32 * s, x, y - 19 * s, (0, "#f7b52c"), (1, "#ec7d17")))
    size = w / c.text_width("Solara", 1, "lobster", bold=True)
    c.text(x + 0.5 * s, y + 0.7 * s, "Solara", size, "lobster", (0.1, 0.15, 0.05, 0.35), "c",
           bold=True, stroke=(0.1, 0.15, 0.05, 0.25), width=3.2 * s)
    c.text(x, y, "Solara", size, "lobster", ink, "c", bold=True, stroke=halo, width=3.0 * s)
    c.curve([(x - 30 * s, y + 5.5 * s), (x - 5 * s, y + 7.6 * s), (x + 30 * s, y + 4 * s)], None,
            ink, 0.9 * s)


def sky(c, x, top, bottom):
    """Warm ground of the picture panels with rays and a halftone foot."""
    c.rect(x, top, PANEL, bottom - top,
           linear(0, top, 0, bottom, (0, "#fdf6e2"), (0.45, "#fbe3ac"), (1, "#f2a235")))
    with c.clipped(x, top, PANEL, bottom - top):
        sunburst(c, x + PANEL / 2, FOLD + 38, 190, 40, (1.0, 0.93, 0.72, 0.55), 2.0)


def front(c, x, fruit):
    mid = x + PANEL / 2
    sky(c, x, RIDGE, FOOT + 4)
    c.rect(x, TOP - 7, PANEL, RIDGE - TOP + 7, GREEN)
    roof(c, x)
    logo(c, mid, FOLD + 46, 78)
    c.rect(x, FOLD + 55, PANEL, 10.5, GREEN)
    c.rect(x, FOLD + 66.2, PANEL, 0.7, GREEN)
    c.fit(mid, FOLD + 62.9, 84, "ORANGE JUICE", "black", 8.2, fill="#fdf6e0", align="c",
          tracking=0.9)
    c.text(mid, FOLD + 71.5, "NOT FROM CONCENTRATE  ·  WITH TENDER PULP", 3.0, "heavy", GREEN, "c",
           tracking=0.12)
    halftone(c, x, 214, PANEL, 58, 2.1, lambda u, v: 0.75 * v * v, (0.85, 0.40, 0.05, 0.35))
    c.ellipse(mid, 251, 41, 5.5, (0.45, 0.18, 0.02, 0.38))
    c.paste(fruit, x + 5, 167, 86, 86 * 620 / 780)
    droplets(c, x + 12, 180, 72, 66, 46, 41, size=(0.4, 1.5))
    seal(c, x + 78, FOLD + 87, 13.2, "NO ADDED SUGAR", "100%\nSQUEEZED", "NATURALLY SWEET")
    c.rect(x, 255.5, PANEL, 16.5, GREEN)
    c.rect(x, 254.3, PANEL, 0.6, "#fdf6e0")
    c.text(x + 6, 264.6, "1 L", 8.6, "black", "#fdf6e0")
    estimated_sign(c, x + 21.5, 264.6, 8, "#fdf6e0")
    c.text(x + PANEL - 6, 261, "PASTEURISED · KEEP CHILLED 0–7 °C", 2.7, "heavy", "#fdf6e0", "r")
    c.text(x + PANEL - 6, 264.8, "shake gently before opening", 2.7, "sans", "#e9dcae", "r",
           italic=True)


def roof(c, x):
    """Roof panel with rays about the cap, and the fin's print above it."""
    mid = x + PANEL / 2
    c.rect(x, RIDGE - 0.5, PANEL, FOLD - RIDGE + 0.5,
           linear(0, RIDGE, 0, FOLD, (0, "#ea8a1e"), (1, "#f5b548")))
    with c.clipped(x, RIDGE, PANEL, FOLD - RIDGE):
        sunburst(c, mid, 61, 80, 32, (1, 0.87, 0.5, 0.45), 0.0)
    c.circle(mid, 60.8, 22, None, "#fdf6e0", 0.7)
    ring_text(c, mid, 60.8, 23.6, "TWIST TO OPEN  •  SHAKE WELL", 3.4, "black", "#fdf6e0", -90, 0.3)
    c.rect(x, FOLD - 5.5, PANEL, 5.5, GREEN)
    c.rect(x, FOLD - 6.6, PANEL, 0.6, "#fdf6e0")
    text = "SUN-RIPENED  •  HAND-PICKED  •  COLD-PRESSED"
    c.text(mid, FOLD - 1.7, text, 3.1, "heavy", "#fdf6e0", "c", tracking=0.25)


def right(c, x):
    """Facts: nutrition, ingredients, bar code."""
    c.rect(x, 0, PANEL, 272, "#fbf3df")
    gusset(c, x)
    c.rect(x, FOLD, PANEL, 15, GREEN)
    c.text(x + 7, FOLD + 10, "What's inside", 8.5, "lobster", "#fdf6e0", bold=True)
    c.paste(art("slice"), x + 72, FOLD + 1.5, 22, 22)
    y = nutrition(c, x + 6, FOLD + 21, PANEL - 12, NUTRITION, head=GREEN, ink=INK, size=3.25)
    c.text(x + 6, y + 3.6, "A carton holds about 4 servings of 250 ml. *Reference intake of an "
           "average adult", 1.75, "sans", INK)
    intake(c, x + 6, y + 6, PANEL - 12, [("ENERGY", "470 kJ", "6%"), ("FAT", "0.3 g", "<1%"),
                                         ("SUGARS", "22 g", "24%"), ("SALT", "0 g", "0%"),
                                         ("VIT. C", "80 mg", "100%")], ORANGE)
    y = c.paragraph(
        x + 6, y + 28, PANEL - 12, "INGREDIENTS: orange juice (98 %), orange pulp (2 %). "
        "Juice content 100 %. Contains naturally occurring sugars only.", 2.8, "medium", fill=INK)
    y = c.paragraph(
        x + 6, y + 1.2, PANEL - 12, "Packed in a protective atmosphere. Once opened keep "
        "refrigerated and use within five days. Natural separation may occur: it is a "
        "sign of quality, simply shake.", 2.35, "sans", fill="#5a4a36")
    ean13(c, x + 6, 229, 41, 26, "402614893307")
    recycling(c, x + 60, 240, 6.6, GREEN)
    bin_mark(c, x + 74, 246, 13, GREEN)
    c.text(x + 88, 246, "e", 11, "black", GREEN, "c")
    c.paragraph(x + 51, 254, 42, "Solara Fruit Co-operative, 14 Quay Road, Port Amber. "
                "Care line 0800 555 0142", 1.8, "sans", fill=INK)
    c.rect(x, 260, PANEL, 12, ORANGE)
    c.text(x + 6, 266, "PLEASE FLATTEN · CAP ON · RECYCLE", 3.1, "black", "#fdf6e0", tracking=0.2)


def gusset(c, x):
    """Folded-in side of the gable: plain colour with fold lines."""
    mid = x + PANEL / 2
    c.rect(x, 0, PANEL, FOLD, linear(0, RIDGE, 0, FOLD, (0, "#f3b75a"), (1, "#ee9a35")))
    random = rng(71)
    for k in range(9):
        px, py = x + random.uniform(8, 88), random.uniform(RIDGE + 4, FOLD - 5)
        with c.at(px, py, random.uniform(0, 360), random.uniform(0.6, 1.0)):
            c.circle(0, 0, 5, None, (1, 0.95, 0.8, 0.55), 0.7)
            for j in range(8):
                a = math.pi * j / 4
                c.line(1.0 * math.cos(a), 1.0 * math.sin(a), 4.2 * math.cos(a), 4.2 * math.sin(a),
                       (1, 0.95, 0.8, 0.5), 0.5)
    for px in (x, x + PANEL):
        c.line(px, FOLD, mid, RIDGE, (0.45, 0.2, 0.02, 0.35), 0.5)


def back(c, x):
    """Story panel over a wall of slices."""
    mid = x + PANEL / 2
    c.rect(x, 0, PANEL, 272, GREEN)
    roof(c, x)
    random = rng(72)
    with c.clipped(x, FOLD, PANEL, 182):
        c.rect(x, FOLD, PANEL, 182, linear(0, FOLD, 0, 272, (0, "#f4a93a"), (1, "#e67f1c")))
        spots = [(0.12, 0.05, 15), (0.5, 0.02, 12), (0.88, 0.07, 16), (0.95, 0.86, 19),
                 (0.1, 0.93, 17), (0.52, 0.97, 14), (0.02, 0.5, 9), (1.0, 0.47, 10)]
        for u, v, r in spots:
            px, py = x + u * PANEL, FOLD + v * 178
            c.circle(px + 0.8, py + 1.2, r, (0.4, 0.15, 0, 0.35))
            with c.at(px, py, random.uniform(0, 360)):
                c.paste(art("slice"), -r, -r, 2 * r, 2 * r)
        droplets(c, x, FOLD, PANEL, 178, 60, 73, size=(0.4, 1.3))
    c.rect(x + 9, FOLD + 22, PANEL - 18, 118, (0.99, 0.96, 0.87, 0.97), r=5)
    c.rect(x + 10.5, FOLD + 23.5, PANEL - 21, 115, None, ORANGE, 0.5, r=4)
    logo(c, mid, FOLD + 62, 54)
    c.text(mid, FOLD + 77, "Morning starts in the grove", 6.2, "brush", DEEP, "c")
    story = (
        "At first light our growers walk the terraces above the bay and pick only what is ripe "
        "that day. Within hours every orange is washed, pressed cold and filled, so the carton "
        "in your hand still tastes of blossom, leaf and sun.")
    y = c.paragraph(x + 16, FOLD + 85, PANEL - 32, story, 3.2, "serif", 1.28, INK, justify=True)
    c.text(mid, y + 5, "Marta & Ilir, growers", 6, "hand", GREEN, "c")
    matrix_code(c, x + 16, y + 9, 21, 74, GREEN, "#fbf5e3")
    c.paragraph(
        x + 40, y + 14, 40, "Scan to meet the families behind this batch and to find recipes "
        "for zest, peel and pulp.", 2.6, "medium", fill=INK)
    c.rect(x, 255.5, PANEL, 16.5, GREEN)
    c.text(mid, 264.4, "100 % JUICE · 100 % SUNSHINE", 4.2, "black", "#fdf6e0", "c", tracking=0.3)


def left(c, x):
    """Three steps from grove to glass, a drawing of a glass, storage advice."""
    c.rect(x, 0, PANEL, 272, "#fbf3df")
    gusset(c, x)
    c.rect(x, FOLD, PANEL, 15, ORANGE)
    c.text(x + 7, FOLD + 10, "From grove to glass", 8.5, "lobster", "#fdf6e0", bold=True)
    steps = [("PICKED", "by hand when the peel turns from green to gold"),
             ("PRESSED", "cold and gently, so that no bitter oil gets in"),
             ("POURED", "fresh into cartons made of 87 % plant-based board")]
    for k, (head, words) in enumerate(steps):
        y = FOLD + 31 + 25 * k
        c.circle(x + 18, y, 9.8, mix(PALE, ORANGE, 0.25 * k))
        c.paste(art(("orange", "slice", "leaf")[k]), x + 10, y - 8, 16, 16)
        c.text(x + 32, y - 2.5, f"{k + 1}  {head}", 5.4, "black", GREEN, tracking=0.2)
        c.paragraph(x + 32, y + 2.6, 58, words, 3.6, "sans", fill=INK)
        if k < 2:
            c.line(x + 18, y + 11, x + 18, y + 14, ORANGE, 1.0)
    glass(c, x + 70, 232)
    y = c.paragraph(x + 7, 192, 42, "One 250 ml glass gives you a full day's vitamin C.", 5.0,
                    "slab", 1.18, DEEP)
    y = c.paragraph(
        x + 7, y + 2, 40, "Best served cold with a slice of lime, or stirred into "
        "yoghurt, porridge and marinades.", 2.8, "serif", fill=INK, italic=True)
    seal(c, x + 17, 240, 10, "FAIR TO GROWERS", "FAIR\nFRUIT", "SINCE 1974", fill=DEEP)
    c.rect(x, 260, PANEL, 12, GREEN)
    c.text(x + 6, 266, "FOLDING BOARD FROM MANAGED FORESTS", 2.6, "heavy", "#fdf6e0", tracking=0.15)


def glass(c, x, y):
    """A tumbler of juice standing at (x, y)."""
    c.ellipse(x + 4, y + 1, 17, 3, (0.4, 0.2, 0, 0.25))
    body = [(x - 12, y - 42), (x + 12, y - 42), (x + 9.5, y), (x - 9.5, y)]
    c.poly(body, (0.9, 0.94, 0.92, 0.7), (0.5, 0.55, 0.5, 0.6), 0.4)
    c.poly([(x - 11.2, y - 33), (x + 11.2, y - 33), (x + 9.2, y - 2), (x - 9.2, y - 2)],
           linear(x - 11, 0, x + 11, 0, (0, "#e2780f"), (0.3, "#f8b136"), (0.7, "#f09a22"),
                  (1, "#d96c0c")))
    c.ellipse(x, y - 33, 11.2, 2.2, "#f9bf58", "#e98a1f", 0.3)
    c.ellipse(x, y - 42, 12, 2.2, None, (0.5, 0.55, 0.5, 0.8), 0.5)
    c.poly([(x - 8.5, y - 38), (x - 6.8, y - 38), (x - 6, y - 5), (x - 7, y - 5)], (1, 1, 1, 0.45))
    with c.at(x + 10, y - 43, 20):
        c.paste(art("slice"), -8, -8, 16, 16)


def fin(c):
    """Coding and notices on the sealed top edge."""
    for k in range(4):
        x = k * PANEL
        c.rect(x, 0, PANEL, RIDGE, GREEN if k % 2 == 0 else "#2a6b41")
        c.rect(x, RIDGE - 1.2, PANEL, 0.5, "#fdf6e0")
    for k, text in ((0, "Solara · orange juice"), (2, "open with the cap on the other side")):
        c.text(k * PANEL + PANEL / 2, 21.4, text, 5, "lobster", "#fdf6e0", "c", bold=True)
    c.rect(8, 8.2, 44, 6.4, "#f3ead0", r=1)
    stamp(c, 10, 13, "BB 14.08.27 09:42", 4.0, 75)
    stamp(c, 2 * PANEL + 10, 13, "L 2231 A 07", 4.0, 76, "#f3ead0")


def wear(c):
    """Fold lines: the varnish cracks a little along every crease."""
    random = rng(77)
    for k in range(5):
        for _ in range(130):
            y = random.uniform(28, 270)
            x = k * PANEL + random.normal(0, 0.28)
            c.line(x, y, x + random.normal(0, 0.1), y + random.uniform(0.2, 2.2),
                   (1, 0.98, 0.93, random.uniform(0.05, 0.3)), random.uniform(0.1, 0.25))
    for y in (FOLD, FOOT, RIDGE):
        for _ in range(320):
            x = random.uniform(0, 382)
            h = y + random.normal(0, 0.22)
            c.line(x, h, x + random.uniform(0.3, 2.4), h + random.normal(0, 0.05),
                   (1, 0.98, 0.93, random.uniform(0.03, 0.2)), random.uniform(0.1, 0.22))
    for k in range(4):
        c.rect(k * PANEL, 28, 2.5, 240,
               linear(k * PANEL, 0, k * PANEL + 2.5, 0, (0, (0, 0, 0, 0.07)), (1, (0, 0, 0, 0.0))))


def cap_art(c):
    x, y, w, h = ATLAS["cap"]
    c.rect(x - 1.5, y - 2, w + 3, h + 4, GREEN)
    c.circle(x + w / 2, y + w / 2, 7.0,
             radial(x + w / 2, y + w / 2, 7, (0, "#2f7a4b"), (0.8, "#2a7046"), (1, "#235f3b")))
    for r in (5.2, 5.7):
        c.circle(x + w / 2, y + w / 2, r, None, (1, 1, 1, 0.16), 0.25)
    c.text(x + w / 2, y + w / 2 + 1.2, "Solara", 3.4, "lobster", (0.93, 0.96, 0.86, 0.75), "c",
           bold=True)
    top, foot = y + h - 7.0, y + h - 1.6
    for k in range(44):
        px = x + w * k / 44
        c.rect(px, top, w / 88, foot - top, (0.02, 0.14, 0.07, 0.55))
        c.rect(px + w / 70, top, w / 176, foot - top, (0.6, 0.85, 0.65, 0.25))
    c.rect(x - 1, foot, w + 2, 0.4, (0, 0.1, 0.04, 0.6))


def draw_atlas():
    c = Canvas(ATLAS["width"], ATLAS["height"], 2048, 1024, "#f2ecdc")
    right(c, PANEL)
    back(c, 2 * PANEL)
    left(c, 3 * PANEL)
    front(c, 0, fruit_group())
    fin(c)
    wear(c)
    c.rect(4 * PANEL, 0, 20, 272, "#efe6cf")
    cap_art(c)
    return picture(mottled(c.array() * 0.93, 78, ink=1.6, paper=1.6))
