"""Studies: the same bytes as the command line, shards, resume, an interrupt."""

from __future__ import annotations

import hashlib
import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import pyhoid

PLAN = """
name = "small"
title = "Both structures in C1"
seed = 5
replications = 12
block = 4

[[scenarios]]
name = "constant"
condition = "C1"
remnant.noise_level = [0.1, 0.2]

[[estimators]]
name = "ARX"
method = "fit"
structure = "arx"
orders.nk = 29

[[estimators]]
name = "BJ"
method = "fit"
structure = "bj"
orders.nd = 1
orders.nk = 29
"""


def digests(directory: Path) -> dict[str, str]:
    return {
        file.name: hashlib.sha256(file.read_bytes()).hexdigest()
        for file in sorted(directory.glob("*.parquet"))
    }


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> pyhoid.Results:
    return pyhoid.study(PLAN, tmp_path_factory.mktemp("study") / "whole")


def test_a_plan_says_what_it_holds() -> None:
    plan = pyhoid.plan(PLAN)
    assert (plan.name, plan.seed, plan.replications) == ("small", 5, 12)
    assert plan.estimates == 2 * 12 * 2 and len(plan.cells) == 2 and "small" in repr(plan)
    assert pyhoid.plan(plan, replications=3).replications == 3
    assert "bias" in pyhoid.plans() and pyhoid.plan("bias").title == pyhoid.plans()["bias"]
    with pytest.raises(pyhoid.OptionError, match="line"):
        pyhoid.plan(PLAN.replace("seed = 5", "seed = five"))
    with pytest.raises(pyhoid.OptionError, match="no file or plan is named"):
        pyhoid.plan("nonsense")


def test_tables(whole: pyhoid.Results) -> None:
    assert whole.finished and whole.estimates == 48 and "fits" in whole
    fits = whole.fits
    frame = fits.to_pandas()
    assert len(frame) == 48 and fits.to_polars().height == 48 and fits.to_arrow().num_rows == 48
    assert isinstance(fits["K_e"], np.ndarray) and fits["K_e"].dtype == np.float64
    assert set(pyhoid.results(whole.directory)) == set(whole)
    with pytest.raises(pyhoid.StudyStateError):
        pyhoid.results(whole.directory / "nothing")


def test_the_command_line_writes_the_same_bytes(
    whole: pyhoid.Results, cli: Any, tmp_path: Path
) -> None:
    plan = tmp_path / "plan.toml"
    plan.write_text(PLAN)
    cli.run("study", "run", plan, "--out", tmp_path / "out")
    assert digests(tmp_path / "out") == digests(whole.directory)


def test_shards_make_the_whole(whole: pyhoid.Results, tmp_path: Path) -> None:
    shards = [tmp_path / f"shard-{k}" for k in (1, 2, 3)]
    for k, shard in enumerate(shards, 1):
        assert not pyhoid.study(PLAN, shard, shard=(k, 3)).finished
    with pytest.raises(pyhoid.StudyStateError, match="missing"):
        pyhoid.merge(shards[:2], tmp_path / "lacking")
    merged = pyhoid.merge(shards, tmp_path / "merged")
    assert digests(merged.directory) == digests(whole.directory)


def test_an_occupied_directory_is_not_overwritten(whole: pyhoid.Results) -> None:
    with pytest.raises(pyhoid.StudyStateError, match="resume=True"):
        pyhoid.study(PLAN, whole.directory)
    assert pyhoid.study(PLAN, whole.directory, resume=True).estimates == 0


@pytest.mark.skipif(sys.platform == "win32", reason="signals are sent otherwise there")
def test_an_interrupt_stops_within_a_second_and_nothing_is_lost(tmp_path: Path) -> None:
    program = (
        "import pyhoid, sys\n"
        "print('started', flush=True)\n"
        "plan = open(sys.argv[1]).read()\n"
        "show = lambda done, total: print(done, flush=True)\n"
        "pyhoid.study(plan, sys.argv[2], resume=True, progress=show)\n"
    )
    plan = PLAN.replace("replications = 12", "replications = 400")
    (tmp_path / "plan.toml").write_text(plan)
    running = subprocess.Popen(
        [sys.executable, "-c", program, str(tmp_path / "plan.toml"), str(tmp_path / "out")],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    assert running.stdout is not None
    for line in running.stdout:
        if line.strip().isdigit() and int(line) > 40:
            break
    begun = time.monotonic()
    os.kill(running.pid, signal.SIGINT)
    _, errors = running.communicate(timeout=30)
    assert time.monotonic() - begun < 2.0, "a second, and one more for a machine under load"
    assert running.returncode != 0 and "KeyboardInterrupt" in errors
    resumed = pyhoid.study(plan, tmp_path / "out", resume=True)
    assert 0 < resumed.estimates < 1600
    at_once = pyhoid.study(plan, tmp_path / "other")
    assert digests(resumed.directory) == digests(at_once.directory)


def test_a_group(cli: Any, tmp_path: Path) -> None:
    cli.run(
        *"simulate-group --subjects 2 --runs 2 --conditions C1 --out".split(), tmp_path / "runs"
    )
    text, others = pyhoid.group_manifest(tmp_path / "runs")
    assert "[[runs]]" in text and "truth.csv" in others
    found = pyhoid.group(tmp_path / "runs", tmp_path / "group")
    assert {"estimates", "averages"} <= set(found) and len(found["estimates"].to_pandas()) > 0
