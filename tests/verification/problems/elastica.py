"""A cantilever under a large dead force at its tip, `a = F L^2 / (E I)`: rise `w` and shortening `u` of the
tip over the length. The solid is neo-Hookean with nu = 0, twenty times longer than high. The thin beam of
theory neither shears nor stretches: the solid's limits differ by up to 0.2 %.
"""

from case import STATIC, Row

TITLE = "Elastica: a cantilever bent far"
SOURCES = {
    "thin": "elliptic integrals (Frisch-Fay, Flexible Bars, 1962; section C10 of the set-ups).",
    "C10": "independent code, elements of fourth order, the same solid (section C10 of the set-ups).",
}
THIN = {
    1: (0.30172077, 0.05643324),
    2: (0.49345748, 0.16064172),
    5: (0.71379152, 0.38762836),
    10: (0.81060902, 0.5549956),
}
SOLID = {1: (0.3022332, 0.0564998), 2: (0.4944604, 0.1608836), 4: (0.6717244, 0.3295344)}


def rows(pliant, quick):
    for load in (1, 2, 4, 5, 10):
        rise, shortening = tip(pliant, load)
        for source, table, within in [("C10", SOLID, 0.0005), ("thin", THIN, 0.006)]:
            if load in table:
                mesh = "6-node triangles, 40 x 2 boxes"
                yield Row(f"a = {load}, w/L", "", source, table[load][0], rise, mesh, within)
                yield Row(f"a = {load}, u/L", "", source, table[load][1], shortening, mesh, within)


def tip(pliant, load):
    young, height = 1e6, 0.05
    traction = load * young * height**2 / 12
    body = {
        "mesh": {"grid": {"cells": [40, 2], "size": [1.0, height]}},
        "elastic": {"neo-hookean": {"young": young, "poisson": 0.0}},
        "order": 2,
        "mass": {"density": 1000.0},
        "pin": [{"half_space": {"normal": [1, 0], "offset": 0}}],
        "load": [{"half_space": {"normal": [-1, 0], "offset": -1}, "traction": [0, f"{traction!r} * t"]}],
    }
    time = STATIC | {"step": 0.25, "solver": {"retries": 4}}
    probe = [{"name": "tip", "at": [1.0, height / 2]}]
    found = pliant.last({"dimension": 2, "time": time, "body": [body], "probe": probe})
    return found["tip.uy"], -found["tip.ux"]
