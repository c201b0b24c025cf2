"""Gradients of runs."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy.typing as npt


@dataclass(frozen=True)
class WallEvent:
    """A vertex that has come to a wall, or left one, in a scene without contact.

    Attributes
    ----------
    step : int
        The step at whose end it is there and at whose beginning it was not, or the other way round, as `Frame.step` counts.
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
        Vertices that came to a wall, or left one, in a scene without contact, by steps: the derivatives do not see changes that shift
        such an event to another step.
    """

    value: float
    derivatives: dict[str, float | npt.NDArray[Any]]
    growth: float
    unsettled: int = 0
    wall_events: tuple[WallEvent, ...] = ()

    def __getitem__(self, name: str) -> float | npt.NDArray[Any]:
        return self.derivatives[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self.derivatives)

    def __len__(self) -> int:
        return len(self.derivatives)


@dataclass(frozen=True, eq=False)
class FrequencyGradient(Mapping[str, "npt.NDArray[Any]"]):
    """Derivatives of squares of natural frequencies by name: ``found["body.beam.rest"][0]`` is that of the lowest.

    Attributes
    ----------
    omega : ndarray of float64, shape (count,)
        Angular frequencies, from the lowest [rad/s]; 0 of rigid motion.
    derivatives : dict of str to ndarray
        Of ``omega**2`` [rad^2/s^2] by each name: shape (count,) where it is one number, else (count, numbers). Those of ``omega`` are
        ``1/(2 omega)`` times these, where it is not 0.
    alike : ndarray of int64, shape (count,)
        How many modes have the frequency of each, itself included. Where there are several, single ones have no derivative, and those given
        are those of their mean.
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
