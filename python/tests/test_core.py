"""Properties of fits, traces and trackers beyond their digits."""

from __future__ import annotations

import pickle
import subprocess
import sys
import threading
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import pyhoid


def test_a_fit_and_its_parts(fit: pyhoid.Fit, c1: pyhoid.Record) -> None:
    assert fit.orders == {"na": 0, "nb": 2, "nc": 0, "nd": 1, "nf": 2, "nk": 29}
    covariance = fit.covariance
    assert covariance is not None and covariance.shape == (5, 5) and covariance.dtype == np.float64
    errors = np.array([fit.standard_errors[name] for name in fit.parameters], dtype=float)
    np.testing.assert_allclose(np.sqrt(np.diag(covariance)), errors, rtol=1e-12)
    operator = fit.operator
    assert operator is not None and operator.convertible and operator.stable
    # Three standard errors around the true value.
    for name, truth in {"K_e": 0.09, "T_L": 0.4, "omega_nm": 11.25, "zeta_nm": 0.35}.items():
        value, error = operator[name]
        assert error is not None and abs(value - truth) < 3 * error, name
    first, residuals = fit.residuals(c1)
    predicted = fit.predict(c1)
    assert predicted.first == first
    np.testing.assert_allclose(c1.u[first:] - predicted.values, residuals, atol=1e-12)
    assert fit.loss == pytest.approx(float(np.mean(residuals**2)), rel=1e-3)
    validation = fit.validate(c1)
    assert validation.quality == fit.quality
    correlation = validation.autocorrelation
    assert (
        correlation.lags[0] == 1
        and np.mean(np.abs(correlation.values) > correlation.bound_99) < 0.1
    )
    margins = fit.margins([90], [1, 6, 0])
    crossover = margins["crossover_rad_s"]
    assert crossover is not None and crossover.value == pytest.approx(
        pyhoid.margins("C1")["crossover_rad_s"], rel=0.1
    )
    assert fit.predict(c1, horizon=10).values.std() < c1.u.std()


def test_a_response_is_that_of_the_polynomials(fit: pyhoid.Fit) -> None:
    omega = np.array([0.3, 1.0, 5.0, 20.0])
    found = fit.frequency_response(omega)
    z = np.exp(1j * omega * fit.sample_time)
    powers = fit.polynomials
    of = {name: np.polyval(powers[name][::-1], 1 / z) for name in ("B", "F")}
    np.testing.assert_allclose(found.response, of["B"] / of["F"], rtol=1e-9)
    assert np.all(found.magnitude_db_se > 0)


def test_texts(fit: pyhoid.Fit, c1: pyhoid.Record) -> None:
    text = repr(fit)
    for word in ("BJ(nb=2", "f1", "K_e", "deg/deg", "T_n", "VAF", "BIC"):
        assert word in text
    assert "<table>" in fit._repr_html_() and "<table>" in c1._repr_html_()
    assert (
        "±" in repr(pyhoid.Estimate(0.09201, 0.0023))
        and repr(pyhoid.Estimate(0.28, None)) == "0.28"
    )


def test_what_does_not_convert_says_why() -> None:
    found = pyhoid.convert(f=(0.5, 0.01), b=(0.1, 0.1), nk=3).operator
    assert not found.convertible and found.reason
    with pytest.raises(pyhoid.NotConvertibleError, match="not convertible"):
        _ = found.K_e
    with pytest.raises(ValueError):
        _ = found["K_e"]
    assert "not convertible" in repr(found)


def test_tables(fit: pyhoid.Fit, c1: pyhoid.Record, c4: pyhoid.Record) -> None:
    table = fit.to_pandas()
    assert table.loc["K_e", "unit"] == "deg/deg" and np.isnan(table.loc["tau_e", "standard_error"])
    dataset = fit.to_xarray()
    assert float(dataset.value.sel(parameter="f1")) == fit.parameters["f1"]
    frame = c1.to_pandas()
    again = pyhoid.Record.from_pandas(frame)
    assert len(again) == len(c1) and again.sample_time == pytest.approx(0.01)
    np.testing.assert_array_equal(again.u, c1.u)
    assert c1.to_xarray().u.attrs["units"] == "deg"
    trace = pyhoid.track(c4, "rls", nk=29, every=10)
    assert trace.to_pandas().index.name == "t" and trace.to_polars().height == len(trace)
    assert trace.to_xarray().K_e.attrs["units"] == "deg/deg"


def test_a_second_run_chooses_the_start_covariance(c4: pyhoid.Record) -> None:
    second = pyhoid.simulate("C4", seed=12)
    trace = pyhoid.track(c4, "rpem", nk=29, nd=1, every=10, validate=second)
    choice = trace.covariance_choice
    assert choice is not None
    best = max(choice["candidates"], key=lambda one: one["vaf"])
    assert best["covariance"] == choice["covariance"] and best["vaf"] > 80
    again = pyhoid.track(c4, "rpem", nk=29, nd=1, every=10, covariance=choice["covariance"])
    np.testing.assert_array_equal(trace["b0"], again["b0"])
    assert again.covariance_choice is None
    assert pickle.loads(pickle.dumps(trace)).covariance_choice == choice
    text: Any = {"covariance": 0.1, "limit": float("inf")}
    updated = pyhoid.track(
        c4, "rpem", nk=29, nd=1, every=10, validate=second, update_covariance=True, **text
    )
    plain = pyhoid.track(c4, "rpem", nk=29, nd=1, every=10, **text)
    assert updated.covariance_choice is None and not np.array_equal(updated["b0"], plain["b0"])
    with pytest.raises(pyhoid.OptionError, match="applies only with validate"):
        pyhoid.track(c4, "rpem", nk=29, nd=1, update_covariance=True)
    with pytest.raises(pyhoid.OptionError, match="one of the two"):
        pyhoid.track(c4, "rpem", nk=29, nd=1, covariance=0.1, validate=second)
    with pytest.raises(pyhoid.DataError, match="validate: expected"):
        pyhoid.track(c4, "rpem", nk=29, nd=1, validate="second.csv")  # type: ignore[arg-type]
    # The recursion of the thesis has no guard against windup.
    of_rls: Any = {"nk": 29, "memory": 256, "covariance": 0.1}
    off = pyhoid.track(c4, "rls", windup_guard="off", every=10, **of_rls)
    np.testing.assert_array_equal(pyhoid.track(c4, "rls", every=10, **of_rls)["a1"], off["a1"])
    on = pyhoid.track(c4, "rls", windup_guard=1e4, every=10, **of_rls)
    assert not np.array_equal(on["a1"], off["a1"])


def test_the_error_is_a_difference_of_columns(c1: pyhoid.Record) -> None:
    frame = c1.to_pandas().rename(columns={"e": "r"}).assign(y=0.25)
    made = pyhoid.Record.from_pandas(frame, input="r-y")
    np.testing.assert_array_equal(made.e, c1.e - 0.25)
    np.testing.assert_array_equal(made["y"], 0.25)
    turned = pyhoid.Record.from_pandas(frame, input="-r")
    np.testing.assert_array_equal(turned.e, -c1.e)
    with pytest.raises(pyhoid.Error, match="the table"):
        pyhoid.Record.from_pandas(frame, input="r-q")


def test_a_file_whose_time_has_another_name(c1: pyhoid.Record, tmp_path: Path) -> None:
    frame = c1.to_pandas().reset_index().rename(columns={"t": "clock"})
    frame["clock"] *= 1000
    frame.to_csv(tmp_path / "run.csv", index=False)
    assert pyhoid.info(tmp_path / "run.csv")["look"]["no_record"] is not None
    look = pyhoid.info(tmp_path / "run.csv", time="clock:ms")["look"]
    assert look["no_record"] is None
    with pytest.warns(UserWarning, match="clock is taken as t"):
        record = pyhoid.read(tmp_path / "run.csv", **look["read"])
    assert abs(record.sample_time - 0.01) < 1e-9


def test_tables_with_instants_and_durations(c1: pyhoid.Record, tmp_path: Path) -> None:
    pd = pytest.importorskip("pandas")
    pl = pytest.importorskip("polars")
    short = c1.span(0, 5)
    frame = short.to_pandas()
    for index in (
        pd.date_range("2026-03-01 12:00", periods=len(frame), freq="10ms"),
        pd.date_range("2026-03-01 12:00", periods=len(frame), freq="10ms", tz="Europe/Berlin"),
        pd.timedelta_range("0s", periods=len(frame), freq="10ms"),
    ):
        made = pyhoid.Record.from_pandas(frame.set_index(index))
        assert made.sample_time == 0.01 and made.start_time == 0.0
        assert np.array_equal(made.u, short.u)
    late = frame.set_index(pd.timedelta_range("2s", periods=len(frame), freq="10ms"))
    assert pyhoid.Record.from_pandas(late).start_time == 2.0
    uneven = frame.drop(frame.index[7])
    with pytest.raises(pyhoid.DataError, match="uneven"):
        pyhoid.Record.from_pandas(
            uneven.set_index(pd.to_datetime(np.asarray(uneven.index), unit="s"))
        )
    # Rounded numbers give the same record from the file and from the table.
    rounded = pd.DataFrame({"t": np.arange(3000) / 60, "e": 0.5, "u": np.arange(3000.0)}).round(4)
    rounded["e"] = np.sin(rounded.u)
    rounded.to_csv(tmp_path / "run.csv", index=False)
    of_file, of_table = pyhoid.read(tmp_path / "run.csv"), pyhoid.Record.from_pandas(rounded)
    assert of_table.sample_time == of_file.sample_time == 1 / 60
    dated = rounded.assign(t=pd.Timestamp("2026-03-01") + pd.to_timedelta(rounded.t, unit="s"))
    assert pyhoid.Record.from_pandas(dated).sample_time == 1 / 60
    with pytest.raises(pyhoid.DataError, match="not numbers"):
        pyhoid.Record.from_pandas(dated.assign(t=dated.t.astype(str)))
    table = short.to_polars()
    assert table.columns[:3] == ["t", "e", "u"]
    made = pyhoid.Record.from_polars(table)
    assert made.sample_time == 0.01 and np.array_equal(made["f_t"], short["f_t"])
    made = pyhoid.Record.from_polars(
        table.with_columns(t=pl.duration(milliseconds=pl.col("t") * 1000))
    )
    assert made.sample_time == 0.01
    with pytest.raises(pyhoid.DataError, match="did you mean f_t"):
        pyhoid.Record.from_polars(table, input="ft")


def test_control_there_and_back(fit: pyhoid.Fit) -> None:
    import control

    system = fit.to_control()
    omega = np.array([0.5, 2.0, 8.0])
    response = np.array([complex(control.evalfr(system, np.exp(1j * w * 0.01))) for w in omega])
    np.testing.assert_allclose(response, fit.frequency_response(omega).response, rtol=1e-8)
    back = pyhoid.from_control(system)
    assert back.nk == 29 and fit.operator is not None
    for name, pair in fit.operator.items():
        assert back.operator[name].value == pytest.approx(pair.value, rel=1e-9)
    with pytest.raises(pyhoid.NotConvertibleError):
        pyhoid.from_control(control.tf([1], [1, 2]))


def test_several_records_share_a_model(c1: pyhoid.Record) -> None:
    other = pyhoid.simulate("C1", seed=1, replication=1)
    both = pyhoid.identify([c1, other], nk=29, nd=1)
    one = pyhoid.identify(c1, nk=29, nd=1)
    ratio = both.standard_errors["f1"] / one.standard_errors["f1"]  # type: ignore[operator]
    assert ratio == pytest.approx(1 / np.sqrt(2), rel=0.15)
    grey = pyhoid.identify(
        [c1, other], noise="remnant", remnant_order=1, delay=(0.28, 0.28), individual=["K_e"]
    )
    operators = grey.operators
    assert len(operators) == 2
    assert operators[0]["K_e"].value != operators[1]["K_e"].value  # type: ignore[index]


def test_a_tracker_goes_on_out_of_a_pickle(c4: pyhoid.Record) -> None:
    for keywords in (
        {"method": "physical"},
        {"method": "rls"},
        {"method": "window", "window": "10s"},
        {"method": "rpem", "nd": (1, 2)},
    ):
        tracker = pyhoid.Tracker(sample_time=0.01, nk=29, **keywords)
        # During and after the warm-up.
        for first, last in ((0, 1500), (1500, 4000), (4000, 5000)):
            copy = pickle.loads(pickle.dumps(tracker))
            expected = tracker.update(c4.e[first:last], c4.u[first:last])
            np.testing.assert_array_equal(copy.update(c4.e[first:last], c4.u[first:last]), expected)
            assert copy.ready == tracker.ready == (last > 2000)
        np.testing.assert_array_equal(copy.theta, tracker.theta)
        assert copy.estimates == tracker.estimates and copy.counts == tracker.counts
        assert tracker.start_fit is not None and copy.start_fit is None


def test_a_tracker_steps_as_it_updates_and_bridges_faults(c4: pyhoid.Record) -> None:
    start = pyhoid.identify(c4.span(0, 30), nk=29, nd=1).parameters
    one, other = (pyhoid.Tracker("rpem", nk=29, start=start, covariance=0.1) for _ in range(2))
    assert one.ready
    e, u = c4.e[:500].copy(), c4.u[:500].copy()
    e[100], u[200], u[300] = np.nan, np.inf, 1e9
    stepped = [one.step(x, y) for x, y in zip(e.tolist(), u.tolist())]
    np.testing.assert_array_equal(stepped, other.update(e, u))
    assert np.isnan(stepped)[[100, 200, 300]].all() and one.counts["skipped"] == 3
    operator = one.operator_estimate()
    assert operator is not None
    with pytest.raises(pyhoid.OptionError, match="warming up"):
        _ = pyhoid.Tracker("rpem").theta
    recorded = pyhoid.Tracker("rpem", nk=29, nd=1, record=c4.span(0, 30))
    assert recorded.ready and recorded.start_fit is not None


def test_files(tmp_path: Path, c1: pyhoid.Record) -> None:
    for name in ("a.csv", "a.parquet", "a.npz", "a.mat"):
        pyhoid.write(tmp_path / name, c1)
        again = pyhoid.read(tmp_path / name)
        assert again.names == c1.names and again.label == "a"
        for channel in c1.names:
            np.testing.assert_array_equal(again[channel], c1[channel])
    negative = pyhoid.read(tmp_path / "a.csv", input="-e", start=10, stop=20)
    np.testing.assert_array_equal(negative.e, -c1.span(10, 20).e)
    prepared = pyhoid.read(
        tmp_path / "a.csv", scale={"u": "2:rad"}, decimate=2, run_in=10, detrend="mean"
    )
    assert (
        prepared.sample_time == 0.02 and prepared.units["u"] == "rad" and len(prepared.steps) == 4
    )
    assert abs(prepared.u.mean()) < 1e-12
    (tmp_path / "plain.csv").write_text("t,e,u\n0,1,2\n0.1,3,4\n")
    named = pyhoid.read(tmp_path / "plain.csv", unit={"e": "deg", "u": "V"})
    assert (named.units["e"], named.units["u"]) == ("deg", "V")
    np.testing.assert_array_equal(named.u, [2.0, 4.0])
    trace = pyhoid.track(c1, "rls", nk=29, every=100)
    trace.write(tmp_path / "trace.csv", ["a comment"])
    assert (tmp_path / "trace.csv").read_text().startswith("# a comment")


def test_a_describing_function(c1: pyhoid.Record, fit: pyhoid.Fit) -> None:
    runs = [pyhoid.simulate("C1", seed=1, replication=k) for k in range(8)]
    found = pyhoid.describing_function(runs)
    model = fit.frequency_response(found.omega).response
    # Within four standard errors of eight runs.
    assert np.all(np.abs(found.response - model) < 4 * found["response_se"] + 0.05 * np.abs(model))
    assert found.per_run.shape == (8, len(found)) and np.all(found["coherence"] <= 1)
    simple = found.gain_lead_delay()
    assert 0.2 < simple["delay_s"].value < 0.5
    crossover = found.margins([90], [1, 6, 0])["crossover_rad_s"]
    assert crossover is not None and 0.5 < crossover.value < 4
    with pytest.raises(pyhoid.DataError):
        pyhoid.describing_function(c1, start=0, stop=50)


def test_fits_and_traces_say_what_they_are_worth(c1: pyhoid.Record, c4: pyhoid.Record) -> None:
    fit = pyhoid.identify(c1, "bj", nk=29, nd=1)
    assert fit.verdict == pyhoid.Verdict("trustworthy", [], []), fit.verdict
    assert repr(fit.verdict) == "Verdict: trustworthy"
    poor = pyhoid.identify(c1, "oe", nk=29).verdict
    assert poor.level == "doubtful" and any("noise model" in reason for reason in poor.reasons)
    change = pyhoid.identify(c1, change="sigmoid").verdict
    assert change.level == "trustworthy" and any("no change" in note for note in change.notes)
    trace = pyhoid.track(c4, "physical", nk=29, nd=1)
    assert trace.verdict.level == "trustworthy", trace.verdict
    start = pyhoid.Tracker("rpem", nk=29, nd=1, record=c4.span(0, 30)).start_fit
    assert start is not None
    with pytest.raises(pyhoid.DataError, match="no records"):
        _ = start.verdict


def test_a_person_is_tracked_with_the_loop_that_they_close(c4: pyhoid.Record) -> None:
    element = ([90.0], [1.0, 6.0, 0.0])
    keywords: Any = {"at": (1, 2.5), "controlled_element": element}
    trace = pyhoid.track(c4, every=50, **keywords)
    assert trace.method == "adaptive" and trace.start is None
    assert trace.response_names == [
        *("gain_db@1", "phase_deg@1", "gain_db@2.5", "phase_deg@2.5"),
        *("crossover_rad_s", "phase_margin_deg"),
    ]
    tracker = pyhoid.Tracker(sample_time=0.01, **keywords)
    assert tracker.ready and tracker.responses == {} and tracker.crossover is None
    assert tracker.no_crossover == "there is no estimate yet"
    tracker.update(c4.e, c4.u)
    gain, phase = tracker.responses[2.5]
    assert gain.value == pytest.approx(trace["gain_db@2.5"][-1], abs=1e-9)
    assert phase.standard_error == pytest.approx(trace["phase_deg@2.5_se"][-1], abs=1e-9)
    assert tracker.crossover is not None and tracker.phase_margin is not None
    assert tracker.crossover.value == pytest.approx(trace["crossover_rad_s"][-1], abs=1e-9)
    assert tracker.phase_margin.value == pytest.approx(trace["phase_margin_deg"][-1], abs=1e-9)
    assert tracker.determined["K_e_dot"] is bool(trace["K_e_dot_determined"][-1])
    assert tracker.at == [1, 2.5] and "6" in (tracker.controlled_element or "")
    assert tracker.settings["at"] == [1, 2.5] and tracker.settings["method"] == "adaptive"
    lost = np.isnan(trace["crossover_rad_s"]).sum()
    assert trace.no_crossover is not None and trace.no_crossover[0] == lost
    assert all(change["changed"] == list(change["changed"]) for change in trace.changes)
    again = pickle.loads(pickle.dumps(tracker))
    assert again.responses == tracker.responses and again.settings == tracker.settings


def test_an_earlier_name_of_a_method_is_read_with_a_warning(c4: pyhoid.Record) -> None:
    earlier: Any = "population"
    said = "`population` is now called `adaptive`"
    now = pyhoid.track(c4.span(0, 20), every=50)
    with pytest.warns(DeprecationWarning, match=said) as warned:
        trace = pyhoid.track(c4.span(0, 20), earlier, every=50)
    assert [warning.filename for warning in warned] == [__file__]
    np.testing.assert_array_equal(trace["K_e"], now["K_e"])
    assert trace.method == "adaptive" and trace.settings["method"] == "adaptive"
    with pytest.warns(DeprecationWarning, match=said) as warned:
        tracker = pyhoid.Tracker(earlier, sample_time=0.01)
    assert [warning.filename for warning in warned] == [__file__]
    assert tracker.settings["method"] == "adaptive"
    # A pickle with the earlier name is read without a warning.
    tracker._options["method"] = earlier
    tracker.update(c4.e[:300], c4.u[:300])
    again = pickle.loads(pickle.dumps(tracker))
    assert again.step(0.5, 1.0) == tracker.step(0.5, 1.0) and again.method == "adaptive"


def test_a_person_is_tracked_from_an_earlier_fit(c1: pyhoid.Record, tmp_path: Path) -> None:
    fit = pyhoid.identify_operator(c1, form="lead", nd=2, excitation="none")
    file = tmp_path / "person.json"
    file.write_text(fit.to_json())
    later = pyhoid.simulate("C1", seed=9)
    by_fit = pyhoid.track(later, prior=fit, at=[2.5], every=50)
    by_file = pyhoid.track(later, prior=file, at=[2.5], every=50)
    usual = pyhoid.track(later, at=[2.5], every=50)
    np.testing.assert_array_equal(by_fit["gain_db@2.5"], by_file["gain_db@2.5"])
    # Before the first sample the estimate is the fit.
    tracker = pyhoid.Tracker(prior=str(file), at=[2.5], sample_time=0.01)
    gain, _ = tracker.responses[2.5]
    assert gain.value == pytest.approx(
        float(fit.fit.frequency_response([2.5]).magnitude_db[0]), abs=0.2
    )
    assert tracker.settings["prior"] == str(file)
    file.unlink()
    assert pickle.loads(pickle.dumps(tracker)).responses == tracker.responses
    assert np.isfinite(by_fit["gain_db@2.5_se"][:2]).all() and np.isnan(usual["gain_db@2.5_se"][0])
    assert (by_fit["gain_db@2.5_se"][3:15] < usual["gain_db@2.5_se"][3:15]).all()
    for prior in ("none", {"omega_nm": (9, 0.2)}, "omega_nm=9:0.2,T_I=5:0.5"):
        assert len(pyhoid.track(later, prior=prior, every=500)) == 17
    with pytest.raises(pyhoid.OptionError, match="no such file|No such file"):
        pyhoid.track(later, prior="absent.json")
    with pytest.raises(pyhoid.Error, match="give the output of `hoid identif"):
        file.write_text("{}")
        pyhoid.track(later, prior=file)
    slow = pyhoid.simulate("C1", sample_time=0.02)
    with pytest.raises(pyhoid.Error, match="100.000000 Hz"):
        pyhoid.track(slow, prior=fit)
    with pytest.raises(pyhoid.OptionError, match="adaptive"):
        pyhoid.track(later, "physical", prior="none")


def test_units_of_gains_are_those_of_the_record(c1: pyhoid.Record) -> None:
    assert pyhoid.estimates.unit_of("K_e_dot", pyhoid.estimates.channel_units([c1])) == "s"
    bare = pyhoid.Record(e=c1.e, u=c1.u, sample_time=c1.sample_time)
    fit = pyhoid.identify(bare, nk=29, nd=1)
    assert "deg/deg" not in fit.summary() and fit.to_pandas().loc["K_e", "unit"] == ""
    mixed = pyhoid.Record(e=c1.e, u=c1.u, sample_time=c1.sample_time, units={"e": "mm", "u": "N"})
    assert pyhoid.estimates.unit_of("K_e", pyhoid.estimates.channel_units([mixed])) == "N/mm"
    assert pyhoid.estimates.unit_of("K_e_dot", pyhoid.estimates.channel_units([mixed])) == "N s/mm"
    assert pyhoid.estimates.unit_of("K_over_T_I", pyhoid.estimates.channel_units([mixed]), "1/s") == "N/(mm s)"
    assert pyhoid.estimates.unit_of("c_2", pyhoid.estimates.channel_units([bare]), "s^2") == "s^2"
    for record, unit in ((bare, ""), (mixed, "N/mm")):
        person = pyhoid.identify_operator(record, form="lead", excitation="none")
        assert person.parameters.K_e.unit == unit and person.parameters.tau_e.unit == "s"


def test_units_of_columns_with_other_names(tmp_path: Path, c1: pyhoid.Record) -> None:
    rows = "\n".join(f"{k / 100},{e},{u}" for k, (e, u) in enumerate(zip(c1.e, c1.u)))
    (tmp_path / "own.csv").write_text(f"# units: error mm, stick N\nt,error,stick\n{rows}\n")
    own = pyhoid.read(tmp_path / "own.csv", input="error", output="stick")
    assert pyhoid.estimates.unit_of("K_e", pyhoid.estimates.channel_units([own])) == "N/mm"


def test_a_description_with_its_verdict(c1: pyhoid.Record) -> None:
    runs = [pyhoid.simulate("C1", seed=1, replication=k) for k in range(4)]
    found = pyhoid.describe(runs, controlled_element="90/(s(s+6))")
    assert found.verdict == "trustworthy" and not found.reasons, found
    assert found.excitation == "f_t" and abs(found.period - 81.92) < 1e-9
    by_hand = pyhoid.describing_function(runs, averaging="reference", reference="f_t")
    # Selected by hand: the lines of larger amplitude.
    shared = np.isin(found.function.omega.round(9), by_hand.omega.round(9))
    assert np.array_equal(found.function.response[shared], by_hand.response)
    # No jumps, and each phase a whole number of turns from its principal value.
    turns = (found.phase_deg[shared] - by_hand["phase_deg"]) / 360
    assert np.allclose(turns, np.round(turns)) and np.all(np.diff(found.phase_deg)[3:] < 0)
    assert found.open_loop is not None
    # The straight line between neighbouring lines, 0.76 octaves apart here, is 2 % off.
    for name, truth in (("crossover_rad_s", 1.5635), ("phase_margin_deg", 76.2)):
        estimate = found.open_loop[name]
        assert estimate is not None and estimate.standard_error is not None
        assert abs(estimate.value / truth - 1) < 0.03
    pair = pyhoid.describe(runs, controlled_element=([90], [1, 6, 0]))
    assert pair.open_loop == found.open_loop and "trustworthy" in repr(pair)
    alone = pyhoid.describe(c1)
    assert alone.verdict == "doubtful" and alone.open_loop is None
    with pytest.raises(pyhoid.OptionError, match="at character 5"):
        pyhoid.describe(runs, controlled_element="1/(s")
    with pytest.raises(pyhoid.OptionError, match="expected text"):
        pyhoid.describe(runs, controlled_element=3)  # type: ignore[arg-type]
    with pytest.raises(pyhoid.Error, match="one of"):
        pyhoid.describe(runs, excitation="w")


def test_progress_and_interrupt(c1: pyhoid.Record) -> None:
    calls: list[tuple[int, int]] = []
    pyhoid.identify(c1, nk=(27, 31), nd=1, progress=lambda done, total: calls.append((done, total)))
    assert calls[-1] == (5, 5)

    def stop(done: int, total: int) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        pyhoid.identify(c1, progress=stop)


def test_fits_run_side_by_side() -> None:
    """A fit releases the interpreter lock: another thread counts during the fit."""
    record = pyhoid.simulate("C1", seed=2)
    counted, done = 0, threading.Event()

    def count() -> None:
        nonlocal counted
        while not done.is_set():
            counted += 1
            time.sleep(0)

    thread = threading.Thread(target=count)
    thread.start()
    try:
        pyhoid.identify(record, nk=(20, 40), nd=(1, 2))
        during = counted
    finally:
        done.set()
        thread.join()
    assert during > 100


def test_the_version_is_that_of_the_package() -> None:
    from importlib.metadata import version

    assert version("pyhoid") == pyhoid.__version__
    assert sys.version_info >= (3, 10)


def test_figures_and_clusters_are_loaded_at_their_first_use() -> None:
    program = """
import sys, pyhoid
assert {"plots", "dask", "lsl"} <= set(dir(pyhoid))
assert not {"matplotlib", "pandas", "dask", "distributed"} & set(sys.modules)
assert callable(pyhoid.plots.bode) and "matplotlib" in sys.modules
assert callable(pyhoid.dask.study)
try:
    pyhoid.nothing
except AttributeError as error:
    print(error)
"""
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout.strip() == "module 'pyhoid' has no attribute 'nothing'"
