"""A soft finger on a robot of MuJoCo: poses go in by a driven pin, wrenches come back out of its reaction.

    python mujoco_finger.py

lets an arm of two joints press a finger of rubber on the floor, and prints what each side says of it.

Coupling is staggered. In each interval of MuJoCo's step the arm moves first, under the mean wrench of the
interval before; then the finger follows, in smaller steps, its base on the cubic way between both poses of
the hand (`Simulation.move`: position and velocity are continuous). Both wrenches are the same numbers with
opposite signs, one interval apart: momentum is conserved but for that delay, an error in proportion to the
interval. It is stable where the base of the finger is light beside the hand.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import mujoco
import numpy as np
import numpy.typing as npt
import pliant

Array = npt.NDArray[np.float64]

#: Cells of the finger and their size [m]; it hangs down from the hand.
CELLS = (1, 1, 5)
SPACING = 0.016
#: Step of the finger [s].
STEP = 2e-4
#: Where the hand starts: the middle of the base of the finger [m].
HAND = np.array([0.4, 0.0, 0.14])
PIN = "finger/base"

ARM = f"""
<mujoco>
  <option timestep="{{interval}}" gravity="0 0 {{gravity}}" integrator="implicitfast"/>
  <worldbody>
    <body name="upper" pos="0 0 0.14">
      <joint name="shoulder" axis="0 1 0" damping="0.2"/>
      <geom type="capsule" fromto="0 0 0 0.2 0 0" size="0.02" mass="0.5" contype="0" conaffinity="0"/>
      <body name="hand" pos="0.2 0 0">
        <joint name="elbow" axis="0 1 0" damping="0.1"/>
        <geom type="capsule" fromto="0 0 0 0.2 0 0" size="0.02" mass="0.4" contype="0" conaffinity="0"/>
        <site name="grip" pos="0.2 0 0"/>
      </body>
    </body>
  </worldbody>
  <actuator>
    <position joint="shoulder" kp="60" dampratio="1"/>
    <position joint="elbow" kp="40" dampratio="1"/>
  </actuator>
</mujoco>
"""

#: A hand that floats, on which nothing acts but the finger: what it loses the finger gains.
FLOATING = f"""
<mujoco>
  <option timestep="{{interval}}" gravity="0 0 {{gravity}}"/>
  <worldbody>
    <body name="hand" pos="{HAND[0]} {HAND[1]} {HAND[2]}">
      <freejoint/>
      <geom type="box" size="0.03 0.03 0.02" mass="0.5" contype="0" conaffinity="0"/>
      <site name="grip"/>
    </body>
  </worldbody>
</mujoco>
"""


def finger(gravity: float = -9.81) -> pliant.Scene:
    """The finger, its upper end held, above a floor."""
    width, length = CELLS[0] * SPACING, CELLS[2] * SPACING
    origin = HAND - [0.5 * width, 0.5 * width, length]
    top = {"min": [-1.0, -1.0, HAND[2] - 1e-6], "max": [1.0, 1.0, HAND[2] + 1e-6]}
    return pliant.Scene(
        dimension=3,
        time={"integrator": "symplectic-euler", "step": STEP, "duration": 1.0},
        world={"gravity": [0.0, 0.0, gravity], "walls": [{"normal": [0.0, 0.0, 1.0], "offset": 0.0}]},
        body=[
            {
                "name": "finger",
                "mesh": {"grid": {"cells": CELLS, "spacing": SPACING, "origin": origin}},
                "elastic": {"stable-neo-hookean": {"young": 1e5, "poisson": 0.4}},
                "mass": {"density": 1000.0},
                "damping": {"strain_rate": {"shear": "10 Pa s"}},
                "pin": [{"name": "base", "box": top}],
            }
        ],
    )


@dataclass
class Coupled:
    """An arm with a finger, both at the same time at the ends of intervals.

    Attributes
    ----------
    model, data : mujoco.MjModel, mujoco.MjData
        The arm.
    finger : Simulation
        The finger.
    substeps : int
        Steps of the finger in an interval.
    wrench : ndarray, shape (2, 3)
        Mean force [N] and moment [N m], about the middle of the base, of the hand on the finger in the last
        interval.
    """

    model: Any
    data: Any
    finger: pliant.Simulation
    substeps: int
    wrench: Array = field(default_factory=lambda: np.zeros((2, 3)))
    #: Work that the hand did on the finger, as MuJoCo has it [J].
    work: float = 0.0

    @classmethod
    def start(cls, robot: str = ARM, substeps: int = 5, gravity: float = -9.81) -> Coupled:
        """At rest."""
        text = robot.format(interval=substeps * STEP, gravity=gravity)
        model = mujoco.MjModel.from_xml_string(text)
        data = mujoco.MjData(model)
        mujoco.mj_forward(model, data)
        coupled = cls(model, data, pliant.Simulation(finger(gravity)), substeps)
        coupled.wrench = coupled.finger.reactions()[PIN]
        return coupled

    @property
    def interval(self) -> float:
        """Interval of the coupling [s]."""
        return float(self.model.opt.timestep)

    def pose(self) -> tuple[Array, tuple[Array, Array]]:
        """Pose of the base from where it started, as `Simulation.move` takes it, and both velocities."""
        grip = self.data.site("grip")
        pose = np.eye(4)
        # Where the arm starts its axes are those of the world.
        pose[:3, :3], pose[:3, 3] = grip.xmat.reshape(3, 3), grip.xpos - HAND
        rates = np.zeros(6)
        mujoco.mj_objectVelocity(self.model, self.data, mujoco.mjtObj.mjOBJ_SITE, grip.id, rates, 0)
        return pose, (rates[3:], rates[:3])

    def advance(self) -> None:
        """Take an interval: the arm, then the finger."""
        hand, grip = self.data.body("hand"), self.data.site("grip")
        force, moment = -self.wrench
        arm = grip.xpos - hand.xipos
        hand.xfrc_applied[:] = np.concatenate([force, moment + np.cross(arm, force)])
        before = grip.xpos.copy(), grip.xmat.reshape(3, 3).copy()
        mujoco.mj_step(self.model, self.data)
        # Positions and velocities of what was stepped to.
        mujoco.mj_forward(self.model, self.data)
        turn = grip.xmat.reshape(3, 3) @ before[1].T
        angle = 0.5 * np.array([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]])
        self.work += float(self.wrench[0] @ (grip.xpos - before[0]) + self.wrench[1] @ angle)
        pose, velocity = self.pose()
        self.finger.move(PIN, pose, velocity, over=self.interval)
        wrench = np.zeros((2, 3))
        for _ in range(self.substeps):
            # Each step of the scheme takes the forces at its beginning.
            wrench += self.finger.reactions()[PIN]
            self.finger.step()
        self.wrench = wrench / self.substeps

    def momentum(self) -> Array:
        """Linear momentum of hand and finger [kg m/s], of a hand that floats."""
        hand: Array = self.data.qvel[:3] * self.model.body("hand").mass
        return hand + self.finger.momentum()


def press(duration: float = 0.6, substeps: int = 5) -> tuple[Coupled, float, float]:
    """Let the arm lower the finger on the floor and press.

    Means of the last third: forces of the floor and of the hand on it [N].
    """
    coupled, forces = Coupled.start(substeps=substeps), []
    for _ in range(round(duration / coupled.interval)):
        # The shoulder goes down, and the elbow turns the hand back, so that the finger stays upright.
        part = min(coupled.data.time / (0.5 * duration), 1.0)
        coupled.data.ctrl[:] = 0.35 * part, -0.35 * part
        coupled.advance()
        forces.append((coupled.finger.reactions()["wall0"][0, 2], coupled.wrench[0, 2]))
    floor, hand = np.mean(forces[-len(forces) // 3 :], axis=0)
    return coupled, float(floor), float(hand)


def drift(substeps: int, duration: float = 0.1) -> float:
    """Momentum that is lost, as a part of what went from the hand, thrown sideways, to the finger."""
    coupled = Coupled.start(FLOATING, substeps=substeps, gravity=0.0)
    coupled.data.qvel[:3] = 0.2, 0.0, 0.0
    mujoco.mj_forward(coupled.model, coupled.data)
    # The base has the velocity of the hand from the first step on.
    start = coupled.data.qvel[:3] * coupled.model.body("hand").mass
    for _ in range(round(duration / coupled.interval)):
        coupled.advance()
    exchanged = np.linalg.norm(coupled.finger.momentum())
    return float(np.linalg.norm(coupled.momentum() - start) / exchanged)


if __name__ == "__main__":
    coupled, floor, hand = press()
    weight = 9.81 * float(coupled.finger.masses.sum())
    print(
        f"the floor carries {floor:.2f} N, the hand presses with {-hand:.2f} N, "
        f"the finger weighs {weight:.2f} N"
    )
    print(
        f"the hand did {coupled.work:.4f} J, the finger got {coupled.finger.energy()['balance.motion']:.4f} J"
    )
    for substeps in (20, 10, 5):
        print(
            f"an interval of {1e3 * substeps * STEP:.1f} ms loses {100 * drift(substeps):.2f} % "
            f"of the momentum exchanged"
        )
