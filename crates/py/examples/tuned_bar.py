"""A shape whose lowest frequency is asked for: a bar of steel that is filed until it sounds as it should.

    python tuned_bar.py

A bar is held at one end. Its thickness along its length is to be such that its lowest frequency is that of an
E, 1320 Hz, and the second one five times as much, with as much steel as there is. As it is sawn it has 1168
Hz and 6541 Hz. `Simulation.frequency_gradient` says how they change with the shape at rest; Newton's steps
with the least change of thickness (by the pseudoinverse) lead there.

The frequencies are those of the elements: linear triangles of this size are too stiff by
2.5 parts of a hundred.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt
import pliant

Array = npt.NDArray[np.float64]

LENGTH, THICKNESS = 0.12, 0.02
COLUMNS, ROWS = 48, 8
#: Frequencies that are asked for [Hz].
WANTED = np.array([1320.0, 6600.0])


def points(thickness: Array) -> Array:
    """Vertices of a bar of this thickness at each column [m], shape (columns + 1, rows + 1, 2)."""
    x = np.linspace(0.0, LENGTH, COLUMNS + 1)
    y = np.linspace(-0.5, 0.5, ROWS + 1)
    return np.stack([np.broadcast_to(x[:, None], (len(x), len(y))), thickness[:, None] * y], axis=2)


def triangles() -> list[list[int]]:
    """Two in each cell, turned so that the bar is the same from above and from below."""
    found = []
    for i in range(COLUMNS):
        for j in range(ROWS):
            a, b = i * (ROWS + 1) + j, (i + 1) * (ROWS + 1) + j
            down = 2 * j < ROWS
            found += [[a, b, b + 1], [a, b + 1, a + 1]] if down else [[a, b, a + 1], [b, b + 1, a + 1]]
    return found


def scene(thickness: Array) -> pliant.Scene:
    """The bar, without weight: its frequencies are about the shape at rest."""
    return pliant.Scene(
        dimension=2,
        time={"integrator": "trapezoid", "step": 1e-5, "duration": 0.1},
        body=[
            {
                "name": "bar",
                "mesh": {
                    "inline": {"points": points(thickness).reshape(-1, 2).tolist(), "triangles": triangles()}
                },
                "elastic": {"linear": {"young": 210e9, "poisson": 0.3, "plane": "stress"}},
                "mass": {"density": 7850},
                "pin": [{"half_space": {"normal": [1, 0], "offset": 0}}],
            }
        ],
    )


def squares(thickness: Array) -> tuple[Array, Array]:
    """The lowest two ``omega^2`` [rad^2/s^2], and derivatives by the thickness at each column, by rows."""
    found = pliant.Simulation(scene(thickness)).frequency_gradient(["body.bar.rest"], 2)
    by_height = found["body.bar.rest"].reshape(2, COLUMNS + 1, ROWS + 1, 2)[..., 1]
    return found.omega**2, by_height @ np.linspace(-0.5, 0.5, ROWS + 1)


def tune(wanted: Array = WANTED) -> tuple[Array, list[Array]]:
    """The thickness at each column [m], and the frequencies after each step [Hz]."""
    thickness, history = np.full(COLUMNS + 1, THICKNESS), []
    # Its area is that of trapezoids.
    steel = np.full(COLUMNS + 1, LENGTH / COLUMNS)
    steel[[0, -1]] /= 2
    whole = float(steel @ thickness)
    for _ in range(20):
        now, slopes = squares(thickness)
        history.append(np.sqrt(now) / math.tau)
        # Logarithms: what is asked for is a ratio.
        missing = np.append(np.log((math.tau * wanted) ** 2 / now), 1.0 - steel @ thickness / whole)
        if np.abs(missing).max() < 1e-11:
            break
        by_thickness = np.vstack([slopes / now[:, None], steel / whole])
        step = np.linalg.pinv(by_thickness) @ missing
        # No step takes more than a fifth of what is there.
        thickness = thickness + step / max(1.0, float(np.abs(step / thickness).max()) / 0.2)
    return thickness, history


if __name__ == "__main__":
    shape, frequencies = tune()
    for i, pair in enumerate(frequencies):
        print(f"step {i}: {pair[0]:9.4f} Hz and {pair[1]:9.4f} Hz")
    print("thickness from the root to the tip [mm]:", np.round(1e3 * shape[::6], 2))
