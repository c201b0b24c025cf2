"""An elliptic membrane under tension, in plane stress: the stress sigma_yy at the inner end of the long
axis, the point D. Sides of the elements are curved, on the ellipses, and smaller at D. (On CoFEA's
meshes of triangles of second order CalculiX gives 73.09 and 88.42, Code_Aster 73.13 and 88.33 MPa.)
"""

from math import cos, pi, sin

import meshes
from case import STATIC, Row

TITLE = "NAFEMS LE1: elliptic membrane"
SOURCES = {
    "NAFEMS": "The Standard NAFEMS Benchmarks, rev. 3, 1990, test LE1 (as quoted by Fino and FeenoX).",
    "C8": "independent code, elements of fourth order: 92.6576 +- 0.0006 MPa (section C8 of the set-ups).",
}


def rows(pliant, quick):
    for cells, within in [((8, 12), 0.03), ((24, 36), 0.003)]:
        shape = pliant.mesh("le1.msh", meshes.blocks([(place, cells)]))
        body = {
            "mesh": shape,
            "elastic": {"linear": {"young": 210e9, "poisson": 0.3, "plane": "stress"}},
            "order": 2,
            "mass": {"density": 7800.0},
            "pin": [
                {"half_space": {"normal": [0, 1], "offset": 1e-6}, "axes": ["y"]},
                {"half_space": {"normal": [1, 0], "offset": 1e-6}, "axes": ["x"]},
            ],
            "load": [{"vertices": outer(cells), "pressure": -1e7}],
        }
        probe = [{"name": "D", "at": [2.0, 0.0]}]
        found = pliant.last({"dimension": 2, "time": STATIC, "body": [body], "probe": probe})["D.syy"] * 1e-6
        mesh = f"6-node triangles, {cells[0]} x {cells[1]} boxes"
        yield Row("stress syy at D", "MPa", "NAFEMS", 92.7, found, mesh, within)
        yield Row("stress syy at D", "MPa", "C8", 92.6576, found, mesh, within)


def place(r, s):
    r, s = r * (1 + r) / 2, s * (1 + s) / 2
    x = (1 - r) * 2.0 + r * 3.25
    y = (1 - r) * 1.0 + r * 2.75
    return x * cos(pi / 2 * s), y * sin(pi / 2 * s)


def outer(cells):
    """Vertices of the mesh on the outer ellipse."""
    return meshes.vertices([(place, cells)], lambda x, y: abs((x / 3.25) ** 2 + (y / 2.75) ** 2 - 1) < 1e-9)
