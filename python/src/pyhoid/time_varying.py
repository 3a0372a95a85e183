"""A fitted operator whose gains change once."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from . import _pyhoid, _text
from ._arrays import FloatArray, signal
from ._results import Result
from .estimates import Estimate, Operator
from ._model import Series
from .record import Record
from .verdict import Verdict

if TYPE_CHECKING:
    import pandas as pd

__all__ = ["TimeVaryingFit"]


class TimeVaryingFit(Result):
    """A fitted operator whose gains change once, along a sigmoid.

    `identify` with ``change="sigmoid"`` creates it.

    Examples
    --------
    >>> fit = pyhoid.identify(record, change="sigmoid", nd=2)
    >>> fit.change, fit.initial, fit.last
    """

    _native: _pyhoid.TimeVaryingFit

    structure = "operator"

    @property
    def form(self) -> str:
        """Form of the operator, such as ``"lead"`` or ``"lead-lag"``."""
        return self._native.form

    @property
    def estimates(self) -> dict[str, Estimate]:
        """Parameters with their standard errors."""
        return {name: Estimate(*pair) for name, pair, _, _ in self._native.parameters}

    @property
    def parameters(self) -> dict[str, float]:
        """Parameters by name."""
        return {name: pair[0] for name, pair, _, _ in self._native.parameters}

    @property
    def standard_errors(self) -> dict[str, float | None]:
        """Standard errors by name."""
        return {name: pair[1] for name, pair, _, _ in self._native.parameters}

    @property
    def remarks(self) -> dict[str, str]:
        """Remarks on single parameters, for example that one lies at a bound."""
        return {
            name: remark for name, _, _, remark in self._native.parameters if remark is not None
        }

    @property
    def covariance(self) -> FloatArray | None:
        """Covariance of the parameters, shape (p, p)."""
        return self._native.covariance

    @property
    def loss(self) -> float:
        """Mean square of the residuals."""
        return float(self._native.figures["loss"])

    @property
    def innovation_variance(self) -> float:
        """Variance of the innovations."""
        return float(self._native.figures["innovation_variance"])

    @property
    def termination(self) -> dict[str, Any]:
        """How the search ended."""
        return self._native.termination

    @property
    def verdict(self) -> Verdict:
        """Reliability of the fit on its records: `level`, `reasons`, `notes`, and `of` for each answer."""
        return Verdict._read(self._native.verdict)

    @property
    def change(self) -> dict[str, Any]:
        """Whether a change was found, and the comparison with an operator that does not change."""
        return self._native.change

    @property
    def levels(self) -> list[Estimate | None]:
        """The constant part of u in each record, which is not a response to e, in the unit of u.

        None if it was not estimated: for simulated runs and with ``faults="keep"``.
        """
        return [None if pair is None else Estimate(*pair) for pair in self._native.levels]

    @property
    def initial(self) -> Operator | None:
        """The operator before the change."""
        found = self._native.initial
        return None if found is None else Operator(found)

    @property
    def last(self) -> Operator | None:
        """The operator after the change."""
        found = self._native.last
        return None if found is None else Operator(found)

    def gains(self, times: Any) -> dict[str, FloatArray]:
        """Return ``t`` and the changing parameters at these times in s, with standard errors under ``_se``.

        They are K_e, T_L and K_e_dot for a gain with a lead; K (and K_over_T_I) and T_L for other forms.

        >>> change.gains([20.0, 60.0])
        """
        return self._native.gains([float(t) for t in signal(np.atleast_1d(times), "times")])

    def residuals(self, record: Record) -> Series:
        """Return the one-step prediction errors.

        >>> change.residuals(record).values.std()
        """
        return Series(*self._native.residuals(record))

    def simulate(self, record: Record) -> Series:
        """Simulate the response to e alone.

        >>> change.simulate(record)
        """
        return Series(*self._native.simulate(record))

    def to_pandas(self) -> pd.DataFrame:
        """Return the parameters as a table: value, standard_error, unit, remark.

        >>> change.to_pandas()
        """
        import pandas as pd

        rows = self._native.parameters
        return pd.DataFrame(
            {
                "value": [pair[0] for _, pair, _, _ in rows],
                "standard_error": [
                    np.nan if pair[1] is None else pair[1] for _, pair, _, _ in rows
                ],
                "unit": [unit for _, _, unit, _ in rows],
                "remark": [remark or "" for _, _, _, remark in rows],
            },
            index=pd.Index([name for name, *_ in rows], name="parameter"),
        )

    def summary(self) -> str:
        """Return the fit as a text table.

        >>> print(change.summary())
        """
        rows = [
            [name, *_text.with_uncertainty(*pair), unit, remark or ""]
            for name, pair, unit, remark in self._native.parameters
        ]
        found = "" if self.change["found"] else "\nThe records show no change."
        header = ["parameter", "value", "standard error", "unit", ""]
        return f"{self._title()}\n{_text.plain_table(header, rows)}{found}"

    def _title(self) -> str:
        of_form = "" if self.form == "lead" else f" of the form {self.form}"
        return f"Operator{of_form} whose gains change once (sigmoid)"

    def __repr__(self) -> str:
        return self.summary()

    def _repr_html_(self) -> str:
        rows = [
            [name, *_text.with_uncertainty(*pair), unit, remark or ""]
            for name, pair, unit, remark in self._native.parameters
        ]
        return _text.html_table(
            self._title(),
            ["", "value", "standard error", "unit", ""],
            rows,
        )
