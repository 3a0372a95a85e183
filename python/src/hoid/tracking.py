"""Recursive estimates: over a record, and live."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from os import PathLike
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from . import _hoid, _options, _text
from ._arrays import FloatArray, signal
from .errors import DataError, OptionError
from .estimates import UNITS, Estimate, Operator
from .identification import Fit, Order, Progress
from .record import Record

if TYPE_CHECKING:
    import pandas as pd
    import polars as pl
    import xarray as xr
    from matplotlib.axes import Axes

__all__ = ["Trace", "Tracker", "track"]

Memory = float | str

#: Keywords of a recursion that have a meaning beside others alone.
_FORGETS = 'a recursion that forgets; method="window" has window, forgetting="gradient" has rate, "adaptive" finds its memory'


def _recursion(
    method: str,
    *,
    structure: str | None,
    na: Order | None,
    nb: Order | None,
    nc: Order | None,
    nd: Order | None,
    nf: Order | None,
    nk: Order | None,
    criterion: str,
    start: Mapping[str, float] | str | None,
    memory: Memory | None,
    forgetting_factor: float | None,
    memory_of: Mapping[str, Memory] | None,
    forgetting: str,
    drift: Mapping[str, float] | None,
    rate: float | None,
    covariance: float | None,
    pseudo_linear: bool,
    stable: str,
    bound: Mapping[str, tuple[float | None, float | None]] | None,
    track_delay: tuple[float, float] | None,
    window: Memory | None,
    refit: int | None,
    limit: float | None,
    alarm: float | None,
    largest: float,
) -> dict[str, Any]:
    """The keywords of a recursion in their plain form, checked against each other."""
    name, way = method.lower(), forgetting.lower().replace("_", "-")
    windowed, adaptive = name == "window", name == "adaptive"
    remembers = not windowed and not adaptive and way != "gradient"
    for keyword, wrong, belongs in (
        ("window", window is not None and not windowed, 'method="window"'),
        ("refit", refit is not None and not windowed, 'method="window"'),
        ("memory", (memory is not None or forgetting_factor is not None) and not remembers, _FORGETS),
        ("memory_of", memory_of is not None and not remembers, _FORGETS),
        ("bound", bound is not None and name not in ("physical", "adaptive"), 'method="physical" or "adaptive"'),
        ("alarm", alarm is not None and not adaptive, 'method="adaptive"'),
        ("track_delay", track_delay is not None and name != "physical", 'method="physical"'),
        ("drift", drift is not None and way != "random-walk", 'forgetting="random-walk"'),
        ("rate", rate is not None and way != "gradient", 'forgetting="gradient"'),
    ):
        if wrong:
            raise OptionError(f"{keyword} belongs to {belongs}")
    if isinstance(start, str) and start != "nothing":
        raise OptionError(f'start is {start!r}, expected all coefficients by name, or "nothing"')
    orders = {
        order: _options.order(order, value)
        for order, value in (("na", na), ("nb", nb), ("nc", nc), ("nd", nd), ("nf", nf), ("nk", nk))
        if value is not None
    }
    return {
        "method": name,
        "structure": structure,
        "orders": orders,
        "criterion": criterion,
        "start": None if start is None or isinstance(start, str) else _options.numbers("start", start),
        "from_nothing": start == "nothing",
        "memory": None if memory is None else _options.memory(memory),
        "forgetting_factor": forgetting_factor,
        "memory_of": {key: _options.memory(value) for key, value in (memory_of or {}).items()},
        "forgetting": way,
        "drift": None if drift is None else _options.numbers("drift", drift),
        "rate": rate,
        "covariance": covariance,
        "pseudo_linear": bool(pseudo_linear),
        "stable": stable,
        "bound": _options.bounds(bound or {}),
        "track_delay": _options.span("track_delay", track_delay),
        "window": None if window is None else _options.memory(window),
        "refit": refit,
        "limit": limit,
        "alarm": alarm,
        "largest": float(largest),
    }


class Trace:
    """The estimate at every sample that was kept, with its uncertainty. `track` makes it.

    Columns are read by name: ``trace["K_e"]``, ``trace["K_e_se"]`` for its standard errors; all have the shape (N,). NaN stands where a
    row has no operator.

    Attributes
    ----------
    record : Record
        The record that was tracked.
    """

    def __init__(self, native: _hoid.Trace, record: Record) -> None:
        self._native = native
        self.record = record
        self._columns: dict[str, npt.NDArray[Any]] | None = None

    @property
    def columns(self) -> dict[str, npt.NDArray[Any]]:
        """All columns by name, in the order of the file of a trace."""
        if self._columns is None:
            self._columns = self._native.columns()
        return self._columns

    def __getitem__(self, name: str) -> npt.NDArray[Any]:
        try:
            return self.columns[name]
        except KeyError:
            raise KeyError(f"there is no column {name}; the trace has {', '.join(self.columns)}") from None

    def __contains__(self, name: object) -> bool:
        return name in self.columns

    def __len__(self) -> int:
        return len(self._native)

    @property
    def time(self) -> FloatArray:
        """Times of the rows in s."""
        return self["t"]

    @property
    def method(self) -> str:
        """The recursion."""
        return self._native.method

    @property
    def structure(self) -> str:
        """The structure."""
        return self._native.structure

    @property
    def orders(self) -> dict[str, int]:
        """na, nb, nc, nd, nf and nk."""
        return self._native.orders

    @property
    def parameter_names(self) -> list[str]:
        """Names of the coefficients."""
        return self._native.parameter_names

    @property
    def operator_names(self) -> list[str]:
        """Names of the operator's parameters."""
        return self._native.operator_names

    @property
    def updated_from(self) -> float:
        """Time in s from which the estimate moved."""
        return self._native.updated_from

    @property
    def counts(self) -> dict[str, int]:
        """samples, skipped, steps_shortened."""
        return self._native.counts

    @property
    def changes(self) -> list[dict[str, Any]]:
        """The changes that ``"adaptive"`` declared: when, how long ago, the odds, and the gains before and after with standard errors."""
        return self._native.changes

    @property
    def innovation_variance(self) -> FloatArray:
        """Innovation variance of each row, as tracked."""
        return self._native.innovation_variance

    @property
    def start(self) -> Fit | None:
        """The batch fit that the recursion started from."""
        native = self._native.start
        if native is None:
            return None
        return Fit(native, [self.record])

    def operator(self, row: int = -1) -> Operator | None:
        """The operator of a row, by default the last."""
        found = self._native.operator(row if row >= 0 else row + len(self))
        return None if found is None else Operator(found)

    def to_pandas(self) -> pd.DataFrame:
        """All columns with the time in s as index."""
        import pandas as pd

        columns = {name: values for name, values in self.columns.items() if name != "t"}
        return pd.DataFrame(columns, index=pd.Index(self.time, name="t"), copy=False)

    def to_polars(self) -> pl.DataFrame:
        """All columns."""
        import polars as pl

        return pl.DataFrame(dict(self.columns))

    def to_xarray(self) -> xr.Dataset:
        """All columns over the coordinate ``t`` (s)."""
        import xarray as xr

        variables = {
            name: ("t", values, {"units": UNITS.get(name.removesuffix("_se"), "")})
            for name, values in self.columns.items()
            if name != "t"
        }
        attributes = {"method": self.method, "structure": self.structure}
        return xr.Dataset(variables, coords={"t": ("t", self.time, {"units": "s"})}, attrs=attributes)

    def write(self, path: str | PathLike[str], comments: Sequence[str] = ()) -> None:
        """Write the columns as CSV, Parquet, NPZ or .mat, as ``hoid track`` does."""
        self._native.write(path, list(comments))

    def plot(self, names: Sequence[str] | None = None, axes: Sequence[Axes] | None = None) -> Sequence[Axes]:
        """The parameters over time with their bands; see `hoid.plots`."""
        from . import plots

        return plots.trace(self, names, axes=axes)

    def _rows(self) -> list[list[str]]:
        moved = np.flatnonzero(self.time >= self.updated_from)
        first = int(moved[0]) if moved.size else 0
        picked = np.unique(np.linspace(first, len(self) - 1, 8).round().astype(int))
        names = self.operator_names if bool(np.any(self["convertible"])) else self.parameter_names[:6]
        rows = []
        for row in picked:
            cells = [repr(Estimate(float(self[n][row]), float(self[f"{n}_se"][row]))) for n in names]
            rows.append([f"{self.time[row]:.2f}", *cells])
        return [["t in s", *names], *rows]

    def __repr__(self) -> str:
        if not len(self):
            return f"Trace by {self.method}: no rows"
        header, *rows = self._rows()
        return f"Trace by {self.method}, {self.structure}: {len(self)} rows\n{_text.plain_table(header, rows)}"

    def _repr_html_(self) -> str:
        header, *rows = self._rows()
        return _text.html_table(f"Trace by {self.method}, {self.structure}: {len(self)} rows", header, rows)


def track(
    record: Record,
    method: str = "physical",
    *,
    structure: str | None = None,
    na: Order | None = None,
    nb: Order | None = None,
    nc: Order | None = None,
    nd: Order | None = None,
    nf: Order | None = None,
    nk: Order | None = None,
    criterion: str = "bic",
    start: Mapping[str, float] | str | None = None,
    memory: Memory | None = None,
    forgetting_factor: float | None = None,
    memory_of: Mapping[str, Memory] | None = None,
    forgetting: str = "exponential",
    drift: Mapping[str, float] | None = None,
    rate: float | None = None,
    covariance: float | None = None,
    pseudo_linear: bool = False,
    stable: str = "predictor",
    bound: Mapping[str, tuple[float | None, float | None]] | None = None,
    track_delay: tuple[float, float] | None = None,
    window: Memory | None = None,
    refit: int | None = None,
    limit: float | None = None,
    alarm: float | None = None,
    largest: float = 1e6,
    start_span: tuple[float, float] | None = None,
    update_from: float | None = None,
    moving_average: float | None = None,
    every: int = 1,
    progress: Progress = False,
) -> Trace:
    """Track a model and the operator's parameters over a record, sample by sample.

    With no options this is the physical recursion, started from a Box-Jenkins fit of the first third of the record.

    Parameters
    ----------
    record : Record
    method : {"physical", "rls", "rpem", "window", "rriv", "adaptive"}
        Recursion in the operator's parameters; recursive least squares (arx, fir); recursive prediction error method (Ljung 1999, ch. 11);
        batch fits of a sliding window; recursive refined instrumental variable (Young 2011);
        a bank of hypotheses of when the person changed, which sets its memory itself and tells of changes (`Trace.changes`).
    structure : str, optional
        Default ``"arx"`` for rls, else ``"bj"``.
    na, nb, nc, nd, nf, nk : int or (int, int) or range, optional
        Orders; pairs are searched on the start span.
    criterion : str
        What decides between candidates.
    start : mapping of str to float, or "nothing", optional
        All coefficients; default a batch fit of the start span.
    memory : float or str, optional
        Time in which the weight of a sample falls to 1/e: samples (``256``), seconds (``"2.56s"``) or ``"inf"``.
    forgetting_factor : float, optional
        lambda = 1 - 1/memory, in its place.
    memory_of : mapping, optional
        Memory of single parameters, or of all of one letter, as ``{"b": 256, "K_e": "5s"}``.
    forgetting : {"exponential", "random-walk", "window", "variable", "directional", "gradient"}
    drift : mapping of str to float, optional
        For ``"random-walk"``: by how much a parameter drifts in one second.
    rate : float, optional
        Step size for ``"gradient"``; default 0.1.
    covariance : float, optional
        P at the start as a multiple of the unit matrix (the reference text: 0.1); default that of the start fit.
    pseudo_linear : bool
        Extended least squares in place of the gradient, for rpem.
    stable : {"predictor", "noise"}
        Polynomials that are kept stable: C and F, or D too.
    bound : mapping, optional
        Bounds of physical parameters.
    track_delay : (float, float), optional
        Track tau_e within this range in s.
    window, refit
        Length of the window (default ``"20s"``), and samples between two fits (25), for ``"window"``.
    limit : float, optional
        Standard deviations beyond which an innovation moves the estimate no further.
    alarm : float, optional
        For ``"adaptive"``: logarithm of the odds from which a change is declared; default 4.
    largest : float
        Magnitude of e or u beyond which a sample is a fault.
    start_span : (float, float), optional
        Span of the start fit in s; default the first third.
    update_from : float, optional
        Time in s from which the estimate moves.
    moving_average : float, optional
        Mean over the last so many seconds in place of each estimate.
    every : int
        Keep every n-th sample.
    progress : bool or callable
        As in `identify`.

    Returns
    -------
    Trace

    Raises
    ------
    OptionError, DataError, EstimationError
    """
    if not isinstance(record, Record):
        raise DataError(f"expected a hoid.Record, found {type(record).__name__}")
    options = _recursion(
        method,
        structure=structure,
        na=na,
        nb=nb,
        nc=nc,
        nd=nd,
        nf=nf,
        nk=nk,
        criterion=criterion,
        start=start,
        memory=memory,
        forgetting_factor=forgetting_factor,
        memory_of=memory_of,
        forgetting=forgetting,
        drift=drift,
        rate=rate,
        covariance=covariance,
        pseudo_linear=pseudo_linear,
        stable=stable,
        bound=bound,
        track_delay=track_delay,
        window=window,
        refit=refit,
        limit=limit,
        alarm=alarm,
        largest=largest,
    )
    if start_span is not None and isinstance(start, Mapping):
        raise OptionError("start_span is the span of the start fit, and start gives the start itself; drop one")
    end = record.start_time + len(record) * record.sample_time
    if update_from is not None and not update_from < end:
        raise OptionError(f"update_from is {update_from}: the record ends at {end:.4f} s; give a time before")
    if every < 1:
        raise OptionError(f"every is {every}, expected 1 or more")
    rows = None
    if moving_average is not None:
        if not 0 <= moving_average <= len(record) * record.sample_time:
            raise OptionError(f"moving_average is {moving_average}, expected a length in s up to that of the record")
        # Half away from zero, as the command line rounds.
        rows = max(int(np.floor(moving_average / (every * record.sample_time) + 0.5)), 1)
    native = _hoid.track(
        record,
        options,
        start_span=_options.span("start_span", start_span),
        update_from=update_from,
        moving_average=rows,
        every=int(every),
        progress=_options.reporter(progress, "candidates"),
    )
    return Trace(native, record)


class Tracker(_hoid.Tracker):
    """A recursive estimate that takes one sample at a time. It can be pickled, and goes on with the same digits.

    Without a start it collects `warm_up` seconds, fits them, and goes on from there; until then `ready` is False.

    Parameters
    ----------
    method, structure, ...
        As in `track`.
    sample_time : float, default 0.01
        Ts in s.
    warm_up : float, default 20
        Seconds that are collected before the start fit.
    record : Record, optional
        A record to start from, in place of the warm-up: its fit is the start, and the filters have seen it.

    Examples
    --------
    >>> tracker = hoid.Tracker("rpem", nk=29, nd=1, sample_time=0.01)
    >>> for e, u in samples:
    ...     innovation = tracker.step(e, u)
    """

    _options: dict[str, Any]

    def __new__(
        cls,
        method: str = "physical",
        *,
        sample_time: float = 0.01,
        warm_up: float = 20.0,
        record: Record | None = None,
        structure: str | None = None,
        na: Order | None = None,
        nb: Order | None = None,
        nc: Order | None = None,
        nd: Order | None = None,
        nf: Order | None = None,
        nk: Order | None = None,
        criterion: str = "bic",
        start: Mapping[str, float] | str | None = None,
        memory: Memory | None = None,
        forgetting_factor: float | None = None,
        memory_of: Mapping[str, Memory] | None = None,
        forgetting: str = "exponential",
        drift: Mapping[str, float] | None = None,
        rate: float | None = None,
        covariance: float | None = None,
        pseudo_linear: bool = False,
        stable: str = "predictor",
        bound: Mapping[str, tuple[float | None, float | None]] | None = None,
        track_delay: tuple[float, float] | None = None,
        window: Memory | None = None,
        refit: int | None = None,
        limit: float | None = None,
        alarm: float | None = None,
        largest: float = 1e6,
    ) -> Tracker:
        """See the class."""
        options = _recursion(
            method,
            structure=structure,
            na=na,
            nb=nb,
            nc=nc,
            nd=nd,
            nf=nf,
            nk=nk,
            criterion=criterion,
            start=start,
            memory=memory,
            forgetting_factor=forgetting_factor,
            memory_of=memory_of,
            forgetting=forgetting,
            drift=drift,
            rate=rate,
            covariance=covariance,
            pseudo_linear=pseudo_linear,
            stable=stable,
            bound=bound,
            track_delay=track_delay,
            window=window,
            refit=refit,
            limit=limit,
            alarm=alarm,
            largest=largest,
        )
        samples = round(warm_up / sample_time) if sample_time > 0 else 0
        return cls._made(options, float(sample_time), samples, record)

    @classmethod
    def _made(cls, options: dict[str, Any], sample_time: float, warm_up: int, record: Record | None) -> Tracker:
        tracker: Tracker = super().__new__(cls, options, sample_time, max(warm_up, 0), record)
        tracker._options = options
        return tracker

    def update(self, e: Any, u: Any, f_t: Any = None, *, update: bool = True) -> FloatArray:
        """Take samples one after the other.

        Parameters
        ----------
        e, u : array_like, shape (N,)
        f_t : array_like, shape (N,), optional
            Forcing function, which ``"rriv"`` makes its instruments of.
        update : bool
            False lets the filters follow, and the estimate stays.

        Returns
        -------
        ndarray, shape (N,)
            Innovations; NaN at faults (values that are not finite or beyond `largest`) and during the warm-up.
        """
        reference = None if f_t is None else signal(f_t, "f_t")
        return self.take_all(signal(e, "e"), signal(u, "u"), reference, update)

    @property
    def estimates(self) -> dict[str, Estimate]:
        """Coefficients with their standard errors."""
        return {name: Estimate(*pair) for name, pair in self.parameters}

    @property
    def start_fit(self) -> Fit | None:
        """The batch fit that it started from; None when it was given a start, or came out of a pickle."""
        native = self.start
        return None if native is None else Fit(native, [])

    def operator_estimate(self) -> Operator | None:
        """The operator with standard errors; None where the structure has no meaning as one."""
        found = self.operator
        return None if found is None else Operator(found)

    def __reduce__(self) -> tuple[Any, ...]:
        return (_restored, (type(self), self._options, self.sample_time, *self.saved()))

    def __repr__(self) -> str:
        if not self.ready:
            return f"Tracker by {self.method}, {self.structure}: warming up, {self.counts['samples']} samples so far"
        rows = [[name, repr(estimate)] for name, estimate in self.estimates.items()]
        title = f"Tracker by {self.method}, {self.structure}: {self.counts['samples']} samples"
        return f"{title}\n{_text.plain_table(['parameter', 'estimate'], rows)}"


def _restored(
    kind: type[Tracker],
    options: dict[str, Any],
    sample_time: float,
    orders: dict[str, int] | None,
    numbers: FloatArray,
) -> Tracker:
    tracker = kind._made(options, sample_time, 1, None)
    tracker.restore(orders, numbers)
    return tracker
