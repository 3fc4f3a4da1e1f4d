"""Photo-like illustrations: small height fields with colour, lit and composited with shadows."""

import math

import numpy as np
from PIL import Image

from .noise import blur, fbm, rng, upsample
from .surfaces import blend, colour, smoothstep


class Relief:
    """A z-buffer of height (pixels), colour (linear-ish 0..255) and gloss; start empty."""

    def __init__(self, rows, cols, background=None):
        self.z = np.full((rows, cols), -1e3 if background is None else 0.0)
        self.rgb = np.zeros((rows, cols, 3))
        if background is not None:
            self.rgb[:] = background
        self.gloss = np.zeros((rows, cols))
        self.cover = np.zeros((rows, cols)) if background is None else np.ones((rows, cols))

    def put(self, cx, cy, half, shape, lift=0.0):
        """shape(x, y) over a window about (cx, cy) gives (height or -inf, rgb, gloss), y up."""
        rows, cols = self.z.shape
        x0, x1 = max(0, int(cx - half)), min(cols, int(cx + half) + 1)
        y0, y1 = max(0, int(cy - half)), min(rows, int(cy + half) + 1)
        if x0 >= x1 or y0 >= y1:
            return
        x, y = np.meshgrid(np.arange(x0, x1) - cx, cy - np.arange(y0, y1))
        h, tone, gloss = shape(x, y)
        window = (slice(y0, y1), slice(x0, x1))
        front = (h > -1e2) & (h + lift > self.z[window])
        self.z[window] = np.where(front, h + lift, self.z[window])
        self.rgb[window] = np.where(front[..., None], tone, self.rgb[window])
        self.gloss[window] = np.where(front, gloss, self.gloss[window])
        self.cover[window] = np.where(front, 1.0, self.cover[window])

    def light(self, sun=(-0.5, 0.62, 0.6), ambient=0.5, depth=12.0, soften=0.7, bump=1.0):
        """RGB array 0..255: Lambert, a highlight, darker where the neighbourhood is higher."""
        z = np.where(self.cover > 0, self.z, 0.0)
        smooth = blur(z, soften, wrap=False) if soften else z
        gy, gx = np.gradient(smooth)
        n = np.dstack([-gx * bump, gy * bump, np.ones_like(z)])
        n /= np.linalg.norm(n, axis=2, keepdims=True)
        s = np.array(sun) / np.linalg.norm(sun)
        lambert = np.clip(n @ s, 0, 1)
        half = s + np.array([0, 0, 1.0])
        shine = np.clip(n @ (half / np.linalg.norm(half)), 0, 1)**60
        shade = np.ones_like(z)
        for scale in (2, 6, 16):
            around = blur(z, scale, wrap=False)
            shade *= 1 - 0.42 * np.clip((around - z) / (depth * scale / 6), 0, 1)
        lit = (ambient * (0.75 + 0.25 * n[..., 2]) + (1.2 - ambient) * lambert) * shade
        deep = np.clip(1 - lit, 0, 1)[..., None]  # light bounces: shadows gain saturation
        out = self.rgb * (self.rgb / 255)**(0.9 * deep) * (lit**0.85)[..., None] + 235 * (
            self.gloss * shine * shade)[..., None]
        return np.clip(out, 0, 255)

    def picture(self, shrink=2, **keys):
        """RGBA image, antialiased by `shrink`."""
        data = np.dstack([self.light(**keys), self.cover * 255])
        data[..., :3] *= data[..., 3:] / 255
        rows, cols = data.shape[0] // shrink, data.shape[1] // shrink
        data = data[:rows * shrink, :cols * shrink].reshape(rows, shrink, cols, shrink, 4)
        data = data.mean(axis=(1, 3))
        data[..., :3] /= np.maximum(data[..., 3:], 1) / 255
        return Image.fromarray(np.rint(np.clip(data, 0, 255)).astype(np.uint8), "RGBA")


def ball(radius, tone, dark, seed, pores=0.0, gloss=0.35, squash=1.0, mottle=0.25, stem=None):
    """Round fruit; `pores` is the depth of the peel's dimples in pixels."""

    def shape(x, y):
        q = (x / radius)**2 + (y / (radius * squash))**2
        inside = q < 1
        h = radius * np.sqrt(np.clip(1 - q, 0, 1))
        rows, cols = x.shape
        dimples = fbm(rows, cols, max(4, int(cols / 7)), seed, 2)
        cloud = fbm(rows, cols, 3, seed + 1, 4)
        facing = np.sqrt(np.clip(1 - q, 0, 1))
        h = h + pores * np.minimum(dimples, 0.4) * facing
        c = blend(colour(tone), colour(dark), mottle * (0.5 + 0.4 * cloud) + 0.25 * (1 - facing))
        if stem:
            d = np.hypot(x - radius * stem[0], y - radius * stem[1]) / radius
            spot = 1 - smoothstep(0.05, 0.09, d)
            c = blend(c, colour("#5d6b2c"), spot)
            h = h - radius * 0.10 * np.exp(-(d / 0.12)**2) + radius * 0.03 * spot
        return np.where(inside, h, -1e9), c, np.full_like(h, gloss) * (1 + 0.3 * dimples)

    return shape


def citrus_slice(radius, seed, flesh=("#f7a823", "#e8780c"), rind="#f08a12", segments=10, turn=0.2):
    """Cut citrus face: rind, pith, segments with juice vesicles."""
    random = rng(seed)
    sizes = 1 + random.uniform(-0.13, 0.13, segments)
    bounds = np.concatenate([[0], np.cumsum(sizes)]) / sizes.sum() * 2 * math.pi

    def shape(x, y):
        r = np.hypot(x, y) / radius
        t = (np.arctan2(y, x) + turn) % (2 * math.pi)
        k = np.clip(np.searchsorted(bounds, t, side="right") - 1, 0, segments - 1)
        half = (bounds[k + 1] - bounds[k]) / 2
        off = t - bounds[k] - half
        side = (half - np.abs(off)) * r  # distance to the membrane, in radii
        outer = 0.855 - 0.05 * (np.abs(off) / half)**4
        edge = np.minimum(np.minimum(side - 0.012, outer - r), r - 0.10)
        inside = smoothstep(0.0, 0.022, edge)
        # Vesicles: cells drawn out along the radius, with a pointed inner end.
        angular = 44 / (2 * math.pi)
        cell_t = t * angular * (1 + 0.0 * r)
        cell_r = r * 5.2 + 0.37 * np.floor(cell_t)
        jitter = upsample(random.uniform(-1, 1, (64, 64)), *x.shape)
        ct = (cell_t + 0.25 * jitter) % 1 - 0.5
        cr = (cell_r + 0.3 * jitter) % 1 - 0.5
        vesicle = np.clip(1 - (ct / 0.5)**2 - (cr / 0.56)**2, 0, 1)
        glow = fbm(*x.shape, 14, seed + 3, 4)
        c = blend(colour(flesh[1]), colour(flesh[0]),
                  0.25 + 0.6 * vesicle + 0.12 * glow + 0.25 * (r - 0.5))
        c = c * (0.9 + 0.14 * smoothstep(0.0, 0.15, edge))[..., None]
        pith = blend(colour("#f8e8be"), colour("#f6cf86"), 0.4 + 0.25 * glow)
        c = blend(pith, c, inside)
        skin = smoothstep(0.925, 0.945, r)
        c = blend(c, colour(rind) * np.ones_like(c), skin)
        h = 2.2 * inside * (0.3 + 0.7 * np.sqrt(vesicle)) + 6 * (1 - smoothstep(0.965, 1.0, r))
        return np.where(r < 1, h, -1e9), c, 0.05 + 0.5 * inside * vesicle

    return shape


def leaf(length, width, degrees, seed, tone="#5f9a35", dark="#2c6426"):
    """Pointed leaf from the origin along `degrees`, with midrib and veins."""
    a = math.radians(degrees)

    def shape(x, y):
        u = (x * math.cos(a) + y * math.sin(a)) / length
        v = (-x * math.sin(a) + y * math.cos(a)) / length
        v = v - 0.10 * np.sin(math.pi * np.clip(u, 0, 1))
        w = width / length * np.sin(math.pi * np.clip(u, 0, 1)**0.8)**0.9
        inside = (u > 0) & (u < 1) & (np.abs(v) < w / 2)
        rel = np.abs(v) / np.maximum(w / 2, 1e-6)
        vein = np.abs(((u - 0.55 * np.abs(v) * 1.2) * 9) % 1 - 0.5)
        ridge = smoothstep(0.36, 0.48, vein) * (1 - rel) + 1.5 * (1 - smoothstep(0.0, 0.09, rel))
        h = length * (0.07 * (1 - (1 - rel)**2) + 0.05 * np.sin(math.pi * np.clip(u, 0, 1)))
        h = h - 0.006 * length * ridge
        c = blend(colour(tone), colour(dark), 0.35 + 0.2 * fbm(*x.shape, 5, seed, 4) - 0.3 * ridge)
        return np.where(inside, h, -1e9), c, np.full_like(h, 0.25)

    return shape
