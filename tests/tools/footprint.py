"""What each feature of a scene costs: ``footprint.py PLIANT [--write] [--svg]``.

Takes the lecture's cantilever with one change at a time, by a Python that has the package, and compares
memory, work in a step and the size of the recording with the table of ``docs/guide/evidence/footprint.md``.
Ends with 1 where they differ, or where a feature that is named and off costs memory.
``--write`` measures the times, too, and writes the table and the pictures; ``--svg`` draws the pictures of
the page's table.

Memory is what a simulation holds after its first step, as the C library counts it, which has to be glibc.
Versions of the library may differ by 5 %. A feature that is off may differ by 500 bytes: one number for each
vertex would be 640. Counts of work are exact, sizes of files to 1 %, times are not compared.
"""

from __future__ import annotations

import ctypes
import json
import os
import subprocess
import sys
import tempfile
import tomllib
from typing import Any

from evidence import BLUE, FOLDER, ORANGE, ROOT, TEXT, Pages, Svg, markdown

SCENE = "scenes/cantilever_fem_2d.toml"
PAGE = FOLDER / "footprint.md"
BASELINE = "the scene as it is"
IMPLICIT = ['time.integrator="implicit-euler"']
# Changes of the scene, and what their rows show.
FEATURES: dict[str, list[str]] = {
    BASELINE: [],
    "`velocity-verlet`": ['time.integrator="velocity-verlet"'],
    "`rk4`": ['time.integrator="rk4"'],
    "`ether_drag = 0.1`": ["world.ether_drag=0.1"],
    "a probe": ['probe=[{name="tip",at=[0.69,0.65]}]'],
    "a moving pin": ['body.0.pin.0.motion={displacement=["0","1e-3*sin(t)"]}'],
    "a traction": ["body.0.load=[{traction=[0,1]}]"],
    "springs on all edges": ["body.0.springs={stiffness=10}"],
    "damping by strain rate": ["body.0.damping={strain_rate={shear=1,second=1}}"],
    "contact, and no wall": ["contact={}", "world.walls=[]"],
    "quadrilaterals": ['body.0.mesh.grid.element="quadrilateral"'],
    "`order = 2`": ["body.0.order=2"],
    "the channel `von-mises`": ['output.channels=["state","mesh","energy","von-mises"]'],
    '`channels = ["state"]`': ['output.channels=["state"]'],
    "implicit Euler, matrix-free": [*IMPLICIT, 'time.solver={linear="matrix-free"}'],
    "implicit Euler": IMPLICIT,
}
# Features that are named and off.
OFF = [
    "world.ether_drag=0",
    "body.0.order=1",
    "body.0.load=[]",
    "body.0.muscle=[]",
    'body.0.stress="analytic"',
    "attachment=[]",
    "obstacle=[]",
    "probe=[]",
    "time.allow_unstable=false",
    'output.channels=["state","mesh","energy"]',
]


class Held(ctypes.Structure):
    """glibc's ``struct mallinfo2``."""

    NAMES = "arena, ordblks, smblks, hblks, hblkhd, usmblks, fsmblks, uordblks, fordblks, keepcost"
    _fields_ = [(name, ctypes.c_size_t) for name in NAMES.split(", ")]


def hold(changes: dict[str, Any]) -> None:
    """Prints the bytes that a simulation holds; in a process of its own, see ``held``."""
    import gc
    import warnings

    import pliant

    library = ctypes.CDLL(None)
    library.mallinfo2.restype = Held

    def used() -> int:
        info = library.mallinfo2()
        return info.uordblks + info.hblkhd

    def take(scene: pliant.Scene) -> int:
        before = used()
        simulation = pliant.Simulation(scene)
        simulation.step()
        return used() - before

    warnings.simplefilter("ignore")
    gc.disable()
    scene = pliant.Scene.from_toml(ROOT / SCENE)
    # What is made once in a process.
    take(scene)
    scene = scene.with_changes(changes)
    take(scene)
    # Blocks that are reused may be a few bytes larger than what is in them.
    print(min(take(scene) for _ in range(9)))


def held(changes: list[str]) -> int:
    values = {
        change.split("=", 1)[0]: tomllib.loads("v=" + change.split("=", 1)[1])["v"] for change in changes
    }
    # Without the library's cache of free blocks, which counts as held.
    alone = {"GLIBC_TUNABLES": "glibc.malloc.tcache_count=0", "RAYON_NUM_THREADS": "1"}
    command = [sys.executable, __file__, "--hold", json.dumps(values)]
    return int(
        subprocess.run(command, env={**os.environ, **alone}, check=True, stdout=subprocess.PIPE).stdout
    )


def ask(program: str, arguments: list[str], changes: list[str]) -> Any:
    """What a command prints as JSON about the scene with these changes."""
    sets = [word for change in changes for word in ("--set", change)]
    command = [program, arguments[0], str(ROOT / SCENE), "--json", "--quiet", *arguments[1:], *sets]
    ran = subprocess.run(command, check=False, capture_output=True, text=True)
    if ran.returncode:
        sys.exit(f"{' '.join(command)}\n{ran.stdout}{ran.stderr}")
    return json.loads(ran.stdout)


def number(value: float) -> str:
    """Three digits at most: ``0.0157``, ``3``, ``247``."""
    return f"{value:.3g}"


class Footprint:
    """What a scene takes: memory, and work and the size of the file once it has run."""

    def __init__(self, program: str, changes: list[str]) -> None:
        self.program, self.changes = program, changes
        self.predicted = ask(program, ["check"], changes)["memory"]["simulation"]
        self.held = held(changes)

    def cells(self) -> list[str]:
        with tempfile.TemporaryDirectory() as folder:
            run = ask(self.program, ["run", "--threads", "1", "-o", f"{folder}/run.mcap"], self.changes)
        summary = run["summary"]
        solver, steps = summary["solver"], summary["steps"]
        solves = (
            [number(solver[key] / steps) for key in ("newton_iterations", "factorizations")] if solver else []
        )
        return [
            f"{self.held / 1000:.1f}",
            f"{self.predicted / 1000:.1f}",
            number(summary["force_evaluations"] / steps),
            ", ".join(solves) or "-",
            f"{run['bytes'] / 1000:.0f}",
        ]


HEADER = [
    "one change",
    "memory",
    "`check`",
    "forces",
    "Newton, factors",
    "file",
    "time",
]


def times(program: str) -> dict[str, float]:
    """Microseconds of a step with each feature: the least of rounds in which all take turns."""
    arguments, least = ["run", "--no-record", "--threads", "1"], dict.fromkeys(FEATURES, float("inf"))
    for _ in range(20):
        for name, changes in FEATURES.items():
            summary = ask(program, arguments, changes)["summary"]
            least[name] = min(least[name], 1e6 / summary["steps_per_second"])
    return least


def rows_of_page() -> list[list[str]]:
    lines = PAGE.read_text().split("<!-- footprint -->")[1].split("<!-- end -->")[0].strip().splitlines()
    return [[cell.strip() for cell in line.split("|")[1:-1]] for line in lines[2:]]


def sentence(rows: list[list[str]]) -> str:
    memory = {row[0]: number(float(row[1])) for row in rows}
    return (
        f"The lecture's beam takes {memory[BASELINE]} kB with an explicit integrator, "
        f"{memory['implicit Euler']} kB with implicit Euler."
    )


def chart(rows: list[list[str]], *, small: bool) -> str:
    """Bars of memory: the scene as it is, and what a feature adds."""
    if small:
        chosen = [
            BASELINE,
            "`rk4`",
            "a probe",
            "contact, and no wall",
            "`order = 2`",
            "implicit Euler",
        ]
        rows = [row for row in rows if row[0] in chosen]
    names = {row[0]: row[0].replace("`", "").replace('"', "") for row in rows}
    names[BASELINE] = "as it is"
    left, width, pitch, top = (96, 250, 24, 40) if small else (200, 560, 23, 34)
    svg = Svg(width, 200 if small else top + pitch * len(rows) + 12, 11 if small else 13)
    svg.text(4, 14, "memory of the lecture's beam [kB]", font_weight="bold")
    most = max(float(row[1]) for row in rows)
    base = next(float(row[1]) for row in rows if row[0] == BASELINE)
    scale = (width - left - 46) / most
    for i, row in enumerate(rows):
        y, memory = top + i * pitch, float(row[1])
        svg.text(left - 6, y + 13, names[row[0]].split(", and")[0], "end")
        svg.box(left, y + 2, min(base, memory) * scale, pitch - 8, BLUE)
        svg.box(left + base * scale, y + 2, max(0, memory - base) * scale, pitch - 8, ORANGE)
        svg.text(left + memory * scale + 5, y + 13, row[1], fill=TEXT)
    return str(svg)


def close(a: str, b: str, part: float) -> bool:
    return abs(float(a) - float(b)) <= part * float(b)


def features_that_are_off_cost_nothing(program: str, pages: Pages) -> None:
    """Each alone and all together leave memory and work as they are."""
    baseline = Footprint(program, [])
    for changes in [*([change] for change in OFF), OFF]:
        named = Footprint(program, changes)
        if named.predicted != baseline.predicted or abs(named.held - baseline.held) > 500:
            memory = f"{named.held} and {named.predicted} bytes"
            pages.faults.append(f"{changes}: {memory}, without it {baseline.held} and {baseline.predicted}")
    if Footprint(program, OFF).cells()[1:4] != baseline.cells()[1:4]:
        pages.faults.append("features that are off change the work of a step")


def compare(program: str, pages: Pages) -> None:
    """Measures all rows, and compares the page with them or writes it."""
    rows = [[name, *Footprint(program, changes).cells()] for name, changes in FEATURES.items()]
    if pages.write:
        least = times(program)
        timed = [[*row, f"{least[row[0]]:.2g}"] for row in rows]
        pages.part(PAGE, "footprint", markdown(HEADER, "lrrrrrr", timed))
        return
    for row, said in zip(rows, rows_of_page(), strict=True):
        is_exact = [row[0], *row[2:5]] == [said[0], *said[2:5]]
        if not (is_exact and close(row[1], said[1], 0.05) and close(row[5], said[5], 0.01)):
            pages.faults.append(f"the page says {said}, measured {row}")


def main() -> None:
    pages, only_draw = Pages("--write" in sys.argv), "--svg" in sys.argv
    if not only_draw:
        features_that_are_off_cost_nothing(sys.argv[1], pages)
        compare(sys.argv[1], pages)
    pages.write = pages.write or only_draw
    rows = rows_of_page()
    pages.file(FOLDER / "footprint.svg", chart(rows, small=False))
    pages.file(FOLDER / "footprint-small.svg", chart(rows, small=True))
    for page in ("README.md", "docs/README.md"):
        pages.says(ROOT / page, sentence(rows))
    if not pages.faults and not only_draw:
        print(f"{len(rows)} rows as measured; {len(OFF)} features that are off cost nothing")
    pages.end()


if __name__ == "__main__":
    if sys.argv[1] == "--hold":
        hold(json.loads(sys.argv[2]))
    else:
        main()
