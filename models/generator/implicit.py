"""Smooth closed surfaces from a function that is negative inside (surface nets)."""

import numpy as np

from .mesh import Patch


def smooth_max(a, b, k):
    h = np.clip(0.5 + 0.5 * (a - b) / k, 0, 1)
    return b + (a - b) * h + k * h * (1 - h)


def smooth_min(a, b, k):
    return -smooth_max(-a, -b, k)


def gradient(f, p, step=1e-5):
    columns = []
    for axis in range(3):
        d = np.zeros(3)
        d[axis] = step
        columns.append((f(p + d) - f(p - d)) / (2 * step))
    return np.column_stack(columns)


def surface_net(f, low, high, cell, mat, relax=6):
    """Quad mesh of f = 0: one vertex per crossed cell, relaxed along the surface and projected on
    it; normals are those of f. f takes points (k, 3)."""
    low, high = np.asarray(low, float), np.asarray(high, float)
    n = np.ceil((high - low) / cell).astype(int) + 1
    axes = [low[a] + cell * (np.arange(n[a]) + 0.37) for a in range(3)]
    grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
    inside = (f(grid.reshape(-1, 3)) < 0).reshape(n)
    corners = [
        inside[i:n[0] - 1 + i, j:n[1] - 1 + j, k:n[2] - 1 + k] for i in (0, 1) for j in (0, 1)
        for k in (0, 1)
    ]
    count = sum(c.astype(int) for c in corners)
    crossed = (count > 0) & (count < 8)
    index = np.full(crossed.shape, -1)
    index[crossed] = np.arange(crossed.sum())
    p = (grid[:-1, :-1, :-1] + cell / 2)[crossed]
    faces = []
    for axis in range(3):
        a, b = (axis + 1) % 3, (axis + 2) % 3
        first, second = np.take(inside, range(n[axis] - 1),
                                axis), np.take(inside, range(1, n[axis]), axis)
        for cut in np.argwhere(first != second):
            if min(cut[a], cut[b]) == 0:
                continue
            around = []
            for da, db in ((-1, -1), (0, -1), (0, 0), (-1, 0)):
                q = cut.copy()
                q[a] += da
                q[b] += db
                around.append(int(index[tuple(q)]))
            faces.append(tuple(around if first[tuple(cut)] else around[::-1]))
    neighbours = [set() for _ in p]
    for face in faces:
        for i in range(4):
            neighbours[face[i]].update((face[i - 1], face[(i + 1) % 4]))
    links = np.array([(i, j) for i, s in enumerate(neighbours) for j in sorted(s)])
    degree = np.bincount(links[:, 0], minlength=len(p))[:, None]
    for _ in range(relax):
        total = np.column_stack(
            [np.bincount(links[:, 0], p[links[:, 1], a], len(p)) for a in range(3)])
        p = p + 0.6 * (total / degree - p)
        for _ in range(2):
            g = gradient(f, p)
            p = p - (f(p) / np.maximum((g * g).sum(axis=1), 1e-9))[:, None] * g
    g = gradient(f, p)
    normals = g / np.linalg.norm(g, axis=1, keepdims=True)
    return Patch(p, normals, np.zeros((len(p), 2)), faces, [mat] * len(faces))


def split_views(patch, view, floor=0.0):
    """Splits a skin by its facing into front, back and side views of `view` metres above `floor`
    and sets uv: front and back in the upper half of the texture, the sides below the front."""
    p, n, uv, faces = [], [], [], []
    face_normals = [patch.n[list(f)].mean(axis=0) for f in patch.faces]
    for side in range(3):
        rows = {}
        for f, m in zip(patch.faces, face_normals):
            if (0 if m[1] < -0.35 else 1 if m[1] > 0.35 else 2) != side:
                continue
            for i in f:
                if i not in rows:
                    rows[i] = len(p)
                    x, y, z = patch.p[i]
                    across = (x, -x, y)[side]
                    p.append(patch.p[i])
                    n.append(patch.n[i])
                    uv.append(((across + view[0] / 2) / (2 * view[0]) + (0, 0.5, 0)[side],
                               (z - floor) / (2 * view[1]) + (0.5, 0.5, 0)[side]))
            faces.append(tuple(rows[i] for i in f))
    return Patch(np.array(p), np.array(n), np.array(uv), faces, patch.mats)
