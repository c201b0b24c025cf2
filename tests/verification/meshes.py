"""Meshes of mapped blocks, with curved sides: triangles and tetrahedra of second order, quadrilaterals and
hexahedra, as Gmsh files (2.2).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import permutations, product

Point = tuple[float, ...]
Map = Callable[..., Point]

# Corners of a cell, counter-clockwise.
SQUARE = [(0, 0), (1, 0), (1, 1), (0, 1)]
CUBE = [(*corner, 0) for corner in SQUARE] + [(*corner, 1) for corner in SQUARE]
# Nodes in the middle of edges, in Gmsh's order.
TRIANGLE_EDGES = [(0, 1), (1, 2), (2, 0)]
TETRAHEDRON_EDGES = [(0, 1), (1, 2), (2, 0), (3, 0), (2, 3), (1, 3)]
GMSH = {(2, "simplex"): 9, (3, "simplex"): 11, (2, "cell"): 3, (3, "cell"): 5}


def blocks(parts: Sequence[tuple[Map, Sequence[int]]], element: str = "simplex") -> str:
    """A mesh of blocks that share the vertices where they meet.

    A part is a map of the unit square or cube to space, which must not mirror, and its numbers of cells;
    ``element`` is ``simplex`` (triangles or tetrahedra of second order, whose middle nodes are mapped too) or
    ``cell`` (quadrilaterals or hexahedra).
    """
    points, cells = built(parts, element)
    kind = GMSH[len(parts[0][1]), element]
    lines = ["$MeshFormat", "2.2 0 8", "$EndMeshFormat", "$Nodes", str(len(points))]
    for number, point in enumerate(points, 1):
        x, y, z = (*point, 0.0)[:3]
        lines.append(f"{number} {x!r} {y!r} {z!r}")
    lines += ["$EndNodes", "$Elements", str(len(cells))]
    for number, cell in enumerate(cells, 1):
        lines.append(f"{number} {kind} 0 " + " ".join(str(vertex + 1) for vertex in cell))
    return "\n".join([*lines, "$EndElements", ""])


def described(count: Sequence[int], element: str) -> str:
    """Elements in space and their numbers, for a row."""
    size = " x ".join(map(str, count))
    return f"10-node tetrahedra, {size} boxes" if element == "simplex" else f"hexahedra, {size}"


def vertices(parts: Sequence[tuple[Map, Sequence[int]]], chosen: Callable[..., bool]) -> list[int]:
    """Numbers of the vertices at chosen places, in the mesh of second order."""
    return [number for number, point in enumerate(built(parts, "simplex")[0]) if chosen(*point)]


def built(parts: Sequence[tuple[Map, Sequence[int]]], element: str) -> tuple[list[Point], list[list[int]]]:
    """Points and cells."""
    numbers: dict[Point, int] = {}
    points: list[Point] = []
    cells: list[list[int]] = []

    def node(place: Map, at: Sequence[float]) -> int:
        point = place(*at)
        # Blocks meet where their maps agree to rounding.
        key = tuple(round(x, 9) + 0.0 for x in point)
        if key not in numbers:
            numbers[key] = len(points)
            points.append(point)
        return numbers[key]

    dimension = len(parts[0][1])
    edges = TRIANGLE_EDGES if dimension == 2 else TETRAHEDRON_EDGES
    shapes = simplices(dimension) if element == "simplex" else [SQUARE if dimension == 2 else CUBE]
    for place, counts in parts:
        for cell in product(*(range(count) for count in counts)):
            for shape in shapes:
                ats = [[(c + o) / n for c, o, n in zip(cell, corner, counts)] for corner in shape]
                if element == "simplex":
                    ats += [[(a + b) / 2 for a, b in zip(ats[i], ats[j])] for i, j in edges]
                cells.append([node(place, at) for at in ats])
    return points, cells


def simplices(dimension: int) -> list[list[tuple[int, ...]]]:
    """A square as two triangles, a cube as six tetrahedra, all along the diagonal from 0 to 1."""
    found = []
    for order in permutations(range(dimension)):
        corners = [
            tuple(int(axis in order[:step]) for axis in range(dimension)) for step in range(dimension + 1)
        ]
        odd = sum(a > b for i, a in enumerate(order) for b in order[i + 1 :]) % 2
        if odd:
            corners[-1], corners[-2] = corners[-2], corners[-1]
        found.append(corners)
    return found
