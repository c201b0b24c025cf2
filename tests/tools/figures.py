"""Figures of the guide that explain: ``figures.py [--write]``, by a Python that has the package.

What they show is computed: contact laws and amplification factors from their formulas, selections, the
equilibrium path and the environments by the package, from the snippets of the pages that show them. Ends with
1 where a picture of ``docs/guide/pictures`` has something else; ``--write`` writes them.
"""

from __future__ import annotations

import cmath
import math
import re
import sys
import tempfile
import tomllib
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pliant
from evidence import BLUE, FAINT, ORANGE, ROOT, TEXT, Pages, Svg

FOLDER = ROOT / "docs" / "guide" / "pictures"
# Bytes of a picture.
LARGEST = 40_000
Point = tuple[float, float]


class Figure(Svg):
    """A picture with arrows and areas, whose text has 13 pixels at a width of 750."""

    def __init__(self, height: float) -> None:
        super().__init__(750, height, 13)

    def area(self, points: list[Point], fill: str, opacity: float, stroke: str = "none") -> None:
        path = "L".join(f"{x:.1f} {y:.1f}" for x, y in points)
        self.parts.append(f'<path d="M{path}Z" fill="{fill}" fill-opacity="{opacity}" stroke="{stroke}"/>')

    def lines(self, parts: list[tuple[Point, Point]], stroke: str, width: float) -> None:
        path = "".join(f"M{a:.0f} {b:.0f}L{c:.0f} {d:.0f}" for (a, b), (c, d) in parts)
        self.parts.append(f'<path d="{path}" fill="none" stroke="{stroke}" stroke-width="{width}"/>')

    def arrow(self, points: list[Point], color: str, width: float = 1.5, dash: str = "") -> None:
        """A line with a head at its last point, as long as the last part has room for."""
        (x0, y0), (x1, y1) = points[-2:]
        length = math.hypot(x1 - x0, y1 - y0)
        size = min(5 + 2 * width, length)
        a, b = (x1 - x0) / length * size, (y1 - y0) / length * size
        self.line([*points[:-1], (x1 - 0.8 * a, y1 - 0.8 * b)], color, width, dash)
        self.area(
            [(x1, y1), (x1 - a - b / 2.5, y1 - b + a / 2.5), (x1 - a + b / 2.5, y1 - b - a / 2.5)], color, 1
        )

    def ring(self, x: float, y: float, radius: float, stroke: str) -> None:
        self.parts.append(
            f'<circle cx="{x:.1f}" cy="{y:.1f}" r="{radius}" fill="none" stroke="{stroke}" stroke-width="2"/>'
        )


class Axes:
    """A frame in a figure, and the places of values in it."""

    def __init__(self, figure: Figure, box: tuple[float, float, float, float], x: Point, y: Point) -> None:
        self.figure, (self.left, self.top, self.right, self.bottom) = figure, box
        self.span, self.rise, self.log = x, y, False

    def at(self, x: float, y: float) -> Point:
        a, b = (math.log(v) for v in self.span) if self.log else self.span
        part = ((math.log(x) if self.log else x) - a) / (b - a)
        low, high = self.rise
        up = (y - low) / (high - low)
        return self.left + part * (self.right - self.left), self.bottom - up * (self.bottom - self.top)

    def frame(self, xs: list[float], ys: list[float], x_title: str, y_title: str) -> None:
        figure = self.figure
        for y in ys:
            right, level = self.at(self.span[1], y)
            figure.line([(self.left, level), (right, level)], FAINT, 0.4)
            figure.text(self.left - 7, level + 4.5, f"{y:g}".replace("-", "\u2212"), "end")
        for x in xs:
            place = self.at(x, self.rise[0])[0]
            figure.line([(place, self.bottom), (place, self.bottom + 5)], TEXT)
            figure.text(place, self.bottom + 20, f"{x:g}".replace("-", "\u2212"), "middle")
        figure.line([(self.left, self.top), (self.left, self.bottom), (self.right, self.bottom)], TEXT)
        figure.text(self.right, self.bottom + 38, x_title, "end")
        figure.text(self.left - 30, self.top - 12, y_title)

    def curve(self, f: Callable[[float], float], stroke: str, width: float = 2, dash: str = "") -> None:
        """The graph of a function as far as it is in the frame."""
        low, high = self.rise
        n = 240
        a, b = (math.log(v) for v in self.span) if self.log else self.span
        values = [a + (b - a) * i / n for i in range(n + 1)]
        part: list[Point] = []
        for x in [math.exp(v) for v in values] if self.log else values:
            y = f(x)
            if low <= y <= high:
                part.append(self.at(x, y))
            elif part:
                part.append(self.at(x, min(max(y, low), high)))
                break
        self.figure.line(part, stroke, width, dash)


def block(page: str, fence: str) -> str:
    """The code of a page below this line."""
    text = (ROOT / "docs" / "guide" / page).read_text()
    found = re.search(rf"^```{re.escape(fence)}\n(.*?)^```$", text, re.DOTALL | re.MULTILINE)
    if found is None:
        sys.exit(f"{page} has no block {fence}")
    return found[1]


# Contact laws as functions of the gap in activation distances, for surfaces without a radius: pressures over
# the stiffness `kappa`.


def barrier(gap: float) -> float:
    if gap >= 1:
        return 0.0
    if gap <= 0:
        return math.inf
    q = gap**2
    return (2 * (q - 1) * math.log(q) + (q - 1) ** 2 / q) * 2 * gap


def penalty(gap: float) -> float:
    return 2 * max(1 - gap, 0.0) ** 2


def contact_law() -> str:
    figure = Figure(340)
    axes = Axes(figure, (60, 40, 735, 285), (-0.4, 1.4), (0, 5))
    left, right = axes.at(-0.4, 0)[0], axes.at(0, 0)[0]
    figure.box(left, axes.top, right - left, axes.bottom - axes.top, ORANGE, 0.1)
    axes.frame(
        [-0.4, -0.2, 0, 0.2, 0.4, 0.6, 0.8, 1, 1.2, 1.4], [0, 1, 2, 3, 4, 5], "gap / dhat", "pressure / kappa"
    )
    axes.curve(penalty, BLUE)
    # The curve of the barrier begins where it comes into the frame.
    inside = next(gap / 1000 for gap in range(1, 1000) if barrier(gap / 1000) <= 5)
    axes.figure.line([axes.at(gap, barrier(gap)) for gap in steps(inside, 1.4, 120)], ORANGE, 2)
    figure.text(left + 8, axes.top + 16, "surfaces overlap")
    x, y = axes.at(inside, 5)
    figure.text(x + 14, y + 14, "barrier of implicit steps:", fill=ORANGE)
    figure.text(x + 22, y + 32, "no bound as the gap closes", fill=ORANGE)
    x, y = axes.at(0.02, penalty(0))
    figure.text(x, y - 32, "penalty of explicit steps:", fill=BLUE)
    figure.text(x, y - 14, "bounded, fast bodies overlap", fill=BLUE)
    for pressure, name in ((0.1, "kappa / 10"), (1.0, "kappa")):
        gap = barrier_gap(pressure)
        at = axes.at(gap, barrier(gap))
        figure.dot(*at, 4.5, ORANGE)
        figure.text(at[0] + 8, at[1] - 7, f"{gap:.2f} dhat at {name}")
    return str(figure)


def steps(first: float, last: float, n: int) -> list[float]:
    return [first + (last - first) * i / n for i in range(n + 1)]


def contact_gap() -> str:
    """A body at three gaps above a floor, with the force of the barrier."""
    figure = Figure(225)
    floor, distance, width = 160.0, 60.0, 170.0
    states = [(1.4, "farther than distance"), (barrier_gap(0.1), "resting"), (0.7, "pressed")]
    for number, (gap, name) in enumerate(states):
        x, bottom = 60 + 240 * number, floor - gap * distance
        figure.box(x - 20, floor - distance, width + 40, distance, ORANGE, 0.12)
        figure.box(x - 20, floor, width + 40, 12, FAINT, 0.5)
        figure.line([(x - 20, floor), (x + width + 20, floor)], TEXT, 2)
        top = bottom - 62
        figure.area([(x, top), (x + width, top), (x + width, bottom), (x, bottom)], BLUE, 0.08, BLUE)
        pressure = barrier(gap)
        figure.text(x + width / 2, top + 18, name, "middle", font_weight="bold")
        text = f"pressure {pressure:.2g} kappa" if pressure else "no force"
        figure.text(x + width / 2, top + 36, text, "middle")
        for part in (0.2, 0.4, 0.6, 0.8) if pressure else ():
            foot, tip = bottom, bottom - 8 - 8 * min(pressure, 2)
            figure.arrow([(x + part * width, foot), (x + part * width, tip)], ORANGE, 2)
        figure.arrow([(x + width + 10, (floor + bottom) / 2), (x + width + 10, bottom)], TEXT, 1)
        figure.arrow([(x + width + 10, (floor + bottom) / 2), (x + width + 10, floor)], TEXT, 1)
        figure.text(x + width / 2, floor + 34, f"gap {gap:.2f} distance", "middle")
    figure.text(10, 215, "orange band: the activation distance, distance in a scene, dhat in formulas")
    return str(figure)


def barrier_gap(pressure: float) -> float:
    """The gap at which the barrier has this pressure."""
    low, high = 1e-6, 1.0
    for _ in range(60):
        middle = (low + high) / 2
        low, high = (middle, high) if barrier(middle) > pressure else (low, middle)
    return low


# Selections.

BEAM = {"tapered_beam": {"cells": [10, 3], "length": 1.0, "heights": [0.24, 0.24]}}
SELECTIONS: list[tuple[str, dict[str, Any]]] = [
    ("vertices = [0, 5, 42]", {"vertices": [0, 5, 42]}),
    ("box = { min = [0.35, 0], max = [0.65, 0.2] }", {"box": {"min": [0.35, 0], "max": [0.65, 0.2]}}),
    ("half_space = { normal = [1, 0], offset = 0.2 }", {"half_space": {"normal": [1, 0], "offset": 0.2}}),
    ('group = "right"', {"group": "right"}),
]


def selected(selection: dict[str, Any]) -> tuple[Any, Any, list[bool]]:
    """Vertices and triangles of the beam, and which vertices a pin holds while the others fall."""
    body = {
        "mesh": BEAM,
        "elastic": {"neo-hookean": {"young": 1e5, "poisson": 0.3}},
        "mass": {"density": 1000},
        "pin": [selection],
    }
    time = {"integrator": "symplectic-euler", "step": 1e-4, "duration": 1.0}
    simulation = pliant.Simulation(
        pliant.Scene(dimension=2, time=time, world={"gravity": [0, -9.81]}, body=[body])
    )
    simulation.step(3)
    rest = simulation.rest_positions
    held = [bool((a == b).all()) for a, b in zip(rest, simulation.positions, strict=True)]
    return rest, simulation.bodies[0]["triangles"], held


def selection() -> str:
    figure = Figure(345)
    scale = 310.0
    for number, (text, chosen) in enumerate(SELECTIONS):
        x0, y0 = 30 + 370 * (number % 2), 95 + 165 * (number // 2)
        rest, triangles, held = selected(chosen)
        at = [(x0 + scale * x, y0 - scale * y) for x, y in rest]
        if "box" in chosen:
            (a, b), (c, d) = chosen["box"]["min"], chosen["box"]["max"]
            figure.box(x0 + scale * a, y0 - scale * d, scale * (c - a), scale * (d - b), ORANGE, 0.2)
        if "half_space" in chosen:
            edge = chosen["half_space"]["offset"]
            figure.box(x0 - 18, y0 - 55, 18 + scale * edge, 110, ORANGE, 0.2)
            figure.arrow([(x0 + scale * edge, y0 - 46), (x0 + scale * edge + 26, y0 - 46)], ORANGE, 2)
            figure.text(x0 + scale * edge + 32, y0 - 42, "normal", fill=ORANGE)
        edges = {(min(t[i], t[i - 1]), max(t[i], t[i - 1])) for t in triangles for i in range(3)}
        figure.lines([(at[a], at[b]) for a, b in sorted(edges)], FAINT, 0.8)
        for index, place in enumerate(at):
            if held[index]:
                figure.dot(*place, 5, ORANGE)
                if "vertices" in chosen:
                    above = -9 if rest[index][1] > 0 else 20
                    figure.text(place[0], place[1] + above, str(index), "middle", font_weight="bold")
        figure.text(x0 - 2, y0 - 68, text, font_family="monospace", font_size=12)
    figure.text(28, 338, "orange vertices are pinned; positions are those of the reference configuration")
    return str(figure)


# Integrators.


# An amplification matrix is a function of [[0, z], [-z, 0]], whose eigenvalues are i z and -i z. Its spectral
# radius is the absolute value of that function at i z.


def verlet(z: float) -> float:
    """Spectral radius of [[1 - z^2/2, z], [z^3/4 - z, 1 - z^2/2]], whose determinant is 1."""
    half = 1 - z**2 / 2
    return max(abs(half + sign * cmath.sqrt(half**2 - 1)) for sign in (1, -1))


def tr_bdf2(z: float) -> float:
    w, g = 1j * z, 2 - math.sqrt(2)
    first = (1 + g * w / 2) / (1 - g * w / 2)
    second = (first - (1 - g) ** 2) / (g * (2 - g)) / (1 - (1 - g) / (2 - g) * w)
    return abs(second)


FACTORS: dict[str, Callable[[float], float]] = {
    "forward-euler": lambda z: abs(1 + 1j * z),
    "rk4": lambda z: abs(sum((1j * z) ** k / math.factorial(k) for k in range(5))),
    "velocity-verlet": verlet,
    "implicit-midpoint": lambda z: abs((1 + 0.5j * z) / (1 - 0.5j * z)),
    "implicit-euler": lambda z: 1 / abs(1 - 1j * z),
    "tr-bdf2": tr_bdf2,
}


def amplification() -> str:
    # A closed form that is not the program's integrator ends it.
    for name, factor in FACTORS.items():
        for z in (0.1, 1.0, 1.9):
            if abs(factor(z) - measured(name, z)) > 1e-9:
                sys.exit(f"{name} at z = {z}: {factor(z)} here, {measured(name, z)} by the program")
    figure = Figure(370)
    axes = Axes(figure, (50, 40, 735, 315), (0.1, 50), (0, 1.5))
    axes.log = True
    x, y = axes.at(0.1, 1)
    figure.box(x, axes.top, axes.right - x, y - axes.top, ORANGE, 0.08)
    axes.frame(
        [0.1, 0.3, 1, 2, 3, 10, 30],
        [0, 0.5, 1, 1.5],
        "z = step times angular frequency",
        "amplitude, factor in a step",
    )
    styles = {"rk4": "6 3", "velocity-verlet": "2 3", "implicit-midpoint": "2 3", "tr-bdf2": "6 3"}
    for name, factor in FACTORS.items():
        explicit = name in ("forward-euler", "rk4", "velocity-verlet")
        axes.curve(factor, BLUE if explicit else ORANGE, 2.5, styles.get(name, ""))
    labels: list[tuple[str, float, float, str, str]] = [
        ("forward-euler", 0.78, 1.32, "end", BLUE),
        ("dotted: velocity-verlet, 1 up to z = 2", 3.4, 1.38, "start", BLUE),
        ("dashed: rk4, below 1 up to z = 2.83", 3.4, 1.26, "start", BLUE),
        ("implicit-midpoint: 1 at any z", 49, 1.04, "end", ORANGE),
        ("implicit-euler", 0.75, 0.62, "end", ORANGE),
        ("tr-bdf2", 8.5, 0.55, "start", ORANGE),
    ]
    for text, z, level, anchor, color in labels:
        figure.text(*axes.at(z, level), text, anchor, fill=color)
    figure.text(axes.left + 10, axes.top + 16, "above 1: grows")
    figure.text(axes.left + 10, axes.bottom - 12, "below 1: numerical damping")
    return str(figure)


def measured(name: str, z: float) -> float:
    """The factor of the program, as docs/guide/theory/schemes.md takes it."""
    names: dict[str, Any] = {}
    code = block("theory/schemes.md", "python")
    exec(code[: code.index("\nfor integrator in")], names)  # noqa: S102
    return float(names["amplification"](name, z))


# Arc length.


def arc_length() -> str:
    """The equilibrium path of the roof of docs/guide/how-to/statics.md, its run and its closed form."""
    text = block("how-to/statics.md", "toml roof.toml")
    with tempfile.TemporaryDirectory() as folder:
        record = Path(folder) / "roof.mcap"
        pliant.Simulation(pliant.Scene(**tomllib.loads(text))).run(record=record)
        run = pliant.load(record)
        factors, ridge = run.energy["load_factor"], run.positions[:][:, 1, 1]
    height, stiffness, load = 0.3, 1000.0, 10.0
    length = math.hypot(1, height)

    def factor(y: float) -> float:
        bar = math.hypot(1, y)
        return 2 * stiffness * (length - bar) * y / bar / load

    wrong = max(abs(factor(y) - f) for y, f in zip(ridge, factors, strict=True))
    if wrong > 1e-9:
        sys.exit(f"the run is {wrong} off the closed form")

    figure = Figure(390)
    axes = Axes(figure, (55, 40, 735, 335), (0, 0.7), (-1.5, 2))
    axes.frame([0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7], [-1, 0, 1, 2], "ridge displacement [m]", "load factor")
    path = [axes.at(height - y, factor(y)) for y in steps(height, float(min(ridge)), 200)]
    figure.line(path, BLUE, 2)
    limits = [
        root(lambda y: factor(y + 1e-6) - factor(y - 1e-6), low, high)
        for low, high in ((0.05, 0.3), (-0.3, -0.05))
    ]
    # Beyond the first limit point load steps find the equilibrium on the other side, of the same load.
    far = root(lambda y: factor(y) - factor(limits[0]), -0.6, -0.3)
    start, end = axes.at(height - limits[0], factor(limits[0])), axes.at(height - far, factor(far))
    figure.arrow([start, (end[0] - 6, end[1])], ORANGE, 1.5, "5 4")
    figure.text(
        (start[0] + end[0]) / 2,
        start[1] - 8,
        "load steps jump, or find no equilibrium",
        "middle",
        fill=ORANGE,
    )
    for y, f in zip(ridge, factors, strict=True):
        figure.dot(*axes.at(height - y, f), 3.5, BLUE)
    for y, down in zip(limits, (-30, 34), strict=True):
        x, level = axes.at(height - y, factor(y))
        figure.ring(x, level, 8, ORANGE)
        figure.text(
            x, level + down, f"limit point, load factor {factor(y):.4f}".replace("-", "\u2212"), "middle"
        )
    shapes = [(height, 110, 285, "at the start"), (0.0, 400, 150, "flat, no load")]
    for y, x, level, name in [*shapes, (float(min(ridge)), 560, 150, "snapped through")]:
        feet, top = [(x - 45, level), (x + 45, level)], (x, level - 45 * y)
        figure.line([feet[0], top, feet[1]], TEXT, 2)
        figure.dot(*feet[0], 3, TEXT)
        figure.dot(*feet[1], 3, TEXT)
        figure.dot(*top, 4, BLUE)
        figure.text(x, level + (38 if y < 0 else 20), name, "middle")
    figure.text(axes.left + 8, axes.bottom - 8, "dots: steps of the run; line: closed form")
    return str(figure)


def root(f: Callable[[float], float], low: float, high: float) -> float:
    """Where a function that has two signs at the ends is zero."""
    for _ in range(80):
        middle = (low + high) / 2
        low, high = (middle, high) if (f(middle) > 0) == (f(low) > 0) else (low, middle)
    return (low + high) / 2


# Environments.


def environments() -> str:
    """The loop of docs/guide/how-to/environments.md, with the shapes and some beams of its first block."""
    names: dict[str, Any] = {"print": lambda *_: None}
    exec(block("how-to/environments.md", "python"), names)  # noqa: S102
    env = names["env"]
    env.reset(seed=1)
    import numpy as np

    actions = np.linspace(-40, 40, env.num_envs)[:, None]
    for _ in range(12):
        observations, rewards, terminated, *_ = env.step(actions)
    figure = Figure(300)
    top, bottom = 40.0, 215.0

    def card(x: float, width: float, title: str, lines: list[str]) -> None:
        figure.area([(x, top), (x + width, top), (x + width, bottom), (x, bottom)], BLUE, 0.05, BLUE)
        figure.text(x + width / 2, top + 22, title, "middle", font_weight="bold")
        for number, line in enumerate(lines):
            figure.text(x + width / 2, top + 44 + 18 * number, line, "middle")

    card(10, 150, "policy", ["yours: a network,", "a search, a formula"])
    millis = 1e3 * env.simulation(0).step_size * 20
    card(
        270,
        235,
        "env.step(actions)",
        [f"{env.num_envs} copies, 20 steps each", f"= {millis:g} ms, on all cores"],
    )
    card(665, 80, "reset", ["start,", "seed"])
    triangles = [tuple(int(i) for i in t) for t in env.simulation(0).bodies[0]["triangles"]]
    edges = [edge for t in triangles for edge in ((t[0], t[1]), (t[1], t[2]), (t[2], t[0]))]
    follows = {a: b for a, b in edges if (b, a) not in edges}
    outline = [min(follows)]
    while len(outline) < len(follows):
        outline.append(follows[outline[-1]])
    for number in range(4):
        x0, y0 = 300 + 100 * (number % 2), 150 + 45 * (number // 2)
        positions = env.positions[number * 5]
        at = [(x0 + 180 * x, y0 - 180 * y) for x, y in positions]
        figure.area([at[i] for i in outline], BLUE, 0.6)
    figure.arrow([(160, 75), (270, 75)], ORANGE, 2)
    figure.text(215, 66, f"actions {actions.shape}", "middle")
    loop = [(387, bottom), (387, 262), (85, 262), (85, bottom)]
    figure.arrow(loop, ORANGE, 2)
    figure.text(100, 254, f"observations {observations.shape}, rewards {rewards.shape}")
    figure.arrow([(505, 75), (665, 75)], ORANGE, 2)
    figure.text(585, 66, "episode ends", "middle")
    for number, line in enumerate(["terminated: your test,", "or a failed step", "truncated: max_steps"]):
        figure.text(585, 98 + 18 * number, line, "middle")
    figure.arrow([(665, 185), (505, 185)], ORANGE, 2)
    figure.text(585, 204, "autoreset", "middle")
    figure.text(100, 284, f"terminated {terminated.shape}, truncated {terminated.shape}, info")
    return str(figure)


FIGURES: dict[str, Callable[[], str]] = {
    "contact-law": contact_law,
    "contact-gap": contact_gap,
    "selection": selection,
    "amplification": amplification,
    "arc-length": arc_length,
    "environments": environments,
}


def main() -> None:
    warnings.simplefilter("ignore")
    pages = Pages("--write" in sys.argv)
    for name, figure in FIGURES.items():
        text = figure()
        if len(text) > LARGEST:
            pages.faults.append(f"{name} has {len(text)} bytes of at most {LARGEST}")
        pages.file(FOLDER / f"{name}.svg", text)
    pages.end()


if __name__ == "__main__":
    main()
