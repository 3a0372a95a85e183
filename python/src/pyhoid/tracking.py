"""Recursive estimates over a record."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from . import _options, _pyhoid, _recursion
from ._options import Order, Progress
from ._recursion import Memory
from .errors import DataError, OptionError
from .record import Record
from .trace import Trace

__all__ = ["track"]


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
    smooth: bool = False,
    every: int = 1,
    progress: Progress = False,
) -> Trace:
    """Track a model and the operator's parameters over a record, sample by sample.

    Without options this is the physical recursion, started from a Box-Jenkins fit of the first
    third of the record.

    Parameters
    ----------
    record : Record
    method : {"physical", "rls", "rpem", "window", "rriv", "adaptive", "fused", "ekf", "ukf"}
        ``"physical"`` is a recursion in the operator's parameters, ``"rls"`` recursive least
        squares (arx, fir), ``"rpem"`` the recursive prediction error method (Ljung 1999, ch. 11),
        ``"window"`` batch fits of a sliding window, ``"rriv"`` the recursive refined instrumental
        variable (Young 2011). ``"adaptive"`` is a bank of hypotheses about when the person changed;
        it sets its memory itself and reports changes (`Trace.changes`). For comparison there are
        least squares with the poles of rpem (``"fused"``) and Kalman filters of state and
        parameters, extended (``"ekf"``) and unscented (``"ukf"``).
    structure : str, optional
        Default ``"arx"`` for ``"rls"``, otherwise ``"bj"``.
    na, nb, nc, nd, nf, nk : int or (int, int) or range, optional
        Orders; pairs are searched on the start span.
    criterion : str
        The criterion that chooses between candidates.
    start : mapping of str to float, or "nothing", optional
        All coefficients; default a batch fit of the start span.
    memory : float or str, optional
        Time in which the weight of a sample falls to 1/e: samples (``256``), seconds (``"2.56s"``)
        or ``"inf"``.
    forgetting_factor : float, optional
        lambda = 1 - 1/memory, instead of `memory`.
    memory_of : mapping, optional
        Memory of single parameters, or of all of one letter: ``{"b": 256, "K_e": "5s"}``.
    forgetting : {"exponential", "random-walk", "window", "variable", "directional", "gradient"}
    drift : mapping of str to float, optional
        For ``"random-walk"``: how much a parameter drifts in one second.
    rate : float, optional
        Step size for ``"gradient"``; default 0.1.
    covariance : float, optional
        P at the start, as a multiple of the unit matrix (0.1 in the reference text); default that
        of the start fit.
    pseudo_linear : bool
        Extended least squares instead of the gradient, for ``"rpem"``.
    stable : {"predictor", "noise"}
        Polynomials that are kept stable: C and F, or also D.
    bound : mapping, optional
        Bounds of physical parameters.
    track_delay : (float, float), optional
        Track tau_e too, within this range in s.
    window, refit
        For ``"window"``: its length (default ``"20s"``), and the samples between two fits (25).
    limit : float, optional
        Standard deviations beyond which an innovation moves the estimate no further.
    alarm : float, optional
        For ``"adaptive"``: logarithm of the odds at which a change is declared; default 6.
    largest : float
        Magnitude of e or u beyond which a sample is a fault.
    start_span : (float, float), optional
        Span of the start fit in s; default the first third.
    update_from : float, optional
        Time in s from which the estimate is updated.
    moving_average : float, optional
        Replace each estimate by the mean over this many seconds.
    smooth : bool
        For ``"adaptive"``: estimate each sample from all of the record, not only from its past.
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
    settings = {
        name: value for name, value in locals().items() if name not in ("record", "progress")
    }
    if not isinstance(record, Record):
        raise DataError(f"expected a pyhoid.Record, found {type(record).__name__}")
    options = _recursion.plain(settings) | {"smooth": bool(smooth)}
    if smooth and options["method"] != "adaptive":
        raise OptionError('smooth belongs to method="adaptive"')
    if start_span is not None and isinstance(start, Mapping):
        raise OptionError(
            "start_span is the span of the start fit, but start gives the start itself; drop one"
        )
    end = record.start_time + len(record) * record.sample_time
    if update_from is not None and not update_from < end:
        raise OptionError(
            f"update_from is {update_from}: the record ends at {end:.4f} s; give an earlier time"
        )
    if every < 1:
        raise OptionError(f"every is {every}, expected 1 or more")
    rows = None
    if moving_average is not None:
        if not 0 <= moving_average <= len(record) * record.sample_time:
            raise OptionError(
                f"moving_average is {moving_average},"
                " expected a length in s up to that of the record"
            )
        # Halves are rounded away from zero, as the command line does.
        rows = max(int(np.floor(moving_average / (every * record.sample_time) + 0.5)), 1)
    native = _pyhoid.track(
        record,
        options,
        start_span=_options.span("start_span", start_span),
        update_from=update_from,
        moving_average=rows,
        every=int(every),
        progress=_options.reporter(progress, "candidates"),
    )
    return Trace(native, record, settings)
