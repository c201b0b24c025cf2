"""Reads an export with other people's libraries: pip install numpy meshio pyvista.

Usage: read_vtu.py COLLECTION.pvd [MESH.obj ...]

Reads every frame with meshio and with PyVista, and compares the two. The exit code is not 0 if anything is
wrong.
"""

import os
import sys
import xml.etree.ElementTree

import meshio
import numpy as np
import pyvista


def check(condition, what):
    if not condition:
        raise SystemExit(f"{sys.argv[1]}: {what}")


def compare(path, time):
    grid, mesh = pyvista.read(path), meshio.read(path)
    check(grid.n_points == len(mesh.points) > 0, f"{path}: the numbers of points differ")
    check(
        grid.n_cells == sum(len(block.data) for block in mesh.cells) > 0,
        f"{path}: the numbers of cells differ",
    )
    check((np.asarray(grid.points) == mesh.points).all(), f"{path}: the points differ")
    check(
        mesh.points.dtype == np.float64 and mesh.points.shape[1] == 3,
        f"{path}: points are not doubles in space",
    )
    check(
        set(mesh.point_data) == {"displacement", "velocity"}, f"{path}: point data are {set(mesh.point_data)}"
    )
    for name, values in mesh.point_data.items():
        check(
            values.shape == mesh.points.shape and np.isfinite(values).all(), f"{path}: {name} is not finite"
        )
        check((np.asarray(grid.point_data[name]) == values).all(), f"{path}: {name} reads two ways")
    check("body" in mesh.cell_data, f"{path}: cells have no body")
    for name, blocks in mesh.cell_data.items():
        # meshio makes blocks of the cells, in their order, and may keep an axis of length one.
        values = np.concatenate([np.asarray(block, dtype=float).reshape(len(block), -1) for block in blocks])
        other = np.asarray(grid.cell_data[name], dtype=float).reshape(grid.n_cells, -1)
        check(np.array_equal(other, values, equal_nan=True), f"{path}: {name} reads two ways")
    check(float(grid.field_data["TimeValue"][0]) == time, f"{path}: the time is not that of the collection")
    rest = mesh.points - mesh.point_data["displacement"]
    return rest, {block.type: block.data for block in mesh.cells}


def main():
    collection, surfaces = sys.argv[1], sys.argv[2:]
    folder = os.path.dirname(collection)
    entries = xml.etree.ElementTree.parse(collection).getroot().findall("Collection/DataSet")
    check(entries, "the collection is empty")
    frames = [compare(os.path.join(folder, e.get("file")), float(e.get("timestep"))) for e in entries]
    times = [float(entry.get("timestep")) for entry in entries]
    check(times == sorted(set(times)), "times do not ascend")
    first_rest, first_cells = frames[0]
    for rest, cells in frames:
        # The displacement is rounded: x - (x - X) is X but for an ulp of x.
        check(
            np.allclose(rest, first_rest, rtol=0, atol=1e-12 * np.abs(first_rest).max()),
            "the rest shape changes",
        )
        check(all((cells[kind] == first_cells[kind]).all() for kind in first_cells), "the cells change")
    for path in surfaces:
        mesh = meshio.read(path)
        check(len(mesh.points) > 0 and "triangle" in mesh.cells_dict, f"{path}: no surface")
        check(
            pyvista.read(path).n_cells == len(mesh.cells_dict["triangle"]),
            f"{path}: the numbers of faces differ",
        )
    print(
        f"{len(frames)} frames, {len(first_rest)} points, "
        f"{', '.join(f'{len(c)} {k}' for k, c in first_cells.items())}"
    )


if __name__ == "__main__":
    main()
