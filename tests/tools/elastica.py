"""Limit loads of Lee's frame and of a shallow arch as extensible elastica, independently of pliant.

    python tests/tools/elastica.py frame|arch

A beam is r' = (1 + N/EA) t + Q/(5/6 GA) b, theta' = M/EI + k, M' = -(r' x n), N = n . t, Q = n . b with a
force n that is constant between loads and the curvature k at rest (Reissner 1972; the frame without shear).
Shooting from one end by the Runge-Kutta method of order 4 must meet what holds at the other; Newton's method
on the pseudo arc length of (unknowns, load) follows the curve. A limit load is that of the parabola through
three points. Printed for two numbers of steps and two distances. It needs NumPy.
"""

import math
import sys

import numpy as np


def go(state, length, count, force, ea, ei, curvature=0.0, shear=0.0):
    """Integrates x, y, theta, M along a beam."""

    def rates(s):
        c, sn = math.cos(s[2]), math.sin(s[2])
        stretch = 1.0 + (force[0] * c + force[1] * sn) / ea
        slide = shear * (-force[0] * sn + force[1] * c)
        dx, dy = stretch * c - slide * sn, stretch * sn + slide * c
        return [dx, dy, s[3] / ei + curvature, -(dx * force[1] - dy * force[0])]

    h = length / count
    for _ in range(count):
        k1 = rates(state)
        k2 = rates([a + 0.5 * h * b for a, b in zip(state, k1)])
        k3 = rates([a + 0.5 * h * b for a, b in zip(state, k2)])
        k4 = rates([a + h * b for a, b in zip(state, k3)])
        state = [a + h / 6 * (p + 2 * q + 2 * r + w) for a, p, q, r, w in zip(state, k1, k2, k3, k4)]
    return state


class Frame:
    """Frame of two legs of 1.2 m, EA = 43.2 MN, EI = 1440 N m^2 (E = 72 GPa, 3 cm by 2 cm).

    They are hinged at both far ends and joined at a right angle; a dead load P down, 24 cm from the corner:
    Lee, Manuel, Rossow 1968, "Large deflections and stability of elastic frames", J. Eng. Mech. Div.
    ASCE 94, 521. Loads in 10 kN.
    """

    LENGTH, LOADED, EA, EI = 1.2, 0.24, 7.2e10 * 6e-4, 7.2e10 * 2e-8
    start, last, radius = [0.0, 0.0, 0.5 * math.pi, 0.0], 2.6, 0.05

    def shoot(self, unknown, steps):
        rx, ry, angle, load = unknown[0] * 1e4, unknown[1] * 1e4, unknown[2], unknown[3] * 1e4
        n = (-rx, -ry)
        s = go([0.0, 0.0, angle, 0.0], self.LENGTH, steps, n, self.EA, self.EI)
        s[2] -= 0.5 * math.pi
        s = go(s, self.LOADED, max(steps // 5, 1), n, self.EA, self.EI)
        rest = self.LENGTH - self.LOADED
        s = go(s, rest, steps - steps // 5, (n[0], n[1] + load), self.EA, self.EI)
        return np.array([s[0] - self.LENGTH, s[1] - self.LENGTH, s[3] / self.EI])


class Arch:
    """Half of a circular arch of radius 1 m and half angle 0.3, 11 mm thick, of E = 1 MPa and 1 m wide.

    It is clamped at its foot; the crown moves up and down without turning, pressed by half of the load. Loads
    in newtons, of the half.
    """

    ANGLE, THICKNESS, YOUNG = 0.3, 0.011, 1e6
    start, last, radius = [0.0, 0.0, 0.0], 3.0, 0.02

    def shoot(self, unknown, steps):
        thrust, moment, load = unknown[0] * 20, unknown[1] * 0.1, unknown[2]
        ea, ei = self.YOUNG * self.THICKNESS, self.YOUNG * self.THICKNESS**3 / 12
        # G = E / 2, for Poisson's ratio is 0.
        start, force = [-math.sin(self.ANGLE), 0.0, self.ANGLE, moment], (-thrust, -load)
        s = go(start, self.ANGLE, steps, force, ea, ei, -1.0, 12.0 / (5.0 * ea))
        return np.array([s[0], s[2]])


def jacobian(shoot, unknown, steps):
    columns = []
    for i in range(len(unknown)):
        up, down = unknown.copy(), unknown.copy()
        up[i] += 1e-6
        down[i] -= 1e-6
        columns.append((shoot(up, steps) - shoot(down, steps)) / 2e-6)
    return np.array(columns).T


def tangent(matrix, before):
    t = np.linalg.svd(matrix)[2][-1]
    return t if t @ before > 0 else -t


def curve(problem, steps, radius):
    """Points of the path, the load the last of the unknowns."""
    point = np.array(problem.start)
    up = np.zeros(len(point))
    up[-1] = 1.0
    direction = tangent(jacobian(problem.shoot, point, steps), up)
    points = [point]
    while points[-1][-1] < problem.last and len(points) < 4000:
        guess = point + radius * direction
        for _ in range(30):
            misfit = np.append(problem.shoot(guess, steps), direction @ (guess - point) - radius)
            change = np.linalg.solve(np.vstack([jacobian(problem.shoot, guess, steps), direction]), -misfit)
            guess = guess + change
            if np.abs(change).max() < 1e-11:
                break
        else:
            sys.exit("the path was lost")
        direction = tangent(jacobian(problem.shoot, guess, steps), direction)
        point = guess
        points.append(point)
    return points


def main():
    problem = {"frame": Frame, "arch": Arch}[sys.argv[1]]()
    for steps, part in [(60, 1.0), (120, 0.5)]:
        points = curve(problem, steps, part * problem.radius)
        loads = [point[-1] for point in points]
        print(f"{steps} steps, distance {part * problem.radius}: {len(points)} points, to {loads[-1]:.6f}")
        for a, b, c in zip(loads, loads[1:], loads[2:]):
            if (b - a) * (c - b) < 0:
                bend, slope = 0.5 * (a + c) - b, 0.5 * (c - a)
                print(f"  limit load {b - slope * slope / (4 * bend):.6f}")


if __name__ == "__main__":
    main()
