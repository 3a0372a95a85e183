"""Conditions and people compared."""

from __future__ import annotations

import json
import pickle
from pathlib import Path

import pyhoid
import pytest


@pytest.fixture
def results(tmp_path: Path) -> Path:
    people = [
        {
            "subject": subject,
            "condition": condition,
            "run": "all",
            "runs": 5,
            "form": "lead",
            "parameters": {"tau_e": {"value": 0.6 / crossover, "standard_error": 0.01}},
            "open_loop": {"crossover_rad_s": {"value": crossover, "standard_error": 0.1}},
            "verdict": {"level": "trustworthy", "reasons": []},
        }
        for subject, fo, so in [("P03", 2.0, 1.2), ("P05", 4.0, 3.3), ("P09", 3.0, 2.6), ("P11", 3.1, 2.2)]
        for condition, crossover in [("fo", fo), ("so", so)]
    ]
    path = tmp_path / "results.json"
    path.write_text(json.dumps({"group": "pilots", "people": people}))
    return path


def test_conditions_are_compared(results: Path) -> None:
    found = pyhoid.compare(results, of=["crossover", "tau_e"])
    assert found.verdict.level == "trustworthy"
    assert found.sentences[0].startswith("crossover fell by 0.7")
    assert repr(found).endswith(found.sentences[-1])
    difference = found.differences[0]
    assert (difference["quantity"], difference["unit"], difference["degrees_of_freedom"]) == (
        "crossover",
        "rad/s",
        3,
    )
    table = found.to_dataframe()
    assert list(table["quantity"]) == ["crossover", "tau_e"]
    assert (table["low"] < table["value"]).all() and (table["p_adjusted"] >= table["p"]).all()
    assert len(found.to_dataframe("estimates")) == 16
    assert found.to_dataframe("left_out").empty
    assert found.to_svg().startswith("<svg ")
    again = pyhoid.Comparison.from_json(found.to_json())
    assert again == found and pickle.loads(pickle.dumps(found)) == found


def test_factors_are_given_as_texts_or_names(results: Path) -> None:
    levels = {"training": {"no": ["P03", "P05"], "yes": ["P09", "P11"]}}
    named = pyhoid.compare(results, factor=levels, of="crossover", variation="between")
    typed = pyhoid.compare(results, factor="training:no=P03,P05;yes=P09,P11", of="crossover")
    assert named.differences == typed.differences
    both = pyhoid.compare(results, factor=["condition", "training:no=P03,P05;yes=P09,P11"], of="crossover")
    assert [d["factor"] for d in both.differences] == ["condition", "training", "condition × training"]


def test_mistakes_are_told(results: Path, tmp_path: Path) -> None:
    with pytest.raises(pyhoid.OptionError, match="expected crossover"):
        pyhoid.compare(results, of="speed")
    with pytest.raises(pyhoid.OptionError, match="the conditions are fo, so"):
        pyhoid.compare(results, factor="display")
    with pytest.raises(pyhoid.OptionError):
        pyhoid.compare(results, adjust="bonferroni")  # type: ignore[arg-type]
    with pytest.raises(pyhoid.FormatError, match=r"group\.toml"):
        pyhoid.compare(tmp_path)
    with pytest.raises(pyhoid.FileMissingError):
        pyhoid.compare(tmp_path / "nothing.json")
    with pytest.raises(pyhoid.DataError):
        pyhoid.Comparison.from_json("{}")
