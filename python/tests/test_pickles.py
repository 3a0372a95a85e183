"""Results in other processes: pickle, calls as by joblib, damaged pickles."""

from __future__ import annotations

import copy
import pickle
from typing import Any

import numpy as np
import pytest

import pyhoid
from pyhoid import _pickling


def again(result: Any) -> Any:
    return pickle.loads(pickle.dumps(result))


def test_a_fit_comes_back_with_its_digits(fit: pyhoid.Fit, c1: pyhoid.Record) -> None:
    back = again(fit)
    assert back == fit and hash(back) == hash(fit)
    assert back.parameters == fit.parameters and back.orders == fit.orders
    assert back.standard_errors == fit.standard_errors
    assert np.array_equal(back.covariance, fit.covariance)
    assert back.verdict == fit.verdict and back.quality == fit.quality
    assert repr(back) == repr(fit) and back.summary() == fit.summary()
    assert np.array_equal(back.predict(c1).values, fit.predict(c1).values)
    assert again(back).parameters == fit.parameters
    assert copy.deepcopy(fit).parameters == fit.parameters
    samples = sum(record[name].nbytes for record in fit.records for name in record.names)
    assert len(pickle.dumps(fit)) < samples + 40_000, "each sample once, and the model"


def test_a_fit_of_a_recording_with_a_level_comes_back(c1: pyhoid.Record) -> None:
    """A recording has a level of u; removing it twice would change the rounding errors."""
    recorded = pyhoid.Record(e=c1.e + 0.02, u=c1.u + 0.7, sample_time=c1.sample_time)
    for structure in ("bj", "arx"):
        fit = pyhoid.identify(recorded, structure, nk=29)
        assert not np.array_equal(fit.records[0].u, recorded.u), "the level is out of the data"
        back = again(fit)
        assert np.array_equal(back.predict(recorded).values, fit.predict(recorded).values)


def test_a_trace_and_its_start_come_back(c4: pyhoid.Record) -> None:
    trace = pyhoid.track(c4, "physical", nk=29, nd=1, every=16)
    back = again(trace)
    assert len(back) == len(trace) and list(back.columns) == list(trace.columns)
    for name, values in trace.columns.items():
        assert np.array_equal(back[name], values, equal_nan=True), name
    assert repr(back) == repr(trace) and back.counts == trace.counts
    start, own = back.start, trace.start
    assert start is not None and own is not None and again(start).parameters == own.parameters


def test_the_other_results_come_back(c1: pyhoid.Record) -> None:
    described = pyhoid.describe(c1, excitation="f_t")
    back = again(described)
    assert repr(back) == repr(described)
    assert np.array_equal(back.function.response, described.function.response)
    assert back.function.gain_lead_delay() == described.function.gain_lead_delay()
    operator = pyhoid.identify_operator(c1, form="lead", nd=2, excitation="none")
    other = again(operator)
    assert repr(other) == repr(operator) and other.parameters == operator.parameters
    assert other.fit.parameters == operator.fit.parameters
    record = again(c1)
    assert np.array_equal(record.u, c1.u) and not record.u.flags.writeable


def test_damaged_pickles_are_refused(fit: pyhoid.Fit, c1: pyhoid.Record) -> None:
    state = fit.__getstate__()
    empty = pyhoid.Fit.__new__(pyhoid.Fit)
    place = state["text"].index('"state": "') + 200
    changed = state["text"][:place] + "A" + state["text"][place + 1 :]
    with pytest.raises(pyhoid.DataError, match="truncated or changed"):
        empty.__setstate__({**state, "text": changed})
    less = {key: value for key, value in state.items() if key != "records"}
    with pytest.raises(pyhoid.DataError, match="not a pickle of a Fit"):
        empty.__setstate__(less)
    with pytest.raises(pyhoid.DataError, match="not a pickle of a Fit"):
        empty.__setstate__({"parameters": 1})
    # A trace with a correct seal, but from other data.
    trace = pyhoid.track(c1.span(0, 20), "rls", nk=29, every=100)
    answers, call = trace.__getstate__()["answers"], trace.__dict__["_call"]
    strange = _pickling.RestoredNative(
        answers, call._replace(records=(pyhoid.simulate("C1", seed=99),))
    )
    with pytest.raises(pyhoid.DataError, match="cannot be reproduced"):
        strange._native()
    parts = dict(c1.__reduce__()[1][0])
    parts["u"] = np.full(len(c1), np.nan)
    with pytest.raises(pyhoid.DataError):
        c1.__reduce__()[0](parts)


def test_joblib_spreads_fits_over_processes() -> None:
    joblib = pytest.importorskip("joblib")
    records = [pyhoid.simulate("C1", seed=seed).span(0, 40) for seed in (1, 2)]
    spread = joblib.Parallel(n_jobs=2)(
        joblib.delayed(pyhoid.identify)(record, "arx", nk=29) for record in records
    )
    for found, record in zip(spread, records):
        same = pyhoid.identify(record, "arx", nk=29)
        assert found.parameters == same.parameters
        assert np.array_equal(found.residuals(record).values, same.residuals(record).values)
