"""The falling beam beside Newton, whose kernels are Warp's: explicit steps, and block descent, on the CPU.

SolverSemiImplicit has the stable neo-Hookean energy with the logarithm, SolverVBD the one without; pliant
has both. Newton computes in single precision, pliant in double.
"""

from __future__ import annotations

from common import Case, measure, report  # isort: skip

from collections.abc import Callable

import beam
import numpy as np
import warp as wp

# Before the import that starts it.
wp.config.log_level = wp.LOG_WARNING
import newton  # noqa: E402


def with_newton(solver: str, steps: int, iterations: int = 0, shifted: bool = False) -> Case:
    """A case of Newton: SolverSemiImplicit, or SolverVBD with so many iterations a step.

    ``shifted`` begins with velocities half a step earlier: the positions of SolverSemiImplicit are then
    those of Verlet.
    """

    def prepare() -> tuple[Callable[[], object], Callable[[], np.ndarray]]:
        builder = newton.ModelBuilder(gravity=(0.0, 0.0, -beam.GRAVITY))
        explicit = solver == "SemiImplicit"
        earlier = 0.5 * beam.DURATION / steps * beam.GRAVITY if shifted else 0.0
        builder.add_soft_mesh(
            pos=wp.vec3(0.0, 0.0, 0.0),
            rot=wp.quat_identity(),
            scale=1.0,
            vel=wp.vec3(0.0, 0.0, earlier),
            vertices=[wp.vec3(*point) for point in beam.POINTS],
            indices=beam.TETRAHEDRA.ravel().tolist(),
            density=beam.DENSITY,
            k_mu=beam.LOG_MU if explicit else beam.MU,
            k_lambda=beam.LOG_LAMBDA if explicit else beam.LAMBDA,
            k_damp=0.0,
            add_surface_mesh_edges=False,
        )
        for index in np.flatnonzero(~beam.FREE):
            builder.particle_mass[index] = 0.0
            builder.particle_qd[index] = wp.vec3(0.0, 0.0, 0.0)
            builder.particle_flags[index] &= ~int(newton.ParticleFlags.ACTIVE)
        if not explicit:
            builder.color()
        model = builder.finalize(device="cpu")
        # Nothing touches: neither is looked for.
        model.particle_grid = None
        if explicit:
            made = newton.solvers.SolverSemiImplicit(model, enable_tri_contact=False)
        else:
            made = newton.solvers.SolverVBD(model, iterations=iterations, particle_enable_self_contact=False)
        states = [model.state(), model.state()]
        control, step = model.control(), beam.DURATION / steps

        def work() -> None:
            for _ in range(steps):
                states[0].clear_forces()
                made.step(states[0], states[1], control, None, step)
                states.reverse()
            wp.synchronize()

        return work, lambda: states[0].particle_q.numpy().astype(float)

    more = f", {iterations} iterations" if iterations else ", shifted" if shifted else ""
    return Case("Newton", f"{solver}, {steps} steps{more}", prepare)


def explicit() -> None:
    """Symplectic Euler in both."""
    material = "stable-neo-hookean-log"
    exact = beam.converged(material, False)
    beam.describe(exact, material, False)
    cases = []
    for steps in (420, 840, 1680):
        cases += [
            with_newton("SemiImplicit", steps),
            with_newton("SemiImplicit", steps, shifted=True),
            beam.with_pliant(material, False, "symplectic-euler", steps),
            beam.with_pliant(material, False, "velocity-verlet", steps),
        ]
    measure(cases, beam.error_of(exact))
    report(f"{beam.TITLE}, explicit", cases, [1e-1, 1e-2, 1e-3, 1e-4, 1e-5])


def implicit() -> None:
    """Implicit Euler, by block descent in Newton and by Newton's method in pliant."""
    material = "stable-neo-hookean"
    exact = beam.converged(material, False)
    beam.describe(exact, material, False)
    cases = []
    # 20 iterations in each of 200 steps take as long as all other cases together.
    few = [(20, 5), (40, 5), (40, 20), (100, 5), (100, 20), (200, 5)]
    cases += [with_newton("VBD", steps, iterations) for steps, iterations in few]
    for steps in (20, 40, 100, 200):
        cases += [
            beam.with_pliant(material, False, "implicit-euler", steps),
            beam.with_pliant(material, False, "linearised-implicit-euler", steps),
            beam.with_pliant(material, False, "implicit-midpoint", steps),
        ]
    measure(cases, beam.error_of(exact), largest=1.0)
    report(f"{beam.TITLE}, implicit", cases, [0.5, 0.2, 1e-1, 1e-2, 1e-3])


if __name__ == "__main__":
    print(f"\n## Beside Newton {newton.__version__}, Warp {wp.__version__}")
    explicit()
    implicit()
