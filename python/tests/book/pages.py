"""Pages, their code blocks, and the marks before them.

A mark is a comment of HTML, which readers do not see:

| mark | states |
|---|---|
| `<!-- file: NAME -->` | the block is the file of this name, which blocks after it use |
| `<!-- given: CODE -->` | what the reader has already: run before the block, with it |
| `<!-- then: CODE -->` | what shows that a file is right: run after the block |
| `<!-- picture: FILE => PICTURE -->` | the file that the block draws is this one of `docs/src/images`; with HOID_UPDATE_DOCS=1 it becomes it |
| `<!-- smaller: TEXT => OTHER -->` | run with OTHER in place of TEXT: the same in less time |
| `<!-- ends with: N -->` | the exit code of the block, where it is not 0 |
| `<!-- not run: REASON -->` | an exception; `test_book.py` counts them |

A block of `text` or `json` is what the block before it has printed, or what it is given by; what no
program prints is a `formula`. Blocks of `rust` are run by `cargo test`, as documentation of the crate `hoid`.

`python -m book` in `python/tests` lists all blocks.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from pathlib import Path

ROOT = Path(__file__).parents[3]
BOOK = ROOT / "docs" / "src"

#: Its blocks are the help of the commands; a test of `hoid-cli` compares the page with them.
GENERATED = {"docs/src/reference/command-line.md"}

FENCE = re.compile(r"^```(\S*)\s*$")
MARK = re.compile(r"<!--\s*(file|given|then|picture|smaller|ends with|not run):\s*(.*?)\s*-->", re.DOTALL)


@dataclass
class Block:
    """One code block, with the marks before it."""

    line: int
    language: str
    text: str
    marks: list[tuple[str, str]] = field(default_factory=list)

    def mark(self, name: str) -> str | None:
        return next((value for kind, value in self.marks if kind == name), None)

    def as_run(self) -> str:
        """The text, shortened if a mark specifies it."""
        text = self.text
        for kind, value in self.marks:
            if kind == "smaller":
                old, new = (side.strip() for side in value.split("=>"))
                assert old in text, f"line {self.line}: nothing states {old!r}, to be made smaller"
                text = text.replace(old, new)
        return text


def pages() -> list[Path]:
    """README, the README of the Python package, and the pages of the book."""
    found = [ROOT / "README.md", ROOT / "python" / "README.md", *sorted(BOOK.rglob("*.md"))]
    return [page for page in found if name(page) not in GENERATED]


def name(page: Path) -> str:
    return page.relative_to(ROOT).as_posix()


def blocks(page: Path) -> list[Block]:
    found: list[Block] = []
    lines = page.read_text(encoding="utf-8").splitlines()
    before = 0
    position = 0
    while position < len(lines):
        opened = FENCE.match(lines[position])
        position += 1
        if not opened:
            continue
        start = position
        while not FENCE.match(lines[position]):
            position += 1
        marks = MARK.findall("\n".join(lines[before : start - 1]))
        text = "\n".join(lines[start:position]) + "\n"
        found.append(Block(start, opened[1], text, marks))
        position += 1
        before = position
    return found
