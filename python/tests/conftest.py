"""Shared fixtures: runs that are simulated once, and the command line for comparison."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
from pathlib import Path
from typing import Any

import pytest

import pyhoid

os.environ.setdefault("MPLBACKEND", "Agg")


#: Modules with the longest tests, which start first so that no processor waits for them at the end.
LONGEST = ("test_stubs.py", "test_book.py", "test_pages.py")


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    place = {name: number for number, name in enumerate(LONGEST)}
    items.sort(key=lambda item: place.get(item.path.name, len(place)))


@pytest.fixture(scope="session")
def c1() -> pyhoid.Record:
    return pyhoid.simulate("C1", seed=1)


@pytest.fixture(scope="session")
def c4() -> pyhoid.Record:
    return pyhoid.simulate("C4", seed=1)


@pytest.fixture(scope="session")
def fit(c1: pyhoid.Record) -> pyhoid.Fit:
    return pyhoid.identify(c1, "bj", nb=2, nd=1, nf=2, nk=29)


@pytest.fixture
def group_results(tmp_path: Path) -> Path:
    """Results of a group of four people in two conditions."""
    people = [
        {
            "subject": subject,
            "condition": condition,
            "run": "all",
            "runs": 5,
            "form": "lead",
            "parameters": {"tau_e": {"value": 0.6 / crossover, "standard_error": 0.01}},
            "open_loop": {"crossover_rad_s": {"value": crossover, "standard_error": 0.1}},
            "verdict": {"level": "trustworthy", "reasons": []},
        }
        for subject, fo, so in [("P03", 2.0, 1.2), ("P05", 4.0, 3.3), ("P09", 3.0, 2.6), ("P11", 3.1, 2.2)]
        for condition, crossover in [("fo", fo), ("so", so)]
    ]
    path = tmp_path / "results.json"
    path.write_text(json.dumps({"group": "pilots", "people": people}))
    return path


class CommandLine:
    """The binary built from the same sources; `cargo xtask test` gives its path in HOID_BINARY."""

    def __init__(self, binary: str) -> None:
        self.binary = binary

    def run(self, *arguments: Any) -> str:
        done = subprocess.run(
            [self.binary, *map(str, arguments)], capture_output=True, text=True, check=False
        )
        assert done.returncode == 0, done.stderr
        return done.stdout

    def json(self, *arguments: Any) -> Any:
        return json.loads(self.run(*arguments, "--json"))


@pytest.fixture(scope="session")
def cli() -> CommandLine:
    built = Path(__file__).parents[2] / "target" / "debug" / "hoid"
    binary = os.environ.get("HOID_BINARY") or (
        str(built) if built.exists() else shutil.which("hoid")
    )
    if not binary:
        pytest.skip(
            "no hoid binary: build it by cargo build -p hoid-cli, or name it in HOID_BINARY"
        )
    return CommandLine(binary)
