"""Tileable or fitted textures of raw surfaces: wood, parquet, plaster, fabric, cork, board.

Arrays are (rows, cols, 3), sRGB 0..255, float64.
"""

import numpy as np

from .noise import blur, fbm, rng, upsample, white


def colour(hex_colour):
    return np.array([int(hex_colour[i:i + 2], 16) for i in (1, 3, 5)], float)


def blend(a, b, t):
    """Per-pixel mix of two colours (or pictures) by an array of weights."""
    t = np.clip(t, 0, 1)[..., None]
    return a * (1 - t) + b * t


def smoothstep(a, b, x):
    t = np.clip((x - a) / (b - a), 0, 1)
    return t * t * (3 - 2 * t)


def wood(rows, cols, mm, seed, light="#c9a06c", dark="#8f6236", ring_mm=7.0):
    """Sawn wood, grain along the columns. `mm` is the size of a texel. The growth rings are those
    of a slightly bent trunk cut lengthwise, which gives cathedral figures."""
    random = rng(seed)
    y = (np.arange(rows) - rows * random.uniform(0.25, 0.75))[:, None] * mm
    bends = upsample(random.uniform(-1, 1, (1, max(2, int(cols * mm / 500)))), 1, cols)
    depth = 30 + 34 * bends
    wobble = fbm(rows, cols, 5, seed + 1, 4, stretch=7) * 3.5
    wobble = wobble + fbm(rows, cols, 60, seed + 2, 3, stretch=24) * 0.35
    radius = np.sqrt((y * 0.8 + wobble)**2 + (depth + 0.4 * wobble)**2)
    phase = (radius / ring_mm) % 1.0
    ring = smoothstep(0.2, 0.92, phase) * (1 - smoothstep(0.92, 1.0, phase))
    strength = 0.6 + 0.4 * np.sin(np.floor(radius / ring_mm) * 2.4 + seed)
    fibre = fbm(rows, cols, cols // 2, seed + 3, 2, stretch=24)
    long_fibre = fbm(rows, cols, cols // 5, seed + 4, 3, stretch=40)
    tone = fbm(rows, cols, 3, seed + 5, 3, stretch=3)
    out = blend(colour(light), colour(dark),
                0.2 + 0.3 * ring * strength + 0.035 * fibre + 0.06 * long_fibre + 0.07 * tone)
    length = max(3, int(6 / mm))
    pores = np.cumsum(np.pad(white(rows, cols, seed + 6), ((0, 0), (length, 0)), mode="wrap"),
                      axis=1)
    streak = pores[:, length:] - pores[:, :-length]
    streak = (streak - streak.mean()) / streak.std()
    pore = smoothstep(1.2, 2.6, streak + 0.7 * ring * strength)
    fleck = smoothstep(1.6, 2.6, fbm(rows, cols, cols // 14, seed + 7, 2, stretch=6))
    return out * (1 - 0.30 * pore - 0.10 * fleck)[..., None]


def desk_top(rows, cols, mm, seed):
    """Oiled solid top of seven staves with a coffee ring, scratches, rubbed and darker patches."""
    random = rng(seed)
    edges = np.rint(np.linspace(0, rows, 8)).astype(int)
    out = np.zeros((rows, cols, 3))
    for k in range(7):
        stave = wood(edges[k + 1] - edges[k], cols, mm, seed * 100 + 10 * k,
                     ring_mm=random.uniform(4, 8), light="#cca676", dark="#8d6137")
        shift = np.array([1, random.uniform(0.97, 1.0), random.uniform(0.92, 1.0)])
        out[edges[k]:edges[k + 1]] = stave * random.uniform(0.9, 1.06) * shift
        out[edges[k]] *= 0.80
    y, x = np.mgrid[0:rows, 0:cols] * mm
    for cx, cy, r, force in ((520, 560, 41, 0.2), (548, 585, 41, 0.12), (1215, 250, 38, 0.14)):
        d = np.hypot(x - cx, y - cy)
        t = np.arctan2(y - cy, x - cx)
        gap = smoothstep(-0.6, 0.5, np.sin(1.3 * t + cx) + 0.5 * np.sin(3 * t + cy))
        mark = np.exp(-((d - r) / 1.1)**2) * (0.35 + 0.65 * gap)
        out *= 1 - force * mark[..., None] * np.array([0.8, 1, 1.15])
    for _ in range(70):  # scratches catch the light or dirt
        x0, y0, a = random.uniform(0, 1600), random.uniform(0, 800), random.normal(0, 0.5)
        length, bend = random.uniform(8, 90) * random.uniform(0.2, 1), random.normal(0, 0.002)
        s = np.arange(0, length, mm * 0.5)
        px = ((x0 + s * np.cos(a)) / mm).astype(int) % cols
        py = ((y0 + s * np.sin(a) + bend * s * s) / mm).astype(int) % rows
        out[py, px] *= random.uniform(0.80, 1.18)
    wear = fbm(rows, cols, 5, seed + 9, 5)
    spots = smoothstep(2.6, 3.0, fbm(rows, cols, 60, seed + 10, 3))
    return out * (1 + 0.03 * wear - 0.12 * spots)[..., None]


def parquet(size, tile_m, seed):
    """Oak strip floor, tileable: boards of 90 x 625 mm with dark bevelled joints."""
    random = rng(seed)
    mm = tile_m * 1000 / size
    strips = 28
    out = np.zeros((size, size, 3))
    edges = np.rint(np.linspace(0, size, strips + 1)).astype(int)
    for s in range(strips):
        height = edges[s + 1] - edges[s]
        start = int(random.uniform(0, size))
        boards = 4
        cuts = np.rint(np.linspace(0, size, boards + 1)).astype(int)
        row = np.zeros((height, size, 3))
        for b in range(boards):
            width = cuts[b + 1] - cuts[b]
            t = random.uniform(0, 1)
            light = blend(colour("#bd9362"), colour("#a37a4c"), np.array([t]))[0]
            board = wood(height, width, mm, seed * 1000 + s * 10 + b, ring_mm=9)
            board = board / board.mean(axis=(0, 1)) * light * random.uniform(0.88, 1.08)
            yy = np.minimum(np.arange(height), np.arange(height)[::-1])[:, None]
            xx = np.minimum(np.arange(width), np.arange(width)[::-1])[None, :]
            joint = smoothstep(0.0, 2.2, np.minimum(yy, xx) + 0.35)
            row[:, cuts[b]:cuts[b + 1]] = board * (0.42 + 0.58 * joint[..., None])
        out[edges[s]:edges[s + 1]] = np.roll(row, start, axis=1)
    wear = fbm(size, size, 4, seed + 7, 5)
    return out * (1 + 0.035 * wear[..., None])


def plaster(size, base, seed, strength=1.0):
    """Rolled wall paint over plaster: orange-peel stipple, soft clouds, a few scuffs."""
    peel = blur(white(size, size, seed), 1.0)
    peel = peel / peel.std()
    relief = peel - np.roll(np.roll(peel, 1, 0), 1, 1)
    cloud = fbm(size, size, 3, seed + 1, 5)
    out = colour(base) * (1 + strength * (0.012 * relief + 0.012 * cloud + 0.006 * peel))[..., None]
    scuff = smoothstep(2.3, 3.2, fbm(size, size, 24, seed + 2, 4, stretch=3))
    return out * (1 - 0.05 * strength * scuff[..., None])


def woven(size, threads, base, other, seed):
    """Plain weave, tileable."""
    t = np.arange(size) * threads / size
    a, b = np.meshgrid(t, t)
    over = (np.floor(a) + np.floor(b)) % 2
    warp = np.abs(np.sin(np.pi * a))**0.6
    weft = np.abs(np.sin(np.pi * b))**0.6
    shade = np.where(over > 0, warp * (0.7 + 0.3 * weft), weft * (0.7 + 0.3 * warp))
    fuzz = fbm(size, size, size // 8, seed, 3)
    tint = blend(colour(base), colour(other), np.where(over > 0, 0.25, 0.7))
    return tint * (0.55 + 0.45 * shade + 0.05 * fuzz + 0.03 * fbm(size, size, 4, seed + 1))[...,
                                                                                            None]


def cork(size, seed):
    """Pressed cork: rounded granules of many tones with dark gaps."""
    random = rng(seed)
    count = size * size // 60
    points = random.uniform(0, size, (count, 2))
    best = np.full((size, size), 1e9)
    second = np.full((size, size), 1e9)
    owner = np.zeros((size, size), int)
    reach = 11
    for k, (px, py) in enumerate(points):
        ix, iy = int(px), int(py)
        xs = np.arange(ix - reach, ix + reach + 1)
        ys = np.arange(iy - reach, iy + reach + 1)
        d = np.hypot(xs[None, :] - px, (ys[:, None] - py) * 1.2)
        g = np.ix_(ys % size, xs % size)
        b, s, o = best[g], second[g], owner[g]
        nearer = d < b
        second[g] = np.where(nearer, b, np.minimum(s, d))
        best[g] = np.where(nearer, d, b)
        owner[g] = np.where(nearer, k, o)
    tone = random.normal(0, 1, count)[owner]
    gap = smoothstep(0.2, 2.0, second - best)
    out = blend(colour("#a87b4a"), colour("#d2a873"), 0.5 + 0.24 * tone)
    return out * (0.62 + 0.38 * gap + 0.04 * fbm(size, size, size // 4, seed + 1, 2))[..., None]


def mottled(array, seed, ink=1.2, paper=0.6):
    """Print on board: slight ink mottling and fibre noise on an existing picture."""
    rows, cols = array.shape[:2]
    grain = blur(white(rows, cols, seed), 1)
    grain = grain / grain.std()
    cloud = fbm(rows, cols, 24, seed + 1, 4)
    return np.clip(array + (ink * grain + paper * cloud)[..., None], 0, 255)
