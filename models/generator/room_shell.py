"""Desk, floor, walls, ceiling and lights of the room. World frame: z = 0 is the desk top."""

import numpy as np

from . import surfaces
from .canvas import picture
from .mesh import Patch
from .shapes import box

FLOOR, CEILING = -0.74, 1.86
X, Y = 2.5, 2.3  # half extents of the room
DESK = (1.6, 0.8, 0.028)
CEILING_LIGHT = {
    "center": (0.0, 0.0, 1.80), "half_u": (0.44, 0.0, 0.0), "half_v": (0.0, -0.28, 0.0),
    "radiance": (50.0, 45.0, 37.0)
}
WINDOW_LIGHT = {
    "center": (-2.42, 0.15, 0.62), "half_u": (0.0, 0.55, 0.0), "half_v": (0.0, 0.0, 0.55),
    "radiance": (7.0, 8.2, 10.0)
}


def quad(corners, mat, rect=(0, 0, 1, 1)):
    """Flat rectangle, corners counter-clockwise from the lower left."""
    p = np.array(corners, float)
    n = np.cross(p[1] - p[0], p[3] - p[0])
    u0, v0, u1, v1 = rect
    uv = np.array([(u0, v0), (u1, v0), (u1, v1), (u0, v1)], float)
    return Patch(p, np.tile(n / np.linalg.norm(n), (4, 1)), uv, [(0, 1, 2, 3)], [mat])


def add_desk(model):
    model.images["desk.jpg"] = picture(surfaces.desk_top(1024, 2048, 0.78125, 11))
    model.material("desk", image="desk.jpg", ks=0.04, ns=90)
    model.material("steel", kd=(0.035, 0.036, 0.04), ks=0.05, ns=60)
    lx, ly, lz = DESK
    edge = 0.06
    rim = {
        "top": (0, 0, 1, 1), "front": (0, 0, 1, edge / 2), "back": (0, 1 - edge / 2, 1, 1),
        "left": (0, 0, 0.03, 1), "right": (0.97, 0, 1, 1), "bottom": (0, 1, 1, 0)
    }
    model.add("desk_top", box(DESK, 0.003, "desk", seg=2, uv=rim).moved(z=-lz))
    legs = []
    for sx in (-1, 1):
        for sy in (-1, 1):
            leg = box((0.05, 0.05, -FLOOR - lz + 0.001), 0.003, "steel")
            legs.append(leg.moved(sx * (lx / 2 - 0.06), sy * (ly / 2 - 0.06), FLOOR))
    for sy in (-1, 1):
        legs.append(
            box((lx - 0.17, 0.025, 0.05), 0.002, "steel").moved(y=sy * (ly / 2 - 0.06),
                                                                z=-lz - 0.0505))
    model.add("desk_legs", *legs)


def add_shell(model):
    model.images["floor.jpg"] = picture(surfaces.parquet(1024, 2.5, 21))
    model.images["wall.jpg"] = picture(surfaces.plaster(1024, "#d9d5cb", 22))
    model.material("floor", image="floor.jpg", ks=0.04, ns=60)
    model.material("wall", image="wall.jpg", ks=0.01, ns=10)
    model.material("ceiling", image="wall.jpg", ks=0.01, ns=5)
    a, b = 2 * X / 2.5, 2 * Y / 2.5
    h = CEILING - FLOOR
    model.add(
        "floor",
        quad([(-X, -Y, FLOOR), (X, -Y, FLOOR), (X, Y, FLOOR), (-X, Y, FLOOR)], "floor",
             (0, 0, a, b)))
    model.add(
        "ceiling",
        quad([(-X, Y, CEILING), (X, Y, CEILING), (X, -Y, CEILING), (-X, -Y, CEILING)], "ceiling",
             (0, 0, 4, 4)))
    walls = []
    corners = [(X, -Y), (X, Y), (-X, Y), (-X, -Y)]
    for k in range(4):
        (x1, y1), (x0, y0) = corners[k - 1], corners[k]
        width = abs(x1 - x0) + abs(y1 - y0)
        walls.append(
            quad([(x0, y0, FLOOR), (x1, y1, FLOOR), (x1, y1, CEILING), (x0, y0, CEILING)], "wall",
                 (0, 0, width / h * 2, 2)))
    model.add("walls", *walls)


def light_quad(light, mat, back, rect=(0, 0, 1, 1), grow=1.0):
    c, u, v = (np.array(light[k], float) for k in ("center", "half_u", "half_v"))
    n = np.cross(u, v)
    c = c - n / np.linalg.norm(n) * back
    u, v = u * grow, v * grow
    return quad([c - u - v, c + u - v, c + u + v, c - u + v], mat, rect)


def add_lights(model):
    model.material("lamp_glow", ke=CEILING_LIGHT["radiance"], ks=0.0)
    model.add("lamp_panel", light_quad(CEILING_LIGHT, "lamp_glow", 0.001))


def environment_yaml():
    lines = [
        "# Lights emit towards cross(half_u, half_v); radiance in W/(sr m^2) up to one scale.",
        "mesh: room_desk.obj", "lights:"
    ]
    for light in (CEILING_LIGHT, WINDOW_LIGHT):
        fields = ", ".join(f"{k}: [{', '.join(str(float(v)) for v in light[k])}]"
                           for k in ("center", "half_u", "half_v", "radiance"))
        lines.append(f"  - {{type: area, {fields}}}")
    lines += [
        "surfaces:", f"  desk: {{z: 0.0, x: [{-DESK[0] / 2}, {DESK[0] / 2}],"
        f" y: [{-DESK[1] / 2}, {DESK[1] / 2}]}}",
        f"  floor: {{z: {FLOOR}, x: [{-X}, {X}], y: [{-Y}, {Y}]}}"
    ]
    return "\n".join(lines) + "\n"
