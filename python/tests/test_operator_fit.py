"""The operator of a person, on simulated people whose parameters are known."""

from __future__ import annotations

import csv
import json
import math
import pickle
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import pyhoid

#: A single form and few noise orders, for tests that do not concern their selection.
FEW: dict[str, Any] = {"form": "lead-lag", "nd": (0, 6)}


@pytest.fixture(scope="session")
def people(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Three runs of a person on an integrator, with disturbance d."""
    directory = tmp_path_factory.mktemp("people")
    pyhoid.simulate_people(
        directory, subjects=1, runs=3, plants=["integrator"], form="lead-lag", seed=3
    )
    return directory


@pytest.fixture(scope="session")
def runs(people: Path) -> list[pyhoid.Record]:
    return [pyhoid.read(people / f"S1_integrator_{run}.csv") for run in (1, 2, 3)]


@pytest.fixture(scope="session")
def truth(people: Path) -> list[dict[str, str]]:
    with (people / "truth.csv").open() as file:
        return list(csv.DictReader(line for line in file if not line.startswith("#")))


@pytest.fixture(scope="session")
def found(runs: list[pyhoid.Record]) -> pyhoid.OperatorFit:
    return pyhoid.identify_operator(runs, controlled_element="1/s")


def test_the_parameters_are_those_of_the_person(
    found: pyhoid.OperatorFit, truth: list[dict[str, str]]
) -> None:
    tau = found.parameters["tau_e"]
    true = float(np.mean([float(row["tau_e"]) for row in truth]))
    assert tau.determined and tau.unit == "s" and tau.standard_error is not None
    assert abs(tau.value - true) < 4 * math.hypot(tau.standard_error, 0.1 * true / math.sqrt(3))
    assert found.parameters.tau_e is tau and len(found.operators) == 1
    with pytest.raises(AttributeError, match="it has"):
        found.parameters.nothing  # noqa: B018


def test_what_a_fit_holds(found: pyhoid.OperatorFit) -> None:
    assert found.form in [row["form"] for row in found.forms] and len(found.forms) > 3
    assert found.excitation == "d" and found.lines is not None and found.no_lines is None
    assert found.verdict.level in ("trustworthy", "doubtful", "not determined")
    p = len(found.coordinates)
    assert found.covariance is not None and found.covariance.shape == (p, p)
    assert np.allclose(found.covariance, found.covariance.T, rtol=1e-9, atol=0)
    # The error of tau_e includes the differences between forms, in addition to its coordinate.
    place = list(found.coordinates).index("tau_e")
    tau = found.parameters["tau_e"]
    own = math.sqrt(found.covariance[place, place])
    assert tau.standard_error is not None and tau.standard_error_person == tau.standard_error
    if tau.averaged_over:
        assert tau.standard_error > 0.5 * own and found.form in tau.averaged_over
    else:
        assert tau.standard_error == pytest.approx(own, rel=1e-12)
    assert sum(row["weight"] for row in found.forms) == pytest.approx(1.0)
    low, high = tau.interval or (0.0, 0.0)
    assert low < found.coordinates["tau_e"] < high
    assert found.open_loop is not None
    crossover, margin = found.open_loop["crossover_rad_s"], found.open_loop["phase_margin_deg"]
    assert crossover is not None and margin is not None and margin.standard_error is not None
    shape = found.loop_shape
    assert shape is not None and shape["stable"] is True
    lowest = shape["crossovers"][0]
    # The shape is from the best form, the crossover is the mean over forms.
    assert abs(lowest[0].value - crossover.value) < 2 * (crossover.standard_error or 0.0)
    assert lowest[1].standard_error > 0
    assert shape["gain_margin_db"].value > 0 and shape["gain_margin_db"].standard_error > 0
    assert found.open_loop_intervals is not None
    ends = found.open_loop_intervals["phase_margin_deg"]
    # The interval of a mixture with Student's quantiles is wider than the normal interval.
    assert ends is not None and ends[0] < margin.value < ends[1]
    assert ends[1] - ends[0] > 2 * 1.96 * margin.standard_error
    at_lines = found.lines["open_loop"]["crossover_rad_s"]
    assert at_lines.value == pytest.approx(crossover.value, rel=0.2)
    assert found.agreement is not None and 0 <= found.agreement["p_value"] <= 1
    assert found.riv_bj is not None and found.riv_bj["converged"]
    by_instruments = found.riv_bj["open_loop"]["crossover_rad_s"]
    assert by_instruments.value == pytest.approx(crossover.value, rel=0.2)
    assert all(pair["p_value"] >= found.agreement["p_value"] / 3 for pair in found.agreement["pairs"])
    assert found.prior["omega_nm"] == (10.5, 0.3) and found.settings["form"].startswith("auto among gain, lead")
    text = found.summary()
    for part in (found.verdict.level, found.form, "tau_e (s)", "at the lines", "phase margin", "95 %"):
        assert part in text, part
    assert "tau_e" in found._repr_html_() and repr(found) == text
    table = found.to_pandas()
    assert table.loc["tau_e", "value"] == found.parameters["tau_e"].value


def test_the_polynomials_are_the_same_model(found: pyhoid.OperatorFit) -> None:
    """The polynomials reproduce the loss and the crossover."""
    residuals = np.concatenate([found.fit.residuals(r).values for r in found.records])
    # The loss omits the samples that the longest delay and noise order of all forms need.
    assert np.mean(residuals**2) == pytest.approx(found.loss, rel=5e-3)
    assert np.array_equal(found.noise["d"], found.fit.polynomials["D"][1:])
    crossover = found.open_loop and found.open_loop["crossover_rad_s"]
    assert crossover
    response = found.fit.frequency_response([crossover.value]).response[0]
    # The crossover is the mean over forms; the polynomials describe the best form.
    front = next(row["weight"] for row in found.forms if row["form"] == found.form)
    off = 1e-3 if front == 1.0 else 2 * (crossover.standard_error or 0.0) / crossover.value
    assert abs(response) / crossover.value == pytest.approx(1.0, rel=off)
    assert found.fit.covariance is None and found.fit.quality["vaf_prediction"] > 90
    assert found.fit.to_xarray()["value"].sizes["parameter"] == len(found.fit.parameters)


def test_the_command_line_gives_the_same(
    found: pyhoid.OperatorFit, runs: list[pyhoid.Record], people: Path, cli: Any
) -> None:
    files = [people / f"S1_integrator_{run}.csv" for run in (1, 2, 3)]
    expected = cli.json("identify", *files, "--controlled-element", "1/s")
    assert found.form == expected["form"] and list(found.verdict) == [
        expected["verdict"]["level"],
        *(expected["verdict"][name] for name in ("reasons", "notes")),
    ]
    for p in expected["parameters"]:
        here = found.parameters[p["name"]]
        assert (here.value, here.standard_error) == (p["value"], p["standard_error"])
        assert (here.prior_share, here.determined) == (p["prior_share"], p["determined"])
    assert found.covariance is not None
    assert found.covariance.tolist() == expected["covariance"]["matrix"]
    assert found.forms == expected["forms"] and found.loss == expected["loss"]
    assert found.lines is not None and found.lines["chi2"] == expected["lines"]["chi2"]
    # A result of the command line as a prior, and the fit itself.
    path = people.parent / "result.json"
    path.write_text(json.dumps(expected))
    by_file = pyhoid.identify_operator(runs[0], prior=path, **FEW)
    by_fit = pyhoid.identify_operator(runs[0], prior=found, **FEW)
    assert by_file.prior == by_fit.prior and "tau_e" in by_file.prior
    assert by_file.parameters["tau_e"] == by_fit.parameters["tau_e"]


def test_options(runs: list[pyhoid.Record]) -> None:
    one = runs[0]
    plain = pyhoid.identify_operator(one, excitation="none", prior=None, **FEW)
    assert plain.lines is None and plain.open_loop is None and plain.prior == {}
    assert all(p.prior_share == 0 for p in plain.parameters.values())
    assert plain.form == "lead-lag" and len(plain.forms) == 1 and len(plain.noise["d"]) <= 6
    by_names = pyhoid.identify_operator(
        one, excitation="none", prior={"omega_nm": (10.5, 0.3)}, **FEW
    )
    by_text = pyhoid.identify_operator(one, excitation="none", prior="omega_nm=10.5:0.3", **FEW)
    assert by_names.parameters == by_text.parameters
    assert by_names.parameters.omega_nm.prior_share > 0
    without = pyhoid.identify_operator(
        one, form="lead-lag", neuromuscular=False, excitation="none", nd=2, delay=(0.1, 0.4)
    )
    assert "omega_nm" not in without.parameters and 0.1 <= without.parameters.tau_e.value <= 0.4
    with pytest.raises(pyhoid.OptionError, match="excitation .* found nothing; expected one of e, u"):
        pyhoid.identify_operator(one, excitation="nothing", **FEW)


def test_a_gain_for_each_run(runs: list[pyhoid.Record]) -> None:
    each = pyhoid.identify_operator(runs[:2], individual=["K"], excitation="none", **FEW)
    first, second = each.operators
    assert first.K_over_T_I.value != second.K_over_T_I.value
    assert first.tau_e.value == second.tau_e.value and len(each.fits) == 2
    assert each.fits[1].records == each.records[1:]


def test_what_cannot_be(runs: list[pyhoid.Record], tmp_path: Path) -> None:
    for wrong, word in [
        ({"form": "integral"}, "lead-lag"),
        ({"form": "lead", "neuromuscular": False}, "pure derivative"),
        ({"prior": "K=1:1"}, "omega_nm"),
        ({"prior": {"omega_nm": 10.0}}, "centre, spread"),
        ({"prior": {"omega_nm": (-1.0, 0.3)}}, "positive"),
        ({"individual": ["gain"]}, "expected K, T_L"),
        ({"nd": (3, 99)}, "0..64"),
        ({"run_to_run": -1.0}, "0 or more"),
    ]:
        with pytest.raises(pyhoid.OptionError, match=word):
            pyhoid.identify_operator(runs[0], **wrong)
    (tmp_path / "other.json").write_text("[]")
    with pytest.raises(FileNotFoundError, match="none.json"):
        pyhoid.identify_operator(runs[0], prior=tmp_path / "none.json")
    with pytest.raises(pyhoid.OptionError, match="prior: .*other.json"):
        pyhoid.identify_operator(runs[0], prior=tmp_path / "other.json")
    with pytest.raises(pyhoid.DataError):
        pyhoid.identify_operator(runs[0].span(0, 0.5))


def test_guesses_of_coefficients_have_their_own_name(c1: pyhoid.Record) -> None:
    orders = {"nb": 2, "nd": 1, "nf": 2, "nk": 29}
    free = pyhoid.identify(c1, "bj", **orders)
    held = pyhoid.identify(c1, "bj", coefficient_prior={"f1": (-1.9, 1e3)}, **orders)
    assert abs(held.parameters["f1"] + 1.9) < abs(free.parameters["f1"] + 1.9)
    of_coefficients: Any = {"f1": (-1.9, 1.0)}
    with pytest.raises(pyhoid.OptionError, match="prior applies only to"):
        pyhoid.identify(c1, "bj", prior=of_coefficients)


def test_a_simulation_without_noise_gives_its_operator_back() -> None:
    record = pyhoid.simulate("C1", noise_level=0.0)
    found = pyhoid.identify(record)
    assert (found.form, found.verdict.level) == ("lead", "trustworthy")
    truth = {"K_e": 0.09, "T_L": 0.4, "omega_nm": 11.25, "zeta_nm": 0.35, "tau_e": 0.28}
    for name, value in truth.items():
        assert found.parameters[name].value == pytest.approx(value, rel=1e-9)
    assert [row["weight"] for row in found.forms if row["weight"] > 0] == [1.0]


def test_the_delay_depends_on_what_the_error_does_between_its_samples(c1: pyhoid.Record) -> None:
    found = pyhoid.identify(c1, form="lead", nd=1, excitation="none")
    straight = pyhoid.identify(c1, form="lead", nd=1, excitation="none", intersample="foh")
    tau = found.parameters["tau_e"].value
    half = 0.5 * c1.sample_time
    assert found.intersample["used"] == "auto"
    assert found.intersample["tau_e_if_straight"] == pytest.approx(tau + half, rel=1e-9)
    assert straight.intersample == {"used": "foh", "tau_e_if_straight": None}
    # With one model, the remaining value is the centre of the prior.
    assert straight.parameters["tau_e"].value == pytest.approx(tau + half, abs=1e-4)
    with pytest.raises(pyhoid.OptionError):
        pyhoid.identify(c1, intersample="cubic")


def test_the_page_of_a_person(found: pyhoid.OperatorFit, tmp_path: Path) -> None:
    page = found.report(tmp_path / "page", title="One of three").read_text(encoding="utf-8")
    assert "One of three" in page and "<svg" in page and found.verdict.level in page
    again = pickle.loads(pickle.dumps(found))
    assert "phase margin" in again.report(tmp_path / "again").read_text(encoding="utf-8")
    with pytest.raises(pyhoid.DataError, match="no records"):
        pyhoid.from_json(found.to_json()).report(tmp_path / "none")
