"""Desk electronics: keyboard, mouse, monitor, cable, lamp, headphones."""

import math

import numpy as np

from .canvas import Canvas, picture
from .mesh import Model, Patch, join
from .noise import rng
from .screen_print import screen
from .shapes import box, fillet, prism, sheet, tube, turned
from .surfaces import mottled

ROWS = [
    "Esc|1 F1 F2 F3 F4|1 F5 F6 F7 F8|1 F9 F10 F11 F12", "` 1 2 3 4 5 6 7 8 9 0 - = Back:2",
    "Tab:1.5 Q W E R T Y U I O P [ ] \\:1.5", "Caps:1.75 A S D F G H J K L ; ' Enter:2.25",
    "Shift:2.25 Z X C V B N M , . / Shift:2.75",
    "Ctrl:1.25 Alt:1.25 Fn:1.25 _:6.25 Alt:1.25 Fn:1.25 Menu:1.25 Ctrl:1.25"
]
SIDE = [["Prt", "Scr", "Brk"], ["Ins", "Hom", "PgU"], ["Del", "End", "PgD"], [], [None, "Up", None],
        ["Lt", "Dn", "Rt"]]
PITCH = 0.019
BOARD = (0.368, 0.132)


def keys():
    """All keys: (label, x, y, width) in metres, centred on the board."""
    out = []
    for r, row in enumerate(ROWS):
        x = 0.0
        y = 0.048 - r * PITCH - (0.004 if r else 0.0)
        for word in row.split():
            label, _, rest = word.partition(":")
            gap = 0.0
            if "|" in label:
                label, _, g = label.partition("|")
                gap = float(g)
            w = float(rest or 1)
            out.append((label, (x + w / 2) * PITCH - 0.1755, y, w * PITCH))
            x += w + gap * (1.0 if "Esc" in label else 0.5)
        for k, label in enumerate(SIDE[r]):
            if label:
                out.append((label, 0.1235 + k * PITCH, y, PITCH))
    return out


def keyboard_print():
    w, h = BOARD[0] * 1000, BOARD[1] * 1000
    c = Canvas(w, h, 1024, 512, "#34373b")
    random = rng(1001)
    for label, x, y, kw in keys():
        px, py, kw = x * 1000 + w / 2, h / 2 - y * 1000, kw * 1000
        accent = label in ("Esc", "Enter")
        tone = "#b5523a" if accent else "#53575c" if len(label) > 1 and not label.startswith(
            "F") or label.startswith("Fn") else "#d9d5cb"
        ink = "#f1ede2" if tone != "#d9d5cb" else "#2b2d30"
        c.rect(px - kw / 2, py - 9.5, kw, 19, tone)
        worn = random.uniform(0.0, 0.08)
        c.ellipse(px, py, kw * 0.3, 5, (1, 1, 1, worn))
        if label == "_":
            continue
        size = 4.6 if len(label) == 1 else 2.9
        c.text(px - min(kw, 19) * 0.28 if len(label) == 1 else px,
               py + (0.4 if len(label) == 1 else 1), label, size, "medium", ink,
               "l" if len(label) == 1 else "c")
        if label in "1234567890":
            c.text(px - 5.3, py - 1.8 + 6.2, "!@#$%^&*()"[("1234567890").index(label)], 3.0, "sans",
                   ink)
    c.text(w - 34, 8, "HALMAR", 4, "black", "#9a9da0", tracking=0.6)
    return picture(mottled(c.array() * 0.95, 1002, 1.2, 1.5))


def keyboard():
    model = Model("keyboard")
    model.images["keys.jpg"] = keyboard_print()
    model.material("keys", image="keys.jpg", ks=0.035, ns=45)
    model.material("case", kd=(0.035, 0.037, 0.04), ks=0.035, ns=60)
    model.material("led", ke=(0.05, 0.6, 0.15), ks=0.02)
    w, d = BOARD
    outline = fillet([(-w / 2 - 0.006, -d / 2 - 0.004), (w / 2 + 0.006, -d / 2 - 0.004),
                      (w / 2 + 0.006, d / 2 + 0.004), (-w / 2 - 0.006, d / 2 + 0.004)], 0.008, 4,
                     closed=True)
    parts = {"case": prism(outline, 0.013, 0.0025, "case")}
    caps = []
    for label, x, y, kw in keys():
        a, b = kw / 2 - 0.0006, PITCH / 2 - 0.0006
        cap = prism(fillet([(-a, -b), (a, -b), (a, b), (-a, b)], 0.0018, 1, closed=True), 0.0085,
                    0.0011, "keys", bevel_seg=1, scale_top=1.0)
        taper = 1 - 0.0019 / b * np.clip(cap.p[:, 2:] / 0.0085, 0, 1) * np.array([[b / a, 1.0]])
        cap.p[:, :2] *= taper
        cap.p[:, :2] += (x, y)
        cap.p[:, 2] += 0.0095
        caps.append(cap)
    keycaps = join(caps)
    keycaps.uv = np.column_stack([keycaps.p[:, 0] / w + 0.5, keycaps.p[:, 1] / d + 0.5])
    parts["keys"] = keycaps
    parts["led"] = box((0.004, 0.0018, 0.0016), 0.0005, "led").moved(0.16, 0.064, 0.0122)
    tilt = 4.0
    for name, part in parts.items():
        part = part.moved(y=0.070).rotated("x", tilt).moved(y=-0.070, z=0.0002)
        model.add(name, part)
    feet = [box((0.03, 0.012, 0.0125), 0.002, "case").moved(s * 0.14, 0.055, 0) for s in (-1, 1)]
    model.add("feet", *feet)
    return model


def cable_path(knots, count):
    """Smooth curve through the knots (Catmull-Rom), `count` points."""
    k = np.array(knots, float)
    k = np.vstack([2 * k[0] - k[1], k, 2 * k[-1] - k[-2]])
    s = np.linspace(0, len(k) - 3 - 1e-9, count)
    i = s.astype(int)
    t = (s - i)[:, None]
    a, b, c, d = k[i], k[i + 1], k[i + 2], k[i + 3]
    return 0.5 * (2 * b + (c - a) * t + (2 * a - 5 * b + 4 * c - d) * t**2 +
                  (3 * b - a - 3 * c + d) * t**3)


def cable():
    """Coiled cable with a plug at either end."""
    model = Model("cable")
    model.material("rubber", kd=(0.022, 0.022, 0.024), ks=0.03, ns=35)
    model.material("plug", kd=(0.5, 0.5, 0.48), ks=0.04, ns=90)
    model.material("metal", kd=(0.45, 0.45, 0.46), ks=0.35, ns=150)
    random = rng(1010)
    pts = [(-0.115, -0.075, 0.0035), (-0.085, -0.06, 0.0032)]
    for k in range(31):
        a = -2.2 + 2 * math.pi * k / 10
        r = 0.052 + 0.004 * math.sin(2.3 * k) + random.normal(0, 0.001)
        pts.append((r * math.cos(a), 0.9 * r * math.sin(a),
                    0.003 + 0.0002 + 0.0046 * (k / 10) + 0.0012 * math.sin(3 * a)))
    pts += [(0.03, 0.068, 0.010), (0.085, 0.06, 0.0035), (0.125, 0.03, 0.0035)]
    path = cable_path(pts, 210)
    model.add("cable", tube(path, 0.0026, "rubber", seg=8))
    for name, (end, near) in {"plug_a": (path[0], path[3]), "plug_b": (path[-1], path[-4])}.items():
        angle = math.degrees(math.atan2(end[1] - near[1], end[0] - near[0]))
        body = box((0.032, 0.013, 0.0075), 0.002, "plug", seg=2).moved(x=0.012)
        tip = box((0.013, 0.011, 0.0042), 0.0006, "metal").moved(x=0.033, z=0.0016)
        model.add(name, join(body, tip).rotated("z", angle).moved(end[0], end[1], 0))
    return model


def mouse():
    model = Model("mouse")
    model.material("shell", kd=(0.05, 0.052, 0.056), ks=0.035, ns=55)
    model.material("side", kd=(0.16, 0.17, 0.18), ks=0.03, ns=30)
    model.material("wheel", kd=(0.012, 0.012, 0.012), ks=0.02, ns=20)
    u, v = np.meshgrid(np.linspace(0, 2 * math.pi, 41), np.linspace(0, 1, 15))
    e = 2 / 2.6
    cx = np.sign(np.cos(u)) * np.abs(np.cos(u))**e
    cy = np.sign(np.sin(u)) * np.abs(np.sin(u))**e
    roll = np.sin(0.5 * math.pi * v)**0.62
    grow = np.cos(0.5 * math.pi * v)**0.5
    waist = 1 - 0.07 * np.exp(-((cy * grow - 0.05) / 0.35)**2)
    x = 0.031 * cx * grow * waist
    y = 0.057 * cy * grow
    z = 0.0005 + (0.030 + 0.007 * np.cos(1.4 * (y / 0.057 + 0.35))) * roll * (1 - 0.10 *
                                                                              (y / 0.057)**2 * v)
    body = sheet(np.dstack([x, y, z]), "shell")
    base = np.column_stack([x[0], y[0], z[0]])[:-1]
    n = len(base)
    p = np.vstack([base, [[0, 0, z[0, 0]]]])
    foot = Patch(p, np.tile([0, 0, -1.0], (n + 1, 1)), np.zeros((n + 1, 2)),
                 [((k + 1) % n, k, n) for k in range(n)], ["side"] * n)
    body.n[:41] = np.column_stack([cx[0], cy[0], 0 * cx[0]]) / np.hypot(cx[0], cy[0])[:, None]
    body.n[-41:] = (0, 0, 1)
    model.add("body", body, foot)
    wheel = turned([(0, -0.0035), (0.0095, -0.0035), (0.0095, 0.0035), (0, 0.0035)],
                   [0, 0.0015, 0.0015, 0], "wheel", seg=20)
    model.add("wheel", wheel.rotated("y", 90).moved(0, -0.031, 0.0298))
    seam = tube([(0, -0.0525, 0.0150), (0, -0.044, 0.0262), (0, -0.0425, 0.0275)], 0.0005, "wheel",
                seg=6)
    model.add("seam", seam)
    return model


def monitor():
    model = Model("monitor")
    model.images["screen.jpg"] = screen()
    model.material("screen", image="screen.jpg", kd=(0.7, 0.7, 0.7), ke=(0.9, 0.95, 1.0), ks=0.03,
                   ns=120)
    model.material("bezel", kd=(0.02, 0.02, 0.022), ks=0.04, ns=60)
    model.material("stand", kd=(0.33, 0.33, 0.34), ks=0.2, ns=60)
    model.material("led", ke=(0.1, 0.35, 0.8), ks=0.02)
    w, h, z0 = 0.54, 0.325, 0.10
    model.add("case", box((w, 0.022, h), 0.003, "bezel", seg=2).moved(z=z0))
    model.add("back",
              box((w * 0.55, 0.03, h * 0.6), 0.010, "bezel", seg=2).moved(y=0.0245, z=z0 + 0.05))
    glass = sheet(
        np.array([[[-w / 2 + 0.009, -0.0113, z0 + 0.020], [w / 2 - 0.009, -0.0113, z0 + 0.020]],
                  [[-w / 2 + 0.009, -0.0113, z0 + h - 0.009],
                   [w / 2 - 0.009, -0.0113, z0 + h - 0.009]]]), "screen")
    model.add("screen", glass)
    model.add("led",
              box((0.008, 0.002, 0.0018), 0.0006, "led").moved(w / 2 - 0.03, -0.0112, z0 + 0.008))
    neck = prism(
        fillet([(-0.03, -0.012), (0.03, -0.012), (0.03, 0.012), (-0.03, 0.012)], 0.006, 3,
               closed=True), 0.20, 0.002, "stand")
    model.add("neck", neck.moved(y=0.045, z=0.006))
    foot = fillet([(-0.12, -0.085), (0.12, -0.085), (0.105, 0.10), (-0.105, 0.10)], 0.02, 5,
                  closed=True)
    model.add("foot", prism(foot, 0.008, 0.002, "stand"))
    vents = [
        box((0.16, 0.0016, 0.003), 0.0005, "stand").moved(0, 0.0398, z0 + 0.16 + 0.008 * k)
        for k in range(7)
    ]
    model.add("vents", *vents)
    return model


def desk_lamp():
    """Jointed lamp: round foot, two arms, conical shade, a dim bulb."""
    model = Model("desk_lamp")
    model.material("enamel", kd=(0.36, 0.05, 0.035), ks=0.045, ns=260)
    model.material("inner", kd=(0.75, 0.74, 0.70), ks=0.02, ns=30)
    model.material("steel", kd=(0.35, 0.35, 0.36), ks=0.3, ns=120)
    model.material("bulb", kd=(0.8, 0.78, 0.72), ks=0.04, ns=200)
    foot = turned([(0, 0), (0.078, 0), (0.078, 0.012), (0.02, 0.026), (0.014, 0.045), (0, 0.045)],
                  [0, 0.002, 0.006, 0.012, 0.002, 0], "enamel", seg=36, bevel_seg=3)
    model.add("foot", foot)
    a, b, c = np.array([0, 0, 0.04]), np.array([0.02, 0.11, 0.27]), np.array([-0.02, -0.10, 0.40])
    for k, s in enumerate((-1, 1)):
        model.add(f"arm{k}",
                  tube([a + (s * 0.008, 0, 0), b + (s * 0.008, 0, 0)], 0.0042, "steel", seg=8),
                  tube([b + (s * 0.008, 0, 0), c + (s * 0.008, 0, 0)], 0.0042, "steel", seg=8))
    joint = turned([(0, -0.014), (0.0115, -0.014), (0.0115, 0.014), (0, 0.014)],
                   [0, 0.002, 0.002, 0], "enamel", seg=16).rotated("y", 90)
    model.add("joints", *[joint.moved(*q) for q in (a + (0, 0, 0.008), b, c)])
    shade = turned([(0.070, 0.0), (0.072, 0.001), (0.030, 0.085), (0.026, 0.120), (0.0, 0.122), ],
                   [0, 0.0008, 0.015, 0.008, 0], "enamel", seg=36, bevel_seg=3)
    inner = turned([(0.0, 0.115), (0.024, 0.115), (0.028, 0.084), (0.070, 0.0)],
                   [0, 0.004, 0.015, 0], "inner", seg=36)
    bulb = turned([(0, 0.012), (0.022, 0.02), (0.022, 0.045), (0.012, 0.075), (0.012, 0.116),
                   (0, 0.116)], [0, 0.018, 0.018, 0.01, 0, 0], "bulb", seg=20, bevel_seg=4)
    for name, part in (("shade", join(shade, inner)), ("bulb", bulb)):
        model.add(name, part.moved(z=-0.115).rotated("x", -28).moved(*c))
    return model


def headphones():
    """Lying on their side: two cups, cushions, a band."""
    model = Model("headphones")
    model.material("matt", kd=(0.025, 0.026, 0.03), ks=0.03, ns=40)
    model.material("leather", kd=(0.06, 0.045, 0.038), ks=0.035, ns=25)
    model.material("metal", kd=(0.42, 0.36, 0.28), ks=0.35, ns=120)
    t = np.radians(np.linspace(8, 172, 29))
    arch = np.column_stack([0.082 * np.cos(t), 0.105 * np.sin(t), 0 * t])
    band = tube(arch, 0.0042, "metal", seg=8).scaled(1, 1, 1.9)
    pad = tube(arch[7:22] * 0.965, [0.004] + [0.0085] * 13 + [0.004], "leather",
               seg=10).scaled(1, 1, 1.6)
    cups = []
    for s in (-1, 1):
        cup = turned([(0, -0.004), (0.034, -0.004), (0.039, 0.004), (0.036, 0.020), (0.02, 0.026),
                      (0, 0.026)], [0, 0.002, 0.004, 0.008, 0.006, 0], "matt", seg=28, bevel_seg=3)
        ring = turned([(0.018, -0.020), (0.027, -0.023), (0.039, -0.014), (0.037, -0.0035),
                       (0.018, -0.0035), (0.018, -0.020)], [0, 0.006, 0.008, 0.003, 0, 0],
                      "leather", seg=28, bevel_seg=3)
        cloth = turned([(0, -0.012), (0.0185, -0.012), (0.0185, -0.005), (0, -0.005)], 0, "matt",
                       seg=20)
        dot = turned([(0, 0.0255), (0.012, 0.0255), (0.0115, 0.0268), (0, 0.0268)],
                     [0, 0, 0.0006, 0], "metal", seg=20)
        side = join(cup, ring, cloth, dot).scaled(1, 1.18,
                                                  1).rotated("y", s * 90).moved(s * 0.076, 0.0, 0)
        cups.append(side.rotated("z", s * 6))
    whole = join(band, pad, cups)
    z = float(whole.p[:, 2].min())
    for name, part in (("band", band), ("pad", pad), ("left_cup", cups[0]), ("right_cup", cups[1])):
        model.add(name, part.moved(y=-0.035, z=-z))
    return model
