"""The falling beam of St. Venant-Kirchhoff, beside the flex of MuJoCo.

Both read the same Gmsh file. A flex with ``dof="full"`` has linear tetrahedra of this material, a mass that
all vertices share equally, and no damping unless asked for; contact and constraints are off.
"""

from __future__ import annotations

from common import Case, measure, report  # isort: skip

import os
import tempfile
from collections.abc import Callable
from pathlib import Path

import beam
import mujoco
import numpy as np
from mesh import write


def model(mesh: Path, integrator: str, step: float, tolerance: float) -> mujoco.MjModel:
    """The beam as MJCF."""
    pins = " ".join(str(index) for index in np.flatnonzero(~beam.FREE))
    total = float(beam.masses(True).sum())
    return mujoco.MjModel.from_xml_string(f"""
    <mujoco>
      <option timestep="{step!r}" gravity="0 0 -{beam.GRAVITY}" integrator="{integrator}"
        tolerance="{tolerance}" iterations="1000">
        <flag contact="disable" constraint="disable"/>
      </option>
      <worldbody>
        <flexcomp name="beam" type="gmsh" file="{mesh}" dim="3" mass="{total!r}" radius="1e-3">
          <elasticity young="{beam.YOUNG}" poisson="{beam.POISSON}" damping="0"/>
          <contact selfcollide="none" contype="0" conaffinity="0"/>
          <edge equality="false"/>
          <pin id="{pins}"/>
        </flexcomp>
      </worldbody>
    </mujoco>""")


def with_mujoco(
    mesh: Path, integrator: str, steps: int, tolerance: float = 1e-8, shifted: bool = False
) -> Case:
    """A case of MuJoCo; ``tolerance`` is that of its solver, 1e-8 unless said.

    ``shifted`` begins with velocities half a step earlier: Euler's positions are then those of Verlet.
    """

    def prepare() -> tuple[Callable[[], object], Callable[[], np.ndarray]]:
        made = model(mesh, integrator, beam.DURATION / steps, tolerance)
        if not np.allclose(made.flex_vert0.shape, beam.POINTS.shape):
            raise RuntimeError("the flex has other vertices")
        data = mujoco.MjData(made)
        if shifted:
            # Of every free vertex three sliding joints, along x, y and z.
            data.qvel.reshape(-1, 3)[:, 2] = 0.5 * beam.DURATION / steps * beam.GRAVITY
        mujoco.mj_kinematics(made, data)
        mujoco.mj_flex(made, data)
        if np.abs(data.flexvert_xpos - beam.POINTS).max() > 1e-12:
            raise RuntimeError("the flex has its vertices in other places")

        def work() -> None:
            mujoco.mj_step(made, data, steps)
            # It starts again where accelerations are too large.
            if abs(data.time - beam.DURATION) > 1e-9:
                raise RuntimeError("unstable")

        def answer() -> np.ndarray:
            mujoco.mj_kinematics(made, data)
            mujoco.mj_flex(made, data)
            return data.flexvert_xpos.copy()

        return work, answer

    more = f", tolerance {tolerance:g}" if tolerance != 1e-8 else ""
    more += ", shifted" if shifted else ""
    return Case("MuJoCo", f"{integrator}, {steps} steps{more}", prepare)


if __name__ == "__main__":
    # Of a flex without constraints, and where a step is too large: both are looked at below.
    mujoco.set_mju_user_warning(lambda _: None)
    print(f"\n## Beside MuJoCo {mujoco.__version__}")
    exact = beam.converged("stvk", True)
    beam.describe(exact, "stvk", True)
    with tempfile.TemporaryDirectory() as folder:
        mesh = write(beam.MESH, Path(folder) / "beam.msh")
        # MuJoCo keeps a log in the working directory.
        os.chdir(folder)

        ours = beam.with_pliant("stvk", True, "symplectic-euler", 1680, mesh)
        beam.compare(with_mujoco(mesh, "Euler", 1680), ours, exact, 1680)

        cases = []
        for steps in (20, 40, 100, 200):
            cases += [
                with_mujoco(mesh, "discrete", steps),
                beam.with_pliant("stvk", True, "linearised-implicit-euler", steps, mesh),
                beam.with_pliant("stvk", True, "implicit-euler", steps, mesh),
                beam.with_pliant("stvk", True, "implicit-midpoint", steps, mesh),
            ]
        cases += [with_mujoco(mesh, "discrete", steps, 1e-4) for steps in (40, 200)]
        # pliant gives the largest stable step of explicit Euler as a 413th part of the whole.
        for steps in (420, 840, 1680):
            cases += [
                with_mujoco(mesh, "Euler", steps),
                with_mujoco(mesh, "Euler", steps, shifted=True),
                beam.with_pliant("stvk", True, "symplectic-euler", steps, mesh),
                with_mujoco(mesh, "RK4", steps),
                beam.with_pliant("stvk", True, "rk4", steps, mesh),
                beam.with_pliant("stvk", True, "velocity-verlet", steps, mesh),
            ]
        measure(cases, beam.error_of(exact))
        report(f"{beam.TITLE}, St. Venant-Kirchhoff", cases, [1e-1, 1e-2, 1e-3, 1e-4, 1e-6, 1e-8])
