#!/usr/bin/python3
"""Checks the models as they are in the repository: closed and outward meshes, normals, textures,
size. Needs nothing but Python; exit code 1 and one line per finding if something is wrong."""

import struct
import sys
from collections import Counter
from pathlib import Path

MODELS = Path(__file__).resolve().parents[2] / "models"
MAX_TOTAL_BYTES = 20_000_000
MAX_TEXTURE_PX = 2048


def read_obj(path):
    """Vertices, normals and {part: faces}, a face being a list of (vertex, normal)."""
    vertices, normals, parts, part = [], [], {}, None
    for line in path.read_text().splitlines():
        key, *words = line.split() or [""]
        if key == "v":
            vertices.append([float(w) for w in words])
        elif key == "vn":
            normals.append([float(w) for w in words])
        elif key == "o":
            part = parts.setdefault(words[0], [])
        elif key == "f":
            corners = [w.split("/") for w in words]
            part.append([(int(c[0]) - 1, int(c[2]) - 1) for c in corners])
    return vertices, normals, parts


def cross(a, b):
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def dot(a, b):
    return sum(x * y for x, y in zip(a, b))


def open_edges(faces):
    edges = Counter()
    for face in faces:
        ids = [v for v, _ in face]
        edges.update(zip(ids, ids[1:] + ids[:1]))
    return sum(1 for (a, b), n in edges.items() if edges.get((b, a), 0) != n)


def volume(vertices, faces):
    total = 0.0
    for face in faces:
        p = [vertices[v] for v, _ in face]
        for k in range(1, len(p) - 1):
            total += dot(p[0], cross(p[k], p[k + 1])) / 6
    return total


def turned_normals(vertices, normals, faces):
    """Faces whose normals point away from their winding by more than a right angle."""
    count = 0
    for face in faces:
        p = [vertices[v] for v, _ in face[:3]]
        n = cross([b - a for a, b in zip(p[0], p[1])], [b - a for a, b in zip(p[0], p[2])])
        count += all(dot(n, normals[i]) < 0 for _, i in face)
    return count


def image_size(path):
    """(width, height) of a PNG or a JPEG file."""
    data = path.read_bytes()
    if data[:4] == b"\x89PNG":
        return struct.unpack(">II", data[16:24])
    at = 2
    while data[at + 1] not in (0xC0, 0xC1, 0xC2):
        at += 2 + struct.unpack(">H", data[at + 2:at + 4])[0]
    height, width = struct.unpack(">HH", data[at + 5:at + 9])
    return width, height


def check_materials(folder):
    mtl = folder / f"{folder.name}.mtl"
    for line in mtl.read_text().splitlines():
        key, *words = line.split() or [""]
        if not key.startswith("map_"):
            continue
        file = folder / words[0]
        if not file.is_file():
            yield f"texture {file.name} is missing"
            continue
        for size in image_size(file):
            if size > MAX_TEXTURE_PX or size & (size - 1):
                yield f"{file.name} is {size} pixels wide or high, not a power of two up to 2048"


def check(folder):
    vertices, normals, parts = read_obj(folder / f"{folder.name}.obj")
    yield from check_materials(folder)
    if (folder / "environment.yaml").is_file():
        return  # walls and posters are open surfaces
    low = [min(v[k] for v in vertices) for k in range(3)]
    high = [max(v[k] for v in vertices) for k in range(3)]
    if abs(low[2]) > 0.001:
        yield f"rests at z = {low[2]} m, not on 0"
    tallest = 1.0 if folder.name == "occluder_pole" else 0.5
    if max(abs(low[k] + high[k]) for k in (0, 1)) > 0.25 or high[2] > tallest:
        yield f"has an odd size or place: {low} to {high}"
    for name, faces in parts.items():
        if len(faces) == 1:
            continue  # a display
        if open_edges(faces):
            yield f"part {name} has {open_edges(faces)} open edges"
        elif volume(vertices, faces) <= 0:
            yield f"part {name} is inside out"
        if turned_normals(vertices, normals, faces) > 0.01 * len(faces):
            yield f"part {name} has normals against its winding"


def main():
    folders = sorted(p.parent for p in MODELS.glob("*/*.obj"))
    findings = [f"{folder.name}: {text}" for folder in folders for text in check(folder)]
    total = sum(f.stat().st_size for folder in folders for f in folder.iterdir())
    if total > MAX_TOTAL_BYTES:
        findings.append(f"the models take {total} bytes, more than {MAX_TOTAL_BYTES}")
    if len(folders) < 15:
        findings.append(f"only {len(folders)} models found")
    for finding in findings:
        print(finding, file=sys.stderr)
    print(f"{len(folders)} models, {total / 1e6:.1f} MB, {len(findings)} findings")
    return 1 if findings else 0


if __name__ == "__main__":
    sys.exit(main())
