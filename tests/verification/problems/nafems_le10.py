"""A thick plate, a quarter of an elliptic ring with the outlines of LE1 and 0.6 m thick, under a pressure of
1 MPa on its upper face: the stress sigma_yy at the inner end of the long axis, on the upper face (point
D). The outer side is fixed in the plane, its middle line in the vertical direction.

(On CoFEA's fine meshes of second order CalculiX gives -5.77 with tetrahedra and -5.65 MPa with hexahedra,
Code_Aster -5.85 and -5.66, Elmer -3.51 and -5.65.)
"""

from math import cos, pi, sin

import meshes
from case import STATIC, Row

TITLE = "NAFEMS LE10: thick plate"
SOURCES = {
    "NAFEMS": "The Standard NAFEMS Benchmarks, rev. 3, 1990, test LE10 (as quoted by Fino and CoFEA).",
}


def rows(pliant, quick):
    for cells, within in [((6, 8, 4), 0.04), ((12, 16, 8), 0.02)]:
        if quick and cells[0] > 6:
            continue
        parts = [(place, cells)]
        body = {
            "mesh": pliant.mesh("le10.msh", meshes.blocks(parts)),
            "elastic": {"linear": {"young": 210e9, "poisson": 0.3}},
            "order": 2,
            "mass": {"density": 7800.0},
            "pin": [
                {"half_space": {"normal": [0, 1, 0], "offset": 1e-6}, "axes": ["y"]},
                {"half_space": {"normal": [1, 0, 0], "offset": 1e-6}, "axes": ["x"]},
                {"vertices": meshes.vertices(parts, lambda x, y, z: outside(x, y)), "axes": ["x", "y"]},
                {"vertices": meshes.vertices(parts, middle), "axes": ["z"]},
            ],
            "load": [{"half_space": {"normal": [0, 0, -1], "offset": -0.6 + 1e-6}, "pressure": 1e6}],
        }
        probe = [{"name": "D", "at": [2.0, 0.0, 0.6]}]
        found = pliant.last({"dimension": 3, "time": STATIC, "body": [body], "probe": probe})["D.syy"] * 1e-6
        mesh = f"10-node tetrahedra, {' x '.join(map(str, cells))} boxes"
        yield Row("stress syy at D", "MPa", "NAFEMS", -5.38, found, mesh, within)


def place(r, s, z):
    # Finer where the stress is.
    x = 2.0 + 1.25 * r**1.5
    y = 1.0 + 1.75 * r**1.5
    return x * cos(pi / 2 * s), y * sin(pi / 2 * s), 0.6 * z


def outside(x, y):
    return abs((x / 3.25) ** 2 + (y / 2.75) ** 2 - 1) < 1e-9


def middle(x, y, z):
    return outside(x, y) and abs(z - 0.3) < 1e-9
