"""The bars of the comparisons: their meshes, and the files that several programs read."""

from __future__ import annotations

from itertools import permutations
from pathlib import Path

import meshio
import numpy as np


def bar(cells: tuple[int, int, int], size: tuple[float, float, float], kind: str) -> meshio.Mesh:
    """A box from the origin along x, of six tetrahedra or one hexahedron (``kind``) for each cell."""
    axes = [np.linspace(0.0, length, count + 1) for count, length in zip(cells, size, strict=True)]
    grid = np.meshgrid(*axes, indexing="ij")
    points = np.stack([axis.ravel() for axis in grid], axis=1)
    strides = np.array([(cells[1] + 1) * (cells[2] + 1), cells[2] + 1, 1])
    corners = (
        np.stack(np.meshgrid(*(np.arange(n) for n in cells), indexing="ij"), axis=-1).reshape(-1, 3) @ strides
    )
    if kind == "hexahedron":
        ring = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]
        return meshio.Mesh(points, [(kind, corners[:, None] + np.array(ring) @ strides)])
    elements = []
    for order in permutations(range(3)):
        # From corner to corner of a cell along one axis after another.
        steps = [0, *np.cumsum(strides[list(order)])]
        even = np.linalg.det(np.eye(3)[list(order)]) > 0
        elements.append(corners[:, None] + np.array(steps if even else [*steps[:2], steps[3], steps[2]]))
    return meshio.Mesh(points, [("tetra", np.stack(elements, axis=1).reshape(-1, 4))])


def write(mesh: meshio.Mesh, path: Path) -> Path:
    """As a file: .vtu, or for .msh Gmsh's version 2.2."""
    if path.suffix == ".msh":
        # Tags, which nobody reads here: without them it warns.
        tags = [np.ones(len(block), dtype=int) for block in mesh.cells]
        mesh.cell_data = {"gmsh:physical": tags, "gmsh:geometrical": tags}
        meshio.write(path, mesh, file_format="gmsh22", binary=False)
    else:
        mesh.write(path)
    return path
