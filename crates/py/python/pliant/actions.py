"""Actions of vector environments."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
import numpy.typing as npt

if TYPE_CHECKING:
    from .environments import VectorEnvironment

Array = npt.NDArray[np.float64]

#: Name, displacements and rotation vectors (n, 6) or None, velocities (n, 6), time [s].
Move = tuple[str, Array | None, Array, float]


def _bounds(low: npt.ArrayLike, high: npt.ArrayLike, size: int, what: str) -> tuple[Array, Array]:
    bounds = [np.array(np.broadcast_to(np.asarray(bound, float), (size,))) for bound in (low, high)]
    if not all(np.isfinite(bound).all() for bound in bounds) or (bounds[0] >= bounds[1]).any():
        raise ValueError(f"bounds of {what} are finite, low below high; got low = {low!r}, high = {high!r}")
    return bounds[0], bounds[1]


def _letters(axes: str, known: str, what: str) -> list[int]:
    if len(set(axes)) < len(axes) or any(axis not in known for axis in axes):
        raise ValueError(f"{what} are letters of {known!r}, each once; got {axes!r}")
    return ["xyz".index(axis) for axis in axes]


class PinAction:
    """Action that moves a pin, by `Simulation.move`.

    Parameters
    ----------
    pin : str
        Name of the pin, ``body/pin``.
    axes : str, optional
        Axes along which the pin moves, one number each; default: all.
    turns : str, default ""
        Axes about which the pin turns, one number each: letters of "xyz", in 2D "z". The numbers are
        components of a rotation vector.
    by : {"position", "velocity"}
        Meaning of the numbers: displacements [m] and rotations [rad] from the initial pose of the pin,
        reached at rest at the end of the step of the environment; or velocities [m/s], [rad/s] reached there.
    low, high : float or array_like
        Bounds of the numbers.

    Examples
    --------
    >>> wrist = PinAction("finger/base", axes="x", turns="z", by="velocity", low=-0.2, high=0.2)
    >>> wrist.by
    'velocity'
    """

    def __init__(
        self,
        pin: str,
        axes: str | None = None,
        turns: str = "",
        by: Literal["position", "velocity"] = "position",
        low: npt.ArrayLike = -1.0,
        high: npt.ArrayLike = 1.0,
    ) -> None:
        if by not in ("position", "velocity"):
            raise ValueError(f'a pin is steered by "position" or by "velocity", got {by!r}')
        self.pin, self.axes, self.turns, self.by = pin, axes, turns, by
        self._given = (low, high)

    def _bind(self, env: VectorEnvironment) -> tuple[Array, Array]:
        d = env.dimension
        pins = env._pins
        if self.pin not in pins:
            raise KeyError(f"there is no pin {self.pin!r}; there are {pins}")
        axes = _letters("xyz"[:d] if self.axes is None else self.axes, "xyz"[:d], "axes of a pin")
        turns = _letters(self.turns, "z" if d == 2 else "xyz", "axes that a pin turns about")
        self._columns = axes + [3 + turn for turn in turns]
        return _bounds(*self._given, len(self._columns), f"the pin {self.pin!r}")

    def _move(self, env: VectorEnvironment, numbers: Array) -> Move:
        full = np.zeros((env.num_envs, 6))
        full[:, self._columns] = numbers
        over = env.step_duration
        return (
            (self.pin, None, full, over)
            if self.by == "velocity"
            else (self.pin, full, np.zeros_like(full), over)
        )


class ForceAction:
    """Action that applies a force, distributed equally over vertices.

    Parameters
    ----------
    vertices : array_like of int, or of bool with shape (vertices,)
        The vertices.
    axes : str, optional
        Axes along which the force acts, one number each [N]; default: all.
    low, high : float or array_like
        Bounds of the numbers [N].

    Examples
    --------
    >>> push = ForceAction([8, 9], axes="x", low=-5.0, high=5.0)
    >>> push.axes
    'x'
    """

    def __init__(
        self,
        vertices: npt.ArrayLike,
        axes: str | None = None,
        low: npt.ArrayLike = -1.0,
        high: npt.ArrayLike = 1.0,
    ) -> None:
        self.vertices, self.axes = np.atleast_1d(np.asarray(vertices)), axes
        self._given = (low, high)

    def _bind(self, env: VectorEnvironment) -> tuple[Array, Array]:
        d, count = env.dimension, env.vertex_count
        which = np.flatnonzero(self.vertices) if self.vertices.dtype == bool else self.vertices
        if self.vertices.dtype == bool and self.vertices.shape != (count,):
            raise ValueError(f"a mask of vertices must have length {count}, got {self.vertices.shape}")
        if which.dtype.kind not in "iu" or which.size == 0 or which.min() < 0 or which.max() >= count:
            raise ValueError(f"a force acts on vertices 0 to {count - 1}, got {self.vertices}")
        axes = _letters("xyz"[:d] if self.axes is None else self.axes, "xyz"[:d], "axes of a force")
        # A vertex that is named twice gets two parts.
        self._parts = np.bincount(which, minlength=count) / len(which)
        self._columns = axes
        return _bounds(*self._given, len(axes), "a force")

    def _add(self, env: VectorEnvironment, numbers: Array, forces: Array) -> None:
        for column, axis in enumerate(self._columns):
            forces[:, :, axis] += numbers[:, column, None] * self._parts


class FunctionAction:
    """Action that a function turns into forces on all vertices.

    Use it for muscles, thrusters, friction: forces that depend on positions and velocities.

    Parameters
    ----------
    size : int
        Number of numbers.
    function : callable
        Called with the `VectorEnvironment` and the numbers, shape (n, size); returns forces [N], shape (n,
        vertices, dim).
    low, high : float or array_like
        Bounds of the numbers.
    every : int, optional
        Number of steps of the simulation between calls; default: one call per step of the environment.

    Examples
    --------
    >>> def lift(env, numbers):
    ...     return numbers[:, :, None] * np.ones((env.num_envs, env.vertex_count, env.dimension))
    >>> FunctionAction(1, lift, every=5).size
    1
    """

    def __init__(
        self,
        size: int,
        function: Callable[[VectorEnvironment, Array], npt.ArrayLike],
        low: npt.ArrayLike = -1.0,
        high: npt.ArrayLike = 1.0,
        every: int | None = None,
    ) -> None:
        if size < 1 or (every is not None and every < 1):
            raise ValueError(f"size and every are at least 1, got {size} and {every}")
        self.size, self.function, self.every = size, function, every
        self._given = (low, high)

    def _bind(self, env: VectorEnvironment) -> tuple[Array, Array]:
        return _bounds(*self._given, self.size, "a function of forces")

    def _add(self, env: VectorEnvironment, numbers: Array, forces: Array) -> None:
        found = np.asarray(self.function(env, numbers), float)
        if found.shape != forces.shape:
            raise ValueError(f"a function of forces returns shape {forces.shape}, got {found.shape}")
        forces += found


class ValueAction:
    """Action that sets values of the scene, by `Simulation.set`.

    Parameters
    ----------
    paths : str or sequence of str
        Keys, one number each: ``"world.gravity.1"``, ``"body.0.elastic.corotated.young"``.
    low, high : float or array_like
        Bounds of the numbers, in SI units.

    Notes
    -----
    A changed value assembles its environment anew, one environment after the other, which is slow; actions on
    pins and forces do not. A number replaces a formula of time or position. Values that a scene refuses raise
    `SceneError`, such as a zero load or muscle tension.

    Examples
    --------
    >>> tilt = ValueAction("world.gravity.0", low=-1.0, high=1.0)
    >>> tilt.paths
    ('world.gravity.0',)
    """

    def __init__(
        self, paths: str | Sequence[str], low: npt.ArrayLike = -1.0, high: npt.ArrayLike = 1.0
    ) -> None:
        self.paths = (paths,) if isinstance(paths, str) else tuple(paths)
        self._given = (low, high)

    def _bind(self, env: VectorEnvironment) -> tuple[Array, Array]:
        if not self.paths:
            raise ValueError("no keys to set")
        self._start = {path: env.scene._value(path) for path in self.paths}
        # What a path leads to, and whether a number may be there, the scene knows.
        env.scene.with_changes(dict(self._start))
        self._now: list[dict[str, Any]] = [dict(self._start) for _ in range(env.num_envs)]
        return _bounds(*self._given, len(self.paths), f"values {list(self.paths)}")

    def _set(self, env: VectorEnvironment, numbers: Array, mask: npt.NDArray[np.bool_]) -> None:
        for i in np.flatnonzero(mask):
            self._change(env, int(i), dict(zip(self.paths, numbers[i].tolist())))

    def _reset(self, env: VectorEnvironment, mask: npt.NDArray[np.bool_]) -> None:
        for i in np.flatnonzero(mask):
            self._change(env, int(i), dict(self._start))

    def _change(self, env: VectorEnvironment, i: int, values: dict[str, Any]) -> None:
        changes = {path: value for path, value in values.items() if value != self._now[i][path]}
        if changes:
            env._batch.set(i, changes)
            self._now[i] = values


Action = PinAction | ForceAction | FunctionAction | ValueAction
