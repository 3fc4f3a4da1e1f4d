"""Things that come between the camera and an object: a hand, a clipboard, a tube, a parcel."""

import math

import numpy as np

from .canvas import Canvas, picture
from .clutter_boxes import printed_box
from .implicit import smooth_min, split_views, surface_net
from .mesh import Model, join
from .noise import fbm, rng
from .prints import ean13, matrix_code
from .shapes import box, fillet, lathe, shell, turned
from .surfaces import blend, colour, mottled, smoothstep, woven

WRIST = 0.23  # height at which the hand begins
# x of the knuckle, length of the finger, radius at its root, splay to the right (degrees).
FINGERS = {
    "index": (0.0290, 0.074, 0.0098, 3.5), "middle": (0.0095, 0.081, 0.0100, 0.8),
    "ring": (-0.0100, 0.075, 0.0095, -1.8), "little": (-0.0285, 0.058, 0.0084, -6.0)
}
KNUCKLE_Z = {"index": 0.327, "middle": 0.331, "ring": 0.327, "little": 0.317}
CURL = (7, 12, 10)  # degrees at each joint, towards the palm
VIEW = (0.17, 0.22)  # metres covered by a view of the skin's texture


def finger_joints(name):
    """Four points from the knuckle to the tip, and the direction of the last bone."""
    x, length, _, splay = FINGERS[name]
    p, bend = np.array([x, 0.0, KNUCKLE_Z[name]]), 0.0
    joints = [p]
    for part, curl in zip((0.45, 0.31, 0.24), CURL):
        bend += math.radians(curl)
        s = math.radians(splay)
        d = np.array([math.sin(s), -math.sin(bend), math.cos(s) * math.cos(bend)])
        p = p + part * length * d / np.linalg.norm(d)
        joints.append(p)
    return joints, d / np.linalg.norm(d)


def bone(p, a, b, ra, rb):
    """Distance to a capsule whose radius changes from ra to rb."""
    a, b = np.asarray(a, float), np.asarray(b, float)
    t = np.clip((p - a) @ (b - a) / ((b - a) @ (b - a)), 0, 1)
    return np.linalg.norm(p - a - t[:, None] * (b - a), axis=1) - (ra + t * (rb - ra))


def hand(p):
    """A right hand, fingers up and closed, the palm towards -y, the thumb on the +x side."""
    flat = p * np.array([1, 1.28, 1])
    out = bone(flat, (-0.003, 0, 0.19), (0.0, 0, WRIST), 0.0285, 0.0268)
    for name in FINGERS:
        x, _, r, _ = FINGERS[name]
        root = np.array([0.62 * x, 0.002, WRIST + 0.008])
        out = smooth_min(out, bone(p, root, (x, 0.001, KNUCKLE_Z[name] - 0.004), 0.0150, r + 0.0030),
                         0.011)
    out = smooth_min(out, bone(p, (0.012, -0.007, WRIST + 0.014), (0.040, -0.012, 0.276), 0.0165,
                               0.0145), 0.010)  # ball of the thumb
    out = smooth_min(out, bone(p, (-0.022, -0.006, WRIST + 0.016), (-0.028, -0.005, 0.288), 0.014,
                               0.011), 0.009)  # heel of the hand
    out = smooth_min(out, bone(p, (0.040, -0.012, 0.276), (0.057, -0.018, 0.303), 0.0125, 0.0105),
                     0.007)
    out = smooth_min(out, bone(p, (0.057, -0.018, 0.303), (0.064, -0.023, 0.330), 0.0102, 0.0080),
                     0.003)
    for name in FINGERS:
        joints, _ = finger_joints(name)
        r = FINGERS[name][2]
        chain = bone(p, joints[0], joints[1], r, 0.93 * r)
        chain = smooth_min(chain, bone(p, joints[1], joints[2], 0.95 * r, 0.86 * r), 0.002)
        chain = smooth_min(chain, bone(p, joints[2], joints[3], 0.87 * r, 0.74 * r), 0.002)
        out = smooth_min(out, chain, 0.0028)
    return out


def skin_texture():
    """Palm in the left half, back in the right, 340 x 440 mm together with the sides below."""
    w, h = VIEW[0] * 1000, VIEW[1] * 1000
    px = 1024
    tone = fbm(px, px, 10, 1201, 6)
    fine = fbm(px, px, 160, 1202, 2)
    out = blend(colour("#d8a488"), colour("#c88a6f"), 0.5 + 0.16 * tone)
    out = out * (1 + 0.022 * fine)[..., None]

    def spot(x, z, view, radius, to, force):
        """x, z in metres in a view (0 palm, 1 back)."""
        v, u = np.mgrid[0:px, 0:px] / px * np.array([2 * h, 2 * w])[:, None, None]
        cx = (x if view == 0 else -x) * 1000 + w / 2 + view * w
        cz = 2 * h - (z - 0.19) * 1000 - h
        d = np.hypot(u - cx, v - cz + 0.0)
        return blend(out, colour(to), force * np.exp(-(d / radius)**2))

    for name in FINGERS:
        joints, _ = finger_joints(name)
        out = spot(joints[3][0], joints[3][2], 0, 11, "#d08070", 0.55)
        for joint in joints[1:3]:
            out = spot(joint[0], joint[2], 1, 7, "#b06a58", 0.5)
        out = spot(joints[0][0], joints[0][2], 1, 10, "#b87058", 0.4)
        out = spot(joints[0][0], joints[0][2] - 0.008, 0, 11, "#d68a78", 0.45)
    out = spot(0.035, 0.268, 0, 20, "#dc9a86", 0.5)
    out = spot(-0.027, 0.262, 0, 17, "#dc9480", 0.5)
    c = Canvas(2 * w, 2 * h, px, px)
    c.paste(picture(out), 0, 0, 2 * w, 2 * h)
    creases(c, w, h)
    return picture(mottled(c.array(), 1203, 0.8, 0.9))


def creases(c, w, h):

    def at(x, z, view=0):
        return ((x if view == 0 else -x) * 1000 + w / 2 + view * w, h - (z - 0.19) * 1000)

    dark = (0.50, 0.26, 0.20, 0.55)
    lines = [[(0.034, 0.300), (0.014, 0.283), (0.008, 0.262), (0.012, 0.240)],
             [(0.036, 0.303), (0.012, 0.291), (-0.014, 0.277), (-0.032, 0.272)],
             [(0.022, 0.319), (0.002, 0.306), (-0.020, 0.303), (-0.036, 0.308)],
             [(0.027, 0.236), (0.0, 0.231), (-0.028, 0.235)]]
    for line in lines:
        c.curve([at(*q) for q in line], None, dark, 0.75)
    for name in FINGERS:
        joints, _ = finger_joints(name)
        r = FINGERS[name][2]
        for joint in joints[:3]:
            for shift in (0.0, 0.0022):
                a, b = at(joint[0] - r, joint[2] + shift), at(joint[0] + r, joint[2] + shift)
                c.line(*a, *b, (0.52, 0.27, 0.20, 0.42), 0.5)
        for joint in joints[1:3]:  # wrinkles on the back
            for shift in (-0.0025, 0.0, 0.0024):
                q = [at(joint[0] + s * r, joint[2] + shift + 0.001 * abs(s), 1) for s in (-0.7, 0, 0.7)]
                c.curve(q, None, (0.45, 0.24, 0.18, 0.38), 0.5)


def nail(name):
    """Lies round the finger like a tile with an oval outline, its rim in the skin."""
    joints, d = finger_joints(name)
    r = FINGERS[name][2]
    back = -np.cross([1.0, 0, 0], d)
    back /= np.linalg.norm(back)
    side = np.cross(back, d)
    across, along = np.meshgrid(np.linspace(1, -1, 9), np.linspace(-1, 1, 11))
    angle = 0.8 * across * np.sqrt(1 - 0.97 * along**4)
    rim = np.maximum(np.abs(across), np.abs(along))**6
    radius = (0.79 - 0.045 * along) * r + 0.0005 - 0.0010 * rim
    place = 0.62 * r * along - 0.25 * r
    points = (joints[3] + place[..., None] * d + (radius * np.cos(angle))[..., None] * back +
              (radius * np.sin(angle))[..., None] * side)
    return shell(points, "nail", 0.0008)


def sleeve():
    """Knitted cuff and sleeve, oval, with soft folds."""
    profile = [(0, 0), (0.048, 0), (0.0465, 0.06), (0.0435, 0.12), (0.0405, 0.160), (0.0385, 0.163),
               (0.0380, 0.213), (0.0345, 0.214), (0.0335, 0.200), (0, 0.200)]
    rows = fillet(profile, [0, 0.004, 0.01, 0.01, 0.001, 0.001, 0.002, 0.0015, 0.001, 0], 2)
    fine = []
    for a, b in zip(rows, rows[1:]):
        steps = max(1, int(np.linalg.norm(b[:2] - a[:2]) / 0.008))
        fine += [a + (b - a) * k / steps for k in range(steps)]
    body = lathe(np.array(fine + [rows[-1]]), "wool", seg=40)
    t = np.arctan2(body.p[:, 1], body.p[:, 0])
    z = body.p[:, 2]
    fold = 0.045 * np.sin(2 * t + 34 * z) * np.sin(55 * z + 1.3 * np.sin(t)) * (z < 0.155) * (z > 0.004)
    body.p[:, :2] *= (1 + fold)[:, None] * np.array([1.0, 0.84])
    body.uv = np.column_stack([body.uv[:, 0] * 3, body.p[:, 2] / 0.08])
    return body


def wool():
    out = woven(256, 32, "#3f5573", "#31445e", 1210)
    return picture(out)


def build_hand():
    model = Model("occluder_hand")
    model.images["skin.jpg"] = skin_texture()
    model.images["wool.jpg"] = wool()
    model.material("skin", image="skin.jpg", ks=0.028, ns=24)
    model.material("wool", image="wool.jpg", ks=0.0, ns=5)
    model.material("nail", kd=(0.60, 0.34, 0.27), ks=0.04, ns=120)
    skin = surface_net(hand, (-0.06, -0.05, 0.152), (0.085, 0.045, 0.425), 0.0045, "skin")
    model.add("hand", split_views(skin, VIEW, 0.19))
    for name in FINGERS:
        model.add(f"nail_{name}", nail(name))
    model.add("sleeve", sleeve())
    return model


FORM = [("Carton, orange juice 1 L", "48", "46"), ("Pasta, penne 500 g", "120", "118"),
        ("Detergent, sea breeze", "24", "24"), ("Tomatoes, peeled, can", "96", "90"),
        ("Green tea, 20 bags", "60", "61"), ("Cereal, blueberry", "36", "33"),
        ("Sticky notes, yellow", "80", "80"), ("Ruler, beech, 30 cm", "25", "24"),
        ("Tape, clear, 25 m", "40", "38"), ("Eraser, soft", "150", "147")]


def draw_form(c):
    """A stock list on A4, filled in by hand; 210 x 297 mm."""
    c.rect(0, 0, 210, 297, "#f3f1ea")
    c.text(14, 24, "STOCK TAKE", 13, "black", "#1d3a4f", tracking=0.4)
    c.text(14, 32, "Warehouse 3 · aisle 7 · sheet 2 of 5", 5, "sans", "#33424c")
    c.rect(150, 12, 46, 20, None, "#1d3a4f", 0.6)
    c.text(153, 19, "date", 3.4, "sans", "#5a6872")
    c.text(158, 28, "14 / 11", 8, "note", "#1f2f7a")
    columns = (14, 108, 134, 160, 196)
    c.rect(14, 42, 182, 9, "#1d3a4f")
    for x, word in zip(columns, ("Article", "due", "found", "remarks")):
        c.text(x + 2, 48.6, word, 4.6, "heavy", "#f3f1ea")
    random = rng(1220)
    for k in range(18):
        y = 51 + 10.5 * k
        c.line(14, y + 10.5, 196, y + 10.5, "#9aa6ae", 0.3)
        if k % 2:
            c.rect(14, y, 182, 10.5, (0.11, 0.23, 0.31, 0.05))
        if k >= len(FORM):
            continue
        name, due, found = FORM[k]
        c.text(16, y + 7, name, 5, "sans", "#22303a")
        c.text(112, y + 7, due, 5, "mono", "#22303a")
        c.text(139, y + 7.8 + random.uniform(-0.6, 0.6), found, 8, "note", "#1f2f7a")
        if due != found:
            c.text(163, y + 7.8, ("check!", "1 open", "dented", "ok?")[k % 4], 6.5, "note", "#1f2f7a")
        c.curve([(101, y + 5.4), (103, y + 8.2), (107, y + 2.2)], None, "#1f2f7a", 0.7)
    for x in columns:
        c.line(x, 42, x, 51 + 189, "#9aa6ae", 0.3)
    c.text(14, 256, "counted by", 4, "sans", "#5a6872")
    c.line(36, 257, 100, 257, "#5a6872", 0.3)
    c.text(40, 255, "M. Lindqvist", 11, "script", "#1f2f7a")
    matrix_code(c, 172, 248, 24, 1221)
    c.text(14, 285, "Form 12-B · keep for two years", 3.6, "sans", "#5a6872")


def build_board():
    """Clipboard of hardboard, standing on its lower edge, the form towards -y."""
    model = Model("occluder_board")
    c = Canvas(210, 297, 1024, 1024)
    draw_form(c)
    model.images["form.jpg"] = picture(mottled(c.array() * 0.96, 1222, 1.0, 1.2))
    grain = fbm(256, 256, 40, 1223, 4)
    model.images["hardboard.jpg"] = picture(
        blend(colour("#7d5636"), colour("#5d3d24"), 0.5 + 0.2 * grain))
    model.material("board", image="hardboard.jpg", ks=0.04, ns=40)
    model.material("paper", image="form.jpg", ks=0.01, ns=10)
    model.material("metal", kd=(0.42, 0.42, 0.43), ks=0.4, ns=120)
    board = box((0.228, 0.0034, 0.318), 0.0012, "board", seg=2)
    model.add("board", board)
    plain = (0.02, 0.01, 0.05, 0.03)
    sheet = box((0.210, 0.0008, 0.297), 0.0003, "paper", uv={
        "front": (0, 0, 1, 1), "back": plain, "left": plain, "right": plain, "top": plain,
        "bottom": plain
    })
    model.add("paper", sheet.moved(y=-0.0019, z=0.006))
    clip = box((0.110, 0.010, 0.022), 0.004, "metal", seg=3).moved(y=-0.0062, z=0.291)
    lever = box((0.060, 0.004, 0.016), 0.0018, "metal", seg=2).rotated("x", -28)
    model.add("clip", join(clip))
    model.add("lever", lever.moved(y=-0.012, z=0.306))
    return model


def build_pole():
    """Poster tube of brown board with plastic lids and a label, upright."""
    model = Model("occluder_pole")
    w, h = 190, 940
    c = Canvas(w, h, 512, 2048, "#b08a5c")
    random = rng(1230)
    for k in range(16):  # the seam of the wound board
        y = -80 + 70 * k
        c.line(0, y + 60, w, y, (0.35, 0.24, 0.12, 0.5), 0.8)
        c.line(0, y + 61, w, y + 1, (0.95, 0.85, 0.68, 0.35), 0.6)
    for _ in range(500):
        x, y = random.uniform(0, w), random.uniform(0, h)
        c.line(x, y, x + random.uniform(-6, 6), y + random.uniform(-2, 2),
               (0.3, 0.2, 0.1, random.uniform(0.04, 0.2)), 0.3)
    for y in (210, 610):
        c.rect(52, y, 90, 120, "#f1efe8")
        c.text(57, y + 12, "PRINTWORKS HALDEN", 6.2, "black", "#222222")
        c.paragraph(57, y + 22, 80, "2 posters 70 x 100\nDo not bend", 6, "sans")
        ean13(c, 62, y + 62, 60, 34, "402345098127")
        c.text(57, y + 110, "REF 77-A-1042", 6, "ocr", "#222222")
    c.rect(0, 470, w, 46, (0.93, 0.90, 0.80, 0.55))
    model.images["tube.jpg"] = picture(mottled(c.array() * 0.97, 1231, 1.2, 2.4))
    model.material("board", image="tube.jpg", ks=0.01, ns=12)
    model.material("lid", kd=(0.75, 0.75, 0.74), ks=0.04, ns=60)
    tube = turned([(0, 0.008), (0.030, 0.008), (0.030, 0.948), (0, 0.948)], [0, 0.001, 0.001, 0],
                  "board", seg=40)
    tube.uv = np.column_stack([tube.uv[:, 0], (tube.p[:, 2] - 0.008) / 0.94])
    model.add("tube", tube)
    lid = turned([(0, 0), (0.0318, 0), (0.0318, 0.012), (0, 0.012)], [0, 0.002, 0.0008, 0], "lid",
                 seg=40)
    model.add("lid_below", lid)
    model.add("lid_above", lid.rotated("x", 180).moved(z=0.956))
    return model


def draw_parcel(c, rects):
    random = rng(1240)
    for x, y, w, h in rects.values():
        c.rect(x, y, w, h, "#b58b5b")
        for k in range(int(h / 3.2)):
            c.line(x, y + 3.2 * k, x + w, y + 3.2 * k, (0.35, 0.22, 0.1, 0.09), 1.2)
    for name in ("front", "back"):
        x, y, w, h = rects[name]
        c.rect(x, y, w, 20, (0.80, 0.66, 0.42, 0.6))
        c.text(x + 12, y + h - 14, "HALDEN", 26, "black", (0.28, 0.17, 0.07, 0.85))
        c.text(x + w - 12, y + h - 16, "THIS WAY UP", 9, "heavy", (0.28, 0.17, 0.07, 0.85), "r")
    x, y, w, h = rects["front"]
    c.rect(x + w - 122, y + 32, 108, 78, "#f4f2ea")
    c.text(x + w - 116, y + 44, "PARCEL", 9, "black", "#1a1a1a")
    c.text(x + w - 20, y + 44, "2.4 kg", 7, "heavy", "#1a1a1a", "r")
    c.line(x + w - 118, y + 48, x + w - 18, y + 48, "#1a1a1a", 0.6)
    c.paragraph(x + w - 116, y + 57, 96, "Studio Nordlys\nHavnegata 12\n0150 Fjordby", 6.4, "sans")
    ean13(c, x + w - 114, y + 84, 56, 22, "730045512098")
    matrix_code(c, x + w - 46, y + 78, 28, 1241)
    x, y, w, h = rects["top"]
    c.rect(x, y + h / 2 - 25, w, 50, (0.83, 0.70, 0.46, 0.75))
    c.line(x, y + h / 2, x + w, y + h / 2, (0.2, 0.12, 0.05, 0.8), 0.8)
    for _ in range(60):
        name = ("front", "back", "left", "right", "top")[int(random.integers(0, 5))]
        x, y, w, h = rects[name]
        a, b = random.uniform(x, x + w), random.uniform(y, y + h)
        c.line(a, b, a + random.uniform(-14, 14), b + random.uniform(-3, 3),
               (0.9, 0.8, 0.62, 0.4), 0.4)


def build_parcel():
    return printed_box("occluder_box", (260, 150, 180), draw_parcel, (2048, 1024),
                       {"ks": 0.005, "ns": 10})


FIGURE_PARTS = (  # centre, half axes, smoothing: a sitting bird
    ((0, 0, 0.034), (0.027, 0.036, 0.032), 0.0), ((0, -0.016, 0.066), (0.0185, 0.019, 0.0185), 0.016),
    ((0, 0.040, 0.040), (0.013, 0.026, 0.0085), 0.014), ((0.024, 0.008, 0.037), (0.007, 0.026, 0.016), 0.004),
    ((-0.024, 0.008, 0.037), (0.007, 0.026, 0.016), 0.004))


def ellipsoid(p, centre, half):
    q = (p - np.array(centre)) / np.array(half)
    n = np.linalg.norm(q, axis=1)
    g = np.linalg.norm(q / np.array(half), axis=1)
    return n * (n - 1) / np.maximum(g, 1e-9)


def bird(p):
    out = None
    for centre, half, k in FIGURE_PARTS:
        d = ellipsoid(p, centre, half)
        out = d if out is None else smooth_min(out, d, k)
    out = smooth_min(out, bone(p, (0, -0.033, 0.065), (0, -0.045, 0.062), 0.0050, 0.0012), 0.004)
    stand = np.maximum(np.hypot(p[:, 0], p[:, 1]) - 0.023, np.abs(p[:, 2] - 0.004) - 0.004)
    return smooth_min(out, stand, 0.008)


def build_figurine():
    """A glazed bird, 9 cm long: curved surfaces and no print."""
    model = Model("figurine_bird")
    model.material("glaze", kd=(0.30, 0.46, 0.44), ks=0.05, ns=260)
    model.material("eye", kd=(0.02, 0.02, 0.02), ks=0.05, ns=300)
    skin = surface_net(bird, (-0.05, -0.06, -0.006), (0.05, 0.08, 0.095), 0.0028, "glaze")
    skin.p[:, 2] = np.maximum(skin.p[:, 2], 0.0)
    model.add("bird", skin)
    for k, side in enumerate((-1, 1)):
        eye = turned([(0, 0), (0.0022, 0), (0.0014, 0.0016), (0, 0.0018)], [0, 0.0003, 0.0008, 0],
                     "eye", seg=12)
        model.add(f"eye{k}", eye.rotated("y", side * 78).rotated("z", side * -28).moved(
            side * 0.0152, -0.0245, 0.0705))
    return model
