"""Solids with rounded edges and exact smooth normals: boxes, lathes, prisms, tubes, sheets."""

import math

import numpy as np

from .mesh import Patch, join

# name: (normal, u axis, v axis) with u x v = normal.
BOX_FACES = {
    "front": ((0, -1, 0), (1, 0, 0), (0, 0, 1)), "right": ((1, 0, 0), (0, 1, 0), (0, 0, 1)),
    "back": ((0, 1, 0), (-1, 0, 0), (0, 0, 1)), "left": ((-1, 0, 0), (0, -1, 0), (0, 0, 1)),
    "top": ((0, 0, 1), (1, 0, 0), (0, 1, 0)), "bottom": ((0, 0, -1), (1, 0, 0), (0, -1, 0))
}


def box(size, radius=0.001, mat="", seg=1, uv=None, mats=None, tile=None, skip=()):
    """Rounded box resting on z = 0. `uv` maps a face to its rectangle (u0, v0, u1, v1) of the
    texture; with `tile` (metres per texture repeat) coordinates are metric. The bevel of each edge
    has `seg` strips on either face, and the print runs on over it. skip: faces left out."""
    half = np.array(size, float) / 2
    inner = half - radius
    angles = [math.pi / 4 * i / seg for i in range(seg + 1)] if radius > 0 else [0.0]
    patches = []
    for face, axes in BOX_FACES.items():
        if face in skip:
            continue
        n, a, b = (np.array(v, float) for v in axes)
        ha, hb, hn = (abs(v) @ inner for v in (a, b, n))

        def steps(h):
            low = [(-h, -t) for t in reversed(angles)]
            return low + [(h, t) for t in angles]

        rows, cols = steps(hb), steps(ha)
        p, nrm, uvs = [], [], []
        rect = (uv or {}).get(face, (0, 0, 1, 1))
        for sb, tb in rows:
            for sa, ta in cols:
                d = n + math.tan(ta) * a + math.tan(tb) * b
                d /= np.linalg.norm(d)
                p.append(n * hn + a * sa + b * sb + radius * d)
                nrm.append(d)
                ea, eb = sa + radius * ta, sb + radius * tb
                if tile:
                    uvs.append((ea / tile, eb / tile))
                else:
                    ra, rb = ha + radius * angles[-1], hb + radius * angles[-1]
                    s, t = (ea / ra + 1) / 2, (eb / rb + 1) / 2
                    uvs.append(
                        (rect[0] + s * (rect[2] - rect[0]), rect[1] + t * (rect[3] - rect[1])))
        w = len(cols)
        faces = [(r * w + c, r * w + c + 1, (r + 1) * w + c + 1, (r + 1) * w + c)
                 for r in range(len(rows) - 1) for c in range(w - 1)]
        name = (mats or {}).get(face, mat)
        patches.append(Patch(np.array(p), np.array(nrm), np.array(uvs), faces, [name] * len(faces)))
    return join(patches).moved(z=half[2])


def fillet(points, radii=0.0, seg=3, closed=False):
    """Rounds the corners of a plane polyline. Returns rows (x, y, nx, ny), normal to the right of
    the way (outwards for a counter-clockwise outline). A corner of radius 0 gives two rows."""
    pts = [np.array(q, float) for q in points]
    count = len(pts)
    radii = [radii] * count if np.isscalar(radii) else list(radii)
    out = []

    def right(d):
        return np.array([d[1], -d[0]])

    for i, q in enumerate(pts):
        if not closed and i in (0, count - 1):
            d = pts[1] - q if i == 0 else q - pts[i - 1]
            out.append(np.concatenate([q, right(d / np.linalg.norm(d))]))
            continue
        d0, d1 = q - pts[i - 1], pts[(i + 1) % count] - q
        l0, l1 = np.linalg.norm(d0), np.linalg.norm(d1)
        d0, d1 = d0 / l0, d1 / l1
        turn = math.atan2(d0[0] * d1[1] - d0[1] * d1[0], d0 @ d1)
        if abs(turn) < 1e-6:
            out.append(np.concatenate([q, right(d0)]))
            continue
        cut = min(radii[i] * math.tan(abs(turn) / 2), 0.499 * l0, 0.499 * l1)
        if cut < 1e-9:
            out.append(np.concatenate([q, right(d0)]))
            out.append(np.concatenate([q, right(d1)]))
            continue
        r = cut / math.tan(abs(turn) / 2)
        centre = q - d0 * cut - right(d0) * r * math.copysign(1, turn)
        for k in range(seg + 1):
            t = turn * k / seg
            n = right(d0)
            n = np.array(
                [n[0] * math.cos(t) - n[1] * math.sin(t), n[0] * math.sin(t) + n[1] * math.cos(t)])
            out.append(np.concatenate([centre + n * r * math.copysign(1, turn), n]))
    return np.array(out)


def arc_length(rows):
    step = np.linalg.norm(np.diff(rows[:, :2], axis=0), axis=1)
    return np.concatenate([[0.0], np.cumsum(step)])


def lathe(rows, mat, seg=32, rect=(0, 0, 1, 1), tile=None):
    """Turns rows (r, z, nr, nz), from the bottom up along the outside, about the z axis. u runs
    counter-clockwise from +y, so that u = 1/2 faces -y; v follows the arc length."""
    length = arc_length(rows)
    v = length / (tile or max(length[-1], 1e-9))
    if not tile:
        v = rect[1] + v * (rect[3] - rect[1])
    p, n, uv = [], [], []
    for k in range(seg + 1):
        t = math.pi / 2 + 2 * math.pi * (k % seg) / seg
        c, s = math.cos(t), math.sin(t)
        p += [(r * c, r * s, z) for r, z, _, _ in rows]
        n += [(a * c, a * s, b) for _, _, a, b in rows]
        u = rect[0] + k / seg * (rect[2] - rect[0])
        uv += [(u, w) for w in v]
    w = len(rows)
    faces = []
    for k in range(seg):
        for i in range(w - 1):
            same = np.linalg.norm(rows[i, :2] - rows[i + 1, :2]) < 1e-9
            if same or (rows[i, 0] < 1e-9 and rows[i + 1, 0] < 1e-9):
                continue
            a, b, c, d = k * w + i, (k + 1) * w + i, (k + 1) * w + i + 1, k * w + i + 1
            if rows[i, 0] < 1e-9:
                faces.append((a, c, d))
            elif rows[i + 1, 0] < 1e-9:
                faces.append((a, b, d))
            else:
                faces.append((a, b, c, d))
    return Patch(np.array(p), np.array(n), np.array(uv), faces, [mat] * len(faces))


def turned(points, radii, mat, seg=32, bevel_seg=2, **keys):
    """Lathe of a polyline (r, z) with rounded corners."""
    return lathe(fillet(points, radii, bevel_seg), mat, seg, **keys)


def prism(outline, height, bevel, mat, bevel_seg=2, cap_mat=None, scale_top=1.0):
    """Upright prism on z = 0 over rows of `fillet(..., closed=True)`, counter-clockwise and star
    shaped about its mean; top and bottom edges are rounded. uv: metres, planar on the caps."""
    rows = np.vstack([outline, outline[:1]])
    centre = outline[:, :2].mean(axis=0)
    along = arc_length(rows)
    rings = []
    steps = [math.pi / 2 * k / bevel_seg for k in range(bevel_seg + 1)]
    for t in steps:
        rings.append((bevel * (1 - math.sin(t)), bevel * (1 - math.cos(t)), -math.cos(t)))
    for t in reversed(steps):
        rings.append((bevel * (1 - math.sin(t)), height - bevel * (1 - math.cos(t)), math.cos(t)))
    patches = []
    p, n, uv = [], [], []
    for inset, z, nz in rings:
        flat = math.sqrt(max(0.0, 1 - nz * nz))
        grow = 1 + (scale_top - 1) * z / height
        for row, s in zip(rows, along):
            q = centre + (row[:2] - inset * row[2:] - centre) * grow
            p.append((q[0], q[1], z))
            n.append((row[2] * flat, row[3] * flat, nz))
            uv.append((s, z))
    w = len(rows)
    faces = [(j * w + i, j * w + i + 1, (j + 1) * w + i + 1, (j + 1) * w + i)
             for j in range(len(rings) - 1) for i in range(w - 1)
             if np.linalg.norm(rows[i, :2] - rows[i + 1, :2]) > 1e-9]
    patches.append(Patch(np.array(p), np.array(n), np.array(uv), faces, [mat] * len(faces)))
    for top in (False, True):
        ring = np.array(p[-w:] if top else p[:w])
        q = np.vstack([ring, [[centre[0], centre[1], ring[0, 2]]]])
        normal = np.tile([0, 0, 1.0 if top else -1.0], (w + 1, 1))
        tris = [(i, i + 1, w) if top else (i + 1, i, w) for i in range(w - 1)
                if np.linalg.norm(ring[i] - ring[i + 1]) > 1e-9]
        patches.append(Patch(q, normal, q[:, :2].copy(), tris, [cap_mat or mat] * len(tris)))
    return join(patches)


def tube(path, radius, mat, seg=10, closed=False, round_ends=True, tile=0.05):
    """Round tube along a polyline (k, 3); `radius` may vary along it. Closed at both ends."""
    path = np.array(path, float)
    radius = np.broadcast_to(np.asarray(radius, float), (len(path), )).copy()
    if closed:
        tangent = np.roll(path, -1, 0) - np.roll(path, 1, 0)
    else:
        tangent = np.gradient(path, axis=0)
    tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
    side = np.cross(tangent[0], [0, 0, 1] if abs(tangent[0, 2]) < 0.9 else [1, 0, 0])
    frames = []
    for t in tangent:
        side = side - t * (side @ t)
        side /= np.linalg.norm(side)
        frames.append((side, np.cross(t, side)))
    rings = [(path[i], radius[i], frames[i], tangent[i], 0.0) for i in range(len(path))]
    if closed:  # the twist that is left over is spread over all rings
        twist = math.atan2(frames[-1][0] @ frames[0][1], frames[-1][0] @ frames[0][0])
        for i, (q, r, (sa, sb), t, w) in enumerate(rings):
            c, s = math.cos(twist * i / len(rings)), -math.sin(twist * i / len(rings))
            rings[i] = (q, r, (sa * c + sb * s, sb * c - sa * s), t, w)
        rings.append(rings[0])
    else:
        for end, sign in ((0, -1), (-1, 1)):
            q, r, frame, t, _ = rings[end]
            tip = []
            for w in (math.pi / 4, math.pi / 2) if round_ends else (math.pi / 2, ):
                tip.append((q + sign * t * r * math.sin(w), r * math.cos(w), frame, t, sign * w))
            if not round_ends:
                flat = sign * math.pi / 2
                tip = [(q, r, frame, t, flat), (q, 0.0, frame, t, flat)]
            rings = tip[::-1] + rings if end == 0 else rings + tip
    p, n, uv, along = [], [], [], 0.0
    for j, (q, r, (a, b), t, tilt) in enumerate(rings):
        along += np.linalg.norm(q - rings[j - 1][0]) if j else 0.0
        for i in range(seg + 1):
            w = 2 * math.pi * (i % seg) / seg
            d = a * math.cos(w) + b * math.sin(w)
            p.append(q + r * d)
            n.append(d * math.cos(tilt) + t * math.sin(tilt))
            uv.append((i / seg, along / tile))
    return Patch(np.array(p), np.array(n), np.array(uv), *grid_faces(len(rings), seg + 1, mat))


def grid_faces(rows, cols, mat):
    faces = [(r * cols + c, r * cols + c + 1, (r + 1) * cols + c + 1, (r + 1) * cols + c)
             for r in range(rows - 1) for c in range(cols - 1)]
    return faces, [mat] * len(faces)


def sheet(points, mat, uv=None, normals=None):
    """Smooth grid (rows, cols, 3); outside is cols direction x rows direction. Normals by finite
    differences unless given; uv defaults to the unit square."""
    points = np.asarray(points, float)
    rows, cols, _ = points.shape
    if normals is None:
        normals = np.cross(np.gradient(points, axis=1), np.gradient(points, axis=0))
        length = np.linalg.norm(normals, axis=2, keepdims=True)
        normals = normals / np.where(length > 1e-15, length, 1)
    if uv is None:
        uu, vv = np.meshgrid(np.linspace(0, 1, cols), np.linspace(0, 1, rows))
        uv = np.stack([uu, vv], axis=2)
    return Patch(points.reshape(-1, 3),
                 np.asarray(normals).reshape(-1, 3),
                 np.asarray(uv, float).reshape(-1, 2), *grid_faces(rows, cols, mat))


def shell(points, mat, thickness, uv=None):
    """Closed thin sheet: `sheet` with a back side and a rim."""
    front = sheet(points, mat, uv)
    rows, cols, _ = np.asarray(points).shape
    back = Patch(front.p - front.n * thickness, -front.n, front.uv, [f[::-1] for f in front.faces],
                 front.mats)
    index = np.arange(rows * cols).reshape(rows, cols)
    loop = np.concatenate([index[0, :-1], index[:-1, -1], index[-1, :0:-1], index[:0:-1, 0]])
    following = np.roll(loop, -1)
    side = np.cross(front.p[following] - front.p[loop], front.n[loop])
    side /= np.maximum(np.linalg.norm(side, axis=1, keepdims=True), 1e-12)
    n = len(loop)
    p = np.vstack([front.p[loop], back.p[loop]])
    quads = [(k, k + n, (k + 1) % n + n, (k + 1) % n) for k in range(n)]
    rim = Patch(p, np.vstack([side, side]), np.vstack([front.uv[loop]] * 2), quads, [mat] * n)
    return join(front, back, rim)
