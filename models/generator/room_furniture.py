"""Furniture along the walls and on the floor."""

import math

import numpy as np

from . import surfaces
from .canvas import picture
from .mesh import join
from .noise import rng
from .room_boards import SPINES, moving_box, spines
from .room_shell import CEILING, CEILING_LIGHT, FLOOR
from .room_walls import on_wall
from .shapes import box, fillet, prism, shell, tube, turned


def add_materials(model):
    model.images["oak.jpg"] = picture(surfaces.wood(512, 1024, 0.8, 31, "#b08a5c", "#7c5530"))
    model.images["curtain.png"] = picture(surfaces.woven(256, 64, "#c7b08a", "#a98f66", 33))
    model.images["spines.jpg"] = spines()
    model.material("oak", image="oak.jpg", ks=0.03, ns=50)
    model.material("oak_frame", image="oak.jpg", ks=0.03, ns=60)
    model.material("curtain", image="curtain.png", ks=0.0, ns=5)
    model.material("spines", image="spines.jpg", ks=0.03, ns=60)
    model.material("pages", kd=(0.66, 0.61, 0.50), ks=0.0, ns=5)
    model.material("white_paint", kd=(0.70, 0.69, 0.66), ks=0.03, ns=90)
    model.material("door", kd=(0.30, 0.35, 0.33), ks=0.03, ns=70)
    model.material("aluminium", kd=(0.36, 0.36, 0.37), ks=0.25, ns=90)
    model.material("brass", kd=(0.42, 0.29, 0.09), ks=0.3, ns=120)
    model.material("terracotta", kd=(0.42, 0.16, 0.08), ks=0.01, ns=10)
    model.material("basket", kd=(0.35, 0.25, 0.14), ks=0.01, ns=10)
    model.material("teal", kd=(0.03, 0.16, 0.17), ks=0.03, ns=50)


def book(height, depth, thick, cell):
    """A standing book, spine towards the viewer; `cell` picks its spine on the sheet."""
    col, row = cell % SPINES[0], cell // SPINES[0] % SPINES[1]
    u0, u1 = col / SPINES[0] + 0.001, (col + 1) / SPINES[0] - 0.001
    v1, v0 = 1 - row / SPINES[1] - 0.001, 1 - (row + 1) / SPINES[1] + 0.001
    plain = (u0 + 0.02, v0 + 0.005, u0 + 0.021, v0 + 0.006)
    uv = {"front": (u0, v0, u1, v1), "left": plain, "right": plain}
    return box((thick, depth, height), 0.0, "spines", uv=uv, mats={"top": "pages"},
               skip=("back", "bottom"))


def books(x0, x1, z, depth_back, seed, top=0.30):
    """A row of books between x0 and x1 on a shelf at z; some gaps, leaning and lying ones."""
    random = rng(seed)
    parts, x = [], x0
    while x < x1 - 0.05:
        kind = random.uniform(0, 1)
        if kind < 0.05:
            x += random.uniform(0.03, 0.09)
        elif kind < 0.10 and x < x1 - 0.28:
            zz = z
            for _ in range(int(random.integers(2, 5))):
                t = random.uniform(0.018, 0.04)
                lying = book(random.uniform(0.2, 0.24), 0.15, t, int(random.integers(0, 96)))
                lying = lying.moved(y=0.075).rotated("y", 90).moved(x=x, y=-depth_back + 0.01,
                                                                    z=zz + t / 2)
                parts.append(lying)
                zz += t
            x += 0.26
        else:
            t, h = random.uniform(0.014, 0.048), random.uniform(0.62, 0.95) * top
            d = random.uniform(0.13, 0.19)
            one = book(h, d, t, int(random.integers(0, 96)))
            inset = random.uniform(0.005, 0.035)
            if random.uniform(0, 1) < 0.04:
                one = one.moved(x=t / 2).rotated("y", 12).moved(x=-t / 2)
                x += h * math.sin(math.radians(12)) * 0.9
                parts.append(
                    one.moved(x=x - h * 0.19 + t / 2, y=-depth_back + inset + d / 2, z=z + 0.004))
            else:
                parts.append(one.moved(x=x + t / 2, y=-depth_back + inset + d / 2, z=z))
            x += t + 0.0008
    return parts


def plank(w, d, h, r=0.002):
    return box((w, d, h), r, "oak", tile=0.8)


def add_bookcase(model):
    """North-west corner: five shelves."""
    w, d, h = 0.95, 0.30, 1.88
    parts = [
        plank(0.022, d, h).moved(x=s * (w / 2 - 0.011), y=-d / 2 - 0.018, z=FLOOR) for s in (-1, 1)
    ]
    parts.append(
        box((w - 0.04, 0.006, h - 0.02), 0.0, "oak", tile=0.8).moved(y=-0.022, z=FLOOR + 0.01))
    levels = [0.06, 0.43, 0.79, 1.15, 1.50, h - 0.023]
    for z in levels:
        parts.append(plank(w - 0.046, d - 0.004, 0.022).moved(y=-d / 2 - 0.018, z=FLOOR + z))
    model.add("bookcase", on_wall(join(parts), "north", -1.92))
    rows = []
    for k, z in enumerate(levels[:-1]):
        rows += books(-w / 2 + 0.03, w / 2 - 0.03, FLOOR + z + 0.0225, d - 0.01, 500 + k,
                      0.33 if k < 4 else 0.30)
    model.add("bookcase_books", on_wall(join(rows), "north", -1.92))


def add_wall_shelf(model):
    """South wall: a long board on brackets with books and boxes."""
    parts = [plank(1.15, 0.2, 0.026).moved(y=-0.1, z=0.16)]
    for x in (-0.42, 0.42):
        parts.append(box((0.02, 0.18, 0.02), 0.001, "steel").moved(x, -0.09, 0.1395))
        parts.append(box((0.02, 0.02, 0.12), 0.001, "steel").moved(x, -0.012, 0.02))
    for k, (x, w, tone) in enumerate(((0.36, 0.2, "teal"), (-0.46, 0.16, "basket"))):
        parts.append(box((w, 0.16, 0.14), 0.006, tone, seg=2).moved(x, -0.1, 0.1865))
        parts.append(box((w + 0.008, 0.168, 0.03), 0.004, tone, seg=2).moved(x, -0.1, 0.318))
    model.add("wall_shelf", on_wall(join(parts), "south", 1.82))
    model.add("wall_shelf_books",
              on_wall(join(books(-0.34, 0.23, 0.1865, 0.18, 520, 0.27)), "south", 1.82))


def add_cabinet(model):
    """North wall: sideboard with three doors, a plant and a stack on top."""
    w, d, h = 1.5, 0.40, 0.62
    base = FLOOR + 0.10
    parts = [box((w, d, h), 0.003, "oak", seg=1, tile=0.8).moved(y=-d / 2 - 0.02, z=base)]
    for k in range(3):
        x = (k - 1) * 0.49
        parts.append(
            box((0.475, 0.018, h - 0.05), 0.002, "white_paint").moved(x, -d - 0.0285, base + 0.025))
        parts.append(
            tube([(x + 0.19, -d - 0.037, base + h - 0.12), (x + 0.19, -d - 0.062, base + h - 0.12)],
                 0.011, "brass", seg=10))
    for sx in (-1, 1):
        for y in (-0.06, -d + 0.02):
            parts.append(
                turned([(0, 0), (0.012, 0), (0.02, 0.105), (0, 0.105)], [0, 0.002, 0, 0], "oak",
                       seg=12).moved(sx * 0.66, y - 0.02, FLOOR))
    model.add("cabinet", on_wall(join(parts), "north", 1.05))
    vase = turned([(0, 0), (0.045, 0), (0.075, 0.09), (0.03, 0.2), (0.036, 0.235), (0.03, 0.235),
                   (0.024, 0.2), (0, 0.19)], [0, 0.006, 0.05, 0.03, 0.003, 0.003, 0.02, 0], "teal",
                  seg=24, bevel_seg=4)
    pile = books(-0.1, 0.16, 0, 0.19, 530, 0.26)
    top = base + h
    model.add(
        "cabinet_things",
        on_wall(
            join(vase.moved(-0.52, -0.2, top),
                 join(pile).moved(0.1, -0.05, top),
                 plant(11, 0.24, 0.085).moved(0.55, -0.26, top)), "north", 1.05))


def blade(length, width, bend, azimuth, lift, mat):
    """Arching leaf with a keel."""
    u, v = np.meshgrid(np.linspace(1, -1, 3), np.linspace(0, 1, 7))
    half = width / 2 * np.sin(math.pi * np.clip(0.08 + 0.92 * v, 0, 1))**0.7
    angle = lift - bend * v
    radial = np.cumsum(np.cos(angle), axis=0) * length / 7
    height = np.cumsum(np.sin(angle), axis=0) * length / 7
    points = np.dstack([radial, u * half, height + 0.25 * np.abs(u) * half])
    return shell(points, mat, 0.0006).rotated("z", azimuth)


def plant(seed, size, pot):
    """Potted plant: terracotta pot, soil, two dozen arching leaves."""
    random = rng(seed)
    body = turned([(0, 0), (pot * 0.72, 0), (pot, pot * 1.55), (pot * 1.08, pot * 1.55),
                   (pot * 1.08, pot * 1.85), (pot * 0.98, pot * 1.85), (pot * 0.94, pot * 1.6),
                   (0, pot * 1.62)], [0, 0.006, 0.002, 0.003, 0.004, 0.004, 0.002, 0], "terracotta",
                  seg=24)
    parts = [body]
    for k in range(26):
        t = k / 26
        leafy = blade(size * random.uniform(0.75, 1.15), size * 0.15,
                      random.uniform(1.0, 2.0) * (1.1 - 0.6 * t), 137.5 * k,
                      random.uniform(0.9, 1.15) + 0.35 * t, ("leaf_a", "leaf_b")[k % 2])
        parts.append(leafy.moved(z=pot * 1.6))
    return join(parts)


def add_floor_things(model):
    model.material("leaf_a", kd=(0.12, 0.30, 0.06), ks=0.04, ns=60)
    model.material("leaf_b", kd=(0.19, 0.36, 0.09), ks=0.04, ns=60)
    model.add("floor_plant", plant(41, 0.62, 0.17).moved(-1.93, -1.72, FLOOR))
    model.images["rug.jpg"] = picture(rug(1024, 43))
    model.material("rug", image="rug.jpg", ks=0.0, ns=5)
    uv = {"top": (0, 0, 1, 1)}
    model.add("rug", box((2.9, 1.95, 0.012), 0.005, "rug", uv=uv).moved(z=FLOOR + 0.0005))
    radiator = []
    for k in range(15):
        radiator.append(
            box((0.058, 0.09, 0.52), 0.012, "white_paint",
                seg=1).moved(-0.455 + 0.065 * k, -0.09, FLOOR + 0.12))
    radiator.append(
        tube([(-0.46, -0.09, FLOOR + 0.60), (0.46, -0.09, FLOOR + 0.60)], 0.016, "white_paint",
             seg=8))
    radiator.append(
        tube([(0.44, -0.09, FLOOR + 0.16), (0.53, -0.09, FLOOR + 0.16),
              (0.535, -0.09, FLOOR + 0.002)], 0.011, "white_paint", seg=8))
    model.add("radiator", on_wall(join(radiator), "west", 0.15))


def rug(size, seed):
    """Flat-woven rug with a border and a stepped lozenge pattern."""
    y, x = np.mgrid[0:size, 0:size] / size
    tones = [surfaces.colour(h) for h in ("#7a2f2b", "#d8c39a", "#27384f", "#a9693c", "#4f5f4a")]
    a = np.abs(((x * 7) % 1) - 0.5) * 2
    b = np.abs(((y * 5) % 1) - 0.5) * 2
    step = np.floor((a + b) * 6)
    pattern = np.array(tones)[np.array([0, 2, 1, 0, 3, 0, 1, 4, 0, 2, 0,
                                        0])[np.clip(step, 0, 11).astype(int)]]
    edge = np.minimum(np.minimum(x, 1 - x) * 1.49, np.minimum(y, 1 - y))
    band = np.array(tones)[np.array([2, 1, 3, 2, 2, 1, 0])[np.clip(edge * 70, 0, 6).astype(int)]]
    out = np.where((edge < 0.1)[..., None], band, pattern)
    teeth = (edge > 0.055) & (edge < 0.08) & (((x + y) * 40) % 1 > 0.5)
    out = np.where(teeth[..., None], tones[1], out)
    weave = 0.86 + 0.14 * np.abs(np.sin(y * size * math.pi / 5)) * np.abs(
        np.sin(x * size * math.pi / 3))
    fade = surfaces.fbm(size, size, 5, seed, 5)
    fuzz = surfaces.blur(surfaces.white(size, size, seed + 1), 1)
    return out * (weave * (1 + 0.05 * fade + 0.05 * fuzz))[..., None] * 0.92


def add_boxes(model):
    """Two removal boxes in the south-east corner."""
    model.images["carton.jpg"] = moving_box()
    model.material("cardboard", image="carton.jpg", ks=0.01, ns=8)
    side = (0, 0, 1, 0.72)
    uv = {k: side for k in ("front", "back", "left", "right")}
    uv.update(top=(0, 0.73, 1, 1), bottom=(0, 0.73, 1, 1))
    low = box((0.56, 0.42, 0.36), 0.003, "cardboard", uv=uv).rotated("z",
                                                                     168).moved(1.75, -1.9, FLOOR)
    high = box((0.44, 0.36, 0.28), 0.003, "cardboard",
               uv=uv).rotated("z", 195).moved(1.72, -1.92, FLOOR + 0.36)
    model.add("boxes", low, high)


def add_ceiling(model):
    c, u, v = (CEILING_LIGHT[k] for k in ("center", "half_u", "half_v"))
    w, d = 2 * abs(u[0]), 2 * abs(v[1])
    parts = []
    for s in (-1, 1):
        parts.append(
            box((w + 0.08, 0.038, 0.05), 0.004, "aluminium").moved(y=s * (d / 2 + 0.02),
                                                                   z=c[2] + 0.0003))
        parts.append(
            box((0.038, d + 0.003, 0.05), 0.004, "aluminium").moved(x=s * (w / 2 + 0.02),
                                                                    z=c[2] + 0.0003))
        parts.append(
            tube([(s * 0.3, 0, c[2] + 0.015), (s * 0.3, 0, CEILING)], 0.004, "aluminium", seg=8))
    parts.append(box((w + 0.004, d + 0.004, 0.012), 0.0, "aluminium").moved(z=c[2] + 0.012))
    model.add("lamp_housing", *parts)
    detector = turned([(0, 0.035), (0.05, 0.035), (0.055, 0.0), (0.0, 0.0)][::-1],
                      [0, 0.006, 0.008, 0], "white_paint", seg=24)
    model.add("smoke_detector",
              detector.transformed(np.diag([1, 1, -1.0])).moved(1.1, -1.2, CEILING))
    grille = [box((0.34, 0.34, 0.012), 0.003, "white_paint").moved(-1.2, 1.2, CEILING - 0.0121)]
    grille += [
        box((0.28, 0.008, 0.012), 0.002, "aluminium").moved(-1.2, 1.07 + 0.026 * k, CEILING - 0.023)
        for k in range(11)
    ]
    model.add("grille", *grille)


def add_chair(model):
    """Wooden chair by the south wall, turned a little."""
    legs = []
    for sx in (-1, 1):
        for sy in (-1, 1):
            high = 0.86 if sy > 0 else 0.44
            legs.append(
                tube([(sx * 0.2, sy * 0.19 + (0.04 if sy > 0 else -0.02), 0.0),
                      (sx * 0.185, sy * 0.18, 0.44),
                      (sx * 0.185, 0.18 + 0.07, high)] if sy > 0 else [(sx * 0.2, -0.21, 0.0),
                                                                       (sx * 0.185, -0.18, 0.44)],
                     0.016, "oak", seg=10))
    seat = prism(
        fillet([(-0.21, -0.21), (0.21, -0.21), (0.2, 0.2), (-0.2, 0.2)], 0.05, 4, closed=True),
        0.03, 0.008, "oak")
    slats = [
        box((0.38, 0.018, 0.07), 0.006, "oak", seg=2,
            tile=0.8).moved(0, 0.185 + 0.07 * (z - 0.44) / 0.42, z) for z in (0.54, 0.66, 0.78)
    ]
    cushion = prism(
        fillet([(-0.19, -0.19), (0.19, -0.19), (0.18, 0.16), (-0.18, 0.16)], 0.05, 4, closed=True),
        0.04, 0.018, "teal", bevel_seg=3)
    chair = join(legs, seat.moved(z=0.43), slats, cushion.moved(z=0.459))
    model.add("chair", chair.rotated("z", 205).moved(-1.02, -1.86, FLOOR))
