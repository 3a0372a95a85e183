"""Conversion of signals to contiguous arrays of float64.

An array that already has this form is not copied.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from .errors import DataError

FloatArray = npt.NDArray[np.float64]

__all__ = ["FloatArray", "signal"]


def signal(values: Any, name: str) -> FloatArray:
    """Convert `values` to a one-dimensional, contiguous array of float64 in native byte order.

    An array that already has this form is used without a copy, as are the values of a pandas Series. The
    index of a Series is ignored, because hoid counts samples: give `sample_time`. Lists, integers, other
    byte orders and strided arrays are converted.

    Raises
    ------
    DataError
        For masked values, complex numbers, text, and arrays that are not one-dimensional.
    """
    if isinstance(values, np.ma.MaskedArray):
        masked = np.ma.getmaskarray(values)
        if masked.any():
            first = int(np.flatnonzero(masked.ravel())[0])
            raise DataError(
                f"{name} has {int(masked.sum())} masked values, the first at sample {first};"
                " fill them or cut them out before identification"
            )
        values = values.data
    try:
        array = np.asarray(values)
    except Exception as error:
        raise DataError(f"{name} cannot be converted to an array of numbers: {error}") from error
    if array.dtype.kind not in "fiub":
        if array.dtype.kind == "O":
            try:
                array = array.astype(np.float64)
            except (TypeError, ValueError) as error:
                raise DataError(f"{name} contains a value that is not a number: {error}") from error
        else:
            raise DataError(f"{name} has the type {array.dtype}, expected real numbers")
    if array.ndim != 1:
        squeezed = (
            array.reshape(-1)
            if array.size == max(array.shape, default=0) and array.ndim == 2
            else None
        )
        remedy = (
            "; take one row or column of it"
            if squeezed is None
            else "; write .ravel() for a single row or column"
        )
        raise DataError(f"{name} has the shape {array.shape}, expected one dimension{remedy}")
    return np.ascontiguousarray(array, dtype=np.float64)
