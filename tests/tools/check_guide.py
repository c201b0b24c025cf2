"""Run every command and snippet of the guide: ``check_guide.py PLIANT [--show] [PAGE...]``.

Runs under a Python that has the package. The pages are ``README.md`` and those of ``docs/guide`` and of the
translations, ``docs/zh``. Each has a folder of its own under ``target/ci/guide``, with links to ``scenes``,
``crates``, ``docs`` and ``tests``, and its blocks run there from top to bottom. The words after the opening
fence say what a block is:

- ``sh``: run by bash, ``pliant`` being the program PLIANT; ``sh exits=1``: it has to end with this code;
  ``sh unchecked``: not run (installations, Ctrl-C, what opens a browser or costs minutes).
- ``python``: run in this process; the blocks of a page share their names.
- ``toml NAME.toml``: a scene, written to this file and checked by ``pliant check``;
  ``toml into=NAME.toml``: tables that are put into that scene, which is assembled;
  ``toml``: a document that parses.
- ``text output``: lines of the output of the block before, in this order, blanks aside; ``...`` stands for
  any others, and in a line for any text.
- ``rust FILE``: consecutive lines of a file that CI compiles, an example in its documentation included;
  ``rust``: not checked, as ``text``.

A translation has the blocks of the page of ``docs/guide`` that has its name. ``--show`` prints what blocks
print, and writes it into blocks of output that are empty. Links are checked by ``check_links.py``.
"""

from __future__ import annotations

import contextlib
import io
import os
import re
import shutil
import subprocess
import sys
import time
import tomllib
import traceback
import warnings
from itertools import zip_longest
from pathlib import Path
from typing import Any

import pliant

ROOT = Path(__file__).resolve().parents[2]
WORK = ROOT / "target" / "ci" / "guide"
TRANSLATIONS = ROOT / "docs" / "zh"
SHOW = "--show" in sys.argv
FENCE = re.compile(r"^( *)```([^\n]*)\n(.*?)^\1```$", re.DOTALL | re.MULTILINE)


class Wrong(Exception):
    """A block that does not do what the page says."""


class Page:
    """One page: its folder, the names of its Python blocks, and the output of the last block."""

    def __init__(self, path: Path, program: Path) -> None:
        self.path, self.text = path, path.read_text()
        self.folder = WORK / path.relative_to(ROOT).with_suffix("")
        self.names: dict[str, Any] = {"__name__": "__guide__"}
        self.output = ""
        self.unchecked = 0
        shutil.rmtree(self.folder, ignore_errors=True)
        (self.folder / "bin").mkdir(parents=True)
        (self.folder / "bin" / "pliant").symlink_to(program)
        for name in ("scenes", "crates", "docs", "tests"):
            (self.folder / name).symlink_to(ROOT / name)

    def run(self) -> list[str]:
        """All blocks in turn; what went wrong, which ends the page."""
        os.chdir(self.folder)
        for match in FENCE.finditer(self.text):
            line = self.text.count("\n", 0, match.start()) + 1
            kind, *words = match[2].split() or ["text"]
            body = "".join(row[len(match[1]) :] for row in match[3].splitlines(keepends=True))
            try:
                if SHOW and words == ["output"] and not body:
                    text = self.path.read_text()
                    self.path.write_text(text.replace("output\n```", f"output\n{self.output}```", 1))
                self.block(kind, words, body)
                if SHOW and kind in ("sh", "python"):
                    print(f"--- line {line}\n{self.output}")
            except Exception as error:  # noqa: BLE001
                detail = str(error) if isinstance(error, Wrong) else traceback.format_exc(limit=-2)
                place = f"{self.path.relative_to(ROOT)}:{line}"
                return [f"{place}: {kind} block: {detail}", *self.translation()]
        return self.translation()

    def block(self, kind: str, words: list[str], body: str) -> None:
        if "unchecked" in words:
            self.unchecked += 1
        elif kind == "sh":
            self.shell(body, next((int(word[6:]) for word in words if word.startswith("exits=")), 0))
        elif kind == "python":
            self.python(body)
        elif kind == "toml":
            self.toml(words[0] if words else None, body)
        elif kind == "text" and words == ["output"]:
            self.compare(body)
        elif kind == "rust" and words:
            text = (ROOT / words[0]).read_text()
            if body not in text and body not in uncommented(text):
                raise Wrong(f"not the lines of {words[0]}, comment marks aside")

    def shell(self, body: str, code: int) -> None:
        path = [str(self.folder / "bin"), str(Path(sys.executable).parent), os.environ["PATH"]]
        # Nothing that a page opens shall open a window here.
        environment = {**os.environ, "PATH": ":".join(path), "BROWSER": "true"}
        command = ["bash", "-euo", "pipefail", "-c", body]
        ran = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=120)
        self.output = ran.stdout + ran.stderr
        if ran.returncode != code:
            raise Wrong(f"ended with {ran.returncode}, not {code}:\n{body}\n{self.output}")

    def python(self, body: str) -> None:
        printed = io.StringIO()
        with contextlib.redirect_stdout(printed):
            exec(compile(body, str(self.path), "exec"), self.names)  # noqa: S102
        self.output = printed.getvalue()

    def toml(self, word: str | None, body: str) -> None:
        tables = tomllib.loads(body)
        if word is None:
            return
        if not word.startswith("into="):
            (self.folder / word).write_text(body)
            self.shell(f"pliant check {word}", 0)
            return
        scene = tomllib.loads((self.folder / word.removeprefix("into=")).read_text())
        for key, value in tables.items():
            scene[key] = merged(scene.get(key), value)
        if "adaptive" in tables.get("time", {}):
            scene["time"].pop("step", None)
        pliant.Simulation(pliant.Scene(**scene))

    def compare(self, body: str) -> None:
        printed = [" ".join(row.split()) for row in self.output.splitlines()]
        start = 0
        for row in body.splitlines():
            row = " ".join(row.split())
            if row in ("", "..."):
                continue
            pattern = re.compile(".*".join(map(re.escape, row.split("..."))))
            rest = range(start, len(printed))
            found = next((number for number in rest if pattern.fullmatch(printed[number])), None)
            if found is None:
                raise Wrong(f"no such line in the output: {row}\n{self.output}")
            start = found + 1

    def translation(self) -> list[str]:
        """The first block of a translation that the page in English does not have there."""
        if not self.path.is_relative_to(TRANSLATIONS) or self.path.name == "README.md":
            return []
        name = self.path.relative_to(ROOT)
        originals = list((ROOT / "docs" / "guide").rglob(self.path.name))
        if len(originals) != 1:
            return [f"{name}: {len(originals)} pages of docs/guide have this name"]
        original = originals[0].relative_to(ROOT)
        blocks = zip_longest(FENCE.finditer(self.text), FENCE.finditer(originals[0].read_text()))
        for translated, block in blocks:
            if translated is None:
                return [f"{name}: lacks a block of {original}:\n{block[0]}"]
            if block is None or translated.groups() != block.groups():
                return [f"{name}: not the block of {original}:\n{translated[0]}"]
        return []


def merged(old: Any, new: Any) -> Any:
    """Keys of a table beside those that are there; tables of a list in turn, and behind them what is more."""
    if isinstance(old, dict) and isinstance(new, dict):
        return {**old, **new}
    if isinstance(old, list) and isinstance(new, list) and all(isinstance(item, dict) for item in old + new):
        return [merged(a, b) for a, b in zip(old, new, strict=False)] + new[len(old) :] + old[len(new) :]
    return new


def uncommented(text: str) -> str:
    """Rust without the marks of its documentation."""
    return re.sub("^ *//[/!] ?", "", text, flags=re.MULTILINE)


def pages() -> list[Path]:
    """Every page, each of which the table of contents has to list."""
    folders = (ROOT / "docs" / "guide", TRANSLATIONS)
    guide = [page for folder in folders for page in sorted(folder.rglob("*.md"))]
    contents = (ROOT / "docs" / "SUMMARY.md").read_text()
    for page in guide:
        if str(page.relative_to(ROOT / "docs")) not in contents:
            sys.exit(f"docs/SUMMARY.md does not list {page}")
    return [ROOT / "README.md", *(ROOT / "docs" / name for name in ("README.md", "SUMMARY.md")), *guide]


def main() -> None:
    program = Path(sys.argv[1]).resolve()
    chosen = [Path(name).resolve() for name in sys.argv[2:] if name != "--show"] or pages()
    # Warnings of scenes that lock or gain energy on purpose.
    warnings.simplefilter("ignore")
    faults: list[str] = []
    for path in chosen:
        started = time.perf_counter()
        page = Page(path, program)
        found = page.run()
        faults += found
        left_out = f", {page.unchecked} not run" if page.unchecked else ""
        seconds = time.perf_counter() - started
        name = path.relative_to(ROOT)
        print(f"{'failed' if found else 'ok':6} {seconds:5.1f} s  {name}{left_out}", flush=True)
    sys.exit("\n".join(faults) if faults else 0)


if __name__ == "__main__":
    main()
