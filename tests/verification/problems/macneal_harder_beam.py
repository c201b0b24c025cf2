"""A straight cantilever, 6 x 0.2 x 0.1 (along x, y, z), E = 1e7, nu = 0.3, clamped at x = 0, with a unit
force or a unit torque at its tip. The published answers are those of beam theory. Loads are tractions of
the end face.

A solid differs from the theory in three points. Clamping all of the end face prevents the lateral
contraction there: a solid is a little stiffer. The twist of the table is not that of St. Venant for this
section, `T L / (G J)` with `J = 0.2287 b t^3`, which gives 0.03406; both are compared. A force at the end
also shears the beam.

The meshes of 6 x 1 x 1 are the paper's, which distinguish elements of eight nodes from each other. In our
cell the moment is constant along the cell, and the clamped section of the first cell cannot warp. See
[the page of elements](how-to/element.md#quadrilaterals-and-hexahedra-that-bend)."""

from case import STATIC, Row

TITLE = "MacNeal and Harder: straight cantilever"
SOURCES = {
    "MH": "MacNeal and Harder 1985, table 3 (as quoted in the tests of pyfe3d); extension and "
    "bending follow from F L / (E A) and F L^3 / (3 E I).",
    "StV": "S. P. Timoshenko, J. N. Goodier, Theory of Elasticity: torsion of a rectangular bar, "
    "by its series.",
}
LENGTH, WIDTH, HEIGHT = 6.0, 0.2, 0.1
AREA = WIDTH * HEIGHT
# A traction that turns about the axis, with a torque of 1.
POLAR = AREA * (WIDTH**2 + HEIGHT**2) / 12
LOADS = {
    "extension": [1 / AREA, 0, 0],
    "in-plane shear": [0, 1 / AREA, 0],
    "out-of-plane shear": [0, 0, 1 / AREA],
    "twist": [0, f"-(Z - 0.05)/{POLAR}", f"(Y - 0.1)/{POLAR}"],
}
PUBLISHED = {
    "extension": ("m", 3.0e-5),
    "in-plane shear": ("m", 0.1081),
    "out-of-plane shear": ("m", 0.4321),
    "twist": ("rad", 0.03208),
}

# Cells, keys of the body, element, and what each load is allowed to be off.
MESHES = {
    "10-node tetrahedra, 6 x 1 x 1 boxes": ([6, 1, 1], {"order": 2}, None, [0.01, 0.05, 0.05, 0.2]),
    "10-node tetrahedra, 24 x 2 x 2 boxes": ([24, 2, 2], {"order": 2}, None, [0.005, 0.01, 0.01, 0.06]),
    "10-node tetrahedra, 48 x 4 x 4 boxes": ([48, 4, 4], {"order": 2}, None, [0.005, 0.01, 0.01, 0.01]),
    "hexahedra, 6 x 1 x 1": ([6, 1, 1], {}, "hexahedron", [0.015, 0.02, 0.03, 0.17]),
    "hexahedra, 96 x 6 x 4": ([96, 6, 4], {}, "hexahedron", [0.005, 0.01, 0.01, 0.04]),
}


def rows(pliant, quick):
    for mesh, (count, options, element, within) in MESHES.items():
        if quick and count[0] > 24:
            continue
        for i, (load, traction) in enumerate(LOADS.items()):
            ours = tip(pliant, count, options, element, load, traction)
            unit, published = PUBLISHED[load]
            if load == "twist":
                # What the table's section is stiffer, 6.2 %, is allowed beside.
                yield Row(load, unit, "MH", published, ours, mesh, max(within[i], 0.065))
                yield Row(load, unit, "StV", 0.034061, ours, mesh, within[i])
            else:
                yield Row(load, unit, "MH", published, ours, mesh, within[i])


def tip(pliant, count, options, element, load, traction):
    """Displacement of the middle of the end, or its turn."""
    grid = {"cells": count, "size": [LENGTH, WIDTH, HEIGHT]} | ({"element": element} if element else {})
    body = {
        "mesh": {"grid": grid},
        "elastic": {"linear": {"young": 1e7, "poisson": 0.3}},
        "mass": {"density": 1.0},
        "pin": [{"half_space": {"normal": [1, 0, 0], "offset": 0}}],
        "load": [{"half_space": {"normal": [-1, 0, 0], "offset": -LENGTH}, "traction": traction}],
        **options,
    }
    probes = [{"name": f"c{y}{z}", "at": [LENGTH, y * WIDTH, z * HEIGHT]} for y in (0, 1) for z in (0, 1)]
    found = pliant.last({"dimension": 3, "time": STATIC, "body": [body], "probe": probes})
    if load == "twist":
        # Corners turn as rigid bodies do, but for warping along x.
        rise = [found[f"c1{z}.uz"] - found[f"c0{z}.uz"] for z in (0, 1)]
        return sum(rise) / 2 / WIDTH
    axis = {"extension": "ux", "in-plane shear": "uy", "out-of-plane shear": "uz"}[load]
    return sum(found[f"c{y}{z}.{axis}"] for y in (0, 1) for z in (0, 1)) / 4
