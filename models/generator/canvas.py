"""Drawing in millimetres on a cairo surface: origin top left, y down."""

import math
import subprocess
from contextlib import contextmanager

import cairo
import numpy as np
from PIL import Image

FONTS = {
    "sans": "Lato", "light": "Lato Light", "medium": "Lato Medium", "heavy": "Lato Heavy",
    "black": "Lato Black", "slab": "Roboto Slab", "display": "Bebas Neue",
    "brush": "Kaushan Script", "lobster": "Lobster Two", "serif": "EB Garamond", "hand": "Breip",
    "note": "DkgHandwriting", "script": "Kristi", "round": "Quicksand",
    "narrow": "Yanone Kaffeesatz", "mono": "DejaVu Sans Mono", "ocr": "OCR B"
}


def missing_fonts():
    """Families that fontconfig does not know; cairo would silently take another."""
    listed = subprocess.run(["fc-list", ":", "family"], check=True, capture_output=True, text=True)
    known = {name.strip() for line in listed.stdout.splitlines() for name in line.split(",")}
    return sorted(set(FONTS.values()) - known)


def rgb(colour, alpha=1.0):
    """'#rrggbb' or a tuple (r, g, b[, a]) of 0..1 -> (r, g, b, a)."""
    if isinstance(colour, str):
        values = [int(colour[i:i + 2], 16) / 255 for i in (1, 3, 5)]
        return (*values, alpha)
    return (*colour[:3], (colour[3] if len(colour) > 3 else 1.0) * alpha)


def mix(a, b, t):
    return tuple(x + (y - x) * t for x, y in zip(rgb(a), rgb(b)))


def linear(x0, y0, x1, y1, *stops):
    gradient = cairo.LinearGradient(x0, y0, x1, y1)
    for offset, colour in stops:
        gradient.add_color_stop_rgba(offset, *rgb(colour))
    return gradient


def radial(x, y, r, *stops, fx=None, fy=None, r0=0.0):
    gradient = cairo.RadialGradient(x if fx is None else fx, y if fy is None else fy, r0, x, y, r)
    for offset, colour in stops:
        gradient.add_color_stop_rgba(offset, *rgb(colour))
    return gradient


class Canvas:

    def __init__(self, width, height, px_width, px_height, background="#ffffff"):
        self.width, self.height = width, height
        self.surface = cairo.ImageSurface(cairo.FORMAT_ARGB32, px_width, px_height)
        self.cr = cairo.Context(self.surface)
        self.cr.scale(px_width / width, px_height / height)
        options = cairo.FontOptions()
        options.set_antialias(cairo.ANTIALIAS_GRAY)
        options.set_hint_style(cairo.HINT_STYLE_NONE)
        options.set_hint_metrics(cairo.HINT_METRICS_OFF)
        self.cr.set_font_options(options)
        self.rect(0, 0, width, height, background)

    @contextmanager
    def at(self, x=0.0, y=0.0, degrees=0.0, sx=1.0, sy=None):
        self.cr.save()
        self.cr.translate(x, y)
        self.cr.rotate(math.radians(degrees))
        self.cr.scale(sx, sx if sy is None else sy)
        yield self
        self.cr.restore()

    @contextmanager
    def clipped(self, x, y, w, h, r=0.0):
        self.cr.save()
        self._round_path(x, y, w, h, r)
        self.cr.clip()
        yield self
        self.cr.restore()

    def paint(self, fill=None, stroke=None, width=0.2):
        """Fills and/or strokes the current path; a paint is a colour or a gradient."""
        for paint, keep in ((fill, stroke is not None), (stroke, False)):
            if paint is None:
                continue
            if isinstance(paint, cairo.Pattern):
                self.cr.set_source(paint)
            else:
                self.cr.set_source_rgba(*rgb(paint))
            if paint is fill:
                (self.cr.fill_preserve if keep else self.cr.fill)()
            else:
                self.cr.set_line_width(width)
                self.cr.stroke()
        self.cr.new_path()

    def rect(self, x, y, w, h, fill=None, stroke=None, width=0.2, r=0.0):
        self._round_path(x, y, w, h, r)
        self.paint(fill, stroke, width)

    def _round_path(self, x, y, w, h, r):
        if r <= 0:
            self.cr.rectangle(x, y, w, h)
            return
        r = min(r, w / 2, h / 2)
        self.cr.new_path()
        for cx, cy, a in ((x + w - r, y + r, -90), (x + w - r, y + h - r, 0),
                          (x + r, y + h - r, 90), (x + r, y + r, 180)):
            self.cr.arc(cx, cy, r, math.radians(a), math.radians(a + 90))
        self.cr.close_path()

    def circle(self, x, y, r, fill=None, stroke=None, width=0.2):
        self.cr.new_path()
        self.cr.arc(x, y, r, 0, 2 * math.pi)
        self.paint(fill, stroke, width)

    def ellipse(self, x, y, rx, ry, fill=None, stroke=None, width=0.2, degrees=0.0):
        self.cr.save()
        self.cr.translate(x, y)
        self.cr.rotate(math.radians(degrees))
        self.cr.scale(rx, ry)
        self.cr.new_path()
        self.cr.arc(0, 0, 1, 0, 2 * math.pi)
        self.cr.restore()
        self.paint(fill, stroke, width)

    def poly(self, points, fill=None, stroke=None, width=0.2, closed=True):
        self.cr.new_path()
        for p in points:
            self.cr.line_to(*p)
        if closed:
            self.cr.close_path()
        self.paint(fill, stroke, width)

    def line(self, x0, y0, x1, y1, stroke="#000000", width=0.2):
        self.cr.move_to(x0, y0)
        self.cr.line_to(x1, y1)
        self.paint(None, stroke, width)

    def curve(self, points, fill=None, stroke=None, width=0.2, closed=False, tension=0.5):
        """Smooth curve through the points (Catmull-Rom)."""
        n = len(points)
        self.cr.new_path()
        self.cr.move_to(*points[0])
        for i in range(n if closed else n - 1):
            if closed:
                q = [points[(i + k) % n] for k in (-1, 0, 1, 2)]
            else:
                q = [points[min(max(i + k, 0), n - 1)] for k in (-1, 0, 1, 2)]
            t = tension / 3 * 2
            c1 = [q[1][k] + (q[2][k] - q[0][k]) * t / 2 for k in (0, 1)]
            c2 = [q[2][k] - (q[3][k] - q[1][k]) * t / 2 for k in (0, 1)]
            self.cr.curve_to(*c1, *c2, *q[2])
        if closed:
            self.cr.close_path()
        self.paint(fill, stroke, width)

    def font(self, name, size, bold=False, italic=False):
        self.cr.select_font_face(FONTS.get(name, name),
                                 cairo.FONT_SLANT_ITALIC if italic else cairo.FONT_SLANT_NORMAL,
                                 cairo.FONT_WEIGHT_BOLD if bold else cairo.FONT_WEIGHT_NORMAL)
        self.cr.set_font_size(size)

    def text_width(self, text, size, font="sans", bold=False, italic=False, tracking=0.0):
        self.font(font, size, bold, italic)
        return self.cr.text_extents(text).x_advance + tracking * max(len(text) - 1, 0)

    def text(self, x, y, text, size, font="sans", fill="#000000", align="l", bold=False,
             italic=False, tracking=0.0, stroke=None, width=0.2):
        """Baseline at y; align l, c or r. `stroke` outlines the letters under the fill."""
        w = self.text_width(text, size, font, bold, italic, tracking)
        x -= {"l": 0.0, "c": w / 2, "r": w}[align]
        self.cr.new_path()
        if tracking:
            for letter in text:
                self.cr.move_to(x, y)
                self.cr.text_path(letter)
                x += self.cr.text_extents(letter).x_advance + tracking
        else:
            self.cr.move_to(x, y)
            self.cr.text_path(text)
        if stroke is not None:
            self.cr.set_line_join(cairo.LINE_JOIN_ROUND)
            path = self.cr.copy_path()
            self.paint(None, stroke, width)
            self.cr.append_path(path)
        self.paint(fill)
        return w

    def fit(self, x, y, w, text, font="sans", size=100.0, **keys):
        """Text scaled down to the width w; returns the size used."""
        style = {k: keys[k] for k in ("bold", "italic") if k in keys}
        tracking = keys.get("tracking", 0.0)
        natural = self.text_width(text, 1.0, font, **style)
        size = min(size, (w - tracking * (len(text) - 1)) / natural)
        self.text(x, y, text, size, font, **keys)
        return size

    def paragraph(self, x, y, w, text, size, font="sans", leading=1.25, fill="#222222",
                  justify=False, **keys):
        """Wrapped text, first baseline at y; returns the baseline after the last line."""
        style = {k: keys[k] for k in ("bold", "italic") if k in keys}
        for block in text.split("\n"):
            lines, line = [], ""
            for word in block.split():
                trial = (line + " " + word).strip()
                if line and self.text_width(trial, size, font, **style) > w:
                    lines.append(line)
                    line = word
                else:
                    line = trial
            lines.append(line)
            for i, line in enumerate(lines):
                words = line.split()
                if justify and i < len(lines) - 1 and len(words) > 1:
                    free = w - sum(self.text_width(v, size, font, **style) for v in words)
                    cx = x
                    for v in words:
                        cx += self.text(cx, y, v, size, font, fill, **
                                        keys) + free / (len(words) - 1)
                else:
                    align = keys.get("align", "l")
                    self.text(x + {"l": 0, "c": w / 2, "r": w}[align], y, line, size, font, fill,
                              **keys)
                y += size * leading
        return y

    def paste(self, picture, x, y, w, h, alpha=1.0):
        """Draws a PIL image (RGB or RGBA) into the rectangle."""
        data = np.asarray(picture.convert("RGBA")).astype(np.uint32)
        a = data[..., 3:4]
        pre = (data[..., :3] * a + 127) // 255
        bgra = np.concatenate([pre[..., ::-1], a], axis=2).astype(np.uint8)
        height, width = bgra.shape[:2]
        buffer = np.ascontiguousarray(bgra)
        surface = cairo.ImageSurface.create_for_data(buffer, cairo.FORMAT_ARGB32, width, height)
        self.cr.save()
        self.cr.translate(x, y)
        self.cr.scale(w / width, h / height)
        self.cr.set_source_surface(surface, 0, 0)
        self.cr.get_source().set_filter(cairo.FILTER_GOOD)
        self.cr.get_source().set_extend(cairo.EXTEND_PAD)
        self.cr.rectangle(0, 0, width, height)
        self.cr.clip()
        self.cr.paint_with_alpha(alpha)
        self.cr.restore()

    def array(self):
        """The picture as float64 (rows, cols, 3), 0..255, sRGB."""
        self.surface.flush()
        h, w = self.surface.get_height(), self.surface.get_width()
        data = np.frombuffer(self.surface.get_data(), np.uint8).reshape(h, -1, 4)[:, :w, 2::-1]
        return data.astype(np.float64)

    def image(self):
        return picture(self.array())


def picture(array):
    """PIL image of an array (rows, cols[, 3]) of 0..255."""
    return Image.fromarray(np.clip(np.rint(array), 0, 255).astype(np.uint8))
