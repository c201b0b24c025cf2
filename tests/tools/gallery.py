"""The gallery, ``docs/gallery.md``: ``gallery.py [--write] [--pictures PLIANT [SCENE...]]``.

Scenes stand in the groups of ``scenes/gallery.txt``, each with its picture, the command that runs it and its
first comment. Without an option the page is compared with what this writes, and the exit code is 1 if it
differs; ``--write`` writes it. ``--pictures`` runs scenes, all without a name, and draws
``docs/gallery/NAME.gif``.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile
import tomllib
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
SCENES = ROOT / "scenes"
PAGE = ROOT / "docs" / "gallery.md"
# Three pictures of the default width fit a page on GitHub; docs/gallery.css makes a grid of them in the book.
COLUMNS = 3
HEAD = """# Gallery

The command below a picture runs its scene and plays it in the browser. `tests/tools/gallery.py` makes this
page and its pictures.

<div class="gallery">
"""


def groups(text: str) -> list[tuple[str, list[str]]]:
    """Titles of groups with the names below them, which are indented."""
    found: list[tuple[str, list[str]]] = []
    for line in filter(str.strip, text.splitlines()):
        if line[0].isspace():
            found[-1][1].append(line.strip())
        else:
            found.append((line.strip(), []))
    return found


def escaped(text: str) -> str:
    """A text in a cell of Markdown: what a scene says is no markup, except code between backticks."""
    parts = text.replace("\n", " ").replace("|", "\\|").split("`")
    is_paired = len(parts) % 2 == 1
    for i in range(0, len(parts), 2 if is_paired else 1):
        for mark, plain in {"&": "&amp;", "<": "&lt;", "[": "\\[", "*": "\\*", "_": "\\_"}.items():
            parts[i] = parts[i].replace(mark, plain)
    return ("`" if is_paired else "\\`").join(parts)


def comment(text: str) -> str:
    """The comment that a scene begins with; ``#:schema`` is for editors."""
    lines = []
    for line in text.splitlines():
        if not line.startswith("#"):
            break
        if not line.startswith("#:"):
            lines.append(line.lstrip("#").strip())
    return "\n".join(lines).strip()


def cell(name: str) -> str:
    """Picture, title, command and description of a scene."""
    text = (SCENES / f"{name}.toml").read_text()
    title = escaped(tomllib.loads(text)["title"])
    found = f" ![{title}](gallery/{name}.gif)<br>**{title}**<br>`pliant run scenes/{name}.toml --view`"
    about = escaped(comment(text))
    return found + (f"<details><summary>What it shows</summary>{about}</details> " if about else " ")


def page() -> str:
    """The page."""
    text = HEAD
    for title, names in groups((SCENES / "gallery.txt").read_text()):
        text += f"\n## {escaped(title)}\n|{' |' * COLUMNS}\n|{'---|' * COLUMNS}\n"
        for i in range(0, len(names), COLUMNS):
            cells = [cell(name) for name in names[i : i + COLUMNS]]
            text += "|" + "|".join(cells + [" "] * (COLUMNS - len(cells))) + "|\n"
    return text + "\n</div>\n"


def draw(pliant: Path, name: str) -> None:
    """Runs a scene and draws its animation."""
    with tempfile.TemporaryDirectory() as folder:
        recording = Path(folder) / "scene.mcap"
        scene = SCENES / f"{name}.toml"
        subprocess.run([pliant, "run", scene, "-o", recording, "--quiet"], check=True)
        picture = PAGE.with_suffix("") / f"{name}.gif"
        options = ["--frames", "24", "--size", "240x180", "--bare", "--force", "--quiet"]
        subprocess.run([pliant, "render", recording, "-o", picture, *options], check=True)


def main() -> int:
    arguments = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    arguments.add_argument("--write", action="store_true")
    arguments.add_argument("--pictures", metavar="PLIANT", type=Path)
    arguments.add_argument("scenes", nargs="*")
    given = arguments.parse_args()
    named = {name for _, names in groups((SCENES / "gallery.txt").read_text()) for name in names}
    there = {path.stem for path in SCENES.glob("*.toml")}
    for name in sorted(named ^ there):
        what = "scenes/gallery.txt does not name it" if name in there else "there is no such scene"
        print(f"{name}: {what}", file=sys.stderr)
    if given.pictures:
        for name in given.scenes or sorted(named):
            draw(given.pictures.resolve(), name)
    if given.write:
        PAGE.write_text(page())
    if PAGE.read_text() != page():
        print(f"{PAGE.relative_to(ROOT)} differs; gallery.py --write writes it", file=sys.stderr)
        return 1
    return int(named != there)


if __name__ == "__main__":
    sys.exit(main())
