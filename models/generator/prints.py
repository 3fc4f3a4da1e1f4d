"""Elements that packages and posters share: codes, tables, marks, seals, halftones, stamps."""

import math

from .noise import rng

_LEFT = [
    "0001101", "0011001", "0010011", "0111101", "0100011", "0110001", "0101111", "0111011",
    "0110111", "0001011"
]
_PARITY = [
    "LLLLLL", "LLGLGG", "LLGGLG", "LLGGGL", "LGLLGG", "LGGLLG", "LGGGLL", "LGLGLG", "LGLGGL",
    "LGGLGL"
]


def ean13(c, x, y, w, h, twelve, ink="#111111", paper="#fbfaf5"):
    """EAN-13 bar code of twelve digits (the check digit is added), on a quiet zone of its own."""
    digits = [int(d) for d in twelve]
    digits.append(-sum(d * (3 if i % 2 else 1) for i, d in enumerate(digits)) % 10)
    flip = str.maketrans("01", "10")
    bits = "101"
    for d, parity in zip(digits[1:7], _PARITY[digits[0]]):
        code = _LEFT[d]
        bits += code if parity == "L" else code.translate(flip)[::-1]
    bits += "01010" + "".join(_LEFT[d].translate(flip) for d in digits[7:]) + "101"
    module = w / (95 + 18)
    c.rect(x, y, w, h, paper)
    x0 = x + 11 * module
    for i, bit in enumerate(bits):
        if bit == "1":
            guard = i < 3 or i > 91 or 45 <= i < 50
            c.rect(x0 + i * module, y + h * 0.06, module, h * (0.84 if guard else 0.74), ink)
    size = min(h * 0.17, 9.2 * module)
    text = "".join(str(d) for d in digits)
    c.text(x + 2 * module, y + h * 0.96, text[0], size, "ocr", ink)
    c.text(x0 + 24 * module, y + h * 0.96, text[1:7], size, "ocr", ink, "c", tracking=module * 0.6)
    c.text(x0 + 71 * module, y + h * 0.96, text[7:], size, "ocr", ink, "c", tracking=module * 0.6)


def matrix_code(c, x, y, size, seed, ink="#141414", paper="#fbfaf5", n=25):
    """A two-dimensional code: three finder squares and seeded modules."""
    random = rng(seed)
    bits = random.integers(0, 2, (n, n))
    m = size / (n + 4)
    c.rect(x, y, size, size, paper)
    for r in range(n):
        for k in range(n):
            if (r < 8 or r >= n - 8) and k < 8 or r < 8 and k >= n - 8:
                continue
            if bits[r, k]:
                c.rect(x + (k + 2) * m, y + (r + 2) * m, m * 1.03, m * 1.03, ink)
    for r, k in ((0, 0), (0, n - 7), (n - 7, 0)):
        for inset, tone in ((0, ink), (1, paper), (2, ink)):
            side = (7 - 2 * inset) * m
            c.rect(x + (k + 2 + inset) * m, y + (r + 2 + inset) * m, side, side, tone)


def nutrition(c, x, y, w, rows, title="Nutrition declaration", per=("per 100 ml", "per 250 ml"),
              ink="#2a241c", size=2.3, head="#2f6b35", paper="#fffdf6"):
    """Table of rows (name, value, value); names that start with '-' are indented. Returns its
    bottom."""
    step = size * 1.62
    h = step * (len(rows) + 2) + size * 0.5
    c.rect(x, y, w, h, paper, ink, 0.3)
    c.rect(x, y, w, step * 1.05, head)
    c.text(x + 1, y + step * 0.78, title, size * 1.08, "black", "#fdf8ea")
    line = y + step * 2
    a, b = x + w * 0.76, x + w - 1
    c.text(a, line - size * 0.4, per[0], size * 0.86, "heavy", ink, "r")
    c.text(b, line - size * 0.4, per[1], size * 0.86, "heavy", ink, "r")
    c.line(x + 1, line + size * 0.1, x + w - 1, line + size * 0.1, ink, 0.35)
    for i, (name, v1, v2) in enumerate(rows):
        base = line + step * (i + 0.85)
        minor = name.startswith("-")
        if i % 2:
            c.rect(x + 0.2, base - step * 0.78, w - 0.4, step, (0.2, 0.35, 0.2, 0.07))
        c.text(x + (2.6 if minor else 1), base, name.lstrip("- "), size,
               "sans" if minor else "heavy", ink)
        c.text(a, base, v1, size, "sans", ink, "r")
        c.text(b, base, v2, size, "sans", ink, "r")
        c.line(x + 1, base + size * 0.42, x + w - 1, base + size * 0.42, (0, 0, 0, 0.25), 0.1)
    return y + h


def intake(c, x, y, w, items, fill, ink="#2a241c", paper="#fffdf6"):
    """Row of capsules: nutrient, amount, share of the daily intake; 18 mm high."""
    step = w / len(items)
    for i, (name, amount, share) in enumerate(items):
        px = x + i * step + step * 0.05
        pw = step * 0.9
        c.rect(px, y, pw, 17, paper, ink, 0.25, r=pw * 0.42)
        with c.clipped(px, y, pw, 17, pw * 0.42):
            c.rect(px, y + 11, pw, 6, fill)
        c.text(px + pw / 2, y + 4.6, name, 1.9, "heavy", ink, "c")
        c.text(px + pw / 2, y + 9, amount, 3.2, "black", ink, "c")
        c.text(px + pw / 2, y + 15, share, 3.0, "black", "#fffdf6", "c")


def recycling(c, x, y, r, ink="#2f6b35", label="84", sub="C/PAP"):
    """Three chasing arrows with a material code."""
    for k in range(3):
        with c.at(x, y, 120 * k):
            c.poly([(-r * 0.52, r * 0.52), (r * 0.25, r * 0.52), (r * 0.25, r * 0.36),
                    (r * 0.62, r * 0.64), (r * 0.25, r * 0.92), (r * 0.25, r * 0.76),
                    (-r * 0.66, r * 0.76)], ink)
    c.text(x, y + r * 0.22, label, r * 0.55, "black", ink, "c")
    c.text(x, y + r * 1.5, sub, r * 0.45, "heavy", ink, "c")


def bin_mark(c, x, y, s, ink):
    """A person putting litter into a bin."""
    c.circle(x - 0.25 * s, y - 0.82 * s, 0.13 * s, ink)
    c.poly([(x - 0.42 * s, y - 0.62 * s), (x - 0.1 * s, y - 0.62 * s), (x + 0.25 * s, y - 0.42 * s),
            (x + 0.2 * s, y - 0.32 * s), (x - 0.12 * s, y - 0.46 * s), (x - 0.14 * s, y),
            (x - 0.24 * s, y), (x - 0.27 * s, y - 0.25 * s), (x - 0.32 * s, y), (x - 0.42 * s, y)],
           ink)
    c.poly([(x + 0.2 * s, y - 0.22 * s), (x + 0.6 * s, y - 0.22 * s), (x + 0.54 * s, y),
            (x + 0.26 * s, y)], None, ink, 0.07 * s)
    c.rect(x + 0.36 * s, y - 0.4 * s, 0.1 * s, 0.1 * s, ink)


def estimated_sign(c, x, y, size, ink):
    """The 'e' of prepacked goods."""
    c.text(x, y, "e", size, "black", ink)


def ring_text(c, x, y, r, text, size, font="heavy", fill="#ffffff", start=-90.0, tracking=0.0,
              inside=False):
    """Text centred on the angle `start` along a circle; inside: reads along the lower half."""
    widths = [c.text_width(t, size, font) + tracking for t in text]
    total = sum(widths)
    sign = -1 if inside else 1
    angle = math.radians(start) - sign * total / (2 * r)
    for letter, w in zip(text, widths):
        a = angle + sign * w / (2 * r)
        with c.at(x + r * math.cos(a), y + r * math.sin(a),
                  math.degrees(a) + (-90 if inside else 90)):
            c.text(0, 0, letter, size, font, fill, "c")
        angle += sign * w / r


def seal(c, x, y, r, top, middle, bottom, fill="#2f6b35", ink="#fdf6e0", teeth=36, font="black"):
    """Toothed round badge with three lines."""
    points = []
    for i in range(teeth * 2):
        q = r * (1.0 if i % 2 else 0.94)
        t = math.pi * i / teeth
        points.append((x + q * math.cos(t), y + q * math.sin(t)))
    c.poly(points, fill)
    c.circle(x, y, r * 0.84, None, ink, r * 0.025)
    c.circle(x, y, r * 0.60, None, ink, r * 0.012)
    ring_text(c, x, y, r * 0.66, top, r * 0.17, "heavy", ink, -90, r * 0.025)
    ring_text(c, x, y, r * 0.77, bottom, r * 0.17, "heavy", ink, 90, r * 0.025, inside=True)
    lines = middle.split("\n")
    for i, line in enumerate(lines):
        size = min(r * 0.62 / len(lines)**0.5, r * 1.0 / c.text_width(line, 1, font))
        c.text(x, y + size * (0.35 + 0.95 * (i - (len(lines) - 1) / 2)), line, size, font, ink, "c")


def sunburst(c, x, y, r, rays, paint, start=0.0, fraction=0.5):
    for k in range(rays):
        a = math.radians(start) + 2 * math.pi * k / rays
        b = a + 2 * math.pi / rays * fraction
        c.poly([(x, y), (x + r * math.cos(a), y + r * math.sin(a)),
                (x + r * math.cos(b), y + r * math.sin(b))], paint)


def halftone(c, x, y, w, h, pitch, weight, paint, degrees=45.0):
    """Dots whose radius follows weight(u, v) in 0..1 over the unit square."""
    cos, sin = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    n = int(math.hypot(w, h) / pitch) + 2
    with c.clipped(x, y, w, h):
        for i in range(-n, n):
            for j in range(-n, n):
                px = w / 2 + (i * cos - j * sin) * pitch
                py = h / 2 + (i * sin + j * cos) * pitch
                if -pitch < px < w + pitch and -pitch < py < h + pitch:
                    t = weight(min(max(px / w, 0), 1), min(max(py / h, 0), 1))
                    if t > 0.01:
                        c.circle(x + px, y + py, pitch * 0.68 * math.sqrt(min(t, 1)), paint)


def stamp(c, x, y, text, size, seed, ink="#1d2230"):
    """Ink-jet coding: mono letters broken into dots, slightly uneven."""
    random = rng(seed)
    for letter in text:
        dy = random.normal(0, size * 0.02)
        c.text(x, y + dy, letter, size, "mono",
               (*[int(ink[i:i + 2], 16) / 255 for i in (1, 3, 5)], random.uniform(0.72, 0.95)),
               bold=True)
        x += size * 0.62


def droplets(c, x, y, w, h, count, seed, light="#ffffff", size=(0.6, 2.4)):
    """Water drops: a dark rim, a bright foot, a highlight and a cast shadow."""
    from .canvas import radial
    random = rng(seed)
    for _ in range(count):
        px, py = x + random.uniform(0, w), y + random.uniform(0, h)
        r = size[0] + (size[1] - size[0]) * random.uniform(0, 1)**3
        ry = r * random.uniform(1.0, 1.25)
        c.ellipse(px + r * 0.18, py + r * 0.22, r, ry, (0.2, 0.08, 0, 0.28))
        c.ellipse(
            px, py, r, ry,
            radial(px, py, ry, (0, (1, 1, 1, 0.10)), (0.75, (0.3, 0.12, 0, 0.14)),
                   (1, (0.2, 0.07, 0, 0.42))))
        c.ellipse(px + r * 0.25, py + ry * 0.38, r * 0.5, ry * 0.34, (1, 1, 0.92, 0.42))
        c.ellipse(px - r * 0.35, py - ry * 0.4, r * 0.22, ry * 0.18, (1, 1, 1, 0.92))
