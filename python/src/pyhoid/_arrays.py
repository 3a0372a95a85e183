"""What people hand over as a signal, and what becomes of it: a contiguous array of float64, without a copy where it is one already."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from .errors import DataError

FloatArray = npt.NDArray[np.float64]

__all__ = ["FloatArray", "signal"]


def signal(values: Any, name: str) -> FloatArray:
    """Bring `values` into a one-dimensional, contiguous array of float64 in native byte order.

    An array that is one already is used as it is, without a copy; so are the values of a pandas Series, whose index is not looked at
    (hoid counts samples: give the sampling by `sample_time`). Lists, integers, other byte orders, and strided arrays are converted.

    Raises
    ------
    DataError
        For masked values, complex numbers, text, and what is not one-dimensional.
    """
    if isinstance(values, np.ma.MaskedArray):
        masked = np.ma.getmaskarray(values)
        if masked.any():
            first = int(np.flatnonzero(masked.ravel())[0])
            raise DataError(
                f"{name} has {int(masked.sum())} masked values, the first at sample {first}; fill or cut them out before identification"
            )
        values = values.data
    try:
        array = np.asarray(values)
    except Exception as error:
        raise DataError(f"{name} cannot be made an array of numbers: {error}") from error
    if array.dtype.kind not in "fiub":
        if array.dtype.kind == "O":
            try:
                array = array.astype(np.float64)
            except (TypeError, ValueError) as error:
                raise DataError(f"{name} holds something that is no number: {error}") from error
        else:
            raise DataError(f"{name} has the type {array.dtype}, expected real numbers")
    if array.ndim != 1:
        squeezed = array.reshape(-1) if array.size == max(array.shape, default=0) and array.ndim == 2 else None
        remedy = "; take one row or column of it" if squeezed is None else "; write .ravel() for a single row or column"
        raise DataError(f"{name} has the shape {array.shape}, expected one dimension{remedy}")
    return np.ascontiguousarray(array, dtype=np.float64)
