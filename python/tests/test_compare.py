"""Comparison of conditions and people."""

from __future__ import annotations

import json
import pickle
from pathlib import Path

import pyhoid
import pytest


def test_conditions_are_compared(group_results: Path) -> None:
    found = pyhoid.compare(group_results, of=["crossover", "tau_e"])
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
    dispatched = pyhoid.from_json(found.to_json())
    assert isinstance(dispatched, pyhoid.Comparison) and dispatched.to_json() == found.to_json()
    assert again == found and pickle.loads(pickle.dumps(found)) == found


def test_factors_are_given_as_texts_or_names(group_results: Path) -> None:
    levels = {"training": {"no": ["P03", "P05"], "yes": ["P09", "P11"]}}
    named = pyhoid.compare(group_results, factor=levels, of="crossover", variation="between")
    typed = pyhoid.compare(group_results, factor="training:no=P03,P05;yes=P09,P11", of="crossover")
    assert named.differences == typed.differences
    both = pyhoid.compare(group_results, factor=["condition", "training:no=P03,P05;yes=P09,P11"], of="crossover")
    assert [d["factor"] for d in both.differences] == ["condition", "training", "condition × training"]


def test_a_mixed_model_of_two_conditions_is_the_paired_difference(group_results: Path) -> None:
    found = pyhoid.compare(group_results, of=["crossover", "tau_e"])
    unweighted = found.differences[0]["unweighted"]
    model = found.mixed_model("crossover")
    assert model.params["C(condition)[T.so]"] == pytest.approx(unweighted["value"], rel=1e-6)
    assert model.bse["C(condition)[T.so]"] == pytest.approx(unweighted["standard_error"], rel=1e-3)
    rows = found.to_dataframe("estimates")
    rows["trained"] = rows["subject"].isin(["P09", "P11"])
    assert "trained[T.True]" in found.mixed_model("crossover", "trained + condition", rows).params
    with pytest.raises(pyhoid.OptionError, match="expected crossover, tau_e"):
        found.mixed_model("speed")


def test_a_bayes_factor_is_that_of_the_unweighted_test(group_results: Path) -> None:
    found = pyhoid.compare(group_results, of=["crossover"])
    factor = found.differences[0]["bayes_factor"]
    assert factor > 3 and found.to_dataframe()["bayes_factor"][0] == factor


def test_mistakes_are_told(group_results: Path, tmp_path: Path) -> None:
    with pytest.raises(pyhoid.OptionError, match="expected crossover"):
        pyhoid.compare(group_results, of="speed")
    with pytest.raises(pyhoid.OptionError, match="the conditions fo, so"):
        pyhoid.compare(group_results, factor="display")
    with pytest.raises(pyhoid.OptionError):
        pyhoid.compare(group_results, adjust="bonferroni")  # type: ignore[arg-type]
    with pytest.raises(pyhoid.FormatError, match=r"group\.toml"):
        pyhoid.compare(tmp_path)
    with pytest.raises(pyhoid.FileMissingError):
        pyhoid.compare(tmp_path / "nothing.json")
    with pytest.raises(pyhoid.DataError):
        pyhoid.Comparison.from_json("{}")


def test_recordings_are_analysed_first(tmp_path: Path) -> None:
    runs, kept = tmp_path / "runs", tmp_path / "kept"
    plants = ["integrator", "double-integrator"]
    pyhoid.simulate_people(runs, subjects=3, runs=1, plants=plants, remnants=["lag"], remnant_share=(0.05, 0.1))
    seen: list[tuple[int, int]] = []
    found = pyhoid.compare(
        runs, of=["crossover", "T_L"], directory=kept, progress=lambda done, total: seen.append((done, total))
    )
    assert [d["quantity"] for d in found.differences] == ["crossover", "T_L"]
    assert any("of all people" in note for note in found.verdict.notes) and seen[-1][0] == seen[-1][1]
    # A finished analysis is compared again without the recordings.
    again = pyhoid.compare(kept / "group", of="crossover")
    assert again.differences[0]["value"] == found.differences[0]["value"]
    assert sorted(place.name for place in kept.iterdir()) == ["group", "group-lead-lag"]
