"""A tapered membrane in plane stress, 10 m long and 5 to 1 m high, clamped at its wide end. The targets are
mesh values themselves: converged values are 0.01 to 0.05 % lower.
"""

from case import STATIC, Row

TITLE = "NAFEMS FV32: tapered membrane"
SOURCES = {
    "NAFEMS": "NAFEMS R0015, Selected Benchmarks for Natural Frequency Analysis, FV32 (as quoted by Altair).",
    "C8": "independent code, elements of fourth order (section C8 of the set-ups).",
}
NAFEMS = [44.623, 130.03, 162.70, 246.05, 379.90, 391.44]
LIMITS = [44.617016, 130.00947, 162.68874, 245.98596, 379.7175, 391.40420]


def rows(pliant, quick):
    for options, cells, within in [
        ({"order": 2}, [16, 8], 0.001),
        ({"element": "quadrilateral"}, [32, 16], 0.015),
    ]:
        options = dict(options)
        element = {"element": options.pop("element")} if "element" in options else {}
        body = {
            "mesh": {"tapered_beam": {"cells": cells} | element},
            "elastic": {"linear": {"young": 200e9, "poisson": 0.3, "plane": "stress"}},
            "mass": {"density": 8000.0},
            "pin": [{"group": "left"}],
            **options,
        }
        found = pliant.frequencies({"dimension": 2, "time": STATIC, "body": [body]}, 6)
        mesh = (
            f"quadrilaterals, {cells[0]} x {cells[1]}"
            if element
            else f"6-node triangles, {cells[0]} x {cells[1]} boxes"
        )
        for mode, ours in enumerate(found):
            yield Row(f"mode {mode + 1}", "Hz", "NAFEMS", NAFEMS[mode], ours, mesh, within)
            yield Row(f"mode {mode + 1}", "Hz", "C8", LIMITS[mode], ours, mesh, within)
