"""Gradients of runs."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy.typing as npt


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
    wall_events : int
        How often a vertex came to a wall, or left one, in a scene without contact.
    """

    value: float
    derivatives: dict[str, float | npt.NDArray[Any]]
    growth: float
    unsettled: int = 0
    wall_events: int = 0

    def __getitem__(self, name: str) -> float | npt.NDArray[Any]:
        return self.derivatives[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self.derivatives)

    def __len__(self) -> int:
        return len(self.derivatives)
