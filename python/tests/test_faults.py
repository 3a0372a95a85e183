"""Faults of recorded data."""

from __future__ import annotations

import numpy as np
import pyhoid
import pytest


def _with_spike() -> tuple[pyhoid.Record, pyhoid.Record]:
    clean = pyhoid.simulate(condition="C1", seed=81)
    e = np.array(clean.e)
    e[4000] = 30.0
    return clean, pyhoid.Record(e=e, u=np.array(clean.u), sample_time=clean.sample_time)


def test_a_bad_sample_is_bridged_and_told() -> None:
    clean, bad = _with_spike()
    options = {"nb": 2, "nd": 1, "nf": 2, "nk": 29}
    right = pyhoid.identify(clean, "bj", **options)
    found = pyhoid.identify(bad, "bj", **options)
    assert right.faults == []
    assert right.records[0] is clean
    [fault] = found.faults
    assert (fault["kind"], fault["channel"], fault["action"]) == ("spike", "e", "bridged")
    assert fault["from"] == pytest.approx(40.0)
    assert found.verdict.level == "trustworthy"
    assert any("spike in e" in note for note in found.verdict.notes)
    for name, value in found.parameters.items():
        assert value == pytest.approx(right.parameters[name], abs=1e-3)


def test_what_is_only_reported_is_doubted() -> None:
    _, bad = _with_spike()
    found = pyhoid.identify(bad, "bj", nb=2, nd=1, nf=2, nk=29, faults="report")
    assert found.verdict.level != "trustworthy"
    kept = pyhoid.identify(bad, "bj", nb=2, nd=1, nf=2, nk=29, faults="keep")
    assert kept.faults == []
    with pytest.raises(ValueError):
        pyhoid.identify(bad, "bj", nk=29, faults="mend")


def test_a_level_of_u_is_found_and_moves_nothing() -> None:
    clean = pyhoid.simulate(condition="C3", seed=82)
    assert pyhoid.identify(clean, "bj", nk=29, nd=1).levels == []
    e, u = np.array(clean.e), np.array(clean.u)
    bare = pyhoid.Record(e=e, u=u, sample_time=clean.sample_time)
    moved = pyhoid.Record(e=e, u=u + 0.5, sample_time=clean.sample_time)
    for structure, options in (("bj", {"nk": 29, "nd": 1}), (None, {"change": "sigmoid", "delay": (0.27, 0.29)})):
        before = pyhoid.identify(bare, structure, **options)
        found = pyhoid.identify(moved, structure, **options)
        for name, value in found.parameters.items():
            assert value == pytest.approx(before.parameters[name], rel=1e-5), name
        [one], [other] = before.levels, found.levels
        assert one is not None and other is not None and one.standard_error
        assert other.value - one.value == pytest.approx(0.5, abs=1e-5)
        assert abs(one.value) < 4 * one.standard_error
        as_read = pyhoid.identify(moved, structure, **options, faults="keep")
        assert [level for level in as_read.levels if level is not None] == []
