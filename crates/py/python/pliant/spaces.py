"""Spaces and classes of Gymnasium, and their replacements if it is not installed."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, TypeVar

import numpy as np
import numpy.typing as npt

T = TypeVar("T")

#: Modes of resetting environments that have ended: our names and those of Gymnasium.
MODES = {"next-step": "NextStep", "same-step": "SameStep", "disabled": "Disabled"}


class Box:
    """Arrays between bounds: replacement of Gymnasium's space of this name if it is not installed."""

    def __init__(self, low: npt.NDArray[Any], high: npt.NDArray[Any], dtype: Any) -> None:
        self.low, self.high, self.dtype = low.astype(dtype), high.astype(dtype), np.dtype(dtype)
        self.shape = self.low.shape
        self._random = np.random.default_rng()

    def seed(self, seed: int | None = None) -> None:
        """Seed the random numbers of `sample`."""
        self._random = np.random.default_rng(seed)

    def sample(self) -> npt.NDArray[Any]:
        """Return random numbers; all bounds must be finite."""
        return self._random.uniform(self.low, self.high).astype(self.dtype)

    def contains(self, x: npt.NDArray[Any]) -> bool:
        """Return True if an array is within the bounds."""
        return x.shape == self.shape and bool(((self.low <= x) & (x <= self.high)).all())

    __contains__ = contains


def boxes(
    bounds: Sequence[tuple[npt.NDArray[np.float64], npt.NDArray[np.float64], Any]], n: int
) -> tuple[list[Any], list[Any]]:
    """Return spaces with these bounds and types, for one environment and for n."""
    try:
        from gymnasium.spaces import Box as GymnasiumBox
        from gymnasium.vector.utils import batch_space
    except ImportError:
        batched = [Box(np.tile(low, (n, 1)), np.tile(high, (n, 1)), kind) for low, high, kind in bounds]
        return [Box(*each) for each in bounds], batched
    single = [GymnasiumBox(low.astype(kind), high.astype(kind), dtype=kind) for low, high, kind in bounds]
    return list(single), [batch_space(box, n) for box in single]


def autoreset_mode(name: str) -> Any:
    """Return Gymnasium's mode; ours if Gymnasium is not installed."""
    try:
        from gymnasium.vector import AutoresetMode
    except ImportError:
        return name
    return AutoresetMode(MODES[name])


def kind_of_gymnasium(kind: type[T]) -> type[T]:
    """Return the class, derived from Gymnasium's ``VectorEnv`` if that is installed."""
    try:
        from gymnasium.vector import VectorEnv
    except ImportError:
        return kind
    bases: Any = (kind, VectorEnv)
    made: type[T] = type(kind.__name__, bases, {"__module__": kind.__module__, "__doc__": kind.__doc__})
    return made
