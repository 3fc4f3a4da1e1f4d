"""Posters and pictures on the walls. Each function returns a picture; sizes in millimetres."""

import math

import numpy as np

from .canvas import Canvas, linear, picture, radial
from .noise import blur, fbm, rng, upsample
from .prints import sunburst
from .relief import Relief, ball, leaf
from .surfaces import blend, colour, mottled, smoothstep

PAPER, INK = "#efe9da", "#23262b"


def finish(c, seed, ink=1.4):
    return picture(mottled(c.array() * 0.94 + 4, seed, ink=ink, paper=1.2))


def jazz():
    """500 x 700: overlapping discs and stripes with large type."""
    c = Canvas(500, 700, 512, 1024, "#e9dfc6")
    for k, (x, y, r, tone) in enumerate(((170, 250, 150, "#c8452e"), (330, 300, 130, "#1f4e6b"),
                                         (250, 420, 110, "#e0a02f"), (390, 150, 60, "#23262b"))):
        c.circle(x, y, r, (*[int(tone[i:i + 2], 16) / 255 for i in (1, 3, 5)], 0.9))
        for j in range(5):
            c.circle(x, y, r * (0.22 + 0.13 * j), None, (0.95, 0.9, 0.78, 0.55), 2)
    for k in range(9):
        c.rect(40 + 12 * k, 330, 5, 190 - 14 * k, INK)
    c.poly([(250, 40), (262, 40), (330, 520), (300, 520)], INK)
    c.rect(0, 540, 500, 160, "#1f4e6b")
    c.text(36, 612, "HARBOUR", 88, "display", "#f2ead6", bold=True)
    c.text(36, 678, "JAZZ", 76, "display", "#e0a02f", bold=True)
    c.text(180, 652, "12 – 15 June · Pier 9", 24, "heavy", "#f2ead6")
    c.text(180, 680, "Quartet Ono / Lida Brandt / The Low Tide", 15.5, "medium", "#cfdbe0")
    c.text(464, 70, "XXIV", 40, "slab", INK, "r", bold=True)
    return finish(c, 301)


def alpine():
    """600 x 800: travel poster, layered mountains."""
    c = Canvas(600, 800, 512, 1024, "#f1d9a8")
    c.rect(0, 0, 600, 800, linear(0, 0, 0, 620, (0, "#2c6a86"), (0.55, "#8fbcb8"), (1, "#f3d39a")))
    sunburst(c, 400, 300, 700, 36, (1, 0.95, 0.75, 0.16))
    c.circle(400, 250, 62, "#f6e2ae")
    random = rng(302)
    tones = ["#8ba7ad", "#5f8794", "#3c6a6f", "#2d5547", "#1f3d33"]
    for k, tone in enumerate(tones):
        base, rough = 330 + 75 * k, 120 - 18 * k
        n = 60
        t = np.linspace(0, 1, n)
        ridge = sum(
            upsample(random.uniform(-1, 1, (1, 3 * 2**j)), 1, n)[0] / 1.8**j for j in range(4))
        pts = [(600 * a, base - rough * b) for a, b in zip(t, ridge)]
        c.poly([(-5, 805)] + pts + [(605, 805)], tone)
        if k < 2:
            for (x, y) in pts[::1]:
                if y < base - rough * 0.35:
                    c.poly([(x, y), (x + 14, y + 26), (x + 4, y + 20), (x - 5, y + 30),
                            (x - 12, y + 18)], (0.97, 0.96, 0.92, 0.85))
    for k in range(46):
        x, h = random.uniform(0, 600), random.uniform(28, 64)
        y = 690 + random.uniform(-40, 60)
        for j in range(4):
            c.poly([(x - h * 0.1 * (j + 1.5), y - h * (0.65 - 0.22 * j)),
                    (x, y - h * (1.05 - 0.2 * j)),
                    (x + h * 0.1 * (j + 1.5), y - h * (0.65 - 0.22 * j))], "#18332b")
    c.curve([(-10, 640), (150, 610), (260, 650), (420, 600), (610, 640)], None, "#7a3b2b", 7)
    for k in range(7):
        c.rect(205 + 34 * k, 618 + 3 * math.sin(k), 31, 17, "#b23a2a", r=3)
        c.rect(209 + 34 * k, 621 + 3 * math.sin(k), 23, 6, "#f3e2b6")
    c.rect(0, 712, 600, 88, "#b23a2a")
    c.fit(300, 766, 520, "ALPENBAHN", "display", 66, fill="#f6e8c8", align="c", bold=True,
          tracking=6)
    c.text(300, 785, "over the high pass in four hours", 16, "serif", "#f6e8c8", "c", italic=True)
    c.rect(8, 8, 584, 784, None, "#f6e8c8", 5)
    return finish(c, 303)


def botanical():
    """400 x 500: pressed-leaf study with captions, inside a wide margin."""
    r = Relief(1000, 800)
    stem = [(400, 900), (410, 700), (385, 500), (400, 300), (420, 130)]
    random = rng(304)
    for k in range(11):
        t = k / 10
        y = 880 - 720 * t
        x = 400 + 14 * math.sin(6 * t)
        for side in (0, 1):
            d = (28 + 30 * t) if side else 180 - (28 + 30 * t)
            size = 250 * (1 - 0.5 * abs(t - 0.3)) * random.uniform(0.9, 1.05)
            r.put(x, y, 280, leaf(size, size * 0.34, d, 305 + 2 * k + side, "#7f9a62", "#3f5a3a"),
                  6 * k)
    art = r.picture(2, ambient=0.7)
    c = Canvas(400, 500, 512, 512, "#ece4cf")
    c.rect(28, 28, 344, 444, None, "#8b7d62", 0.8)
    c.curve([(x * 0.33 + 68, y * 0.33 + 50) for x, y in stem], None, "#6b7a46", 2.5)
    c.paste(art, 68, 50, 264, 330)
    c.text(200, 418, "Fraxinus litoralis", 25, "serif", "#3c3a2c", "c", italic=True)
    c.text(200, 440, "PLATE XVII", 11, "serif", "#6d654e", "c", tracking=3)
    c.text(200, 458, "leaf, natural size · gathered near Port Amber", 9.5, "serif", "#6d654e", "c")
    return finish(c, 306)


def lake():
    """700 x 500: black and white photograph of a mountain lake, with a white margin."""
    h, w = 512, 1024
    y = np.linspace(0, 1, h)[:, None] * np.ones((1, w))
    sky = 205 - 60 * y + 14 * fbm(h, w, 4, 307, 6, stretch=3)
    out = sky.copy()
    random = rng(308)
    for k, (base, amp, tone) in enumerate(((0.40, 0.16, 150), (0.46, 0.13, 112), (0.52, 0.08, 66))):
        ridge = sum(upsample(random.uniform(-1, 1, (1, 4 * 2**j)), 1, w) / 1.9**j for j in range(7))
        line = base - amp * (0.35 + 0.5 * ridge)
        rock = fbm(h, w, 16, 309 + k, 6, gain=0.7)
        snow = smoothstep(0.2, 0.9, rock) * smoothstep(0.15, 0.0, y - line) * (k == 0) * 80
        out = np.where(y > line, tone + 17 * rock + snow, out)
    trees = np.abs(upsample(random.uniform(0, 1, (1, 260)), 1, w)) * 0.05 + 0.015
    out = np.where((y > 0.56 - trees) & (y < 0.575), 26 + 8 * fbm(h, w, 90, 312, 2), out)
    water = y > 0.57
    source = np.clip((0.57 - (y - 0.57) * 1.02) * (h - 1), 0, h - 1).astype(int)
    ripple = 6 * fbm(h, w, 20, 313, 5, stretch=0.25) * (y - 0.5)
    shift = (np.arange(w)[None, :] + ripple.astype(int)) % w
    out = np.where(
        water, 0.75 * out[source, shift] + 10 + 14 * fbm(h, w, 60, 314, 3, stretch=12) * (y - 0.5),
        out)
    photo = picture(np.dstack([out * 1.0, out * 0.985, out * 0.955]))
    c = Canvas(700, 500, 1024, 512, "#f1eee6")
    c.paste(photo, 60, 60, 580, 370)
    c.text(640, 452, "Lago Sereno, 6 a.m.", 15, "hand", "#5a5a58", "r")
    return finish(c, 315)


def swiss():
    """500 x 700: red ground, turned lower-case type."""
    c = Canvas(500, 700, 512, 1024, "#c9402d")
    with c.at(-10, 455, -38):
        c.text(0, 0, "form", 210, "black", "#f3ede0", tracking=-10)
        c.text(60, 165, "raum", 210, "black", "#23262b", tracking=-10)
    for k in range(6):
        c.rect(40, 40 + 9 * k, 120 - 14 * k, 4, "#f3ede0")
    c.text(40, 640, "Museum für Gestaltung am Hafen", 19, "heavy", "#f3ede0")
    c.text(40, 662, "18. Oktober – 2. Februar", 19, "sans", "#f3ede0")
    c.text(460, 662, "Di – So 10 – 18 h", 15, "sans", "#f3ede0", "r")
    return finish(c, 316)


def planet():
    """500 x 700: printed space poster."""
    c = Canvas(500, 700, 512, 1024, "#131a2b")
    random = rng(317)
    c.rect(0, 0, 500, 700, radial(250, 300, 520, (0, "#2c3d63"), (0.6, "#182340"), (1, "#0e1424")))
    for _ in range(700):
        r = random.uniform(0.3, 1.5)**2
        c.circle(random.uniform(0, 500), random.uniform(0, 700), r * 0.8,
                 (1, 0.96, 0.86, random.uniform(0.2, 0.9)))
    for rx, ry in ((300, 92), (280, 84), (262, 77), (248, 72)):
        c.ellipse(250, 300, rx, ry, None, (0.91, 0.76, 0.5, 0.6), 6, degrees=-18)
    p = Relief(700, 700)
    p.put(350, 350, 345, ball(330, "#d98e55", "#7d3b33", 318, mottle=0.9, gloss=0.0))
    c.paste(p.picture(2, ambient=0.18), 110, 160, 280, 280)
    with c.clipped(0, 318, 500, 400):
        for rx, ry in ((300, 92), (280, 84), (262, 77)):
            c.ellipse(250, 300, rx, ry, None, (0.95, 0.82, 0.58, 0.85), 6, degrees=-18)
    c.text(250, 590, "OUTBOUND", 92, "display", "#f1dfbb", "c", bold=True, tracking=6)
    c.text(250, 622, "A GRAND TOUR OF THE RINGED WORLDS", 17, "heavy", "#d98e55", "c", tracking=3)
    c.text(250, 668, "departures every 178 years", 20, "serif", "#9fb0cc", "c", italic=True)
    return finish(c, 319)


def elements():
    """900 x 600: chart of tiles, like a table of elements."""
    c = Canvas(900, 600, 1024, 512, "#f0ece1")
    c.text(30, 52, "TABLE OF THE MINERALS", 34, "black", INK)
    c.text(870, 50, "VISUAL AID No. 7 — SCHOOL EDITION", 14, "medium", "#6b6b66", "r")
    random = rng(320)
    tones = ["#d9a441", "#c8553d", "#4f7f8f", "#7a9a5a", "#8d6a9f", "#b9b2a0", "#5b6f95"]
    letters = "AlBaCaDoFeGaHgIrKyLiMnNiOpPbQzRuSiTiUrVaWoXeYtZn"
    n = 0
    for row in range(7):
        for col in range(18):
            if row == 0 and 0 < col < 17 or row in (1, 2) and 1 < col < 12:
                continue
            x, y = 30 + col * 46.8, 72 + row * 68
            tone = tones[(col * 5 // 9 + (row * col) % 3) % 7]
            c.rect(x, y, 44, 65, tone, r=2)
            k = (n * 2) % (len(letters) - 1)
            c.text(x + 22, y + 39, letters[k:k + 2].capitalize(), 26, "heavy", "#fbf8ef", "c")
            c.text(x + 3, y + 12, str(n + 1), 10, "heavy", "#fbf8ef")
            c.text(x + 22, y + 57, f"{random.uniform(1, 240):.2f}", 9, "sans", "#fbf8ef", "c")
            n += 1
    c.text(150, 112, "hardness · lustre · streak · cleavage", 20, "serif", INK, italic=True)
    return finish(c, 321)


def camera():
    """600 x 800: exploded drawing of a folding camera, white on blue."""
    c = Canvas(600, 800, 512, 1024, "#24496b")
    line = "#dce8ee"
    for k in range(1, 30):
        c.line(0, 27.6 * k, 600, 27.6 * k, (1, 1, 1, 0.07), 0.8)
        c.line(20.7 * k, 0, 20.7 * k, 800, (1, 1, 1, 0.07), 0.8)
    c.line(300, 90, 300, 660, (1, 1, 1, 0.5), 1)
    for k, (y, rx, ry) in enumerate(((120, 70, 20), (165, 92, 27), (215, 84, 24), (268, 100, 30),
                                     (322, 76, 22), (380, 110, 34))):
        c.ellipse(300, y, rx, ry, (0.14, 0.29, 0.42, 1), line, 2.4)
        c.ellipse(300, y - 8, rx * 0.8, ry * 0.78, (1, 1, 1, 0.08), line, 1.2)
        side = -1 if k % 2 else 1
        c.line(300 + side * rx, y, 300 + side * 190, y - 22, line, 1)
        c.circle(300 + side * 204, y - 26, 13, None, line, 1.6)
        c.text(300 + side * 204, y - 20, str(k + 1), 16, "mono", line, "c")
    for k in range(7):
        w = 90 + 12 * k
        c.rect(300 - w, 430 + 17 * k, 2 * w, 14, (0.14, 0.29, 0.42, 1), line, 1.6, r=3)
    c.rect(110, 556, 380, 110, (0.14, 0.29, 0.42, 1), line, 2.6, r=12)
    c.rect(140, 576, 70, 40, None, line, 1.6, r=4)
    c.circle(420, 600, 26, None, line, 1.8)
    c.circle(420, 600, 15, None, line, 1.2)
    c.text(300, 62, "ANATOMY OF A CAMERA", 36, "display", line, "c", bold=True, tracking=4)
    for k, words in enumerate(
        ("1 hood   2 front element   3 iris   4 middle group   5 shutter   6 rear group",
         "bellows in seven folds · film plane · winding knob · finder",
         "drawn to scale 1 : 1 after the original of 1931")):
        c.text(300, 710 + 22 * k, words, 13.5, "mono", line, "c")
    c.rect(14, 14, 572, 772, None, line, 2)
    return finish(c, 326, 1.0)


def world_map():
    """1400 x 900: physical map of an invented world."""
    h, w = 1024, 1024
    relief = fbm(h, w, 3, 322, 9, gain=0.58, stretch=1.5)
    lat = np.abs(np.linspace(-1, 1, h))[:, None]
    relief = relief - 0.75 * smoothstep(0.75, 1.0, lat) + 0.1
    land = relief > 0.32
    sea = blend(colour("#8fb6c4"), colour("#cfe3e2"), smoothstep(-1.2, 0.32, relief))
    low = blend(colour("#a9c08a"), colour("#e3d3a0"), smoothstep(0.32, 1.0, relief))
    high = blend(low, colour("#a9754d"), smoothstep(0.9, 1.9, relief))
    shade = np.roll(relief, 2, 0) - np.roll(relief, -2, 0)
    out = np.where(land[..., None], high * (1 + 0.45 * np.clip(shade, -0.4, 0.4))[..., None], sea)
    coast = land ^ np.roll(land, 1, 0) | land ^ np.roll(land, 1, 1)
    out = np.where(coast[..., None], colour("#47616d"), out)
    c = Canvas(1400, 900, 1024, 1024, "#f1ead7")
    c.paste(picture(out), 40, 40, 1320, 760)
    for k in range(1, 24):
        c.line(40 + 55 * k, 40, 40 + 55 * k, 800, (0.2, 0.3, 0.4, 0.25), 0.8)
    for k in range(1, 14):
        c.line(40, 40 + 54.3 * k, 1360, 40 + 54.3 * k, (0.2, 0.3, 0.4, 0.25), 0.8)
    for k in range(24):
        for y in (30, 800):
            c.rect(40 + 55 * k, y, 55, 10, INK if k % 2 else "#f7f2e4", INK, 0.8)
    random = rng(323)
    names = [
        "Valdoro", "Port Amber", "Isla Sereno", "Nordhamn", "Cape Linnet", "Ostrava Bay", "Tirano",
        "Halmar", "Quill Sea", "Mira", "Santa Brisa", "Keld", "Lumera", "Arden", "Bay of Glass",
        "Voss", "Marrow Hills", "Eastreach", "Dunmore", "Pelago", "Uhl", "Castine", "Old Ferry"
    ]
    for name in names * 2:
        x, y = random.uniform(80, 1290), random.uniform(80, 770)
        c.circle(x, y, 2.6, "#b23a2a", INK, 0.6)
        c.text(x + 5, y + 4, name, random.choice([11, 13, 18]), "serif", INK, italic=bool(x > 700))
    c.text(700, 866, "THE WORLD", 52, "serif", INK, "c", tracking=24)
    c.text(60, 850, "Physical edition · scale 1 : 30 000 000", 15, "serif", INK)
    c.text(1340, 850, "Meridian Atlas House", 15, "serif", INK, "r", italic=True)
    for x in (350, 700, 1050):
        c.rect(x, 0, 2, 900, linear(x - 1, 0, x + 3, 0, (0, (0, 0, 0, 0.14)), (1, (1, 1, 1, 0.3))))
    return finish(c, 324)


def garden():
    """View out of the window, out of focus: sky, trees, a roof, a hedge; glazing bars. Square."""
    n = 512
    y = np.linspace(0, 1, n)[:, None] * np.ones((1, n))
    x = np.linspace(0, 1, n)[None, :] * np.ones((n, 1))
    cloud = smoothstep(-0.2, 1.6, fbm(n, n, 3, 330, 5, stretch=2))
    out = blend(colour("#b9d2ee"), colour("#f6f8fb"), 0.3 + 0.7 * cloud * (1 - 0.3 * y))
    for k, (base, amp, a, b) in enumerate(
        ((0.50, 0.16, "#5d7a55", "#94ab7c"), (0.62, 0.2, "#3c5a35", "#7d9a52"))):
        crown = upsample(rng(331 + k).uniform(-1, 1, (1, 9)), 1, n) * amp + base
        crown = crown + 0.02 * fbm(n, n, 40, 333 + k, 3)
        tree = blend(colour(a), colour(b), 0.5 + 0.35 * fbm(n, n, 24, 335 + k, 4))
        out = blend(out, tree, smoothstep(0, 0.012, y - crown))
        if k == 0:
            wall = (x > 0.52) & (x < 0.86) & (y > 0.5)
            roof = (np.abs(x - 0.69) * 0.55 < (y - 0.36)) & (np.abs(x - 0.69) < 0.2) & (y < 0.51)
            out = np.where(wall[..., None],
                           colour("#d9cbb2") * (1 - 0.12 * ((x * 40) % 1 > 0.8))[..., None], out)
            pane = wall & ((x * 9) % 1 > 0.45) & (y > 0.55) & (y < 0.62)
            out = np.where(pane[..., None], colour("#56646e"), out)
            out = np.where(roof[..., None], colour("#9a5a42"), out)
    hedge = blend(colour("#2f4a2a"), colour("#5f7f3d"), 0.5 + 0.4 * fbm(n, n, 50, 338, 3))
    out = blend(out, hedge, smoothstep(0.80, 0.82, y))
    out = 255 * (blur(out, 2, wrap=False) / 255)**1.6  # leaves are far darker than the sky
    # Glazing bars, against the light. As solids they would stand right before the emitter.
    for d, half in ((np.abs(x - 0.5), 0.0227), (np.abs(y - 0.3545), 0.0136)):
        bar = blend(colour("#45474a"), colour("#85888b"), smoothstep(0.55, 1.0, d / half))
        out = np.where((d < half)[..., None], bar, out)
    handle = (np.abs(x - 0.535) < 0.045) & (np.abs(y - 0.56) < 0.010)
    return picture(
        np.where(handle[..., None],
                 colour("#303234") * (1.2 - 12 * np.abs(y - 0.555))[..., None], out))
