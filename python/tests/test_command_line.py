"""The same digits as the command line, for the same data and options."""

from __future__ import annotations

import csv
import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import pyhoid


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory, cli: Any) -> Path:
    path = tmp_path_factory.mktemp("runs") / "c4.csv"
    cli.run("simulate", "--condition", "C4", "--seed", 3, "--out", path)
    return path


def same(pair: Any, found: dict[str, Any]) -> None:
    assert pair.value == found["value"]
    assert pair.standard_error == found["standard_error"]


def same_fit(fit: pyhoid.Fit, found: dict[str, Any]) -> None:
    assert fit.structure == found["structure"]
    assert fit.orders == found["orders"]
    assert list(fit.parameters) == [p["name"] for p in found["parameters"]]
    for p in found["parameters"]:
        same(fit.estimates[p["name"]], p)
    assert fit.loss == found["loss"]
    assert fit.innovation_variance == found["innovation_variance"]
    for name in ("reason", "converged", "iterations"):
        assert fit.termination[name] == found["termination"][name]
    for name, value in fit.quality.items():
        assert value == found["fit"][name]
    for name, value in fit.criteria.items():
        assert value == found["fit"][name]
    operator = found["operator"]
    if operator is None:
        assert fit.operator is None
    elif not operator["convertible"]:
        assert fit.operator is not None and fit.operator.reason == operator["reason"]
    else:
        assert fit.operator is not None
        for name, pair in fit.operator.items():
            same(pair, operator[name])
    remnant = found["remnant"]
    if remnant is not None and remnant["convertible"]:
        assert fit.remnant is not None
        same(fit.remnant.T_n, remnant["T_n"])
        same(fit.remnant.K_n, remnant["K_n"])


def test_simulate(run: Path) -> None:
    record, simulated = pyhoid.read(run), pyhoid.simulate("C4", seed=3)
    assert record.names[:2] == ["e", "u"] and set(record.names) == set(simulated.names)
    for name in simulated.names:
        np.testing.assert_array_equal(record[name], simulated[name], err_msg=name)
    assert record.sample_time == simulated.sample_time == 0.01


@pytest.mark.parametrize(
    ("keywords", "options"),
    [
        ({"structure": "bj"}, ["--structure", "bj"]),
        ({"structure": "bj", "nk": 29, "nd": 2}, ["--nk", 29, "--orders", "nd=2"]),
        ({"structure": "arx", "nk": (20, 35)}, ["--structure", "arx", "--nk", "20..35"]),
        (
            {"structure": "armax", "na": 2, "nb": 2, "nc": 1, "nk": 29},
            ["--structure", "armax", "--orders", "na=2,nb=2,nc=1", "--nk", 29],
        ),
        (
            {"method": "rivbj", "nk": 29, "nd": 1},
            ["--method", "rivbj", "--nk", 29, "--orders", "nd=1"],
        ),
        (
            {"noise": "remnant", "remnant_order": 1},
            ["--noise", "remnant", "--remnant-order", 1],
        ),
        (
            {
                "structure": "bj",
                "nk": 29,
                "nd": 1,
                "robust": True,
                "fix": {"d1": -0.85},
                "bound": {"b0": (0, None)},
            },
            ["--nk", 29, "--orders", "nd=1", "--robust", "--fix", "d1=-0.85", "--bound", "b0=0.."],
        ),
    ],
)
def test_identify(run: Path, cli: Any, keywords: dict[str, Any], options: list[Any]) -> None:
    fit = pyhoid.identify(pyhoid.read(run), **keywords)
    found = cli.json("identify", run, *options)
    same_fit(fit, found)
    if not keywords:
        assert len(fit.candidates) == len(found["candidates"]) > 100
        assert [c["bic"] for c in fit.candidates] == [c["bic"] for c in found["candidates"]]


def test_identify_a_change(run: Path, cli: Any) -> None:
    fit = pyhoid.identify(pyhoid.read(run), change="sigmoid", delay=(0.27, 0.29))
    found = cli.json("identify", run, "--change", "sigmoid", "--delay", "0.27..0.29")
    assert isinstance(fit, pyhoid.TimeVaryingFit)
    for p in found["parameters"]:
        same(fit.estimates[p["name"]], p)
    assert fit.change["found"] == found["change"]["found"] is True
    assert fit.initial is not None
    same(fit.initial.K_e, found["initial"]["K_e"])


@pytest.mark.parametrize(
    ("keywords", "options"),
    [
        ({}, []),
        (
            {"method": "rls", "nk": 29, "memory": 256},
            ["--method", "rls", "--nk", 29, "--memory", 256],
        ),
        (
            {
                "method": "rpem",
                "nk": 29,
                "nd": 1,
                "memory_of": {"b": "2.56s", "f": "inf"},
                "covariance": 0.1,
                "moving_average": 0.5,
            },
            [
                *("--method", "rpem", "--nk", 29, "--orders", "nd=1"),
                *("--memory-of", "b=2.56s,f=inf", "--covariance", 0.1, "--moving-average", 0.5),
            ],
        ),
        ({"method": "multiple-model", "nk": 29}, ["--method", "multiple-model", "--nk", 29]),
        (
            {"method": "multiple-model", "nk": 29, "smooth": True},
            ["--method", "multiple-model", "--nk", 29, "--smooth"],
        ),
        (
            {"method": "rriv", "nk": 29, "nd": 1, "every": 7},
            ["--method", "rriv", "--nk", 29, "--orders", "nd=1", "--every", 7],
        ),
    ],
)
def test_track(
    run: Path, cli: Any, tmp_path: Path, keywords: dict[str, Any], options: list[Any]
) -> None:
    trace = pyhoid.track(pyhoid.read(run), **keywords)
    file = tmp_path / "trace.csv"
    found = cli.json("track", run, *options, "--out", file)
    rows = list(
        csv.reader(line for line in file.read_text().splitlines() if not line.startswith("#"))
    )
    assert rows[0] == list(trace.columns)
    assert len(rows) - 1 == len(trace) == found["rows"]
    for i, name in enumerate(rows[0]):
        column = np.array([float(row[i]) if row[i] else math.nan for row in rows[1:]])
        np.testing.assert_array_equal(trace[name], column, err_msg=name)
    assert trace.counts["steps_shortened"] == found["steps_shortened"]
    assert [change["t"] for change in trace.changes] == [
        change["t"] for change in found.get("changes", [])
    ]
    own = json.loads(trace.to_json())
    for key in ("kind", "verdict", "last", "updated_from", "rows", "faults", "rms_relative_error"):
        assert own[key] == found[key], key
    # `adaptive` starts without a fit.
    started = None if trace.start is None else trace.start.orders
    assert (found["start"] and found["start"]["orders"]) == started
    assert (started is None) == (keywords == {})


def test_convert_and_margins(cli: Any) -> None:
    found = cli.json("convert", "--f", "-1.91,0.92", "--b", "0.044,-0.043", "--nk", 29)
    here = pyhoid.convert(f=(-1.91, 0.92), b=(0.044, -0.043), nk=29)
    for name, pair in here.operator.items():
        assert pair.value == found["operator"][name]["value"]
    back = cli.json(
        "convert", "--operator", "K_e=.09,K_e_dot=.036,omega_nm=11.25,zeta_nm=.35,tau_e=.28"
    )
    discrete = pyhoid.convert(
        operator={"K_e": 0.09, "K_e_dot": 0.036, "omega_nm": 11.25, "zeta_nm": 0.35, "tau_e": 0.28}
    )
    assert [*discrete.f] == back["discrete"]["f"] and [*discrete.b] == back["discrete"]["b"]
    transfer = cli.json("convert", "--transfer-function", "1,2/1,3,4", "--method", "tustin")
    num, den, _ = pyhoid.discretise([1, 2], [1, 3, 4], method="tustin")
    assert (
        num.tolist() == transfer["transfer_function"]["num"]
        and den.tolist() == transfer["transfer_function"]["den"]
    )
    printed = cli.json("margins", "--condition", "C2", "--noise-levels", "0.1,0.5")
    lowest = printed.pop("crossovers")[0]
    assert lowest["phase_margin_deg"] == pytest.approx(printed["phase_margin_deg"], rel=1e-9)
    assert pyhoid.margins("C2", noise_levels=[0.1, 0.5]) == printed


def test_stream_and_tracker(run: Path, cli: Any) -> None:
    record = pyhoid.read(run)
    tracker = pyhoid.Tracker("rpem", nk=29, nd=1, sample_time=0.01)
    tracker.update(record.e, record.u)
    import json
    import subprocess

    lines = "".join(f"{e!r},{u!r}\n" for e, u in zip(record.e.tolist(), record.u.tolist()))
    done = subprocess.run(
        [cli.binary, *"stream --method rpem --nk 29 --orders nd=1 --fs 100 --every 1000".split()],
        input=lines,
        capture_output=True,
        text=True,
        check=True,
    )
    last = json.loads(done.stdout.splitlines()[-1])
    again = pyhoid.Tracker("rpem", nk=29, nd=1, sample_time=0.01)
    again.update(record.e[:8000], record.u[:8000])
    for name, value in last["parameters"].items():
        number = value["value"] if isinstance(value, dict) else value
        assert again.estimates[name].value == number
