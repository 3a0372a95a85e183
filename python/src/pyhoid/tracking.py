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

_ORDERS = ("na", "nb", "nc", "nd", "nf", "nk")


def _numbers(order: Order) -> list[int]:
    """Return an order of a model with two inputs as a list: one number for both, or one for each."""
    if isinstance(order, (tuple, list, range)):
        return [int(number) for number in order]
    return [int(order)]


def track(
    record: Record,
    method: RecursiveMethod = "adaptive",
    *,
    inputs: Sequence[str] | None = None,
    roles: Mapping[str, str] | None = None,
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

    Without options this is ``"adaptive"``, which estimates gains in a basis common to all people. It needs
    no start fit, gives its first estimate after one second, and is intended for recorded people. If the form
    and the delay of the operator are known, ``"multiple-model"`` is more precise.

    Parameters
    ----------
    record : Record
    method : str
        {methods}
    inputs : sequence of str, optional
        For ``"adaptive"``, ``"rls"`` and ``"rpem"``: the error and one further channel to which the person responds,
        such as ``["e", "r"]``. Each order is then one number for both inputs or a pair with one for each;
        ``"rls"`` and ``"rpem"`` require `nk`. The trace has the coefficients ``b0[r]``, ..., with ``"adaptive"``
        the parameters ``K_f[r]``, ``K_f_dot[r]`` and ``tau_f[r]``, and with `at` the columns
        ``gain_db[r]@2.5`` and ``phase_deg[r]@2.5``.
    roles : mapping of str to str, optional
        Role of the further input: ``{{"r": "feedforward"}}`` (the default), ``"motion"`` or ``"output"``; with
        ``"adaptive"`` also its preview in s, ``{{"r": "feedforward:0.25"}}``.
    structure : str, optional
        By default ``"arx"`` for ``"rls"``, otherwise ``"bj"``.
    na, nb, nc, nd, nf, nk : int or (int, int) or range, optional
        Orders; pairs are ranges that are searched on the start span (with two inputs: one number for each).
    delay : float or (float, float), optional
        Delay tau_e in s in place of `nk`, or the shortest and the longest delay of a search.
    criterion : str
        Criterion that selects among candidates.
    start : mapping of str to float, or "nothing", optional
        Start values of all coefficients; by default from a batch fit of the start span. ``"adaptive"``
        uses `prior` instead.
    largest : float
        Magnitude of e or u above which a sample counts as faulty.
    at : sequence of float
        Frequencies in rad/s at which the trace has columns for gain in dB and phase in deg
        (``gain_db@2.5``, ``phase_deg@2.5``), with standard errors.
    controlled_element : str or (sequence of float, sequence of float), optional
        Controlled element, such as ``"90/(s(s+6))"``, or numerator and denominator in descending powers
        of s: adds the columns ``crossover_rad_s`` and ``phase_margin_deg``, with standard errors.
    start_span : (float, float), optional
        Span of the start fit in s; by default the first third.
    update_from : float, optional
        Time in s after which the estimate is updated.
    validate : Record, optional
        A second run of the same person in the same task. The initial `covariance` is then selected from a
        grid, so that the trace explains as much as possible of the second run (VAF);
        ``trace.covariance_choice`` contains the table. For methods with `covariance`, which must then not
        be given.
    update_covariance : bool
        With `validate`: P is not selected at the start but reduced during the run, whenever the estimate
        explains less of the second run than half a second earlier.
    moving_average : float, optional
        Replace each estimate by the mean over this many seconds.
    every : int
        Store every n-th sample.
    decimate : "auto", "off" or int
        Track every n-th sample after a linear-phase low-pass filter. ``"auto"`` reduces rates above
        200 Hz by the factor whose new rate is nearest to 100 Hz, unless `nk` is given or the method counts
        samples (its memory or orders are those of a polynomial). ``trace.record`` is the decimated record.
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

    Tracking of a person with an earlier fit as the prior, and the measures of the closed loop:

    >>> fit = pyhoid.identify(earlier)
    >>> trace = pyhoid.track(record, at=(1, 2.5), controlled_element="90/(s(s+6))", prior=fit)
    >>> trace["phase_margin_deg"], trace["phase_margin_deg_se"]

    Tracking of a person who sees the target:

    >>> trace = pyhoid.track(record, "rpem", inputs=["e", "f_t"], nd=1, nk=(14, 1), at=[2])
    >>> trace["gain_db[f_t]@2"]
    """
    method = _recursion.current_name(method)
    shared = {
        name: value
        for name, value in locals().items()
        if name not in ("record", "progress", "settings", "validate", "update_covariance", "inputs", "roles")
    }
    if not isinstance(record, Record):
        raise DataError(f"expected a pyhoid.Record, found {type(record).__name__}")
    if validate is not None and not isinstance(validate, Record):
        raise DataError(f"validate: expected a pyhoid.Record, found {type(validate).__name__}")
    if update_covariance and validate is None:
        raise OptionError("update_covariance applies only with validate, a second run")
    further = _options.roles(record, inputs, roles) if inputs is not None or roles is not None else []
    if further:
        options = _recursion.native_arguments(shared | dict.fromkeys(_ORDERS), settings)
        options |= {
            "inputs": [record.input_name, *(role.partition("=")[0] for role in further)],
            "role": ",".join(further),
            "orders_of_inputs": ",".join(
                f"{name}={','.join(map(str, _numbers(shared[name])))}"
                for name in _ORDERS
                if shared[name] is not None
            ),
        }
    else:
        options = _recursion.native_arguments(shared, settings)
    native = _pyhoid.track(
        record,
        options,
        start_span=_options.span("start_span", start_span),
        update_from=update_from,
        moving_average=None if moving_average is None else float(moving_average),
        every=_options.whole("every", every, 1),
        decimate=str(decimate),
        validate=validate,
        update_covariance=bool(update_covariance),
        progress=_options.reporter(progress, "candidates"),
    )
    by_run = {
        "validate": validate,
        "update_covariance": update_covariance,
        "inputs": inputs,
        "roles": roles,
    }
    call = Call("track", (record,), shared | settings | by_run)
    return Trace(native, record, shared | settings, call)


track.__doc__ = (track.__doc__ or "").format(methods=METHODS, settings=SETTINGS)
