"""Recursive estimates over a record."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from . import _options, _pyhoid, _recursion
from ._options import Order, Progress
from ._settings import METHODS, SETTINGS
from ._pickling import Call
from .errors import DataError, OptionError
from .record import Record
from .trace import Trace

if TYPE_CHECKING:
    from typing_extensions import Unpack

    from ._literals import Criterion
    from ._settings import MethodSettings, RecursiveMethod, Structure

__all__ = ["track"]


def track(
    record: Record,
    method: RecursiveMethod = "adaptive",
    *,
    structure: Structure | None = None,
    na: Order | None = None,
    nb: Order | None = None,
    nc: Order | None = None,
    nd: Order | None = None,
    nf: Order | None = None,
    nk: Order | None = None,
    delay: float | tuple[float, float] | None = None,
    criterion: Criterion = "bic",
    start: Mapping[str, float] | str | None = None,
    largest: float = 1e6,
    at: Sequence[float] = (),
    controlled_element: str | tuple[Sequence[float], Sequence[float]] | None = None,
    start_span: tuple[float, float] | None = None,
    update_from: float | None = None,
    validate: Record | None = None,
    update_covariance: bool = False,
    moving_average: float | None = None,
    every: int = 1,
    decimate: int | str = "auto",
    progress: Progress = False,
    **settings: Unpack[MethodSettings],
) -> Trace:
    """Track a model and the operator's parameters over a record, sample by sample.

    Without options this is ``"adaptive"``: gains in a basis that people share. It needs no start
    fit, speaks from the second second on, and is made for recorded people. Where the form of the
    operator and its delay are known, ``"multiple-model"`` is more precise.

    Parameters
    ----------
    record : Record
    method : str
        {methods}
    structure : str, optional
        Default ``"arx"`` for ``"rls"``, otherwise ``"bj"``.
    na, nb, nc, nd, nf, nk : int or (int, int) or range, optional
        Orders; pairs are searched on the start span.
    delay : float or (float, float), optional
        Delay tau_e in s in place of `nk`, or the shortest and the longest that are searched.
    criterion : str
        The criterion that chooses between candidates.
    start : mapping of str to float, or "nothing", optional
        All coefficients; default a batch fit of the start span. ``"adaptive"`` has `prior` in
        its place.
    largest : float
        Magnitude of e or u beyond which a sample is a fault.
    at : sequence of float
        Frequencies in rad/s at which gain in dB and phase in degrees are columns of the trace
        (``gain_db@2.5``, ``phase_deg@2.5``), with standard errors.
    controlled_element : str or (sequence of float, sequence of float), optional
        What the person controls, as ``"90/(s(s+6))"`` or numerator and denominator by descending
        powers of s: adds the columns ``crossover_rad_s`` and ``phase_margin_deg``, with standard
        errors.
    start_span : (float, float), optional
        Span of the start fit in s; default the first third.
    update_from : float, optional
        Time in s from which the estimate is updated.
    validate : Record, optional
        A second run of the same person in the same task. `covariance` is then the one of a grid
        whose trace explains most of it (VAF); ``trace.covariance_choice`` has the table. For methods
        with `covariance`, which is not given then.
    update_covariance : bool
        With `validate`: P is not chosen at the start but made smaller in course, every half a
        second in which the estimate has come to explain less of the second run.
    moving_average : float, optional
        Replace each estimate by the mean over this many seconds.
    every : int
        Keep every n-th sample.
    decimate : "auto", "off" or int
        Track every n-th sample after a linear-phase low-pass filter; ``"auto"``: above 200 Hz by the
        number that comes nearest to 100 Hz, unless `nk` is given or the method counts samples (its
        memory or orders are those of a polynomial). ``trace.record`` is the decimated record.
    progress : bool or callable
        As in `identify`.
    **settings
        {settings}

    Returns
    -------
    Trace

    Raises
    ------
    OptionError, DataError, EstimationError

    Examples
    --------
    >>> trace = pyhoid.track(record, "rpem", nk=29, nd=1)
    >>> trace["T_L"]

    A person, from an earlier fit of them, with the loop that they closed:

    >>> fit = pyhoid.identify(earlier)
    >>> trace = pyhoid.track(record, at=(1, 2.5), controlled_element="90/(s(s+6))", prior=fit)
    >>> trace["phase_margin_deg"], trace["phase_margin_deg_se"]
    """
    method = _recursion.name_of_now(method)
    shared = {
        name: value
        for name, value in locals().items()
        if name not in ("record", "progress", "settings", "validate", "update_covariance")
    }
    if not isinstance(record, Record):
        raise DataError(f"expected a pyhoid.Record, found {type(record).__name__}")
    if validate is not None and not isinstance(validate, Record):
        raise DataError(f"validate: expected a pyhoid.Record, found {type(validate).__name__}")
    if update_covariance and validate is None:
        raise OptionError("update_covariance belongs to validate, a second run; give it too")
    options = _recursion.plain(shared, settings)
    if every < 1:
        raise OptionError(f"every is {every}, expected 1 or more")
    native = _pyhoid.track(
        record,
        options,
        start_span=_options.span("start_span", start_span),
        update_from=update_from,
        moving_average=None if moving_average is None else float(moving_average),
        every=int(every),
        decimate=str(decimate),
        validate=validate,
        update_covariance=bool(update_covariance),
        progress=_options.reporter(progress, "candidates"),
    )
    by_run = {"validate": validate, "update_covariance": update_covariance}
    call = Call("track", (record,), shared | settings | by_run)
    return Trace(native, record, shared | settings, call)


track.__doc__ = (track.__doc__ or "").format(methods=METHODS, settings=SETTINGS)
