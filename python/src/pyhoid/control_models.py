"""Conversion of models of python-control to operators."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from .conversion import Conversion, convert
from .errors import NotConvertibleError

if TYPE_CHECKING:
    import control

__all__ = ["from_control"]


def from_control(system: control.TransferFunction | Any) -> Conversion:
    """Convert a discrete transfer function of python-control to an operator.

    The transfer function has the form ``(b0 + b1 q^-1) q^-nk / (1 + f1 q^-1 + f2 q^-2)``.

    Parameters
    ----------
    system : control.TransferFunction
        A transfer function with one input, one output and a sample time, as from `Fit.to_control`.

    Raises
    ------
    NotConvertibleError
        For a transfer function of another form.

    Examples
    --------
    >>> found = pyhoid.from_control(control.tf([0.044, -0.043], [1, -1.91, 0.92], 0.01))
    """
    if not system.isdtime(strict=True) or not isinstance(system.dt, float) or system.dt <= 0:
        raise NotConvertibleError(
            "the system has no sample time; discretise it first,"
            " with pyhoid.discretise or control.sample_system"
        )
    num = np.asarray(system.num[0][0], dtype=float)
    den = np.asarray(system.den[0][0], dtype=float)
    # Powers of z in descending order; the excess powers of the denominator are the delay.
    relative = len(den) - len(num)
    den, num = den / den[0], num / den[0]
    coefficients = np.trim_zeros(num, "b")
    lead = len(coefficients) - len(np.trim_zeros(coefficients, "f"))
    b = np.trim_zeros(coefficients, "f")
    f = np.trim_zeros(den, "b")
    if len(f) > 3 or len(b) > 2 or relative + lead < 0:
        raise NotConvertibleError(
            f"the system has {len(b)} coefficients in the numerator and {len(f) - 1} poles away"
            " from the origin, expected up to two of each"
        )
    f = np.pad(f, (0, 3 - len(f)))
    b = np.pad(b, (0, 2 - len(b)))
    return convert(f=f[1:].tolist(), b=b.tolist(), nk=relative + lead, sample_time=float(system.dt))
