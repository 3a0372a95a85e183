"""The operator of a person: its form, parameters with realistic errors, and reliability."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

from . import _options, _pyhoid, _text
from ._arrays import FloatArray
from ._decimation import rate_note
from ._model import QUALITY, Model
from ._results import Result
from .errors import DataError
from .estimates import Estimate, estimates, unit_of
from .fit import Fit
from .operator_parameters import OperatorParameter, OperatorParameters
from .record import Record
from .verdict import Verdict

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr
    from matplotlib.axes import Axes

__all__ = ["OperatorFit"]

class OperatorFit(Model, Result):
    """The operator of a person. `identify` creates it.

    Attributes
    ----------
    form : str
        The form that was selected or given.
    neuromuscular : bool
        Whether the operator has neuromuscular dynamics.
    parameters : OperatorParameters
        `OperatorParameter` by name: value, standard error, interval, share of the prior, whether
        the data determine it, unit.
    operators : tuple of OperatorParameters
        One operator for all records, or one for each record if some parameters are individual.
        `parameters` belongs to the first.
    verdict : Verdict
        Reliability of the result: `level`, `reasons`, `notes`, and `of` for each answer.
    forms : list of dict
        The forms that were compared, simplest first: form, weight (with which estimates are averaged),
        loss, criterion (Akaike's), held_out, chi2, degrees_of_freedom, converged.
    lines : dict or None
        The fit at the lines of the excitation: parameters (an Estimate each), chi2,
        degrees_of_freedom, held_out, converged; with a controlled element also open_loop and
        open_loop_intervals.
    no_lines : str or None
        Reason why there is no fit at the lines, if an excitation was named.
    excitation : str or None
        Channel of the excitation.
    agreement : dict or None
        Comparison of the methods: coordinates (each by ``prediction_error``, ``lines`` and ``riv_bj``),
        pairs of methods with chi2 and p_value, and chi2 and p_value of the pair that agrees least
        (p_value times the number of pairs).
    riv_bj : dict or None
        The operator by refined instrumental variables with the recorded excitation as instrument:
        parameters (an Estimate each), nd, converged, termination, and open_loop with a controlled
        element. None without an excitation.
    open_loop : dict or None
        ``crossover_rad_s`` and ``phase_margin_deg``, each an Estimate, or None without a crossover;
        None without a controlled element.
    loop_shape : dict or None
        Further properties of that loop: ``crossovers`` (each frequency in rad/s at which its gain is one,
        with the phase margin in deg, as pairs of Estimates), ``smallest_phase_margin_deg``,
        ``gain_margin_db``, ``phase_crossover_rad_s`` (None if there is none), and ``stable``: True,
        False, or None if it cannot be determined. None without a controlled element.
    open_loop_intervals : dict or None
        95 % intervals (low, high) of both quantities from Student's t distribution, since the errors are
        based on few runs or blocks.
    open_loop_person : dict or None
        The same quantities with the errors of the person, whose gain varies from run to run.
    covariance : ndarray or None
        Covariance of the coordinates, from the scatter of runs or blocks and the uncertainty that the
        prior leaves.
    coordinates : dict of str to float
        The coordinates in which the operator is fitted, in the order of the covariance. In these
        coordinates the estimates are nearly normally distributed.
    noise : dict of str to ndarray
        Coefficients ``"c"`` and ``"d"`` of the noise model C/D, without their leading 1.
    box_jenkins : dict or None
        A free Box-Jenkins model of the same orders: loss, likelihood_ratio, degrees_of_freedom, p_value.
    errors : dict
        Basis of the errors: clusters, kind ("runs" or "blocks"), inflation (ratio of clustered to
        model-based variances), largest_ratio_to_model_based.
    intersample : dict
        Behaviour of e between its samples: ``used`` (``"auto"``, ``"zoh"`` or ``"foh"``), and
        ``tau_e_if_straight``, the delay in s if e was logged from a faster or continuous signal; None
        if the data or `intersample` determine the behaviour.
    prior : dict of str to (float, float)
        Centre of each parameter, and standard deviation of its logarithm.
    loss, innovation_variance : float
    coherent_share : float or None
        Mean coherence of u with the excitation at its lines.
    termination : dict
        How the search ended: reason, converged, iterations.
    records : tuple of Record
        The records as they were fitted, with their means removed.
    fits : tuple of Fit
        The same model as polynomials, one for each of `operators`: prediction, simulation,
        residuals, frequency response. They require records with their means removed, such as `records`.
    faults : list of dict
        Faults found in the records: record, kind, channel, from, to, samples, size,
        deviations, action, words.
    settings : dict
        The keywords of the call, including defaults.

    Examples
    --------
    >>> fit = pyhoid.identify(records, controlled_element="90/(s(s+6))")
    >>> fit.verdict.level, fit.parameters, fit.open_loop
    """

    _native: _pyhoid.OperatorFit

    def __init__(
        self,
        native: _pyhoid.OperatorFit,
        records: Sequence[Record] = (),
        settings: Mapping[str, Any] | None = None,
        units: tuple[str, str] | None = None,
    ) -> None:
        super().__init__(native, records, settings, units)
        self.form, self.neuromuscular = native.form
        self.operators: tuple[OperatorParameters, ...] = tuple(
            OperatorParameters(
                {
                    name: OperatorParameter(
                        value,
                        error,
                        interval,
                        share,
                        determined,
                        unit_of(name, self.units, unit),
                        of_person,
                        tuple(forms),
                    )
                    for name, unit, value, (
                        error,
                        of_person,
                    ), interval, share, determined, forms in of
                }
            )
            for of in native.parameters
        )
        self.parameters = self.operators[0]
        self.verdict = Verdict._read(native.verdict)
        self.forms: list[dict[str, Any]] = native.forms
        self.lines = native.lines
        if self.lines is not None:
            for name in ("parameters", "open_loop"):
                if name in self.lines:
                    self.lines[name] = estimates(self.lines[name])
        self.no_lines = native.no_lines
        self.riv_bj = native.riv_bj
        if self.riv_bj is not None:
            for name in ("parameters", "open_loop"):
                if name in self.riv_bj:
                    self.riv_bj[name] = estimates(self.riv_bj[name])
        self.excitation = native.excitation
        self.agreement = native.agreement
        for row in (self.agreement or {}).get("coordinates", []):
            for name in ("prediction_error", "lines", "riv_bj"):
                if row[name] is not None:
                    row[name] = Estimate(*row[name])
        found = native.open_loop
        self.open_loop: dict[str, Estimate | None] | None = (
            None if found is None else estimates(found)
        )
        self.loop_shape: dict[str, Any] | None = native.loop_shape
        if self.loop_shape is not None:
            self.loop_shape["crossovers"] = [
                (Estimate(*omega), Estimate(*margin))
                for omega, margin in self.loop_shape["crossovers"]
            ]
            for name, value in self.loop_shape.items():
                if isinstance(value, tuple):
                    self.loop_shape[name] = Estimate(*value)
        self.open_loop_intervals: dict[str, tuple[float, float] | None] | None = (
            native.open_loop_intervals
        )
        of_person = native.open_loop_person
        self.open_loop_person: dict[str, Estimate | None] | None = (
            None if of_person is None else estimates(of_person)
        )
        self.covariance: FloatArray | None = native.covariance(0)
        self.coordinates: dict[str, float] = {
            name: float(value)
            for name, value in zip(native.coordinates, native.coordinate_values(0))
        }
        c, d = native.noise
        self.noise: dict[str, FloatArray] = {"c": c, "d": d}
        self.box_jenkins = native.box_jenkins
        self.prior: dict[str, tuple[float, float]] = {
            name: (centre, spread) for name, centre, spread, _ in native.prior
        }
        figures = native.figures
        self.loss: float = figures["loss"]
        self.innovation_variance: float = figures["innovation_variance"]
        self.coherent_share: float | None = figures["coherent_share"]
        self.sample_time: float = figures["sample_time"]
        self.intersample: dict[str, Any] = {
            "used": figures["intersample"],
            "tau_e_if_straight": figures["tau_e_if_straight"],
        }
        self.errors: dict[str, Any] = {
            name: figures[name]
            for name in ("clusters", "kind", "inflation", "largest_ratio_to_model_based")
        }
        self.termination = native.termination
        several = len(self.operators) > 1
        self.fits: tuple[Fit, ...] = tuple(
            Fit(
                native.fit(k),
                self.records[k : k + 1] if several else self.records,
                self.settings,
                self.units,
            )
            for k in range(len(self.operators))
        )

    @property
    def fit(self) -> Fit:
        """The polynomial model of the first operator, for prediction, simulation and similar uses."""
        return self.fits[0]

    @property
    def _model(self) -> _pyhoid.Fit:
        return self.fits[0]._native

    def _response(self, omega: FloatArray) -> Sequence[FloatArray]:
        return self._native.frequency_response(omega, 0)

    def margins(
        self, num: str | Sequence[float], den: Sequence[float] | None = None
    ) -> dict[str, Estimate | None]:
        """Return the crossover frequency and the phase margin with a controlled element.

        `num` is the element as text, such as ``"90/(s(s+6))"``; or `num` and `den` are its coefficients
        in descending powers of s.

        >>> person.margins("90/(s(s+6))")
        """
        return estimates(self._native.margins(_options.controlled_element(num, den)))

    @property
    def channels(self) -> list[dict[str, Any]]:
        """The responses to several inputs, the response to the error first; empty for one input.

        Each has input, role, form, parameters (name, value, standard_error, interval, determined, ...)
        and response (gain and phase with errors over frequency). Responses to inputs other than the error
        also have preview (s), p_value (of the best form against no response) and forms (those
        compared; form None is no response). Their form is None if no response was found.

        >>> [(c["input"], c["role"], c["form"]) for c in fit.channels]
        [('e', 'feedback', 'gain'), ('r', 'feedforward', 'derivative')]
        """
        found: list[dict[str, Any]] = json.loads(self.to_json()).get("channels", [])
        return found

    @property
    def quality(self) -> dict[str, float]:
        """VAF and NRMSE fit (both in %) of simulation and one-step prediction, over the fitted records."""
        figures = json.loads(self.to_json())["fit"]
        return {name: float(figures[name]) for name in QUALITY}

    def to_xarray(self) -> xr.Dataset:
        """Return the parameters, and the covariance of the coordinates in which the operator is fitted.

        >>> person.to_xarray()
        """
        import xarray as xr

        every = self.parameters.values()
        nothing = float("nan")
        variables: dict[str, Any] = {
            "value": ("parameter", [p.value for p in every]),
            "standard_error": (
                "parameter",
                [nothing if p.standard_error is None else p.standard_error for p in every],
            ),
        }
        names = list(self.coordinates)
        if self.covariance is not None:
            variables["covariance"] = (("coordinate", "coordinate_"), self.covariance)
        coordinates = {"parameter": list(self.parameters), "coordinate": names, "coordinate_": names}
        return xr.Dataset(variables, coords=coordinates, attrs={"form": self.form})

    def plot(self, record: Record | None = None, ax: Axes | None = None) -> Axes:
        """Plot the time response on a record, by default the first record; see `pyhoid.plots`.

        >>> axes = person.plot(person.records[0].span(20, 40))
        """
        return self.fit.plot(record, ax)

    def report(self, directory: str | PathLike[str], *, title: str | None = None) -> Path:
        """Write the report page of the operator, ``report.html``, to a directory.

        It is the same page as ``hoid identify --report`` writes.

        Parameters
        ----------
        directory : path
            Created if it does not exist.
        title : str, optional
            Heading of the page.

        Returns
        -------
        Path
            Path of the page.

        Raises
        ------
        FileError
            If the page cannot be written.
        DataError
            For a result that was read from JSON, since it has no records to show.

        >>> page = person.report("out")
        """
        if not self.records:
            raise DataError(
                "the result has no records for the page to show; use a result of identify"
            )
        return Path(self._native.report(list(self.records), Path(directory), title=title))

    @property
    def converged(self) -> bool:
        """Whether the search converged."""
        return bool(self.termination["converged"])

    def to_pandas(self) -> pd.DataFrame:
        """Return the parameters as a table.

        >>> person.to_pandas()
        """
        import pandas as pd

        rows = [
            {
                "value": p.value,
                "standard_error": p.standard_error,
                "low": None if p.interval is None else p.interval[0],
                "high": None if p.interval is None else p.interval[1],
                "prior_share": p.prior_share,
                "determined": p.determined,
                "unit": p.unit,
            }
            for p in self.parameters.values()
        ]
        return pd.DataFrame(rows, index=pd.Index(list(self.parameters), name="parameter"))

    def summary(self) -> str:
        """Return the verdict, the parameters and the basis of the errors in plain text.

        >>> print(person.summary())
        """
        parts = [repr(self.verdict), self._native.title]
        for k, operator in enumerate(self.operators):
            head = (
                f"{self.records[k].label or f'record {k + 1}'}:\n"
                if len(self.operators) > 1
                else ""
            )
            parts.append(head + repr(operator))
        if self.open_loop is not None:
            parts.append(f"Open loop: {_loop(self.open_loop, self.open_loop_intervals)}")
        if self.lines is not None:
            parts.append(self._beside(self.lines))
        if len(self.forms) > 1:
            parts.append(self._forms())
        parts.append(self._closing())
        return "\n\n".join(parts)

    def _beside(self, lines: Mapping[str, Any]) -> str:
        rows = [
            [name, p._shown(), repr(lines["parameters"][name])]
            for name, p in self.parameters.items()
        ]
        text = _text.plain_table(["parameter", "prediction error", "at the lines"], rows)
        text += (
            f"\nAt the lines: chi2 {lines['chi2']:.1f} with {lines['degrees_of_freedom']}"
            " degrees of freedom"
        )
        if lines.get("open_loop") is not None:
            text += f"; {_loop(lines['open_loop'], lines['open_loop_intervals'])}"
        if self.agreement is not None:
            text += (
                f"\nAgreement of the methods: chi2 {self.agreement['chi2']:.1f}"
                f" over {len(self.agreement['coordinates'])} determined coordinates,"
                f" p = {self.agreement['p_value']:.2f}"
            )
        return text

    def _forms(self) -> str:
        least = min((f["criterion"] for f in self.forms if f["criterion"] is not None), default=0.0)
        rows = [
            [
                f["form"],
                f"{f['weight']:.2f}" if f["weight"] > 0 else "",
                _text.number(f["loss"]),
                _text.DASH if f["criterion"] is None else f"+{f['criterion'] - least:.1f}",
                _text.number(f["held_out"], 4),
                _text.number(f["chi2"], 4),
                "chosen" if f["form"] == self.form else "",
            ]
            for f in self.forms
        ]
        return _text.plain_table(["form", "weight", "loss", "criterion", "held out", "chi2", ""], rows)

    def _closing(self) -> str:
        prior = ", ".join(f"{name} = {c:g}:{s:g}" for name, (c, s) in self.prior.items())
        rate = rate_note(self.records)
        return (f"{rate}\n" if rate else "") + (
            f"Standard errors from the scatter of {self.errors['clusters']} {self.errors['kind']}: variances"
            f" {self.errors['inflation']:.2f} times as large as for white residuals\n"
            f"Loss {_text.number(self.loss)}; {self.termination['reason']} after"
            f" {self.termination['iterations']} steps\n"
            f"Prior: {prior or 'none'}"
        )

    def __repr__(self) -> str:
        return self.summary()

    def _repr_html_(self) -> str:
        from html import escape

        parts = [f"<pre>{escape(repr(self.verdict))}</pre>", f"<p>{escape(self._native.title)}</p>"]
        parts.extend(operator._repr_html_() for operator in self.operators)
        parts.append(f"<p>{escape(self._closing())}</p>".replace("\n", "<br>"))
        return "".join(parts)


def _loop(
    found: Mapping[str, Estimate | None],
    intervals: Mapping[str, tuple[float, float] | None] | None,
) -> str:
    crossover, margin = found["crossover_rad_s"], found["phase_margin_deg"]
    if crossover is None or margin is None:
        return "no crossover"

    def within(name: str) -> str:
        ends = (intervals or {}).get(name)
        return "" if ends is None else f" (95 %: {ends[0]:.3g} to {ends[1]:.3g})"

    return (
        f"crossover {crossover} rad/s{within('crossover_rad_s')}, "
        f"phase margin {margin} deg{within('phase_margin_deg')}"
    )
