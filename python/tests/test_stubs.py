"""Types: the stubs match the module, and type checkers accept what people write.

They check as the oldest supported Python would read it.
"""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

PACKAGE = Path(__file__).parents[1]


@pytest.fixture
def cache(tmp_path: Path) -> list[str]:
    return ["--cache-dir", str(tmp_path)]


def check(*arguments: str) -> None:
    quiet = {**os.environ, "PYTHONWARNINGS": "default"}
    done = subprocess.run(
        [sys.executable, "-m", *arguments],
        capture_output=True,
        text=True,
        check=False,
        cwd=PACKAGE,
        env=quiet,
    )
    assert done.returncode == 0, done.stdout + done.stderr


def test_the_stubs_are_those_of_the_module() -> None:
    check("mypy.stubtest", "pyhoid._pyhoid")


def test_mypy_accepts_the_package_and_its_use(cache: list[str]) -> None:
    check("mypy", *cache)


def test_pyright_accepts_the_package_and_its_use() -> None:
    check("basedpyright", "--pythonpath", sys.executable)
