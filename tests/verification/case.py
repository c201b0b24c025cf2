"""What a problem is made of: sources, scenes that the program runs, numbers side by side.

A problem is a file of ``problems``. It has

- a docstring, which the page prints: what the problem is, and what is known of its numbers;
- ``TITLE`` and ``SOURCES``, who published what and where, by short names;
- ``rows(pliant, quick)``, which yields a ``Row`` for every number, with the largest difference that the mesh
  or the step explains.

To add one, write such a file and try it: ``python tests/verification/run.py NAME``. Without a name the
script writes ``docs/guide/compared.md``. If a number was not read at its source, the docstring says what
confirms it.
"""

from __future__ import annotations

import csv
import json
import subprocess
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

STATIC = {"integrator": "quasi-static", "step": 1.0, "duration": 1.0}


@dataclass(frozen=True)
class Row:
    """One published number, and ours."""

    quantity: str
    unit: str
    source: str
    published: float
    ours: float
    mesh: str
    within: float
    """Largest difference, relative, that the discretisation explains; absolute where zero is published."""

    @property
    def difference(self) -> float:
        """Relative, absolute where zero is published."""
        return self.ours / self.published - 1 if self.published else self.ours

    @property
    def holds(self) -> bool:
        # Not `>`, so that NaN does not hold.
        return abs(self.difference) <= self.within


class Pliant:
    """The program, in a folder of its own."""

    def __init__(self, program: Path) -> None:
        self.program = program
        self._folder = tempfile.TemporaryDirectory()
        self.folder = Path(self._folder.name)

    def run(self, scene: dict[str, Any]) -> dict[str, list[float]]:
        """Runs a scene: columns of its probes by name, without units."""
        self._command("run", self._write(scene), "--no-record", "--probes", "probes.csv", "--force", "--json")
        with (self.folder / "probes.csv").open() as table:
            lines = list(csv.reader(table))
        names = [name.split(" ")[0] for name in lines[0]]
        return {name: [float(row[i]) for row in lines[1:]] for i, name in enumerate(names)}

    def last(self, scene: dict[str, Any]) -> dict[str, float]:
        """Runs a scene: the last line of its probes."""
        return {name: column[-1] for name, column in self.run(scene).items()}

    def summary(self, scene: Path | dict[str, Any]) -> dict[str, Any]:
        """Runs a scene, which may be a file: the summary of the run."""
        path = str(scene) if isinstance(scene, Path) else self._write(scene)
        return self._command("run", path, "--no-record", "--json")["summary"]

    def frequencies(self, scene: dict[str, Any], count: int, equilibrium: bool = False) -> list[float]:
        """The lowest natural frequencies [Hz]; about the equilibrium under the loads where that is asked."""
        options = ["--equilibrium"] if equilibrium else []
        report = self._command("modes", self._write(scene), "--count", str(count), "--json", *options)
        return [mode["frequency"] for mode in report["modes"]["modes"]]

    def mesh(self, name: str, text: str) -> dict[str, Any]:
        """Writes a mesh file, and says how a body names it."""
        (self.folder / name).write_text(text)
        return {"file": {"path": name}}

    def _write(self, scene: dict[str, Any]) -> str:
        text = "".join(f"{key} = {toml(value)}\n" for key, value in scene.items())
        (self.folder / "scene.toml").write_text(text)
        return "scene.toml"

    def _command(self, *words: str) -> Any:
        command = [str(self.program), *words]
        ran = subprocess.run(command, cwd=self.folder, capture_output=True, text=True, check=False)
        if ran.returncode:
            raise RuntimeError(f"{' '.join(words)}: exit code {ran.returncode}\n{ran.stdout}{ran.stderr}")
        return json.loads(ran.stdout)


def toml(value: Any) -> str:
    """A value as TOML writes it."""
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{key} = {toml(item)}" for key, item in value.items()) + " }"
    if isinstance(value, list | tuple):
        return "[" + ", ".join(map(toml, value)) + "]"
    if isinstance(value, bool | str):
        return json.dumps(value)
    return repr(value)
