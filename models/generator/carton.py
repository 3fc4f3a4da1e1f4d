"""Gable-top juice carton with a screw cap."""

import math

import numpy as np

from .carton_print import ATLAS, draw_atlas
from .mesh import Model, Patch, join, rotation
from .shapes import turned

HALF = 0.048  # half width and depth
CREASE = 0.001  # radius of the vertical board creases
BODY = 0.178  # height of the body
RIDGE = 0.220  # where the two roof panels meet the fin
TOP = 0.240
FIN = 0.0011  # half thickness of the fin
TUCK = 0.034  # how far the side gussets are folded in
PERIMETER = 4 * 2 * (HALF - CREASE) + 2 * math.pi * CREASE
PANEL = PERIMETER / 4


def ring():
    """Cross section from the middle of the front-left crease, counter-clockwise:
    rows (x, y, nx, ny, arc length); three points per crease."""
    rows, c = [], HALF - CREASE
    for k, (sx, sy) in enumerate(((-1, -1), (1, -1), (1, 1), (-1, 1), (-1, -1))):
        for j in (-1, 0, 1):
            if (k == 0 and j < 0) or (k == 4 and j > 0):
                continue
            t = math.radians(-135 + 90 * k + 45 * j)
            n = (math.cos(t), math.sin(t))
            along = k * PANEL + j * CREASE * math.pi / 4
            rows.append((sx * c + CREASE * n[0], sy * c + CREASE * n[1], *n, along))
    return np.array(rows)


def quads(levels, uvs, normals, mat):
    """Strips between successive levels of the same number of points."""
    count = len(levels[0])
    faces = []
    for a in range(len(levels) - 1):
        for i in range(count - 1):
            faces.append(
                (a * count + i, a * count + i + 1, (a + 1) * count + i + 1, (a + 1) * count + i))
    return Patch(np.vstack(levels), np.vstack(normals), np.vstack(uvs), faces, [mat] * len(faces))


def flat(points, uvs, mat):
    """A planar polygon as a fan, counter-clockwise from outside."""
    p = np.array(points, float)
    n = sum(np.cross(p[i - 1] - p[0], p[i] - p[0]) for i in range(2, len(p)))
    faces = [(0, i, i + 1) for i in range(1, len(p) - 1)]
    return Patch(p, np.tile(n / np.linalg.norm(n), (len(p), 1)), np.array(uvs, float), faces,
                 [mat] * len(faces))


def uv(along, up):
    """Metres on the unfolded sheet (from the left edge of the front panel, from the bottom)."""
    return (along * 1000 / ATLAS["width"], (ATLAS["roll"] + up * 1000) / ATLAS["height"])


def body():
    rows = ring()
    xy, n2, along = rows[:, :2], rows[:, 2:4], rows[:, 4]
    # The fold at the top turns the wall by `lean` into the roof panel or the gusset.
    slope_front = math.atan2(HALF - FIN, RIDGE - BODY)
    slope_side = math.atan2(TUCK, RIDGE - BODY)
    lean = np.array([slope_front * abs(b)**2 + slope_side * abs(a)**2 for a, b in n2])
    r = CREASE
    levels, normals, uvs, heights = [], [], [], []

    def add(offset, z, tilt, up):
        levels.append(np.column_stack([xy - n2 * np.reshape(offset, (-1, 1)), z]))
        normals.append(np.column_stack([n2 * np.cos(tilt)[:, None], np.sin(tilt)]))
        uvs.append(np.array([uv(s, u) for s, u in zip(along, up)]))
        heights.append(up)

    one = np.ones(len(xy))
    for k in range(3):  # bottom edge
        t = math.radians(-90 + 45 * k)
        add(one * r * (1 - math.cos(t)), one * r * (1 + math.sin(t)), one * t, one * r * (1 + t))
    cut = r * np.tan(lean / 2)
    for k in range(3):  # fold into the roof
        t = lean * k / 2
        add(r * (1 - np.cos(t)), BODY - cut + r * np.sin(t), t, BODY - cut + r * t)
    return rows, quads(levels, uvs, normals, "board"), levels[-1], heights[-1], levels[0]


def roof(rows, base, up):
    """Roof panels, gussets and fin above the ring `base`."""
    patches, width = [], HALF - 0.0004
    slant = math.hypot(HALF - FIN, RIDGE - BODY) + BODY
    ridge = {(-1, -1): (-width, -FIN, RIDGE), (1, -1): (width, -FIN, RIDGE),
             (1, 1): (width, FIN, RIDGE), (-1, 1): (-width, FIN, RIDGE)}
    corners = ((-1, -1), (1, -1), (1, 1), (-1, 1))
    for side in range(4):
        # The ring's points on a panel: crease middle, panel start, panel end, crease middle.
        i = [3 * side + k for k in range(4)]
        left, right = np.array(ridge[corners[side]]), np.array(ridge[corners[(side + 1) % 4]])
        e = [uv(rows[j, 4], up[j]) for j in i]
        el, er = uv(side * PANEL, slant), uv((side + 1) * PANEL, slant)
        p = [base[j] for j in i]
        if side % 2 == 0:
            patches.append(flat([p[1], p[2], right, left], [e[1], e[2], er, el], "board"))
        else:
            sx = 1 if side == 1 else -1
            apex = np.array([sx * (HALF - TUCK), 0, RIDGE - 0.004])
            ea = uv((side + 0.5) * PANEL, slant)
            patches.append(flat([p[1], p[2], apex], [e[1], e[2], ea], "board"))
            patches.append(flat([p[1], apex, left], [e[1], ea, el], "board"))
            patches.append(flat([p[2], right, apex], [e[2], er, ea], "board"))
            patches.append(flat([left, apex, right], [el, ea, er], "board"))
        patches.append(flat([p[0], p[1], left], [e[0], e[1], el], "board"))
        patches.append(flat([p[2], p[3], right], [e[2], e[3], er], "board"))
    section = [(-FIN, RIDGE, -1, 0)]
    for k in range(5):
        t = math.radians(180 - 45 * k)
        section.append((FIN * math.cos(t), TOP - FIN + FIN * math.sin(t), math.cos(t), math.sin(t)))
    section.append((FIN, RIDGE, 1, 0))
    levels, normals, uvs, rise = [], [], [], slant
    for k, (y, z, ny, nz) in enumerate(section):
        rise += math.hypot(y - section[k - 1][0], z - section[k - 1][1]) if 0 < k < 4 else 0
        levels.append(np.array([(-width, y, z), (width, y, z)]))
        normals.append(np.array([(0, ny, nz)] * 2))
        up_here = rise if k < 4 else slant + (z - RIDGE)
        lo, hi = (0, PANEL) if k < 4 else (3 * PANEL, 2 * PANEL)
        uvs.append(np.array([uv(lo, up_here), uv(hi, up_here)]))
        if k == 3:  # the print of the back panel begins at the middle of the fin
            levels.append(levels[-1])
            normals.append(normals[-1])
            uvs.append(np.array([uv(3 * PANEL, rise), uv(2 * PANEL, rise)]))
    fin = quads(levels, uvs, normals, "board")
    patches.append(fin)
    edge = [ATLAS["edge"][0] / ATLAS["width"], 1 - ATLAS["edge"][1] / ATLAS["height"]]
    for sx in (1, -1):
        end = [(sx * width, y, z) for y, z, _, _ in section]
        patches.append(flat(end if sx < 0 else end[::-1], [edge] * len(end), "board"))
    return join(patches)


def cap():
    """Screw cap on the middle of the front roof panel."""
    profile = [(0, -0.001), (0.0165, -0.001), (0.0165, 0.0014), (0.0138, 0.0016), (0.0138, 0.0036),
               (0.0146, 0.0038), (0.0142, 0.0145), (0, 0.0145)]
    radii = [0, 0, 0.0005, 0.0003, 0.0003, 0.0005, 0.0014, 0]
    rows = turned(profile, radii, "cap", seg=36, bevel_seg=2)
    x0, y0, w, h = (ATLAS["cap"][k] for k in range(4))
    radius = np.hypot(rows.p[:, 0], rows.p[:, 1])
    on_top = rows.p[:, 2] > 0.0135
    # The top is mapped as a disc, the side as a strip of ribs.
    disc = np.column_stack(
        [x0 + w / 2 + rows.p[:, 0] * 1000 * 0.5, y0 + w / 2 - rows.p[:, 1] * 1000 * 0.5])
    strip = np.column_stack([x0 + rows.uv[:, 0] * w, y0 + h - rows.p[:, 2] * 1000 * 0.5])
    mm = np.where((on_top & (radius < 0.0141))[:, None], disc, strip)
    rows.uv = np.column_stack([mm[:, 0] / ATLAS["width"], 1 - mm[:, 1] / ATLAS["height"]])
    tilt = math.degrees(math.atan2(RIDGE - BODY, HALF - FIN))
    middle = (0, -(HALF + FIN) / 2 - 0.002, (BODY + RIDGE) / 2 - 0.002 * (RIDGE - BODY) / HALF)
    return rows.transformed(rotation("x", tilt), middle)


def build():
    model = Model("orange_juice_carton")
    model.material("board", image="carton.jpg", ks=0.04, ns=60)
    model.material("cap", image="carton.jpg", ks=0.05, ns=120)
    rows, walls, base, up, foot = body()
    count = len(foot) - 1
    edge = [ATLAS["edge"][0] / ATLAS["width"], 1 - ATLAS["edge"][1] / ATLAS["height"]]
    bottom = flat(foot[:count][::-1], [edge] * count, "board")
    model.add("carton", walls, roof(rows, base, up), bottom)
    model.add("cap", cap())
    model.images["carton.jpg"] = draw_atlas()
    return model
