"""The native module. Users find its parts, wrapped, in `pyhoid`.

A test compares these stubs with the module.
"""

from collections.abc import Callable, Sequence
from os import PathLike
from typing import Any, final

import numpy as np
import numpy.typing as npt
from typing_extensions import disjoint_base

from .record import Record

_Array = npt.NDArray[np.float64]
_Path = str | PathLike[str]
_Pair = tuple[float, float | None]
_Ends = tuple[int, int]
_Parameter = tuple[
    str,
    str,
    float,
    list[float | None],
    tuple[float, float] | None,
    float,
    bool,
    list[str],
]
_Progress = Callable[[int, int], object] | None
_Left = tuple[bool, int, list[Any]]

__all__ = [
    "DescribingFunction",
    "Description",
    "Fit",
    "OperatorFit",
    "Plan",
    "TimeVaryingFit",
    "Trace",
    "Tracker",
    "__version__",
    "batch_estimators",
    "check_record",
    "compare",
    "comparison_figure_of",
    "convert_discrete",
    "convert_operator",
    "decimated",
    "describe",
    "describing_function",
    "design",
    "design_figures_of",
    "design_files_of",
    "detrended",
    "discretise_transfer_function",
    "even_times",
    "group",
    "group_manifest",
    "from_json",
    "from_state",
    "identify",
    "identify_axes",
    "in_python",
    "info",
    "margins",
    "merge_shards",
    "plan_names",
    "read",
    "read_table",
    "recursive_methods",
    "renamed_method",
    "reproduce",
    "signal_of",
    "simulate",
    "simulate_group",
    "simulate_people",
    "track",
    "write",
]

__version__: str

@final
class DescribingFunction:
    def columns(self) -> dict[str, npt.NDArray[Any]]: ...
    @property
    def per_run(self) -> list[npt.NDArray[np.complex128]]: ...
    @property
    def remnant_spectrum(self) -> list[_Array]: ...
    @property
    def figures(self) -> dict[str, Any]: ...
    def gain_lead_delay(
        self, *, lead: bool, weights: str, delay: tuple[float, float]
    ) -> dict[str, Any]: ...
    def margins(self, element: str | tuple[list[float], list[float]]) -> dict[str, Any]: ...

@final
class Description:
    @property
    def settings(self) -> list[tuple[str, str, bool]]: ...
    def to_json(self) -> str: ...
    def records(self) -> list[tuple[int, dict[str, Any], list[str]]]: ...
    @property
    def faults(self) -> list[tuple[int, dict[str, Any]]]: ...
    def function(self) -> DescribingFunction: ...
    @property
    def phase_deg(self) -> _Array: ...
    @property
    def open_loop(self) -> dict[str, Any] | None: ...
    @property
    def remnant(self) -> tuple[tuple[float, float | None], tuple[float, float | None]]: ...
    @property
    def verdict(self) -> str: ...
    @property
    def excitation(self) -> tuple[str | None, float]: ...

@final
class Fit:
    @property
    def settings(self) -> list[tuple[str, str, bool]]: ...
    def to_json(self) -> str: ...
    def state(self) -> str | None: ...
    @property
    def structure(self) -> str: ...
    @property
    def title(self) -> str: ...
    @property
    def orders(self) -> dict[str, int]: ...
    @property
    def sample_time(self) -> float: ...
    @property
    def parameters(self) -> list[tuple[str, _Pair]]: ...
    @property
    def covariance(self) -> _Array | None: ...
    @property
    def polynomials(self) -> dict[str, _Array]: ...
    @property
    def figures(self) -> dict[str, Any]: ...
    @property
    def termination(self) -> dict[str, Any]: ...
    @property
    def stable(self) -> bool: ...
    @property
    def operator(self) -> dict[str, Any] | None: ...
    @property
    def operators(self) -> list[dict[str, Any] | None]: ...
    @property
    def roots(self) -> list[dict[str, Any]]: ...
    @property
    def candidates(self) -> list[dict[str, Any]]: ...
    @property
    def criterion(self) -> str | None: ...
    @property
    def delay_interval(self) -> _Ends | None: ...
    @property
    def levels(self) -> list[_Pair | None]: ...
    def records(self) -> list[tuple[int, dict[str, Any], list[str]]]: ...
    @property
    def faults(self) -> list[tuple[int, dict[str, Any]]]: ...
    def remnant(self, discretisation: str) -> dict[str, Any] | None: ...
    def quality(self, records: Sequence[Record]) -> dict[str, float]: ...
    def verdict(self, records: Sequence[Record]) -> str: ...
    def predict(self, record: Record, horizon: int) -> tuple[int, _Array]: ...
    def simulate(self, record: Record) -> tuple[int, _Array]: ...
    def residuals(self, record: Record) -> tuple[int, _Array]: ...
    def validate(self, record: Record) -> dict[str, Any]: ...
    def frequency_response(self, omega: _Array) -> list[_Array]: ...
    def margins(self, element: str | tuple[list[float], list[float]]) -> dict[str, Any]: ...
    def report(
        self,
        records: Sequence[Record],
        directory: _Path,
        *,
        title: str,
        settings: list[tuple[str, str]],
        controlled_element: str | tuple[list[float], list[float]] | None,
    ) -> Any: ...

@final
class OperatorFit:
    @property
    def settings(self) -> list[tuple[str, str, bool]]: ...
    def to_json(self) -> str: ...
    @property
    def form(self) -> tuple[str, bool]: ...
    @property
    def title(self) -> str: ...
    @property
    def parameters(self) -> list[list[_Parameter]]: ...
    @property
    def coordinates(self) -> list[str]: ...
    def coordinate_values(self, record: int) -> _Array: ...
    def covariance(self, record: int) -> _Array | None: ...
    def frequency_response(self, omega: _Array, record: int) -> list[_Array]: ...
    def margins(self, element: str | tuple[list[float], list[float]]) -> dict[str, Any]: ...
    def model_based_covariance(self, record: int) -> _Array | None: ...
    @property
    def verdict(self) -> str: ...
    @property
    def forms(self) -> list[dict[str, Any]]: ...
    @property
    def lines(self) -> dict[str, Any] | None: ...
    @property
    def no_lines(self) -> str | None: ...
    @property
    def riv_bj(self) -> dict[str, Any] | None: ...
    @property
    def agreement(self) -> dict[str, Any] | None: ...
    @property
    def open_loop(self) -> dict[str, _Pair] | None: ...
    @property
    def loop_shape(self) -> dict[str, Any] | None: ...
    @property
    def open_loop_intervals(self) -> dict[str, tuple[float, float] | None] | None: ...
    @property
    def open_loop_person(self) -> dict[str, _Pair] | None: ...
    @property
    def box_jenkins(self) -> dict[str, Any] | None: ...
    @property
    def noise(self) -> tuple[_Array, _Array]: ...
    @property
    def prior(self) -> list[tuple[str, float, float, str]]: ...
    @property
    def figures(self) -> dict[str, Any]: ...
    @property
    def termination(self) -> dict[str, Any]: ...
    @property
    def excitation(self) -> str | None: ...
    def records(self) -> list[tuple[int, dict[str, Any], list[str]]]: ...
    @property
    def faults(self) -> list[tuple[int, dict[str, Any]]]: ...
    def report(
        self, records: Sequence[Record], directory: _Path, *, title: str | None
    ) -> Any: ...
    def fit(self, record: int) -> Fit: ...

@final
class Plan:
    def __new__(
        cls,
        *,
        path: _Path | None = None,
        text: str | None = None,
        name: str | None = None,
        replications: int | None = None,
    ) -> Plan: ...
    @property
    def name(self) -> str: ...
    @property
    def title(self) -> str: ...
    @property
    def description(self) -> str: ...
    @property
    def seed(self) -> int: ...
    @property
    def replications(self) -> int: ...
    @property
    def estimates(self) -> int: ...
    @property
    def text(self) -> str: ...
    @property
    def sha256(self) -> str: ...
    @property
    def estimators(self) -> list[str]: ...
    @property
    def cells(self) -> list[dict[str, Any]]: ...
    def run(
        self,
        directory: _Path,
        *,
        shard: str | None,
        jobs: int | None,
        resume: bool,
        csv: bool,
        progress: _Progress,
    ) -> _Left: ...

@final
class TimeVaryingFit:
    @property
    def settings(self) -> list[tuple[str, str, bool]]: ...
    def to_json(self) -> str: ...
    @property
    def form(self) -> str: ...
    @property
    def parameters(self) -> list[tuple[str, _Pair, str, str | None]]: ...
    @property
    def covariance(self) -> _Array | None: ...
    @property
    def figures(self) -> dict[str, Any]: ...
    @property
    def termination(self) -> dict[str, Any]: ...
    @property
    def change(self) -> dict[str, Any]: ...
    @property
    def initial(self) -> dict[str, Any] | None: ...
    @property
    def last(self) -> dict[str, Any] | None: ...
    @property
    def levels(self) -> list[_Pair | None]: ...
    def records(self) -> list[tuple[int, dict[str, Any], list[str]]]: ...
    @property
    def faults(self) -> list[tuple[int, dict[str, Any]]]: ...
    def gains(self, times: list[float]) -> dict[str, _Array]: ...
    def residuals(self, record: Record) -> tuple[int, _Array]: ...
    def simulate(self, record: Record) -> tuple[int, _Array]: ...
    @property
    def verdict(self) -> str: ...
    def ljung_box(self, record: Record) -> dict[str, float] | None: ...

@final
class Trace:
    def __len__(self) -> int: ...
    @property
    def method(self) -> str: ...
    @property
    def structure(self) -> str: ...
    @property
    def orders(self) -> dict[str, int]: ...
    @property
    def parameter_names(self) -> list[str]: ...
    @property
    def operator_names(self) -> list[str]: ...
    @property
    def updated_from(self) -> float: ...
    @property
    def counts(self) -> dict[str, int]: ...
    @property
    def faults(self) -> list[dict[str, Any]]: ...
    @property
    def changes(self) -> list[dict[str, Any]]: ...
    @property
    def failures(self) -> tuple[int, str] | None: ...
    @property
    def no_crossover(self) -> tuple[int, str | None] | None:
        """How many rows have no crossover, and why most of them."""

    @property
    def covariance_choice(self) -> dict[str, Any] | None: ...
    @property
    def start(self) -> Fit | None: ...
    @property
    def innovation_variance(self) -> _Array: ...
    @property
    def verdict(self) -> str: ...
    def columns(self) -> dict[str, npt.NDArray[Any]]: ...
    def operator(self, row: int) -> dict[str, Any] | None: ...
    def to_json(self) -> str: ...
    def records(self) -> list[tuple[int, dict[str, Any], list[str]]]: ...
    def report(self, directory: _Path, *, title: str | None) -> Any: ...
    def write(self, path: _Path, comments: list[str]) -> None: ...

@disjoint_base
class Tracker:
    # `pyhoid.Tracker` has the keywords that people write.
    def __new__(
        cls, options: dict[str, Any], sample_time: float, warm_up: float, record: Record | None
    ) -> Any: ...
    def step(self, e: float, u: float, f_t: float | None = None, update: bool = True) -> float:
        """Take one sample. Returns the innovation: NaN at a fault and during the warm-up."""

    def take_all(self, e: _Array, u: _Array, f_t: _Array | None, update: bool) -> _Array: ...
    @property
    def ready(self) -> bool:
        """True once there is an estimate."""

    @property
    def trouble(self) -> str | None:
        """Why the last start fit failed, or why the warm-up started again."""

    @property
    def sample_time(self) -> float: ...
    @property
    def decimation(self) -> str | None:
        """How a high rate is lowered; None if it is not."""

    @property
    def method(self) -> str: ...
    @property
    def structure(self) -> str: ...
    @property
    def orders(self) -> dict[str, int]: ...
    @property
    def parameter_names(self) -> list[str]: ...
    @property
    def theta(self) -> _Array: ...
    @property
    def covariance(self) -> _Array | None: ...
    @property
    def parameters(self) -> list[tuple[str, _Pair]]: ...
    @property
    def operator(self) -> dict[str, Any] | None: ...
    @property
    def at(self) -> list[float]:
        """Frequencies in rad/s at which gain and phase are reported."""

    @property
    def controlled_element(self) -> str | None:
        """What the person controls."""

    def response(self, omega: float) -> tuple[_Pair, _Pair] | None:
        """Gain in dB and phase in deg at a frequency in rad/s, each with its standard error."""

    @property
    def open_loop(self) -> tuple[tuple[_Pair, _Pair] | None, str | None] | None:
        """Crossover in rad/s and phase margin in deg, or why there are none."""

    @property
    def determined(self) -> dict[str, bool]:
        """Whether the data determine each parameter of the operator."""

    @property
    def innovation_variance(self) -> float: ...
    @property
    def counts(self) -> dict[str, int]: ...
    @property
    def event(self) -> dict[str, Any] | None:
        """What the guard found or did at the last sample, its times in s before that sample."""

    @property
    def paused(self) -> bool:
        """True while the guard lets the estimate stay constant."""

    @property
    def start(self) -> Fit | None: ...
    def saved(self) -> tuple[dict[str, int] | None, _Array]: ...
    def restore(self, orders: dict[str, int] | None, numbers: _Array) -> None: ...

def check_record(record: Record) -> None: ...
def convert_discrete(
    f: tuple[float, float], b: tuple[float, float], nk: int, sample_time: float
) -> dict[str, Any]: ...
def convert_operator(operator: list[tuple[str, float]], sample_time: float) -> dict[str, Any]: ...
def describe(
    records: Sequence[Record],
    *,
    excitation: str | None,
    lines: list[float] | None,
    period: float | None,
    controlled_element: str | tuple[list[float], list[float]] | None,
    start: float | None,
    stop: float | None,
    offset_samples: float,
    detrend: str,
    faults: str,
    decimate: str,
) -> Description: ...
def describing_function(
    records: Sequence[Record],
    *,
    harmonics: list[int] | None,
    omega: list[float] | None,
    period: float | None,
    channel: str | None,
    least_amplitude: float,
    averaging: str,
    reference: str | None,
    realisation: str,
    start: float | None,
    stop: float | None,
    offset_samples: float,
    detrend: str,
    smoothing_bins: int,
) -> DescribingFunction: ...
def in_python(message: str) -> str: ...
def signal_of(text: str, names: list[str]) -> list[tuple[float, int]]: ...
def decimated(record: Record, decimate: str) -> tuple[dict[str, Any], str] | None: ...
def detrended(record: Record, how: str) -> dict[str, Any]: ...
def discretise_transfer_function(
    num: list[float], den: list[float], sample_time: float, method: str, prewarp: float | None
) -> list[_Array]: ...
def group(
    manifest: _Path,
    directory: _Path,
    *,
    jobs: int | None,
    resume: bool,
    csv: bool,
    progress: _Progress,
) -> tuple[bool, int]: ...
def compare(
    results: _Path,
    *,
    factors: list[str],
    variation: str | None,
    of: list[str],
    covariate: str | None,
    adjust: str,
    weights: str,
    directory: _Path,
    jobs: int | None,
    progress: _Progress,
) -> str: ...
def comparison_figure_of(text: str) -> str: ...
def design(
    people: str,
    *,
    condition: str | None,
    controlled_element: str | tuple[list[float], list[float]] | None,
    form: str | None,
    wanted: list[str],
    disturbance: bool,
    remnant: tuple[float, float],
    length: float,
    runs: int | None,
    lines: int,
    spacing: int,
    band: tuple[float, float],
    shelf: float,
    limits: tuple[float | None, float | None],
    against: str | None,
    difference: str | None,
    run_to_run: str | None,
    statistics: tuple[float, float, str | None],
    display: str,
    seed: int,
) -> str: ...
def design_figures_of(text: str) -> tuple[str, str]: ...
def design_files_of(text: str, scenario: str) -> tuple[str, str, str]: ...
def from_json(text: str) -> OperatorFit | Fit | TimeVaryingFit: ...
def from_state(text: str) -> Fit: ...
def group_manifest(directory: _Path, pattern: str) -> tuple[str, list[str]]: ...
def identify(
    records: Sequence[Record],
    *,
    structure: str | None,
    method: str,
    options: dict[str, str],
    faults: str,
    decimate: str,
    progress: _Progress,
) -> tuple[OperatorFit | Fit | TimeVaryingFit, list[str]]: ...
def identify_axes(
    axes: Sequence[Sequence[Record]],
    pairs: Sequence[str],
    *,
    options: dict[str, str],
    faults: str,
    decimate: str,
) -> list[tuple[OperatorFit, list[tuple[str, float | None, bool, str]]]]: ...
def even_times(times: npt.NDArray[np.float64]) -> tuple[float | None, int]: ...
def info(
    path: _Path,
    *,
    input: str | None,
    output: str | None,
    excitation: str | None,
    controlled_element: str | None,
    time: str | None,
    trial: str | None,
    sampling_frequency: float | None,
) -> dict[str, Any]: ...
def margins(
    *,
    condition: str | None,
    scenario_file: _Path | None,
    scenario_text: str | None,
    state: str,
    noise_levels: list[float],
    noise_definition: str,
) -> dict[str, Any]: ...
def merge_shards(shards: Sequence[_Path], directory: _Path, csv: bool) -> _Left: ...
def plan_names() -> list[tuple[str, str]]: ...
def read(
    path: _Path,
    *,
    input: str | None,
    output: str,
    time: str | None,
    trial: str | None,
    all_trials: bool,
    sampling_frequency: float | None,
    start: float | None,
    stop: float | None,
    resample: bool,
    fill: bool,
    sparse: dict[str, str],
    columns: list[str] | None,
    detrend: str,
    drop_repeated: bool,
    unit: dict[str, str],
    scale: dict[str, str],
    offset: dict[str, str],
    decimate: int | None,
    new_sampling_frequency: float | None,
    run_in: float,
    mask: list[str],
    shortest: float,
) -> list[tuple[dict[str, Any], list[str], list[str]]]: ...
def read_table(path: _Path) -> dict[str, Any]: ...
def reproduce(
    directory: _Path,
    *,
    only: list[str],
    replications: int,
    jobs: int | None,
    recordings: _Path | None,
    progress: _Progress,
) -> tuple[Any, int, list[int] | None] | None: ...
def simulate(
    *,
    condition: str | None,
    scenario_file: _Path | None,
    scenario_text: str | None,
    remnant_order: int | None,
    noise_level: float | None,
    noise_definition: str | None,
    remnant_time_constant: float | None,
    sample_time: float | None,
    realisation: str | None,
    feedforward: str | None,
    disturbance: float | None,
    seed: int,
    cell: int,
    replication: int,
    keep_run_in: bool,
) -> dict[str, Any]: ...
def simulate_group(
    directory: _Path,
    *,
    subjects: int,
    conditions: list[str],
    runs: int,
    between_subjects: float,
    between_runs: float,
    remnant_order: int,
    noise_level: float,
    seed: int,
    trouble: list[str],
) -> int: ...
def simulate_people(
    directory: _Path,
    *,
    subjects: int,
    plants: list[str],
    form: str | None,
    remnants: list[str],
    remnant_share: tuple[float, float],
    sample_time: float,
    runs: int,
    between_runs: float,
    seed: int,
    trouble: list[str],
) -> int: ...
def batch_estimators() -> list[tuple[str, list[str], dict[str, str]]]: ...
def recursive_methods() -> list[tuple[str, str, str, list[str]]]: ...
def renamed_method(name: str) -> tuple[str, str] | None: ...
def track(
    record: Record,
    options: dict[str, Any],
    *,
    start_span: tuple[float, float] | None,
    update_from: float | None,
    moving_average: float | None,
    every: int,
    decimate: str,
    validate: Record | None,
    update_covariance: bool,
    progress: _Progress,
) -> Trace: ...
def write(path: _Path, record: Record) -> None: ...
