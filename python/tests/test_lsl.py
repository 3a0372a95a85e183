"""LabStreamingLayer on loopback: the digits of the tracker alone."""

from __future__ import annotations

import math
import threading
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import pyhoid
import pyhoid.lsl

import xdf

pylsl = pytest.importorskip("pylsl")
# Run one at a time, because each test resolves the streams that exist.
pytestmark = pytest.mark.xdist_group("lsl")

ELEMENT = "90/(s(s+6))"
STEP = 0.01


def person(name: str, labels: tuple[str, ...], rate: float = 100.0) -> Any:
    info = pylsl.StreamInfo(name, "Person", len(labels) or 2, rate, "double64", f"test-{name}")
    if labels:
        channels = info.desc().append_child("channels")
        for label in labels:
            channels.append_child("channel").append_child_value("label", label)
    return pylsl.StreamOutlet(info)


class Running:
    """A stream that is tracked on a thread, and its estimates."""

    def __init__(self, name: str, outlet: Any, tracker: pyhoid.Tracker) -> None:
        self.counts: dict[str, int] = {}
        out = f"{name}-estimate"

        def run() -> None:
            self.counts = pyhoid.lsl.stream(name, out, tracker, patience=2.0)

        self.thread = threading.Thread(target=run)
        self.thread.start()
        assert outlet.wait_for_consumers(20)
        found = pylsl.resolve_byprop("name", out, timeout=20)
        self.inlet = pylsl.StreamInlet(found[0])
        self.inlet.open_stream(timeout=20)

    def estimate(self) -> list[float]:
        values, self.stamp = self.inlet.pull_sample(timeout=20)
        assert values is not None
        return list(values)

    def end(self) -> dict[str, int]:
        self.thread.join(30)
        return self.counts


def same(found: list[float], expected: list[float]) -> bool:
    pairs = zip(found, expected, strict=True)
    return all(a == b or (math.isnan(a) and math.isnan(b)) for a, b in pairs)


def test_the_digits_are_those_of_the_tracker(c4: pyhoid.Record) -> None:
    outlet = person("hoid-test-person", ("u", "f_t", "e"))
    made = lambda: pyhoid.Tracker(sample_time=STEP, controlled_element=ELEMENT)  # noqa: E731
    running = Running("hoid-test-person", outlet, made())
    start = pylsl.local_clock()
    # The samples of one second are lost, and one sample arrives late.
    kept = [k for k in range(3000) if not 1000 <= k < 1100]
    for k in [*kept, 2999]:
        outlet.push_sample([c4.u[k], 0.0, c4.e[k]], start + k * STEP)
    alone = made()
    for k in range(3000):
        lost = 1000 <= k < 1100
        innovation = alone.step(math.nan if lost else c4.e[k], math.nan if lost else c4.u[k])
        if lost:
            continue
        found = running.estimate()
        if k % 100 == 99:
            operator = alone.operator_estimate()
            assert operator is not None
            told = [*(operator[name] for name in ("K_e", "T_L")), alone.crossover]
            wanted = [number for pair in told for number in pair or (None, None)]
            at = [*found[:4], *found[12:14]]
            assert same(at, [math.nan if n is None else n for n in wanted]), k
            assert same(found[16:17], [innovation])
    assert alone.crossover is not None
    assert found[-1] == 100
    assert abs(running.stamp - (start + 2999 * STEP)) < 0.1
    assert running.end() == {"samples": 2900, "lost": 100, "late": 1}


def test_a_recording_of_both_streams_is_read_back(c4: pyhoid.Record, tmp_path: Path) -> None:
    pyxdf = pytest.importorskip("pyxdf")
    name, count = "hoid-test-recorded", 400
    outlet = person(name, ("e", "u"))
    recorder = pylsl.StreamInlet(pylsl.resolve_byprop("name", name, timeout=20)[0])
    recorder.open_stream(timeout=20)
    running = Running(name, outlet, pyhoid.Tracker(sample_time=STEP))
    start = pylsl.local_clock()
    for k in range(count):
        outlet.push_sample([c4.e[k], c4.u[k]], start + k * STEP)
    streams = []
    for label, inlet, labels in (
        (name, recorder, ("e", "u")),
        (f"{name}-estimate", running.inlet, pyhoid.lsl.CHANNELS),
    ):
        pulled = [inlet.pull_sample(timeout=20) for _ in range(count)]
        offset = (pylsl.local_clock(), inlet.time_correction(timeout=20))
        rows, stamps = zip(*pulled, strict=True)
        streams.append(xdf.Stream(label, 1 / STEP, labels, stamps, rows, [offset]))
    assert running.end()["samples"] == count
    path = tmp_path / "both.xdf"
    xdf.write(path, streams)

    theirs = {found["info"]["name"][0]: found for found in pyxdf.load_xdf(path)[0]}
    for stream in streams:
        found = theirs[stream.name]["time_series"]
        assert np.array_equal(found, np.array(stream.rows), equal_nan=True)
    with warnings.catch_warnings():
        # Alignment of the clocks.
        warnings.simplefilter("ignore")
        run = pyhoid.read(path, input=f"{name}.e", output=f"{name}.u")
        # The estimate, from its first value on.
        of = f"{name}-estimate"
        estimate = pyhoid.read(path, input=f"{of}.K_e", output=f"{of}.tau_e_se", start=2.0)
    assert np.array_equal(np.array([run.e, run.u]).T, theirs[name]["time_series"])
    assert np.array_equal(run.e, c4.e[:count]) and np.array_equal(run.u, c4.u[:count])
    columns = [pyhoid.lsl.CHANNELS.index(label) for label in ("K_e", "tau_e_se")]
    wanted = theirs[of]["time_series"][-len(estimate.e) :, columns]
    assert len(estimate.e) >= count - 201
    assert np.array_equal(np.array([estimate.e, estimate.u]).T, wanted)
    stamps = theirs[name]["time_stamps"]
    assert abs(run.sample_time * (count - 1) - (stamps[-1] - stamps[0])) < 1e-6


def test_what_cannot_be_tracked_says_why() -> None:
    with pytest.raises(pyhoid.DataError, match="no stream"):
        pyhoid.lsl.stream("hoid-nobody", "out", pyhoid.Tracker(), patience=0.2)
    outlet = person("hoid-test-other", ("x", "y"))
    with pytest.raises(pyhoid.DataError, match="channels x, y, expected e"):
        pyhoid.lsl.stream("hoid-test-other", "out", pyhoid.Tracker())
    with pytest.raises(pyhoid.OptionError, match="100"):
        pyhoid.lsl.stream("hoid-test-other", "out", pyhoid.Tracker(sample_time=0.02), e="x", u="y")
    del outlet
    assert len(pyhoid.lsl.CHANNELS) == 18 and np.unique(pyhoid.lsl.CHANNELS).size == 18
