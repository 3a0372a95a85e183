"""Functional mock-up units in a simulator.

That the digits of a tracker are those of `hoid track` is tested with all other places, in
``test_places.py``.
"""

from __future__ import annotations

import csv
import math
from pathlib import Path
from typing import Any

import pytest

from places import Missing, Tools
from places.tools import stripped

fmpy = pytest.importorskip("fmpy")

from fmpy.fmi2 import FMU2Slave  # noqa: E402
from fmpy.fmi3 import FMU3Slave  # noqa: E402
from fmpy.validation import validate_fmu  # noqa: E402

STEP = 0.01

#: A person of the family whose gain and delay change, with a remnant that follows the control.
PERSON = """
form = "lead2-lag"
sampling_rate_hz = 100
measurement_s = 20
[initial]
K = 2
T_L_s = 0.5
T_I_s = 3
omega_nm_rad_s = 11
zeta_nm = 0.25
tau_e_s = 0.18
controlled_element = "2/(s(s+3))"
[last]
K = 1.5
tau_e_s = 0.22
[schedule]
rate_per_s = 1
midpoint_s = 8
[disturbance]
rms = 1
[[remnant]]
shape = "lag"
T_n_s = 0.1
share = 0.1
follows = "control"
[stick]
walk_per_root_s = 0.02
"""


@pytest.fixture(scope="module")
def library(cli: Any, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The shared library of the same sources; `cargo xtask test` builds it next to the program."""
    folder = tmp_path_factory.mktemp("library")
    try:
        return stripped(Tools(Path(cli.binary), folder).shared_library(), folder)
    except Missing as reason:
        pytest.skip(str(reason))


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory, cli: Any) -> Path:
    """A run of 82 s in which the task changes."""
    path = tmp_path_factory.mktemp("runs") / "c4.csv"
    cli.run("simulate", "--condition", "C4", "--seed", 3, "--out", path)
    return path


def columns(path: Path) -> dict[str, list[float]]:
    with path.open(newline="") as file:
        rows = list(csv.DictReader(line for line in file if not line.startswith("#")))
    return {name: [float(row[name]) if row[name] else math.nan for row in rows] for name in rows[0]}


class Unit:
    """A unit in simulation mode."""

    def __init__(self, path: Path, start: float = 0.0, **parameters: Any) -> None:
        self.said: list[str] = []
        self.description = fmpy.read_model_description(path)
        self.types = {v.name: v.type for v in self.description.modelVariables}
        self.references = {v.name: v.valueReference for v in self.description.modelVariables}
        folder = fmpy.extract(path)
        self.two = self.description.fmiVersion == "2.0"
        slave = FMU2Slave if self.two else FMU3Slave
        self.unit = slave(
            guid=self.description.guid,
            unzipDirectory=folder,
            modelIdentifier=self.description.coSimulation.modelIdentifier,
            instanceName="tried",
        )
        self.unit.instantiate()
        for name, value in parameters.items():
            self.set(name, value)
        if self.two:
            self.unit.setupExperiment(startTime=start)
            self.unit.enterInitializationMode()
        else:
            self.unit.enterInitializationMode(startTime=start)
        self.unit.exitInitializationMode()

    def _call(self, what: str, name: str, *values: Any) -> Any:
        kind = self.types[name].replace("Real", "Real" if self.two else "Float64")
        return getattr(self.unit, what + kind)([self.references[name]], *values)

    def set(self, name: str, value: Any) -> None:
        self._call("set", name, [value])

    def get(self, name: str) -> Any:
        return self._call("get", name)[0]

    def numbers(self, names: list[str]) -> list[float]:
        read = self.unit.getReal if self.two else self.unit.getFloat64
        return [float(value) for value in read([self.references[name] for name in names])]

    def step(self, t: float) -> None:
        self.unit.doStep(currentCommunicationPoint=t, communicationStepSize=STEP)

    def end(self) -> None:
        self.unit.terminate()
        self.unit.freeInstance()


@pytest.fixture
def empty_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    folder = tmp_path / "empty"
    folder.mkdir()
    monkeypatch.chdir(folder)
    return folder


def test_a_simulator_takes_the_tracker(
    cli: Any, library: Path, run: Path, empty_folder: Path, tmp_path: Path
) -> None:
    import numpy as np

    unit = tmp_path / "tracker.fmu"
    options = '{"nk": 29, "nd": 1, "warm_up": 20}'
    cli.run("fmu", "--out", unit, "--library", library, "--method", "multiple-model")
    record = columns(run)
    signals = np.array(
        list(zip(record["t"], record["e"], record["u"], strict=True)),
        dtype=[("time", float), ("e", float), ("u", float)],
    )
    result = fmpy.simulate_fmu(
        str(unit),
        stop_time=len(signals) * STEP,
        output_interval=STEP,
        input=signals,
        start_values={"options": options},
        output=["K_e_dot", "change_t", "changes", "level"],
    )
    # The task changes at 40.96 s.
    assert result["changes"][-1] >= 1
    assert 39.0 < result["change_t"][-1] < 43.0
    assert abs(result["K_e_dot"][-1] - 0.084) < 0.03


@pytest.mark.parametrize("fmi", [2, 3])
@pytest.mark.parametrize("of", ["C4", "person.toml"])
def test_the_operator_gives_the_digits_of_simulate(
    cli: Any, library: Path, empty_folder: Path, tmp_path: Path, of: str, fmi: int
) -> None:
    run, unit = tmp_path / "run.csv", tmp_path / "person.fmu"
    if of == "C4":
        whom, operator = ("--condition", "C4"), "C4"
    else:
        operator = str(tmp_path / of)
        Path(operator).write_text(PERSON, encoding="utf-8")
        whom = ("--scenario", operator)
    cli.run("simulate", *whom, "--seed", 3, "--keep-run-in", "--out", run)
    seed = ("--seed", 3)
    cli.run(
        *("fmu", "--out", unit, "--library", library, "--operator", operator, *seed, "--fmi", fmi)
    )
    assert validate_fmu(str(unit)) == []
    record = columns(run)
    start = record["t"][0]
    person = Unit(unit, start)
    for k, (e, u, n) in enumerate(zip(record["e"], record["u"], record["n"], strict=True)):
        assert person.numbers(["u", "n"]) == [u, n], k
        person.set("e", e)
        person.step(start + k * STEP)
    person.end()
    other = Unit(unit, start, seed=4)
    for k in range(50):
        other.set("e", 0.0)
        other.step(start + k * STEP)
    assert other.get("u") != record["u"][50]
    other.end()


@pytest.mark.parametrize("fmi", [2, 3])
@pytest.mark.parametrize("kind", ["tracker", "operator", "person"])
def test_a_unit_goes_back_and_goes_on_elsewhere(
    cli: Any, library: Path, run: Path, empty_folder: Path, tmp_path: Path, kind: str, fmi: int
) -> None:
    path = tmp_path / "unit.fmu"
    person = tmp_path / "person.toml"
    person.write_text(PERSON, encoding="utf-8")
    of = {"tracker": (), "operator": ("--operator", "C4"), "person": ("--operator", person)}
    operator = (*of[kind], "--seed", 3) if of[kind] else ()
    cli.run("fmu", "--out", path, "--library", library, "--fmi", fmi, *operator)
    assert validate_fmu(str(path)) == []
    record = columns(run)
    names = ["u", "n"] if operator else ["K_e", "K_e_se", "tau_e_se", "innovation"]

    def went(unit: Unit, first: int, last: int) -> list[list[float]]:
        told = []
        for k in range(first, last):
            unit.set("e", record["e"][k])
            if not operator:
                unit.set("u", record["u"][k])
            unit.step(k * STEP)
            told.append(unit.numbers(names))
        return told

    unit = Unit(path)
    went(unit, 0, 300)
    state = unit.unit.getFMUState()
    expected = went(unit, 300, 500)
    assert not any(math.isnan(number) for number in expected[-1])
    unit.unit.setFMUState(state)
    assert went(unit, 300, 500) == expected
    data = unit.unit.serializeFMUState(state)
    unit.unit.freeFMUState(state)
    # In a separate instance with a different previous state.
    other = Unit(path)
    went(other, 0, 7)
    other.unit.setFMUState(other.unit.deserializeFMUState(data))
    assert went(other, 300, 500) == expected
    for damaged in (data[:-1], data[:100] + bytes([data[100] ^ 1]) + data[101:], b""):
        with pytest.raises(Exception, match="FMU[sS]tate"):
            other.unit.deserializeFMUState(damaged)
    # The state of another unit is rejected.
    cli.run(
        *("fmu", "--out", path, "--library", library, "--fmi", fmi),
        *(() if operator else ("--operator", "C4")),
    )
    stranger = Unit(path)
    with pytest.raises(Exception, match="SetFMU[sS]tate"):
        stranger.unit.setFMUState(stranger.unit.deserializeFMUState(data))
    for one in (unit, other, stranger):
        one.end()


def test_what_cannot_run_says_why(
    cli: Any, library: Path, empty_folder: Path, tmp_path: Path
) -> None:
    unit = tmp_path / "tracker.fmu"
    cli.run("fmu", "--out", unit, "--library", library)
    with pytest.raises(Exception, match="fmi2ExitInitializationMode"):
        Unit(unit, method="kalman")
    tracker = Unit(unit, sample_time=0.001)
    with pytest.raises(Exception, match="fmi2DoStep"):
        tracker.step(0.0)
    tracker.end()
