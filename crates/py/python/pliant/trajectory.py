"""Recordings of `Simulation.run` and ``pliant run``."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from os import PathLike, fspath
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, overload

import numpy as np
import numpy.typing as npt

from ._command import run_command
from ._pliant import Recording, Scene, _recover
from .tables import axes_or_new
from .view import View

if TYPE_CHECKING:
    import meshio as _meshio  # type: ignore[import-untyped]
    import pandas as _pandas
    import pyvista as _pyvista
    from matplotlib.axes import Axes as _Axes

Array = npt.NDArray[np.float64]

#: Number of vertices of each kind of cell in attachments, and its names in meshio and VTK.
_CELLS = {
    "vertex": (1, "vertex", 1),
    "edge": (2, "line", 3),
    "tri": (3, "triangle", 5),
    "tet": (4, "tetra", 10),
    "tri6": (6, "triangle6", 22),
    "tet10": (10, "tetra10", 24),
    "quad": (4, "quad", 9),
    "hex": (8, "hexahedron", 12),
}


#: Energies of the bodies, in the order in which they are drawn.
_ENERGIES = ("total", "kinetic", "elastic", "gravitational", "loads", "contact", "other")


@dataclass(frozen=True)
class _Block:
    """Cells of one body."""

    number: int
    body: str
    kind: str
    cells: npt.NDArray[np.uint32]

    def data(self, values: Array, rows: tuple[int, int] | None) -> Array:
        """Return the rows of the body, from first row and count; NaN for cells that are not elements."""
        width = values.shape[1]
        if rows is not None and rows[1] == len(self.cells):
            own = values[rows[0] : rows[0] + rows[1]]
        else:
            own = np.full((len(self.cells), width), np.nan)
        return own[:, 0] if width == 1 else own


@dataclass(frozen=True)
class _Mesh:
    """Frame as written by `export`, in 3D; data of cells block by block."""

    time: float
    points: Array
    point_data: dict[str, Array]
    blocks: list[_Block]
    cell_data: dict[str, list[npt.NDArray[Any]]]


class Frames:
    """Lazy array of the rows of all frames, which are read on access.

    An index returns one frame, of shape (rows, columns), a slice or a list of indices several, of shape
    (frames, rows, columns). ``numpy.asarray`` and ``[:]`` read all.

    Attributes
    ----------
    shape : tuple of int
        Numbers of frames, rows, columns.
    dtype : numpy.dtype
        Data type, float64.
    ndim : int
        Number of axes, 3.
    """

    def __init__(self, recording: Recording, name: str, shape: tuple[int, int, int]) -> None:
        self._recording, self._name = recording, name
        self.shape = shape
        self.dtype = np.dtype(np.float64)
        self.ndim = 3

    def __len__(self) -> int:
        return self.shape[0]

    def _frame(self, index: int) -> Array:
        if self._name in ("positions", "velocities"):
            read = self._recording.positions if self._name == "positions" else self._recording.velocities
            return read(index)
        return self._recording.elements(self._name, index)

    @overload
    def __getitem__(self, index: int) -> Array: ...
    @overload
    def __getitem__(
        self, index: slice | list[int] | npt.NDArray[np.integer[Any]] | tuple[Any, ...]
    ) -> Array: ...

    def __getitem__(self, index: Any) -> Array:
        rest: tuple[Any, ...] = ()
        if isinstance(index, tuple):
            index, rest = index[0], index[1:]
        if isinstance(index, slice):
            frames = range(*index.indices(len(self)))
        elif np.ndim(index) == 0:
            number = range(len(self))[int(index)]
            chosen: Array = self._frame(number)[rest]
            return chosen
        else:
            frames = range(len(self))
            frames = [frames[int(i)] for i in np.asarray(index)]  # type: ignore[assignment]
        out = np.empty((len(frames), *self.shape[1:]))
        for i, frame in enumerate(frames):
            out[i] = self._frame(frame)
        return out[(slice(None), *rest)]

    def __iter__(self) -> Iterator[Array]:
        return (self._frame(i) for i in range(len(self)))

    def __array__(self, dtype: npt.DTypeLike | None = None, copy: bool | None = None) -> npt.NDArray[Any]:
        if copy is False:
            raise ValueError("frames are read from a file: there is no array to share")
        return self[:] if dtype is None else self[:].astype(dtype)

    def __repr__(self) -> str:
        return f"<pliant.Frames {self._name} of shape {self.shape}>"


class Trajectory:
    """Frames of a recording, read on access.

    Parameters
    ----------
    path : str or os.PathLike
        File, as for `load`.

    Attributes
    ----------
    dimension : int
        Space dimension, 2 or 3.
    vertex_count : int
        Number of vertices.
    times : ndarray of float64, shape (F,)
        Simulated time of each frame [s].
    """

    def __init__(self, path: str | PathLike[str]) -> None:
        self._recording = Recording(path)
        self._info: dict[str, Any] | None = None
        self.path = path
        self.dimension: int = self._recording.dimension
        self.vertex_count: int = self._recording.vertex_count
        self.times: Array = self._recording.times

    def __len__(self) -> int:
        return len(self.times)

    def __repr__(self) -> str:
        size = f"{len(self)} frames of {self.vertex_count} vertices in {self.dimension}D"
        return f"<pliant.Trajectory {str(self.path)}: {size}>"

    def __reduce__(self) -> tuple[type[Trajectory], tuple[str | PathLike[str]]]:
        return (Trajectory, (self.path,))

    @property
    def positions(self) -> Frames:
        """Frames, shape (F, n, dim): Positions [m].

        The order is: all bodies, then obstacles; `topology` has the vertex numbers of each.
        """
        return Frames(self._recording, "positions", (len(self), self.vertex_count, self.dimension))

    @property
    def velocities(self) -> Frames:
        """Frames, shape (F, n, dim): Velocities [m/s]."""
        return Frames(self._recording, "velocities", (len(self), self.vertex_count, self.dimension))

    def measure(self, name: str) -> Frames:
        """Return a measure of every finite element, or of every vertex.

        Parameters
        ----------
        name : str
            Channel of the recording: ``"von-mises"``, ``"green-strain"``, ...; ``"nodal-von-mises"``,
            ``"nodal-stress"`` for vertices.

        Returns
        -------
        Frames, shape (F, m, k)
            The k components of the measure of m elements or vertices; NaN at vertices without elements.

        Raises
        ------
        KeyError
            The recording has no such channel.

        Examples
        --------
        >>> trajectory.measure("jacobian")[0].shape
        (8, 1)
        """
        rows, columns = self._recording.elements(name, 0).shape
        return Frames(self._recording, name, (len(self), rows, columns))

    @property
    def energy(self) -> dict[str, Array]:
        """dict of str to ndarray of float64, shape (F,): Energies [J], momenta and work, by name.

        They come from the channel ``energy``.

        Examples
        --------
        >>> trajectory.energy["kinetic"].shape
        (7,)
        """
        return self._recording.energy()

    @property
    def reactions(self) -> dict[str, Array]:
        """dict of str to ndarray of float64, shape (F,): Forces [N] and moments [N m] of pins, by name.

        They are NaN after the release of a pin.

        Examples
        --------
        >>> trajectory.reactions["beam/left.force[1]"].shape
        (7,)
        """
        return self._recording.reactions()

    def contacts(self, frame: int = -1) -> dict[str, Any]:
        """Return the active contact pairs of a frame.

        Parameters
        ----------
        frame : int
            Number of the frame; negative ones count from the end.

        Returns
        -------
        dict
            Data as in :meth:`Simulation.contacts`: ``"bodies"``, ``"points"`` [m], ``"normals"``, ``"gaps"``
            [m], ``"forces"`` and ``"friction"`` [N]; zero friction in recordings without it.

        Raises
        ------
        KeyError
            The recording does not have the channel ``contacts``.
        IndexError
            There is no such frame.

        Examples
        --------
        >>> trajectory.contacts()["bodies"]
        []
        """
        count = len(self)
        if not -count <= frame < count:
            raise IndexError(f"frame {frame} of {count}")
        return self._recording.contacts(frame % count)

    def probe(self, name: str) -> dict[str, Array]:
        """Return the readings of a probe over time.

        Parameters
        ----------
        name : str
            Name of the probe.

        Returns
        -------
        dict of str to ndarray of float64, shape (F,)
            Readings by name, as in ``/probe`` channels: ``time`` [s], ``position[0]`` [m],
            ``cauchy_stress[3]`` [Pa], ...

        Examples
        --------
        >>> trajectory.probe("tip")["position[1]"].shape
        (7,)
        """
        return self._recording.probe(name)

    @property
    def metadata(self) -> dict[str, Any]:
        """dict of str to object: Contents of the file and outcome of the run, as ``pliant info --json``."""
        if self._info is None:
            self._info = self._recording.info()
        return self._info

    @property
    def scene(self) -> Scene:
        """Scene: The simulated scene; its file names are relative to the working directory."""
        text = self._recording.attachment("scene.toml")
        if text is None:
            raise KeyError(f"{self.path} does not say what scene it is of")
        return Scene.from_toml(text.decode())

    @property
    def rest_positions(self) -> Array:
        """ndarray of float64, shape (n, dim): Rest positions [m]."""
        return np.frombuffer(self._attachment("rest.f64"), "<f8").reshape(-1, self.dimension).copy()

    @property
    def masses(self) -> Array:
        """ndarray of float64, shape (n,): Lumped mass of every vertex [kg]."""
        return np.frombuffer(self._attachment("mass.f64"), "<f8").copy()

    def _attachment(self, name: str) -> bytes:
        content = self._recording.attachment(name)
        if content is None:
            raise KeyError(f"{self.path} has no attachment {name}")
        return content

    @property
    def topology(self) -> dict[str, dict[str, npt.NDArray[np.uint32]]]:
        """dict of str to dict: Cells of each body by name, as rows of vertex numbers.

        Kinds of cells are ``edge``, ``tri``, ``tet``, ``tri6``, ``tet10``, ``quad``, ``hex``, and
        ``surface``, the triangles of a solid's skin.
        """
        topology: dict[str, dict[str, npt.NDArray[np.uint32]]] = {}
        for body in self.metadata["bodies"]:
            cells = {}
            for kind, width in [*((kind, width) for kind, (width, _, _) in _CELLS.items()), ("surface", 3)]:
                content = self._recording.attachment(f"topology/{body['name']}.{kind}.u32")
                if content is not None:
                    cells[kind] = np.frombuffer(content, "<u4").reshape(-1, width).copy()
            topology[body["name"]] = cells
        return topology

    def _blocks(self) -> list[_Block]:
        """Return the cells of all bodies as written by `export`.

        They are finite elements and triangles, else springs, else the vertices themselves.
        """
        blocks = []
        for number, (body, cells) in enumerate(
            zip(self.metadata["bodies"], self.topology.values(), strict=True)
        ):
            kind = next(
                (kind for kind in ("tet10", "tet", "hex", "tri6", "tri", "quad", "edge") if kind in cells),
                "vertex",
            )
            first = body["first_vertex"]
            vertices = np.arange(first, first + body["vertices"], dtype=np.uint32)[:, None]
            blocks.append(_Block(number, body["name"], kind, cells.get(kind, vertices)))
        return blocks

    def _measures(self, of: Literal["elements", "vertices"]) -> list[str]:
        """Return the recorded measures of elements or vertices."""
        topics, prefix = (topic["topic"] for topic in self.metadata["topics"]), f"/{of}/"
        return [topic.removeprefix(prefix) for topic in topics if topic.startswith(prefix)]

    def _mesh(self, frame: int) -> _Mesh:
        """Return the data of a frame that `export` writes, in 3D."""

        def in_space(rows: Array) -> Array:
            padded = np.zeros((len(rows), 3))
            padded[:, : self.dimension] = rows
            return padded

        frame = range(len(self))[frame]
        points = in_space(self.positions[frame])
        point_data = {"velocity": in_space(self.velocities[frame])}
        if self._recording.attachment("rest.f64") is not None:
            point_data["displacement"] = points - in_space(self.rest_positions)
        for name in self._measures("vertices"):
            values = self._recording.elements(name, frame)
            point_data[name] = values[:, 0] if values.shape[1] == 1 else values
            if name == "nodal-stress":
                for k, principal in enumerate(self._recording.principal_stresses(frame).T, start=1):
                    point_data[f"principal-{k}"] = np.ascontiguousarray(principal)
        blocks = self._blocks()
        cell_data: dict[str, list[npt.NDArray[Any]]] = {
            "body": [np.full(len(block.cells), block.number, np.int32) for block in blocks]
        }
        for name in self._measures("elements"):
            values = self._recording.elements(name, frame)
            rows = {body: (first, count) for body, first, count in self._recording.element_bodies(name)}
            cell_data[name] = [block.data(values, rows.get(block.body)) for block in blocks]
        return _Mesh(float(self.times[frame]), points, point_data, blocks, cell_data)

    def to_meshio(self, frame: int = -1) -> _meshio.Mesh:
        """Convert a frame to a mesh of meshio, which must be installed.

        Parameters
        ----------
        frame : int, default -1
            Number of the frame.

        Returns
        -------
        meshio.Mesh
            Mesh with point data ``velocity`` [m/s], ``displacement`` [m] and all recorded measures of
            vertices (with ``nodal-stress`` also ``principal-1`` to ``principal-3``), and cell data, the
            number of the ``body`` and all recorded measures of elements; NaN for points and cells without
            elements. In 2D, z is 0.

        Examples
        --------
        >>> len(trajectory.to_meshio(frame=0).points)
        10
        """
        import meshio

        mesh = self._mesh(frame)
        cells = [(_CELLS[block.kind][1], block.cells.astype(np.int64)) for block in mesh.blocks]
        return meshio.Mesh(mesh.points, cells, point_data=mesh.point_data, cell_data=mesh.cell_data)

    def to_pyvista(self, frame: int = -1) -> _pyvista.UnstructuredGrid:
        """Convert a frame to a grid of PyVista, which must be installed.

        Parameters
        ----------
        frame : int, default -1
            Number of the frame.

        Returns
        -------
        pyvista.UnstructuredGrid
            Grid with the data of `to_meshio`, and the time [s] as ``field_data["TimeValue"]``.

        Examples
        --------
        >>> trajectory.to_pyvista(frame=0).n_points
        10
        """
        import pyvista

        mesh = self._mesh(frame)
        cells = [block.cells for block in mesh.blocks]
        counted = [np.insert(cells, 0, cells.shape[1], axis=1).ravel().astype(np.int64) for cells in cells]
        types = [np.full(len(block.cells), _CELLS[block.kind][2], np.uint8) for block in mesh.blocks]
        grid = pyvista.UnstructuredGrid(np.concatenate(counted), np.concatenate(types), mesh.points)
        for name, values in mesh.point_data.items():
            grid.point_data[name] = values
        for name, parts in mesh.cell_data.items():
            grid.cell_data[name] = np.concatenate(parts)
        grid.field_data["TimeValue"] = [mesh.time]
        return grid

    def view(self, *, max_bytes: int = 2_000_000, height: int = 480) -> View:
        """Return a page that plays the recording, for notebooks and files, as ``pliant view``.

        Parameters
        ----------
        max_bytes : int, default 2000000
            Bytes of data in the page before encoding. If data do not fit, frames are omitted first, evenly;
            the page says so.
        height : int, default 480
            Height in a notebook [pixel].

        Returns
        -------
        View
            View that a notebook shows as the last expression of a cell; elsewhere use ``.save("run.html")``
            or ``.open()``.

        Raises
        ------
        ValueError
            A number is below 1.

        Examples
        --------
        >>> page = trajectory.view()
        """
        return View(self.path, max_bytes, height)

    def plot(self, quantity: str = "energy", *, axes: _Axes | None = None) -> _Axes:
        """Plot energies, reactions or a probe over time, with matplotlib.

        Parameters
        ----------
        quantity : str, default "energy"
            ``"energy"`` for the energies of the bodies, ``"reactions"`` for forces of pins and walls, another
            name of `energy`, or the name of a probe for its position.
        axes : matplotlib.axes.Axes, optional
            Axes to draw into; default: new ones.

        Returns
        -------
        matplotlib.axes.Axes
            The axes.

        Raises
        ------
        ValueError
            The recording has no such quantity.

        Examples
        --------
        >>> axes = trajectory.plot("reactions")
        >>> axes.get_xlabel()
        'time [s]'
        """
        times, columns, label = self._columns(quantity)
        drawn = axes_or_new(axes)
        for name, values in columns.items():
            drawn.plot(times, values, label=name)
        drawn.set_xlabel("time [s]")
        drawn.set_ylabel(label)
        drawn.legend()
        return drawn

    def render(
        self,
        to: str | PathLike[str],
        *,
        at: float | None = None,
        frames: int | None = None,
        fps: int | None = None,
        speed: float = 1.0,
        size: tuple[int, int] | None = None,
        colour_by: str = "body",
        value_range: tuple[float, float] | None = None,
        camera: tuple[float, float] | None = None,
        theme: str = "light",
        transparent: bool = False,
        bare: bool = False,
        overwrite: bool = False,
    ) -> Path:
        """Draw a still, frames side by side or an animation, as ``pliant render``.

        Parameters
        ----------
        to : str or os.PathLike
            File to write: ``.png``, ``.gif`` or ``.svg``.
        at : float, optional
            Draw only the frame nearest to this time [s]; default: the last one for ``.png`` and ``.svg``,
            else an animation.
        frames : int, optional
            Number of evenly spaced frames: side by side in a ``.png``, one after the other in an animation.
        fps : int, optional
            Frames per second of an animation.
        speed : float, default 1
            Speed of an animation relative to real time.
        size : (int, int), optional
            Width and height of a frame [pixel].
        colour_by : str, default "body"
            ``"body"``, ``"speed"``, ``"displacement"`` or a recorded measure.
        value_range : (float, float), optional
            Limits of the colour scale; default: smallest and largest value.
        camera : (float, float), optional
            Angle from the front towards +x and angle above the horizon [degree].
        theme : {"light", "dark"}
            Colours of the background.
        transparent : bool, default False
            True for a transparent background.
        bare : bool, default False
            True to omit title, time and colour scale.
        overwrite : bool, default False
            True to replace an existing picture.

        Returns
        -------
        pathlib.Path
            The file.

        Raises
        ------
        FileExistsError
            The file exists.
        ValueError
            A number or a name is not valid; the message says what is.

        Examples
        --------
        >>> trajectory.render("beam.png", colour_by="speed").name
        'beam.png'
        """
        path = Path(to)
        if path.exists() and not overwrite:
            raise FileExistsError(f"{path} is there; `overwrite=True` replaces it")
        given: dict[str, object] = {
            "--at": at,
            "--frames": frames,
            "--fps": fps,
            "--speed": speed,
            "--size": size and "x".join(map(str, size)),
            "--colour-by": colour_by,
            "--range": value_range and ",".join(map(repr, value_range)),
            "--camera": camera and ",".join(map(repr, camera)),
            "--theme": theme,
        }
        options = [f"{name}={value}" for name, value in given.items() if value is not None]
        flags = {"--transparent": transparent, "--bare": bare, "--force": overwrite}
        options += [name for name, is_on in flags.items() if is_on]
        run_command("render", fspath(self.path), f"--output={path}", *options)
        return path

    def _columns(self, quantity: str) -> tuple[Array, dict[str, Array], str]:
        """Return times, series by name and the label of their axis."""
        topics = {topic["topic"] for topic in self.metadata["topics"]}
        if quantity == "energy" and "/energy" in topics:
            found, names, label = (
                self.energy,
                [name for name in _ENERGIES if name in self.energy],
                "energy [J]",
            )
        elif quantity == "reactions" and "/reactions" in topics:
            found, label = self.reactions, "force [N]"
            names = [name for name in found if ".force[" in name]
        elif f"/probe/{quantity}" in topics:
            found, label = self.probe(quantity), "position [m]"
            names = [name for name in found if name.startswith("position[")]
        else:
            found, label = (self.energy if "/energy" in topics else {}), quantity
            names = [name for name in found if name.split("[")[0] == quantity]
        if not names:
            known = {"energy", "reactions"} & {topic[1:] for topic in topics}
            known |= {topic[len("/probe/") :] for topic in topics if topic.startswith("/probe/")}
            raise ValueError(
                f"the recording has no `{quantity}` to draw; it has {', '.join(sorted(known)) or 'nothing'}"
            )
        return found["time"], {name: found[name] for name in names}, label

    def _repr_mimebundle_(self, include: Any = None, exclude: Any = None) -> dict[str, str]:
        return self.view()._repr_mimebundle_()

    def export(
        self, to: str | PathLike[str], frames: int | slice = slice(None), *, overwrite: bool = False
    ) -> list[Path]:
        """Write frames for other programs, as ``pliant export``.

        ParaView, PyVista and meshio read ``.vtu``, Blender ``.glb``, NumPy ``.npz``.

        Parameters
        ----------
        to : str or os.PathLike
            Folder or file: ``.pvd`` for a series of ``.vtu`` next to it, ``.vtu`` or ``.obj`` for a single
            frame, ``.html`` for a page that plays it, ``.glb`` for an animation, ``.npz`` for arrays,
            ``.csv`` for energies, reactions, probes and extremes of measures.
        frames : int or slice, default all
            Frames to write.
        overwrite : bool, default False
            True to replace existing files.

        Returns
        -------
        list of pathlib.Path
            Files of the frames, with the ``.pvd`` last.

        Raises
        ------
        FileExistsError
            A file exists.
        IndexError
            There is no such frame.
        ValueError
            No frame is chosen, or the ending is not supported.

        Examples
        --------
        >>> [path.name for path in trajectory.export("beam.npz")]
        ['beam.npz']
        """
        if isinstance(frames, slice):
            start, end, step = frames.indices(len(self))
        else:
            start = range(len(self))[frames]
            end, step = start + 1, 1
        if step < 1 or end <= start:
            raise ValueError(f"{frames} chooses none of {len(self)} frames, forwards")
        return self._recording.export(to, (start, end, step), overwrite)

    def to_pandas(self) -> _pandas.DataFrame:
        """Convert the channel ``energy`` to a table of pandas, which must be installed.

        Returns
        -------
        pandas.DataFrame
            One row per frame, indexed by time [s].

        Examples
        --------
        >>> len(trajectory.to_pandas())
        7
        """
        import pandas

        return pandas.DataFrame(self.energy).set_index("time")


def load(path: str | PathLike[str]) -> Trajectory:
    """Open a recording.

    Parameters
    ----------
    path : str or os.PathLike
        Complete ``.mcap`` file of `Simulation.run` or ``pliant run``.

    Returns
    -------
    Trajectory
        Frames of the recording, read on access.

    Raises
    ------
    FileNotFoundError, OSError
        The file does not exist, or cannot be read.
    ValueError
        The file is not a recording, damaged, or unfinished (``pliant recover`` repairs it).

    Examples
    --------
    >>> trajectory = load("beam.mcap")
    >>> trajectory.positions[-1].shape, trajectory.energy["total"].shape
    ((10, 2), (7,))
    """
    return Trajectory(path)


def recover(
    part: str | PathLike[str], to: str | PathLike[str] | None = None, *, overwrite: bool = False
) -> Trajectory:
    """Make the recording of a killed run readable, as ``pliant recover``.

    Parameters
    ----------
    part : str or os.PathLike
        Partial recording, ending in ``.part``.
    to : str or os.PathLike, optional
        File to write; default: the name without ``.part``.
    overwrite : bool, default False
        True to replace an existing file.

    Returns
    -------
    Trajectory
        Recording with all complete frames.

    Raises
    ------
    FileExistsError
        The file exists, or the run is not finished.
    FileNotFoundError, OSError, ValueError
        There is no such file, or it cannot be read.

    Examples
    --------
    >>> recover("killed.mcap.part", "whole.mcap").positions.shape
    (7, 10, 2)
    """
    if to is None:
        if not fspath(part).endswith(".part"):
            raise ValueError(f"{fspath(part)} does not end in .part: say where to write")
        to = fspath(part)[: -len(".part")]
    return Trajectory(Path(_recover(part, to, overwrite)["path"]))
