"""Patches (vertices, normals, texture coordinates, faces) and the OBJ/MTL writer.

Metres, z up, front towards -y. A patch keeps one row per corner that differs in normal or texture
coordinate; the writer welds equal positions inside each named part, so a smooth or a creased edge
is one edge in the OBJ and parts that only touch stay apart.
"""

import math
from dataclasses import dataclass, field, replace

import numpy as np


@dataclass
class Patch:
    """p, n: (k, 3); uv: (k, 2); faces: tuples of 3 or 4 rows; mats: one material name per face."""

    p: np.ndarray
    n: np.ndarray
    uv: np.ndarray
    faces: list
    mats: list

    def transformed(self, matrix, offset=(0, 0, 0)):
        """Applies p -> matrix p + offset; a mirror image keeps outward winding."""
        m = np.asarray(matrix, float)
        normal = self.n @ np.linalg.inv(m)
        length = np.linalg.norm(normal, axis=1, keepdims=True)
        faces = self.faces
        if np.linalg.det(m) < 0:
            faces = [f[::-1] for f in faces]
        return replace(self, p=self.p @ m.T + np.asarray(offset, float),
                       n=normal / np.where(length > 0, length, 1), faces=faces)

    def moved(self, x=0.0, y=0.0, z=0.0):
        return replace(self, p=self.p + np.array([x, y, z], float))

    def rotated(self, axis, degrees):
        return self.transformed(rotation(axis, degrees))

    def scaled(self, x, y=None, z=None):
        return self.transformed(np.diag([x, x if y is None else y, x if z is None else z]))

    def with_material(self, name):
        return replace(self, mats=[name] * len(self.faces))

    def flipped(self):
        return replace(self, n=-self.n, faces=[f[::-1] for f in self.faces])


def rotation(axis, degrees):
    """Right-handed rotation matrix about 'x', 'y' or 'z'."""
    c, s = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    i = "xyz".index(axis)
    j, k = (i + 1) % 3, (i + 2) % 3
    m = np.eye(3)
    m[j, j], m[j, k], m[k, j], m[k, k] = c, -s, s, c
    return m


def join(*patches):
    """One patch out of several (nested lists allowed)."""
    flat = []
    for patch in patches:
        flat.extend(patch if isinstance(patch, (list, tuple)) else [patch])
    faces, mats, base = [], [], 0
    for patch in flat:
        faces += [tuple(i + base for i in f) for f in patch.faces]
        mats += patch.mats
        base += len(patch.p)
    return Patch(np.vstack([q.p for q in flat]), np.vstack([q.n for q in flat]),
                 np.vstack([q.uv for q in flat]), faces, mats)


@dataclass
class Material:
    kd: tuple = (1.0, 1.0, 1.0)  # linear tint, multiplied on the texture
    image: str = ""  # texture file
    ks: float = 0.02
    ns: float = 20.0
    ke: tuple = ()  # radiance


@dataclass
class Model:
    """A named model: parts, materials and texture images, written into one folder."""

    name: str
    materials: dict = field(default_factory=dict)
    parts: list = field(default_factory=list)
    images: dict = field(default_factory=dict)
    texts: dict = field(default_factory=dict)

    def material(self, name, **keys):
        self.materials[name] = Material(**keys)
        return name

    def add(self, name, *patches):
        self.parts.append((name, join(*patches)))

    def triangles(self):
        return sum(len(f) - 2 for _, patch in self.parts for f in patch.faces)

    def write(self, folder):
        """Writes NAME.obj, NAME.mtl, the images (name -> saver) and extra text files."""
        folder.mkdir(parents=True, exist_ok=True)
        (folder / f"{self.name}.obj").write_text(self._obj())
        (folder / f"{self.name}.mtl").write_text(self._mtl())
        for name, picture in self.images.items():
            save_picture(folder / name, picture)
        for name, text in self.texts.items():
            (folder / name).write_text(text)

    def _obj(self):
        lines = [f"# {self.name}: metres, z up, front towards -y", f"mtllib {self.name}.mtl"]
        base_v = 0
        uvs, normals = {}, {}
        for name, patch in self.parts:
            lines.append(f"o {name}")
            v, vt, vn = {}, [], []
            row = []
            for p, uv, n in zip(patch.p, patch.uv, patch.n):
                kp, kt, kn = fixed(p, 5), fixed(uv, 5), fixed(n, 3)
                if kt not in uvs:
                    uvs[kt] = len(uvs) + 1
                    vt.append("vt " + kt)
                if kn not in normals:
                    normals[kn] = len(normals) + 1
                    vn.append("vn " + kn)
                row.append((v.setdefault(kp, base_v + len(v) + 1), uvs[kt], normals[kn]))
            lines += ["v " + k for k in v] + vt + vn
            base_v += len(v)
            by_material = {}
            for f, m in zip(patch.faces, patch.mats):
                corners = []
                for i in f:
                    if not corners or row[i][0] != corners[-1][0]:
                        corners.append(row[i])
                if len(corners) > 1 and corners[0][0] == corners[-1][0]:
                    corners.pop()
                if len(corners) >= 3:
                    text = " ".join("%d/%d/%d" % c for c in corners)
                    by_material.setdefault(m, []).append("f " + text)
            for m in sorted(by_material):
                lines += [f"usemtl {m}"] + by_material[m]
        return "\n".join(lines) + "\n"

    def _mtl(self):
        used = {m for _, patch in self.parts for m in patch.mats}
        lines = []
        for name in sorted(used):
            m = self.materials[name]
            lines += [
                f"newmtl {name}", "Kd " + fixed(m.kd, 4), "Ks " + fixed([m.ks] * 3, 4),
                "Ns " + fixed([m.ns], 1)
            ]
            if m.ke:
                lines.append("Ke " + fixed(m.ke, 4))
            if m.image:
                lines.append(f"map_Kd {m.image}")
                if m.ke:
                    lines.append(f"map_Ke {m.image}")
            lines.append("")
        return "\n".join(lines)


def fixed(values, digits):
    """Numbers with at most `digits` decimals; the same text whatever the last bits of a double."""
    words = []
    for value in values:
        word = f"{round(float(value), digits + 4):.{digits}f}"
        word = word.rstrip("0").rstrip(".") if "." in word else word
        words.append("0" if word in ("-0", "") else word)
    return " ".join(words)


def save_picture(path, picture):
    """`picture` is a PIL image; JPEG for photo-like textures, PNG for small or flat ones."""
    if path.suffix == ".jpg":
        picture.convert("RGB").save(path, quality=90, subsampling=0)
    else:
        picture.save(path, optimize=True)
