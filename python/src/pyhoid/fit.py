"""A fitted model: coefficients, operator, remnant, quality, predictions, report page."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from . import _options, _pyhoid, _text
from ._arrays import FloatArray
from ._model import QUALITY, Correlation, FrequencyResponse, Model, Series, Validation
from .errors import DataError
from .estimates import Estimate, Operator, Remnant, estimates, unit_of
from .record import Record
from ._results import Result
from .verdict import Verdict

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr
    from matplotlib.axes import Axes

__all__ = ["Correlation", "Fit", "FrequencyResponse", "Series", "Validation"]


class Fit(Model, Result):
    """A fitted model. `identify` creates it.

    Attributes
    ----------
    records : tuple of Record
        The records to which the model was fitted.
    settings : dict
        The keywords of the call, including defaults.

    Examples
    --------
    >>> fit = pyhoid.identify(record, "bj", nk=29, nd=1)
    >>> fit.parameters, fit.standard_errors, fit.verdict
    """

    _native: _pyhoid.Fit

    def __init__(
        self,
        native: _pyhoid.Fit,
        records: Sequence[Record] = (),
        settings: Mapping[str, Any] | None = None,
        units: tuple[str, str] | None = None,
    ) -> None:
        super().__init__(native, records, settings, units)
        self._quality: dict[str, float] | None = None
        self._verdict: Verdict | None = None

    @property
    def _model(self) -> _pyhoid.Fit:
        return self._native

    @property
    def structure(self) -> str:
        """Name of the structure, such as ``"bj"``; ``"operator"`` for an operator with a remnant of order m."""
        return self._native.structure

    @property
    def orders(self) -> dict[str, int]:
        """Orders na, nb, nc, nd, nf and nk; nb counts b0, b1, ..."""
        return self._native.orders

    @property
    def sample_time(self) -> float:
        """Sample time Ts in s."""
        return self._native.sample_time

    @property
    def parameters(self) -> dict[str, float]:
        """Coefficients (or physical parameters of a grey-box model) by name."""
        return {name: value for name, (value, _) in self._native.parameters}

    @property
    def standard_errors(self) -> dict[str, float | None]:
        """Standard errors by name.

        None for a parameter that was fixed, lies at a bound, or was fitted exactly.
        """
        return {name: error for name, (_, error) in self._native.parameters}

    @property
    def estimates(self) -> dict[str, Estimate]:
        """Values and standard errors by name."""
        return {name: Estimate(*pair) for name, pair in self._native.parameters}

    @property
    def covariance(self) -> FloatArray | None:
        """Covariance of the parameters, shape (p, p), in the order of `parameters`.

        None for an exact fit.
        """
        return self._native.covariance

    @property
    def polynomials(self) -> dict[str, FloatArray]:
        """A, B, C, D and F in ascending powers of q^-1.

        B starts with nk zeros for the delay, the others with 1.
        """
        return self._native.polynomials

    @property
    def loss(self) -> float:
        """Mean square of the residuals (Ljung 1999, eq. 7.12)."""
        return float(self._native.figures["loss"])

    @property
    def innovation_variance(self) -> float:
        """Variance of the innovations, corrected for the number of parameters."""
        return float(self._native.figures["innovation_variance"])

    @property
    def criteria(self) -> dict[str, float | None]:
        """Values of the criteria aic, aicc, bic, fpe, mdl and yic."""
        return {
            name: self._native.figures[name] for name in ("aic", "aicc", "bic", "fpe", "mdl", "yic")
        }

    @property
    def termination(self) -> dict[str, Any]:
        """How the search ended: reason, converged, iterations, start."""
        return self._native.termination

    @property
    def converged(self) -> bool:
        """Whether the search converged."""
        return bool(self._native.termination["converged"])

    @property
    def stable(self) -> bool:
        """Whether the model is stable from e to u."""
        return self._native.stable

    @property
    def operator(self) -> Operator | None:
        """The human operator; None if the structure cannot represent one."""
        found = self._native.operator
        return None if found is None else Operator(found, self.units)

    @property
    def operators(self) -> list[Operator | None]:
        """The operator of each record, for a grey-box model with individual parameters.

        Empty for other fits.
        """
        return [None if found is None else Operator(found, self.units) for found in self._native.operators]

    @property
    def levels(self) -> list[Estimate | None]:
        """The constant part of u in each record, which is not a response to e, in the unit of u.

        It is estimated for recorded data; empty for simulated runs and with ``faults="keep"``. None if
        the model has no static gain.
        """
        return [None if pair is None else Estimate(*pair) for pair in self._native.levels]

    @property
    def remnant(self) -> Remnant | None:
        """T_n and K_n, from the inverse of the zero-order hold; see `remnant_by`.

        None without a noise model D.
        """
        return self.remnant_by("zoh")

    def remnant_by(self, discretisation: str) -> Remnant | None:
        """Return T_n and K_n from the inverse of ``"zoh"`` or ``"backward-euler"``.

        >>> fit.remnant_by("backward-euler")
        """
        found = self._native.remnant(discretisation)
        return None if found is None else Remnant(found)

    @property
    def quality(self) -> dict[str, float]:
        """VAF and NRMSE fit (both in %) of simulation and one-step prediction.

        Both are computed over the records of the fit.
        """
        known = self._quality
        if known is None:
            # Without records, the stored values are returned.
            written = None if self.records else json.loads(self.to_json())["fit"]
            known = (
                self._native.quality(list(self.records))
                if written is None
                else {name: float(written[name]) for name in QUALITY}
            )
            self._quality = known
        return known

    @property
    def verdict(self) -> Verdict:
        """Reliability of the fit on its records: `level`, `reasons`, `notes`, and `of` for each answer.

        Raises
        ------
        DataError
            For a fit without records, such as the start of a `Tracker`.
        """
        if not self.records and self._native.state() is not None:
            raise DataError("the fit has no records to judge it on; use a fit from identify")
        if self._verdict is None:
            self._verdict = Verdict._read(self._native.verdict(list(self.records)))
        return self._verdict

    @property
    def candidates(self) -> list[dict[str, Any]]:
        """The candidates from which the model was selected; empty without a search."""
        return self._native.candidates

    @property
    def delay_interval(self) -> tuple[int, int] | None:
        """Range of nk among the candidates that the data cannot distinguish, if nk was searched."""
        return self._native.delay_interval

    @property
    def roots(self) -> list[dict[str, Any]]:
        """Poles and zeros with standard errors, natural frequency (rad/s) and damping."""
        return self._native.roots

    def margins(
        self, num: str | Sequence[float], den: Sequence[float] | None = None
    ) -> dict[str, Estimate | None]:
        """Return the crossover frequency and the margins with a controlled element.

        `num` is the element as text, such as ``"90/(s(s+6))"``; or `num` and `den` are its coefficients
        in descending powers of s.

        >>> fit.margins("90/(s(s+6))")
        """
        return estimates(self._native.margins(_options.controlled_element(num, den)))

    def to_pandas(self) -> pd.DataFrame:
        """Return the parameters, the operator and the remnant as a table: value, standard_error, unit.

        >>> fit.to_pandas()
        """
        import pandas as pd

        rows = self._all_rows()
        return pd.DataFrame(
            {
                "value": [estimate.value for _, estimate in rows],
                "standard_error": [
                    np.nan if e.standard_error is None else e.standard_error for _, e in rows
                ],
                "unit": [unit_of(name, self.units) for name, _ in rows],
            },
            index=pd.Index([name for name, _ in rows], name="parameter"),
        )

    def to_xarray(self) -> xr.Dataset:
        """Return the parameters and their covariance over the coordinate ``parameter``.

        >>> fit.to_xarray()
        """
        import xarray as xr

        names = list(self.parameters)
        errors = [np.nan if e is None else e for e in self.standard_errors.values()]
        variables: dict[str, Any] = {
            "value": ("parameter", list(self.parameters.values())),
            "standard_error": ("parameter", errors),
        }
        covariance = self.covariance
        if covariance is not None:
            variables["covariance"] = (("parameter", "parameter_"), covariance)
        coordinates = {"parameter": names, "parameter_": names}
        return xr.Dataset(
            variables, coords=coordinates, attrs={"structure": self.structure, **self.orders}
        )

    def plot(self, record: Record | None = None, ax: Axes | None = None) -> Axes:
        """Plot the time response on a record, by default the first record; see `pyhoid.plots`.

        >>> axes = fit.plot(record.span(20, 40))
        """
        from . import plots

        return plots.time_response(self, record or self.records[0], ax=ax)

    def report(
        self,
        directory: str | PathLike[str],
        *,
        title: str | None = None,
        controlled_element: str | tuple[Sequence[float], Sequence[float]] | None = None,
    ) -> Path:
        """Write the report page of the model, ``report.html``, to a directory.

        It is the same page as ``hoid identify --report`` writes.

        Parameters
        ----------
        directory : path
            Created if it does not exist.
        title : str, optional
            Heading of the page.
        controlled_element : str or (array_like, array_like), optional
            Text such as ``"90/(s(s+6))"``, or numerator and denominator in descending powers of s. With it,
            the page contains the margins of the loop.

        Returns
        -------
        Path
            Path of the page.

        Raises
        ------
        FileError
            If the page cannot be written.

        >>> page = fit.report("out")
        """
        if not self.records:
            raise DataError("the fit has no records for the page to show; use a fit from identify")
        labels = [record.label or "(unnamed)" for record in self.records]
        what = labels[0] if len(labels) == 1 else f"{len(labels)} records"
        element = None
        if controlled_element is not None:
            element = _options.controlled_element(controlled_element)
        return Path(
            self._native.report(
                list(self.records),
                Path(directory),
                title=title or f"Identification of {what}",
                settings=[
                    ("hoid", _pyhoid.__version__),
                    ("records", ", ".join(labels)),
                    *_options.settings(self.settings),
                ],
                controlled_element=element,
            )
        )

    def _all_rows(self) -> list[tuple[str, Estimate]]:
        rows = list(self.estimates.items())
        for part in (self.operator, self.remnant):
            if part is not None and part.convertible:
                rows.extend(
                    (name, estimate)
                    for name, estimate in part.items()
                    if name not in self.parameters
                )
        return rows

    def summary(self) -> str:
        """Return the fit as tables in plain text.

        >>> print(fit.summary())
        """
        header = ["parameter", "value", "standard error", "unit"]
        rows = [
            [name, *_text.with_uncertainty(e.value, e.standard_error), unit_of(name, self.units)]
            for name, e in self.estimates.items()
        ]
        parts = [self._headline(), _text.plain_table(header, rows)]
        for part in (self.operator, self.remnant):
            if part is not None:
                parts.append(repr(part))
        parts.append(self._closing())
        return "\n\n".join(parts)

    def _headline(self) -> str:
        chosen = f", chosen from {len(self.candidates)} candidates" if self.candidates else ""
        by = f" by {self._native.criterion.upper()}" if self._native.criterion else ""
        return f"{self._native.title}{chosen}{by}"

    def _closing(self) -> str:
        q, t = self.quality, self.termination
        return (
            f"VAF {q['vaf_simulation']:.2f} % simulation, {q['vaf_prediction']:.2f} % prediction; "
            f"NRMSE fit {q['nrmse_simulation']:.2f} %, {q['nrmse_prediction']:.2f} %\n"
            f"BIC {_text.number(self.criteria['bic'], 7)}, loss {_text.number(self.loss)}; "
            f"{t['reason']} after {t['iterations']} steps"
        )

    def __repr__(self) -> str:
        return self.summary()

    def _repr_html_(self) -> str:
        from html import escape

        header = ["", "value", "standard error", "unit"]
        rows = [
            [name, *_text.with_uncertainty(e.value, e.standard_error), unit_of(name, self.units)]
            for name, e in self.estimates.items()
        ]
        parts = [_text.html_table(self._headline(), header, rows)]
        for part in (self.operator, self.remnant):
            if part is not None:
                parts.append(part._repr_html_())
        parts.append(f"<p>{escape(self._closing())}</p>".replace("\n", "<br>"))
        return "".join(parts)
