"""`pyhoid.identify` is `hoid identify`: the same default, the same digits, the same verdict word for word."""

from __future__ import annotations

from contextlib import nullcontext
from collections.abc import Callable
import json
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

import pyhoid

pytestmark = pytest.mark.filterwarnings("ignore::UserWarning")

Signals = tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]


def _frozen(e: npt.NDArray[np.float64], u: npt.NDArray[np.float64]) -> Signals:
    e = e.copy()
    e[2000:2300] = e[2000]
    return e, u


def _spikes(e: npt.NDArray[np.float64], u: npt.NDArray[np.float64]) -> Signals:
    e, u = e.copy(), u.copy()
    u[1500], e[3500] = 4.0, -30.0
    return e, u


#: Problems of a recording; the last is a stick with an offset and another unit.
RECORDED: dict[str, Callable[..., Signals]] = {
    "as recorded": lambda e, u: (e, 12.5 * (u + 0.05)),
    "clipped": lambda e, u: (e, np.clip(u, -0.086, 0.086)),
    "coarse": lambda e, u: (e, np.round(u / 0.02) * 0.02),
    "frozen": _frozen,
    "spikes": _spikes,
    "reversed": lambda e, u: (-e, u),
}


@pytest.fixture(scope="module")
def runs() -> list[pyhoid.Record]:
    return [pyhoid.simulate("C1", seed=seed) for seed in (1, 2)]


def spoilt(record: pyhoid.Record, how: str) -> pyhoid.Record:
    assert record.e is not None
    e, u = RECORDED[how](record.e, record.u)
    return pyhoid.Record(e=e, u=u, sample_time=record.sample_time)


def same(person: pyhoid.OperatorFit, found: dict[str, Any], where: str) -> None:
    def bare(words: list[str]) -> list[str]:
        return [one.replace(where, "").replace(".csv", "") for one in words]

    assert person.form == found["form"]
    assert person.verdict.level == found["verdict"]["level"]
    assert bare(person.verdict.reasons) == bare(found["verdict"]["reasons"])
    assert bare(person.verdict.notes) == bare(found["verdict"]["notes"])
    assert list(person.parameters) == [p["name"] for p in found["parameters"]]
    for p in found["parameters"]:
        here = person.parameters[p["name"]]
        assert (here.value, here.standard_error) == (p["value"], p["standard_error"])
        assert here.determined == p["determined"]
    assert person.loss == found["loss"]


@pytest.mark.parametrize("how", RECORDED)
def test_a_recording_has_one_verdict(
    how: str, runs: list[pyhoid.Record], tmp_path: Path, cli: Any
) -> None:
    path = tmp_path / "run.csv"
    pyhoid.write(path, spoilt(runs[0], how))
    found = cli.json("identify", path, "--controlled-element", "90/(s(s+6))")
    record = pyhoid.read(path)
    person = pyhoid.identify(record, controlled_element="90/(s(s+6))")
    assert isinstance(person, pyhoid.OperatorFit)
    same(person, found, f"{tmp_path}/")
    assert str(person).startswith(f"Verdict: {person.verdict.level}")
    # Another name of the same call.
    again = pyhoid.identify_operator(record, controlled_element="90/(s(s+6))")
    assert again.parameters == person.parameters and again.verdict == person.verdict


#: Every other estimator: keywords of Python, options of the command line.
OTHERS: dict[str, tuple[dict[str, Any], list[str]]] = {
    "bj": (
        {"structure": "bj", "nk": 29, "nd": 1},
        ["--structure", "bj", "--nk", "29", "--orders", "nd=1"],
    ),
    "sriv": ({"method": "sriv", "nk": 29}, ["--method", "sriv", "--nk", "29"]),
    "remnant": ({"noise": "remnant", "remnant_order": 1}, ["--noise", "remnant", "--remnant-order", "1"]),
    "sigmoid": ({"change": "sigmoid"}, ["--change", "sigmoid"]),
}


@pytest.mark.parametrize("estimator", OTHERS)
@pytest.mark.parametrize("how", ["as recorded", "clipped", "spikes"])
def test_so_it_is_by_every_estimator(
    how: str, estimator: str, runs: list[pyhoid.Record], tmp_path: Path, cli: Any
) -> None:
    path = tmp_path / "run.csv"
    pyhoid.write(path, spoilt(runs[0], how))
    keywords, options = OTHERS[estimator]
    found = cli.json("identify", path, *options)
    fit = pyhoid.identify(pyhoid.read(path), **keywords)
    assert (fit.verdict.level, fit.verdict.reasons, fit.verdict.notes) == (
        found["verdict"]["level"],
        found["verdict"]["reasons"],
        found["verdict"]["notes"],
    )
    assert fit.loss == found["loss"]
    assert [fault["words"] for fault in fit.faults] == [fault["words"] for fault in found["faults"]]
    assert pyhoid.from_json(fit.to_json()).faults == fit.faults
    told = found["records"][0].get("level")
    if told is not None:
        assert fit.levels[0] is not None and fit.levels[0].value == told["value"]
    if how == "clipped":
        assert "is saturated in" in fit.verdict.reasons[0]
        assert "saturated" in [fault["kind"] for fault in fit.faults]


@pytest.mark.parametrize("how", ["as recorded", "clipped", "spikes"])
def test_a_description_is_that_of_the_program(
    how: str, runs: list[pyhoid.Record], tmp_path: Path, cli: Any
) -> None:
    path = tmp_path / "run.csv"
    spoilt_run = spoilt(runs[0], how)
    run = pyhoid.Record(
        e=spoilt_run.e, u=spoilt_run.u, f_t=runs[0]["f_t"], sample_time=spoilt_run.sample_time
    )
    pyhoid.write(path, run)
    printed = cli.json("describe", path, "--excitation", "f_t")
    found = pyhoid.describe(pyhoid.read(path), excitation="f_t")
    written = json.loads(found.to_json())
    assert written["kind"] == printed["kind"] == "description"
    assert written["lines"] == printed["lines"]
    for key in ("level", "reasons", "notes"):
        assert written["verdict"][key] == printed["verdict"][key]
    assert (found.verdict, found.reasons) == (printed["verdict"]["level"], printed["verdict"]["reasons"])
    if how == "spikes":
        assert found.faults, "they were searched for and bridged"


def test_a_trace_hears_of_its_channels(
    runs: list[pyhoid.Record], tmp_path: Path, cli: Any
) -> None:
    path = tmp_path / "run.csv"
    pyhoid.write(path, spoilt(runs[0], "clipped"))
    found = cli.json("track", path, "--out", tmp_path / "trace.csv")
    trace = pyhoid.track(pyhoid.read(path))
    assert trace.verdict.reasons == found["verdict"]["reasons"]
    assert "is saturated in" in trace.verdict.reasons[0]


def test_two_runs_with_a_stick_at_its_end_are_doubtful(
    runs: list[pyhoid.Record], tmp_path: Path, cli: Any
) -> None:
    paths = [tmp_path / f"run{k}.csv" for k in (1, 2)]
    for path, record in zip(paths, runs):
        pyhoid.write(path, spoilt(record, "clipped"))
    person = pyhoid.identify([pyhoid.read(path) for path in paths])
    assert person.verdict.level == "doubtful"
    assert "run1: u is saturated in" in person.verdict.reasons[0]
    same(person, cli.json("identify", *paths), f"{tmp_path}/")
    # The polynomials are fitted to the same recordings.
    fit = pyhoid.identify([pyhoid.read(path) for path in paths], "bj", nk=29, nd=1)
    assert "is saturated in" in fit.verdict.reasons[0]


def test_a_run_that_is_given_twice_is_refused(runs: list[pyhoid.Record]) -> None:
    with pytest.raises(pyhoid.DataError, match="hold the same samples"):
        pyhoid.identify([runs[0], runs[0]])
    with pytest.raises(pyhoid.DataError, match="hold the same samples"):
        pyhoid.identify([runs[0], runs[0]], "arx", nk=29)


def test_what_is_fitted_is_told_from_the_options(runs: list[pyhoid.Record]) -> None:
    record = runs[0]
    assert isinstance(pyhoid.identify(record, nk=29, nd=1), pyhoid.Fit)
    assert isinstance(pyhoid.identify(record, method="sriv", nk=29), pyhoid.Fit)
    for name in ("operator", "family", "grey-box", "grey_box"):
        earlier = pytest.warns(DeprecationWarning, match="is now called operator")
        with nullcontext() if name == "operator" else earlier:
            person = pyhoid.identify(record, name, form="lead", nd=2)
        assert isinstance(person, pyhoid.OperatorFit) and person.form == "lead"
    with pytest.warns(DeprecationWarning, match="noise remnant"):
        remnant = pyhoid.identify(record, remnant_order=1)
    assert isinstance(remnant, pyhoid.Fit) and remnant.structure == "operator"
    with pytest.raises(pyhoid.OptionError, match="nk applies only to"):
        pyhoid.identify(record, "operator", nk=29)
    with pytest.raises(pyhoid.OptionError, match="excitation applies only to"):
        pyhoid.identify(record, "bj", excitation="f_t")
