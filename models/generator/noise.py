"""Seeded noise, float64 throughout, so that textures come out the same on every machine."""

import numpy as np


def rng(seed):
    return np.random.Generator(np.random.PCG64(seed))


def fbm(height, width, cells, seed, octaves=6, gain=0.55, stretch=1.0):
    """Tileable fractal value noise, about zero mean and unit deviation. `cells` of the coarsest
    octave lie along the width; stretch > 1 draws the pattern out along the width."""
    random = rng(seed)
    out = np.zeros((height, width))
    amplitude = 1.0
    for octave in range(octaves):
        nx = max(1, int(round(cells * 2**octave / stretch)))
        ny = max(1, int(round(cells * 2**octave * height / width)))
        if nx > width or ny > height:
            break
        out += amplitude * upsample(random.uniform(-1, 1, (ny, nx)), height, width)
        amplitude *= gain
    return (out - out.mean()) / (out.std() + 1e-12)


def upsample(grid, height, width):
    """Periodic cubic interpolation of a coarse grid."""
    return _cubic(_cubic(grid, width).T, height).T


def _cubic(a, size):
    n = a.shape[1]
    x = (np.arange(size) + 0.5) * n / size - 0.5
    i = np.floor(x).astype(int)
    t = x - i
    w = [((-0.5 * t + 1) * t - 0.5) * t, (1.5 * t - 2.5) * t * t + 1,
         ((-1.5 * t + 2) * t + 0.5) * t, (0.5 * t - 0.5) * t * t]
    return sum(w[k] * a[:, (i + k - 1) % n] for k in range(4))


def white(height, width, seed):
    return rng(seed).standard_normal((height, width))


def blur(a, sigma, wrap=True):
    """Gaussian blur by three box passes in each axis (exact to a few percent, cheap)."""
    r = max(1, int(round(sigma)))
    for axis in (0, 1):
        for _ in range(3):
            pad = [(0, 0)] * a.ndim
            pad[axis] = (r + 1, r)
            c = np.cumsum(np.pad(a, pad, mode="wrap" if wrap else "edge"), axis=axis)
            n = a.shape[axis]
            high = np.take(c, np.arange(2 * r + 1, 2 * r + 1 + n), axis=axis)
            low = np.take(c, np.arange(0, n), axis=axis)
            a = (high - low) / (2 * r + 1)
    return a
