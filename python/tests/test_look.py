"""Examination of a file: its summary, and the keywords for reading it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import pyhoid


@pytest.fixture(scope="module")
def path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A target of period 20 s that starts after 3 s and ends before 43 s."""
    sample = np.arange(2640)
    t = sample / 60
    lines = [np.sin(2 * np.pi * h * t / 20 + h) for h in (2, 3, 5, 8, 12, 19)]
    r = np.where((sample >= 180) & (sample < 2580), sum(lines), 0.0)
    y, u = 0.6 * np.roll(r, 20), 0.5 * np.roll(r, 15)
    file = tmp_path_factory.mktemp("look") / "run.csv"
    np.savetxt(
        file, np.column_stack([t, r, y, u]), delimiter=",", header="time,r,y,u", comments=""
    )
    return file


def test_what_a_file_looks_like_is_how_it_is_read(path: Path) -> None:
    look = pyhoid.info(path)["look"]
    assert look["read"] == {"input": "r-y", "output": "u", "start": 3.0, "stop": 43.0}
    assert look["input"]["certain"] and look["excitation"]["column"] == "r"
    assert look["excitation"]["period_s"] == pytest.approx(20)
    with pytest.warns(UserWarning, match="time is taken as t, in s"):
        assert len(pyhoid.read(path, **look["read"])) == 2400
    # The span still contains whole periods after an offset.
    with pytest.warns(UserWarning, match="time is taken as t, in s"):
        assert len(pyhoid.read(path, **look["read"], offset={"u": 1})) == 2400
    known = pyhoid.info(path, excitation="none", controlled_element="1/s")["look"]
    assert known["excitation"]["column"] is None and known["lateness"]["samples"] is None
    assert "start" not in known["read"]


def test_a_reader_is_told_the_columns(path: Path, tmp_path: Path) -> None:
    with pytest.raises(pyhoid.FormatError, match="there is no column e in") as told:
        pyhoid.read(path)
    assert str(told.value).endswith('input="r-y", output="u"')
    with pytest.raises(pyhoid.FormatError, match=r'output="u"'):
        pyhoid.read_segments(path, ["missing"])
    other = tmp_path / "other.csv"
    other.write_text("a,b\n1,2\n2,3\n")
    assert pyhoid.info(other)["look"]["read"] is None
    with pytest.raises(pyhoid.FormatError, match='has no column "e"'):
        pyhoid.read(other)


def test_a_delay_in_seconds_is_nk() -> None:
    record = pyhoid.simulate(condition="C1", seed=1)
    fit = pyhoid.identify(record, "bj", nd=1, delay=0.28)
    assert fit.parameters == pyhoid.identify(record, "bj", nd=1, nk=29).parameters
    assert pyhoid.identify(record, "bj", nd=1, delay=(0.27, 0.29)).orders["nk"] == 29
    by_samples = pyhoid.track(record, "rpem", nd=1, nk=29)
    assert pyhoid.track(record, "rpem", nd=1, delay=0.28)["b0"][-1] == by_samples["b0"][-1]
    with pytest.raises(pyhoid.OptionError, match="give only one of them"):
        pyhoid.identify(record, "bj", nk=29, delay=0.28)
    with pytest.raises(pyhoid.OptionError, match="0 s or more"):
        pyhoid.track(record, "rpem", delay=(-0.1, 0.3))
