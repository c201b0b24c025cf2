"""Half a disk of radius 1 m, E = 1 MPa, nu = 0.3, is pressed 8.1 mm onto a plane: `scenes/hertz_2d.toml`,
triangles of first order, with edges of 5 mm at the contact. For the force F per metre and `E* = E / (1 -
nu^2)`, the half width of contact is `a = sqrt(4 F R / (pi E*))`, and the largest pressure `p0 = 2 F / (pi
a)`.
"""

from math import log, pi, sqrt
from pathlib import Path

from case import Row

TITLE = "Hertz: half a disk on a plane"
SOURCES = {
    "Johnson": "K. L. Johnson, Contact Mechanics, 1985, sections 4.2 and 5.6.",
}


def rows(pliant, quick):
    scene = Path(__file__).parents[3] / "scenes" / "hertz_2d.toml"
    found = pliant.summary(scene)
    force = -next(pin["force"][1] for pin in found["reactions"] if pin["name"] == "disk/press")
    modulus = 1e6 / (1 - 0.3**2)
    a = sqrt(4 * force / (pi * modulus))
    pressure = 2 * force / (pi * a)
    approach = force / (pi * modulus) * (2 * log(4 / a) - 1)
    mesh = "3-node triangles, 5 mm"
    # The middle plane goes down by 8.1 mm less the gap at the start; what is left of the gap is counted.
    yield Row("approach", "mm", "Johnson", 1e3 * approach, 8.0 + 1e3 * found["least_gap"]["gap"], mesh, 0.015)
    stress = found["statics"]["von_mises"]
    yield Row(
        "greatest von Mises stress over p0", "", "Johnson", 0.558, stress["value"] / pressure, mesh, 0.05
    )
    yield Row("its height above the plane over a", "", "Johnson", 0.704, stress["at"][1] / a, mesh, 0.05)
