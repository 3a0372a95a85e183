"""Human-operator identification: how a person controls a machine, from the tracking error e and the control output u.

>>> import hoid
>>> record = hoid.simulate(condition="C1", seed=1)     # or hoid.read("run1.csv"), or hoid.Record(e=, u=, sample_time=)
>>> fit = hoid.identify(record)                        # Box-Jenkins; delay and order of the noise searched
>>> trace = hoid.track(record)                         # the operator from sample to sample

Everything that the command line does is here under the same names and with the same defaults, and gives the same digits.
"""

from __future__ import annotations

from . import errors
from ._hoid import __version__
from .control_models import from_control
from .conversion import Conversion, DiscreteTransferFunction, convert, discretise
from .description import DescribingFunction, describing_function
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
from .fit import Fit, FrequencyResponse, Series, Validation
from .groups import group, group_manifest, simulate_group
from .identification import identify
from .record import Record
from .reading import info, read, read_segments, write
from .reproduction import Reproduction, reproduce
from .simulation import margins, simulate
from .studies import Plan, Results, Table, merge, plan, plans, results, study
from .time_varying import TimeVaryingFit
from .trace import Trace
from .tracker import Tracker
from .tracking import track

__all__ = [
    "Conversion",
    "DataError",
    "DescribingFunction",
    "DiscreteTransferFunction",
    "Error",
    "Estimate",
    "EstimationError",
    "FileError",
    "FileMissingError",
    "Fit",
    "FormatError",
    "FrequencyResponse",
    "NotConvertibleError",
    "Operator",
    "OptionError",
    "Plan",
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
    "__version__",
    "convert",
    "describing_function",
    "discretise",
    "errors",
    "from_control",
    "group",
    "group_manifest",
    "identify",
    "info",
    "margins",
    "merge",
    "plan",
    "plans",
    "read",
    "read_segments",
    "reproduce",
    "results",
    "simulate",
    "simulate_group",
    "study",
    "track",
    "write",
]
