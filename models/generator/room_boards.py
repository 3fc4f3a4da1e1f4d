"""Pictures of the boards, the clock, the calendar and the book spines of the room."""

import math

from .canvas import Canvas, linear, mix, picture
from .noise import rng
from .prints import matrix_code
from .surfaces import cork, mottled

MARKERS = ("#1f3f8f", "#b3302a", "#1f7048", "#24262b")
WORDS = ("dentist Thursday 15:30", "call Marta about the boxes", "buy: tea, milk, zest, rice",
         "residual vs. depth: plot!", "keys are with Ilir", "re-run seed 7", "rent due 1st",
         "lens 35 mm f/2.8", "water the plants", "return library books", "pizza night Fri",
         "train 8:14 platform 3", "draft to Lida", "calibrate camera", "edge threshold 12?",
         "happy birthday!", "parcel at no. 14", "meeting moved to Tue")


def note(c, x, y, w, h, degrees, tone, text, random, font="hand", pin="#b23a2a"):
    with c.at(x, y, degrees):
        for k in range(4):
            c.rect(-w / 2 + 2 + k, -h / 2 + 3 + k, w, h, (0, 0, 0, 0.09))
        c.rect(
            -w / 2, -h / 2, w, h,
            linear(0, -h / 2, 0, h / 2, (0, mix(tone, "#ffffff", 0.12)),
                   (1, mix(tone, "#000000", 0.05))))
        size = w * 0.16
        c.paragraph(-w / 2 + w * 0.08, -h / 2 + size * 1.9, w * 0.84, text, size, font, 1.15,
                    random.choice(MARKERS))
        c.circle(1.2, -h / 2 + 8, 4.6, (0, 0, 0, 0.3))
        c.circle(0, -h / 2 + 6, 4.4, pin)
        c.circle(-1.2, -h / 2 + 4.8, 1.4, (1, 1, 1, 0.6))


def cork_board():
    """1000 x 700: notes, tickets, a photograph strip and a timetable."""
    c = Canvas(1000, 700, 1024, 512)
    c.paste(picture(cork(512, 401)), 0, 0, 500, 350)
    c.paste(picture(cork(512, 402)), 500, 0, 500, 350)
    c.paste(picture(cork(512, 402)), 0, 350, 500, 350)
    c.paste(picture(cork(512, 401)), 500, 350, 500, 350)
    random = rng(403)
    tones = ["#efd96b", "#9fcbd8", "#f0b6a6", "#b7d69a", "#f3efe2", "#f4c36b", "#d9c3e4"]
    spots = [(110, 110), (265, 95), (110, 290), (255, 270), (880, 120), (745, 105), (890, 300),
             (120, 590), (275, 600), (425, 610), (770, 610), (905, 600)]
    for k, (x, y) in enumerate(spots):
        s = random.uniform(95, 130)
        note(c, x, y, s, s * random.uniform(0.8, 1.05), random.normal(0, 5), tones[k % 7], WORDS[k],
             random, ("hand", "note")[k % 2], ("#b23a2a", "#2a5f9e", "#e0a02f", "#2f7d4f")[k % 4])
    with c.at(500, 240, -2):  # timetable
        c.rect(-126, -186, 260, 380, (0, 0, 0, 0.25))
        c.rect(-130, -190, 260, 380, "#f4f1e8")
        c.rect(-130, -190, 260, 46, "#2a5f7e")
        c.text(0, -158, "TIMETABLE · AUTUMN", 20, "black", "#f4f1e8", "c")
        for r in range(10):
            for k in range(5):
                filled = random.uniform(0, 1) < 0.55
                tone = tones[int(random.integers(0, 7))] if filled else "#ffffff"
                c.rect(-98 + 44 * k, -128 + 30 * r, 42, 28, tone, "#8a8a86", 0.5)
                if filled:
                    c.text(-95 + 44 * k, -112 + 30 * r, f"R {random.integers(100, 420)}", 10,
                           "heavy", "#333333")
            c.text(-103, -110 + 30 * r, f"{8 + r}:00", 9.5, "medium", "#444444", "r")
        for k, day in enumerate(("Mo", "Tu", "We", "Th", "Fr")):
            c.text(-77 + 44 * k, -132, day, 10, "heavy", "#444444", "c")
    with c.at(745, 300, 4):  # flyer
        c.rect(-62, -98, 132, 200, (0, 0, 0, 0.25))
        c.rect(-66, -102, 132, 200, "#c9402d")
        c.circle(0, -30, 46, "#f2e3bf")
        c.text(0, -16, "7", 68, "black", "#c9402d", "c")
        c.text(0, 46, "RUMMAGE", 30, "display", "#f2e3bf", "c", bold=True)
        c.text(0, 66, "sale at the old tram depot", 10.5, "medium", "#f2e3bf", "c")
        matrix_code(c, -16, 70, 26, 404)
    for k in range(4):  # photographs
        with c.at(470 + 62 * k, 500, random.normal(0, 4)):
            c.rect(-26, -32, 56, 68, (0, 0, 0, 0.25))
            c.rect(-28, -34, 56, 68, "#f7f5ee")
            c.rect(
                -24, -30, 48, 46,
                linear(0, -30, 0, 16, (0, ("#86aed0", "#e2b27a", "#7fa27a", "#9a86b8")[k]),
                       (1, ("#d9c8a0", "#8d4f3a", "#2f4a32", "#e8c9b8")[k])))
            c.circle(-4 + 4 * k, -8, 9, (0.2, 0.15, 0.12, 0.7))
            c.text(0, 28, ("pier", "sunset", "forest", "Lida")[k], 11, "hand", "#444444", "c")
    return picture(mottled(c.array() * 0.97, 405, 1.0, 1.0))


def whiteboard():
    """1200 x 900: sketches and formulas in four pens, half wiped."""
    c = Canvas(1200, 900, 1024, 1024, "#eceef0")
    random = rng(410)
    for _ in range(60):  # wiped traces
        x, y = random.uniform(0, 1200), random.uniform(0, 900)
        c.curve([(x, y), (x + random.normal(0, 70), y + random.normal(0, 40)),
                 (x + random.normal(0, 120), y + random.normal(0, 60))], None,
                (0.35, 0.4, 0.55, random.uniform(0.02, 0.06)), random.uniform(8, 40))

    def pen(points, k, width=4.0, closed=False):
        shaky = [(x + random.normal(0, 1.4), y + random.normal(0, 1.4)) for x, y in points]
        c.curve(shaky, None, (*mix(MARKERS[k], "#ffffff", 0.08)[:3], 0.9), width, closed)

    c.text(60, 105, "loop closure  today!", 66, "hand", MARKERS[1])
    pen([(60, 122), (300, 130), (560, 118)], 1)
    lines = ("x(k+1) = x(k) · Exp(u)", "r = z - h(x)", "A d = -A r", "cov = inv(H)", "z = f b / d")
    for k, line in enumerate(lines):
        c.text(70, 205 + 68 * k, line, 54, "note", MARKERS[0 if k != 2 else 3])
    nodes = [(640, 250), (760, 190), (890, 210), (1010, 270), (1080, 390), (1020, 510), (890, 560),
             (750, 530), (650, 430)]
    for a, b in [(i, (i + 1) % 9) for i in range(9)] + [(1, 6), (3, 7)]:
        pen([
            nodes[a],
            ((nodes[a][0] + nodes[b][0]) / 2 + random.normal(0, 9),
             (nodes[a][1] + nodes[b][1]) / 2 + random.normal(0, 9)), nodes[b]
        ], 0 if abs(a - b) in (1, 8) else 1, 4)
    for k, (x, y) in enumerate(nodes):
        c.circle(x, y, 25, "#eceef0")
        pen([(x + 25 * math.cos(t), y + 25 * math.sin(t))
             for t in (0, 1.05, 2.1, 3.14, 4.19, 5.24)], 3, 4, True)
        c.text(x, y + 11, f"x{k}", 34, "note", MARKERS[3], "c")
    pen([(1120, 175), (1165, 130)], 2)
    c.text(1000, 120, "object!", 46, "hand", MARKERS[2])
    pen([(90, 850), (90, 570), (92, 560)], 3)
    pen([(80, 838), (480, 842), (492, 842)], 3)
    pen([(95, 600), (140, 690), (200, 760), (280, 795), (380, 808), (470, 812)], 1, 5)
    pen([(95, 640), (160, 700), (240, 720), (330, 770), (400, 765), (470, 790)], 0, 5)
    c.text(300, 885, "frames", 36, "hand", MARKERS[3])
    c.text(330, 700, "fused", 40, "hand", MARKERS[1])
    for k, item in enumerate(("rolling shutter", "blur + noise", "plots for Lida", "coffee beans")):
        y = 660 + 56 * k
        pen([(600, y - 28), (630, y - 28), (630, y), (600, y), (600, y - 28)], 2, 3.5)
        if k in (0, 3):
            pen([(603, y - 18), (612, y - 4), (640, y - 40)], 1, 5)
        c.text(655, y, item, 46, "hand", MARKERS[2])
    for x, y, tone, text in ((1090, 680, "#efd96b", "do NOT wipe"), (1080, 810, "#f0b6a6",
                                                                     "ask Ilir")):
        note(c, x, y, 110, 105, random.normal(0, 5), tone, text, random, pin="#3b3f45")
    return picture(mottled(c.array() * 0.97, 411, 0.6, 0.8))


def clock_face():
    """300 x 300."""
    c = Canvas(300, 300, 512, 512, "#f1eee6")
    for k in range(60):
        a = math.radians(6 * k)
        r = 122 if k % 5 == 0 else 130
        c.line(150 + r * math.sin(a), 150 - r * math.cos(a), 150 + 138 * math.sin(a),
               150 - 138 * math.cos(a), "#23262b", 4 if k % 5 == 0 else 1.6)
    for k in range(1, 13):
        a = math.radians(30 * k)
        c.text(150 + 102 * math.sin(a), 160 - 102 * math.cos(a), str(k), 30, "medium", "#23262b",
               "c")
    c.text(150, 205, "MERIDIAN", 11, "heavy", "#6b6b66", "c", tracking=2)
    for angle, length, width, tone in ((307, 72, 7, "#23262b"), (84, 112, 5, "#23262b"),
                                       (200, 118, 1.6, "#b3302a")):
        for shift, paint in ((3, (0, 0, 0, 0.2)), (0, tone)):
            with c.at(150 + shift, 150 + shift, angle):
                c.poly([(-width / 2, 22), (width / 2, 22), (width / 3, -length),
                        (-width / 3, -length)], paint)
    c.circle(150, 150, 6, "#23262b")
    return c.image()


def calendar():
    """300 x 450: month sheet below a picture."""
    c = Canvas(300, 450, 512, 512, "#f3f0e6")
    c.rect(0, 0, 300, 210, linear(0, 0, 0, 210, (0, "#e7b27c"), (0.5, "#c86f55"), (1, "#5b3f5e")))
    c.circle(200, 120, 30, "#f6dfb0")
    for k, tone in enumerate(("#8a4a52", "#5a3550", "#2f2440")):
        c.curve([(-10, 150 + 20 * k), (70, 120 + 26 * k), (150, 160 + 18 * k), (230, 128 + 26 * k),
                 (310, 160 + 16 * k), (310, 212), (-10, 212)], tone, closed=True, tension=0.6)
    c.rect(0, 210, 300, 240, "#f3f0e6")
    c.text(20, 245, "NOVEMBER", 32, "display", "#b3302a", bold=True, tracking=2)
    for k in range(30):
        col, row = (k + 6) % 7, (k + 6) // 7
        x, y = 32 + 39 * col, 285 + 29 * row
        c.text(x, y, str(k + 1), 16, "heavy" if col > 4 else "sans",
               "#b3302a" if col == 6 else "#333333", "c")
        if k in (4, 13, 21):
            c.circle(x, y - 5, 12, None, "#1f3f8f", 1.6)
    return picture(mottled(c.array() * 0.96, 412, 1.0, 1.0))


def moving_box():
    """Corrugated board: the lower 72 % a side with print, the rest a taped top."""
    c = Canvas(560, 500, 512, 512, "#b08a5e")
    for k in range(280):
        c.line(2 * k, 0, 2 * k, 500, (0.3, 0.18, 0.08, 0.07 + 0.05 * (k % 3)), 0.7)
    c.rect(0, 138, 560, 3, (0.2, 0.1, 0.05, 0.4))
    c.rect(0, 56, 560, 26, (0.80, 0.70, 0.50, 0.75))
    c.rect(250, 141, 60, 70, (0.80, 0.70, 0.50, 0.7))
    c.rect(0, 68.5, 560, 1.4, (0.2, 0.1, 0.05, 0.6))
    c.text(40, 300, "HALMAR", 72, "display", "#3a2a1c", bold=True, tracking=5)
    c.text(42, 330, "REMOVALS · STORAGE · PORT AMBER", 17, "heavy", "#3a2a1c", tracking=1)
    for k in range(3):
        x = 400 + 48 * k
        c.rect(x, 250, 40, 52, None, "#3a2a1c", 2.5)
        c.poly([(x + 20, 258), (x + 32, 276), (x + 25, 276), (x + 25, 294), (x + 15, 294),
                (x + 15, 276), (x + 8, 276)], "#3a2a1c")
    c.text(70, 430, "books + lamps", 62, "hand", "#1f2f6f")
    c.rect(380, 380, 130, 84, "#ece6d6")
    for k in range(5):
        c.rect(390, 392 + 13 * k, 104 - 18 * (k % 3), 4, "#444444")
    return picture(mottled(c.array(), 430, 2.0, 2.5))


SPINES = (24, 4)  # columns, rows of the spine sheet


def spines(seed=420):
    """Book spines, one per cell of a 24 x 4 sheet; cells are 36 x 220 mm."""
    cols, rows = SPINES
    c = Canvas(cols * 36, rows * 220, 1024, 1024, "#444444")
    random = rng(seed)
    titles = ("Harbour Lights", "State Estimation", "The Salt Road", "Linear Algebra",
              "Bread & Time", "Night Trains", "A Field Guide to Moss", "Robot Vision",
              "The Glass Bay", "Typography", "Numerical Recollections", "Wild Orchards",
              "Cartography", "Slow Rivers", "Optics II", "The Ninth Wave", "Kitchen Garden",
              "Probability", "Old Ferry Tales", "Geometry", "Winter Count", "Signals",
              "Dust & Amber", "Atlas of Islands", "Graph Theory")
    authors = ("M. Arden", "L. Brandt", "I. Voss", "K. Halmar", "S. Ono", "R. Uhl", "T. Castine",
               "J. Keld")
    tones = ("#23395b", "#7b2d26", "#e3dac3", "#2f5d50", "#c98b2b", "#1d1f24", "#8c9aa5", "#5b3a5e",
             "#d8d3c8", "#a64b2a", "#3f6e8c", "#efe7d6", "#6b7a46", "#b23a2a", "#4b4a48", "#d7b98a")
    fonts = ("heavy", "serif", "slab", "display", "black", "light", "round", "narrow")
    for row in range(rows):
        for col in range(cols):
            x, y = col * 36, row * 220
            tone = tones[int(random.integers(0, len(tones)))]
            dark = sum(mix(tone, tone, 0)[:3]) < 1.5
            ink = random.choice(["#f1ead6", "#e9c46a", "#dfe7ea"]) if dark else \
                random.choice(["#23262b", "#7b2d26", "#23395b"])
            ink, font = str(ink), fonts[int(random.integers(0, 8))]
            with c.clipped(x, y, 36, 220):
                c.rect(
                    x, y, 36, 220,
                    linear(x, 0, x + 36, 0, (0, mix(tone, "#000000", 0.35)), (0.12, tone),
                           (0.55, mix(tone, "#ffffff", 0.1)), (0.9, tone),
                           (1, mix(tone, "#000000", 0.4))))
                kind = int(random.integers(0, 5))
                if kind == 0:
                    for yy in (14, 18, 190, 194):
                        c.rect(x, y + yy, 36, 1.6, ink)
                elif kind == 1:
                    c.rect(x, y + 150, 36, 70, mix(tone, ink, 0.35))
                elif kind == 2:
                    c.rect(x + 4, y + 10, 28, 40, ink)
                elif kind == 3:
                    for k in range(5):
                        c.circle(x + 18, y + 178 + 7 * k, 10 - 1.5 * k, None, ink, 1)
                title = titles[int(random.integers(0, len(titles)))]
                with c.at(x + 18, y + 58 if kind == 2 else y + 26, 90):
                    room = 84 if kind in (1, 2) else 118
                    size = min(19, room / c.text_width(title, 1, font))
                    c.text(0, size * 0.34, title, size, font, ink)
                with c.at(x + 18, y + 150, 90):
                    author = authors[int(random.integers(0, 8))]
                    c.text(0, 3, author, 9, "medium", ink)
                c.rect(x + 13, y + 203, 10, 9, None, ink, 0.8)
                c.text(x + 18, y + 210, title[0], 7, "serif", ink, "c")
    return picture(mottled(c.array() * 0.95, seed + 1, 1.2, 2.0))
