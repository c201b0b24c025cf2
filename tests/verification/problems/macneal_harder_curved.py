"""A quarter of a ring, radii 4.12 and 4.32, thickness 0.1, E = 1e7, nu = 0.25, is clamped at one end, with a
unit force at the other, in the plane along the radius of the clamped end, or out of it. The published
answers are those of beam theory, and those to which solid elements converge.
"""

from math import cos, pi, sin

import meshes
from case import STATIC, Row

TITLE = "MacNeal and Harder: curved beam"
SOURCES = {
    "MH": "MacNeal and Harder 1985, table 4 (as quoted by FinEtools and in the tests of pyfe3d).",
    "solid": "P. Krysl, FinEtools, `curved_beam`: limits of solid elements by refinement, "
    "0.088519352226485 and 0.498301636614788.",
}
PUBLISHED = {
    "in plane": [("MH", 0.08734), ("solid", 0.0885193522)],
    "out of plane": [("MH", 0.5022), ("solid", 0.4983016366)],
}
MESHES = [
    ((6, 1, 1), "simplex", 0.12),
    ((24, 2, 2), "simplex", 0.025),
    ((48, 4, 4), "simplex", 0.005),
    ((192, 6, 4), "cell", 0.02),
]


def rows(pliant, quick):
    for count, elements, within in MESHES:
        if quick and count[0] > 24:
            continue
        mesh = meshes.described(count, elements)
        shape = pliant.mesh("curved.msh", meshes.blocks([(place, count)], elements))
        for axis, (load, published) in enumerate(PUBLISHED.items(), 1):
            traction = [0.0, 0.0, 0.0]
            # Along y is the radius at the end that is free.
            traction[1 if axis == 1 else 2] = 1 / 0.02
            body = {
                "mesh": shape,
                "elastic": {"linear": {"young": 1e7, "poisson": 0.25}},
                "mass": {"density": 1.0},
                "pin": [{"half_space": {"normal": [0, 1, 0], "offset": 1e-6}}],
                "load": [{"half_space": {"normal": [1, 0, 0], "offset": 1e-6}, "traction": traction}],
            } | ({"order": 2} if elements == "simplex" else {})
            probe = [{"name": "tip", "at": [0.0, 4.22, 0.05]}]
            found = pliant.last({"dimension": 3, "time": STATIC, "body": [body], "probe": probe})
            for source, value in published:
                # A solid of this shape differs from a beam by 1.4 and 0.8 %.
                limit = within + 0.014 if source == "MH" else within
                yield Row(load, "m", source, value, found[f"tip.u{'y' if axis == 1 else 'z'}"], mesh, limit)


def place(s, r, z):
    radius, angle = 4.12 + 0.2 * r, pi / 2 * (1 - s)
    return radius * cos(angle), radius * sin(angle), 0.1 * z
