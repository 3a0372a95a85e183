"""Rates above 200 Hz are filtered and decimated to about 100 Hz, and the result reports it."""

from __future__ import annotations

import pickle

import numpy as np
import pytest

import pyhoid

SAID = "1000 Hz, filtered and decimated by 10 to 100 Hz"


@pytest.fixture(scope="module")
def fast() -> pyhoid.Record:
    return pyhoid.simulate(condition="C1", sample_time=0.001, seed=1)


def test_a_record_is_decimated(fast: pyhoid.Record) -> None:
    slow = fast.decimated()
    assert (len(slow), slow.sample_time) == (len(fast) // 10, 0.01)
    assert slow.input_lead == pytest.approx(0.0045)
    assert slow.steps[-1].startswith(SAID)
    assert fast.decimated("off") is fast and slow.decimated() is slow
    again = pickle.loads(pickle.dumps(slow))
    assert again.input_lead == slow.input_lead and np.array_equal(again.e, slow.e)
    assert slow.span(10, 20).input_lead == slow.detrended().input_lead == slow.input_lead
    for wrong in ("on", 0, -1, 2.5):
        with pytest.raises(pyhoid.OptionError, match="decimate is"):
            fast.decimated(wrong)  # type: ignore[arg-type]
    with pytest.raises(pyhoid.DataError, match="found 100 samples for a filter"):
        fast.span(0, 0.1).decimated()


def test_an_operator_is_that_of_the_old_rate(fast: pyhoid.Record) -> None:
    fit = pyhoid.identify_operator(fast)
    assert fit.records[0].sample_time == 0.01 and SAID in fit.summary()
    tau = fit.parameters["tau_e"]
    assert abs(tau.value - 0.28) < 2 * tau.standard_error
    assert pickle.loads(pickle.dumps(fit)).parameters["tau_e"].value == tau.value
    kept = pyhoid.identify_operator(fast, form="lead", nd=4, decimate="off")
    assert kept.records[0].sample_time == 0.001


def test_what_counts_samples_keeps_them(fast: pyhoid.Record) -> None:
    fit = pyhoid.identify(fast, "arx", na=2, nb=2, nk=281)
    assert fit.records[0].sample_time == 0.001
    fit = pyhoid.identify(fast, "arx", na=2, nb=2, nk=29, decimate=10)
    assert fit.records[0].sample_time == 0.01
    assert pyhoid.identify(fast, "operator").records[0].sample_time == 0.01
    trace = pyhoid.track(fast.span(0, 30), nk=281, every=1000)
    assert trace.record.sample_time == 0.001


def test_a_tracker_has_the_digits_of_a_track(fast: pyhoid.Record) -> None:
    part = fast.span(0, 20)
    trace = pyhoid.track(part, every=10)
    assert SAID in repr(trace) and trace.record.sample_time == 0.01
    assert np.allclose(np.diff(trace.time), 0.01)
    assert part.e is not None
    tracker = pyhoid.Tracker(sample_time=0.001)
    assert tracker.decimation == SAID and tracker.sample_time == 0.001
    tracker.update(part.e[:9_003], part.u[:9_003])
    tracker = pickle.loads(pickle.dumps(tracker))
    innovations = tracker.update(part.e[9_003:], part.u[9_003:])
    # The tracker receives every tenth sample.
    assert np.isfinite(innovations).sum() in (1099, 1100)
    last = innovations[np.isfinite(innovations)]
    behind = len(trace) - np.flatnonzero(trace["innovation"] == last[-1])[0]
    assert 14 <= behind <= 16
    assert np.array_equal(
        trace["innovation"][-behind - 900 : 1 - behind or None][-900:], last[-900:]
    )
    assert pyhoid.Tracker(sample_time=0.001, nk=281).decimation is None
    assert pyhoid.Tracker(sample_time=0.001, decimate="off").decimation is None
    assert pyhoid.Tracker(sample_time=0.005).decimation is None


def test_lines_do_not_depend_on_the_rate(fast: pyhoid.Record) -> None:
    slow, whole = pyhoid.describe(fast), pyhoid.describe(fast, decimate="off")
    for name, most in (("magnitude_db", 0.02), ("phase_deg", 0.1)):
        assert np.abs(slow.function[name] - whole.function[name]).max() < most
    again = pyhoid.describe(fast.decimated(10))
    assert np.array_equal(again.function.response, slow.function.response)
