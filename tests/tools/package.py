"""Wheels, the source distribution and program archives of a release, for all systems: see CONTRIBUTING.md.

``python3 tests/tools/package.py`` builds them on Linux x86_64 into ``target/package/files`` in the profile
``dist``; zig links for foreign systems, so that what is needed beside Rust, with its targets, is Python.
``--check`` builds all in the profile of tests, into ``target/package/check``: it says what links.
``--python`` installs the wheel of this system in a clean environment and tests it there.
"""

from __future__ import annotations

import argparse
import os
import shutil
import subprocess
import sys
import tarfile
import venv
import zipfile
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
TOOLS = ROOT / "tests/tools"
PACKAGE = ROOT / "crates/py"
HOME = ROOT / "target/package"
LARGEST_WHEEL = 8_000_000
SHELLS = {"bash": "pliant.bash", "zsh": "_pliant", "fish": "pliant.fish", "powershell": "_pliant.ps1"}
TESTS = ["test_scene.py", "test_simulation.py", "test_trajectory.py"]


@dataclass(frozen=True)
class System:
    """Where a release runs, with Rust's targets of the wheel and of the program."""

    wheel: str
    program: str
    compatibility: tuple[str, ...] = ()

    @property
    def windows(self) -> bool:
        return "windows" in self.program


MANYLINUX = ("--compatibility", "manylinux_2_28")
# The first is this one: its program prints the completions and pages of all.
SYSTEMS = {
    "linux-x86_64": System("x86_64-unknown-linux-gnu", "x86_64-unknown-linux-musl", MANYLINUX),
    "linux-aarch64": System("aarch64-unknown-linux-gnu", "aarch64-unknown-linux-musl", MANYLINUX),
    "macos-arm64": System("aarch64-apple-darwin", "aarch64-apple-darwin"),
    "macos-x86_64": System("x86_64-apple-darwin", "x86_64-apple-darwin"),
    "windows-x86_64": System("x86_64-pc-windows-gnu", "x86_64-pc-windows-gnu"),
}

# maturin exports `PyInit_pliant._pliant` from libraries that zig links for Windows, by a file of definitions
# that it writes before it calls cargo; the function is `PyInit__pliant`.
WRAPPER = """#!/bin/sh
file="{target}/maturin/pliant._pliant.def"
if grep -q 'pliant\\._pliant' "$file" 2>/dev/null; then sed -i 's/pliant\\._pliant/_pliant/' "$file"; fi
exec "$@"
"""


class Builder:
    def __init__(self, profile: str, output: Path) -> None:
        self.profile, self.output = profile, output
        self.target = Path(os.environ.get("CARGO_TARGET_DIR", HOME / "build")).absolute()
        self.tools = HOME / "tools"
        if not (self.tools / "bin/maturin").exists():
            venv.create(self.tools, with_pip=True)
        run(self.tools / "bin/pip", "install", "--quiet", "-r", TOOLS / "package-requirements.txt")
        self.environment = {
            **os.environ,
            "CARGO_TARGET_DIR": str(self.target),
            "PATH": f"{self.tools / 'bin'}{os.pathsep}{os.environ['PATH']}",
        }

    def wheel(self, system: System) -> Path:
        environment = dict(self.environment)
        if system.windows:
            wrapper = HOME / "rustc-wrapper"
            wrapper.write_text(WRAPPER.format(target=self.target), "utf-8")
            wrapper.chmod(0o755)
            environment["RUSTC_WRAPPER"] = str(wrapper)
        before = set(self.output.glob("*.whl"))
        with self.licences(system.wheel):
            options = ["--profile", self.profile, "--locked", "--strip", "--zig", "--target", system.wheel]
            command = ["maturin", "build", *options, *system.compatibility, "--out", self.output]
            run(*command, cwd=PACKAGE, env=environment)
        (wheel,) = set(self.output.glob("*.whl")) - before
        check_licences(wheel.name, zipfile.ZipFile(wheel).namelist())
        return wheel

    def source(self) -> Path:
        with self.licences(SYSTEMS["linux-x86_64"].wheel):
            run("maturin", "sdist", "--out", self.output, cwd=PACKAGE, env=self.environment)
        (file,) = self.output.glob("*.tar.gz")
        with tarfile.open(file) as archive:
            check_licences(file.name, archive.getnames())
        return file

    def program(self, system: System) -> Path:
        options = ["--locked", "-p", "pliant-cli", "--bin", "pliant"]
        options += ["--profile", self.profile, "--target", system.program]
        run("cargo-zigbuild", "zigbuild", *options, cwd=ROOT, env=self.environment)
        folder = {"dev": "debug"}.get(self.profile, self.profile)
        return self.target / system.program / folder / ("pliant.exe" if system.windows else "pliant")

    def archive(self, name: str, system: System, host: Path) -> Path:
        """The program with its licences, completions and manual, below one folder."""
        program = self.program(system)
        version = text(host, "--version").split()[1]
        folder = HOME / f"pliant-{version}-{name}"
        shutil.rmtree(folder, ignore_errors=True)
        for part in ("completions", "man/man1"):
            (folder / part).mkdir(parents=True)
        shutil.copy2(program, folder)
        for file in ("LICENSE-MIT", "LICENSE-APACHE", "README.md"):
            shutil.copy2(ROOT / file, folder)
        (folder / "LICENSE-THIRD-PARTY").write_text(self.third_party(system.program, "pliant-cli"), "utf-8")
        for shell, file in SHELLS.items():
            (folder / "completions" / file).write_text(text(host, "completions", shell), "utf-8")
        run(host, "man", "--output", folder / "man/man1", "--force", "--quiet")
        form = "zip" if system.windows else "gztar"
        archive = shutil.make_archive(str(self.output / folder.name), form, HOME, folder.name)
        shutil.rmtree(folder)
        return Path(archive)

    def third_party(self, target: str, root: str) -> str:
        # By the Python of the tools: zig's licences lie in its package.
        return text(self.tools / "bin/python", TOOLS / "third_party.py", target, root)

    def licences(self, target: str) -> Generated:
        return Generated(PACKAGE / "LICENSE-THIRD-PARTY", self.third_party(target, "pliant-py"))


class Generated:
    """A file that stands while something is built."""

    def __init__(self, path: Path, content: str) -> None:
        self.path, self.content = path, content

    def __enter__(self) -> None:
        self.path.write_text(self.content, "utf-8")

    def __exit__(self, *_: object) -> None:
        self.path.unlink()


def run(*command: object, **options: object) -> None:
    subprocess.run([str(word) for word in command], check=True, **options)  # type: ignore[call-overload]


def text(*command: object) -> str:
    words = [str(word) for word in command]
    return subprocess.run(words, cwd=ROOT, check=True, stdout=subprocess.PIPE, encoding="utf-8").stdout


def check_licences(file: str, names: list[str]) -> None:
    for licence in ("LICENSE-MIT", "LICENSE-APACHE", "LICENSE-THIRD-PARTY"):
        if not any(name.endswith(f"/{licence}") for name in names):
            raise SystemExit(f"{file} has no {licence}")


def try_wheel(wheel: Path, python: str) -> None:
    """Installs the wheel where no compiler is asked, and runs tests that need no other package."""
    environment = HOME / "trial"
    run(python, "-m", "venv", "--clear", environment)
    run(environment / "bin/pip", "install", "--quiet", "--only-binary", ":all:", wheel, "pytest")
    run(environment / "bin/pliant", "--version")
    tests = [ROOT / "tests/python" / name for name in TESTS]
    run(environment / "bin/python", "-m", "pytest", "-q", "-p", "no:cacheprovider", *tests, cwd=ROOT)


def sizes(output: Path) -> list[str]:
    """Prints what was built; returns what is too large."""
    large = []
    for file in sorted(output.iterdir()):
        size = file.stat().st_size
        print(f"{size / 1e6:8.2f} MB  {file.name}")
        if file.suffix == ".whl" and size > LARGEST_WHEEL:
            large.append(f"{file.name} is larger than {LARGEST_WHEEL / 1e6:g} MB")
    return large


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--check", action="store_true", help="build as for tests, to see what links")
    parser.add_argument("--system", action="append", choices=SYSTEMS, help="only this one; repeatable")
    parser.add_argument(
        "--python", action="append", default=[], help="try the wheel of this system in it; repeatable"
    )
    arguments = parser.parse_args()
    chosen = {name: SYSTEMS[name] for name in SYSTEMS if name in (arguments.system or SYSTEMS)}
    output = HOME / ("check" if arguments.check else "files")
    shutil.rmtree(output, ignore_errors=True)
    output.mkdir(parents=True)
    builder = Builder("dev" if arguments.check else "dist", output)

    failed = []
    host = builder.program(SYSTEMS["linux-x86_64"])
    builder.source()
    for name, system in chosen.items():
        for build in (lambda: builder.wheel(system), lambda: builder.archive(name, system, host)):
            # Others are tried all the same: a run says all that does not link.
            try:
                print(f"== {build().name}", flush=True)
            except subprocess.CalledProcessError as error:
                failed.append(f"{name}: {' '.join(map(str, error.cmd[:2]))} ended with {error.returncode}")
    for python in arguments.python:
        for wheel in output.glob("*manylinux*x86_64.whl"):
            try_wheel(wheel, python)
    large = sizes(output)
    if not arguments.check:
        failed += large
    if failed:
        sys.exit("\n".join(failed))


main()
