"""Interfaces within this process: Python, functional mock-up units."""

from __future__ import annotations

import math
import os
import time
from collections.abc import Iterable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from .told import COLUMNS, ELEMENT, OPERATOR, STEP, Missing, Place, Run, Told
from .tools import Tools, stripped


def of_tracker(tracker: Any) -> list[float]:
    """The output of a tracker in Python."""
    operator = tracker.operator_estimate()
    is_known = operator is not None and operator.convertible
    pairs = [operator[name] if is_known else None for name in OPERATOR]
    pairs += [tracker.crossover, tracker.phase_margin]
    numbers = [number for pair in pairs for number in pair or (None, None)]
    return [math.nan if number is None else number for number in numbers]


def python(run: Run, tools: Tools) -> Told:
    import pyhoid

    tracker = pyhoid.Tracker(sample_time=STEP, controlled_element=ELEMENT)
    rows, seconds = [], []
    for e, u in zip(run.e, run.u, strict=True):
        begin = time.perf_counter()
        tracker.step(e, u)
        row = of_tracker(tracker)
        seconds.append(time.perf_counter() - begin)
        rows.append(row)
    module = Path(pyhoid._pyhoid.__file__)
    return Told(
        np.array(rows), seconds=np.array(seconds), size=(tools.shipped(module), "native module")
    )


def unit(version: int, run: Run, tools: Tools) -> Told:
    try:
        import fmpy
        from fmpy.fmi2 import FMU2Slave
        from fmpy.fmi3 import FMU3Slave
    except ImportError as error:
        raise Missing(f"there is no FMPy: {error}") from None
    path = tools.folder / f"tracker{version}.fmu"
    library = stripped(tools.shared_library(), tools.folder)
    options = ("--fmi", version, "--controlled-element", ELEMENT)
    tools.hoid("fmu", "--out", path, "--library", library, *options)
    about = fmpy.read_model_description(path)
    references = {v.name: v.valueReference for v in about.modelVariables}
    slave = (FMU2Slave if version == 2 else FMU3Slave)(
        guid=about.guid,
        unzipDirectory=fmpy.extract(path),
        modelIdentifier=about.coSimulation.modelIdentifier,
        instanceName="place",
    )
    slave.instantiate()
    if version == 2:
        slave.setupExperiment(startTime=0.0)
    slave.enterInitializationMode()
    slave.exitInitializationMode()
    put = slave.setReal if version == 2 else slave.setFloat64
    get = slave.getReal if version == 2 else slave.getFloat64
    inputs = [references["e"], references["u"]]
    outputs = [references[name] for name in COLUMNS]
    # The unit reads no files of this folder and leaves none.
    empty = tools.folder / f"empty{version}"
    empty.mkdir(exist_ok=True)
    before = Path.cwd()
    os.chdir(empty)
    rows, seconds = [], []
    for k, pair in enumerate(zip(run.e, run.u, strict=True)):
        begin = time.perf_counter()
        put(inputs, pair)
        slave.doStep(currentCommunicationPoint=k * STEP, communicationStepSize=STEP)
        row = get(outputs)
        seconds.append(time.perf_counter() - begin)
        rows.append([float(number) for number in row])
    slave.terminate()
    slave.freeInstance()
    os.chdir(before)
    assert list(empty.iterdir()) == []
    return Told(np.array(rows), seconds=np.array(seconds), size=(path.stat().st_size, "unit"))


PLACES: Iterable[Place] = (
    Place("Python, `pyhoid`", "four calls", python),
    Place("FMI 2.0 (FMPy)", "inputs, a step, outputs", partial(unit, 2)),
    Place("FMI 3.0 (FMPy)", "inputs, a step, outputs", partial(unit, 3)),
)
