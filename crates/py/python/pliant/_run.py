"""What `Simulation.run` shows and returns."""

from __future__ import annotations

import sys
import time
import warnings as _warnings
from dataclasses import dataclass
from os import PathLike
from typing import Any

from ._pliant import Frame


@dataclass(frozen=True)
class Summary:
    """What can be said of a run at its end.

    Attributes
    ----------
    frames : int
        Frames shown.
    steps : int
        Steps taken.
    start, end : dict of str to float
        Energies [J], as `Simulation.energy` has them.
    energy_drift : float or None
        Change of energy over the energy in play; what is known to have come in from outside and gone out is
        no drift. None where the scheme is quasi-static: there is no energy of motion to be kept.
    energy_error : float or None
        The largest such change on the way.
    statics : dict or None
        Of a quasi-static run, the equilibrium at its end: ``displacement``, the largest distance from rest
        [m], and ``von_mises``, the largest stress [Pa] (where there are elements), each a dict of its
        ``value``, the ``body``, the ``index`` of the vertex or element in it, and its place ``at`` [m];
        ``reactions``, the sum of the forces of all pins [N]; ``residual``, the largest component of the force
        that is left at a free coordinate [N]. None for other schemes.
    path : path or None
        The file that was recorded.
    warnings : list of str
        What should be known of the result: energy that nothing accounts for, say. They are issued as
        `RuntimeWarning` too.
    """

    frames: int
    steps: int
    start: dict[str, float]
    end: dict[str, float]
    energy_drift: float | None
    energy_error: float | None
    statics: dict[str, Any] | None
    path: PathLike[str] | None
    warnings: list[str]

    def __post_init__(self) -> None:
        for text in self.warnings:
            # Where `run` was called: the methods in between are not written in Python.
            _warnings.warn(text, RuntimeWarning, stacklevel=3)


class Progress:
    """A line on standard error that says how far a run is."""

    def __init__(self, start: float, end: float) -> None:
        self._start, self._end = start, end
        self._began = time.monotonic()
        self._shown = -1.0
        self._interactive = sys.stderr.isatty()

    def __call__(self, frame: Frame) -> None:
        now = time.monotonic()
        # A terminal is told ten times a second, a file every ten seconds.
        if now - self._shown < (0.1 if self._interactive else 10.0):
            return
        self._shown = now
        done = (frame.time - self._start) / max(self._end - self._start, 1e-300)
        left = (now - self._began) * (1.0 - done) / done if done > 0.0 else float("inf")
        text = f"{100.0 * done:5.1f}% t = {frame.time:.4g} s of {self._end:.4g} s, {left:.0f} s left"
        print(
            f"\r{text:60}" if self._interactive else text,
            end="" if self._interactive else "\n",
            file=sys.stderr,
        )

    def close(self) -> None:
        """End the line."""
        if self._interactive and self._shown >= 0.0:
            print(f"\r{'':60}\r", end="", file=sys.stderr)
