"""Design of experiments."""

from __future__ import annotations

import json
import pickle
from pathlib import Path
from typing import Any

import pytest

import pyhoid


def test_an_experiment_is_designed(tmp_path: Path) -> None:
    designed = pyhoid.design(
        controlled_element="4/s",
        wanted={"tau_e": 0.03, "crossover": 0.02},
        against="reference",
        difference="crossover=10%",
    )
    assert (designed.form, designed.runs) == ("gain", designed.runs_needed)
    assert designed.errors["crossover"] <= 0.02 * designed.to_dataframe()["value"][0]
    assert len(designed.to_dataframe("lines")) == 10
    assert set(designed.to_dataframe("people")["person"]) >= {designed.worst["name"]}  # type: ignore[index]
    power = designed.to_dataframe("power")
    assert (
        power["power"].between(0.05, 1).all()
        and power.query("runs == 8")["power"].is_monotonic_increasing
    )
    assert designed.against is not None and designed.against["name"] == "reference"
    for figure in ("response", "runs"):
        assert designed.to_svg(figure).startswith("<svg ")  # type: ignore[arg-type]
    designed.write(tmp_path / "design")
    assert (tmp_path / "design" / "lab.toml").exists()
    again = pyhoid.design(tmp_path / "design" / "scenario.toml", runs=designed.runs)
    assert again.form == "gain"


def test_a_design_is_read_again() -> None:
    designed = pyhoid.design(controlled_element=([4], [1, 1, 0]), difference={"phase_margin": 5})
    again = pyhoid.ExperimentDesign.from_json(designed.to_json())
    assert again == designed and pickle.loads(pickle.dumps(designed)) == designed
    assert "crossover" in repr(designed)
    with pytest.raises(pyhoid.DataError):
        pyhoid.ExperimentDesign.from_json("{}")
    changed = json.loads(designed.to_json())
    changed["state"] = changed["state"].replace("runs = 1", "runs = 2")
    with pytest.raises(pyhoid.DataError):
        pyhoid.ExperimentDesign.from_json(json.dumps(changed))


def test_a_group_is_designed_for(group_results: Path) -> None:
    wanted: dict[str, Any] = {"condition": "fo", "controlled_element": "1/s", "disturbance": True}
    # A delay without other parameters is not an operator.
    with pytest.raises(pyhoid.FormatError, match="K_e of the form lead is not known"):
        pyhoid.design(group_results, **wanted)
    results = json.loads(group_results.read_text())
    for person in results["people"]:
        gain = 0.9 * person["open_loop"]["crossover_rad_s"]["value"]
        others = {"K_e": gain, "T_L": 0.1, "omega_nm": 12, "zeta_nm": 0.3}
        person["parameters"] |= {name: {"value": value} for name, value in others.items()}
    group_results.write_text(json.dumps(results))
    designed = pyhoid.design(group_results, **wanted)
    assert len(designed.people) >= 3 and designed.form == "lead"
    assert 1.5 < designed.to_dataframe()["value"][0] < 4
    with pytest.raises(pyhoid.OptionError, match="condition"):
        pyhoid.design(group_results, controlled_element="1/s")


def test_both_responses_to_a_target_that_is_seen() -> None:
    designed = pyhoid.design(controlled_element="4/s", display="pursuit", difference="tau_f=0.05")
    assert designed.errors["K_f"] > 0 and designed.errors["tau_f"] > 0
    assert set(designed.to_dataframe("lines")["enters"]) == {"target", "disturbance"}
    assert len(designed.to_dataframe("response_to_target")) == len(designed.response)


def test_mistakes_are_told(tmp_path: Path) -> None:
    with pytest.raises(pyhoid.OptionError, match=r"controlled_element"):
        pyhoid.design()
    with pytest.raises(pyhoid.OptionError, match="expected one of crossover"):
        pyhoid.design(controlled_element="4/s", wanted={"T_I": 0.1})
    with pytest.raises(pyhoid.OptionError, match="disturbance"):
        pyhoid.design(controlled_element="4/s", display="pursuit", against="reference")
    with pytest.raises(pyhoid.OptionError, match="spacing"):
        pyhoid.design(controlled_element="4/s", lines=60, spacing=9)
    with pytest.raises(pyhoid.FileMissingError):
        pyhoid.design(tmp_path / "nothing.toml")
    with pytest.raises(pyhoid.FormatError, match="does not contain people"):
        pyhoid.design(tmp_path)
