"""Results as JSON: the format of the command line, and reading it back."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import pyhoid

CALLS: list[dict[str, Any]] = [
    {"form": "lead", "nd": (0, 4)},
    {"form": "lead", "nd": 2, "controlled_element": "1/s"},
    {"noise": "remnant", "remnant_order": 1},
    {"change": "sigmoid"},
    {"structure": "bj", "nb": 2, "nd": (1, 2), "nf": 2, "nk": (28, 30)},
    {"structure": "arx", "nk": 29},
]


@pytest.mark.parametrize("call", CALLS, ids=lambda call: "-".join(map(str, call.values())))
def test_a_result_is_equal_to_what_comes_back(call: dict[str, Any], c1: pyhoid.Record) -> None:
    record = c1.span(0, 50)
    fit = pyhoid.identify(record, **call)
    text = fit.to_json()
    back = pyhoid.from_json(text)
    assert type(back) is type(fit) and back == fit and back.to_json() == text
    assert back.records == () and back.verdict == fit.verdict and back.faults == fit.faults
    assert back.parameters == fit.parameters and back.settings == fit.settings
    assert back.given == fit.given and back.units == fit.units
    other = pyhoid.simulate("C1", seed=5).span(0, 20)
    assert back != pyhoid.identify(other, "arx", nk=29)
    if isinstance(fit, pyhoid.Fit):
        assert back.quality == fit.quality
    one, two = (f.fit if isinstance(f, pyhoid.OperatorFit) else f for f in (fit, back))
    assert np.array_equal(one.simulate(other).values, two.simulate(other).values)
    assert np.array_equal(one.residuals(other).values, two.residuals(other).values)


def test_every_result_has_the_same_envelope(c1: pyhoid.Record) -> None:
    for call in CALLS:
        found = json.loads(pyhoid.identify(c1.span(0, 50), **call).to_json())
        polynomial = call.get("structure") in ("bj", "arx")
        assert found["kind"] == ("polynomial" if polynomial else "operator")
        assert {"hoid", "records", "data", "settings", "verdict", "parameters"} <= set(found)
        settings = {one["name"]: (one["value"], one["given"]) for one in found["settings"]}
        assert settings["structure"] == (call.get("structure", "operator"), polynomial)
        assert settings["faults"] == ("bridge", False)
        assert ("controlled element" in settings) == ("controlled_element" in call)
        if "controlled_element" in call:
            assert settings["controlled element"][1]


def test_what_is_no_result_is_refused(fit: pyhoid.Fit) -> None:
    text = fit.to_json()
    for wrong in ("", "[1]", "{}", '{"estimator": "pem"}', text[: len(text) // 2]):
        with pytest.raises(pyhoid.DataError, match="not a result of a fit"):
            pyhoid.from_json(wrong)
    changed = json.loads(text)
    changed["estimator"] = "operator"
    with pytest.raises(pyhoid.DataError):
        pyhoid.from_json(json.dumps(changed))


def test_a_design_comes_back_and_a_description_says_that_it_cannot(c1: pyhoid.Record) -> None:
    design = pyhoid.design(controlled_element="4/s", runs=2)
    back = pyhoid.from_json(design.to_json())
    assert isinstance(back, pyhoid.ExperimentDesign) and back.to_json() == design.to_json()
    for result, kind in ((pyhoid.describe(c1), "description"), (pyhoid.track(c1), "trace")):
        with pytest.raises(pyhoid.DataError, match=f"its kind is {kind}, whose JSON cannot be read back"):
            pyhoid.from_json(result.to_json())


def test_a_part_says_whose_it_is(c1: pyhoid.Record) -> None:
    operator = pyhoid.identify(c1.span(0, 50), form="lead", nd=2)
    with pytest.raises(pyhoid.DataError, match="part of another result"):
        operator.fit.to_json()


def test_a_file_is_read_with_its_units(tmp_path: Path, c1: pyhoid.Record) -> None:
    path = tmp_path / "person.json"
    fit = pyhoid.identify(c1.span(0, 50), form="lead", nd=2)
    path.write_text(fit.to_json())
    back = pyhoid.from_json(path.read_text())
    assert isinstance(back, pyhoid.OperatorFit)
    assert {name: p.unit for name, p in back.parameters.items()} == {
        name: p.unit for name, p in fit.parameters.items()
    }


def test_an_operator_does_what_polynomials_do(c1: pyhoid.Record, tmp_path: Path) -> None:
    record = c1.span(0, 50)
    person = pyhoid.identify(record, form="lead", nd=2, controlled_element="1/s")
    for name in ("predict", "simulate", "residuals"):
        one, two = getattr(person, name)(record), getattr(person.fit, name)(record)
        assert one.first == two.first and np.array_equal(one.values, two.values)
    assert person.quality == person.fit.quality_on(person.records)
    assert person.validate(person.records[0]).quality == person.quality_on(person.records)
    # The response is that of the polynomials, and its errors are those of the operator's intervals.
    omega = [0.5, 1.0, 2.0, 4.0]
    one, two = person.frequency_response(omega), person.fit.frequency_response(omega)
    assert np.allclose(one.magnitude_db, two.magnitude_db, atol=0.02)
    assert np.allclose(one.phase_deg, two.phase_deg, atol=0.2)
    assert np.all(one.magnitude_db_se > 0) and np.all(np.isfinite(one.phase_deg_se))
    loop, again = person.open_loop, person.margins("1/s")
    assert loop is not None
    assert again["crossover_rad_s"] == loop["crossover_rad_s"]
    assert again["phase_margin_deg"] == loop["phase_margin_deg"]
    assert list(person.to_xarray()["parameter"].values) == list(person.parameters)
    back = pyhoid.from_json(person.to_json())
    assert isinstance(back, pyhoid.OperatorFit)
    assert back.quality == person.quality
    assert np.array_equal(back.frequency_response(omega).phase_deg_se, one.phase_deg_se)
