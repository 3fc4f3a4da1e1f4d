"""What hangs on the walls: pictures, boards, window, door, clock, sockets.

Wall coordinates, as seen by a viewer who faces the wall: x to the right from its middle, y into the
wall (0 on its face), z the world's height.
"""

import math

import numpy as np

from . import room_boards, room_prints
from .mesh import Patch, join
from .room_shell import CEILING, FLOOR, WINDOW_LIGHT, X, Y, light_quad
from .shapes import box, fillet, shell, tube, turned

TURN = {"north": 0, "east": -90, "south": 180, "west": 90}
OFFSET = {"north": (0, Y), "east": (X, 0), "south": (0, -Y), "west": (-X, 0)}


def on_wall(patch, wall, x=0.0, z=0.0):
    ox, oy = OFFSET[wall]
    return patch.moved(x=x, z=z).rotated("z", TURN[wall]).moved(x=ox, y=oy)


def board(w, h, depth, mat, r=0.001, **keys):
    """Slab lying on the wall, centred at the origin."""
    return box((w, depth, h), r, mat, **keys).moved(y=-depth / 2, z=-h / 2)


def frame(w, h, border, depth, mat):
    """Four bars around a w x h opening."""
    bars = [
        board(w + 2 * border, border, depth, mat, 0.002).moved(z=s * (h + border) / 2)
        for s in (-1, 1)
    ]
    return bars + [
        board(border, h + 0.002, depth, mat, 0.002).moved(x=s * (w + border) / 2) for s in (-1, 1)
    ]


def disc(radius, mat, seg=40):
    """Round picture facing the viewer, 0 at the wall."""
    t = 2 * math.pi * np.arange(seg) / seg
    rim = np.column_stack([np.cos(t), np.zeros(seg), np.sin(t)])
    p = np.vstack([rim * radius, [[0, 0, 0]]])
    uv = np.vstack([0.5 + 0.5 * rim[:, [0, 2]], [[0.5, 0.5]]])
    faces = [(i, (i + 1) % seg, seg) for i in range(seg)]
    return Patch(p, np.tile([0, -1.0, 0], (seg + 1, 1)), uv, faces, [mat] * seg)


# name: wall, x and z of the middle, width, height, frame material or None
PICTURES = {
    "jazz": ("north", -0.98, 0.62, 0.50, 0.70, "black_frame"),
    "alpine": ("north", -0.25, 0.66, 0.60, 0.80, "oak_frame"),
    "lake": ("north", 0.60, 0.70, 0.70, 0.50, "black_frame"), "world_map": ("south", 0.55, 0.62,
                                                                            1.40, 0.90, None),
    "elements": ("south", -0.95, 0.66, 0.90, 0.60, None), "planet": ("west", -1.55, 0.60, 0.50,
                                                                     0.70, "oak_frame"),
    "botanical": ("west", 1.60, 0.62, 0.40, 0.50, "white_frame"),
    "swiss": ("east", 0.44, 0.62, 0.50, 0.70, "white_frame"), "camera": ("south", -1.85, 0.62, 0.60,
                                                                         0.80, "black_frame")
}


def add_pictures(model):
    for name, kd in (("black_frame", (0.02, 0.02, 0.021)), ("white_frame", (0.72, 0.71, 0.68))):
        model.material(name, kd=kd, ks=0.04, ns=120)
    for name, (wall, x, z, w, h, mat) in PICTURES.items():
        model.images[f"{name}.jpg"] = getattr(room_prints, name)()
        model.material(name, image=f"{name}.jpg", ks=0.03 if mat else 0.02, ns=200 if mat else 30)
        parts = []
        if mat:
            parts += frame(w, h, 0.022, 0.024, mat)
            parts.append(board(w + 0.01, h + 0.01, 0.010, name, 0.0))
        else:
            parts.append(poster(w, h, name))
            parts += [
                pin(sx * (w / 2 - 0.02), sz * (h / 2 - 0.02)) for sx in (-1, 1) for sz in (-1, 1)
            ]
        model.add(f"picture_{name}", on_wall(join(parts), wall, x, z))


def poster(w, h, mat):
    """Unframed sheet: a little wavy, its lower corners curl off the wall."""
    u, v = np.meshgrid(np.linspace(-1, 1, 13), np.linspace(-1, 1, 9))
    out = 0.004 + 0.0015 * np.sin(2.1 * u + 1.3 * v) + 0.012 * np.clip(-v, 0, 1)**3 * np.abs(u)**3
    return shell(np.dstack([u * w / 2, -out, v * h / 2]), mat, 0.0008)


def pin(x, z):
    head = turned([(0, 0.0), (0.0035, 0.0), (0.0048, 0.006), (0, 0.0075)], [0, 0, 0.002, 0],
                  "brass", seg=10)
    return head.rotated("x", 90).moved(x, -0.004, z)


def add_boards(model):
    model.images["cork.jpg"] = room_boards.cork_board()
    model.images["whiteboard.jpg"] = room_boards.whiteboard()
    model.images["calendar.jpg"] = room_boards.calendar()
    model.images["clock.png"] = room_boards.clock_face()
    model.material("cork", image="cork.jpg", ks=0.01, ns=8)
    model.material("whiteboard", image="whiteboard.jpg", ks=0.05, ns=400)
    model.material("calendar", image="calendar.jpg", ks=0.03, ns=60)
    model.material("clock_face", image="clock.png", ks=0.04, ns=300)
    model.add(
        "cork_board",
        on_wall(
            join(frame(1.0, 0.7, 0.025, 0.022, "oak_frame"), board(1.01, 0.71, 0.012, "cork", 0.0)),
            "north", 1.72, 0.62))
    tray = board(0.5, 0.012, 0.06, "aluminium").moved(z=-0.468)
    pens = [
        tube([(-0.12 + 0.11 * k, -0.03, -0.453), (0.0 + 0.1 * k, -0.035, -0.453)], 0.008,
             ("marker_red", "marker_blue", "steel")[k], seg=8) for k in range(3)
    ]
    model.material("marker_red", kd=(0.5, 0.04, 0.03), ks=0.04, ns=100)
    model.material("marker_blue", kd=(0.03, 0.07, 0.35), ks=0.04, ns=100)
    model.add(
        "whiteboard",
        on_wall(
            join(frame(1.2, 0.9, 0.018, 0.02, "aluminium"),
                 board(1.21, 0.91, 0.012, "whiteboard", 0.0), tray, pens), "east", -0.62, 0.58))
    model.add("calendar", on_wall(board(0.30, 0.45, 0.004, "calendar", 0.0005), "west", -1.1, 0.52))
    ring = turned([(0.145, 0.001), (0.165, 0.001), (0.165, 0.035), (0.149, 0.045), (0.145, 0.02)],
                  [0, 0.004, 0.01, 0.003, 0], "black_frame", seg=48).rotated("x", 90)
    model.add("clock",
              on_wall(join(ring,
                           disc(0.1455, "clock_face").moved(y=-0.02)), "east", 1.42, 1.52))


def add_window(model):
    model.images["garden.jpg"] = room_prints.garden()
    model.material("window_glow", image="garden.jpg", ke=WINDOW_LIGHT["radiance"], ks=0.0, ns=5)
    model.add("window_view", light_quad(WINDOW_LIGHT, "window_glow", 0.001))
    y0, z0 = WINDOW_LIGHT["center"][1], WINDOW_LIGHT["center"][2]
    s = 1.10
    parts = frame(s, s, 0.075, 0.075, "white_paint")
    sill = box((s + 0.36, 0.22, 0.035), 0.004, "white_paint", seg=2).moved(y=-0.11, z=-s / 2 - 0.11)
    model.add("window_frame", on_wall(join(parts, sill), "west", y0, z0))
    rod = tube([(-1.08, -0.12, 0.74), (1.08, -0.12, 0.74)], 0.012, "black_frame", seg=10)
    knobs = [
        turned([(0, -0.024), (0.024, 0), (0, 0.024)], [0, 0.012, 0], "black_frame",
               seg=12).moved(s_ * 1.095, -0.12, 0.74) for s_ in (-1, 1)
    ]
    curtains = [curtain(-1.05, -0.70, 1), curtain(0.70, 1.05, 2)]
    model.add("curtains", on_wall(join(rod, knobs, curtains), "west", y0, z0))


def curtain(x0, x1, seed):
    """Pleated cloth, front and back, from the rod to just above the skirting."""
    u = np.linspace(0, 1, 49)
    v = np.linspace(0, 1, 15)
    uu, vv = np.meshgrid(u, v)
    deep = 0.030 * (0.55 + 0.45 * (1 - vv)) * np.sin(2 * math.pi * 6.5 * uu + seed +
                                                     0.5 * np.sin(3 * vv + 5 * uu))
    x = x0 + (x1 - x0) * uu + 0.006 * np.sin(2 * math.pi * 6.5 * uu + 1.2)
    z = -1.24 + 1.98 * vv
    front = np.dstack([x, -0.12 + deep - 0.0015, z])
    uv = np.dstack([uu * 2.2, vv * 5.5])
    return shell(front, "curtain", 0.0015, uv)


def add_door(model):
    w, h, bottom = 0.86, 2.02, FLOOR
    parts = [
        board(0.09, h + 0.09, 0.03, "white_paint",
              0.004).moved(x=s * (w + 0.09) / 2, z=bottom + (h + 0.09) / 2) for s in (-1, 1)
    ]
    parts.append(board(w + 0.002, 0.09, 0.03, "white_paint", 0.004).moved(z=bottom + h + 0.045))
    parts.append(board(w, h, 0.012, "door", 0.002).moved(z=bottom + h / 2))
    for z, ph in ((0.55, 0.72), (1.45, 0.84)):
        parts += [b.moved(z=bottom + z) for b in frame(0.56, ph, 0.03, 0.024, "door")]
        parts.append(board(0.5, ph - 0.06, 0.020, "door", 0.008).moved(z=bottom + z))
    plate = board(0.04, 0.2, 0.018, "aluminium", 0.003).moved(x=-0.37, z=bottom + 1.03)
    lever = tube([(-0.37, -0.01, bottom + 1.06), (-0.37, -0.055, bottom + 1.06),
                  (-0.36, -0.062, bottom + 1.06), (-0.25, -0.062, bottom + 1.06)], 0.009,
                 "aluminium", seg=10)
    model.add("door", on_wall(join(parts, plate, lever), "east", 1.42))
    switch = join(board(0.085, 0.085, 0.010, "white_paint", 0.003),
                  board(0.06, 0.06, 0.016, "white_paint", 0.003))
    model.add("switch", on_wall(switch, "east", 0.85, 0.18 - 0.02))


def socket():
    plate = board(0.085, 0.085, 0.011, "white_paint", 0.003)
    bowl = turned([(0.016, 0.0105), (0.021, 0.0105), (0.021, 0.014), (0.019, 0.014),
                   (0.0185, 0.0108), (0.0, 0.0108)], [0, 0, 0.0008, 0.0008, 0, 0], "white_paint",
                  seg=12)
    holes = [
        turned([(0.0028, 0.0105), (0.0028, 0.0112), (0, 0.0112)], 0, "black_frame",
               seg=6).moved(x=s * 0.0095) for s in (-1, 1)
    ]
    return join(plate, join(bowl, holes).rotated("x", 90))


def add_trim(model):
    """Skirting boards, coving, sockets."""
    door = (-1.95, -0.89)  # gap in the skirting, world y
    profile = fillet([(0.0, 0.0), (0.016, 0.0), (0.016, 0.062), (0.006, 0.08), (0.0, 0.08)],
                     [0, 0.001, 0.004, 0.004, 0], 2)

    def run(wall, x0, x1, rows, mat, z, flip=1):
        p, n, uv = [], [], []
        for x in (x0, x1):
            for d, h, nd, nh in rows:
                p.append((x, -d, z + flip * h))
                n.append((0, -nd, flip * nh))
                uv.append((x, h))
        k = len(rows)
        faces = [(i, i + k, i + k + 1, i + 1) if flip > 0 else (i, i + 1, i + k + 1, i + k)
                 for i in range(k - 1)]
        return on_wall(Patch(np.array(p), np.array(n), np.array(uv), faces, [mat] * len(faces)),
                       wall)

    lengths = {"north": X, "south": X, "west": Y, "east": Y}
    coving = fillet([(0.0, 0.0), (0.05, 0.0), (0.045, 0.012), (0.012, 0.045), (0.0, 0.05)],
                    [0, 0, 0.005, 0.005, 0], 2)
    parts = []
    for wall, half in lengths.items():
        spans = [(-half, half)] if wall != "east" else [(-half, -door[1]), (-door[0], half)]
        parts += [run(wall, a, b, profile, "white_paint", FLOOR) for a, b in spans]
        parts.append(run(wall, -half, half, coving, "white_paint", CEILING, -1))
    model.add("trim", *parts)
    model.add(
        "sockets", *[
            on_wall(socket(), wall, x + dx, FLOOR + 0.3)
            for wall, x in (("north", -1.05), ("south", 0.4), ("east", -0.1), ("west", -1.35))
            for dx in (0, 0.088)
        ])
