"""Writes the mesh files of tests/data/meshes with meshio, and the twisted bar of scenes/meshes.

They are the same small bodies in every format.

Usage: write_meshes.py FOLDER

Needs meshio and numpy. Formats and variants that meshio does not write are
written by pyvista (appended arrays, polygonal data, METADATA) and by gmsh (binary `.msh`), where these are
installed.
"""

import os
import sys

import meshio
import numpy as np

# Two tetrahedra on a common triangle, with the triangles that are their base.
POINTS = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0.1, 0.2, 0.7], [1, 1, 1.25]], float)
TETRAHEDRA = np.array([[0, 1, 2, 3], [1, 2, 3, 4]])
BASE = np.array([[0, 2, 1], [0, 1, 3]])
# The same tetrahedra with nodes in the middle of their edges, in the order of VTK.
EDGES = [[0, 1], [1, 2], [0, 2], [0, 3], [1, 3], [2, 3]]


def solid(references=None):
    data = {references: [np.array([7, 8]), np.array([3, 3])]} if references else {}
    return meshio.Mesh(POINTS, [("tetra", TETRAHEDRA), ("triangle", BASE)], cell_data=data)


def surface(points=POINTS):
    return meshio.Mesh(points[:4], [("triangle", np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]]))])


def quadratic():
    points, middles, cells = list(POINTS), {}, []
    for cell in TETRAHEDRA:
        nodes = list(cell)
        for a, b in EDGES:
            key = tuple(sorted((int(cell[a]), int(cell[b]))))
            if key not in middles:
                middles[key] = len(points)
                points.append((POINTS[key[0]] + POINTS[key[1]]) / 2)
            nodes.append(middles[key])
        cells.append(nodes)
    return meshio.Mesh(np.array(points), [("tetra10", np.array(cells))])


def plane():
    points = np.array(
        [[0, 0], [1, 0], [1, 1], [0, 1], [0.5, 0], [1, 0.5], [0.5, 0.5], [0.5, 1], [0, 0.5]], float
    )
    flat = np.column_stack([points, np.zeros(len(points))])
    return meshio.Mesh(flat, [("triangle6", np.array([[0, 1, 2, 4, 5, 6], [0, 2, 3, 6, 7, 8]]))])


# Two hexahedra on a common side, one bent, with the side that is their end; two quadrilaterals in the plane.
CORNERS = np.array([[x, y, z] for x in (0, 1, 2) for y in (0, 1) for z in (0, 1)], float)
CORNERS[11] = [2.2, 1.3, 1.1]
HEXAHEDRA = np.array([[4 * i + c for c in (0, 4, 6, 2, 1, 5, 7, 3)] for i in (0, 1)])
END = np.array([[0, 1, 3, 2]])
QUADS = np.array([[0, 4, 6, 2], [4, 8, 10, 6]])


def hexahedra():
    return meshio.Mesh(CORNERS, [("hexahedron", HEXAHEDRA), ("quad", END)])


def quads():
    return meshio.Mesh(CORNERS * [1, 1, 0], [("quad", QUADS)])


def gmsh_cells(gmsh):
    """The hexahedra and their end as Gmsh has them: an entity each, in named groups."""
    gmsh.initialize()
    gmsh.option.setNumber("General.Terminal", 0)
    gmsh.model.add("cells")
    for dimension, entity, name in [(2, 1, "end"), (3, 1, "first"), (3, 2, "second")]:
        gmsh.model.addDiscreteEntity(dimension, entity)
        group = gmsh.model.addPhysicalGroup(dimension, [entity])
        gmsh.model.setPhysicalName(dimension, group, name)
    gmsh.model.mesh.addNodes(3, 1, list(range(1, 13)), CORNERS.ravel())
    gmsh.model.mesh.addElementsByType(1, 5, [], HEXAHEDRA[0] + 1)
    gmsh.model.mesh.addElementsByType(2, 5, [], HEXAHEDRA[1] + 1)
    gmsh.model.mesh.addElementsByType(1, 3, [], (END + 1).ravel())


def twisted_bar():
    """A bar of 0.1 x 0.1 x 0.4 m along z, turned by a quarter from end to end: 10-node tetrahedra."""
    n, height = (2, 2, 8), 0.4
    nodes, cells = {}, []

    def node(p):
        return nodes.setdefault(tuple(p), len(nodes))

    for corner in np.ndindex(n):
        for path in [(0, 1, 2), (1, 2, 0), (2, 0, 1), (0, 2, 1), (1, 0, 2), (2, 1, 0)]:
            corners = [2 * np.array(corner)]
            for axis in path:
                corners.append(corners[-1] + 2 * np.eye(3, dtype=int)[axis])
            if path in [(0, 2, 1), (1, 0, 2), (2, 1, 0)]:
                corners[2:] = corners[:1:-1]
            cells.append(
                [node(c) for c in corners] + [node((corners[a] + corners[b]) // 2) for a, b in EDGES]
            )
    points = np.array(list(nodes)) / (2 * np.array(n)) * [0.1, 0.1, height] - [0.05, 0.05, 0]
    turn = np.pi / 2 * points[:, 2] / height
    x = np.cos(turn) * points[:, 0] - np.sin(turn) * points[:, 1]
    y = np.sin(turn) * points[:, 0] + np.cos(turn) * points[:, 1]
    return meshio.Mesh(np.column_stack([x, y, points[:, 2]]), [("tetra10", np.array(cells))])


def big_endian(little, big):
    """The same PLY file with its bytes the other way round: meshio writes the order of the machine only."""
    with open(little, "rb") as file:
        header, body = file.read().split(b"end_header\n")
    points = np.frombuffer(body[: 4 * 24], "<f8").astype(">f8")
    faces = np.frombuffer(body[4 * 24 :], [("n", "u1"), ("v", "<i4", 3)]).astype(
        [("n", "u1"), ("v", ">i4", 3)]
    )
    with open(big, "wb") as file:
        file.write(header.replace(b"little", b"big") + b"end_header\n" + points.tobytes() + faces.tobytes())


def gmsh_solid(gmsh, order=1):
    """The two tetrahedra and their base as Gmsh has them: an entity each, in named groups."""
    gmsh.initialize()
    gmsh.option.setNumber("General.Terminal", 0)
    gmsh.model.add("solid")
    for dimension, entity, name in [(2, 1, "base"), (3, 1, "soft"), (3, 2, "hard part")]:
        gmsh.model.addDiscreteEntity(dimension, entity)
        group = gmsh.model.addPhysicalGroup(dimension, [entity])
        gmsh.model.setPhysicalName(dimension, group, name)
    gmsh.model.mesh.addNodes(3, 1, [10, 20, 30, 40, 50], POINTS.ravel())
    tags = 10 * (TETRAHEDRA + 1)
    gmsh.model.mesh.addElementsByType(1, 4, [], tags[0])
    gmsh.model.mesh.addElementsByType(2, 4, [], tags[1])
    gmsh.model.mesh.addElementsByType(1, 2, [], (10 * (BASE + 1)).ravel())
    gmsh.model.mesh.setOrder(order)


def write_gmsh(gmsh, folder, name, version, binary):
    gmsh.option.setNumber("Mesh.MshFileVersion", version)
    gmsh.option.setNumber("Mesh.Binary", int(binary))
    gmsh.write(os.path.join(folder, name))


class Swapped:
    """Copies a binary file of Gmsh with the bytes of every number the other way round."""

    def __init__(self, data):
        self.data, self.at, self.out = data, 0, b""

    def numbers(self, kind, count=1):
        values = np.frombuffer(self.data, "<" + kind, count, self.at)
        self.at += values.nbytes
        self.out += values.astype(">" + kind).tobytes()
        return [int(v) for v in values] if kind[0] != "f" else None

    def upto(self, word):
        """Text up to the line that `word` is, and that line."""
        end = self.data.index(word + b"\n", self.at) + len(word) + 1
        self.out += self.data[self.at : end]
        self.at = end

    def line(self):
        end = self.data.index(b"\n", self.at) + 1
        line = self.data[self.at : end]
        self.out += line
        self.at = end
        return int(line)

    def finish(self):
        return self.out + self.data[self.at :]


NODES = {1: 2, 2: 3, 4: 4, 8: 3, 9: 6, 11: 10, 15: 1}


def swapped_22(data):
    file = Swapped(data)
    file.upto(b"2.2 1 8")
    file.numbers("i4")
    file.upto(b"$Nodes")
    for _ in range(file.line()):
        file.numbers("i4")
        file.numbers("f8", 3)
    file.upto(b"$Elements")
    left = file.line()
    while left > 0:
        kind, count, tags = file.numbers("i4", 3)
        file.numbers("i4", count * (1 + tags + NODES[kind]))
        left -= count
    return file.finish()


def swapped_41(data):
    file = Swapped(data)
    file.upto(b"4.1 1 8")
    file.numbers("i4")
    file.upto(b"$Entities")
    for dimension, count in enumerate(file.numbers("u8", 4)):
        for _ in range(count):
            file.numbers("i4")
            file.numbers("f8", 6 if dimension else 3)
            for _ in range(2 if dimension else 1):
                file.numbers("i4", *file.numbers("u8"))
    file.upto(b"$Nodes")
    for _ in range(file.numbers("u8", 4)[0]):
        _, _, parametric = file.numbers("i4", 3)
        assert not parametric
        (count,) = file.numbers("u8")
        file.numbers("u8", count)
        file.numbers("f8", 3 * count)
    file.upto(b"$Elements")
    for _ in range(file.numbers("u8", 4)[0]):
        _, _, kind = file.numbers("i4", 3)
        (count,) = file.numbers("u8")
        file.numbers("u8", count * (1 + NODES[kind]))
    return file.finish()


def binary_gmsh(folder):
    try:
        import gmsh
    except ImportError:
        print("without gmsh: the files that it writes stay as they are")
        return
    gmsh_solid(gmsh)
    for version, name, swapped in [(2.2, "22", swapped_22), (4.1, "41", swapped_41)]:
        write_gmsh(gmsh, folder, f"solid_{name}_little.msh", version, True)
        with open(os.path.join(folder, f"solid_{name}_little.msh"), "rb") as file:
            data = swapped(file.read())
        with open(os.path.join(folder, f"solid_{name}_big.msh"), "wb") as file:
            file.write(data)
    gmsh.finalize()
    gmsh_cells(gmsh)
    write_gmsh(gmsh, folder, "cells_41_binary.msh", 4.1, True)
    write_gmsh(gmsh, folder, "cells_22.msh", 2.2, False)
    gmsh.finalize()
    gmsh_solid(gmsh, order=2)
    write_gmsh(gmsh, folder, "quadratic_41_binary.msh", 4.1, True)
    write_gmsh(gmsh, folder, "quadratic_22_binary.msh", 2.2, True)
    gmsh.finalize()


def with_metadata(vtk, folder, grid):
    """What VTK adds where arrays have names for their components, or know their range."""
    points = grid.GetPoints().GetData()
    points.SetName("Points")
    for component, name in enumerate(["x", "", "z of it"]):
        points.SetComponentName(component, name)
    points.GetRange(-1)
    grid.GetPoints().GetData().GetInformation().Set(vtk.vtkDataArray.UNITS_LABEL(), "m")
    ids = vtk.vtkIdTypeArray()
    ids.SetName("ids")
    ids.InsertNextValue(7)
    ids.SetComponentName(0, "first")
    more = vtk.vtkDoubleArray()
    more.SetName("more")
    more.InsertNextValue(0.5)
    grid.GetFieldData().AddArray(ids)
    grid.GetFieldData().AddArray(more)
    for version, name in [(42, "42"), (51, "51")]:
        for binary in [False, True]:
            writer = vtk.vtkUnstructuredGridWriter()
            writer.SetFileVersion(version)
            writer.SetFileName(os.path.join(folder, f"metadata_{name}_{'binary' if binary else 'ascii'}.vtk"))
            writer.SetFileTypeToBinary() if binary else writer.SetFileTypeToASCII()
            writer.SetInputData(grid)
            writer.Write()


def main(folder):
    os.makedirs(folder, exist_ok=True)
    binary_gmsh(folder)

    def write(name, mesh, file_format, **options):
        mesh.write(os.path.join(folder, name), file_format=file_format, **options)

    for binary, kind in [(False, "ascii"), (True, "binary")]:
        meshio.vtk.write(os.path.join(folder, f"solid_51_{kind}.vtk"), solid(), "5.1", binary=binary)
        write(f"solid_42_{kind}.vtk", solid(), "vtk42", binary=binary)
        write(f"quadratic_{kind}.vtk", quadratic(), "vtk42", binary=binary)
        write(f"surface_{kind}.ply", surface(), "ply", binary=binary)
        write(f"surface_{kind}.stl", surface(), "stl", binary=binary)
    write("solid_ascii.vtu", solid(), "vtu", binary=False)
    write("solid_binary.vtu", solid(), "vtu", binary=True, compression=None)
    write("solid_zlib.vtu", solid(), "vtu", binary=True, compression="zlib")
    write("quadratic.vtu", quadratic(), "vtu", binary=True, compression="zlib")
    write("twisted_bar.vtu", twisted_bar(), "vtu", binary=True, compression="zlib")
    write("plane.vtu", plane(), "vtu", binary=False)
    write("quadratic.msh", quadratic(), "gmsh22", binary=False)
    write("plane.msh", plane(), "gmsh", binary=False)
    write("cells.vtu", hexahedra(), "vtu", binary=True, compression="zlib")
    write("cells.vtk", hexahedra(), "vtk42", binary=False)
    write("quads.vtu", quads(), "vtu", binary=False)
    write("solid.mesh", solid("medit:ref"), "medit")
    write("solid.node", meshio.Mesh(POINTS, [("tetra", TETRAHEDRA)]), "tetgen")
    os.replace(os.path.join(folder, "surface_binary.ply"), os.path.join(folder, "surface_little.ply"))
    big_endian(os.path.join(folder, "surface_little.ply"), os.path.join(folder, "surface_big.ply"))

    try:
        import pyvista
        import vtk
    except ImportError:
        print("without pyvista: the files that it writes stay as they are")
        return
    cells = np.hstack([np.insert(TETRAHEDRA, 0, 4, axis=1).ravel(), np.insert(BASE, 0, 3, axis=1).ravel()])
    grid = pyvista.UnstructuredGrid(cells, np.array([10, 10, 5, 5]), POINTS)
    for name, raw, compressor in [
        ("raw", True, None),
        ("base64", False, None),
        ("raw_zlib", True, vtk.vtkZLibDataCompressor()),
    ]:
        writer = vtk.vtkXMLUnstructuredGridWriter()
        writer.SetFileName(os.path.join(folder, f"solid_appended_{name}.vtu"))
        writer.SetDataModeToAppended()
        writer.SetEncodeAppendedData(not raw)
        writer.SetCompressor(compressor)
        writer.SetInputData(grid)
        writer.Write()
    faces = np.hstack(
        [np.insert(cell, 0, len(cell)) for cell in ([0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3])]
    )
    pyvista.PolyData(POINTS[:4], faces=faces).save(os.path.join(folder, "surface_polydata.vtk"), binary=True)
    with_metadata(vtk, folder, grid)


if __name__ == "__main__":
    main(sys.argv[1])
