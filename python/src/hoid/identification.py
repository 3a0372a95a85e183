"""Batch fits: from records to a model and the operator's parameters."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, Literal, NamedTuple, overload

import numpy as np
import numpy.typing as npt

from . import _hoid, _options, _text
from ._arrays import FloatArray, signal
from .errors import NotConvertibleError, OptionError
from .estimates import UNITS, Estimate, Operator, Remnant, estimates
from .record import Record

if TYPE_CHECKING:
    import control
    import pandas as pd
    import xarray as xr
    from matplotlib.axes import Axes

__all__ = ["Fit", "FrequencyResponse", "Series", "TimeVaryingFit", "Validation", "identify"]

Order = int | tuple[int, int] | range
Progress = bool | Callable[[int, int], object]


class Series(NamedTuple):
    """Values on the time axis of a record, from sample `first` on: ``record.u[first:]`` belongs to `values`."""

    first: int
    values: FloatArray


class FrequencyResponse(NamedTuple):
    """Frequency response from e to u with its standard errors (NaN where there are none), all of shape (n,)."""

    omega: FloatArray
    magnitude_db: FloatArray
    magnitude_db_se: FloatArray
    phase_deg: FloatArray
    phase_deg_se: FloatArray

    @property
    def response(self) -> npt.NDArray[np.complex128]:
        """The complex response."""
        phase = np.deg2rad(self.phase_deg)
        return np.asarray(10.0 ** (self.magnitude_db / 20.0) * (np.cos(phase) + 1j * np.sin(phase)), dtype=np.complex128)


class Correlation(NamedTuple):
    """Correlation over lags, with the bound that 99 % of white residuals keep."""

    lags: npt.NDArray[np.int64]
    values: FloatArray
    bound_99: float


class Validation(NamedTuple):
    """A model judged on a record: simulation, prediction, and tests of the residuals."""

    first: int
    simulated: FloatArray
    predicted: FloatArray
    quality: dict[str, float]
    autocorrelation: Correlation
    cross_correlation: Correlation
    ljung_box: dict[str, float] | None
    coloured_residuals: bool
    under_modelled: bool
    feedback: bool


class Fit:
    """A fitted model. `identify` makes it.

    Attributes
    ----------
    records : tuple of Record
        The records that it was fitted to.
    """

    def __init__(self, native: _hoid.Fit, records: Sequence[Record]) -> None:
        self._native = native
        self.records: tuple[Record, ...] = tuple(records)
        self._quality: dict[str, float] | None = None

    @property
    def structure(self) -> str:
        """Name of the structure, as ``"bj"`` or ``"grey-box"``."""
        return self._native.structure

    @property
    def orders(self) -> dict[str, int]:
        """na, nb, nc, nd, nf and nk; nb counts b0, b1, ..."""
        return self._native.orders

    @property
    def sample_time(self) -> float:
        """Ts in s."""
        return self._native.sample_time

    @property
    def parameters(self) -> dict[str, float]:
        """Coefficients (or physical parameters of a grey box) by name."""
        return {name: value for name, (value, _) in self._native.parameters}

    @property
    def standard_errors(self) -> dict[str, float | None]:
        """Standard errors by name; None for what was fixed, rests at a bound, or was fitted exactly."""
        return {name: error for name, (_, error) in self._native.parameters}

    @property
    def estimates(self) -> dict[str, Estimate]:
        """Both together."""
        return {name: Estimate(*pair) for name, pair in self._native.parameters}

    @property
    def covariance(self) -> FloatArray | None:
        """Covariance of the parameters, shape (p, p), in the order of `parameters`; None for an exact fit."""
        return self._native.covariance

    @property
    def polynomials(self) -> dict[str, FloatArray]:
        """A, B, C, D and F by ascending powers of q^-1; B begins with its delay, the others with 1."""
        return self._native.polynomials

    @property
    def loss(self) -> float:
        """Mean square of the residuals (Ljung 1999, eq. 7.12)."""
        return float(self._native.figures["loss"])

    @property
    def innovation_variance(self) -> float:
        """Variance of the innovations, freed of the bias by the number of parameters."""
        return float(self._native.figures["innovation_variance"])

    @property
    def criteria(self) -> dict[str, float | None]:
        """aic, aicc, bic, fpe, mdl and yic."""
        return {name: self._native.figures[name] for name in ("aic", "aicc", "bic", "fpe", "mdl", "yic")}

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
        """The human operator; None where the structure has no meaning as one."""
        found = self._native.operator
        return None if found is None else Operator(found)

    @property
    def operators(self) -> list[Operator | None]:
        """The operator of each record of a grey box, whose individual parameters differ; empty for another fit."""
        return [None if found is None else Operator(found) for found in self._native.operators]

    @property
    def remnant(self) -> Remnant | None:
        """T_n and K_n by the inverse of the zero-order hold; None without a noise model D. See `remnant_by`."""
        return self.remnant_by("zoh")

    def remnant_by(self, discretisation: str) -> Remnant | None:
        """T_n and K_n by the inverse of ``"zoh"`` or ``"backward-euler"``."""
        found = self._native.remnant(discretisation)
        return None if found is None else Remnant(found)

    @property
    def quality(self) -> dict[str, float]:
        """VAF and NRMSE fit (both in %) of simulation and one-step prediction, over the records of the fit."""
        if self._quality is None:
            self._quality = self._native.quality(list(self.records))
        return self._quality

    @property
    def candidates(self) -> list[dict[str, Any]]:
        """The table that the model was chosen from; empty when nothing was searched."""
        return self._native.candidates

    @property
    def delay_interval(self) -> tuple[int, int] | None:
        """nk of the candidates that the data do not tell apart, where nk was searched."""
        return self._native.delay_interval

    @property
    def roots(self) -> list[dict[str, Any]]:
        """Poles and zeros with standard errors, natural frequency (rad/s) and damping."""
        return self._native.roots

    def predict(self, record: Record, horizon: int = 1) -> Series:
        """Prediction of u, `horizon` samples ahead.

        Raises
        ------
        DataError
            For a record that is too short or sampled otherwise.
        """
        return Series(*self._native.predict(record, horizon))

    def simulate(self, record: Record) -> Series:
        """Response to e alone, from initial states that fit the record best."""
        return Series(*self._native.simulate(record))

    def residuals(self, record: Record) -> Series:
        """One-step prediction errors."""
        return Series(*self._native.residuals(record))

    def validate(self, record: Record) -> Validation:
        """Simulation, prediction and residual tests on a record."""
        found = dict(self._native.validate(record))
        found["autocorrelation"] = Correlation(*found["autocorrelation"])
        found["cross_correlation"] = Correlation(*found["cross_correlation"])
        return Validation(**found)

    def quality_on(self, records: Record | Sequence[Record]) -> dict[str, float]:
        """`quality` on other records."""
        return self._native.quality(_options.as_records(records))

    def frequency_response(self, omega: Any = None) -> FrequencyResponse:
        """Frequency response from e to u.

        Parameters
        ----------
        omega : array_like, shape (n,), optional
            Frequencies in rad/s; default 200 from 0.1 rad/s to the Nyquist frequency.
        """
        if omega is None:
            omega = np.geomspace(0.1, np.pi / self.sample_time, 200)
        frequencies = signal(np.atleast_1d(omega) if np.isscalar(omega) else omega, "omega")
        return FrequencyResponse(frequencies, *self._native.frequency_response(frequencies))

    def margins(self, num: Sequence[float], den: Sequence[float]) -> dict[str, Estimate | None]:
        """Crossover frequency and margins with a controlled element NUM/DEN by descending powers of s."""
        return estimates(self._native.margins([float(v) for v in num], [float(v) for v in den]))

    def to_control(self) -> control.TransferFunction:
        """The model from e to u as a transfer function of python-control, in z.

        Raises
        ------
        NotConvertibleError
            For a model without an input.
        """
        import control

        parts = self.polynomials
        if not parts["B"].size:
            raise NotConvertibleError("the model has no input, so that it has no transfer function from e to u")
        num = parts["B"]
        den = np.convolve(parts["A"], parts["F"])
        length = max(len(num), len(den))
        num, den = (np.pad(p, (0, length - len(p))) for p in (num, den))
        # Zeros at the front of the numerator are the delay; equal zeros at both ends cancel.
        while length > 1 and num[-1] == 0 and den[-1] == 0:
            num, den, length = num[:-1], den[:-1], length - 1
        return control.tf(num, den, self.sample_time)

    def to_pandas(self) -> pd.DataFrame:
        """Parameters, operator and remnant as a table: value, standard_error, unit."""
        import pandas as pd

        rows = self._all_rows()
        return pd.DataFrame(
            {
                "value": [estimate.value for _, estimate in rows],
                "standard_error": [np.nan if e.standard_error is None else e.standard_error for _, e in rows],
                "unit": [UNITS.get(name, "") for name, _ in rows],
            },
            index=pd.Index([name for name, _ in rows], name="parameter"),
        )

    def to_xarray(self) -> xr.Dataset:
        """Parameters and covariance over the coordinate ``parameter``."""
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
        return xr.Dataset(variables, coords=coordinates, attrs={"structure": self.structure, **self.orders})

    def plot(self, record: Record | None = None, ax: Axes | None = None) -> Axes:
        """The time response on a record, by default the first of the fit; see `hoid.plots`."""
        from . import plots

        return plots.time_response(self, record or self.records[0], ax=ax)

    def _all_rows(self) -> list[tuple[str, Estimate]]:
        rows = list(self.estimates.items())
        for part in (self.operator, self.remnant):
            if part is not None and part.convertible:
                rows.extend((name, estimate) for name, estimate in part.items() if name not in self.parameters)
        return rows

    def summary(self) -> str:
        """The fit as a text of tables."""
        header = ["parameter", "value", "standard error", "unit"]
        rows = [
            [name, *_text.with_uncertainty(e.value, e.standard_error), UNITS.get(name, "")]
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
        rows = [[name, *_text.with_uncertainty(e.value, e.standard_error), UNITS.get(name, "")] for name, e in self.estimates.items()]
        parts = [_text.html_table(self._headline(), header, rows)]
        for part in (self.operator, self.remnant):
            if part is not None:
                parts.append(part._repr_html_())
        parts.append(f"<p>{escape(self._closing())}</p>".replace("\n", "<br>"))
        return "".join(parts)


class TimeVaryingFit:
    """A fitted operator whose gains change once, by a sigmoid. `identify` makes it with ``structure="time-varying"``."""

    def __init__(self, native: _hoid.TimeVaryingFit, records: Sequence[Record]) -> None:
        self._native = native
        self.records: tuple[Record, ...] = tuple(records)

    structure = "time-varying"

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
        """What there is to say of single parameters, as that one rests at a bound."""
        return {name: remark for name, _, _, remark in self._native.parameters if remark is not None}

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
    def change(self) -> dict[str, Any]:
        """Whether a change was found, and its comparison with the operator that does not change."""
        return self._native.change

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
        """``t``, K_e, T_L and K_e_dot at these times in s, with their standard errors."""
        return self._native.gains([float(t) for t in signal(np.atleast_1d(times), "times")])

    def residuals(self, record: Record) -> Series:
        """One-step prediction errors."""
        return Series(*self._native.residuals(record))

    def simulate(self, record: Record) -> Series:
        """Response to e alone."""
        return Series(*self._native.simulate(record))

    def to_pandas(self) -> pd.DataFrame:
        """Parameters as a table: value, standard_error, unit, remark."""
        import pandas as pd

        rows = self._native.parameters
        return pd.DataFrame(
            {
                "value": [pair[0] for _, pair, _, _ in rows],
                "standard_error": [np.nan if pair[1] is None else pair[1] for _, pair, _, _ in rows],
                "unit": [unit for _, _, unit, _ in rows],
                "remark": [remark or "" for _, _, _, remark in rows],
            },
            index=pd.Index([name for name, *_ in rows], name="parameter"),
        )

    def summary(self) -> str:
        """The fit as a text table."""
        rows = [
            [name, *_text.with_uncertainty(*pair), unit, remark or ""] for name, pair, unit, remark in self._native.parameters
        ]
        found = "" if self.change["found"] else "\nThe records show no change."
        header = ["parameter", "value", "standard error", "unit", ""]
        return f"Operator whose gains change once (sigmoid)\n{_text.plain_table(header, rows)}{found}"

    def __repr__(self) -> str:
        return self.summary()

    def _repr_html_(self) -> str:
        rows = [
            [name, *_text.with_uncertainty(*pair), unit, remark or ""] for name, pair, unit, remark in self._native.parameters
        ]
        return _text.html_table("Operator whose gains change once (sigmoid)", ["", "value", "standard error", "unit", ""], rows)


#: Keywords that have a meaning for some fits alone, and what they belong to.
_STEADY_POLYNOMIAL = 'method="pem" and a polynomial structure'


def _check(structure: str, method: str, given: Mapping[str, object]) -> None:
    grey, changing = structure == "grey-box", structure == "time-varying"
    polynomial = not (grey or changing)
    searched = polynomial and method == "pem"
    if searched and given.keys().isdisjoint(("instruments", "remnant_order", "individual", "delay")):
        # Of the rules below none can hold; a fit of a millisecond should not wait for them.
        return
    rules = [
        ("initial_state", method != "pem", 'method="pem"'),
        ("search_method", method != "pem", 'method="pem"'),
        ("fix", method != "pem", 'method="pem"'),
        ("bound", method != "pem", 'method="pem"'),
        ("instruments", method == "pem", 'method="iv4", "sriv" or "rivbj"'),
        ("remnant_order", not grey, 'structure="grey-box"'),
        ("individual", not grey, 'structure="grey-box"'),
        ("delay", polynomial, 'structure="grey-box" or "time-varying"; else give nk'),
        ("nk", not polynomial, "a polynomial structure; else give delay in s"),
        *((name, grey, "a polynomial structure; a grey box has remnant_order") for name in ("na", "nb", "nc", "nd", "nf")),
        *((name, not searched, _STEADY_POLYNOMIAL) for name in ("start", "prior", "robust", "stable", "focus")),
    ]
    for name, wrong, belongs in rules:
        if wrong and name in given:
            raise OptionError(f"{name} belongs to {belongs}")


if TYPE_CHECKING:
    from typing_extensions import TypedDict, Unpack

    class IdentifyOptions(TypedDict, total=False):
        """The keywords of `identify`."""

        na: Order | None
        nb: Order | None
        nc: Order | None
        nd: Order | None
        nf: Order | None
        nk: Order | None
        method: str
        instruments: str | None
        remnant_order: Order | None
        delay: tuple[float, float] | None
        individual: Sequence[str]
        criterion: str
        initial_state: str
        start: Mapping[str, float] | None
        fix: Mapping[str, float] | None
        bound: Mapping[str, tuple[float | None, float | None]] | None
        prior: Mapping[str, tuple[float, float]] | None
        robust: float | bool | None
        focus: str
        stable: bool
        search_method: str
        max_iterations: int
        tolerance: float
        progress: Progress


@overload
def identify(  # type: ignore[overload-overlap]
    records: Record | Sequence[Record],
    structure: Literal["time-varying", "time_varying"],
    **options: Unpack[IdentifyOptions],
) -> TimeVaryingFit: ...
@overload
def identify(
    records: Record | Sequence[Record], structure: str | None = None, **options: Unpack[IdentifyOptions]
) -> Fit: ...
def identify(
    records: Record | Sequence[Record],
    structure: str | None = None,
    *,
    na: Order | None = None,
    nb: Order | None = None,
    nc: Order | None = None,
    nd: Order | None = None,
    nf: Order | None = None,
    nk: Order | None = None,
    method: str = "pem",
    instruments: str | None = None,
    remnant_order: Order | None = None,
    delay: tuple[float, float] | None = None,
    individual: Sequence[str] = (),
    criterion: str = "bic",
    initial_state: str = "auto",
    start: Mapping[str, float] | None = None,
    fix: Mapping[str, float] | None = None,
    bound: Mapping[str, tuple[float | None, float | None]] | None = None,
    prior: Mapping[str, tuple[float, float]] | None = None,
    robust: float | bool | None = None,
    focus: str = "prediction",
    stable: bool = False,
    search_method: str = "auto",
    max_iterations: int = 100,
    tolerance: float = 1e-12,
    progress: Progress = False,
) -> Fit | TimeVaryingFit:
    """Identify a model and the operator's parameters from one or several records.

    With no options this is the operator by Box-Jenkins, its delay searched over 0.05 to 0.6 s and nd over 1 to 4.

    Parameters
    ----------
    records : Record or sequence of Record
        Several share one model and have initial states of their own.
    structure : str, optional
        ``"arx"``, ``"armax"``, ``"oe"``, ``"bj"``, ``"fir"``, ``"ar"``, ``"ma"``, ``"arma"``, ``"ararx"``, ``"ararmax"``, ``"general"``,
        ``"grey-box"`` (operator and remnant in physical parameters, with a real delay) or ``"time-varying"`` (gains that change once).
        Default ``"bj"``, or that of `method`.
    na, nb, nc, nd, nf, nk : int or (int, int) or range, optional
        Orders, and the delay of b0 in samples. A pair is searched from the first to the second, both included. nb counts b0, b1, ...
    method : {"pem", "iv4", "sriv", "rivbj"}
        Prediction error method (Ljung 1999), or instrumental variables: iv4 for arx, sriv for oe, rivbj for bj (Young 2011).
    instruments : str, optional
        Channel of the instruments, or ``"simulated"``; default ``f_t`` where all records have it.
    remnant_order : int or (int, int), optional
        Order m of the remnant for ``"grey-box"``; default 1 to 4.
    delay : (float, float), optional
        Shortest and longest tau_e in s for ``"grey-box"`` and ``"time-varying"``.
    individual : sequence of str
        Parameters that each record has for itself, for ``"grey-box"``.
    criterion : {"bic", "aic", "aicc", "fpe", "mdl", "yic", "loss"}
        What decides between candidates.
    initial_state : {"auto", "zero", "estimate", "backcast"}
    start : mapping of str to float, optional
        Start of the search: all coefficients.
    fix : mapping of str to float, optional
        Coefficients that are held.
    bound : mapping of str to (float or None, float or None), optional
        Bounds; None leaves an end open.
    prior : mapping of str to (float, float), optional
        Guesses with a weight W: the loss grows by W (theta - guess)^2.
    robust : float or True, optional
        Loss of Huber: residuals beyond so many standard deviations count linearly; True is 1.345.
    focus : {"prediction", "simulation"}
        What the model is to be good at.
    stable : bool
        Take only models that are stable from e to u.
    search_method : {"auto", "gn", "lm", "grad"}
    max_iterations : int
    tolerance : float
        Relative decrease of the loss below which the search has converged.
    progress : bool or callable
        True shows how far a search is on standard error; a callable gets what is done and the whole.

    Returns
    -------
    Fit or TimeVaryingFit

    Raises
    ------
    OptionError
        For options out of range or without meaning beside the others (a `ValueError`).
    DataError
        For records that cannot give a result (a `ValueError`).
    EstimationError
        When there is no result, as for singular regressors.

    Examples
    --------
    >>> fit = hoid.identify(record, "bj", nb=2, nd=1, nf=2, nk=29)
    >>> fit.operator.K_e
    0.0920 ± 0.0023
    """
    methods = {"iv4": "arx", "sriv": "oe", "rivbj": "bj"}
    own = methods.get(method.lower(), "bj")
    name = (structure or own).lower().replace("_", "-")
    if structure is not None and method.lower() in methods and name != own:
        raise OptionError(f'method="{method}" fits the structure {own}; drop structure, or take method="pem"')
    orders = {
        order: _options.order(order, value)
        for order, value in (("na", na), ("nb", nb), ("nc", nc), ("nd", nd), ("nf", nf), ("nk", nk))
        if value is not None
    }
    usual = {
        "instruments": (instruments, None),
        "remnant_order": (remnant_order, None),
        "delay": (delay, None),
        "individual": (tuple(individual), ()),
        "initial_state": (initial_state, "auto"),
        "search_method": (search_method, "auto"),
        "start": (start, None),
        "fix": (fix, None),
        "bound": (bound, None),
        "prior": (prior, None),
        "robust": (robust, None),
        "stable": (stable, False),
        "focus": (focus, "prediction"),
    }
    given = {key: value for key, (value, default) in usual.items() if value != default}
    _check(name, method.lower(), {**given, **orders})
    several = _options.as_records(records)
    found = _hoid.identify(
        several,
        name,
        orders=orders,
        method=method,
        instruments=instruments,
        remnant_order=None if remnant_order is None else _options.order("remnant_order", remnant_order),
        delay=_options.span("delay", delay),
        individual=list(individual),
        criterion=criterion,
        initial_state=initial_state,
        start=None if start is None else _options.numbers("start", start),
        fix=_options.numbers("fix", fix or {}),
        bound=_options.bounds(bound or {}),
        prior={key: (float(value), float(weight)) for key, (value, weight) in (prior or {}).items()},
        robust=1.345 if robust is True else (None if robust is None or robust is False else float(robust)),
        focus=focus,
        stable=stable,
        search_method=search_method,
        max_iterations=int(max_iterations),
        tolerance=float(tolerance),
        progress=_options.reporter(progress, "candidates"),
    )
    if isinstance(found, _hoid.TimeVaryingFit):
        return TimeVaryingFit(found, several)
    return Fit(found, several)

