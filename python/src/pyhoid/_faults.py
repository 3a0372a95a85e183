"""Faults found in the records of a fit, and the records as they were fitted."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from . import _pyhoid
from .record import Record

__all__ = ["faults_of", "fitted_records"]


def fitted_records(
    native: _pyhoid.Fit | _pyhoid.OperatorFit | _pyhoid.TimeVaryingFit | _pyhoid.Trace,
    given: Sequence[Record],
) -> tuple[Record, ...]:
    """Return the records as they were fitted, from the given records and the steps applied to them."""
    several = []
    for origin, parts, steps in native.records():
        of = given[origin]
        record = Record._of({**parts, "input_lead": of.input_lead + parts["input_lead"]})
        record.steps = [*of.steps, *steps]
        # For an unchanged record, the given object itself is returned.
        several.append(of if not steps and _same(of, record) else record)
    return tuple(several)


def _same(one: Record, other: Record) -> bool:
    return one.names == other.names and all(
        np.array_equal(one[name], other[name], equal_nan=True) for name in one.names
    )


def faults_of(
    native: _pyhoid.Fit | _pyhoid.OperatorFit | _pyhoid.TimeVaryingFit | _pyhoid.Description,
) -> list[dict[str, Any]]:
    """Return the faults that were found in the records, each with the index of its record."""
    return [{"record": index, **fault} for index, fault in native.faults]
