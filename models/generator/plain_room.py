"""An environment with next to nothing to see: a bare table in a bare room."""

from .mesh import Model
from .room_shell import quad
from .shapes import box

FLOOR, CEILING, X, Y = -0.74, 1.86, 2.5, 2.3
ENVIRONMENT = """# Lights emit towards cross(half_u, half_v); radiance in W/(sr m^2) up to one scale.
mesh: plain_room.obj
lights:
  - {type: area, center: [0.0, -0.2, 1.8], half_u: [0.6, 0.0, 0.0], half_v: [0.0, -0.4, 0.0], radiance: [26.0, 24.5, 22.0]}
  - {type: area, center: [-2.42, 0.0, 0.7], half_u: [0.0, 0.7, 0.0], half_v: [0.0, 0.0, 0.6], radiance: [6.0, 6.8, 8.0]}
surfaces:
  table: {z: 0.0, x: [-0.8, 0.8], y: [-0.4, 0.4]}
"""


def grid(corner, along, up, n, mat):
    """A wall of n x n squares, so that the light on it can vary."""
    patches = []
    for i in range(n):
        for j in range(n):
            p = [[c + a * (i + di) / n + u * (j + dj) / n for c, a, u in zip(corner, along, up)]
                 for di, dj in ((0, 0), (1, 0), (1, 1), (0, 1))]
            patches.append(quad(p, mat))
    return patches


def build():
    model = Model("plain_room")
    model.material("wall", kd=(0.62, 0.61, 0.58), ks=0.0, ns=5)
    model.material("floor", kd=(0.30, 0.29, 0.28), ks=0.02, ns=20)
    model.material("table", kd=(0.50, 0.49, 0.46), ks=0.02, ns=25)
    model.material("lamp", kd=(1, 1, 1), ks=0, ns=5, ke=(24.0, 23.0, 21.0))
    h = CEILING - FLOOR
    model.add("floor", *grid((-X, -Y, FLOOR), (2 * X, 0, 0), (0, 2 * Y, 0), 6, "floor"))
    model.add("ceiling", *grid((-X, Y, CEILING), (2 * X, 0, 0), (0, -2 * Y, 0), 6, "wall"))
    model.add("back", *grid((-X, Y, FLOOR), (2 * X, 0, 0), (0, 0, h), 6, "wall"))
    model.add("front", *grid((X, -Y, FLOOR), (-2 * X, 0, 0), (0, 0, h), 6, "wall"))
    model.add("right", *grid((X, Y, FLOOR), (0, -2 * Y, 0), (0, 0, h), 6, "wall"))
    model.add("left", *grid((-X, -Y, FLOOR), (0, 2 * Y, 0), (0, 0, h), 6, "wall"))
    model.add("table", box((1.6, 0.8, 0.03), 0.004, "table", seg=3).moved(z=-0.03))
    for k, (x, y) in enumerate(((-0.74, -0.34), (0.74, -0.34), (0.74, 0.34), (-0.74, 0.34))):
        model.add(f"leg{k}", box((0.05, 0.05, 0.71), 0.004, "table").moved(x, y, FLOOR))
    model.add("lamp", quad([(-0.6, 0.2, 1.801), (0.6, 0.2, 1.801), (0.6, -0.6, 1.801),
                            (-0.6, -0.6, 1.801)], "lamp"))
    model.texts["environment.yaml"] = ENVIRONMENT
    return model
