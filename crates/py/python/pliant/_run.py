"""Summary and progress of `Simulation.run`."""

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
    """Summary of a run.

    Attributes
    ----------
    frames : int
        Number of frames.
    steps : int
        Number of steps.
    start, end : dict of str to float
        Energies [J], as `Simulation.energy` has them.
    energy_drift : float or None
        Change of energy at the end, relative to the energy scale of the run. Known external work and
        dissipation are accounted for. None in statics.
    energy_error : float or None
        Largest such change during the run.
    statics : dict or None
        Equilibrium at the end of a quasi-static run: ``displacement``, the largest distance from the
        reference position [m], and ``von_mises``, the largest stress [Pa] (if there are elements), each a
        dict of its ``value``, the ``body``, the ``index`` of the vertex or element in it, and its position
        ``at`` [m];
        ``reactions``, the sum of the forces of all pins [N]; ``residual``, the largest component of the
        residual force [N]. None for other integrators.
    path : path or None
        The recording.
    warnings : list of str
        Warnings about the result, such as numerical damping. They are also issued as `RuntimeWarning`.
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
    """Progress line of a run on standard error."""

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
