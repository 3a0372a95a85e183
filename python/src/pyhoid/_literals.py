"""The choices that people type, as types: mypy and pyright find a wrong one before it runs.

A test compares them with the choices of the library.
"""

from __future__ import annotations

from typing import Literal

from ._settings import Structure

__all__ = [
    "BatchMethod",
    "Criterion",
    "Detrending",
    "Faults",
    "Focus",
    "Form",
    "InitialState",
    "ModelStructure",
    "SearchMethod",
]

#: What `identify` fits, but for time-varying.
ModelStructure = Structure | Literal["operator", "family", "grey-box", "grey_box"]

#: How it is fitted.
BatchMethod = Literal["pem", "iv4", "sriv", "rivbj"]

#: What chooses between candidates.
Criterion = Literal["loss", "aic", "aicc", "bic", "fpe", "mdl", "yic"]

#: What a model is fitted for.
Focus = Literal["prediction", "simulation"]

#: Where the filters start.
InitialState = Literal["auto", "zero", "estimate", "backcast"]

#: How the minimum is searched.
SearchMethod = Literal["auto", "gn", "lm", "grad"]

#: What is done about faults of records.
Faults = Literal["bridge", "cut", "report", "keep"]

#: Forms of the operator of a person.
Form = Literal[
    "auto",
    "gain",
    "lead",
    "lead2",
    "lag",
    "lead-lag",
    "lead2-lag",
    "quadratic-integral",
    "lead-droop",
]

#: What is taken out of input and output.
Detrending = Literal["none", "mean", "linear"]
