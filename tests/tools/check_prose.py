"""Words and phrases that the guide has better ones for: ``check_prose.py [PAGE...]``.

Without pages it reads ``README.md`` and every page of ``docs/guide``. Code blocks, inline code, the targets of
links and formulas of tables are left alone. Prints file, line, the phrase and what to write in its place, and
ends with 1 if there is any.
"""

from __future__ import annotations

import re
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]

# Pages that are not rewritten yet: take them off the list when they are.
PENDING: set[str] = set()

# A phrase as a regular expression without regard to case, blanks for any white space, and its replacement.
PHRASES = {
    r"a step taken back|taken back|takes? back": "rejected (step), restored (state)",
    r"at rest,? (?:shape|positions?)|(?:shape|positions?|places?) at rest": "reference configuration",
    r"bear(?:s|ing)? (?:on|more|less|it|a|the|what)|borne": "withstands, carries",
    r"beside": "next to, compared with, in addition to",
    r"balance of energy": "energy balance",
    r"by (?:the )?hand(?! of)": "analytical, formula, written by you",
    r"came in": "external work",
    r"cannot be taken|can not be taken": "fails, is rejected",
    r"coordinates free to move|free to move coordinates": "unknowns, free degrees of freedom",
    r"expected force": "predicted force",
    r"fast(?:est)? motions?": "highest natural frequency, high frequencies",
    r"faults?": "defect, error",
    r"films?": "trajectory data, video, animation",
    r"finely divided": "finely meshed",
    r"way to the first touch": "time of impact",
    r"goes? by|go by": "depends on, is based on",
    r"(?:is|are) (?:given )?held|holds? still|given held": "pinned, fixed, supported",
    r"keep books|the books": "energy balance",
    r"law of contact": "contact law, contact parameters",
    r"led? through|leads? through": "cross, is blocked by",
    r"left out": "inactive, omitted, not reported",
    r"let(?:s)? go": "released",
    r"lets? nothing": "does not let ...",
    r"mends?|mended": "repairs",
    r"no unknown|that are none": "the noun",
    r"old factors?": "reused factorisation",
    r"pass(?:es)? through (?:each other|anything|itself|themselves)": "interpenetrate",
    r"rides? along|riding along": "is embedded",
    r"schemes?": "integrator(s)",
    r"step(?:s)? (?:that|whose size) follows? the error|follow(?:s)? the error": "adaptive step size",
    r"steps? in parts|in parts(?= where| \()": "step subdivision",
    r"(?<!in\s)(?<!last\s)places?(?! of)": "position",
    r"rounding": "round-off",
    r"stands inversion": "tolerates inversion",
    r"takes? a step": "computes, accepts a step",
    r"the same bits": "bit-identical",
    r"things?": "body, object",
    r"threshold speed of (?!friction|explicit)": "friction regularisation velocity",
    r"torture": "robustness",
    r"turned inside out|inside out": "inverted",
    r"watched steps?": "watchdog (non-monotone) line search",
    r"what holds|what is held|things that": "constraint, support; the noun",
    r"what is left": "residual, remainder",
    r"was lost": "dissipation",
    r"in play": "energy scale",
    r"whole steps?": "full step",
}

FENCE = re.compile(r"^( *)```[^\n]*\n.*?^\1```$", re.DOTALL | re.MULTILINE)
CODE = re.compile(r"`[^`]*`|\]\([^)]*\)|https?://\S+")
RULES = [
    (re.compile(r"\b(?:" + text.replace(" ", r"\s+") + r")\b", re.IGNORECASE), better)
    for text, better in PHRASES.items()
]


def blanked(text: str) -> str:
    """The text with code in place of blanks, so that lines keep their numbers."""
    for pattern in (FENCE, CODE):
        text = pattern.sub(lambda match: re.sub(r"[^\n]", " ", match[0]), text)
    return text


def found(text: str) -> list[tuple[int, str, str]]:
    """Line, phrase and replacement of every phrase in a page."""
    prose = blanked(text)
    hits = [(match, better) for rule, better in RULES for match in rule.finditer(prose)]
    rows = [(prose.count("\n", 0, match.start()) + 1, match[0], better) for match, better in hits]
    return sorted((line, " ".join(phrase.split()), better) for line, phrase, better in rows)


def main() -> int:
    guide = sorted((ROOT / "docs" / "guide").rglob("*.md"))
    pages = [Path(name).resolve() for name in sys.argv[1:]] or [ROOT / "README.md", *guide]
    names = [page.relative_to(ROOT).as_posix() for page in pages]
    chosen = [name for name in names if sys.argv[1:] or name not in PENDING]
    hits = [(name, *hit) for name in chosen for hit in found((ROOT / name).read_text())]
    for name, line, phrase, better in hits:
        print(f"{name}:{line}: {phrase!r}: write: {better}")
    print(f"{len(hits)} phrases in {len(chosen)} pages")
    return 1 if hits else 0


if __name__ == "__main__":
    sys.exit(main())
