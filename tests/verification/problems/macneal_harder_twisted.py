"""A cantilever of length 12 and section 1.1 x 0.32, twisted by 90 degrees over its length, E = 29e6, nu =
0.22, with a unit force at the tip, along the wide or the narrow side of the end.
"""

from math import cos, pi, sin

import meshes
from case import STATIC, Row

TITLE = "MacNeal and Harder: twisted beam"
SOURCES = {
    "MH": "MacNeal and Harder 1985, table 5, as Altair's OS-V 0700 quotes it; its HEX20 give "
    "1.017 and 1.052 of it, its HEX8 0.986 and 1.005.",
    "solid": "P. Krysl, FinEtools, `pub_Twisted_beam`: limits of solid elements, 0.001753248285256 "
    "and 0.005424534868469.",
}
PUBLISHED = {"in plane": ("y", 0.001754, 0.001753248285), "out of plane": ("z", 0.005424, 0.005424534868)}

MESHES = [((12, 2, 1), "simplex", 0.02), ((48, 4, 2), "simplex", 0.003), ((96, 8, 4), "cell", 0.01)]


def rows(pliant, quick):
    for count, elements, within in MESHES:
        if quick and count[0] > 12:
            continue
        mesh = meshes.described(count, elements)
        shape = pliant.mesh("twisted.msh", meshes.blocks([(place, count)], elements))
        for load, (axis, published, limit) in PUBLISHED.items():
            traction = [0.0, 0.0, 0.0]
            traction["xyz".index(axis)] = 1 / (1.1 * 0.32)
            body = {
                "mesh": shape,
                "elastic": {"linear": {"young": 29e6, "poisson": 0.22}},
                "mass": {"density": 1.0},
                "pin": [{"half_space": {"normal": [1, 0, 0], "offset": 1e-6}}],
                "load": [{"half_space": {"normal": [-1, 0, 0], "offset": -12 + 1e-6}, "traction": traction}],
            } | ({"order": 2} if elements == "simplex" else {})
            probe = [{"name": "tip", "at": [12.0, 0.0, 0.0]}]
            found = pliant.last({"dimension": 3, "time": STATIC, "body": [body], "probe": probe})
            yield Row(load, "m", "MH", published, found[f"tip.u{axis}"], mesh, within)
            yield Row(load, "m", "solid", limit, found[f"tip.u{axis}"], mesh, within)


def place(s, w, t):
    angle, y, z = pi / 2 * s, 1.1 * (w - 0.5), 0.32 * (t - 0.5)
    return 12 * s, y * cos(angle) - z * sin(angle), y * sin(angle) + z * cos(angle)
