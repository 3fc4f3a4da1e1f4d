"""Small things: pen cup, fruit, plant, tape dispenser, ruler and eraser."""

import math

import numpy as np

from .canvas import Canvas, picture
from .mesh import Model, join
from .noise import fbm, rng
from .room_furniture import plant
from .shapes import box, fillet, lathe, prism, tube, turned
from .surfaces import blend, colour, mottled, smoothstep

PALETTE = {
    "pencil_yellow": (0.62, 0.36, 0.02), "pencil_red": (0.45, 0.04, 0.03),
    "pen_blue": (0.03, 0.07, 0.32), "pen_black": (0.02, 0.02, 0.022),
    "pen_green": (0.03, 0.22, 0.09), "wood_tip": (0.55, 0.37, 0.20), "lead": (0.03, 0.03, 0.03),
    "pink": (0.55, 0.22, 0.22), "white": (0.70, 0.69, 0.66)
}


def add_palette(model, *names):
    for name in names:
        model.material(name, kd=PALETTE[name], ks=0.04, ns=150)


def lean(patch, tilt, azimuth, x, y, z):
    return patch.rotated("y", tilt).rotated("z", azimuth).moved(x, y, z)


def pencil(mat, length):
    """Six-sided pencil, point up."""
    hexagon = [(0.0037 * math.cos(a), 0.0037 * math.sin(a))
               for a in np.radians(np.arange(0, 360, 60) + 30)]
    shaft = prism(fillet(hexagon, 0.0007, 1, closed=True), length - 0.022, 0.0004, mat, bevel_seg=1)
    cone = turned([(0, 0), (0.0035, 0.0), (0.0009, 0.018), (0, 0.0182)], [0, 0.0002, 0, 0],
                  "wood_tip", seg=12)
    tip = turned([(0, 0.0), (0.00095, 0.0), (0.0002, 0.0046), (0, 0.0047)], 0, "lead", seg=8)
    return join(shaft, cone.moved(z=length - 0.0221), tip.moved(z=length - 0.0042))


def pen(mat, length):
    """Ball pen with grip ring, clip and push button, tip down."""
    body = turned([(0, 0), (0.0012, 0.002), (0.0048, 0.016), (0.0052, length * 0.55),
                   (0.0055, length * 0.56), (0.0053, length * 0.93), (0.0036, length * 0.94),
                   (0.0034, length), (0, length)],
                  [0, 0.0005, 0.002, 0.0002, 0.0002, 0.001, 0.0004, 0.0012, 0], mat, seg=14)
    ring = turned([(0, length * 0.54), (0.0058, length * 0.54), (0.0058, length * 0.565),
                   (0, length * 0.565)], [0, 0.0005, 0.0005, 0], "metal", seg=14)
    clip = box((0.0032, 0.0012, length * 0.33), 0.0005, "metal").moved(y=-0.0068, z=length * 0.58)
    return join(body, ring, clip)


def pen_cup():
    model = Model("pen_cup")
    c = Canvas(256, 100, 1024, 512, "#394a4f")
    random = rng(901)
    for k in range(16):
        for j in range(7):
            x, y = 16 * k + 8 * (j % 2), 15 * j + 5
            c.poly([(x, y), (x + 8, y + 7.5), (x, y + 15), (x - 8, y + 7.5)],
                   ("#d9a441", "#e8ddc5", "#b5523a", "#5f8a86", "#394a4f")[int(random.integers(
                       0, 5))])
    model.images["cup.jpg"] = picture(mottled(c.array() * 0.93, 902, 1.2, 2.2))
    model.material("ceramic", image="cup.jpg", ks=0.045, ns=220)
    model.material("metal", kd=(0.4, 0.4, 0.41), ks=0.35, ns=150)
    model.material("dark", kd=(0.03, 0.03, 0.032), ks=0.01, ns=10)
    add_palette(model, *PALETTE)
    cup = turned([(0, 0), (0.038, 0), (0.041, 0.1), (0.0385, 0.1), (0.036, 0.006), (0, 0.006)],
                 [0, 0.003, 0.0012, 0.0012, 0.003, 0], "ceramic", seg=40)
    cup.uv = np.column_stack([cup.uv[:, 0], cup.p[:, 2] / 0.1])
    r = np.hypot(cup.p[:, 0], cup.p[:, 1])
    cup.mats = [
        "dark" if all(r[i] < 0.0386 and cup.p[i, 2] > 0.004 for i in f) else "ceramic"
        for f in cup.faces
    ]
    model.add("cup", cup)
    things = [(pencil("pencil_yellow", 0.175), 7, 20), (pencil("pencil_red", 0.15), 10, 100),
              (pencil("pencil_yellow", 0.19), 11, 190), (pen("pen_blue", 0.145), 9, 250),
              (pen("pen_black", 0.14), 11, 310), (pencil("pen_green", 0.165), 5, 150),
              (pen("pen_green", 0.142), 12, 60)]
    for k, (thing, tilt, azimuth) in enumerate(things):
        a = math.radians(azimuth)
        model.add(
            f"pen{k}",
            lean(thing.rotated("z", 40 * k), tilt, azimuth, 0.014 * math.cos(a),
                 0.014 * math.sin(a), 0.0085))
    ruler = box((0.026, 0.0022, 0.2), 0.0006, "wood_tip").rotated("y",
                                                                  -9).moved(-0.012, 0.006, 0.009)
    model.add("ruler", ruler)
    return model


def fruit_skin(size, base, other, seed, kind):
    out = blend(colour(base), colour(other), 0.5 + 0.33 * fbm(size // 2, size, 3, seed, 5))
    y = np.linspace(0, 1, size // 2)[:, None] * np.ones((1, size))
    if kind == "apple":
        streak = fbm(size // 2, size, 90, seed + 1, 3, stretch=0.12)
        blush = smoothstep(-0.5, 1.0, fbm(size // 2, size, 2, seed + 2, 2) + 0.35 * streak)
        out = blend(out, colour("#a8241c") * (1 + 0.08 * streak)[..., None], blush * 0.85)
        dots = fbm(size // 2, size, 70, seed + 3, 2)
        out = blend(out, colour("#e6c987"), 0.6 * smoothstep(1.9, 2.6, dots))
        out = blend(out, colour("#7a7a35"), smoothstep(0.93, 1.0, 1 - y) * 0.8)
    else:
        pores = fbm(size // 2, size, 110, seed + 1, 2)
        out = out * (1 - 0.10 * smoothstep(0.4, 1.8, pores))[..., None]
        out = blend(out, colour("#7d7a30"), smoothstep(0.985, 1.0, 1 - y))
    return picture(out)


def apple():
    model = Model("apple")
    model.images["skin.jpg"] = fruit_skin(512, "#c9b84a", "#d8a63e", 910, "apple")
    model.material("skin", image="skin.jpg", ks=0.045, ns=160)
    model.material("stem", kd=(0.12, 0.07, 0.03), ks=0.02, ns=20)
    rows = []
    for k in range(25):
        t = -math.pi / 2 + math.pi * k / 24
        r = 0.037 * math.cos(t)**0.75 if 0 < k < 24 else 0.0
        z = 0.0335 + 0.0335 * math.sin(t) - 0.013 * math.exp(-(
            (r / 0.009)**2)) * (1 if t > 0 else -0.5)
        rows.append((r * (1 + 0.06 * math.sin(t)), z))
    rows = np.array(rows)
    d = np.gradient(rows, axis=0)
    n = np.column_stack([d[:, 1], -d[:, 0]])
    n[0], n[-1] = (0, -1), (0, 1)
    n /= np.linalg.norm(n, axis=1, keepdims=True)
    rows[:, 1] -= rows[:, 1].min()
    body = lathe(np.hstack([rows, n]), "skin", seg=32)
    angle = np.arctan2(body.p[:, 1], body.p[:, 0])
    lobes = 1 + 0.018 * np.cos(5 * angle) * (1 - body.p[:, 2] / 0.08)
    body.p[:, :2] *= lobes[:, None]
    model.add("apple", body)
    model.add(
        "stem",
        tube([(0, 0, 0.047), (0.0015, 0.001, 0.058), (0.005, 0.002, 0.070)],
             [0.0011, 0.0010, 0.0017], "stem", seg=8))
    return model


def orange_fruit():
    model = Model("orange_fruit")
    model.images["peel.jpg"] = fruit_skin(512, "#ec8a1c", "#df7412", 920, "orange")
    model.material("peel", image="peel.jpg", ks=0.04, ns=45)
    model.material("navel", kd=(0.10, 0.12, 0.03), ks=0.02, ns=20)
    rows = []
    for k in range(23):
        t = -math.pi / 2 + math.pi * k / 22
        dent = 0.0022 * math.exp(-((math.cos(t) / 0.18)**2))
        rows.append((0.0385 * math.cos(t) if 0 < k < 22 else 0.0,
                     0.0365 * math.sin(t) - math.copysign(dent, t), math.cos(t), math.sin(t)))
    rows = np.array(rows)
    rows[:, 1] -= rows[:, 1].min()
    body = lathe(rows, "peel", seg=36)
    bump = np.sin(7 * body.p[:, 2] * 160) * np.cos(9 * np.arctan2(body.p[:, 1], body.p[:, 0]))
    body.p[:, :2] *= 1 + 0.004 * bump[:, None] * (np.hypot(body.p[:, 0], body.p[:, 1]) > 0.01)[:,
                                                                                               None]
    model.add("orange", body)
    star = turned([(0, 0), (0.0036, 0), (0.002, 0.0016), (0, 0.0016)], [0, 0, 0.0008, 0], "navel",
                  seg=10)
    model.add("navel", star.moved(z=float(body.p[:, 2].max()) - 0.003))
    return model


def potted_plant():
    model = Model("potted_plant")
    model.material("terracotta", kd=(0.42, 0.16, 0.08), ks=0.01, ns=10)
    model.material("leaf_a", kd=(0.12, 0.30, 0.06), ks=0.04, ns=60)
    model.material("leaf_b", kd=(0.19, 0.36, 0.09), ks=0.04, ns=60)
    model.add("plant", plant(930, 0.14, 0.048))
    return model


def tape_dispenser():
    model = Model("tape_dispenser")
    model.material("shell", kd=(0.03, 0.12, 0.14), ks=0.045, ns=220)
    model.material("tape", kd=(0.60, 0.52, 0.33), ks=0.06, ns=200)
    model.material("core", kd=(0.66, 0.64, 0.6), ks=0.03, ns=60)
    model.material("blade", kd=(0.4, 0.4, 0.41), ks=0.4, ns=150)
    lower = prism(
        fillet([(-0.062, 0.0), (0.078, 0.0), (0.078, 0.022), (-0.062, 0.022)], 0.006, 3,
               closed=True), 0.056, 0.003, "shell")
    model.add("base", lower.rotated("x", 90).moved(y=0.028))
    for s in (-1, 1):
        cheek = prism(
            fillet([(-0.05, 0.015), (0.028, 0.015), (0.012, 0.052), (-0.034, 0.052)], 0.012, 4,
                   closed=True), 0.006, 0.002, "shell")
        model.add("cheek_left" if s < 0 else "cheek_right",
                  cheek.rotated("x", 90).moved(y=s * 0.021 + 0.003))
    nose = prism(
        fillet([(0.052, 0.018), (0.0778, 0.018), (0.0775, 0.040), (0.066, 0.038)], 0.004, 3,
               closed=True), 0.034, 0.002, "shell")
    model.add("nose", nose.rotated("x", 90).moved(y=0.017))
    roll = turned([(0.0135, 0.0), (0.029, 0.0), (0.029, 0.025), (0.0135, 0.025), (0.0135, 0.0)],
                  [0, 0.0006, 0.0006, 0, 0], "tape", seg=36)
    hub = turned([(0, -0.002), (0.0134, -0.002), (0.0134, 0.027), (0, 0.027)], [0, 0.001, 0.001, 0],
                 "core", seg=24)
    for name, part in (("roll", roll), ("hub", hub)):
        model.add(name, part.rotated("x", 90).moved(-0.011, 0.0125, 0.046))
    strip = box((0.068, 0.024, 0.0006), 0.0002, "tape").rotated("y", 24).moved(0.040, 0, 0.0553)
    model.add("strip", strip)
    model.add("blade",
              box((0.0022, 0.03, 0.010), 0.0006, "blade").rotated("y", 12).moved(0.0775, 0, 0.034))
    return model


def ruler_eraser():
    """Wooden ruler, an eraser in its sleeve and a pencil."""
    model = Model("ruler_eraser")
    c = Canvas(310, 75, 2048, 256, "#d3ac72")
    random = rng(940)
    for _ in range(260):
        y = random.uniform(0, 34)
        c.line(random.uniform(-40, 300), y, random.uniform(20, 360), y + random.normal(0, 0.5),
               (0.45, 0.28, 0.1, random.uniform(0.03, 0.16)), 0.4)
    for k in range(301):
        c.line(5 + k, 0.4, 5 + k, 7.5 if k % 10 == 0 else 5.6 if k % 5 == 0 else 4, "#2a2018", 0.28)
        if k % 10 == 0:
            c.text(5 + k, 12.4, str(k // 10), 4.2, "sans", "#2a2018", "c")
    c.text(150, 25, "MERIDIAN  No. 30  ·  beech", 5, "heavy", "#7a4a22", "c", tracking=0.6)
    c.circle(300, 24, 3.2, "#5a3a1c")
    c.rect(0, 36, 120, 39, "#efece4")
    c.rect(14, 36, 70, 39, "#26456e")
    c.rect(14, 47, 70, 3, "#d24a35")
    c.text(49, 62, "GUMMA soft", 9.5, "black", "#f2efe6", "c")
    model.images["ruler.jpg"] = picture(mottled(c.array() * 0.95, 941, 1.0, 1.5))
    model.material("print", image="ruler.jpg", ks=0.035, ns=90)
    add_palette(model, "pencil_yellow", "wood_tip", "lead")
    v = 36 / 75
    strip = (0, 1 - v, 1, 1)
    plain = (0.2, 1 - v + 0.02, 0.3, 1 - v + 0.05)
    ruler = box((0.31, 0.036, 0.0032), 0.0009, "print", uv={
        "top": strip, "bottom": strip, "front": plain, "back": plain, "left": plain, "right": plain
    })
    model.add("ruler", ruler.rotated("z", 8))
    r = (0, 0, 120 / 310, 39 / 75)
    eraser = box((0.058, 0.024, 0.0125), 0.0025, "print", seg=3,
                 uv={k: r
                     for k in ("front", "back", "top", "bottom")}
                 | {"left": (0.01, 0.05, 0.03, 0.4), "right": (0.30, 0.05, 0.33, 0.4)})
    model.add("eraser", eraser.rotated("z", -24).moved(-0.07, -0.055))
    model.add(
        "pencil",
        pencil("pencil_yellow", 0.17).rotated("y", 90).rotated("z",
                                                               -13).moved(-0.02, -0.045, 0.0037))
    return model
