"""The printed sheet of the pasta box: side walls in one strip, top, bottom and flap above."""

import math
from functools import lru_cache

import numpy as np

from .canvas import Canvas, linear, picture
from .food import basil, fusilli, heap, tomato
from .noise import rng
from .prints import bin_mark, ean13, intake, nutrition, recycling, seal, stamp
from .relief import Relief
from .surfaces import colour, mottled

SHEET = (404.0, 268.0)
RECTS = {
    "front": (1, 66, 140, 200), "right": (141, 66, 60, 200), "back": (201, 66, 140, 200),
    "left": (341, 66, 60, 200), "top": (1, 2, 140, 60), "bottom": (143, 2, 140, 60),
    "flap": (285, 9, 112, 46)
}
BLUE, NIGHT, CREAM, WHEAT, RED = "#1d4470", "#142c4c", "#f6edd8", "#dba544", "#b23a2a"
INK = "#26303a"
BRAND = "Lumera"

ROWS = [("Energy", "1 510 kJ", "1 208 kJ"), ("", "356 kcal", "285 kcal"), ("Fat", "1.5 g", "1.2 g"),
        ("- of which saturates", "0.3 g", "0.2 g"), ("Carbohydrate", "71 g", "57 g"),
        ("- of which sugars", "3.2 g", "2.6 g"), ("Fibre", "3.0 g", "2.4 g"),
        ("Protein", "13 g", "10 g"), ("Salt", "0.01 g", "0.01 g")]


def screw(random, index):
    return fusilli(random.uniform(270, 330), random.uniform(54, 60), random.uniform(0, 360), index,
                   "#fbdc92", "#d9a548")


@lru_cache(maxsize=None)
def pieces(kind):
    if kind == "window":
        return heap(900, 1060, screw, 120, 200, 81, "#a06a28", 2,
                    1.0).picture(2, depth=40, ambient=0.6)
    r = Relief(700, 700)  # a dish from above
    yy, xx = np.mgrid[0:700, 0:700]
    d = np.hypot(xx - 350, yy - 350) / 340
    r.cover[:] = d < 1
    r.z[:] = np.where(d < 1, 26 * np.clip((d - 0.62) / 0.38, 0, 1)**2, -1e3)
    r.rgb[:] = np.where((np.abs(d - 0.93) < 0.012)[..., None], colour(BLUE), colour("#efe9dc"))
    r.gloss[:] = 0.5
    g = rng(82)
    for k in range(70):
        a, q = g.uniform(0, 2 * math.pi), 195 * math.sqrt(g.uniform(0, 1))
        tone = ("#efb45e", "#b9722a") if k % 3 else ("#dc7a3c", "#a8401c")
        r.put(350 + q * math.cos(a), 350 + q * math.sin(a), 90,
              fusilli(g.uniform(105, 130), 20, g.uniform(0, 360), k, *tone),
              10 + 60 * (1 - q / 215))
    for k in range(7):
        a, q = g.uniform(0, 2 * math.pi), 150 * math.sqrt(g.uniform(0, 1))
        r.put(350 + q * math.cos(a), 350 + q * math.sin(a), 45, tomato(30, 200 + k), 70)
    basil(r, 350, 340, 90, 210)
    return r.picture(2, depth=40, ambient=0.6)


def wheat_ear(c, x, y, length, degrees, ink):
    with c.at(x, y, degrees):
        c.line(0, 0, 0, -length, ink, length * 0.018)
        for k in range(9):
            for side in (-1, 1):
                with c.at(0, -length * (0.42 + 0.06 * k), side * 28):
                    c.ellipse(0, -length * 0.05, length * 0.026, length * 0.062, ink)
                    c.line(0, -length * 0.1, 0, -length * 0.24, ink, length * 0.008)


def brand(c, x, y, w, ink="#fdf6e4"):
    size = w / c.text_width(BRAND, 1, "lobster", bold=True)
    c.text(x, y, BRAND, size, "lobster", ink, "c", bold=True)
    c.text(x, y - size * 0.92, "PASTIFICIO", size * 0.16, "heavy", WHEAT, "c", tracking=size * 0.09)
    c.text(x, y + size * 0.36, "dal 1926", size * 0.2, "serif", WHEAT, "c", italic=True)


def ground(c, x, y, w, h):
    """Blue ground with a fine diaper of ears."""
    c.rect(x, y, w, h, linear(x, y, x, y + h, (0, "#26548a"), (0.5, BLUE), (1, NIGHT)))
    with c.clipped(x, y, w, h):
        for j in range(int(h / 8) + 2):
            for i in range(int(w / 8) + 2):
                wheat_ear(c, x + 8 * i + 4 * (j % 2), y + 8 * j + 3, 6.5, 0, (0.75, 0.85, 1, 0.09))


def front(c):
    x, y, w, h = RECTS["front"]
    ground(c, x, y, w, h)
    mid = x + w / 2
    c.rect(x, y + 92, w, 82, CREAM)
    c.rect(x, y + 92, w, 1.6, WHEAT)
    c.rect(x, y + 172.4, w, 1.6, WHEAT)
    c.ellipse(mid, y + 40, 60, 31, NIGHT, WHEAT, 1.1)
    c.ellipse(mid, y + 40, 57.4, 28.6, None, WHEAT, 0.35)
    for side in (-1, 1):
        wheat_ear(c, mid + side * 14, y + 66, 19, side * 62, WHEAT)
    brand(c, mid, y + 50, 78)
    c.text(mid, y + 87, "FUSILLI", 16, "display", "#fdf6e4", "c", bold=True, tracking=3.4)
    c.text(x + 12, y + 86, "N° 34", 7.5, "slab", WHEAT, bold=True)
    c.text(x + w - 12, y + 83, "cottura", 3.6, "serif", CREAM, "r", italic=True)
    c.text(x + w - 12, y + 87.5, "9 min", 5, "black", WHEAT, "r")
    # Die-cut window: a bowl-shaped outline filled with pasta.
    cr = c.cr
    cr.save()
    cr.new_path()
    cr.move_to(x + 14, y + 103)
    cr.line_to(x + w - 14, y + 103)
    cr.curve_to(x + w - 14, y + 148, x + w - 40, y + 166, mid, y + 166)
    cr.curve_to(x + 40, y + 166, x + 14, y + 148, x + 14, y + 103)
    cr.close_path()
    path = cr.copy_path()
    cr.clip()
    c.paste(pieces("window"), x + 12, y + 100, 116, 116 * 900 / 1060)
    c.rect(x, y + 100, w, 9,
           linear(0, y + 102, 0, y + 110, (0, (0.1, 0.05, 0, 0.65)), (1, (0, 0, 0, 0))))
    c.poly([(x + 30, y + 100), (x + 52, y + 100), (x + 34, y + 170), (x + 8, y + 170)],
           (1, 1, 1, 0.16))
    c.poly([(x + 58, y + 100), (x + 63, y + 100), (x + 45, y + 170), (x + 38, y + 170)],
           (1, 1, 1, 0.13))
    cr.restore()
    cr.append_path(path)
    c.paint(None, WHEAT, 1.3)
    c.text(x + 6, y + 168, "bronze", 5.2, "brush", RED)
    c.text(x + 6, y + 171, "DRAWN", 2.4, "heavy", RED, tracking=0.3)
    seal(c, x + w - 17, y + 160, 13.5, "DURUM WHEAT", "100%\nSEMOLA", "SLOW DRIED", fill=RED)
    c.rect(x, y + 174, w, 26, NIGHT)
    c.text(x + 8, y + 191, "500 g", 12, "black", "#fdf6e4")
    c.text(x + 46, y + 191, "e", 11, "black", "#fdf6e4")
    c.text(x + w - 8, y + 184, "Pasta di semola di grano duro", 5, "serif", WHEAT, "r", italic=True)
    c.text(x + w - 8, y + 190.5, "Durum wheat pasta · high in protein", 3.4, "medium", CREAM, "r")


def back(c):
    x, y, w, h = RECTS["back"]
    c.rect(x, y, w, h, CREAM)
    ground(c, x, y, w, 46)
    brand(c, x + 38, y + 31, 52)
    c.text(x + 74, y + 20, "Fusilli al pomodoro", 8, "brush", WHEAT)
    c.text(x + 74, y + 28, "serves 4 · ready in 20 minutes", 3.6, "medium", CREAM)
    c.text(x + 74, y + 35, "A SUNDAY RECIPE FROM OUR KITCHEN", 2.6, "heavy", CREAM, tracking=0.2)
    c.circle(x + 101, y + 85, 35.5, (0.2, 0.15, 0.1, 0.22))
    c.paste(pieces("dish"), x + 65, y + 48, 70, 70)
    c.text(x + 8, y + 58, "You need", 6, "lobster", RED, bold=True)
    for k, item in enumerate(
        ("400 g Lumera fusilli", "600 g ripe tomatoes", "2 cloves of garlic", "a handful of basil",
         "4 tbsp olive oil", "40 g hard cheese", "sea salt")):
        c.circle(x + 9.4, y + 64.0 + 5.6 * k, 0.9, WHEAT)
        c.text(x + 12.5, y + 65.2 + 5.6 * k, item, 3.7, "sans", INK)
    c.text(x + 8, y + 112, "And then", 6, "lobster", RED, bold=True)
    c.paragraph(
        x + 8, y + 118, 55, "Soften the garlic in oil, add the chopped tomatoes and let them "
        "simmer for a quarter of an hour. Boil the fusilli in plenty of salted water, drain "
        "while still firm and toss them in the pan.", 3.5, "serif", 1.22, INK)
    nutrition(c, x + 68, y + 123, 66, ROWS, per=("per 100 g", "per 80 g"), head=BLUE, ink=INK,
              size=2.45)
    ean13(c, x + 8, y + 163, 44, 27, "800715506231")
    c.paragraph(
        x + 56, y + 177, 44, "Store in a cool, dry place. May contain traces of soya and "
        "mustard. Lumera S.c.a., Via del Molino 8, Valdoro.", 2.2, "sans", fill=INK)
    recycling(c, x + 112, y + 180, 6.5, BLUE, "21", "PAP")
    bin_mark(c, x + 126, y + 187, 13, BLUE)


def side(c, name):
    x, y, w, h = RECTS[name]
    ground(c, x, y, w, h)
    mid = x + w / 2
    brand(c, mid, y + 28, 42)
    if name == "right":
        c.rect(x + 5, y + 44, w - 10, 112, CREAM, WHEAT, 0.6, r=3)
        c.text(mid, y + 56, "How to cook", 6.6, "lobster", RED, "c", bold=True)
        for k, (head, words) in enumerate(
            (("1 litre", "of water for every 100 g of pasta"),
             ("10 g", "of coarse salt once it boils"), ("9 min", "al dente, stir now and then"),
             ("1 ladle", "of the water goes into the sauce"))):
            yy = y + 68 + 22 * k
            c.circle(x + 15, yy + 2, 7, (BLUE, RED, WHEAT, BLUE)[k])
            c.text(x + 15, yy + 4.4, str(k + 1), 7, "black", CREAM, "c")
            c.text(x + 25, yy + 1, head, 5, "black", BLUE)
            c.paragraph(x + 25, yy + 5.4, 28, words, 3.0, "sans", fill=INK)
    else:
        c.rect(x + 5, y + 44, w - 10, 112, RED, WHEAT, 0.6, r=3)
        c.text(mid, y + 57, "Our family", 6.4, "lobster", CREAM, "c", bold=True)
        for k, (label, number) in enumerate((("FUSILLI", 34), ("PENNE", 41), ("FARFALLE", 65),
                                             ("SPAGHETTI", 5), ("RIGATONI", 28), ("ORZO", 12))):
            yy = y + 69 + 13 * k
            c.line(x + 10, yy + 4, x + w - 10, yy + 4, (1, 1, 1, 0.4), 0.25)
            c.text(x + 10, yy, label, 6.2, "display", CREAM, bold=True, tracking=0.5)
            c.text(x + w - 10, yy, f"N° {number}", 5, "slab", "#f4cf8a", "r")
    intake(c, x + 6, y + 166, w - 12, [("ENERGY", "285", "14%"), ("FAT", "1.2 g", "2%"),
                                       ("SUGARS", "2.6 g", "3%"), ("SALT", "0 g", "0%")], BLUE)


def ends(c):
    for name in ("top", "bottom", "flap"):
        x, y, w, h = RECTS[name]
        ground(c, x - 1, y - 2, w + 2, h + 4)
    x, y, w, h = RECTS["flap"]
    c.text(x + w / 2, y + 20, "Lumera", 15, "lobster", "#fdf6e4", "c", bold=True)
    c.text(x + w / 2, y + 28, "FUSILLI N° 34", 5.5, "display", WHEAT, "c", bold=True, tracking=0.8)
    c.text(x + w / 2, y + 42.5, "PUSH HERE AND PULL UP", 2.8, "heavy", CREAM, "c", tracking=0.3)
    for px in (x + 24, x + w - 24):
        c.poly([(px - 2, y + 42.5), (px + 2, y + 42.5), (px, y + 39.5)], CREAM)
    for k in range(40):
        c.line(x + 14 + 2.1 * k, y + 36, x + 15.2 + 2.1 * k, y + 36, (1, 1, 1, 0.55), 0.35)
    x, y, w, h = RECTS["bottom"]
    c.rect(x + 10, y + 14, 62, 9, "#efe6cf", r=1)
    stamp(c, x + 13, y + 20.5, "L 08 226 B 11:37", 4.6, 84)
    c.rect(x + 2, y + 36, w - 4, 0.4, (0, 0, 0, 0.4))


def draw_atlas():
    c = Canvas(*SHEET, 2048, 1024, "#e8dfca")
    front(c)
    back(c)
    side(c, "right")
    side(c, "left")
    ends(c)
    for name in ("front", "right", "back", "left"):
        x, y, w, h = RECTS[name]
        random = rng(86 + int(x))
        for _ in range(200):  # rubbed creases
            yy = y + random.uniform(0, h)
            xx = x + random.normal(0, 0.3)
            c.line(xx, yy, xx, yy + random.uniform(0.2, 2.5),
                   (1, 0.98, 0.94, random.uniform(0, 0.35)), 0.2)
    return picture(mottled(c.array() * 0.955, 85, ink=1.6, paper=1.6))
