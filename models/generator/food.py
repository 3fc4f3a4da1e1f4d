"""Food pieces for package pictures (shapes for Relief.put): pasta, cereal, berries, leaves."""

import math

import numpy as np

from .noise import fbm, rng
from .relief import Relief, ball, leaf
from .surfaces import blend, colour


def _turn(x, y, degrees):
    a = math.radians(degrees)
    return x * math.cos(a) + y * math.sin(a), -x * math.sin(a) + y * math.cos(a)


def fusilli(length, radius, degrees, seed, tone="#f0cb74", dark="#c98f35"):
    """Three-bladed screw seen from the side."""

    def shape(x, y):
        u, v = _turn(x, y, degrees)
        v = v - 0.05 * length * np.sin(u / length * 2.5 + seed)
        h = np.where(
            np.abs(v) < 0.35 * radius, np.sqrt(np.clip((0.35 * radius)**2 - v * v, 0, None)), -1e9)
        phase = 2 * math.pi * u / (2.3 * radius * 1.5) + seed
        for k in range(3):
            a = phase + 2 * math.pi * k / 3
            reach = radius * np.cos(a)
            on = (v * reach > 0) & (np.abs(v) < np.abs(reach)) & (np.sin(a) > 0)
            rel = np.clip(np.abs(v) / np.maximum(np.abs(reach), 1e-6), 0, 1)
            z = np.minimum(np.abs(v * np.tan(a)), radius) - 0.14 * radius * rel**6
            h = np.maximum(h, np.where(on, z, -1e9))
        on = (np.abs(u) < length / 2 + 0.15 * radius * np.sin(3 * v / radius)) & (h > -1e8)
        t = np.clip(h / radius, 0, 1)
        c = blend(colour(dark), colour(tone), 0.35 + 0.7 * t + 0.08 * fbm(*x.shape, 8, seed, 3))
        return np.where(on, h, -1e9), c, np.full_like(h, 0.16)

    return shape


def penne(length, radius, degrees, seed, tone="#f1cf7e", dark="#cf9a41"):
    """Ridged tube with slanted, open ends."""

    def shape(x, y):
        u, v = _turn(x, y, degrees)
        w = np.clip(v / radius, -1, 1)
        h = radius * np.sqrt(1 - w * w)
        ridge = np.cos(13 * np.arcsin(w))
        slant = u - 0.9 * v
        on = (np.abs(v) < radius) & (np.abs(slant) < length / 2)
        mouth = ((slant - length / 2 + 0.42 * radius) / (0.42 * radius))**2 + (w / 0.78)**2 < 1
        c = blend(colour(dark), colour(tone), 0.72 + 0.2 * ridge + 0.08 * fbm(*x.shape, 8, seed, 3))
        c = np.where(mouth[..., None], colour("#8a5a1e"), c)
        h = h + 0.05 * radius * ridge - np.where(mouth, 0.8 * radius, 0)
        return np.where(on, h, -1e9), c, np.where(mouth, 0.0, 0.18)

    return shape


def flake(radius, seed, tone="#dda348", dark="#9c5f1f"):
    """Toasted cereal flake: an irregular, buckled sheet with blisters."""
    random = rng(seed)
    lobes = random.uniform(-0.16, 0.16, 6)
    phases = random.uniform(0, 6.28, 6)
    tilt = random.uniform(-0.35, 0.35, 2)

    def shape(x, y):
        r, t = np.hypot(x, y * 1.15) / radius, np.arctan2(y, x)
        rim = 0.85 + sum(a * np.cos((k + 2) * t + p) for k, (a, p) in enumerate(zip(lobes, phases)))
        n = fbm(*x.shape, 5, seed, 4)
        on = r < rim
        h = radius * (0.25 + 0.10 * n + 0.28 * r**2) + tilt[0] * x + tilt[1] * y
        c = blend(colour(tone), colour(dark), 0.35 + 0.22 * n + 0.6 * (r / np.maximum(rim, 0.1))**5)
        return np.where(on, h, -1e9), c, np.full_like(h, 0.2)

    return shape


def berry(radius, seed):
    """Blueberry with bloom and crown."""
    base = ball(radius, "#4a5a8c", "#232b52", seed, pores=0.4, gloss=0.2, mottle=0.6)

    def shape(x, y):
        h, c, gloss = base(x, y)
        d = np.hypot(x - 0.2 * radius, y - 0.25 * radius) / radius
        t = np.arctan2(y - 0.25 * radius, x - 0.2 * radius)
        crown = (d < 0.30 + 0.07 * np.cos(5 * t)) & (d > 0.16)
        c = np.where(crown[..., None], colour("#1b2042"), c)
        return h - 0.12 * radius * np.exp(-(d / 0.2)**2), c, gloss

    return shape


def tomato(radius, seed):
    """Tomato with five green sepals."""
    base = ball(radius, "#cf3b22", "#8f1d12", seed, gloss=0.8, squash=0.9, mottle=0.35)

    def shape(x, y):
        h, c, gloss = base(x, y)
        dx, dy = x - 0.08 * radius, y - 0.42 * radius
        d, t = np.hypot(dx, dy * 1.5) / radius, np.arctan2(dy * 1.5, dx)
        star = d < 0.11 + 0.34 * np.abs(np.cos(2.5 * t + 0.4))**3
        c = np.where(star[..., None], blend(colour("#6c9a3c"), colour("#35601f"), d * 1.6), c)
        h = h + np.where(star, 0.06 * radius, 0) - 0.12 * radius * np.exp(-(d / 0.3)**2)
        return h, c, np.where(star, 0.1, gloss)

    return shape


def grain_of(length, width, degrees, seed, tone="#3c2a18", dark="#1a120a"):
    """Dry leaf crumb or seed."""

    def shape(x, y):
        u, v = _turn(x, y, degrees)
        q = (2 * u / length)**2 + (2 * v / width + 0.3 * np.sin(4 * u / length))**2
        h = width / 2 * np.sqrt(np.clip(1 - q, 0, 1))
        c = blend(colour(tone), colour(dark), 0.5 + 0.3 * fbm(*x.shape, 4, seed, 3))
        return np.where(q < 1, h, -1e9), c, np.full_like(h, 0.15)

    return shape


def heap(rows, cols, make, count, reach, seed, background="#6b3f14", rise=6.0, stack=0.0):
    """Loose pieces filling a picture: make(random, index) -> shape. A piece lies up to 3 `rise`
    pixels high at random, and `stack` pixels above the one before it."""
    random = rng(seed)
    r = Relief(rows, cols, colour(background))
    # Stratified places, so that the ground is covered evenly, in random order.
    across = max(1, int(math.sqrt(count * cols / rows)))
    down = max(1, count // across)
    places = random.permutation(count)
    for k in range(count):
        cx = (places[k] % across + random.uniform(0, 1)) / across * cols
        cy = ((places[k] // across) % down + random.uniform(0, 1)) / down * rows
        r.put(cx, cy, reach, make(random, k), rise * random.uniform(0, 3) + stack * k)
    return r


def basil(r, x, y, size, seed):
    """A tuft of three basil leaves on a relief."""
    for k, d in enumerate((20, 140, 255)):
        r.put(x, y, size * 1.15, leaf(size, size * 0.52, d, seed + k, "#5c9b3c", "#2a6425"), 90)
