"""A thick tube in plane strain and a thick ball, inner radius 1, outer radius 2, of nearly incompressible
neo-Hookean rubber, E = 300 kPa, nu = 0.4999. They are inflated by the pressure that makes the inner
radius 1.2, 1.5 or 2 in the closed forms of an incompressible one. The pressure follows the surface. The
meshes are a quarter of the tube and an eighth of the ball.
"""

from math import cos, hypot, log, pi, sin, sqrt

import meshes
from case import STATIC, Row

TITLE = "Rivlin: a thick tube and a thick ball blown up"
SOURCES = {
    "Rivlin": "R. S. Rivlin, Large elastic deformations of isotropic materials VI, Philosophical "
    "Transactions A 242 (1949) 173-195; with a the ratio of inner radii, b of outer ones: tube, "
    "p = mu (ln(a/b) + (1/b^2 - 1/a^2)/2); ball, p = mu (2/b + 1/(2 b^4) - 2/a - 1/(2 a^4)).",
}
YOUNG, POISSON = 3e5, 0.4999
SHEAR = YOUNG / 2 / (1 + POISSON)


def rows(pliant, quick):
    for inner in (1.2, 1.5, 2.0):
        for element, count, within in (("simplex", (8, 8), 1e-3), ("cell", (16, 16), 1e-3)):
            ours = inflated(pliant, [(tube, count)], element, tube_pressure(inner))
            kind = "6-node triangles, 8 x 8 boxes" if element == "simplex" else "quadrilaterals, 16 x 16"
            yield Row(
                f"tube, inner radius at {tube_pressure(inner):.0f} Pa",
                "",
                "Rivlin",
                inner,
                ours,
                kind,
                within,
            )
    for inner in (1.2, 1.5):
        for element, count, within in (("simplex", (3, 3, 3), 1e-2), ("cell", (8, 8, 8), 5e-3)):
            if quick:
                continue
            parts = [(ball(axis), count) for axis in range(3)]
            ours = inflated(pliant, parts, element, ball_pressure(inner))
            size = " x ".join(map(str, count))
            kind = (
                f"10-node tetrahedra, 3 of {size} boxes"
                if element == "simplex"
                else f"hexahedra, 3 of {size}"
            )
            yield Row(
                f"ball, inner radius at {ball_pressure(inner):.0f} Pa",
                "",
                "Rivlin",
                inner,
                ours,
                kind,
                within,
            )


def inflated(pliant, parts, element, pressure):
    """Inner radius under a pressure."""
    dimension = len(parts[0][1])
    points = meshes.built(parts, element)[0]
    normals = [[1 if i == axis else 0 for i in range(dimension)] for axis in range(dimension)]
    body = {
        "mesh": pliant.mesh("thick.msh", meshes.blocks(parts, element)),
        "elastic": {"isochoric-neo-hookean": {"young": YOUNG, "poisson": POISSON}},
        "mass": {"density": 1.0},
        "pin": [
            {"half_space": {"normal": normal, "offset": 1e-9}, "axes": ["xyz"[axis]]}
            for axis, normal in enumerate(normals)
        ],
        "load": [
            {
                "vertices": [i for i, point in enumerate(points) if abs(hypot(*point) - 1) < 1e-9],
                "pressure": f"{pressure!r} * t",
            }
        ],
    } | ({"order": 2} if element == "simplex" else {})
    time = STATIC | {"step": 0.1, "solver": {"retries": 6}}
    probe = [{"name": "p", "at": [1.0] + [0.0] * (dimension - 1)}]
    return pliant.last({"dimension": dimension, "time": time, "body": [body], "probe": probe})["p.x"]


def tube(r, s):
    return (1 + r) * cos(pi / 2 * s), (1 + r) * sin(pi / 2 * s)


def ball(axis):
    """A third of an eighth of a ball: where the coordinate `axis` is the largest."""

    def place(r, u, v):
        direction = (1.0, u, v)
        turned = tuple(direction[(i - axis) % 3] for i in range(3))
        return tuple((1 + r) * x / sqrt(1 + u * u + v * v) for x in turned)

    return place


def tube_pressure(inner):
    outer = sqrt(4 + inner**2 - 1) / 2
    return SHEAR * (log(inner / outer) + (outer**-2 - inner**-2) / 2)


def ball_pressure(inner):
    outer = (8 + inner**3 - 1) ** (1 / 3) / 2
    return SHEAR * (2 / outer + outer**-4 / 2 - 2 / inner - inner**-4 / 2)
