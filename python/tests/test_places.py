"""One run of 82 s through every available interface gives the digits of `hoid track`."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from places import PLACES, Missing, Place, Run, Tools
from places.told import expected


@pytest.fixture(scope="module")
def tools(cli: Any, tmp_path_factory: pytest.TempPathFactory) -> Tools:
    return Tools(Path(cli.binary).absolute(), tmp_path_factory.mktemp("places"))


@pytest.fixture(scope="module")
def run(tools: Tools) -> Run:
    return Run.made(tools, tools.folder)


@pytest.fixture(scope="module")
def traces(tools: Tools, run: Run) -> dict[tuple[str, ...], dict[str, list[float]]]:
    return {
        options: expected(tools, run, tools.folder, options)
        for options in {place.options for place in PLACES}
    }


def parameter(place: Place) -> Any:
    """An interface as a named test; its streams do not run in parallel with ``test_lsl.py``."""
    group = [pytest.mark.xdist_group("lsl")] if "LabStreamingLayer" in place.name else []
    return pytest.param(place, id=place.name, marks=group)


@pytest.mark.parametrize("place", [parameter(place) for place in PLACES])
def test_the_digits_are_those_of_track(place: Place, tools: Tools, run: Run, traces: Any) -> None:
    try:
        told = place.run(run, tools)
    except Missing as reason:
        pytest.skip(str(reason))
    off = told.compared(traces[place.options]).off
    assert set(off) <= set(place.other_functions) and all(by <= place.off for by in off.values())
    # One row per sample, with at least some known quantities.
    assert len(told.rows) == len(run.e) or told.at is not None
    assert len(told.rows) >= 3 and not np.isnan(told.rows[-1]).any()
