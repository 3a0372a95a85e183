"""Choices that people type, as types: mypy and pyright find a wrong one before it runs.

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

#: What `identify` fits, except for time-varying.
ModelStructure = Structure | Literal["operator", "family", "grey-box", "grey_box"]

#: How it is fitted.
BatchMethod = Literal["pem", "iv4", "sriv", "rivbj"]

#: What chooses between candidates.
Criterion = Literal["loss", "aic", "aicc", "bic", "fpe", "mdl", "yic"]

#: Treatment of faults of records.
Faults = Literal["bridge", "cut", "report", "keep"]

#: Trend taken out of input and output.
Detrending = Literal["none", "mean", "linear"]

#: Treatment of a column that lacks a value in some rows.
Sparse = Literal["hold", "linear", "drop"]
