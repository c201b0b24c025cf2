"""A clamped beam of 4 m by 1 m, 8 x 2 cells, E = 1 MPa, nu = 0.3, falls under gravity. The result is the tip
1 s after the release, and in equilibrium, for four materials. The comparison is an independent code of
the same elements, with an integrator of order 8 at a tolerance of 1e-13. The mesh is the same, so the
difference is the integration error alone.
"""

from case import Row

TITLE = "Motion: a beam that falls"
SOURCES = {
    "C13": "DOP853 at 1e-13 on an independent finite element code (section C13 of the set-ups).",
}
BEAM = {
    "neo-hookean": (-1.10035409579, -3.42925983975),
    "stable-neo-hookean": (-1.13802413089, -3.43042972968),
    "fixed-corotated": (-1.12234857208, -3.38545115312),
    "stvk": (-1.17703039439, -3.21491162558),
}
STATIC_TIP = {
    "neo-hookean": (-0.158125211285, -1.90066354057),
    "stable-neo-hookean": (-0.1691161282, -1.9058006055),
    "fixed-corotated": (-0.162785870113, -1.87311977989),
    "stvk": (-0.173098852093, -1.77991628352),
}


def rows(pliant, quick):
    for material, published in BEAM.items():
        found = beam(pliant, material, {"integrator": "rk4", "step": 1 / 3200, "duration": 1.0}, "-9.81")
        for axis, value in zip("xy", published):
            yield Row(
                f"{material}, u{axis} at 1 s",
                "m",
                "C13",
                value,
                found[f"tip.u{axis}"],
                "rk4, 1/3200 s",
                1e-9,
            )
    for material, published in STATIC_TIP.items():
        found = beam(
            pliant, material, {"integrator": "quasi-static", "step": 0.25, "duration": 1.0}, "-9.81 * t"
        )
        for axis, value in zip("xy", published):
            yield Row(
                f"{material}, u{axis} at rest",
                "m",
                "C13",
                value,
                found[f"tip.u{axis}"],
                "quasi-static",
                1e-8,
            )


def beam(pliant, material, time, gravity):
    body = {
        "mesh": {"grid": {"cells": [8, 2], "spacing": 0.5}},
        "elastic": {material: {"young": 1e6, "poisson": 0.3}},
        "mass": {"density": 1000.0},
        "pin": [{"half_space": {"normal": [1, 0], "offset": 0}}],
    }
    scene = {"dimension": 2, "time": time, "world": {"gravity": ["0", gravity]}, "body": [body]}
    return pliant.last(scene | {"probe": [{"name": "tip", "at": [4.0, 1.0]}]})
