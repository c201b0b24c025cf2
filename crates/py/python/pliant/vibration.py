"""Natural modes, and how a blow sounds."""

from __future__ import annotations

import wave
from collections.abc import Sequence
from os import PathLike, fspath
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
import numpy.typing as npt

from ._pliant import Scene, Simulation
from .tables import Table, axes_or_new

if TYPE_CHECKING:
    from matplotlib.axes import Axes as _Axes

Array = npt.NDArray[Any]


class Modes(Table):
    """Natural modes, by frequency.

    Columns are ``frequency`` [Hz], ``omega`` [rad/s], ``residual``, ``mass_x``, ``mass_y``, ``mass_z``
    (shares of the mass that is free to move along each axis) and ``shape``, of shape (count, n, dim), with
    ``shape^T M shape = 1`` [kg^-1/2].

    Attributes
    ----------
    rest : ndarray of float64, shape (n, dim)
        Positions that the modes are about [m].
    free_coordinates : int
        Coordinates that are free to move.
    mass_matrix : str
        ``"consistent"`` with the shape functions of quadratic elements of one density, ``"lumped"`` as in
        steps without any.
    """

    def __init__(self, found: dict[str, Any], shapes: Array, rest: Array) -> None:
        modes = found["modes"]
        columns: dict[str, npt.ArrayLike] = {
            name: [mode[name] for mode in modes] for name in ("frequency", "omega", "residual")
        }
        for c, axis in enumerate("xyz"[: rest.shape[1]]):
            columns[f"mass_{axis}"] = [mode["effective_mass"][c] for mode in modes]
        columns["shape"] = shapes
        super().__init__(columns, {"frequency": "Hz", "omega": "rad/s"})
        self.rest = rest
        self.free_coordinates: int = found["free_coordinates"]
        self.mass_matrix: str = found["mass_matrix"]

    def plot(self, mode: int = 0, *, axes: _Axes | None = None, size: float = 0.1) -> _Axes:
        """Draw a mode shape beside where it is about, projected to x and y; by matplotlib, if installed.

        Parameters
        ----------
        mode : int, default 0
            Which.
        axes : matplotlib.axes.Axes, optional
            Where to; new ones without it.
        size : float, default 0.1
            Largest displacement as a part of the size of the body.

        Returns
        -------
        matplotlib.axes.Axes
            What was drawn into.

        Examples
        --------
        >>> axes = modes(scene, 2).plot(1)
        >>> axes.get_xlabel()
        'x [m]'
        """
        axes = axes_or_new(axes)
        shape = self["shape"][mode]
        extent = float(np.ptp(self.rest, axis=0).max())
        moved = self.rest + shape * (size * extent / max(float(np.abs(shape).max()), 1e-300))
        axes.plot(*self.rest[:, :2].T, ".", color="0.8", label="at rest")
        axes.plot(*moved[:, :2].T, ".", label=f"mode {mode}")
        axes.set(aspect="equal", xlabel="x [m]", ylabel="y [m]", title=f"{self['frequency'][mode]:.6g} Hz")
        axes.legend()
        return axes


def modes(scene: Scene | Simulation, count: int = 10) -> Modes:
    """Natural frequencies and mode shapes, as ``pliant modes``.

    Parameters
    ----------
    scene : Scene or Simulation
        A scene is looked at where it starts, a simulation where it is: in a stable equilibrium.
    count : int, default 10
        How many, from the lowest.

    Returns
    -------
    Modes
        A table that plots.

    Raises
    ------
    RuntimeError
        There is no stable equilibrium, or nothing that vibrates.

    Examples
    --------
    >>> modes(scene, 2)["frequency"].shape
    (2,)
    """
    simulation = Simulation(scene) if isinstance(scene, Scene) else scene
    found, shapes = simulation._modes(count)
    return Modes(found, shapes, simulation.positions)


class Sound(Table):
    """What is heard of a blow, one row for each tone.

    Columns are ``mode``, from 0, ``frequency`` [Hz], ``decay`` [1/s] and ``amplitude`` [1/kg], velocity per
    impulse.

    Attributes
    ----------
    samples : ndarray of float64, shape (seconds * rate,)
        The sound, the largest sample a decibel below 1.
    rate : int
        Samples a second [Hz].
    silent : dict of str to int
        Modes that are not heard: ``rigid``, ``above_nyquist``, ``overdamped``, ``not_struck``.
    """

    def __init__(self, found: dict[str, Any], samples: Array, rate: int) -> None:
        names = ["mode", "frequency", "decay", "amplitude"]
        units = {"frequency": "Hz", "decay": "1/s", "amplitude": "1/kg"}
        super().__init__({name: [tone[name] for tone in found["partials"]] for name in names}, units)
        self.samples, self.rate = samples, rate
        self.silent: dict[str, int] = found["silent"]

    def write(self, path: str | PathLike[str], *, bits: Literal[16, 24] = 16) -> None:
        """Write a WAV file.

        Parameters
        ----------
        path : str or os.PathLike
            The file; what is there is replaced.
        bits : {16, 24}
            Of each sample.

        Examples
        --------
        >>> sound(scene, 9, [0.0, 1.0], count=10, seconds=0.1).write("blow.wav")
        """
        if bits not in (16, 24):
            raise ValueError(f"bits is 16 or 24, got {bits}")
        whole = np.rint(self.samples * (2 ** (bits - 1) - 1)).astype("<i4")
        # Of each number in four bytes the lower two or three.
        raw = whole.view(np.uint8).reshape(-1, 4)[:, : bits // 8].tobytes()
        with wave.open(fspath(path), "wb") as file:
            file.setnchannels(1)
            file.setsampwidth(bits // 8)
            file.setframerate(self.rate)
            file.writeframes(raw)


def sound(
    scene: Scene | Simulation,
    strike: int,
    direction: Sequence[float] | npt.NDArray[np.floating[Any]],
    *,
    listen: int | None = None,
    count: int = 30,
    rayleigh: tuple[float, float] | None = None,
    seconds: float = 2.0,
    rate: int = 48_000,
) -> Sound:
    """How a body sounds that is struck, as ``pliant modes --sound``.

    Parameters
    ----------
    scene : Scene or Simulation
        A scene is struck where it starts, a simulation where it is: in a stable equilibrium.
    strike : int
        The vertex that is struck.
    direction : array_like, shape (dim,)
        Direction of the blow, of any length but zero.
    listen : int, optional
        The vertex whose motion along `direction` is heard; the struck one without it.
    count : int, default 30
        How many modes, from the lowest.
    rayleigh : tuple of float, optional
        ``(alpha, beta)`` [1/s, s] of damping ``alpha M + beta K`` in place of the scene's.
    seconds : float, default 2.0
        How long [s].
    rate : int, default 48000
        Samples a second [Hz].

    Returns
    -------
    Sound
        Its tones, and samples.

    Raises
    ------
    ValueError
        There is no such vertex, it is held, or the direction is none.
    RuntimeError
        There is no stable equilibrium, or nothing is heard.

    Examples
    --------
    >>> heard = sound(scene, 9, [0.0, 1.0], count=10, seconds=0.5)
    >>> heard.samples.shape
    (24000,)
    """
    if not (0.0 < seconds < 3600.0 and 0 < rate <= 1_000_000):
        raise ValueError(
            f"seconds must be between 0 and 3600 and rate between 1 and 1000000, got {seconds} and {rate}"
        )
    simulation = Simulation(scene) if isinstance(scene, Scene) else scene
    blow = [float(component) for component in np.asarray(direction, dtype=float).ravel()]
    return Sound(*simulation._sound(count, strike, blow, listen, rayleigh, seconds, float(rate)), rate)
