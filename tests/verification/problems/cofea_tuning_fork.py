"""A free steel tuning fork: prongs of 3 x 3 mm, 66.74 mm long, on half a ring with the radii 4.2 and 7.2 mm,
on a stem of 3 x 3 mm that ends 30 mm below the centre of the ring; E = 207 GPa, nu = 0.33, 7829 kg/m^3.
The meshes are ours, of the same shape, by elements with curved sides.
"""

from math import asin, cos, pi, sin

import meshes
from case import STATIC, Row

TITLE = "CoFEA: tuning fork, CalculiX and others"
SOURCES = {
    "CalculiX": "CoFEA, benchmark 000 (spolanski/CoFEA, `results.md`): CalculiX, tetrahedra of second "
    "order of 2 mm, 1 mm and 0.5 mm: 441.14, 440.29 and 440.00 Hz; Code_Aster and Elmer "
    "agree to 0.1 Hz.",
    "codes": "CoFEA, benchmark 000, `results_comparison.csv`: CalculiX's column for the five modes; "
    "columns of other codes differ by up to 0.4 %.",
    "linear": "CoFEA, benchmark 000: CalculiX, hexahedra of 8 nodes of 0.5 mm. Ours are other elements.",
}
MODES = [440.05, 673.51, 1689.3, 1825.55, 2777.73]
HALF = asin(1.5 / 7.2)


def rows(pliant, quick):
    for size, kind, within in [(1.5, "simplex", 0.004), (0.75, "simplex", 0.001), (0.75, "cell", 0.02)]:
        if quick and size < 1.5:
            continue
        body = {
            "mesh": pliant.mesh("fork.msh", meshes.blocks(parts(size), kind)),
            "elastic": {"linear": {"young": 207e9, "poisson": 0.33}},
            "mass": {"density": 7829.0},
        } | ({"order": 2} if kind == "simplex" else {})
        found = pliant.frequencies({"dimension": 3, "time": STATIC, "body": [body]}, 11)[6:]
        mesh = f"{'10-node tetrahedra' if kind == 'simplex' else 'hexahedra'}, {size} mm"
        if kind == "cell":
            yield Row("mode 7", "Hz", "linear", 434.17, found[0], mesh, within)
            continue
        for size_there, published in [(1.0, 440.29), (0.5, 440.00)]:
            yield Row(
                f"mode 7, theirs of {size_there} mm", "Hz", "CalculiX", published, found[0], mesh, within
            )
        for mode, published in enumerate(MODES):
            yield Row(f"mode {mode + 7}", "Hz", "codes", published, found[mode], mesh, within + 0.001)


def parts(size):
    """Two prongs, the ring in three, the stem; in mm, then in m."""
    through = round(3 / size)

    def metres(place):
        return lambda *at: tuple(1e-3 * x for x in place(*at))

    def ring(start, end):
        def place(s, r, z):
            radius, angle = 4.2 + 3 * r, start + (end - start) * s
            return radius * cos(angle), radius * sin(angle), 3 * z

        return place

    def prong(side):
        return lambda s, r, z: (side * (4.2 + 3 * r), 66.74 * (1 - s if side > 0 else s), 3 * z)

    middle = -pi / 2

    def stem(s, r, z):
        # From the outer side of the ring down.
        angle = middle + HALF * (1 - 2 * s)
        x, y = 7.2 * cos(angle), 7.2 * sin(angle)
        low = 1.5 - 3 * s
        return (1 - r) * x + r * low, (1 - r) * y - r * 30, 3 * z

    arc = 2 * round(2 * 7 / size / 2)
    found = [
        (prong(1.0), (round(66.74 / 2 / size), through, through)),
        (prong(-1.0), (round(66.74 / 2 / size), through, through)),
        (ring(middle - HALF, -pi), (arc, through, through)),
        (ring(middle + HALF, middle - HALF), (2 * through, through, through)),
        (ring(0.0, middle + HALF), (arc, through, through)),
        (stem, (2 * through, round(23 / 2 / size), through)),
    ]
    return [(metres(place), counts) for place, counts in found]
