"""A reader with a new folder, who types the blocks of a page from top to bottom.

Every block of `sh` has a shell of its own, the blocks of `python` of a page one interpreter. `hoid`
is the program of the tests. `cargo` is a small program in its place (`cargo.py`), so that nothing is
compiled again for release.
"""

from __future__ import annotations

import json
import os
import re
import shlex
import subprocess
import sys
from decimal import Decimal
from pathlib import Path
from types import TracebackType
from typing import Any

from .pages import BOOK, ROOT, Block

#: No block takes longer than this, in s.
PATIENCE = 400


class Reader:
    def __init__(self, folder: Path, program: Path) -> None:
        self.folder = folder
        self.printed = ""
        self.output = folder.with_name(folder.name + ".txt").open("w+", encoding="utf-8")
        programs = folder.with_name(folder.name + "-bin")
        for directory in (folder, programs):
            directory.mkdir()
        # Files of the repository that blocks refer to.
        for part in ("fixtures", "crates", "python"):
            (folder / part).symlink_to(ROOT / part)
        (programs / "hoid").symlink_to(program)
        cargo = programs / "cargo"
        script = shlex.quote(str(Path(__file__).with_name("cargo.py")))
        cargo.write_text(f'#!/bin/sh\nexec {shlex.quote(sys.executable)} {script} "$@"\n')
        cargo.chmod(0o755)
        beside = Path(sys.executable).parent
        # The pages keep their width: pytest-xdist sets a width for its workers.
        self.environment = {
            **{name: value for name, value in os.environ.items() if name != "COLUMNS"},
            "PATH": os.pathsep.join([str(programs), str(beside), os.environ["PATH"]]),
            "HOID_BINARY": str(program),
            "MPLBACKEND": "Agg",
        }
        self.interpreter: subprocess.Popen[str] | None = None

    def __enter__(self) -> Reader:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, what: BaseException | None, at: TracebackType | None
    ) -> None:
        if self.interpreter:
            self.interpreter.communicate()
            self.answers.close()
        self.output.close()

    def take(self, block: Block) -> None:
        """Executes a block as a reader would."""
        given, file = block.mark("given") or "", block.mark("file")
        if file:
            self.shell(given)
            place = self.folder / file
            place.parent.mkdir(parents=True, exist_ok=True)
            place.write_text(block.as_run(), encoding="utf-8")
        elif block.language == "sh":
            self.shell(given + "\n" + block.as_run(), int(block.mark("ends with") or 0))
        elif block.language == "python":
            self.python(given)
            self.python(block.as_run())
        elif block.language == "text":
            if given:
                self.shell(given)
            lines_are_in(block.text, self.printed)
        elif block.language == "json":
            rows = [json.loads(line) for line in self.printed.splitlines() if line[:1] == "{"]
            for shown in block.text.splitlines():
                expected = json.loads(shown, parse_float=Decimal)
                assert any(agree(expected, row) for row in rows), (
                    f"no line of the output is {shown}"
                )
        else:
            what = "state by a mark which file it is" if block.language == "toml" else "no such block"
            raise AssertionError(f"a block of {block.language!r}: {what}")
        then = block.mark("then")
        if then:
            self.shell(then)
        for kind, value in block.marks:
            if kind == "picture":
                self.picture(*(side.strip() for side in value.split("=>")))

    def picture(self, file: str, picture: str) -> None:
        """Checks that a block drew the picture of the book; elsewhere the last digits may differ."""
        drawn, shown = self.folder / file, BOOK / "images" / picture
        assert drawn.exists(), f"no picture {file}"
        if os.environ.get("HOID_UPDATE_DOCS"):
            shown.write_bytes(drawn.read_bytes())
        elif sys.platform == "linux":
            same = shown.exists() and drawn.read_bytes() == shown.read_bytes()
            assert same, f"{file} is no longer images/{picture}: HOID_UPDATE_DOCS=1 renews it"

    def shell(self, code: str, expected: int = 0) -> None:
        done = subprocess.run(
            ["bash", "-euo", "pipefail", "-c", code],
            cwd=self.folder,
            env=self.environment,
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            timeout=PATIENCE,
            check=False,
        )
        self.printed = done.stdout + done.stderr
        assert done.returncode == expected, f"exit code {done.returncode}:\n{self.printed[-3000:]}"

    def python(self, code: str) -> None:
        if self.interpreter is None:
            reading, writing = os.pipe()
            self.interpreter = subprocess.Popen(
                [sys.executable, str(Path(__file__).with_name("interpreter.py")), str(writing)],
                cwd=self.folder,
                env=self.environment,
                stdin=subprocess.PIPE,
                stdout=self.output,
                stderr=subprocess.STDOUT,
                text=True,
                pass_fds=[writing],
            )
            os.close(writing)
            self.answers = os.fdopen(reading)
        assert self.interpreter.stdin
        here = self.output.seek(0, os.SEEK_END)
        self.interpreter.stdin.write(json.dumps(code) + "\n")
        self.interpreter.stdin.flush()
        answer = self.answers.readline()
        wrong = json.loads(answer) if answer else "the interpreter has ended"
        assert wrong is None, wrong
        self.output.seek(here)
        self.printed = self.output.read()


def lines_are_in(shown: str, printed: str) -> None:
    """Each line that a page shows was printed, in that order; `...` represents anything."""
    lines = iter(printed.splitlines())
    for line in filter(str.strip, shown.splitlines()):
        parts = map(re.escape, line.rstrip().split("..."))
        pattern = re.compile(".*".join(parts) + r"\s*")
        if not any(pattern.fullmatch(found) for found in lines):
            raise AssertionError(f"not printed, or not here:\n{line}\nbut:\n{printed[-6000:]}")


def agree(shown: Any, found: Any) -> bool:
    """A line of JSON as a page shows it: with its digits, and `"...": {}` for the rest."""
    if isinstance(shown, dict):
        keys = [key for key in shown if key != "..."]
        same = isinstance(found, dict) and (len(keys) < len(shown) or set(found) == set(keys))
        return same and all(key in found and agree(shown[key], found[key]) for key in keys)
    if isinstance(shown, list):
        return (
            isinstance(found, list) and len(shown) == len(found) and all(map(agree, shown, found))
        )
    if isinstance(shown, Decimal):
        digits = -int(shown.as_tuple().exponent)
        return isinstance(found, float) and round(found, digits) == float(shown)
    return bool(shown == found)
