"""A panel with the corners (0, 0), (48, 44), (48, 60), (0, 44) is clamped on its left, with a uniform load
on its right. The result is the vertical displacement of the middle (48, 52) or the corner (48, 60) of the
right side. The literature's 23.96 is that of the middle. Further limits, for large strains and near
incompressibility, are those of an independent code with elements of fourth order (section C9 of
`tests/verification.md`).
"""

from case import STATIC, Row

TITLE = "Cook's membrane"
SOURCES = {
    "Cook": "R. D. Cook, Improved two-dimensional finite element, Journal of the Structural "
    "Division (ASCE) 100 (1974) 1851-1863, E = 1, nu = 1/3, plane stress, force 1; 23.96 is "
    "the value that later papers compare with, 23.91 that of Ibrahimbegovic, Taylor and "
    "Wilson 1990.",
    "C9": "independent code, elements of fourth order, graded.",
}
LINEAR = {"linear": {"young": 1.0, "poisson": 1 / 3, "plane": "stress"}}
MESHES = {
    "3-node triangles": {},
    "6-node triangles": {"order": 2},
    "quadrilaterals": {"element": "quadrilateral"},
}


def rows(pliant, quick):
    for kind, cells, within in [
        ("3-node triangles", 32, 0.04),
        ("6-node triangles", 16, 0.003),
        ("quadrilaterals", 32, 0.003),
        ("6-node triangles", 64, 0.0005),
    ]:
        ours = rise(pliant, cells, kind, LINEAR, "1/16", 52.0)
        mesh = f"{kind}, {cells} x {cells}" + ("" if kind == "quadrilaterals" else " boxes")
        yield Row("middle, linear, plane stress", "m", "Cook", 23.96, ours, mesh, within)
        yield Row("middle, linear, plane stress", "m", "C9", 23.96774, ours, mesh, within)
    soft = {"neo-hookean": {"young": 240.565, "poisson": 0.3}}
    rubber = {"neo-hookean": {"young": 240.565, "poisson": 0.4999}}
    for kind, cells, material, published, within in [
        ("6-node triangles", 16, soft, 7.78138, 0.005),
        ("quadrilaterals", 32, soft, 7.78138, 0.005),
        ("6-node triangles", 32, rubber, 6.932, 0.02),
        ("quadrilaterals", 48, rubber, 6.932, 0.006),
    ]:
        ours = rise(pliant, cells, kind, material, "6.25 * t", 60.0)
        name = f"corner, neo-Hookean, nu = {material['neo-hookean']['poisson']}"
        mesh = f"{kind}, {cells} x {cells}" + ("" if kind == "quadrilaterals" else " boxes")
        yield Row(name, "m", "C9", published, ours, mesh, within)


def rise(pliant, cells, kind, material, load, height):
    options = dict(MESHES[kind])
    element = {"element": options.pop("element")} if "element" in options else {}
    body = {
        "mesh": {"cooks_membrane": {"cells": [cells, cells]} | element},
        "elastic": material,
        "mass": {"density": 1.0},
        "pin": [{"group": "left"}],
        "load": [{"group": "right", "traction": [0, load]}],
        **options,
    }
    time = STATIC if "linear" in material else STATIC | {"step": 0.25, "solver": {"retries": 4}}
    probe = [{"name": "p", "at": [48.0, height]}]
    return pliant.last({"dimension": 2, "time": time, "body": [body], "probe": probe})["p.uy"]
