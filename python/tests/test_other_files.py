"""Files that other packages read, with the options and checks of all others."""

from __future__ import annotations

import gzip
import json
import shutil
from pathlib import Path

import numpy as np
import pytest

import pyhoid


@pytest.fixture
def run(c1: pyhoid.Record, tmp_path: Path) -> Path:
    pyhoid.write(tmp_path / "run.csv", c1.span(0, 20))
    return tmp_path / "run.csv"


def test_packed_text(run: Path) -> None:
    packed = run.with_name("run.csv.gz")
    with run.open("rb") as source, gzip.open(packed, "wb") as target:
        shutil.copyfileobj(source, target)
    plain, same = pyhoid.read(run, start=5), pyhoid.read(packed, start=5)
    assert np.array_equal(plain.u, same.u) and same.label == plain.label
    assert pyhoid.info(packed)["columns"] == pyhoid.info(run)["columns"]
    with pytest.raises(pyhoid.FormatError, match=r"run\.csv\.gz has no column"):
        pyhoid.read(packed, input="q")
    data = packed.read_bytes()
    packed.write_bytes(data[: len(data) // 2])
    with pytest.raises(pyhoid.FormatError, match="damaged"):
        pyhoid.read(packed)
    with pytest.raises(pyhoid.FileMissingError, match="No such file"):
        pyhoid.read(run.with_name("none.csv.gz"))


def test_compressed_bids_recording(tmp_path: Path) -> None:
    place = tmp_path / "sub-01" / "beh"
    place.mkdir(parents=True)
    packed = place / "sub-01_task-track_physio.tsv.gz"
    with gzip.open(packed, "wt") as table:
        table.writelines(f"{0.1 * k:.1f}\t{0.2 * k:.1f}\n" for k in range(50))
    sidecar = {"SamplingFrequency": 50, "StartTime": -2.5, "Columns": ["e", "u"]}
    (tmp_path / "task-track_physio.json").write_text(json.dumps(sidecar))
    read = pyhoid.read(packed)
    assert (len(read.u), read.start_time, read.sample_time) == (50, -2.5, 0.02)
    assert pyhoid.info(packed)["columns"]


def test_arrow(run: Path) -> None:
    pytest.importorskip("polars")
    plain = pyhoid.read(run)
    for ending in ("arrow", "feather"):
        file = run.with_suffix(f".{ending}")
        plain.to_polars().write_ipc(file)
        same = pyhoid.read(file)
        assert np.array_equal(plain.u, same.u) and same.sample_time == plain.sample_time
    run.with_suffix(".ipc").write_text("nothing")
    with pytest.raises(pyhoid.FormatError, match="cannot be read as Arrow"):
        pyhoid.read(run.with_suffix(".ipc"))


def test_formats_that_nobody_reads_have_a_way_out(tmp_path: Path) -> None:
    for name, words in (("a.mcap", "package mcap"), ("a.edf", "pyedflib"), ("a.TDMS", "nptdms")):
        with pytest.raises(pyhoid.FormatError, match=words):
            pyhoid.read(tmp_path / name)
