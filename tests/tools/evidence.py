"""Tables and pictures of docs/guide/evidence, and the numbers of README: ``evidence.py [--write]``.

They are drawn from ``docs/accuracy/rows.csv`` and ``docs/stress.md``. Ends with 1 where a page or a picture
has something else; ``--write`` writes them. ``footprint.py`` measures the third page.
"""

from __future__ import annotations

import csv
import math
import re
import sys
from collections import Counter
from pathlib import Path
from typing import Any
from xml.sax.saxutils import escape

ROOT = Path(__file__).resolve().parents[2]
FOLDER = ROOT / "docs" / "guide" / "evidence"
Row = dict[str, str]

# Legible on a light and on a dark page, since an image does not know the page's colours.
TEXT, FAINT, BLUE, ORANGE = "#777777", "#a0a0a0", "#2f81c7", "#d2691e"
GREEN_CELL, BLUE_CELL, ORANGE_CELL, INK = "#b9dfcb", "#b5c9ea", "#f2c063", "#222222"


class Svg:
    """A picture of lines, boxes and text without a background."""

    def __init__(self, width: float, height: float, size: float = 12) -> None:
        self.width, self.height, self.size, self.parts = width, height, size, list[str]()

    def box(self, x: float, y: float, width: float, height: float, fill: str, opacity: float = 1) -> None:
        faint = f' fill-opacity="{opacity}"' if opacity < 1 else ""
        self.parts.append(
            f'<rect x="{x:.1f}" y="{y:.1f}" width="{width:.1f}" height="{height:.1f}" fill="{fill}"{faint}/>'
        )

    def line(self, points: list[tuple[float, float]], stroke: str, width: float = 1, dash: str = "") -> None:
        dashed = f' stroke-dasharray="{dash}"' if dash else ""
        path = "L".join(f"{x:.1f} {y:.1f}" for x, y in points)
        self.parts.append(f'<path d="M{path}" fill="none" stroke="{stroke}" stroke-width="{width}"{dashed}/>')

    def dot(self, x: float, y: float, radius: float, fill: str) -> None:
        self.parts.append(f'<circle cx="{x:.1f}" cy="{y:.1f}" r="{radius}" fill="{fill}"/>')

    def text(self, x: float, y: float, text: str, anchor: str = "start", **style: Any) -> None:
        words = "".join(f' {key.replace("_", "-")}="{value}"' for key, value in style.items())
        ends = "" if anchor == "start" else f' text-anchor="{anchor}"'
        self.parts.append(f'<text x="{x:.1f}" y="{y:.1f}"{ends}{words}>{escape(text)}</text>')

    def __str__(self) -> str:
        head = (
            f'<svg xmlns="http://www.w3.org/2000/svg" width="{self.width:g}" height="{self.height:g}" '
            f'viewBox="0 0 {self.width:g} {self.height:g}" font-family="sans-serif" '
            f'font-size="{self.size:g}" fill="{TEXT}">'
        )
        return "\n".join([head, *self.parts, "</svg>", ""])


def markdown(header: list[str], align: str, rows: list[list[str]]) -> str:
    """A table; ``align`` has ``l`` or ``r`` for each column."""
    rules = ["---" if side == "l" else "--:" for side in align]
    lines = [f"| {' | '.join(cells)} |" for cells in [header, *rows]]
    return "\n".join([lines[0], f"|{'|'.join(rules)}|", *lines[1:]])


def short(seconds: float) -> str:
    """``2.86 ms``: three digits and a prefix."""
    scale, unit = next((s, u) for s, u in ((1, "s"), (1e-3, "ms"), (1e-6, "us")) if seconds >= s or s == 1e-6)
    return f"{three_digits(seconds / scale)} {unit}"


def three_digits(value: float) -> str:
    return f"{value:#.3g}".removesuffix(".")


class Pages:
    """Compares pages and pictures with what they have to be, or writes them."""

    def __init__(self, write: bool) -> None:
        self.write, self.faults = write, list[str]()

    def file(self, path: Path, text: str) -> None:
        if self.write:
            path.write_text(text)
        elif not path.exists() or path.read_text() != text:
            self.faults.append(f"{path.relative_to(ROOT)} is not what would be written")

    def part(self, path: Path, name: str, text: str) -> None:
        """The lines of ``path`` between ``<!-- name -->`` and ``<!-- end -->``."""
        old = path.read_text()
        pattern = re.compile(rf"(<!-- {name} -->\n).*?(<!-- end -->)", re.DOTALL)
        if not pattern.search(old):
            self.faults.append(f"{path.relative_to(ROOT)} has no part `{name}`")
            return
        self.file(path, pattern.sub(lambda marks: f"{marks[1]}{text}\n{marks[2]}", old))

    def says(self, path: Path, *sentences: str) -> None:
        """``path`` has these sentences, wherever its lines break."""
        text = " ".join(path.read_text().split())
        missing = [sentence for sentence in sentences if sentence not in text]
        self.faults += [f"{path.relative_to(ROOT)} has to say: {sentence}" for sentence in missing]

    def end(self) -> None:
        sys.exit("\n".join(self.faults) if self.faults else 0)


# Accuracy.

EXPLICIT = ("symplectic-euler", "velocity-verlet", "rk4", "dormand-prince5", "yoshida4")
TARGETS = {0.1: "10 %", 1e-2: "1 %", 1e-3: "0.1 %", 1e-4: "0.01 %", 1e-6: "1e-6", 1e-8: "1e-8"}
SHOWN = (0.1, 1e-2, 1e-4, 1e-6)
# Names as the table has room for.
SHORT = {
    "symplectic-euler": "sym. Euler",
    "velocity-verlet": "Verlet",
    "rk4": "RK4",
    "dormand-prince5": "DP5",
    "yoshida4": "Yoshida4",
    "implicit-euler": "imp. Euler",
    "implicit-midpoint": "midpoint",
    "generalised-alpha": "gen. alpha",
    "bdf2": "BDF2",
    "tr-bdf2": "TR-BDF2",
    "sdirk4": "SDIRK4",
    "gauss2": "Gauss2",
    "radau-iia3": "Radau3",
}
PROBLEMS = {
    "beam, neo-hookean": "soft beam, neo-Hookean",
    "beam, stable-neo-hookean": "soft beam, stable neo-Hookean",
    "chain": "chain of ten masses",
    "kepler": "Kepler's ellipse",
    "stiff_beam": "stiff beam, nu = 0.49",
    "stiff_chain": "stiff chain",
    "stiff_pendulum": "stiff pendulum",
    "twisted_bar": "twisted bar",
    "impact": "two squares collide (\\*)",
}


def is_explicit(row: Row) -> bool:
    return row["integrator"].removesuffix(" (adaptive)") in EXPLICIT


def time_of(row: Row) -> float:
    return float(row["wall_min_s"])


def error_of(row: Row) -> float:
    return float(row["err_q_rms"])


def study_rows() -> dict[str, list[Row]]:
    """Rows of each problem, those included that failed."""
    problems: dict[str, list[Row]] = {name: [] for name in PROBLEMS}
    with (ROOT / "docs" / "accuracy" / "rows.csv").open() as file:
        for row in csv.DictReader(file):
            name = f"{row['case']}, {row['material']}" if row["variant"] else row["case"]
            problems[name].append(row)
    return problems


def solved(rows: list[Row]) -> list[Row]:
    return [row for row in rows if row["status"] == "ok" and row["dropped"] != "true"]


def fastest(rows: list[Row], error: float) -> Row | None:
    return min((row for row in solved(rows) if error_of(row) <= error), key=time_of, default=None)


class Accuracy:
    """What the committed study says in one sentence and one table."""

    def __init__(self) -> None:
        self.problems = study_rows()
        wins, ratios, implicit = 0, [], []
        for name, rows in self.problems.items():
            for error, percent in TARGETS.items():
                explicit = fastest([row for row in rows if is_explicit(row)], error)
                other = fastest([row for row in rows if not is_explicit(row)], error)
                if explicit is None and other is None:
                    continue
                if other is None or (explicit is not None and time_of(explicit) < time_of(other)):
                    wins += 1
                    ratios += [time_of(other) / time_of(explicit)] if other and explicit else []
                else:
                    implicit.append((name, percent))
        sizes = [int(rows[0]["ndof"]) for rows in self.problems.values()]
        # The page's sentences name these two problems; a new study may need others.
        assert implicit == [("stiff_beam", "10 %"), ("stiff_pendulum", "10 %")], implicit
        self.finding = (
            f"explicit integrator is the fastest in {wins} of {wins + len(implicit)} cases, "
            f"by a factor of {min(ratios):.1f} to {max(ratios):.0f}"
        )
        self.sizes = f"{min(sizes)} to {max(sizes)} unknowns"
        rows = [row for rows in self.problems.values() for row in rows]
        again = [row for row in rows if int(row["repeats"]) > 1]
        noisy = [row for row in again if float(row["wall_iqr_s"]) > 0.05 * float(row["wall_median_s"])]
        self.noise = f"in {len(noisy)} of {len(again)} rows"
        self.runs = f"all {len(rows)} runs"
        self.machines = sorted({row["cpu"].replace("(R)", "") for row in rows})
        explicit, other = (self.best("stiff_beam", 1e-2, explicit=kind) for kind in (True, False))
        self.sentence = (
            f"1 % error on a stiff beam takes {short(time_of(explicit))} with an explicit integrator, "
            f"{short(time_of(other))} with an implicit one."
        )

    def best(self, name: str, error: float, *, explicit: bool) -> Row:
        row = fastest([row for row in self.problems[name] if is_explicit(row) == explicit], error)
        assert row is not None
        return row

    def table(self) -> str:
        def cell(row: Row | None, bold: bool) -> str:
            if row is None:
                return "-"
            name = SHORT[row["integrator"].removesuffix(" (adaptive)")]
            mark = "+" if row["tol"] else ""
            return (
                f"{'**' if bold else ''}{name}{mark} {three_digits(1e3 * time_of(row))}{'**' if bold else ''}"
            )

        table = []
        for name, rows in self.problems.items():
            cells = [f"{PROBLEMS[name]} ({rows[0]['ndof']})"]
            for error in SHOWN:
                pair = [fastest([r for r in rows if is_explicit(r) == kind], error) for kind in (True, False)]
                least = min(time_of(row) for row in pair if row)
                cells.append("<br>".join(cell(row, bool(row) and time_of(row) == least) for row in pair))
            table.append(cells)
        header = ["problem (unknowns)", *(TARGETS[error] for error in SHOWN)]
        return markdown(header, "lllll", table)

    def front(self, name: str) -> list[Row]:
        """Runs that no other run beats in both error and time, from the fastest on."""
        front: list[Row] = []
        for row in sorted(solved(self.problems[name]), key=time_of):
            if error_of(row) < 1 and (not front or error_of(row) < error_of(front[-1])):
                front.append(row)
        return front

    def chart(self, name: str, *, small: bool) -> str:
        """Error against run time, both logarithmic: all runs faint, the front bold."""
        width, height, left, right, top, bottom = (
            (250, 200, 40, 8, 24, 34) if small else (750, 460, 62, 14, 30, 48)
        )
        svg = Svg(width, height, 11 if small else 13)
        rows, front = self.problems[name], self.front(name)
        low, high = -9, 0.7
        first = math.log10(min(map(time_of, front)) * 1e3) - 0.25
        last = math.log10(max(map(time_of, solved(rows))) * 1e3) + 0.05

        def x(seconds: float) -> float:
            return left + (math.log10(seconds * 1e3) - first) / (last - first) * (width - left - right)

        def y(error: float) -> float:
            value = min(math.log10(error), high)
            return top + (high - value) / (high - low) * (height - top - bottom)

        unstable = [row for row in rows if is_explicit(row) and row["status"] != "ok"]
        least = min(time_of(row) for row in solved(rows) if is_explicit(row))
        svg.box(left, top, x(least) - left, height - top - bottom, ORANGE, 0.12)
        frame = [(left, top), (left, height - bottom), (width - right, height - bottom)]
        svg.line(frame, TEXT)
        for power in range(low + 1, 1, 4 if small else 2):
            svg.text(left - 5, y(10.0**power) + 4, f"1e{power}" if power else "1", "end")
            svg.line([(left, y(10.0**power)), (width - right, y(10.0**power))], FAINT, 0.3)
        for power in range(math.ceil(first), math.floor(last) + 1):
            svg.text(x(10.0**power * 1e-3), height - bottom + 15, f"{10**power:g}", "middle")
        svg.text(width - right, height - 6, "run time [ms]", "end")
        title = "error against time, stiff beam" if small else "relative error of positions, stiff beam"
        svg.text(left - 34 if small else left, 14, title, font_weight="bold")
        svg.line([(left, y(0.01)), (width - right, y(0.01))], TEXT, 1, "2 3")
        svg.text(width - right, y(0.01) - 4, "1 %", "end")

        for integrator in dict.fromkeys(row["integrator"] for row in rows):
            of = [row for row in solved(rows) if row["integrator"] == integrator]
            # Explicit steps beyond the limit follow no line.
            points = [(x(time_of(row)), y(error_of(row))) for row in of if error_of(row) < 5]
            if len(points) > 1:
                svg.line(points, FAINT, 1)
            for point in points:
                svg.dot(*point, 1.5, FAINT)
        steps = [(x(time_of(front[0])), y(error_of(front[0])))]
        for row in front[1:]:
            steps += [(x(time_of(row)), steps[-1][1]), (x(time_of(row)), y(error_of(row)))]
        svg.line(steps, TEXT, 2.5)
        for row in front:
            at = (x(time_of(row)), y(error_of(row)))
            svg.dot(*at, 3.5 if small else 5, BLUE if is_explicit(row) else ORANGE)
        if small:
            return str(svg)
        for row, following in zip(front, [*front[1:], None], strict=True):
            if following and following["integrator"] == row["integrator"]:
                continue
            name = row["integrator"].replace(" (adaptive)", ", adaptive")
            label = f"{name}, {short(float(row['dt'])).replace('.0 ', ' ')}"
            at = (x(time_of(row)), y(error_of(row)))
            color = BLUE if is_explicit(row) else ORANGE
            # The lower left of the front is empty.
            if following:
                place = max(left + 6, at[0] - 10 - 6.2 * len(label))
                down = 20 if place == left + 6 else 15
            else:
                place, down = at[0] + 9, 15
            svg.text(place, at[1] + down, label, fill=color, font_size=12)
        svg.text(left + 6, height - bottom - 24, f"{len(unstable)} explicit runs with", font_size=12)
        svg.text(left + 6, height - bottom - 8, "larger steps diverged", font_size=12)
        for number, (color, text) in enumerate(
            ((BLUE, "explicit"), (ORANGE, "implicit"), (FAINT, "all others"))
        ):
            svg.dot(width - 300 + 100 * number, 10, 5, color)
            svg.text(width - 290 + 100 * number, 14, text)
        return str(svg)


# Robustness.

STARTS = ("plane", "point", "inverted", "stretch", "scramble", "scramble, free")
BLOCKS = [(dim, integrator) for dim in "23" for integrator in ("implicit-euler", "quasi-static")]
REASONS = {
    "step": (
        "an implicit step is solved, and elements are still inverted",
        "watch `min J` in the next steps",
    ),
    "entangled": (
        "statics end in an equilibrium away from the reference shape",
        "start from a shape closer to it",
    ),
    "stvk": ("St. Venant-Kirchhoff keeps inverted elements", "use `stable-neo-hookean`"),
    "static": ("statics at nu >= 0.495 keep inverted elements", "start from a shape closer to it"),
    "reported": (
        "Newton's method did not converge, and the message said so",
        "use a smaller step, `retries`, `implicit-euler`",
    ),
    "locks": ("linear elements lock at nu >= 0.49", "use `order = 2`"),
    "unsettled": (
        "friction still changed when a solve ended",
        "use a smaller step, more `friction_iterations`",
    ),
    "overload": ("less than 5 % of the contact distance was left", "use a larger contact `stiffness`"),
}


class Robustness:
    """What the committed suite says: verdicts, reasons, the table of starts."""

    def __init__(self) -> None:
        text = (ROOT / "docs" / "stress.md").read_text()
        self.families: dict[str, list[list[str]]] = {}
        for section in text.split("\n## ")[1:]:
            lines = [line for line in section.splitlines() if re.match(r"\| (?!case \|)", line)]
            self.families[section.splitlines()[0]] = [
                [cell.strip() for cell in line.split("|")[1:-1]] for line in lines
            ]
        rows = [row for family in self.families.values() for row in family]
        self.verdicts = Counter(row[6] for row in rows)
        said = re.findall(
            r"^- (.*): (inverted|entangled|reported|overload|unsettled|locks): ", text, re.MULTILINE
        )
        self.reasons = Counter(self.reason(case.split(": ")[0], kind) for case, kind in said)
        assert self.reasons.total() == self.verdicts["flagged"] and "FAIL" not in self.verdicts, self.reasons
        self.sentence = (
            f"{len(rows)} stiff and extreme cases: {self.verdicts['pass']} pass, "
            f"{self.verdicts['flagged']} are flagged with a reason, {self.verdicts['FAIL']} fail."
        )
        starts = next(iter(self.families.values()))
        self.starts = {(r[1], r[4], r[2], r[3], r[0]): r for r in starts if r[5] == "cholesky"}
        steady = sum(row[4] in ("implicit-euler", "quasi-static") for row in rows)
        self.integrators = (
            f"{steady} cases are for implicit Euler and statics, "
            f"{len(rows) - steady} for {len({row[4] for row in rows}) - 2} other integrators"
        )
        static = [row for row in self.starts.values() if row[4] == "quasi-static"]
        steps = [row for row in self.starts.values() if row[4] == "implicit-euler"]
        rest = sum(row[6] == "pass" for row in static)
        done = sum(row[9] != "" for row in steps)
        inverted = sum(row[9] != "" and float(row[9]) <= 0 for row in steps)
        self.finding = (
            f"Statics reach the reference shape in {rest} of {len(static)} cases. "
            f"One implicit step is solved in {done} of {len(steps)}; "
            f"in {inverted} of them elements are still inverted."
        )

    @staticmethod
    def reason(case: str, kind: str) -> str:
        if kind != "inverted":
            return kind
        return "stvk" if "stvk" in case else "step" if "implicit-euler" in case else "static"

    def table_of_reasons(self) -> str:
        rows = [[REASONS[key][0], str(count), REASONS[key][1]] for key, count in self.reasons.most_common()]
        return markdown(["reason", "cases", "what to do"], "lrl", rows)

    def table_of_families(self) -> str:
        rows = []
        for name, cases in self.families.items():
            counts = Counter(row[6] for row in cases)
            rows.append([name, *(str(counts[verdict]) for verdict in ("pass", "flagged", "FAIL"))])
        return markdown(["family", "pass", "flagged", "fail"], "lrrr", rows)

    def chart(self, *, small: bool) -> str:
        """The table of starts as a map: materials down, starts across, one block a dimension and method."""
        materials = list(dict.fromkeys((key[2], key[3]) for key in self.starts))
        cell, left, gap, top = ((9, 11), 4, 8, 40) if small else ((21, 21), 186, 12, 26)
        block = (len(STARTS) * cell[0], len(materials) * cell[1])
        svg = Svg(250 if small else 750, 200 if small else 330, 11 if small else 12)
        if small:
            svg.text(left, 14, "impossible starting shapes", font_weight="bold")
        for number, (dim, integrator) in enumerate(BLOCKS):
            x0 = left + number * (block[0] + gap)
            kind = "static" if integrator == "quasi-static" else "step" if small else "one implicit step"
            svg.text(x0 + block[0] / 2, top - 6, f"{dim}D, {kind}", "middle")
            for i, material in enumerate(materials):
                for j, start in enumerate(STARTS):
                    row = self.starts[(dim, integrator, *material, start)]
                    inverted = row[9] != "" and float(row[9]) <= 0
                    color = GREEN_CELL if row[6] == "pass" else BLUE_CELL if inverted else ORANGE_CELL
                    x, y = x0 + j * cell[0], top + i * cell[1]
                    svg.box(x, y, cell[0] - 1, cell[1] - 1, color)
                    if row[6] != "pass" and not small:
                        svg.text(x + 10, y + 15, "-" if inverted else "!", "middle", fill=INK)
            for j, start in enumerate(() if small else STARTS):
                x, y = x0 + (j + 0.7) * cell[0], top + block[1] + 10
                svg.text(x, y, start, "end", transform=f"rotate(-50 {x:.1f} {y:.1f})")
        for i, (material, poisson) in enumerate([] if small else materials):
            svg.text(left - 6, top + i * cell[1] + 15, f"{material} {poisson}", "end")
        legend = (
            (GREEN_CELL, "pass", 4, 186),
            (BLUE_CELL, "- elements inverted", 60, 260),
            (ORANGE_CELL, "! away from rest, or not solved", 4, 410),
        )
        for number, (color, text, x_small, x_large) in enumerate(legend):
            x = x_small if small else x_large
            y = 156 + 18 * (number // 2) if small else svg.height - 18
            svg.box(x, y, 12, 12, color)
            svg.text(x + 17, y + 10, text[2:] if small and number else text)
        return str(svg)


def main() -> None:
    pages = Pages("--write" in sys.argv)
    accuracy, robustness = Accuracy(), Robustness()
    for name, small in (("front", False), ("front-small", True)):
        pages.file(FOLDER / f"{name}.svg", accuracy.chart("stiff_beam", small=small))
    for name, small in (("starts", False), ("starts-small", True)):
        pages.file(FOLDER / f"{name}.svg", robustness.chart(small=small))
    page = FOLDER / "accuracy.md"
    pages.part(page, "fastest", accuracy.table())
    pages.says(page, accuracy.finding, accuracy.sizes, accuracy.noise, accuracy.runs, *accuracy.machines)
    page = FOLDER / "robustness.md"
    pages.part(page, "reasons", robustness.table_of_reasons())
    pages.part(page, "families", robustness.table_of_families())
    pages.says(page, robustness.sentence, robustness.finding, robustness.integrators)
    for page in (ROOT / "README.md", ROOT / "docs" / "README.md"):
        pages.says(page, accuracy.sentence, robustness.sentence)
    if not pages.faults:
        print("pages, pictures and README agree with rows.csv and stress.md")
    pages.end()


if __name__ == "__main__":
    main()
