"""A scene that a camera in a hand sees from views that have nothing to do with one another.

    random_views.py SCENE VIEWS SEED OUT.yaml

The scene stays as it is but for its path: one frame a second, each from another place around the tracked object: 10 to 70 degrees
above it, 0.4 to 1.2 m from its middle, the object not always in the middle of the picture.
"""

import math
import random
import re
import sys
from pathlib import Path

ELEVATION = (math.radians(10), math.radians(70))
DISTANCE_M = (0.4, 1.2)
MIDDLE_M = 0.11  # height of the objects' middles above the desk
ASIDE_M = 0.05  # standard deviation of the point that is looked at
TILT_RAD = 0.08
REST_S, MOVE_S = 0.2, 0.8  # a frame is taken in the middle of a rest
TREMOR = "{amplitude_m: 0.003, amplitude_rad: 0.006, band_hz: [1.5, 8], seed: %d}"  # as in our scenes


def view(draw, x, y):
    azimuth, elevation = draw.uniform(-math.pi, math.pi), draw.uniform(*ELEVATION)
    distance = draw.uniform(*DISTANCE_M)
    flat = distance * math.cos(elevation)
    position = (x + flat * math.cos(azimuth), y + flat * math.sin(azimuth), MIDDLE_M + distance * math.sin(elevation))
    target = [c + draw.gauss(0, ASIDE_M) for c in (x, y, MIDDLE_M)]
    return position, target, draw.gauss(0, TILT_RAD)


def segment(draw, k, x, y):
    position, target, tilt = view(draw, x, y)
    rest = REST_S / 2 if k == 0 else REST_S
    point = lambda p: "[%.5f, %.5f, %.5f]" % tuple(p)
    return (f"    - {{type: rest, position: {point(position)}, look_at: {point(target)}, roll_rad: {tilt:.5f}, "
            f"duration_s: {rest}, join_s: {MOVE_S}}}")


def scene_of_views(scene, views, seed):
    """The text of such a scene; `scene` is the text of a file whose last key is `path`."""
    head = scene[:re.search(r"^path:", scene, re.M).start()]
    tracked = next(line for line in head.splitlines() if "track: true" in line)
    x, y = (float(v) for v in re.search(r"at: \[([-0-9.]+), ([-0-9.]+)\]", tracked).groups())
    head = re.sub(r"^duration_s:.*$", f"duration_s: {views}", head, flags=re.M)
    head = re.sub(r"^( +rate_hz:) .*$", r"\1 1", head, flags=re.M)
    head = re.sub(r"^seed:.*$", f"seed: {seed}", head, flags=re.M)
    draw = random.Random(seed)
    segments = "\n".join(segment(draw, k, x, y) for k in range(views))
    return f"{head}path:\n  type: sequence\n  segments:\n{segments}\n  shake:\n    - {TREMOR % seed}\n"


if __name__ == "__main__":
    if len(sys.argv) != 5:
        sys.exit(__doc__)
    Path(sys.argv[4]).write_text(scene_of_views(Path(sys.argv[1]).read_text(), int(sys.argv[2]), int(sys.argv[3])))
