"""A cantilever of square section, 1 x 1, along an eighth of a circle of radius 100 in a plane, E = 1e7, nu =
0, bends far out of the plane under a force of 600 at its end. The published displacements of the end are
those of beam elements. The solid is St. Venant-Kirchhoff material, in tetrahedra of second order with
curved sides.
"""

from math import cos, pi, sin

import meshes
from case import STATIC, Row

TITLE = "Bathe and Bolourchi: a bend of 45 degrees"
SOURCES = {
    "BB": "K. J. Bathe, S. Bolourchi, Large displacement analysis of three-dimensional beam "
    "structures, International Journal for Numerical Methods in Engineering 14 (1979) 961-986, as "
    "quoted by Kynema: 13.4, 53.4, 23.5.",
    "Kynema": "Kynema's documentation, `curved.rst`: a geometrically exact beam, one spectral element "
    "of nine nodes: 23.64597, 13.72080, 53.57763.",
}
PUBLISHED = {
    "away from the centre": ("x", 1, 13.4, 13.72080),
    "back along the beam": ("y", -1, 23.5, 23.64597),
    "out of the plane": ("z", 1, 53.4, 53.57763),
}


def rows(pliant, quick):
    for count, within in [((16, 1, 1), 0.015), ((32, 2, 2), 0.006)]:
        if quick and count[0] > 16:
            continue
        mesh = f"10-node tetrahedra, {' x '.join(map(str, count))} boxes"
        found = end(pliant, count)
        for name, (axis, sign, beam, exact) in PUBLISHED.items():
            ours = sign * found[axis]
            # The paper's beams are straight elements, eight of them.
            yield Row(name, "", "BB", beam, ours, mesh, within + 0.02)
            yield Row(name, "", "Kynema", exact, ours, mesh, within)


def end(pliant, count):
    """Displacement of the middle of the end."""
    tangent = (-sin(pi / 4), cos(pi / 4))
    offset = tangent[0] * (100 * cos(pi / 4) - 100) + tangent[1] * 100 * sin(pi / 4)
    body = {
        "mesh": pliant.mesh("bend.msh", meshes.blocks([(place, count)])),
        "elastic": {"stvk": {"young": 1e7, "poisson": 0.0}},
        "order": 2,
        "mass": {"density": 1.0},
        "pin": [{"half_space": {"normal": [0, 1, 0], "offset": 1e-6}}],
        "load": [
            {
                "half_space": {"normal": [-tangent[0], -tangent[1], 0], "offset": 1e-6 - offset},
                "traction": [0, 0, "600 * t"],
            }
        ],
    }
    probes = [{"name": f"c{r}{z}", "at": list(place(1, r, z))} for r in (0, 1) for z in (0, 1)]
    time = STATIC | {"step": 0.1, "solver": {"retries": 4}}
    found = pliant.last({"dimension": 3, "time": time, "body": [body], "probe": probes})
    return {axis: sum(found[f"{p['name']}.u{axis}"] for p in probes) / 4 for axis in "xyz"}


def place(s, r, z):
    """From the clamped end at the origin, along y, about (-100, 0)."""
    angle, radius = pi / 4 * s, 100.5 - r
    return radius * cos(angle) - 100, radius * sin(angle), z - 0.5
