"""Links between pages: ``check_links.py [FOLDER]``, the folder of a checkout, this one without it.

Every relative link and picture of a Markdown file leads to a file that exists, in the letters of its name,
and every anchor to a heading. Pages of ``docs``, which is a book, link to nothing outside of it. Each is
linked from another page; the table of contents does not count, for it lists all of them. Code is left alone,
and so are addresses with a scheme. Prints what is wrong, and ends with 1 if there is any.
"""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path
from urllib.parse import unquote

ROOT = Path(__file__).resolve().parents[2]

# Parts of pages that are written elsewhere, with links as they are there.
PARTS = {"tests/verification/page.md"}

FENCE = re.compile(r"^( *)```[^\n]*\n.*?^\1```$", re.DOTALL | re.MULTILINE)
CODE = re.compile(r"(`+)(?!`).*?(?<!`)\1(?!`)", re.DOTALL)
COMMENT = re.compile(r"<!--.*?-->", re.DOTALL)
TARGETS = (
    re.compile(r"\]\(\s*<?([^)\s>]+)>?(?:\s+\"[^\"]*\")?\s*\)"),
    re.compile(r"^ {0,3}\[[^\]^]+\]:\s*<?(\S+?)>?\s*$", re.MULTILINE),
    re.compile(r"<(?:a|img|source)\b[^>]*?\b(?:href|src|srcset)=\"([^\"\s]+)\""),
)
IDENTIFIER = re.compile(r"<[^>]*\b(?:id|name)=\"([^\"]+)\"")


def blanked(text: str) -> str:
    """The text with blanks in place of code and comments, so that lines keep their numbers."""
    for pattern in (FENCE, COMMENT, CODE):
        text = pattern.sub(lambda match: re.sub(r"[^\n]", " ", match[0]), text)
    return text


def links(text: str) -> list[tuple[int, str]]:
    """Line and target of every link and picture."""
    text = blanked(text)
    found = [match for pattern in TARGETS for match in pattern.finditer(text)]
    return sorted((text.count("\n", 0, match.start(1)) + 1, match[1]) for match in found)


def anchors(text: str) -> set[str]:
    """Anchors of a page, as GitHub and mdBook make them of headings, and the identifiers of its HTML."""
    text = FENCE.sub("", text)
    names: set[str] = set(IDENTIFIER.findall(text))
    for heading in re.findall(r"^#{1,6} +(.*?)(?: +#+)? *$", text, re.MULTILINE):
        words = re.sub(r"\]\([^)]*\)|<[^>]*>", "", heading).strip().lower()
        anchor = re.sub(r"[^\w\- ]", "", words).replace(" ", "-")
        same = (f"{anchor}-{number}" if number else anchor for number in range(len(names) + 1))
        names.add(next(name for name in same if name not in names))
    return names


def exists(path: Path) -> bool:
    """Whether there is such a file or folder, in these letters: some file systems take others as well."""
    return path.exists() and (
        path.parent == path or path.name in {entry.name for entry in path.parent.iterdir()}
    )


def faults(root: Path, pages: list[Path]) -> list[str]:
    """What is wrong with the links of these pages of a checkout, a line each."""
    texts = {page: page.read_text() for page in pages}
    names = {page: anchors(text) for page, text in texts.items()}
    docs = root / "docs"
    contents = docs / "SUMMARY.md"
    wrong: list[str] = []
    linked: set[Path] = set()
    for page, text in texts.items():
        for line, target in links(text):
            file, _, anchor = unquote(target).partition("#")
            if re.match(r"[a-z][a-z0-9+.-]*:", file, re.IGNORECASE):
                continue
            place = f"{page.relative_to(root)}:{line}"
            path = (page.parent / file).resolve() if file else page
            if not path.is_relative_to(root) or not exists(path):
                wrong.append(f"{place}: no file {target}")
            elif page.is_relative_to(docs) and not path.is_relative_to(docs):
                wrong.append(f"{place}: not in the book: {target}")
            elif anchor and path in names and anchor not in names[path]:
                wrong.append(f"{place}: no heading {target}")
            elif path != page and page != contents:
                linked.add(path)
    book = [page for page in pages if page.is_relative_to(docs) and page != contents]
    return wrong + [
        f"{page.relative_to(root)}: no other page links to it" for page in book if page not in linked
    ]


def main() -> int:
    root = Path(sys.argv[1]).resolve() if len(sys.argv) > 1 else ROOT
    command = ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard", "*.md"]
    listed = subprocess.run(command, cwd=root, capture_output=True, text=True, check=True).stdout.split("\0")
    pages = sorted(root / name for name in listed if name and name not in PARTS and (root / name).exists())
    wrong = faults(root, pages)
    for fault in wrong:
        print(fault)
    print(f"{len(wrong)} links are wrong in {len(pages)} pages")
    return 1 if wrong or not pages else 0


if __name__ == "__main__":
    sys.exit(main())
