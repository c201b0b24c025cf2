"""Writes scenes/meshes/knot.obj: the closed surface of a tube along a trefoil knot, 0.33 m across.

python tests/tools/write_knot.py > scenes/meshes/knot.obj
"""

from math import cos, hypot, pi, sin

ALONG, AROUND = 96, 14
SCALE, RADIUS = 0.05, 0.45


def centre(t):
    return sin(t) + 2 * sin(2 * t), cos(t) - 2 * cos(2 * t), -sin(3 * t)


def tangent(t):
    return cos(t) + 4 * cos(2 * t), -sin(t) + 4 * sin(2 * t), -3 * cos(3 * t)


def cross(a, b):
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def unit(a):
    return tuple(x / hypot(*a) for x in a)


print("# Tube along a trefoil knot, by tests/tools/write_knot.py")
for i in range(ALONG):
    t = 2 * pi * i / ALONG
    # Sideways in the plane of the knot, then upwards: both turn once about the axis of the knot and close.
    side = unit(cross((0, 0, 1), tangent(t)))
    up = unit(cross(tangent(t), side))
    for j in range(AROUND):
        c, s = cos(2 * pi * j / AROUND), sin(2 * pi * j / AROUND)
        x = (SCALE * (m + RADIUS * (c * a + s * b)) for m, a, b in zip(centre(t), side, up))
        print("v " + " ".join(f"{component:.5f}" for component in x))
for i in range(ALONG):
    for j in range(AROUND):
        a, b = i * AROUND + j + 1, (i + 1) % ALONG * AROUND + j + 1
        c, d = (i + 1) % ALONG * AROUND + (j + 1) % AROUND + 1, i * AROUND + (j + 1) % AROUND + 1
        print(f"f {a} {d} {c} {b}")
