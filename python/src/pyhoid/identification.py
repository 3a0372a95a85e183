"""Batch fits: from records to a model and the operator's parameters."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, Literal, overload

from . import _faults, _options, _pyhoid
from ._decimation import decimated
from ._options import Order, Progress
from ._pickling import Call
from .errors import OptionError
from .fit import Fit
from .operator_identification import prior_of
from .record import Record
from .time_varying import TimeVaryingFit

__all__ = ["identify"]


#: The keywords that each batch estimator takes, from the registry of the library.
#: The operator of a person has a function of its own, `identify_operator`.
_KEYWORDS = {
    name: set(keywords) for name, _, keywords in _pyhoid.batch_estimators() if name != "family"
}
#: Estimators that are named as structures.
_MODELS = ("grey-box", "time-varying")
#: The structure of a method that fits no other.
_OF_METHOD = {
    name: structures[0]
    for name, structures, _ in _pyhoid.batch_estimators()
    if name in _KEYWORDS and len(structures) == 1 and name not in _MODELS
}
#: What to give in place of a keyword.
_INSTEAD = {
    "delay": "; else give nk",
    "nk": "; else give delay in s",
    "orders": "; a grey box has remnant_order",
}


def _check(structure: str, method: str, given: Mapping[str, object]) -> None:
    """Refuse a keyword that belongs to another estimator."""
    own = _KEYWORDS.get(structure) or _KEYWORDS.get(method)
    if own is None:
        # The native module names the methods that there are.
        return
    for name in given:
        option = "orders" if name in ("na", "nb", "nc", "nd", "nf") else name
        of = [estimator for estimator, keywords in _KEYWORDS.items() if option in keywords]
        if of and option not in own:
            names = ", ".join(
                f'structure="{one}"' if one in _MODELS else f'method="{one}"' for one in of
            )
            raise OptionError(f"{name} belongs to {names}{_INSTEAD.get(option, '')}")


if TYPE_CHECKING:
    from typing_extensions import TypedDict, Unpack

    from ._literals import (
        BatchMethod,
        Criterion,
        Faults,
        Focus,
        Form,
        InitialState,
        ModelStructure,
        SearchMethod,
    )

    class IdentifyOptions(TypedDict, total=False):
        """The keywords of `identify`."""

        na: Order | None
        nb: Order | None
        nc: Order | None
        nd: Order | None
        nf: Order | None
        nk: Order | None
        method: BatchMethod
        instruments: str | None
        form: Form | None
        neuromuscular: bool
        prior: Any
        remnant_order: Order | None
        delay: tuple[float, float] | None
        individual: Sequence[str]
        criterion: Criterion
        initial_state: InitialState
        start: Mapping[str, float] | None
        fix: Mapping[str, float] | None
        bound: Mapping[str, tuple[float | None, float | None]] | None
        coefficient_prior: Mapping[str, tuple[float, float]] | None
        robust: float | bool | None
        focus: Focus
        stable: bool
        search_method: SearchMethod
        max_iterations: int
        tolerance: float
        faults: Faults
        decimate: int | str
        progress: Progress


@overload
def identify(
    records: Record | Sequence[Record],
    structure: Literal["time-varying", "time_varying"],
    **options: Unpack[IdentifyOptions],
) -> TimeVaryingFit: ...
@overload
def identify(
    records: Record | Sequence[Record],
    structure: ModelStructure | None = None,
    **options: Unpack[IdentifyOptions],
) -> Fit: ...
def identify(
    records: Record | Sequence[Record],
    structure: ModelStructure | Literal["time-varying", "time_varying"] | None = None,
    *,
    na: Order | None = None,
    nb: Order | None = None,
    nc: Order | None = None,
    nd: Order | None = None,
    nf: Order | None = None,
    nk: Order | None = None,
    method: BatchMethod = "pem",
    instruments: str | None = None,
    form: Form | None = None,
    neuromuscular: bool = True,
    prior: Any = None,
    remnant_order: Order | None = None,
    delay: tuple[float, float] | None = None,
    individual: Sequence[str] = (),
    criterion: Criterion = "bic",
    initial_state: InitialState = "auto",
    start: Mapping[str, float] | None = None,
    fix: Mapping[str, float] | None = None,
    bound: Mapping[str, tuple[float | None, float | None]] | None = None,
    coefficient_prior: Mapping[str, tuple[float, float]] | None = None,
    robust: float | bool | None = None,
    focus: Focus = "prediction",
    stable: bool = False,
    search_method: SearchMethod = "auto",
    max_iterations: int = 100,
    tolerance: float = 1e-12,
    faults: Faults = "bridge",
    decimate: int | str = "auto",
    progress: Progress = False,
) -> Fit | TimeVaryingFit:
    """Identify a model and the operator's parameters from one or several records.

    Without options this fits a Box-Jenkins model of the operator, and searches the delay from 0.05
    to 0.6 s and nd from 1 to 4.

    Parameters
    ----------
    records : Record or sequence of Record
        Several records share one model, each with its own initial states.
    structure : str, optional
        ``"arx"``, ``"armax"``, ``"oe"``, ``"bj"``, ``"fir"``, ``"ar"``, ``"ma"``, ``"arma"``,
        ``"ararx"``, ``"ararmax"``, ``"general"``, ``"grey-box"`` (operator and remnant in physical
        parameters, with a real delay) or ``"time-varying"`` (gains that change once).
        Default ``"bj"``, or that of `method`.
    na, nb, nc, nd, nf, nk : int or (int, int) or range, optional
        Orders, and the delay of b0 in samples. A pair is searched from the first to the second,
        both included. nb counts b0, b1, ...
    method : {"pem", "iv4", "sriv", "rivbj"}
        Prediction error method (Ljung 1999), or instrumental variables: iv4 for arx, sriv for oe,
        rivbj for bj (Young 2011).
    instruments : str, optional
        Channel for the instruments, or ``"simulated"``; default ``f_t`` if all records have it.
    form : str, optional
        Form of the operator for ``"time-varying"``: ``"gain"``, ``"lead"``, ``"lead2"``,
        ``"lag"``, ``"lead-lag"``, ``"lead2-lag"``, ``"quadratic-integral"``, ``"lead-droop"``;
        default ``"lead"``. Its numerator changes; lag, neuromuscular part and delay stay. Models
        that do not change: `identify_operator`.
    neuromuscular : bool
        With omega_nm and zeta_nm, for ``"time-varying"``.
    prior : str, path, mapping, OperatorFit or None
        What is known of the person before the data, for ``"time-varying"``, as for
        `identify_operator`; default nothing.
    remnant_order : int or (int, int), optional
        Order m of the remnant for ``"grey-box"``; default 1 to 4.
    delay : (float, float), optional
        Shortest and longest tau_e in s for ``"grey-box"`` and ``"time-varying"``.
    individual : sequence of str
        Parameters with a value of their own for each record, for ``"grey-box"``.
    criterion : {"bic", "aic", "aicc", "fpe", "mdl", "yic", "loss"}
        The criterion that chooses between candidates.
    initial_state : {"auto", "zero", "estimate", "backcast"}
    start : mapping of str to float, optional
        Where the search starts: all coefficients.
    fix : mapping of str to float, optional
        Coefficients that are held fixed.
    bound : mapping of str to (float or None, float or None), optional
        Lower and upper bounds; None leaves an end open.
    coefficient_prior : mapping of str to (float, float), optional
        Guesses of coefficients, each with a weight W: the loss grows by W (theta - guess)^2.
    robust : float or True, optional
        Huber's loss: residuals beyond this many standard deviations count linearly; True is 1.345.
    focus : {"prediction", "simulation"}
        What the model is fitted for.
    stable : bool
        Accept only models that are stable from e to u.
    search_method : {"auto", "gn", "lm", "grad"}
    max_iterations : int
    tolerance : float
        Relative decrease of the loss below which the search has converged.
    faults : {"bridge", "cut", "report", "keep"}
        What is done about faults of the records (spikes, dropouts, frozen and idle stretches):
        bridge what lasts up to 0.1 s and cut at what is longer, cut all, report only, or look for
        none. What was found is ``fit.faults``. Of recorded data a level of u is estimated too
        (``fit.levels``), and ``fit.records`` are without their means; keep leaves data as they are.
    decimate : "auto", "off" or int
        Keep every n-th sample behind a linear-phase low-pass filter. ``"auto"``: above 200 Hz by the
        number that comes nearest to 100 Hz for ``"grey-box"`` and ``"time-varying"``; polynomial
        structures, whose orders and delay count samples, take all samples unless a number is given.
        ``fit.records`` are the decimated records.
    progress : bool or callable
        True shows on standard error how far a search is; a callable gets the number of
        candidates done and the number of all.

    Returns
    -------
    Fit or TimeVaryingFit

    Raises
    ------
    OptionError
        For options that are out of range or do not fit each other (a `ValueError`).
    DataError
        For records that cannot give a result (a `ValueError`).
    EstimationError
        When there is no result, for example with singular regressors.

    Examples
    --------
    >>> fit = pyhoid.identify(record, "bj", nb=2, nd=1, nf=2, nk=29)
    >>> fit.operator.K_e
    0.0920 ± 0.0023
    """
    settings = {
        name: value for name, value in locals().items() if name not in ("records", "progress")
    }
    own = _OF_METHOD.get(method.lower(), "bj")
    name = (structure or own).lower().replace("_", "-")
    if structure is not None and method.lower() in _OF_METHOD and name != own:
        raise OptionError(
            f'method="{method}" fits the structure {own}; drop structure, or use method="pem"'
        )
    orders = {
        order: _options.order(order, value)
        for order, value in (("na", na), ("nb", nb), ("nc", nc), ("nd", nd), ("nf", nf), ("nk", nk))
        if value is not None
    }
    usual = {
        "instruments": (instruments, None),
        "form": (form, None),
        "neuromuscular": (neuromuscular, True),
        "prior": (prior, None),
        "remnant_order": (remnant_order, None),
        "delay": (delay, None),
        "individual": (tuple(individual), ()),
        "initial_state": (initial_state, "auto"),
        "search_method": (search_method, "auto"),
        "start": (start, None),
        "fix": (fix, None),
        "bound": (bound, None),
        "coefficient_prior": (coefficient_prior, None),
        "robust": (robust, None),
        "stable": (stable, False),
        "focus": (focus, "prediction"),
    }
    given = {key: value for key, (value, default) in usual.items() if value != default}
    _check(name, method.lower(), {**given, **orders})
    several, of_faults, says = _faults.mended(_options.as_records(records), faults)
    several = decimated(several, decimate, counts_samples=name not in _MODELS)
    # A constant of u: out of the data of a constant model, an unknown of one that changes.
    as_read = several
    level = faults != "keep" and _pyhoid.may_have_level(as_read)
    without = _pyhoid.without_level(as_read, name) if level else None
    if without is not None:
        several = tuple(Record._of(parts) for parts in without)
    found = _pyhoid.identify(
        several,
        name,
        orders=orders,
        method=method,
        instruments=instruments,
        form=form,
        neuromuscular=bool(neuromuscular),
        prior=None if prior is None else prior_of(prior),
        remnant_order=None
        if remnant_order is None
        else _options.order("remnant_order", remnant_order),
        delay=_options.span("delay", delay),
        individual=list(individual),
        criterion=criterion,
        initial_state=initial_state,
        start=None if start is None else _options.numbers("start", start),
        fix=_options.numbers("fix", fix or {}),
        bound=_options.bounds(bound or {}),
        coefficient_prior={
            key: (float(value), float(weight))
            for key, (value, weight) in (coefficient_prior or {}).items()
        },
        robust=1.345
        if robust is True
        else (None if robust is None or robust is False else float(robust)),
        focus=focus,
        stable=stable,
        search_method=search_method,
        max_iterations=int(max_iterations),
        tolerance=float(tolerance),
        second_opinion=faults != "keep",
        level=level,
        progress=_options.reporter(progress, "candidates"),
    )
    # The records are mended already: what is looked for in them again is not taken out. Their level is
    # still in them: out of records without it a rest of rounding would be taken, and change the digits.
    again = settings | {"faults": "keep" if faults == "keep" else "report", "decimate": "off"}
    call = Call("identify", as_read, again)
    if isinstance(found, _pyhoid.TimeVaryingFit):
        change = TimeVaryingFit(found, several, settings, call)
        change.faults, change._of_faults = of_faults, says
        return change
    fit = Fit(found, several, settings, call)
    fit.faults, fit._of_faults = of_faults, says
    if without is not None:
        fit._as_read = as_read
    return fit
