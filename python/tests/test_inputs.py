"""Several inputs: signals that a person sees in addition to the error."""

from __future__ import annotations

from pathlib import Path

import pytest

import pyhoid

SCENARIO = Path(__file__).parents[2] / "fixtures" / "scenario" / "pursuit.toml"


@pytest.fixture(scope="module")
def runs() -> list[pyhoid.Record]:
    return [pyhoid.simulate(scenario=SCENARIO, seed=seed) for seed in (1, 2, 3)]


def test_both_responses_are_found(runs: list[pyhoid.Record]) -> None:
    fit = pyhoid.identify(
        runs, inputs=["e", "f_t"], roles={"f_t": "feedforward:0.25"}, intersample="zoh"
    )
    feedback, target = fit.channels
    assert (feedback["role"], target["role"], target["form"]) == (
        "feedback",
        "feedforward",
        "derivative",
    )
    found = {p["name"]: p for p in target["parameters"]}
    for name, truth in (("K_d", 0.7), ("tau_f", -0.05)):
        assert abs(found[name]["value"] - truth) < 3.5 * found[name]["standard_error"], found[name]
    assert len(target["response"]) == len(feedback["response"])
    again = pyhoid.from_json(fit.to_json())
    assert isinstance(again, pyhoid.OperatorFit) and again.to_json() == fit.to_json()


def test_one_input_is_doubtful_where_the_target_is_seen(runs: list[pyhoid.Record]) -> None:
    fit = pyhoid.identify(runs)
    assert fit.channels == []
    assert fit.verdict.level == "doubtful"
    assert any("responds to f_t" in reason for reason in fit.verdict.reasons)


@pytest.mark.parametrize(
    ("inputs", "roles", "words"),
    [
        (["q"], None, "expected the error first"),
        (["e"], {"e": "motion"}, "e is the feedback"),
        (["e"], {"f_t": "motion"}, "not one of the inputs"),
        (["e", "nothing"], None, "no channel nothing"),
        (None, {"f_t": "sight"}, "feedforward"),
    ],
)
def test_what_has_no_meaning_is_refused(
    runs: list[pyhoid.Record], inputs: list[str] | None, roles: dict[str, str] | None, words: str
) -> None:
    with pytest.raises(pyhoid.Error, match=words):
        pyhoid.identify(runs[0], inputs=inputs, roles=roles)
