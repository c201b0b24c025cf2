"""Licences of what a build links: ``python3 tests/tools/third_party.py TARGET CRATE``.

Crates come from ``cargo metadata``: those that the package or the program links on that target, without
build scripts, macros and tests. Their texts are the files that they ship. Where a crate ships none, Apache's
text is taken if it is under Apache too, or MIT's with the authors that its manifest names; any other crate
without a text is an error. Beside crates there are the C code that ``zstd-sys`` compiles, the three.js of the
page, Rust's library and, on musl and MinGW, the C library of zig.
"""

from __future__ import annotations

import json
import re
import subprocess
import sys
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
NAMES = re.compile(r"(licen[sc]e|copying|copyright|notice|unlicense)", re.IGNORECASE)
# Folders below a crate with code of others that it compiles.
INNER = {"zstd-sys": ["zstd"]}
# The C library that is linked into a program or a library, in zig's package.
C_LIBRARY = {"musl": "musl/COPYRIGHT", "windows-gnu": "mingw/COPYING"}


def linked(target: str, root: str) -> list[dict]:
    """Packages from a registry that ``root`` links on ``target``."""
    features = ["--features", "pyo3/extension-module"]
    command = ["cargo", "metadata", "--format-version=1", "--locked", "--filter-platform", target, *features]
    metadata = json.loads(output(*command))
    packages = {package["id"]: package for package in metadata["packages"]}
    dependencies = {node["id"]: node["deps"] for node in metadata["resolve"]["nodes"]}
    waiting = [key for key, package in packages.items() if package["name"] == root]
    found: set[str] = set()
    while waiting:
        key = waiting.pop()
        if key in found:
            continue
        found.add(key)
        for dependency in dependencies[key]:
            macro = any("proc-macro" in part["kind"] for part in packages[dependency["pkg"]]["targets"])
            if not macro and any(kind["kind"] is None for kind in dependency["dep_kinds"]):
                waiting.append(dependency["pkg"])
    foreign = (packages[key] for key in found if packages[key]["source"])
    return sorted(foreign, key=lambda package: package["name"])


def output(*command: str) -> str:
    return subprocess.run(command, cwd=ROOT, check=True, stdout=subprocess.PIPE, text=True).stdout


def files(folder: Path) -> list[Path]:
    return sorted(file for file in folder.iterdir() if file.is_file() and NAMES.match(file.name))


def crate_texts(package: dict) -> Iterator[str]:
    folder = Path(package["manifest_path"]).parent
    texts = [file for name in ["", *INNER.get(package["name"], [])] for file in files(folder / name)]
    yield from (file.read_text("utf-8", "replace").strip() for file in texts)
    if texts:
        return
    if "Apache-2.0" in package["license"]:
        yield (ROOT / "LICENSE-APACHE").read_text("utf-8").strip()
    elif package["license"] == "MIT":
        authors = ", ".join(re.sub(r" *<.*?>", "", author) for author in package["authors"])
        holder = f"Copyright (c) {authors or 'the authors of ' + package['name']}"
        yield re.sub(r"Copyright.*", holder, (ROOT / "LICENSE-MIT").read_text("utf-8"), count=1).strip()
    else:
        sys.exit(f"{package['name']} ({package['license']}) ships no text of its licence")


def others(target: str) -> Iterator[tuple[str, str]]:
    yield "three.js", (ROOT / "crates/view/vendor/three/LICENSE").read_text("utf-8").strip()
    documents = Path(output("rustc", "--print", "sysroot").strip()) / "share/doc/rust"
    for name in ("MIT.txt", "Apache-2.0.txt"):
        text = (documents / "licenses" / name).read_text("utf-8").strip()
        yield "Rust's library (MIT OR Apache-2.0), copyright the Rust project's contributors", text
    for part, name in C_LIBRARY.items():
        if part in target:
            # Asked of the environment that links, which has zig.
            import ziglang

            file = Path(ziglang.__file__).parent / "lib/libc" / name
            yield f"the C library of {name.split('/')[0]}", file.read_text("utf-8", "replace").strip()


def write(target: str, root: str) -> str:
    """One text with every licence once, below the names of what is under it."""
    texts: dict[str, str] = {}
    under: dict[str, list[str]] = defaultdict(list)

    def add(name: str, text: str) -> None:
        # Spaces and line ends alone make no other licence.
        key = " ".join(text.split())
        texts.setdefault(key, text)
        under[key].append(name)

    for package in linked(target, root):
        for text in crate_texts(package):
            add(f"{package['name']} {package['version']} ({package['license']})", text)
    for name, text in others(target):
        add(name, text)
    line = "\n\n" + 78 * "-" + "\n"
    parts = ["\n".join(dict.fromkeys(under[key])) + "\n\n" + text for key, text in texts.items()]
    return line.join([f"Works that pliant for {target} links, with their licences.", *parts]) + "\n"


if __name__ == "__main__":
    sys.stdout.reconfigure(encoding="utf-8")
    sys.stdout.write(write(*sys.argv[1:3]))
