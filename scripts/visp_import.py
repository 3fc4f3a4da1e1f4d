"""What the importers of ViSP's image data share: arguments, errors, poses and the writing of a sequence directory."""

import argparse
import math
import os
import shutil
import sys

DEFAULT_SOURCE = "/usr/share/visp-images-data/ViSP-images"
RATE_HZ = 30

MISSING_INPUT, BAD_DATA, CANNOT_WRITE = 66, 65, 74


def fail(code, message):
    print(message, file=sys.stderr)
    sys.exit(code)


def arguments(description):
    parser = argparse.ArgumentParser(description=description)
    parser.add_argument("out", metavar="OUT", help="the sequence directory to write; it must not exist")
    parser.add_argument("--source", default=DEFAULT_SOURCE, help="ViSP's image data (default: %(default)s)")
    return parser.parse_args()


def require(path):
    if not os.path.exists(path):
        fail(MISSING_INPUT, f"{path}: not found; install the package visp-images-data, or give --source DIR")
    return path


def read_numbers(path, count):
    with open(require(path), encoding="ascii", errors="replace") as file:
        words = file.read().split()
    try:
        numbers = [float(word) for word in words]
    except ValueError:
        numbers = []
    if len(numbers) != count or not all(map(math.isfinite, numbers)):
        fail(BAD_DATA, f"{path}: expected {count} numbers")
    return numbers


def lines_without_comments(path):
    with open(require(path), encoding="utf-8", errors="replace") as file:
        lines = [line.split("#")[0].strip() for line in file]
    return [line for line in lines if line]


def quaternion_from_rotation_vector(v):
    """(x, y, z, w)"""
    angle = math.sqrt(sum(c * c for c in v))
    k = math.sin(angle / 2) / angle if angle > 0 else 0.5
    return [k * c for c in v] + [math.cos(angle / 2)]


def quaternion_from_matrix(m):
    """(x, y, z, w) of a 3x3 rotation matrix, by its largest component."""
    trace = m[0][0] + m[1][1] + m[2][2]
    squares = [1 + 2 * m[i][i] - trace for i in range(3)] + [1 + trace]
    k = max(range(4), key=lambda i: squares[i])
    q = [0.0] * 4
    if k == 3:
        q = [m[2][1] - m[1][2], m[0][2] - m[2][0], m[1][0] - m[0][1], squares[3]]
    else:
        i, j, l = k, (k + 1) % 3, (k + 2) % 3
        q[i], q[j], q[l], q[3] = squares[i], m[j][i] + m[i][j], m[l][i] + m[i][l], m[l][j] - m[j][l]
    norm = math.sqrt(sum(c * c for c in q))
    return [c / norm for c in q]


def inverse_pose(rotation, translation):
    transposed = [[rotation[j][i] for j in range(3)] for i in range(3)]
    return transposed, [-sum(transposed[i][j] * translation[j] for j in range(3)) for i in range(3)]


def flow(numbers):
    return "[" + ", ".join(f"{n!r}" for n in numbers) + "]"


def pgm_size(path):
    with open(require(path), "rb") as file:
        words = []
        while len(words) < 3:
            line = file.readline()
            if not line:
                fail(BAD_DATA, f"{path}: not a PGM image")
            words += line.split(b"#")[0].split()
    if words[0] not in (b"P5", b"P2"):
        fail(BAD_DATA, f"{path}: not a PGM image")
    return int(words[1]), int(words[2])


class Sequence:
    """A sequence directory that appears under its name only when it is complete."""

    def __init__(self, out):
        self.out = out
        self.partial = out.rstrip("/") + ".partial"
        if os.path.lexists(out):
            fail(CANNOT_WRITE, f"{out}: exists already; remove it or choose another name")
        shutil.rmtree(self.partial, ignore_errors=True)

    def __enter__(self):
        os.makedirs(os.path.join(self.partial, "rgb"))
        return self

    def __exit__(self, kind, error, trace):
        if kind is None:
            os.rename(self.partial, self.out)
        else:
            shutil.rmtree(self.partial, ignore_errors=True)

    def write(self, name, text):
        path = os.path.join(self.partial, name)
        os.makedirs(os.path.dirname(path), exist_ok=True)
        with open(path, "w", encoding="utf-8") as file:
            file.write(text)

    def write_images(self, images):
        lines = ["# grey images", "# from ViSP's image data", "# timestamp filename"]
        for i, image in enumerate(images):
            name = f"rgb/{i:06d}.pgm"
            shutil.copyfile(image, os.path.join(self.partial, name))
            lines.append(f"{self.time(i)} {name}")
        self.write("rgb.txt", "\n".join(lines) + "\n")

    def write_mesh(self, name, vertices, faces):
        """Faces index from 0; polygons are allowed."""
        lines = ["v " + " ".join(f"{c:.9g}" for c in v) for v in vertices]
        lines += ["f " + " ".join(str(i + 1) for i in face) for face in faces]
        self.write(name, "\n".join(lines) + "\n")

    def write_description(self, size, focal, centre, name, translation, quaternion):
        self.write("sequence.yaml", "\n".join([
            f"camera: {{model: pinhole, width: {size[0]}, height: {size[1]}, fx: {focal[0]!r}, fy: {focal[1]!r}, "
            f"cx: {centre[0]!r}, cy: {centre[1]!r}, distortion: []}}",
            "images: rgb.txt",
            "objects:",
            f"  - name: {name}",
            f"    model: {name}.obj",
            "    scale: 1.0",
            f"    initial_T_camera_object: {{position: {flow(translation)}, quaternion_xyzw: {flow(quaternion)}}}",
        ]) + "\n")

    def write_poses(self, name, header, poses):
        lines = [f"# {header}", "# timestamp tx ty tz qx qy qz qw"]
        for i, (translation, quaternion) in enumerate(poses):
            lines.append(" ".join([self.time(i)] + [f"{c!r}" for c in translation + quaternion]))
        self.write(name, "\n".join(lines) + "\n")

    @staticmethod
    def time(i):
        return f"{i / RATE_HZ:.6f}"


def run(main):
    """Calls main; an operating system error becomes one line and its exit code."""
    try:
        main()
    except OSError as error:
        name = error.filename2 or error.filename
        fail(CANNOT_WRITE, f"{name}: {error.strerror}")
    except KeyboardInterrupt:
        fail(130, "interrupted")
