"""The golden set in Python: recorded answers of `pyhoid`, for the calls of the same list.

`fixtures/golden/calls.toml` lists inputs and calls, `fixtures/golden/python/` holds an answer each.
`HOID_UPDATE_GOLDEN=1 cargo xtask python tests/test_golden.py` renews the answers.
"""

from __future__ import annotations

import inspect
import json
import math
import os
import sys
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import pytest

import pyhoid

if sys.version_info < (3, 11):
    pytest.skip("tomllib comes with Python 3.11", allow_module_level=True)

import tomllib

pytestmark = [
    # The inputs are made once.
    pytest.mark.xdist_group("golden"),
    # Problems of an input are reported as warnings when it is read.
    pytest.mark.filterwarnings("ignore::UserWarning"),
]

GOLDEN = Path(__file__).parents[2] / "fixtures" / "golden"
MANIFEST = tomllib.loads((GOLDEN / "calls.toml").read_text(encoding="utf-8"))
CALLS = [call for call in MANIFEST["call"] if "python" in call]
#: Longer lists are truncated.
LONG = 24
#: Smaller numbers are rounding errors and count as zero.
NOTHING = 1e-15

Rows = list[list[float | None]]


def changed(text: str, made: Mapping[str, Any]) -> str:
    """Applies changes to the columns and rows of a table, as in the tests of the command line."""
    lines = [line for line in text.splitlines() if not line.startswith("#")]
    names = lines[0].split(",")
    places = [names.index(name) for name in made["columns"]]
    rows: Rows = []
    for line in lines[1:]:
        cells = line.split(",")
        rows.append([float(cells[c]) if cells[c] else None for c in places])
    if "rows" in made:
        rows = rows[made["rows"][0] : made["rows"][1]]
    header = list(made["columns"])
    for change in made.get("change", []):
        apply(change.split(" "), header, rows)

    def cell(value: float | None) -> str:
        return "" if value is None else repr(value)

    return "\n".join([",".join(header), *(",".join(map(cell, row)) for row in rows)]) + "\n"


def apply(words: list[str], header: list[str], rows: Rows) -> None:
    kind = words[0]
    if kind == "gap":
        del rows[int(words[1]) : int(words[2])]
        return
    if kind == "repeat":
        rows.insert(int(words[1]), list(rows[int(words[1])]))
        return
    column = header.index(words[1])
    if kind == "rename":
        header[column] = words[2]
        return
    each: dict[str, Callable[[float, float], float]] = {
        "clip": lambda v, x: min(max(v, -x), x),
        "scale": lambda v, x: v * x,
        "add": lambda v, x: v + x,
        "round": lambda v, x: round(v / x) * x,
    }
    if kind in each:
        for row in rows:
            value = row[column]
            row[column] = None if value is None else each[kind](value, float(words[2]))
    elif kind in ("hold", "blank"):
        held = rows[int(words[2])][column] if kind == "hold" else None
        for row in rows[int(words[2]) : int(words[3])]:
            row[column] = held
    elif kind == "set":
        rows[int(words[2])][column] = float(words[3])
    elif kind == "late":
        late = int(words[2])
        values = [row[column] for row in rows]
        for row, value in zip(rows[late:], values, strict=False):
            row[column] = value
    else:
        raise ValueError(f"no such change: {kind}")


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory, cli: Any) -> Path:
    """The inputs that the calls in Python need."""
    at = tmp_path_factory.mktemp("golden")
    needed = {file for call in CALLS for file in call["python"].get("records", [])}
    made = {one["file"]: one for one in MANIFEST["input"]}
    while more := {made[file]["of"] for file in needed if "of" in made[file]} - needed:
        needed |= more
    for one in MANIFEST["input"]:
        file = at / one["file"]
        if "text" in one:
            file.write_text(one["text"], encoding="utf-8")
        elif one["file"] not in needed:
            continue
        elif "simulate" in one:
            options = [
                str(at / word) if word.endswith(".toml") else word
                for word in one["simulate"].split()
            ]
            cli.run("simulate", *options, "--out", file)
        else:
            text = (at / one["of"]).read_text(encoding="utf-8")
            file.write_text(changed(text, one), encoding="utf-8")
    return at


def plain(value: Any) -> Any:
    """A result as JSON: numbers with twelve digits, and eight entries of long lists."""
    if value is None or isinstance(value, (str, bool, int)):
        return value
    if isinstance(value, float):
        return float(f"{value:.11e}") if math.isfinite(value) else str(value)
    if isinstance(value, complex):
        return [plain(value.real), plain(value.imag)]
    if isinstance(value, pyhoid.Estimate):
        return {"value": plain(value.value), "standard_error": plain(value.standard_error)}
    if isinstance(value, Mapping):
        return {str(key): plain(one) for key, one in value.items()}
    if hasattr(value, "tolist"):
        return plain(value.tolist())
    if isinstance(value, (list, tuple)):
        if len(value) > LONG:
            step = -(-len(value) // 8)
            return {"length": len(value), "kept": [plain(one) for one in value[::step]]}
        return [plain(one) for one in value]
    if isinstance(value, pyhoid.Verdict):
        return {"level": value.level, "reasons": plain(value.reasons)}
    if hasattr(value, "items"):
        return {str(key): plain(one) for key, one in value.items()}
    return repr(value)


#: Attributes of a result that are recorded in addition to its type.
KEPT = (
    "structure",
    "form",
    "orders",
    "estimates",
    "loss",
    "innovation_variance",
    "termination",
    "quality",
    "operator",
    "remnant",
    "levels",
    "delay_interval",
    "change",
    "changes",
    "initial",
    "last",
    "figures",
    "counts",
    "method",
    "faults",
    "verdict",
    "reasons",
    "phase_deg",
    "open_loop",
    "remnant_share",
    "noise_ratio",
    "excitation",
    "period",
    "sample_time",
)


def answer(result: Any) -> dict[str, Any]:
    found: dict[str, Any] = {"type": type(result).__name__}
    if hasattr(result, "to_json"):
        of_json = json.loads(result.to_json())
        found["json"] = plain({name: of_json[name] for name in of_json if name not in ("hoid", "state")})
    for name in KEPT:
        value = getattr(result, name, None)
        if value is not None and not inspect.ismethod(value):
            found[name] = plain(value)
    if isinstance(result, (pyhoid.Trace, pyhoid.Record)):
        names = result.names if isinstance(result, pyhoid.Record) else result.columns
        found["columns"] = {name: plain(result[name][::500]) for name in names}
    if isinstance(result, Mapping):
        found["values"] = plain(result)
    return found


def changes(key: str, was: Any, now: Any, tolerance: float) -> list[str]:
    """The differences, with old and new values."""
    if isinstance(was, dict) and isinstance(now, dict):
        return [
            line
            for name in sorted(was.keys() | now.keys())
            for line in changes(f"{key}.{name}", was.get(name), now.get(name), tolerance)
        ]
    if isinstance(was, list) and isinstance(now, list) and len(was) == len(now):
        pairs = enumerate(zip(was, now, strict=True))
        return [line for k, (a, b) in pairs for line in changes(f"{key}[{k}]", a, b, tolerance)]
    if isinstance(was, float) and isinstance(now, float):
        scale = max(abs(was), abs(now))
        if abs(was - now) <= tolerance * scale or scale < NOTHING:
            return []
    return [] if was == now else [f"{key}: was {was!r:.300}, now {now!r:.300}"]


@pytest.mark.parametrize("call", CALLS, ids=[call["name"] for call in CALLS])
def test_answer_is_what_it_was(call: dict[str, Any], folder: Path) -> None:
    keywords = dict(call["python"])
    function = getattr(pyhoid, keywords.pop("function"))
    records = [pyhoid.read(folder / file) for file in keywords.pop("records", [])]
    keywords = {
        name: tuple(value) if isinstance(value, list) else value for name, value in keywords.items()
    }
    # A single record is passed as such, several records as a list.
    given = [records[0] if len(records) == 1 else records] if records else []
    now = json.loads(json.dumps(answer(function(*given, **keywords))))
    file = GOLDEN / "python" / f"{call['name']}.json"
    if os.environ.get("HOID_UPDATE_GOLDEN"):
        file.parent.mkdir(exist_ok=True)
        lines = ",\n".join(f"{json.dumps(key)}: {json.dumps(now[key])}" for key in now)
        file.write_text(f"{{\n{lines}\n}}\n", encoding="utf-8")
    was = json.loads(file.read_text(encoding="utf-8")) if file.exists() else None
    moved = changes(call["name"], was, now, call.get("tolerance", MANIFEST["tolerance"]))
    assert not moved, "renew by HOID_UPDATE_GOLDEN=1 what is meant:\n" + "\n".join(moved)
