"""A quarter of a thick pipe in plane strain, radii 3 and 9, E = 1000, under an internal pressure of 1, from
nearly compressible to nearly incompressible. Elements that lock deform too little. The closed form is
Lamé's.
"""

from math import cos, pi, sin

import meshes
from case import STATIC, Row

TITLE = "MacNeal and Harder: thick-walled cylinder"
SOURCES = {
    "MH": "MacNeal and Harder 1985, table 10 (radial displacement of the inner side).",
    "Lamé": "u = (1 + nu) p a^2 / (E (b^2 - a^2)) ((1 - 2 nu) r + b^2 / r), as in Timoshenko and "
    "Goodier; confirms the table.",
}
PUBLISHED = {0.49: 5.0399e-3, 0.499: 5.0602e-3, 0.4999: 5.0623e-3}


def rows(pliant, quick):
    for elements, count, within in [
        ("simplex", (8, 8), 0.002),
        ("cell", (8, 8), 0.01),
        ("cell", (32, 32), 0.001),
    ]:
        kind = "6-node triangles" if elements == "simplex" else "quadrilaterals"
        shape = pliant.mesh("pipe.msh", meshes.blocks([(place, count)], elements))
        for poisson, published in PUBLISHED.items():
            body = {
                "mesh": shape,
                "elastic": {"linear": {"young": 1000.0, "poisson": poisson}},
                "mass": {"density": 1.0},
                "pin": [
                    {"half_space": {"normal": [0, 1], "offset": 1e-6}, "axes": ["y"]},
                    {"half_space": {"normal": [1, 0], "offset": 1e-6}, "axes": ["x"]},
                ],
                # Radially, and dead: what a pressure is for small displacements. Far from the outer side.
                "load": [
                    {
                        "box": {"min": [-1.0, -1.0], "max": [3.0001, 3.0001]},
                        "traction": [f"{axis} / sqrt(X^2 + Y^2)" for axis in "XY"],
                    }
                ],
            } | ({"order": 2} if elements == "simplex" else {})
            # Points of the x-axis are corners.
            probe = [{"name": "inner", "at": [3.0, 0.0]}]
            found = pliant.last({"dimension": 2, "time": STATIC, "body": [body], "probe": probe})["inner.ux"]
            mesh = f"{kind}, {count[0]} x {count[1]}"
            lame = (1 + poisson) * 9 / (1000 * 72) * ((1 - 2 * poisson) * 3 + 81 / 3)
            yield Row(f"nu = {poisson}", "m", "MH", published, found, mesh, within)
            yield Row(f"nu = {poisson}", "m", "Lamé", lame, found, mesh, within)


def place(r, s):
    # Finer inside.
    radius, angle = 3 * 3**r, pi / 2 * s
    return radius * cos(angle), radius * sin(angle)
