"""Whether `diorama check` names the file that was altered."""

import json
import math
import os
import random
import shutil

import png16
from acceptance import DIORAMA, render, sh

FRAMES = 30


def named(sequence):
    """The files that the check of a sequence finds fault with."""
    result = sh(DIORAMA, "check", sequence, "--json", check=False)
    found = json.loads(result.stdout)
    assert (result.returncode == 1) == bool(found["findings"])
    return found["findings"]


class Tampered:
    """A copy of a sequence, its files linked until they are written."""

    def __init__(self, source, folder, with_manifest):
        self.folder = folder
        shutil.copytree(source, folder, copy_function=lambda a, b: os.link(a, b))
        if not with_manifest:
            (folder / "manifest.csv").unlink()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        shutil.rmtree(self.folder)

    def write(self, name, text):
        (self.folder / name).unlink()
        (self.folder / name).write_text(text)

    def change_pixel(self, name, x, y, change):
        rows, bits = png16.read(self.folder / name)
        rows[y][x] = change(rows[y][x])
        (self.folder / name).unlink()
        png16.write(self.folder / name, rows, bits)

    def change_line(self, name, number, change):
        lines = (self.folder / name).read_text().splitlines()
        at = [i for i, l in enumerate(lines) if not l.startswith("#")][number]
        lines[at] = " ".join(change(lines[at].split()))
        self.write(name, "\n".join(lines) + "\n")

    def names(self, file):
        return any(f["file"] == file for f in named(self.folder))


def moved(axis, step):
    """Turns the fields of a TUM line into those of T * Exp of a step along or about an axis of its own."""
    def change(fields):
        t, q = [float(v) for v in fields[1:4]], [float(v) for v in fields[4:8]]
        unit = [float(k == axis % 3) for k in range(3)]
        if axis < 3:
            t = [a + step * b for a, b in zip(t, rotated(q, unit))]
        else:
            q = product(q, [math.sin(step / 2) * v for v in unit] + [math.cos(step / 2)])
        return fields[:1] + [f"{v:.9f}" for v in t + q]
    return change


def product(a, b):
    ax, ay, az, aw = a
    bx, by, bz, bw = b
    return [aw * bx + ax * bw + ay * bz - az * by, aw * by - ax * bz + ay * bw + az * bx,
            aw * bz + ax * by - ay * bx + az * bw, aw * bw - ax * bx - ay * by - az * bz]


def rotated(q, v):
    conjugate = [-q[0], -q[1], -q[2], q[3]]
    return product(product(q, v + [0.0]), conjugate)[:3]


def altered_bits(report, source, work):
    """The smallest changes, with the manifest."""
    changes = {
        "depth/000003.png": lambda t: t.change_pixel("depth/000003.png", 300, 200, lambda v: v + 1),
        "mask_visib/000004_000000.png": lambda t: t.change_pixel("mask_visib/000004_000000.png", 5, 5, lambda v: 255 - v),
        "groundtruth.txt": lambda t: t.change_line("groundtruth.txt", 5, moved(0, 1e-6)),
        "objects/orange_juice.txt": lambda t: t.change_line("objects/orange_juice.txt", 6, moved(1, 1e-6)),
        "rgb.txt": lambda t: t.change_line("rgb.txt", 7, lambda f: [f"{float(f[0]) + 1e-6:.6f}"] + f[1:]),
    }
    for file, change in changes.items():
        with Tampered(source, work / "tampered", True) as tampered:
            change(tampered)
            report.line(f"check names {file} after its smallest change", "exit 1", tampered.names(file))


def altered_poses(report, source, work):
    for file in ("groundtruth.txt", "objects/orange_juice.txt"):
        found = 0
        for axis in range(6):
            with Tampered(source, work / "tampered", False) as tampered:
                tampered.change_line(file, 4 * axis + 3, moved(axis, 0.005 if axis < 3 else math.radians(0.5)))
                found += tampered.names(file)
        report.limit(f"no manifest, a pose of {file} 5 mm or 0.5 degrees off: found of 6", found, "==", 6)


def altered_depth(report, source, work, on_object):
    """One pixel that is 20 mm off, anywhere with depth, or on the tracked object: in each frame in turn. Not in all of them at once:
    two of the same amount on the same surface look like one thin thing that shows itself twice."""
    chance = random.Random(1)
    found = 0
    for k in range(FRAMES):
        name = f"depth/{k:06d}.png"
        with Tampered(source, work / "tampered", False) as tampered:
            allowed = png16.read(tampered.folder / f"mask_visib/{k:06d}_000000.png" if on_object
                                 else tampered.folder / name)[0]
            x, y = chance.choice([(x, y) for y, row in enumerate(allowed) for x, v in enumerate(row) if v > 100])
            step = chance.choice((-100, 100))
            tampered.change_pixel(name, x, y, lambda v: v + step)
            found += any(f["file"] == name and f"({x}, {y})" in f["what"] for f in named(tampered.folder))
    where = "on the tracked object" if on_object else "anywhere"
    report.limit(f"no manifest, a depth pixel {where} 20 mm off: found of {FRAMES}", found, "==", FRAMES)


def measure(report, work):
    source = work / "tamper"
    render(source, "--frames", f"0:{FRAMES}", "--quality", "draft")
    altered_bits(report, source, work)
    altered_poses(report, source, work)
    altered_depth(report, source, work, True)
    altered_depth(report, source, work, False)
