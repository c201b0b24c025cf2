"""The checker of links finds what is wrong with them, and nothing else."""

from __future__ import annotations

import runpy
from pathlib import Path

import pytest

TOOL = runpy.run_path(str(Path(__file__).parents[1] / "tools" / "check_links.py"))

#: A checkout whose links are right.
PAGES = {
    "README.md": "[The guide](docs/README.md#the-guide)\n",
    "docs/README.md": "# The guide\n[a](guide/a.md), ![b](guide/b.svg)\n```sh\n[no](a)\n```\n`[no](a)`\n",
    "docs/SUMMARY.md": "[a](guide/a.md)\n",
    "docs/guide/a.md": "# One: `two`\n## Same\n## Same\n[1](#one-two) [2](#same-1) [0](../README.md) [3](https://a.b/c)\n",
}


def faults(folder: Path, changes: dict[str, str]) -> list[str]:
    for name, text in {**PAGES, "docs/guide/b.svg": "", **changes}.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(text)
    return TOOL["faults"](folder, sorted(folder.rglob("*.md")))


def test_right_links_are_right(tmp_path: Path) -> None:
    assert faults(tmp_path, {}) == []


@pytest.mark.parametrize(
    ("page", "link", "fault"),
    [
        ("docs/guide/a.md", "[x](c.md)", "docs/guide/a.md:5: no file c.md"),
        ("docs/guide/a.md", "[two\nlines](c.md)", "docs/guide/a.md:6: no file c.md"),
        ("docs/guide/a.md", "![x](B.svg)", "docs/guide/a.md:5: no file B.svg"),
        ("docs/guide/a.md", '<img src="c.svg">', "docs/guide/a.md:5: no file c.svg"),
        ("docs/guide/a.md", "[x]: c.md", "docs/guide/a.md:5: no file c.md"),
        ("docs/guide/a.md", "[x](#same-2)", "docs/guide/a.md:5: no heading #same-2"),
        ("docs/guide/a.md", "[x](../README.md#a)", "docs/guide/a.md:5: no heading ../README.md#a"),
        ("docs/guide/a.md", "[x](../../README.md)", "docs/guide/a.md:5: not in the book: ../../README.md"),
        ("README.md", "[x](../README.md)", "README.md:2: no file ../README.md"),
    ],
)
def test_wrong_links_are_named(tmp_path: Path, page: str, link: str, fault: str) -> None:
    assert faults(tmp_path, {page: f"{PAGES[page]}{link}\n"}) == [fault]


def test_pages_that_only_contents_list_are_named(tmp_path: Path) -> None:
    pages = {"docs/guide/c.md": "[itself](c.md)\n", "docs/SUMMARY.md": "[a](guide/a.md) [c](guide/c.md)\n"}
    assert faults(tmp_path, pages) == ["docs/guide/c.md: no other page links to it"]
