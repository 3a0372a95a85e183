"""Parameters of an operator, and how well the data determine them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

from . import _text
from .estimates import Estimate, Named

__all__ = ["OperatorParameter", "OperatorParameters"]


class OperatorParameter(NamedTuple):
    """A parameter of an operator, and how well the data determine it.

    Attributes
    ----------
    value : float
        Value of the parameter; infinite for the lag of a pure integration.
    standard_error : float or None
        Standard error to first order, for the operator of these runs; None if there is none, for example
        at a bound.
    standard_error_person : float or None
        Standard error for the person, whose gain varies from run to run.
    interval : (float, float) or None
        95 % interval; an open end is infinite.
    prior_share : float
        Ratio of the variance after the data to that of the prior; 0 without a prior, 1 if the data add
        no information.
    determined : bool
        Whether the data determine the parameter.
    unit : str
    averaged_over : tuple of str
        The forms over which the estimate is averaged; empty for a single form.

    Examples
    --------
    >>> fit.parameters["T_L"].interval
    """

    value: float
    standard_error: float | None
    interval: tuple[float, float] | None
    prior_share: float
    determined: bool
    unit: str
    standard_error_person: float | None = None
    averaged_over: tuple[str, ...] = ()

    def __repr__(self) -> str:
        return " ".join(part for part in (self._shown(), self.unit, self._remark()) if part)

    def __float__(self) -> float:
        return float(self.value)

    def _remark(self) -> str:
        if self.determined:
            return ""
        return "(the prior alone)" if self.prior_share > 0.5 else "(not determined)"

    def _shown(self) -> str:
        """Format value and error; empty if neither the data nor a prior carries information."""
        if not self.determined and self.prior_share <= 0.5:
            return ""
        if self.standard_error is not None and self.standard_error > abs(self.value):
            return "not known"
        return repr(Estimate(self.value, self.standard_error))


class OperatorParameters(Named[OperatorParameter]):
    """Parameters of an operator by name, which are also attributes (``parameters.K.value``)."""

    _owner = "the operator"

    def __init__(self, found: Mapping[str, OperatorParameter]) -> None:
        self._all = dict(found)

    def _rows(self) -> list[list[str]]:
        rows = []
        for name, p in self._all.items():
            low, high = ("", "") if p.interval is None else map(_end, p.interval)
            share = f"{100 * p.prior_share:.0f} %" if p.prior_share > 0 else ""
            named = f"{name} ({p.unit})" if p.unit else name
            rows.append([named, p._shown(), low, high, share, p._remark().strip("()")])
        return rows

    def __repr__(self) -> str:
        return _text.plain_table(_HEADER, self._rows())

    def _repr_html_(self) -> str:
        return _text.html_table("Operator", _HEADER, self._rows())


_HEADER = ["parameter", "value", "95 % from", "to", "from prior", ""]


def _end(value: float) -> str:
    return "open" if value in (float("inf"), float("-inf")) else _text.number(value, 3)
