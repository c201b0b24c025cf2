"""Natural modes, and the sound of an impact."""

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
    (effective mass along each axis, as a fraction of the free mass) and ``shape``, of shape (count, n, dim),
    with ``shape^T M shape = 1`` [kg^-1/2].

    Attributes
    ----------
    rest : ndarray of float64, shape (n, dim)
        Equilibrium positions of the modes [m].
    free_coordinates : int
        Number of unknowns.
    mass_matrix : str
        ``"consistent"`` with the shape functions for quadratic elements of one density, else ``"lumped"``, as
        in steps.
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
        """Plot a mode shape and the equilibrium, projected to x and y, with matplotlib.

        Parameters
        ----------
        mode : int, default 0
            Number of the mode.
        axes : matplotlib.axes.Axes, optional
            Axes to draw into; default: new ones.
        size : float, default 0.1
            Largest displacement as a fraction of the size of the body.

        Returns
        -------
        matplotlib.axes.Axes
            The axes.

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
        axes.plot(*self.rest[:, :2].T, ".", color="0.8", label="equilibrium")
        axes.plot(*moved[:, :2].T, ".", label=f"mode {mode}")
        axes.set(aspect="equal", xlabel="x [m]", ylabel="y [m]", title=f"{self['frequency'][mode]:.6g} Hz")
        axes.legend()
        return axes


def modes(scene: Scene | Simulation, count: int = 10) -> Modes:
    """Compute natural frequencies and mode shapes, as ``pliant modes``.

    Parameters
    ----------
    scene : Scene or Simulation
        Scene at its initial state, or simulation at its current state, which must be a stable equilibrium.
    count : int, default 10
        Number of modes, from the lowest.

    Returns
    -------
    Modes
        Table with plots.

    Raises
    ------
    RuntimeError
        The state is not a stable equilibrium, or nothing can vibrate.

    Examples
    --------
    >>> modes(scene, 2)["frequency"].shape
    (2,)
    """
    simulation = Simulation(scene) if isinstance(scene, Scene) else scene
    found, shapes = simulation._modes(count)
    return Modes(found, shapes, simulation.positions)


class Sound(Table):
    """Sound of an impact, one row per tone.

    Columns are ``mode``, from 0, ``frequency`` [Hz], ``decay`` [1/s] and ``amplitude`` [1/kg], velocity per
    impulse.

    Attributes
    ----------
    samples : ndarray of float64, shape (seconds * rate,)
        Samples; the largest one is a decibel below 1.
    rate : int
        Sample rate [Hz].
    silent : dict of str to int
        Numbers of silent modes: ``rigid``, ``above_nyquist``, ``overdamped``, ``not_struck``.
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
            File to write; an existing one is replaced.
        bits : {16, 24}
            Bits per sample.

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
    """Compute the sound of an impact on a body, as ``pliant modes --sound``.

    Parameters
    ----------
    scene : Scene or Simulation
        Scene at its initial state, or simulation at its current state, which must be a stable equilibrium.
    strike : int
        Vertex of the impact.
    direction : array_like, shape (dim,)
        Direction of the impact, of any nonzero length.
    listen : int, optional
        Vertex whose motion along `direction` is heard; default: that of the impact.
    count : int, default 30
        Number of modes, from the lowest.
    rayleigh : tuple of float, optional
        ``(alpha, beta)`` [1/s, s] of damping ``alpha M + beta K``, instead of the scene's.
    seconds : float, default 2.0
        Duration [s].
    rate : int, default 48000
        Sample rate [Hz].

    Returns
    -------
    Sound
        Tones and samples.

    Raises
    ------
    ValueError
        There is no such vertex, it is pinned, or the direction is not valid.
    RuntimeError
        The state is not a stable equilibrium, or there is no tone.

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
