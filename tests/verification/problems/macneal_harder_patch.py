"""The displacement of the boundary is linear in the position, and the inner nodes are free: strains and
stresses must be uniform, however irregular the elements. Patches of one square and one cube; both
materials have E = 1e6 and nu = 0.25. The result is the stress in the element of a probe, for
displacements that are 1e-5 of the paper's, multiplied by 1e5: the program's stress is Cauchy's, which at
strains of 1e-3 differs from Hooke's by a fraction of 1e-3.

One published hexahedron has a negative det J at the node (0.320, 0.186, 0.643), -8 % of its mean, though
positive ones at all quadrature points. The program warns of it, and computes.
"""

from case import STATIC, Row

TITLE = "MacNeal and Harder: patch tests"
SOURCES = {
    "MH": "R. H. MacNeal, R. L. Harder, A proposed standard set of problems to test finite "
    "element accuracy, Finite Elements in Analysis and Design 1 (1985) 3-20, tables 1 and "
    "2. Nodes as in MOOSE's `PatchMeshGenerator`; the stresses follow from Hooke's law.",
}
ELASTIC = {"young": 1e6, "poisson": 0.25}
# Corners, then the nodes inside.
PLANE = [(0, 0), (0.24, 0), (0.24, 0.12), (0, 0.12), (0.04, 0.02), (0.18, 0.03), (0.16, 0.08), (0.08, 0.08)]
QUADRILATERALS = [(0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7), (4, 5, 6, 7)]
SPACE = [
    *[(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)],
    *[(0.249, 0.342, 0.192), (0.826, 0.288, 0.288), (0.850, 0.649, 0.263), (0.273, 0.750, 0.230)],
    *[(0.320, 0.186, 0.643), (0.677, 0.305, 0.683), (0.788, 0.693, 0.644), (0.165, 0.745, 0.702)],
]
HEXAHEDRA = [
    *[(12, 13, 14, 15, 4, 5, 6, 7), (8, 9, 13, 12, 0, 1, 5, 4), (8, 12, 15, 11, 0, 4, 7, 3)],
    *[(9, 10, 14, 13, 1, 2, 6, 5), (10, 11, 15, 14, 2, 3, 7, 6), (8, 11, 10, 9, 0, 3, 2, 1)],
    (8, 9, 10, 11, 12, 13, 14, 15),
]
PLANE_MOTION = ["1e-8 * t * (X + Y/2)", "1e-8 * t * (Y + X/2)"]
SPACE_MOTION = [f"1e-8 * t * (X + Y + Z + {axis})/2" for axis in "XYZ"]


def rows(pliant, quick):
    halves = [half for a, b, c, d in QUADRILATERALS for half in ((a, b, c), (a, c, d))]
    patches = {
        "4-node quadrilaterals": (PLANE, {"quadrilaterals": QUADRILATERALS}, {}),
        "3-node triangles": (PLANE, {"triangles": halves}, {}),
        "6-node triangles": (PLANE, {"triangles": halves}, {"order": 2}),
        "8-node hexahedra": (SPACE, {"hexahedra": HEXAHEDRA}, {}),
        "4-node tetrahedra": (SPACE, {"tetrahedra": tetrahedra()}, {}),
        "10-node tetrahedra": (SPACE, {"tetrahedra": tetrahedra()}, {"order": 2}),
    }
    for mesh, (points, cells, options) in patches.items():
        plane = points is PLANE
        body = {
            "mesh": {"inline": {"points": points, **cells}},
            "elastic": {"linear": ELASTIC | ({"plane": "stress"} if plane else {})},
            "mass": {"density": 1.0},
            "pin": held(points, PLANE_MOTION if plane else SPACE_MOTION, options.get("order", 1)),
            **options,
        }
        at = [0.11, 0.05] if plane else [0.5, 0.5, 0.45]
        scene = {"dimension": 2 if plane else 3, "time": STATIC, "body": [body]}
        found = pliant.last(scene | {"probe": [{"name": "p", "at": at}]})
        direct, shear = (1333.0 + 1 / 3, 400.0) if plane else (2000.0, 400.0)
        yield Row("direct stress sxx", "Pa", "MH", direct, found["p.sxx"] * 1e5, mesh, 1e-6)
        yield Row("shear stress sxy", "Pa", "MH", shear, found["p.sxy"] * 1e5, mesh, 1e-6)


def held(points, motion, order):
    """The boundary, with nodes in the middle of its edges; each node by one side alone."""
    if order == 1:
        return [{"vertices": list(range(4 if points is PLANE else 8)), "motion": {"displacement": motion}}]
    sides, low, high = [], [-1.0] * len(points[0]), [2.0] * len(points[0])
    for axis in range(len(points[0])):
        ends = min(p[axis] for p in points), max(p[axis] for p in points)
        for end in ends:
            box = {"min": [*low], "max": [*high]}
            box["min"][axis], box["max"][axis] = end - 1e-6, end + 1e-6
            sides.append({"box": box, "motion": {"displacement": motion}})
        low[axis], high[axis] = ends[0] + 1e-3, ends[1] - 1e-3
    return sides


def volume(cell):
    """Six times the volume of a tetrahedron."""
    a, b, c = ([SPACE[vertex][k] - SPACE[cell[0]][k] for k in range(3)] for vertex in cell[1:])
    return sum(a[i] * (b[i - 2] * c[i - 1] - b[i - 1] * c[i - 2]) for i in range(3))


def tetrahedra():
    """Hexahedra cut into six along their first diagonal; neighbours share the diagonals of their faces."""
    found = []
    for cell in HEXAHEDRA:
        # By the vertex of the smallest number, so that neighbours agree: a pyramid over each face without it.
        apex = min(cell)
        for face in [(0, 1, 2, 3), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)]:
            corners = [cell[i] for i in face]
            if apex in corners:
                continue
            first = corners.index(min(corners))
            a, b, c, d = corners[first:] + corners[:first]
            for tet in ([a, b, c, apex], [a, c, d, apex]):
                found.append(tet if volume(tet) > 0 else [tet[1], tet[0], *tet[2:]])
    return found
