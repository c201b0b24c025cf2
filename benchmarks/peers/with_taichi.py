"""The falling beam beside Taichi: explicit steps written by hand, in double precision.

Taichi is a language, not a simulator: what is timed is the loop below, symplectic Euler or Verlet with
forces that tetrahedra add to their vertices. It knows this one energy and scheme.
"""

# No `from __future__ import annotations`: Taichi looks at the types of arguments.
from common import Case, measure, report  # isort: skip

import os
from collections.abc import Callable

os.environ["ENABLE_TAICHI_HEADER_PRINT"] = "0"

import beam
import numpy as np
import taichi as ti

ti.init(
    arch=ti.cpu,
    cpu_max_num_threads=1,
    default_fp=ti.f64,
    fast_math=True,
    log_level=ti.ERROR,
    offline_cache=False,
)

COUNT, CELLS = len(beam.POINTS), len(beam.TETRAHEDRA)
x, v, f = (ti.Vector.field(3, ti.f64, COUNT) for _ in range(3))
inverse_mass = ti.field(ti.f64, COUNT)
cells = ti.Vector.field(4, ti.i32, CELLS)
inverse = ti.Matrix.field(3, 3, ti.f64, CELLS)
volume = ti.field(ti.f64, CELLS)
MU, LAMBDA, GRAVITY = beam.MU, beam.LAMBDA, beam.GRAVITY


@ti.func
def cofactor(a):
    p = ti.Vector([a[0, 0], a[1, 0], a[2, 0]])
    q = ti.Vector([a[0, 1], a[1, 1], a[2, 1]])
    r = ti.Vector([a[0, 2], a[1, 2], a[2, 2]])
    return ti.Matrix.cols([q.cross(r), r.cross(p), p.cross(q)])


@ti.kernel
def advance(steps: ti.i32, step: ti.f64):
    # The outermost loop is the one that Taichi would spread over threads.
    for _once in range(1):
        for _step in range(steps):
            for i in range(COUNT):
                f[i] = ti.Vector([0.0, 0.0, 0.0])
            for e in range(CELLS):
                c = cells[e]
                now = ti.Matrix.cols([x[c[1]] - x[c[0]], x[c[2]] - x[c[0]], x[c[3]] - x[c[0]]])
                g = now @ inverse[e]
                k = cofactor(g)
                j = g[0, 0] * k[0, 0] + g[1, 0] * k[1, 0] + g[2, 0] * k[2, 0]
                stress = MU * g + ((LAMBDA + MU) * (j - 1) - MU) * k
                on = -volume[e] * stress @ inverse[e].transpose()
                for a in ti.static(range(3)):
                    part = ti.Vector([on[0, a], on[1, a], on[2, a]])
                    # Not `+=`, which is atomic, and makes the whole over twice as slow.
                    f[c[a + 1]] = f[c[a + 1]] + part
                    f[c[0]] = f[c[0]] - part
            for i in range(COUNT):
                if inverse_mass[i] > 0:
                    v[i] = v[i] + step * (f[i] * inverse_mass[i] - ti.Vector([0.0, 0.0, GRAVITY]))
                    x[i] = x[i] + step * v[i]


def with_taichi(steps: int, verlet: bool = False) -> Case:
    """A case of Taichi: symplectic Euler, or velocity Verlet.

    The positions of Verlet are those of symplectic Euler from velocities half a step earlier. At the start
    only the weight acts, and the answer is of positions, so that the same loop does both.
    """

    def prepare() -> tuple[Callable[[], object], Callable[[], np.ndarray]]:
        edges = (beam.POINTS[beam.TETRAHEDRA[:, 1:]] - beam.POINTS[beam.TETRAHEDRA[:, :1]]).swapaxes(1, 2)
        x.from_numpy(beam.POINTS)
        earlier = 0.5 * beam.DURATION / steps * GRAVITY if verlet else 0.0
        v.from_numpy(np.where(beam.FREE[:, None], [0.0, 0.0, earlier], 0.0))
        inverse_mass.from_numpy(np.where(beam.FREE, 1 / beam.masses(False), 0.0))
        cells.from_numpy(beam.TETRAHEDRA.astype(np.int32))
        inverse.from_numpy(np.linalg.inv(edges))
        volume.from_numpy(np.linalg.det(edges) / 6)

        def work() -> None:
            advance(steps, beam.DURATION / steps)
            ti.sync()

        return work, x.to_numpy

    name = "Verlet" if verlet else "symplectic Euler"
    return Case("Taichi", f"{name}, {steps} steps", prepare)


if __name__ == "__main__":
    print(f"\n## Beside Taichi {'.'.join(map(str, ti.__version__))}")
    material = "stable-neo-hookean"
    exact = beam.converged(material, False)
    beam.describe(exact, material, False)
    ours = beam.with_pliant(material, False, "symplectic-euler", 1680)
    beam.compare(with_taichi(1680), ours, exact, 1680)
    found = []
    for number in (420, 840, 1680, 3360):
        found += [
            with_taichi(number),
            with_taichi(number, verlet=True),
            beam.with_pliant(material, False, "symplectic-euler", number),
            beam.with_pliant(material, False, "velocity-verlet", number),
        ]
    found += [beam.with_pliant(material, False, "rk4", number) for number in (420, 840, 1680)]
    measure(found, beam.error_of(exact))
    report(f"{beam.TITLE}, explicit", found, [1e-1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6])
