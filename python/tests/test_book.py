"""Every code block of README and book runs, unchanged, and prints what the page states.

How blocks are marked: `book/pages.py`. What `sh` and `cargo` are: `book/reader.py`.
"""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from book.pages import ROOT, blocks, name, pages
from book.reader import Reader

#: Number of blocks that may be skipped, each with a reason.
EXCEPTIONS = 2
RUN = {"sh", "python", "toml", "text", "json"}
PAGES = [page for page in pages() if any(block.language in RUN for block in blocks(page))]


@pytest.mark.skipif(sys.platform == "win32", reason="the blocks are for a POSIX shell")
@pytest.mark.parametrize("page", PAGES, ids=name)
def test_a_page(page: Path, cli: Any, tmp_path: Path) -> None:
    wrong = []
    with Reader(tmp_path / "reader", Path(cli.binary).absolute()) as reader:
        for block in blocks(page):
            if block.language in RUN and not block.mark("not run"):
                try:
                    reader.take(block)
                except (AssertionError, subprocess.TimeoutExpired) as error:
                    wrong.append(f"{name(page)}:{block.line}: {error}")
    if wrong:
        pytest.fail("\n".join(wrong), pytrace=False)


def test_all_blocks_are_accounted_for() -> None:
    kinds = RUN | {"formula", "rust"}
    left_out = []
    tested = (ROOT / "crates" / "hoid" / "src" / "lib.rs").read_text(encoding="utf-8")
    for page in pages():
        for block in blocks(page):
            where = f"{name(page)}:{block.line}"
            assert block.language in kinds, f"{where}: a block of {block.language!r}"
            if block.mark("not run"):
                left_out.append(where)
            if block.language == "rust":
                assert name(page) in tested, f"{where}: the page is not among the tests of hoid"
    assert len(left_out) <= EXCEPTIONS, left_out
