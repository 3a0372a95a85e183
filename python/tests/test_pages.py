"""Outputs of the command line from Python: pages, groups, reproduction, contents of a file."""

from __future__ import annotations

import hashlib
import inspect
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import pyhoid
from pyhoid._recursion import KEYWORDS


def test_the_page_of_a_fit(fit: pyhoid.Fit, tmp_path: Path) -> None:
    page = fit.report(tmp_path / "fit", controlled_element=([10.0], [1.0, 0.2, 0.0]))
    text = page.read_text()
    assert page.name == "report.html" and "<svg" in text and "phase margin" in text
    # The settings in use, and the true values of a simulated run.
    assert "largest number of steps" in text and "true" in text.lower()
    assert (
        fit.report(tmp_path / "again", controlled_element=([10.0], [1.0, 0.2, 0.0])).read_bytes()
        == page.read_bytes()
    )


def test_the_page_of_a_fit_out_of_nothing(c1: pyhoid.Record, tmp_path: Path) -> None:
    trace = pyhoid.track(c1, "rls", nk=29, na=2, nb=2, every=64)
    assert trace.start is not None and trace.start.report(tmp_path).exists()
    tracker = pyhoid.Tracker("rls", nk=29, na=2, nb=2, record=c1)
    assert tracker.start_fit is not None
    with pytest.raises(pyhoid.DataError, match="no records"):
        tracker.start_fit.report(tmp_path)


def test_the_page_of_a_trace(c4: pyhoid.Record, tmp_path: Path) -> None:
    trace = pyhoid.track(c4, "physical", nk=29, nd=1, every=16)
    text = trace.report(tmp_path, title="A change").read_text()
    assert "<h1>A change" in text and "Innovations over time" in text
    assert trace.settings["every"] == 16 and "every" in text


def digests(directory: Path, kind: str) -> dict[str, str]:
    return {
        file.name: hashlib.sha256(file.read_bytes()).hexdigest()
        for file in sorted(directory.glob(kind))
    }


def test_virtual_people(cli: Any, tmp_path: Path) -> None:
    arguments = "simulate-group --people --subjects 1 --runs 2 --plants integrator --out"
    cli.run(*arguments.split(), tmp_path / "runs")
    assert pyhoid.simulate_people(tmp_path / "same", subjects=1, runs=2, plants=["integrator"]) == 2
    assert digests(tmp_path / "same", "*.csv") == digests(tmp_path / "runs", "*.csv")
    run = pyhoid.read(tmp_path / "same" / "S1_integrator_1.csv")
    assert len(run) == 2400
    with pytest.raises(pyhoid.OptionError, match="double-integrator"):
        pyhoid.simulate_people(tmp_path / "other", plants=["1/s"])


def test_a_virtual_experiment_and_its_pages(cli: Any, tmp_path: Path) -> None:
    cli.run(
        *"simulate-group --subjects 2 --runs 2 --conditions C1 --out".split(), tmp_path / "runs"
    )
    assert pyhoid.simulate_group(tmp_path / "same", subjects=2, runs=2, conditions=["C1"]) == 4
    assert digests(tmp_path / "same", "*.csv") == digests(tmp_path / "runs", "*.csv")
    with pytest.raises(pyhoid.StudyStateError, match="already holds"):
        pyhoid.simulate_group(tmp_path / "same")
    with pytest.raises(pyhoid.OptionError, match="jitter"):
        pyhoid.simulate_group(tmp_path / "other", trouble=["noise"])
    found = pyhoid.group(tmp_path / "runs", tmp_path / "group")
    assert [page.name for page in found.pages] == [
        "report.html",
        "subject-S1.html",
        "subject-S2.html",
    ]
    cli.run("group", tmp_path / "runs", "--out", tmp_path / "by-cli")
    assert digests(tmp_path / "group", "*.html") == digests(tmp_path / "by-cli", "*.html")
    assert digests(tmp_path / "group", "*.parquet") == digests(tmp_path / "by-cli", "*.parquet")


def test_the_reproduction(cli: Any, tmp_path: Path) -> None:
    made = pyhoid.reproduce(tmp_path / "out", only=["table-2", "fig-3", "fig-11"], replications=2)
    assert made.page.exists() and made.claims is None
    assert set(made.figures) == {"fig-3", "fig-11"} and {"table-2", "fig-3", "fig-11"} <= set(
        made.tables
    )
    assert len(made.studies) == 1 and "<svg" in made.figures["fig-11"].read_text()
    options = "--only table-2,fig-3,fig-11 --replications 2 --out".split()
    cli.run("reproduce", *options, tmp_path / "by-cli")
    for folder in ("figures", "tables"):
        assert digests(tmp_path / "out" / folder, "*") == digests(tmp_path / "by-cli" / folder, "*")
    with pytest.raises(pyhoid.OptionError, match="fig-99"):
        pyhoid.reproduce(tmp_path / "out", only=["fig-99"])


@pytest.fixture
def stalled(c1: pyhoid.Record, tmp_path: Path) -> Path:
    """A run whose recorder stayed constant for half a second."""
    e, u = np.array(c1.e), np.array(c1.u)
    e[3000:3050], u[3000:3050] = e[3000], u[3000]
    path = tmp_path / "stalled.csv"
    pyhoid.write(path, pyhoid.Record(e=e, u=u, sample_time=c1.sample_time))
    return path


def test_what_is_inside_of_a_file(stalled: Path, cli: Any) -> None:
    found, expected = pyhoid.info(stalled), cli.json("info", stalled)
    assert found["format"] == expected["format"] and found["notes"] == expected["notes"]
    assert found["columns"] == expected["columns"] and found["samplings"] == expected["samplings"]
    kinds = [[t["kind"] for t in account["trouble"]] for account in (found, expected)]
    assert kinds == [["stalled"], ["stalled"]]
    assert found["trouble"][0]["remedy"] == expected["trouble"][0]["remedy"]
    assert found["trouble"][0]["places"][0][0] == expected["trouble"][0]["places"][0]["row"]


def test_segments_between_faults(stalled: Path, cli: Any) -> None:
    with pytest.warns(UserWarning, match="hold their values|stay constant|stalled"):
        segments = pyhoid.read_segments(stalled, ["stalled"])
    assert len(segments) == 2 and sum(map(len, segments)) < 8192
    fit = pyhoid.identify(segments, "bj", nk=29, nd=1)
    options = "--structure bj --nk 29 --orders nd=1 --mask stalled".split()
    found = cli.json("identify", stalled, *options)
    assert fit.parameters == {p["name"]: p["value"] for p in found["parameters"]}
    with pytest.raises(pyhoid.OptionError, match="clock"):
        pyhoid.read_segments(stalled, ["clock"])


def test_track_and_tracker_have_the_same_keywords() -> None:
    track = inspect.signature(pyhoid.track).parameters
    tracker = inspect.signature(pyhoid.Tracker.__new__).parameters
    # The rate belongs to the samples, not to the recursion.
    same = [*KEYWORDS, "decimate"]
    for name in same:
        usual = "adaptive" if name == "method" else track[name].default
        assert tracker[name].default == usual, name
        assert track[name].annotation == tracker[name].annotation, name
    shared = [name for name in track if name in tracker]
    assert set(same) == set(shared) - {"record", "settings"}
    assert track["settings"].annotation == tracker["settings"].annotation
