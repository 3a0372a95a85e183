"""Remedies in messages use Python keywords, and work."""

from __future__ import annotations

import inspect
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import pyhoid
from pyhoid import _pyhoid, _settings

CRATES = Path(__file__).parents[2] / "crates"
# Libraries whose messages appear in Python.
LIBRARIES = ("hoid-io", "hoid-model", "hoid-ident", "hoid-track", "hoid-analysis")
# Options of the program only: its files, pages and output; and examples for developers.
# The help of `change` lists the options that the command rejects.
OF_THE_PROGRAM = {"figure", "horizon", "json", "report", "scenario", "validate"}


def table(path: Path, rows: list[tuple[Any, ...]]) -> Path:
    path.write_text("t,e,u\n" + "".join(",".join(map(str, row)) + "\n" for row in rows))
    return path


def rows() -> list[tuple[Any, ...]]:
    rng = np.random.default_rng(3)
    e, u = rng.normal(size=(2, 400)).cumsum(axis=1)
    return [(k / 50, a, b) for k, (a, b) in enumerate(zip(e, u, strict=True))]


def spoilt(how: str) -> list[tuple[Any, ...]]:
    all_rows = rows()
    if how == "twice":
        all_rows.insert(100, all_rows[99])
    elif how == "empty":
        all_rows[100] = (all_rows[100][0], "", all_rows[100][2])
    elif how == "sparse":
        all_rows = [(t, e if k % 2 == 0 else "", u) for k, (t, e, u) in enumerate(all_rows)]
    elif how == "still":
        all_rows[101] = (all_rows[100][0], *all_rows[101][1:])
    elif how == "gap":
        del all_rows[100:110]
    elif how == "trials":
        all_rows = [(k % 200 / 50, e, u) for k, (_, e, u) in enumerate(all_rows)]
    return all_rows


REMEDIES = [
    ("twice", "drop_repeated=True", {"drop_repeated": True}),
    ("empty", "fill=True", {"fill": True}),
    ("sparse", 'sparse={"e": "hold"}', {"sparse": {"e": "linear"}}),
    ("still", "sampling_frequency=50", {"sampling_frequency": 50.0}),
    ("gap", "resample=True", {"resample": True}),
    ("trials", 'trial="t=1"', {"trial": "t=1"}),
]


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize(("how", "remedy", "keywords"), REMEDIES, ids=[how for how, *_ in REMEDIES])
def test_a_remedy_that_is_named_helps(
    how: str, remedy: str, keywords: dict[str, Any], tmp_path: Path
) -> None:
    path = table(tmp_path / "run.csv", spoilt(how))
    with pytest.raises(pyhoid.errors.Error) as refused:
        pyhoid.read(path)
    assert remedy in str(refused.value)
    assert len(pyhoid.read(path, **keywords)) > 100


@pytest.mark.parametrize(
    ("typed", "said"),
    [
        ("give --fs HZ in place of t", "give sampling_frequency=HZ in place of t"),
        ("with --fs if t is wrong", "with sampling_frequency if t is wrong"),
        ("leave out with --from and --to", "leave out with start and stop"),
        ("--trial t, or --fill", 'trial="t", or fill=True'),
        ("name --time COLUMN:UNIT", "name time COLUMN:UNIT"),
        ("--scale e=rad, or --scale e=0.5,u=V", 'scale={"e": "rad"}, or scale={"e": 0.5, "u": "V"}'),
        ("--neuromuscular yes; a -- dash", 'neuromuscular="yes"; a -- dash'),
    ],
)
def test_an_option_is_a_keyword(typed: str, said: str) -> None:
    assert _pyhoid.in_python(typed) == said


def test_every_option_that_a_library_names_is_a_keyword() -> None:
    functions = [
        pyhoid.read,
        pyhoid.read_segments,
        pyhoid.read_trials,
        pyhoid.identify,
        pyhoid.track,
        pyhoid.describe,
        pyhoid.info,
    ]
    known = {name for function in functions for name in inspect.signature(function).parameters}
    for of in (_settings.BatchSettings, _settings.MethodSettings):
        known |= set(of.__annotations__)
    named: dict[str, Path] = {}
    for library in LIBRARIES:
        for path in (CRATES / library / "src").rglob("*.rs"):
            # Documentation and tests are excluded.
            code = path.read_text().split("#[cfg(test)]")[0]
            lines = [line for line in code.splitlines() if not line.strip().startswith("//")]
            for option in re.findall(r"--([a-z][a-z-]*)", "\n".join(lines)):
                named.setdefault(option, path)
    assert {"fs", "fill", "trial"} <= set(named)
    for option in sorted(set(named) - OF_THE_PROGRAM):
        keyword = re.split("[=,]", _pyhoid.in_python(f"--{option}"))[0]
        assert keyword in known, f"{keyword} of --{option} in {named[option]}"
