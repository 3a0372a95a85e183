"""Conversion of discrete coefficients to operator parameters and back, and to discrete time."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

from . import _options, _pyhoid
from ._arrays import FloatArray
from .errors import OptionError
from .estimates import Operator

__all__ = ["Conversion", "DiscreteTransferFunction", "convert", "discretise"]


class Conversion(NamedTuple):
    """An operator in discrete and continuous form.

    The discrete form is ``B q^-nk / F`` with ``B = b0 + b1 q^-1``, ``F = 1 + f1 q^-1 + f2 q^-2``.

    Examples
    --------
    >>> pyhoid.convert(f=(-1.91, 0.92), b=(0.044, -0.043), nk=29).operator
    """

    f: tuple[float, float]
    b: tuple[float, float]
    nk: int
    sample_time: float
    operator: Operator


class DiscreteTransferFunction(NamedTuple):
    """Numerator and denominator in ascending powers of q^-1.

    Examples
    --------
    >>> pyhoid.discretise([90.0], [1.0, 6.0, 0.0], 0.01).den
    """

    num: FloatArray
    den: FloatArray
    sample_time: float


def _two(values: Sequence[float], name: str) -> tuple[float, float]:
    numbers = [float(value) for value in values]
    if len(numbers) != 2:
        raise OptionError(
            f"the operator model has two coefficients in {name}, found {len(numbers)}"
        )
    return numbers[0], numbers[1]


def convert(
    *,
    f: Sequence[float] | None = None,
    b: Sequence[float] | None = None,
    nk: int = 1,
    operator: Mapping[str, Any] | None = None,
    sample_time: float = 0.01,
) -> Conversion:
    """Convert discrete coefficients to operator parameters, or vice versa.

    Parameters
    ----------
    f, b : sequence of two floats
        ``f1, f2`` and ``b0, b1`` of the discrete operator.
    nk : int
        Delay of b0 in samples.
    operator : mapping
        ``K_e``, ``T_L`` (or ``K_e_dot``), ``omega_nm``, ``zeta_nm`` and ``tau_e`` (0 if omitted), as
        numbers or estimates; also an `Operator`.
    sample_time : float
        Ts in s.

    Returns
    -------
    Conversion

    Raises
    ------
    OptionError
        If both or neither are given, or if a parameter is missing.

    Examples
    --------
    >>> pyhoid.convert(f=(-1.91, 0.92), b=(0.044, -0.043), nk=29, sample_time=0.01).operator
    """
    if operator is not None:
        if f is not None or b is not None:
            raise OptionError("give f and b, or operator, not both")
        pairs = [
            (str(name), float(getattr(value, "value", value))) for name, value in operator.items()
        ]
        if isinstance(operator, Operator):
            pairs = [(name, value) for name, value in pairs if name != "K_e_dot"]
        found = _pyhoid.convert_operator(pairs, sample_time)
    elif f is not None and b is not None:
        found = _pyhoid.convert_discrete(_two(f, "F"), _two(b, "B"), _options.whole("nk", nk), sample_time)
    else:
        raise OptionError("give either f and b, or operator")
    discrete = found["discrete"]
    return Conversion(
        f=_two(discrete["f"], "F"),
        b=_two(discrete["b"], "B"),
        nk=discrete["nk"],
        sample_time=found["sample_time"],
        operator=Operator(found["operator"]),
    )


def discretise(
    num: Sequence[float],
    den: Sequence[float],
    *,
    sample_time: float = 0.01,
    method: str = "zoh",
    prewarp: float | None = None,
) -> DiscreteTransferFunction:
    """Discretise a continuous transfer function.

    Parameters
    ----------
    num, den : sequence of float
        Coefficients in descending powers of s.
    sample_time : float
        Ts in s.
    method : {"zoh", "foh", "tustin", "prewarped", "forward-euler", "backward-euler", "matched"}
    prewarp : float, optional
        Frequency in rad/s for ``"prewarped"``.

    Returns
    -------
    DiscreteTransferFunction
        Numerator and denominator in ascending powers of q^-1.

    Examples
    --------
    >>> num, den = pyhoid.discretise([90.0], [1.0, 6.0, 0.0], 0.01)
    """
    if method == "prewarped" and prewarp is None:
        raise OptionError('method="prewarped" needs prewarp, a frequency in rad/s')
    found = _pyhoid.discretise_transfer_function(
        [float(v) for v in num], [float(v) for v in den], sample_time, method, prewarp
    )
    return DiscreteTransferFunction(found[0], found[1], sample_time)
