"""Gradients of runs."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

if TYPE_CHECKING:
    from ._pliant import Frame, Scene, Simulation


@dataclass(frozen=True)
class WallEvent:
    """Event of a vertex that reaches or leaves a wall, in a scene without contact.

    Attributes
    ----------
    step : int
        Step in which the vertex reaches or leaves the wall, as counted by `Frame.step`.
    vertex : int
        The vertex.
    wall : int
        Index of the wall in ``[world] walls``.
    has_come : bool
        True if the vertex reaches the wall, False if it leaves.
    """

    step: int
    vertex: int
    wall: int
    has_come: bool


@dataclass(frozen=True)
class ContactEvents:
    """Number of changes of active contact pairs, counted from each state of a run to the next.

    Attributes
    ----------
    come : int
        Pairs that became active.
    left : int
        Pairs that became inactive.
    slid : int
        Pairs that began to slide, by the velocities of states; none in statics.
    stuck : int
        Pairs that began to stick.
    """

    come: int
    left: int
    slid: int
    stuck: int


@dataclass(frozen=True, eq=False)
class Gradient(Mapping[str, "float | npt.NDArray[Any]"]):
    """Derivatives of a loss by name: ``gradient["body.beam.elastic.young"]``.

    Attributes
    ----------
    value : float
        The loss.
    derivatives : dict of str to float or ndarray
        Derivatives by name: a float for one number, shape (n, dim) for positions and velocities,
        (steps, n, dim) for ``"forces"``, (steps + 1, n, dim) for ``"pins"``.
    growth : float
        Growth rate of the logarithm of the largest derivative by a state, backwards in time [1/s]. If it is
        large, small changes at the start become large at the end, and derivatives of long runs say little.
    unsettled : int
        Number of solves after which friction still changed, where the derivatives are not exact.
    wall_events : tuple of WallEvent
        Vertices that reached or left a wall, in a scene without contact, by step. The derivatives do not
        include shifts of such events to another step.
    contact_events : ContactEvents
        Numbers of contact pairs that became active or inactive, began to slide or to stick. Derivatives are
        exact there, but the more events, the less they predict larger changes.
    """

    value: float
    derivatives: dict[str, float | npt.NDArray[Any]]
    growth: float
    unsettled: int = 0
    wall_events: tuple[WallEvent, ...] = ()
    contact_events: ContactEvents = ContactEvents(0, 0, 0, 0)

    def __getitem__(self, name: str) -> float | npt.NDArray[Any]:
        return self.derivatives[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self.derivatives)

    def __len__(self) -> int:
        return len(self.derivatives)


@dataclass(frozen=True, eq=False)
class FrequencyGradient(Mapping[str, "npt.NDArray[Any]"]):
    """Derivatives of squared natural frequencies by name.

    ``found["body.beam.rest"][0]`` is the derivative of the lowest.

    Attributes
    ----------
    omega : ndarray of float64, shape (count,)
        Angular frequencies, from the lowest [rad/s]; 0 of rigid motion.
    derivatives : dict of str to ndarray
        Derivatives of ``omega**2`` [rad^2/s^2] by name: shape (count,) for one number, else (count,
        numbers). Multiply by ``1/(2 omega)`` for those of a nonzero ``omega``.
    alike : ndarray of int64, shape (count,)
        Multiplicity of each frequency. Single modes of a multiple frequency have no derivative; the given one
        is that of their mean.
    """

    omega: npt.NDArray[Any]
    derivatives: dict[str, npt.NDArray[Any]]
    alike: npt.NDArray[Any]

    def __getitem__(self, name: str) -> npt.NDArray[Any]:
        return self.derivatives[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self.derivatives)

    def __len__(self) -> int:
        return len(self.derivatives)


@dataclass(frozen=True, eq=False)
class HessianProduct(Mapping[str, "float | npt.NDArray[Any]"]):
    """Product of the Hessian of a loss with a direction, by name, from differences of gradients.

    Attributes
    ----------
    value : float
        ``d . H d`` with the direction ``d``.
    derivatives : dict of str to float or ndarray
        Product by name, with the shapes of the direction.
    errors : dict of str to float or ndarray
        Error estimates by name, not bounds: the change by the last extrapolation of each number, or the
        deviation of smaller differences. A large one means that the loss is not smooth, or that steps are
        solved too coarsely.
    """

    value: float
    derivatives: dict[str, float | npt.NDArray[Any]]
    errors: dict[str, float | npt.NDArray[Any]]

    def __getitem__(self, name: str) -> float | npt.NDArray[Any]:
        return self.derivatives[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self.derivatives)

    def __len__(self) -> int:
        return len(self.derivatives)


class _MovedRuns:
    """Gradients of a loss over runs whose start and parameters move along a direction."""

    def __init__(
        self,
        simulation: Simulation,
        loss: Callable[[Frame], tuple[Any, ...] | None],
        direction: Mapping[str, npt.ArrayLike],
        steps: int | None,
        times: Sequence[float] | None,
        memory: int | None,
    ) -> None:
        self.simulation, self.loss = simulation, loss
        self.run: dict[str, Any] = {"steps": steps, "times": times, "memory": memory}
        self.direction = {name: np.asarray(change, dtype=np.float64) for name, change in direction.items()}
        known = simulation.gradient_names()
        for name in self.direction:
            if name not in known:
                raise KeyError(f"`{name}` has no derivative; these have one: {', '.join(known)}")
        scene = simulation.scene
        # Quantities are numbers there.
        numbers = type(scene).from_toml(scene.to_toml())
        self.paths = {name: _path(scene, name) for name in direction if name not in ("position", "velocity")}
        self.values: dict[str, npt.NDArray[np.float64]] = {
            name: np.asarray(numbers._value(path), dtype=np.float64) for name, path in self.paths.items()
        }
        self.values |= {"position": simulation.positions, "velocity": simulation.velocities}
        for name, change in self.direction.items():
            if change.shape != self.values[name].shape:
                raise ValueError(f"{name} must have shape {self.values[name].shape}; got {change.shape}")
        parts = [_largest(change) / self._size(name) for name, change in self.direction.items()]
        #: Length of the direction, in parts of what it changes.
        self.length = max(parts, default=0.0) or 1.0

    def _size(self, name: str) -> float:
        """Return the scale of changes of this name."""
        extent = float(np.ptp(self.values["position"], axis=0).max())
        if name == "position":
            return extent or 1.0
        of_values = _largest(self.values[name])
        if name == "velocity":
            duration = self.simulation.scene.duration
            return max(of_values, extent / duration) if duration else of_values or 1.0
        return of_values or 1.0

    def gradient(self, part: float) -> list[float]:
        """Return all derivatives, with the largest relative change equal to `part`."""
        scale = part / self.length
        at = {name: self.values[name] + scale * change for name, change in self.direction.items()}
        moved = self.simulation.clone()
        if self.paths:
            moved.set({path: at[name].tolist() for name, path in self.paths.items()})
        if "position" in at:
            moved.positions = at["position"]
        if "velocity" in at:
            moved.velocities = at["velocity"]
        found = moved.gradient(self.loss, list(self.direction), **self.run)
        rows = [np.ravel(found[name]) for name in self.direction]
        numbers: list[float] = np.concatenate(rows).tolist() if rows else []
        return numbers

    def shown(self, product: Sequence[float], errors: Sequence[float]) -> HessianProduct:
        """Return the product by name, from that with a direction of length 1."""
        sizes = [change.size for change in self.direction.values()]

        def by_name(numbers: Sequence[float]) -> dict[str, float | npt.NDArray[Any]]:
            parts = np.split(self.length * np.asarray(numbers), np.cumsum(sizes)[:-1])
            shaped = zip(self.direction.items(), parts, strict=True)
            return {
                name: part.reshape(change.shape) if change.ndim else float(part[0])
                for (name, change), part in shaped
            }

        found = by_name(product)
        value = sum(float(np.sum(change * found[name])) for name, change in self.direction.items())
        return HessianProduct(value, found, by_name(errors))


def _largest(numbers: npt.NDArray[np.float64]) -> float:
    """Return the largest magnitude."""
    return float(np.abs(numbers).max(initial=0.0))


def _path(scene: Scene, name: str) -> str:
    """Return the path of a parameter in the scene, from its name among the derivatives."""
    from ._differentiable import _may_be_a_key, _path

    if not _may_be_a_key(name):
        raise KeyError(f"`{name}` is no number of the scene that could be changed")
    return _path(scene, name)
