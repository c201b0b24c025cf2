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
    """A vertex that has come to a wall, or left one, in a scene without contact.

    Attributes
    ----------
    step : int
        The step at whose end it is there and at whose beginning it was not, or the other way round, as
        `Frame.step` counts.
    vertex : int
        The vertex.
    wall : int
        The wall, by its place in ``[world] walls``.
    has_come : bool
        True if it has come, False if it has left.
    """

    step: int
    vertex: int
    wall: int
    has_come: bool


@dataclass(frozen=True)
class ContactEvents:
    """Changes of the pairs of closest primitives that touch, counted from each state of a run to the next.

    Attributes
    ----------
    come : int
        Pairs that have come within reach.
    left : int
        Pairs that have left it.
    slid : int
        Pairs that stuck and slide now, by the velocities of states; statics has none.
    stuck : int
        Pairs that slid and stick now.
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
        By each name: a float where it is one number, shape (n, dim) for positions and velocities, (steps, n,
        dim) for ``"forces"``, (steps + 1, n, dim) for ``"pins"``.
    growth : float
        Growth of the logarithm of the largest derivative by a state per second of the run, backwards [1/s].
        Where it is large, small changes at the start are large at the end, and derivatives of long runs say
        little.
    unsettled : int
        Solves after which friction still changed: the derivatives are not exact there.
    wall_events : tuple of WallEvent
        Vertices that came to a wall, or left one, in a scene without contact, by steps: the derivatives do
        not see changes that shift such an event to another step.
    contact_events : ContactEvents
        Number of pairs of surfaces that came within reach, left it, began to slide or to stick. Derivatives
        are exact there; what they say of larger changes is less the more there are.
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
    """Derivatives of squares of natural frequencies by name.

    ``found["body.beam.rest"][0]`` is that of the lowest.

    Attributes
    ----------
    omega : ndarray of float64, shape (count,)
        Angular frequencies, from the lowest [rad/s]; 0 of rigid motion.
    derivatives : dict of str to ndarray
        Of ``omega**2`` [rad^2/s^2] by each name: shape (count,) where it is one number, else (count,
        numbers). Those of ``omega`` are ``1/(2 omega)`` times these, where it is not 0.
    alike : ndarray of int64, shape (count,)
        How many modes have the frequency of each, itself included. Where there are several, single ones have
        no derivative, and those given are those of their mean.
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
    """Product of the Hessian of a loss with a direction, by name, found by differences of gradients.

    Attributes
    ----------
    value : float
        ``d . H d`` with the direction ``d``.
    derivatives : dict of str to float or ndarray
        The product by each name, of the shapes of the direction.
    errors : dict of str to float or ndarray
        Estimates of its errors, likewise, no bounds: what the last extrapolation of each number has changed,
        or how far smaller changes lead away. Where one is large, the loss is not smooth so far, or steps are
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
    """Gradients of a loss over runs whose start and numbers are changed by parts of a direction."""

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
        """What changes of this name are measured by."""
        extent = float(np.ptp(self.values["position"], axis=0).max())
        if name == "position":
            return extent or 1.0
        of_values = _largest(self.values[name])
        if name == "velocity":
            duration = self.simulation.scene.duration
            return max(of_values, extent / duration) if duration else of_values or 1.0
        return of_values or 1.0

    def gradient(self, part: float) -> list[float]:
        """All derivatives, where the largest change is this part of what it changes."""
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
        """The product by name, from that with a direction of length 1."""
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
    """The largest size of any of them."""
    return float(np.abs(numbers).max(initial=0.0))


def _path(scene: Scene, name: str) -> str:
    """The path of a number in the scene by its name among the derivatives."""
    from ._differentiable import _may_be_a_key, _path

    if not _may_be_a_key(name):
        raise KeyError(f"`{name}` is no number of the scene that could be changed")
    return _path(scene, name)
