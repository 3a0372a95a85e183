"""Human-operator identification: estimates how a person controls a machine from the tracking error
e and the control output u.

>>> import pyhoid
>>> record = pyhoid.simulate("C1", seed=1)  # or pyhoid.read("run1.csv"), or pyhoid.Record(...)
>>> fit = pyhoid.identify(record)           # the operator of a person, and its reliability
>>> trace = pyhoid.track(record)            # the operator from sample to sample
>>> pyhoid.plots.bode(fit)                  # matplotlib is imported here, not before

Everything that the command line offers is available here under the same names, with the same defaults
and the same numerical results.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

from . import errors
from ._pyhoid import __version__
from .comparison import Comparison, compare
from .control_models import from_control
from .conversion import Conversion, DiscreteTransferFunction, convert, discretise
from .description import DescribingFunction, Description, describe, describing_function
from .errors import (
    DataError,
    Error,
    EstimationError,
    FileError,
    FileMissingError,
    FormatError,
    NotConvertibleError,
    OptionError,
    StudyStateError,
)
from .estimates import Estimate, Operator, Remnant
from .experiment import ExperimentDesign, design
from .fit import Fit, FrequencyResponse, Series, Validation
from .groups import group, group_manifest, simulate_group, simulate_people
from .axes import Axis, Coupling, identify_axes
from .identification import from_json, identify, identify_operator
from .operator_fit import OperatorFit
from .operator_parameters import OperatorParameter
from .reading import info, read, read_segments, read_trials, write
from .record import Record
from .reproduction import Reproduction, reproduce
from .simulation import margins, simulate
from .studies import Plan, Results, Table, merge, plan, plans, results, study
from .time_varying import TimeVaryingFit
from .trace import Trace
from .tracker import Tracker
from .tracking import track
from .verdict import Reason, Verdict

if TYPE_CHECKING:
    from . import dask as dask
    from . import lsl as lsl
    from . import plots as plots

__all__ = [
    "Comparison",
    "Conversion",
    "DataError",
    "DescribingFunction",
    "Description",
    "DiscreteTransferFunction",
    "Error",
    "Estimate",
    "EstimationError",
    "ExperimentDesign",
    "FileError",
    "FileMissingError",
    "Fit",
    "FormatError",
    "FrequencyResponse",
    "NotConvertibleError",
    "Operator",
    "OperatorFit",
    "OperatorParameter",
    "OptionError",
    "Plan",
    "Reason",
    "Record",
    "Remnant",
    "Reproduction",
    "Results",
    "Series",
    "StudyStateError",
    "Table",
    "TimeVaryingFit",
    "Trace",
    "Tracker",
    "Validation",
    "Verdict",
    "__version__",
    "compare",
    "convert",
    "describe",
    "describing_function",
    "design",
    "discretise",
    "errors",
    "from_control",
    "from_json",
    "group",
    "group_manifest",
    "identify",
    "identify_axes",
    "identify_operator",
    "info",
    "margins",
    "merge",
    "plan",
    "plans",
    "read",
    "read_segments",
    "read_trials",
    "reproduce",
    "results",
    "simulate",
    "simulate_group",
    "simulate_people",
    "study",
    "track",
    "write",
]

#: Modules that are imported only at their first use, because they import large packages.
_LAZY = ("dask", "lsl", "plots")


def __getattr__(name: str) -> Any:
    if name in _LAZY:
        return importlib.import_module(f"{__name__}.{name}")
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted({*globals(), *_LAZY})
