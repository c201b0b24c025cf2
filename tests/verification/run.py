"""What was compared with what: ``python tests/verification/run.py [--quick] [NAME...]``.

Runs every problem of the folder ``problems``, or those named, by the program ``pliant``, and prints what was
published beside what the program gives. Ends with 1 where a difference is more than the discretisation
explains. Needs Python 3.10 alone.

A run of all problems in full writes the page ``docs/guide/compared.md``. ``--quick`` leaves out what takes
longer than seconds, and ends with 1, too, where the page says other numbers.
"""

from __future__ import annotations

import argparse
import importlib
import re
import sys
import textwrap
import time
from pathlib import Path
from types import ModuleType

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]
PAGE = ROOT / "docs" / "guide" / "compared.md"
sys.path.insert(0, str(HERE))

from case import Pliant, Row  # noqa: E402

HEAD = ["quantity", "published", "by", "ours", "difference", "allowed", "mesh or step"]
Found = dict[str, tuple[ModuleType, list[Row]]]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("names", nargs="*", help="problems, by the names of their files")
    parser.add_argument("--quick", action="store_true", help="only what takes seconds")
    parser.add_argument("--program", type=Path, default=ROOT / "target" / "release" / "pliant")
    arguments = parser.parse_args()

    found: Found = {}
    all_names = sorted(path.stem for path in (HERE / "problems").glob("[a-z]*.py"))
    if unknown := [name for name in arguments.names if name not in all_names]:
        parser.error(f"no problem {', '.join(unknown)}; there are {', '.join(all_names)}")
    if not arguments.program.is_file():
        parser.error(f"no program {arguments.program}: `cargo build --release` makes it")
    for name in arguments.names or all_names:
        problem = importlib.import_module(f"problems.{name}")
        started = time.perf_counter()
        rows = list(problem.rows(Pliant(arguments.program.resolve()), arguments.quick))
        print(f"\n{problem.TITLE} ({name}, {time.perf_counter() - started:.1f} s)")
        show(rows)
        found[name] = (problem, rows)

    named = [(name, row) for name, (_, rows) in found.items() for row in rows]
    faults = [f"{name}: off: {row.quantity}, {row.mesh}" for name, row in named if not row.holds]
    if arguments.quick:
        page = PAGE.read_text().splitlines()
        faults += [f"{name}: not in {PAGE.name}: {line(row)}" for name, row in named if not stands(row, page)]
    elif not arguments.names and not faults:
        PAGE.write_text(written(found))
    if faults:
        sys.exit("\n" + "\n".join(faults))
    print(f"\n{len(named)} numbers hold")


def cells(row: Row) -> list[str]:
    """A row, as text."""
    unit = f" [{row.unit}]" if row.unit else ""
    numbers = [f"{row.published:.6g}", row.source, f"{row.ours:.6g}"]
    return [
        row.quantity + unit,
        *numbers,
        share(row.difference, row, "+"),
        share(row.within, row, ""),
        row.mesh,
    ]


def share(value: float, row: Row, sign: str) -> str:
    """A part of what was published, in percent unless it is small or zero was published."""
    if row.published == 0 or abs(value) < 5e-5:
        return f"{value:{sign}.0e}"
    return f"{100 * value:{sign}.2f} %" if sign else f"{100 * value:g} %"


def line(row: Row) -> str:
    return "| " + " | ".join(cells(row)) + " |"


def show(rows: list[Row]) -> None:
    lines = [HEAD, *map(cells, rows)]
    widths = [max(len(texts[i]) for texts in lines) for i in range(len(HEAD))]
    for texts, row in zip(lines, [None, *rows]):
        mark = "off" if row and not row.holds else "   "
        print(mark, "  ".join(text.ljust(width) for text, width in zip(texts, widths)).rstrip())


def stands(row: Row, page: list[str]) -> bool:
    """Whether the page has this row, but for the last digits of what was computed."""
    new = cells(row)
    for text in page:
        old = text.strip("| ").split(" | ")
        if len(old) == len(new) and all(old[i] == new[i] for i in (0, 1, 2, 5, 6)):
            # Where zero is published, rounding.
            within = 2e-5 * abs(row.ours) if row.published else row.within
            return abs(float(old[3]) - row.ours) <= within
    return False


def written(found: Found) -> str:
    """The page."""
    table = ["| problem | numbers | nearest to what is allowed |", "|---|---|---|"]
    parts = []
    for problem, rows in sorted(found.values(), key=lambda pair: pair[0].TITLE):
        anchor = re.sub(r"[^\w\- ]", "", problem.TITLE.lower()).replace(" ", "-")
        largest = cells(max(rows, key=lambda row: abs(row.difference) / row.within))
        table.append(f"| [{problem.TITLE}](#{anchor}) | {len(rows)} | {largest[4]} of {largest[5]} |")
        sources = [f"- {name}: {text}" for name, text in problem.SOURCES.items()]
        lines = [
            *(f"## {problem.TITLE}", problem.__doc__.strip(), ""),
            *("| " + " | ".join(HEAD) + " |", "|" + "---|" * len(HEAD)),
            *map(line, rows),
            "",
            *(
                textwrap.fill(source, 108, subsequent_indent="  ", break_on_hyphens=False)
                for source in sources
            ),
        ]
        parts.append("\n".join(lines))
    page = (HERE / "page.md").read_text()
    counts = {"counts": sum(len(rows) for _, rows in found.values()), "problems": len(found)}
    return page.format(**counts, table="\n".join(table)) + "\n\n".join(parts) + "\n"


if __name__ == "__main__":
    main()
