"""Recordings in Rerun."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

if TYPE_CHECKING:
    import rerun as _rerun

    from .trajectory import Trajectory

_Indices = npt.NDArray[np.uint32]


def _triangles(cells: dict[str, _Indices]) -> _Indices | None:
    """Return the visible triangles of a body: its surface or its cells, corners only."""
    for kind in ("surface", "tri", "tri6"):
        if kind in cells:
            return cells[kind][:, :3]
    if "quad" in cells:
        return np.concatenate([cells["quad"][:, [0, 1, 2]], cells["quad"][:, [0, 2, 3]]])
    return None


def to_rerun(trajectory: Trajectory, recording: _rerun.RecordingStream | None = None) -> None:
    """Draw a recording in Rerun, which must be installed (``pip install 'pliant[rerun]'``).

    Bodies are entities below ``bodies/``: surfaces are meshes with fixed triangles and moving vertices,
    springs and strands are lines, particles are points. The time line is ``time`` [s]. In 2D,
    z is 0.

    Parameters
    ----------
    trajectory : Trajectory
        The recording.
    recording : rerun.RecordingStream, optional
        Recording to log to; default: the current one of Rerun.

    Raises
    ------
    ModuleNotFoundError
        Rerun is not installed.

    Examples
    --------
    >>> import rerun as rr
    >>> to_rerun(trajectory, rr.RecordingStream("pliant"))
    """
    import rerun as rr

    stream = rr.get_global_data_recording() if recording is None else recording
    if stream is None:
        raise ValueError(
            "there is no recording of Rerun to draw in; call `rerun.init(...)` before, or give one"
        )
    points = np.zeros((trajectory.vertex_count, 3), np.float32)
    stream.log("bodies", rr.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)
    bodies = []
    for body, cells in zip(trajectory.metadata["bodies"], trajectory.topology.values(), strict=True):
        first = body["first_vertex"]
        own = slice(first, first + body["vertices"])
        name, triangles = f"bodies/{body['name']}", _triangles(cells)
        if triangles is not None:
            # Vertices of the mesh are those of the body alone.
            stream.log(
                name, rr.Mesh3D.from_fields(triangle_indices=triangles - np.uint32(first)), static=True
            )
        bodies.append((name, own, triangles is not None, cells.get("edge")))
    for frame, time in enumerate(trajectory.times):
        stream.set_time("time", duration=float(time))
        points[:, : trajectory.dimension] = trajectory.positions[frame]
        for name, own, solid, edges in bodies:
            if solid:
                stream.log(name, rr.Mesh3D.from_fields(vertex_positions=points[own]))
            elif edges is not None:
                stream.log(name, rr.LineStrips3D(points[edges]))
            else:
                stream.log(name, rr.Points3D(points[own]))
