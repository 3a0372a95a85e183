"""Choices as literal types, so that mypy and pyright find an invalid choice before the program runs.

The entries of single options are in `_settings`.
"""

from __future__ import annotations

from typing import Literal

from ._settings import Structure

__all__ = [
    "BatchMethod",
    "Criterion",
    "Detrending",
    "Faults",
    "ModelStructure",
    "Sparse",
]

#: Structures that `identify` fits, except for time-varying.
ModelStructure = Structure | Literal["operator", "family", "grey-box", "grey_box"]

#: Methods by which `identify` fits.
BatchMethod = Literal["pem", "iv4", "sriv", "rivbj"]

#: Criteria that select among candidates.
Criterion = Literal["loss", "aic", "aicc", "bic", "fpe", "mdl", "yic"]

#: Treatment of faults of records.
Faults = Literal["bridge", "cut", "report", "keep"]

#: Trend removed from the input and the output.
Detrending = Literal["none", "mean", "linear"]

#: Treatment of a column without values in some rows.
Sparse = Literal["hold", "linear", "drop"]
