"""Paper things: a stack of books, a spiral notebook, sticky notes."""

import math

import numpy as np

from .canvas import Canvas, linear, picture
from .mesh import Model, Patch, join
from .noise import rng
from .prints import ean13, halftone, sunburst
from .shapes import box, fillet, prism, shell, tube
from .surfaces import mottled

# A cell of the cover sheet holds back, spine and front of a book; the last strip is paper edges.
CELLS = 4


def cover_sheet(sizes):
    """256 mm high cells stacked over each other; `sizes`: (width, height, thickness) in mm."""
    c = Canvas(420, 4 * 260, 1024, 2048, "#dcd2bd")
    random = rng(801)
    for k in range(400):  # page edges, right of the covers
        c.line(398, 2.6 * k, 420, 2.6 * k + random.normal(0, 0.2),
               (0.35, 0.28, 0.18, random.uniform(0.05, 0.4)), 0.5)
    for k, (w, h, t) in enumerate(sizes):
        y = 260 * k
        front, spine = 2 + w + t, 2 + w
        with c.clipped(2, y, 2 * w + t, h):
            (cover_maths, cover_novel, cover_garden, cover_robots)[k](c, front, y, w, h, spine, t,
                                                                      random)
    return picture(mottled(c.array() * 0.95, 802, 1.3, 1.6))


def spine_text(c, x, y, w, h, title, author, font, ink):
    with c.at(x + w / 2, y + 12, 90):
        size = min(w * 0.55, (h - 75) / c.text_width(title, 1, font, bold=True))
        c.text(0, size * 0.34, title, size, font, ink, bold=True)
        c.text(h - 22, w * 0.13, author, min(w * 0.3, 5), "medium", ink, "r")


def cover_maths(c, x, y, w, h, sx, t, random):
    c.rect(2, y, 2 * w + t, h, "#e3b23c")
    for k in range(11):
        c.circle(x + w * 0.62, y + h * 0.62, 10 + 7 * k, None, "#1f2937", 1.6)
    c.rect(x + 10, y + 14, w - 20, 62, "#1f2937")
    c.text(x + 16, y + 40, "Estimation", 20, "slab", "#f6e7bd", bold=True)
    c.text(x + 16, y + 64, "on Manifolds", 20, "slab", "#f6e7bd")
    c.text(x + 16, y + h - 14, "K. Halmar  ·  Second edition", 6, "medium", "#1f2937")
    spine_text(c, sx, y, t, h, "Estimation on Manifolds", "HALMAR", "slab", "#1f2937")
    c.rect(sx, y + h - 16, t, 3, "#1f2937")
    ean13(c, 2 + w - 56, y + h - 38, 44, 26, "978031415926")
    c.paragraph(
        18, y + 30, w - 40,
        "A patient course in states that live on curved spaces: rotations, poses, maps. With two "
        "hundred exercises and a chapter on things that go wrong.", 6.0, "serif", fill="#1f2937")


def cover_novel(c, x, y, w, h, sx, t, random):
    c.rect(2, y, 2 * w + t, h,
           linear(0, y, 0, y + h, (0, "#1d2b4f"), (0.55, "#7b3f5e"), (1, "#e08a5a")))
    c.circle(x + w / 2, y + h * 0.55, 34, "#f4d7a1")
    for k, tone in enumerate(("#5a3150", "#3a2444", "#1c1730")):
        pts = [(xx, y + h * (0.66 + 0.09 * k) + 9 * math.sin(xx / (17 - 3 * k) + 2 * k))
               for xx in range(-10, 420, 10)]
        c.poly([(-10, y + h)] + pts + [(430, y + h)], tone)
    for _ in range(60):
        c.circle(random.uniform(2, 2 * w + t), y + random.uniform(0, h * 0.4),
                 random.uniform(0.2, 0.7), (1, 1, 0.9, 0.8))
    c.text(x + w / 2, y + 36, "HARBOUR", 25, "display", "#f6ead2", "c", bold=True, tracking=2)
    c.text(x + w / 2, y + 60, "LIGHTS", 25, "display", "#f6ead2", "c", bold=True, tracking=2)
    c.text(x + w / 2, y + 74, "a novel", 8, "script", "#f4d7a1", "c")
    c.text(x + w / 2, y + h - 10, "LIDA BRANDT", 10, "heavy", "#f6ead2", "c", tracking=1.5)
    spine_text(c, sx, y, t, h, "HARBOUR LIGHTS", "Brandt", "display", "#f6ead2")
    ean13(c, 2 + w - 52, y + h - 36, 40, 24, "978271828182")


def cover_garden(c, x, y, w, h, sx, t, random):
    c.rect(2, y, 2 * w + t, h, "#e9e4d2")
    for _ in range(70):
        px, py, r = random.uniform(0, 2 * w + t), y + random.uniform(0, h), random.uniform(8, 22)
        tone = ("#4d7a4a", "#7fa05a", "#2f5d50", "#a9bf7a", "#d98e55")[int(random.integers(0, 5))]
        with c.at(px, py, random.uniform(0, 360)):
            c.curve([(0, 0), (r * 0.5, -r * 0.35), (r * 1.3, 0), (r * 0.5, r * 0.35)], tone,
                    closed=True)
            c.line(0, 0, r * 1.2, 0, (1, 1, 1, 0.5), 0.5)
    c.rect(x + 16, y + 40, w - 32, 60, "#fbf8ee", "#2f5d50", 1.2)
    c.fit(x + w / 2, y + 66, w - 46, "The Kitchen", "lobster", 22, fill="#2f5d50", align="c",
          bold=True)
    c.fit(x + w / 2, y + 87, w - 56, "Garden Year", "lobster", 20, fill="#d0703c", align="c",
          bold=True)
    c.rect(sx, y, t, h, "#2f5d50")
    spine_text(c, sx, y, t, h, "The Kitchen Garden Year", "Arden", "lobster", "#fbf8ee")


def cover_robots(c, x, y, w, h, sx, t, random):
    c.rect(2, y, 2 * w + t, h, "#b93a2b")
    halftone(c, x, y, w, h, 4, lambda u, v: 0.6 * (1 - v) * u, (0.35, 0.05, 0.05, 0.6))
    sunburst(c, x + w * 0.5, y + h * 0.62, 44, 24, "#f3e3c3")
    c.circle(x + w * 0.5, y + h * 0.62, 24, "#22262d")
    c.circle(x + w * 0.5, y + h * 0.62, 15, "#7fb3bd")
    c.circle(x + w * 0.47, y + h * 0.59, 4, "#f3f6f4")
    c.text(x + 10, y + 34, "Seeing", 28, "black", "#f3e3c3")
    c.text(x + 10, y + 56, "machines", 28, "light", "#f3e3c3")
    c.text(x + 10, y + h - 10, "S. Ono", 8, "heavy", "#f3e3c3")
    spine_text(c, sx, y, t, h, "Seeing machines", "Ono", "black", "#f3e3c3")


def hardcover(cell, size, name):
    """Book lying on its back cover, spine towards -x: boards, arched spine, recessed pages."""
    w, h, t = (s / 1000 for s in size)
    sheet_w, sheet_h = 0.420, 4 * 0.260
    y0 = 0.260 * cell

    def rect(x, width):
        return (x / sheet_w, 1 - (y0 + h) / sheet_h, (x + width) / sheet_w, 1 - y0 / sheet_h)

    thick = 0.0026
    back, front = rect(0.002, w), rect(0.002 + w + t, w)
    plain = (front[0] + 0.01, front[1] + 0.002, front[0] + 0.012, front[1] + 0.004)
    sides = {k: plain for k in ("front", "left", "right", "back")}
    # Boards are built with the height along +x turned later: width w along x, height h along y.
    top = box((w, h, thick), 0.0011, name, uv={"top": front, "bottom": plain,
                                               **sides}).moved(z=t - thick)
    low = box((w, h, thick), 0.0011, name, uv={"bottom": back, "top": plain, **sides})
    edge = (0.95, 0.02, 0.995, 0.24)
    pages = box((w - 0.006, h - 0.008, t - 2 * thick + 0.0004), 0.0, name,
                uv={k: edge
                    for k in ("front", "back", "left", "right", "top", "bottom")})
    pages = pages.moved(x=-0.002, z=thick - 0.0002)
    # The spine: an arched strip along the left edge.
    spine = rect(0.002 + w, t)
    rows = []
    for k in range(7):
        a = math.pi * (k / 6 - 0.5)
        bulge = 0.10 * t * math.cos(a)
        rows.append((-w / 2 - bulge, thick * 0.4 + (t - 0.8 * thick) * (0.5 + 0.5 * math.sin(a)),
                     -math.cos(a) * 0.5 - 0.5, 0.45 * math.sin(a), k / 6))
    p, n, uv = [], [], []
    for x, z, nx, nz, s in rows:
        for sy in (-1, 1):
            p.append((x, sy * h / 2, z))
            n.append((nx, 0, nz))
            uv.append((spine[0] + s * (spine[2] - spine[0]), spine[1] if sy < 0 else spine[3]))
    n = np.array(n) / np.linalg.norm(n, axis=1, keepdims=True)
    faces = [(2 * k, 2 * k + 2, 2 * k + 3, 2 * k + 1) for k in range(6)]
    outer = Patch(np.array(p), n, np.array(uv), faces, [name] * 6)
    inner = Patch(outer.p + np.array([0.0016, 0, 0]), -n, outer.uv, [f[::-1] for f in faces],
                  [name] * 6)
    rim = []
    for sy in (0, 1):
        q = np.vstack([outer.p[sy::2], inner.p[sy::2]])
        strip = [(k, k + 7, k + 8, k + 1) if sy == 0 else (k, k + 1, k + 8, k + 7)
                 for k in range(6)]
        rim.append(
            Patch(q, np.tile([0, 2.0 * sy - 1, 0], (14, 1)), np.tile([plain[:2]], (14, 1)), strip,
                  [name] * 6))
    ends = []
    for k in (0, 6):
        q = np.array([outer.p[2 * k], outer.p[2 * k + 1], inner.p[2 * k + 1], inner.p[2 * k]])
        ends.append(
            Patch(q, np.tile([0, 0, -1.0 if k == 0 else 1.0], (4, 1)), np.tile([plain[:2]], (4, 1)),
                  [(0, 1, 2, 3)] if k == 0 else [(3, 2, 1, 0)], [name]))
    return [("boards", join(top, low)), ("pages", pages), ("spine", join(outer, inner, rim, ends))]


BOOKS = [(178, 246, 34), (156, 232, 27), (170, 214, 19), (135, 205, 15)]


def book_stack():
    model = Model("book_stack")
    model.images["covers.jpg"] = cover_sheet(BOOKS)
    model.material("cover", image="covers.jpg", ks=0.04, ns=70)
    z = 0.0
    for k, (size, turn, dx, dy) in enumerate(
            zip(BOOKS, (86, 97, 81, 104), (0, 0.006, -0.012, 0.014), (0, 0.004, 0.01, -0.004))):
        for part, patch in hardcover(k, size, "cover"):
            model.add(f"book{k}_{part}", patch.rotated("z", turn).moved(dx, dy, z))
        z += size[2] / 1000 + 0.0003
    return model


def notebook_page():
    """Two A5 pages side by side: ruled with notes, and squared with a sketch."""
    c = Canvas(297, 210, 1024, 1024, "#f4f1e6")
    random = rng(820)
    for k in range(27):
        c.line(8, 18 + 7 * k, 140, 18 + 7 * k, (0.45, 0.6, 0.75, 0.6), 0.25)
    for k in range(28):
        c.line(157, 12 + 7 * k, 290, 12 + 7 * k, (0.45, 0.6, 0.75, 0.45), 0.22)
    for k in range(20):
        c.line(157 + 7 * k, 8, 157 + 7 * k, 203, (0.45, 0.6, 0.75, 0.45), 0.22)
    c.line(26, 0, 26, 210, (0.8, 0.35, 0.35, 0.6), 0.3)
    blue = "#23357f"
    for k, line in enumerate(
        ("22 Nov - run 14", "", "carton found at 0.4 m, lost when",
         "the mug passes in front (frame 212)", "-> weigh edges by gradient?", "",
         "sigma depth = 0.8 % of z", "drift after one lap: 11 mm", "",
         "* ask Lida for the thin cable", "* new batteries", "* try slower shutter 1/60", "",
         "it works!!  0.6 mm rms", "(with rolling rows on)")):
        c.text(30 + random.normal(0, 0.6), 23.6 + 10.5 * k, line, 9.2, "hand",
               blue if k < 13 else "#a52a22")
    c.curve([(30, 164), (70, 166), (104, 163)], None, "#a52a22", 0.8)
    cx, cy = 222, 82
    for dx, dy in ((0, 0), (24, -20)):
        c.curve([(cx - 30 + dx, cy - 24 + dy), (cx + 30 + dx, cy - 23 + dy),
                 (cx + 30 + dx, cy + 44 + dy), (cx - 30 + dx, cy + 45 + dy)], None, blue, 0.8,
                closed=True, tension=0.1)
    for sx, sy in ((-30, -24), (30, -23), (30, 44), (-30, 45)):
        c.line(cx + sx, cy + sy, cx + sx + 24, cy + sy - 20, blue, 0.7)
    c.text(cx - 52, cy + 60, "K = [ f 0 cx; 0 f cy ]", 9, "hand", blue)
    c.line(172, 190, 172, 152, blue, 0.7)
    c.line(168, 186, 282, 186, blue, 0.7)
    c.curve([(172, 160), (186, 172), (202, 168), (220, 178), (248, 179), (280, 182)], None,
            "#a52a22", 0.9)
    c.text(252, 196, "t [s]", 7, "hand", blue)
    for k in range(9):  # hatching
        c.line(cx - 26 + 6 * k, cy + 42, cx - 20 + 6 * k, cy + 30, blue, 0.4)
    c.rect(143, 0, 12, 210,
           linear(143, 0, 155, 0, (0, (0, 0, 0, 0.0)), (0.5, (0, 0, 0, 0.3)), (1, (0, 0, 0, 0.0))))
    return picture(mottled(c.array() * 0.89, 821, 0.9, 1.4))


def notebook():
    """Open A5 notebook with a wire spiral along its middle."""
    model = Model("notebook")
    model.images["pages.jpg"] = notebook_page()
    model.material("page", image="pages.jpg", ks=0.01, ns=8)
    model.material("edge", kd=(0.66, 0.62, 0.52), ks=0.0, ns=5)
    model.material("cover", kd=(0.04, 0.10, 0.12), ks=0.04, ns=60)
    model.material("wire", kd=(0.10, 0.10, 0.11), ks=0.3, ns=120)
    for side in (-1, 1):
        left = side < 0
        high = 0.007 if left else 0.005
        body = box(
            (0.142, 0.208, high), 0.0008, "edge", mats={"top": "page"},
            uv={"top": (0.005, 0.005, 0.483, 0.995) if left else (0.517, 0.005, 0.995, 0.995)})
        model.add("pages_left" if left else "pages_right", body.moved(x=side * 0.0775, z=0.0012))
        cover = prism(
            fillet([(-0.0725, -0.107), (0.0725, -0.107), (0.0725, 0.107), (-0.0725, 0.107)], 0.005,
                   3, closed=True), 0.0013, 0.0005, "cover", bevel_seg=1)
        model.add("cover_left" if left else "cover_right", cover.moved(x=side * 0.0775))
    t = np.radians(np.linspace(-35, 215, 9))
    rings = []
    for k in range(22):
        y = -0.094 + 0.188 * k / 21
        rings.append(
            tube(
                np.column_stack(
                    [0.0105 * np.cos(t), y + 0.0012 * np.sin(t * 0.5),
                     0.0072 + 0.0078 * np.sin(t)]), 0.0007, "wire", seg=6))
    model.add("spiral", *rings)
    return model


def sticky_notes():
    """Block of notes whose top sheet curls, and a loose note beside it."""
    c = Canvas(152, 76, 1024, 512, "#e9d45e")
    c.rect(76, 0, 76, 76, "#e79aa0")
    c.paragraph(7, 20, 62, "call the dentist 15:30\ncarton + pasta for Friday", 11, "hand", 1.2,
                "#26357a")
    c.paragraph(83, 22, 62, "back at four - keys under the mug", 12, "note", 1.25, "#333333")
    c.curve([(10, 66), (30, 63), (60, 66)], None, "#b23a2a", 1.0)
    model = Model("sticky_notes")
    model.images["notes.jpg"] = picture(mottled(c.array() * 0.90, 830, 1.0, 1.6))
    model.material("note", image="notes.jpg", ks=0.01, ns=8)
    model.material("block", kd=(0.62, 0.50, 0.10), ks=0.01, ns=8)
    model.add("block", box((0.076, 0.076, 0.018), 0.0006, "block"))

    def leaf_of(u0, lift):
        u, v = np.meshgrid(np.linspace(0, 1, 9), np.linspace(0, 1, 9))
        rise = lift * np.clip(1 - v, 0, 1)**2.2 * (0.6 + 0.4 * u)
        p = np.dstack([(u - 0.5) * 0.076, (v - 0.5) * 0.076 + 0.25 * rise, rise])
        return shell(p, "note", 0.0002, np.dstack([u0 + u * 0.5, v]))

    model.add("top_note", leaf_of(0.0, 0.012).moved(z=0.0184))
    model.add("loose_note", leaf_of(0.5, 0.010).rotated("z", 24).moved(0.094, 0.012, 0.0006))
    return model
