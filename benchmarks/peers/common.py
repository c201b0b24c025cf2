"""What the comparisons share: how cases are timed, and how tables are printed.

Imported before NumPy and the programs, for it sets the number of threads to one.
"""

from __future__ import annotations

import os

for name in ("OMP", "OPENBLAS", "MKL", "NUMEXPR", "RAYON"):
    os.environ[f"{name}_NUM_THREADS"] = "1"

import platform
import statistics
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

ROUNDS = 5
"""How often each case is timed, after one run that is not; ``PEERS_ROUNDS`` changes it."""


@dataclass
class Case:
    """A program at one setting.

    ``prepare`` makes everything up to the first step and returns two functions: what is timed, and what
    gives the answer afterwards, as an array. A case that is ``aside`` is not in the table of what is soonest;
    ``work`` says what it took beside time.
    """

    program: str
    settings: str
    prepare: Callable[[], tuple[Callable[[], object], Callable[[], np.ndarray]]]
    aside: bool = False
    work: str = ""
    error: float = np.nan
    answer: np.ndarray | None = None
    failed: str = ""
    seconds: list[float] = field(default_factory=list)
    wall: list[float] = field(default_factory=list)

    def run(self) -> None:
        """Once, timed; a case that failed is not run again.

        The time is that of the processor, over all threads of this process: other programs that run beside,
        as on a shared machine, add nothing to it. With one thread and an idle machine it is the wall time.
        """
        if self.failed:
            return
        try:
            work, answer = self.prepare()
            start, used = time.perf_counter(), time.process_time()
            work()
            self.seconds.append(time.process_time() - used)
            self.wall.append(time.perf_counter() - start)
            self.answer = answer()
        except Exception as error:  # noqa: BLE001
            self.failed = (str(error).strip().splitlines() or [type(error).__name__])[0]

    @property
    def median(self) -> float:
        """Of the processor times."""
        return statistics.median(self.seconds)


def measure(cases: Sequence[Case], error: Callable[[Case], float], largest: float = 0.5) -> None:
    """Run all cases in turn, and again, so that a slow spell of the machine meets all of them.

    The first round is not timed: it compiles, fills caches, and shows which cases fail. ``error`` is of a
    case that has run. One above ``largest`` counts as failed.
    """
    for case in cases:
        case.run()
        if not case.failed:
            case.error = error(case)
            if not case.error <= largest:
                case.failed = f"wrong by {case.error:.1g}"
        case.seconds.clear()
        case.wall.clear()
    for _ in range(int(os.environ.get("PEERS_ROUNDS", ROUNDS))):
        for case in cases:
            case.run()


def digits(value: float) -> str:
    """Three digits, without an exponent where that is short."""
    return (
        f"{value:.3g}" if 0.01 <= value < 1000 else f"{value:.0f}" if 1000 <= value < 1e6 else f"{value:.2e}"
    )


def table(title: str, cases: Sequence[Case]) -> None:
    """Print all cases: error, median and spread of the processor times, median of the wall times."""
    print(f"\n### {title}: every setting\n")
    counted = any(case.work for case in cases)
    print(
        "| program | settings | error | median [ms] | least to most [ms] | wall [ms] |" + " work |" * counted
    )
    print("|---|---|--:|--:|--:|--:|" + "---|" * counted)
    for case in cases:
        if case.failed:
            print(f"| {case.program} | {case.settings} | {case.failed} | - | - | - |" + " |" * counted)
            continue
        times = [1e3 * value for value in case.seconds]
        spread = f"{digits(min(times))} to {digits(max(times))}"
        median = digits(1e3 * case.median)
        wall = digits(1e3 * statistics.median(case.wall))
        row = f"| {case.program} | {case.settings} | {case.error:.1e} | {median} | {spread} | {wall} |"
        print(row + f" {case.work} |" * counted)


def fastest(title: str, cases: Sequence[Case], targets: Sequence[float]) -> None:
    """Print for each error what reaches it soonest, by program; who is faster is said first."""
    programs = list(dict.fromkeys(case.program for case in cases))
    peers = [name for name in programs if name != "pliant"]
    print(f"\n### {title}: soonest to an error\n")
    print("| error at most | first | by a factor | " + " | ".join([*peers, "pliant"]) + " |")
    print("|--:|---|--:|" + "---|" * len(programs))
    for target in targets:
        best: dict[str, Case] = {}
        for case in cases:
            if case.failed or case.aside or case.error > target:
                continue
            if case.program not in best or case.median < best[case.program].median:
                best[case.program] = case
        if not best:
            continue
        order = sorted(best.values(), key=lambda case: case.median)
        # Where the median of one is in the spread of the other, they are not told apart.
        first, factor = order[0].program, "alone"
        if len(order) > 1:
            factor = digits(order[1].median / order[0].median)
            if min(order[1].seconds) <= order[0].median or order[1].median <= max(order[0].seconds):
                first = f"{order[0].program}, within the spread"
        cells = []
        for name in [*peers, "pliant"]:
            case = best.get(name)
            cells.append(f"{digits(1e3 * case.median)} ms, {case.settings}" if case else "not reached")
        print(f"| {target:.0e} | {first} | {factor} | " + " | ".join(cells) + " |")


def report(title: str, cases: Sequence[Case], targets: Sequence[float]) -> None:
    """Both tables. A program of which no case ran is set up wrongly, and has not lost."""
    for program in {case.program for case in cases}:
        if all(case.failed for case in cases if case.program == program):
            reasons = {case.failed for case in cases if case.program == program}
            raise SystemExit(f"{title}: no case of {program} ran: {'; '.join(sorted(reasons))}")
    fastest(title, cases, targets)
    table(title, cases)
    sys.stdout.flush()


def processor() -> str:
    """The name of the processor, as lscpu has it."""
    try:
        with open("/proc/cpuinfo") as file:
            for line in file:
                if line.startswith("model name"):
                    return line.split(":", 1)[1].strip()
    except OSError:
        pass
    return platform.processor() or platform.machine()
