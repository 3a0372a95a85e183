"""Batch fits: from records to the operator of a person, or to a model of polynomials."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, Literal, overload

from . import _options, _pyhoid
from ._options import Order, Progress
from ._pickling import Call
from .errors import OptionError
from .fit import Fit
from .operator_fit import OperatorFit
from .operator_identification import operator_of, prior_of
from .record import Record
from .time_varying import TimeVaryingFit

__all__ = ["identify", "identify_operator"]


#: The keywords that each batch estimator takes, from the registry of the library.
_KEYWORDS = {
    "operator" if name == "family" else name: set(keywords)
    for name, _, keywords in _pyhoid.batch_estimators()
}
_KEYWORDS["operator"].add("controlled_element")
#: Estimators that are named as structures.
_MODELS = ("operator", "grey-box", "time-varying")
#: Other names of the operator of a person.
_OPERATOR = ("operator", "family", "grey-box")
#: What a model of polynomials alone has.
_OF_POLYNOMIALS = ("start", "fix", "bound", "coefficient_prior", "robust", "focus", "stable")
#: Parameters of the operator with a remnant of order m alone.
_OF_REMNANT = ("K_e_dot", "T_n")
#: The structure of a method that fits no other.
_OF_METHOD = {
    name: structures[0]
    for name, structures, _ in _pyhoid.batch_estimators()
    if name in _KEYWORDS and len(structures) == 1 and name not in _MODELS
}
#: The keywords of the operator of a person.
_OF_OPERATOR = (
    "form",
    "neuromuscular",
    "prior",
    "excitation",
    "period",
    "controlled_element",
    "individual",
    "delay",
    "nc",
    "nd",
    "run_to_run",
    "initial_state",
    "search_method",
    "max_iterations",
    "tolerance",
    "faults",
    "decimate",
)
#: What to give in place of a keyword.
_INSTEAD = {
    "nk": "; else give delay in s",
    "orders": "; a grey box has remnant_order",
}


def _model(structure: str | None, method: str, given: Mapping[str, object]) -> str:
    """What is to be fitted, as the command line tells it from the same options."""
    name = None if structure is None else structure.lower().replace("_", "-")
    if method in _OF_METHOD:
        own = _OF_METHOD[method]
        if name not in (None, own):
            raise OptionError(
                f'method="{method}" fits the structure {own}; drop structure, or use method="pem"'
            )
        return own
    if name is None:
        orders = ("na", "nb", "nf", "nk")
        if any(option in given for option in (*orders, *_OF_POLYNOMIALS)):
            return "bj"
    elif name not in _OPERATOR:
        return name
    individual = given.get("individual", ())
    of_remnant = isinstance(individual, tuple) and any(one in _OF_REMNANT for one in individual)
    return "grey-box" if "remnant_order" in given or of_remnant else "operator"


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
    from ._settings import Structure
    from .operator_identification import OperatorOptions

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
        delay: float | tuple[float, float] | None
        individual: Sequence[str]
        excitation: str | None
        period: float | None
        controlled_element: str | tuple[Sequence[float], Sequence[float]] | None
        run_to_run: float | None
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
        max_iterations: int | None
        tolerance: float | None
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
    structure: Structure,
    **options: Unpack[IdentifyOptions],
) -> Fit: ...
@overload
def identify(
    records: Record | Sequence[Record],
    structure: Literal["operator", "family"] | None = None,
    **options: Unpack[OperatorOptions],
) -> OperatorFit: ...
@overload
def identify(
    records: Record | Sequence[Record],
    structure: ModelStructure | None = None,
    **options: Unpack[IdentifyOptions],
) -> Any: ...
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
    prior: Any = ...,
    excitation: str | None = None,
    period: float | None = None,
    controlled_element: str | tuple[Sequence[float], Sequence[float]] | None = None,
    run_to_run: float | None = None,
    remnant_order: Order | None = None,
    delay: float | tuple[float, float] | None = None,
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
    max_iterations: int | None = None,
    tolerance: float | None = None,
    faults: Faults = "bridge",
    decimate: int | str = "auto",
    progress: Progress = False,
) -> OperatorFit | Fit | TimeVaryingFit:
    """Identify the operator of a person, or a model of polynomials, from one or several records.

    It is ``hoid identify`` with the same options, defaults and digits. Without a structure it is the
    operator of a person: a family of operators with a rich noise model, its form by evidence, fitted
    by prediction error and, where the excitation is periodic and recorded, at its lines too; with a
    verdict. The mean of e and u is taken out of each record.

    Parameters
    ----------
    records : Record or sequence of Record
        Several records share one model, each with its own initial states.
    structure : str, optional
        ``"operator"`` (also ``"grey-box"``, ``"family"``; with `remnant_order` a gain with a lead and
        its remnant of order m), ``"time-varying"`` (an operator whose gains change once), or
        polynomials: ``"arx"``, ``"armax"``, ``"oe"``, ``"bj"``, ``"fir"``, ``"ar"``, ``"ma"``,
        ``"arma"``, ``"ararx"``, ``"ararmax"``, ``"general"``. Default ``"operator"``; that of
        `method`; ``"bj"`` with options that polynomials alone have, as nk.
    na, nb, nc, nd, nf, nk : int or (int, int) or range, optional
        Orders, and the delay of b0 in samples. A pair is searched from the first to the second,
        both included. nb counts b0, b1, ... Those that are left out of ``"bj"`` are searched: nk from
        0.05 to 0.6 s, nd from 1 to 4. For ``"operator"`` nc and nd are those of the noise model,
        which Akaike's criterion chooses; nd by default from 0 to 24, or to 8 where nc is not 0.
    method : {"pem", "iv4", "sriv", "rivbj"}
        Prediction error method (Ljung 1999), or instrumental variables: iv4 for arx, sriv for oe,
        rivbj for bj (Young 2011).
    instruments : str, optional
        Channel for the instruments, or ``"simulated"``; default ``f_t`` if all records have it.
    form : str, optional
        Form of the operator: ``"auto"``, the simplest that the data do not refute, or ``"gain"``,
        ``"lead"``, ``"lead2"``, ``"lag"``, ``"lead-lag"``, ``"lead2-lag"``,
        ``"quadratic-integral"``, ``"lead-droop"``; for ``"time-varying"`` ``"lead"`` by default, and
        its numerator changes.
    neuromuscular : bool
        With neuromuscular dynamics omega_nm, zeta_nm.
    prior : str, path, mapping, OperatorFit or None
        What is known of the person before the data: ``"population"`` (published people; the default
        for ``"operator"``), None or ``"none"`` (the default for ``"time-varying"``), text such as
        ``"omega_nm=10.5:0.3"``, ``{"omega_nm": (10.5, 0.3)}`` (centre, and standard deviation of the
        logarithm) of omega_nm, zeta_nm, tau_e, T_L, T_I, the JSON result of ``hoid identify
        --json``, or another fit.
    excitation : str, optional
        Channel of the recorded disturbance or target, for ``"operator"``; by default the first of
        the usual names that has lines; ``"none"`` for no fit at lines.
    period : float, optional
        Its period in s; by default found from its lines.
    controlled_element : str or (array_like, array_like), optional
        As text, such as ``"90/(s(s+6))"``, or numerator and denominator by descending powers of s:
        adds crossover and phase margin to an operator, and to its verdict whether anybody could have
        held the loop.
    run_to_run : float, optional
        Variation of a person's gain from one run to the next, as a part of it; it stands in the
        errors of fewer than five records. Default 0.06.
    remnant_order : int or (int, int), optional
        Order m of the remnant of an operator with a gain and a lead; it makes the fit that one.
    delay : float or (float, float), optional
        Delay tau_e in s, or the shortest and the longest; of polynomials in place of `nk`. Default
        0.02 to 0.8 for ``"operator"``.
    individual : sequence of str
        Parameters with a value of their own for each record, for operators that do not change.
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
    max_iterations : int, optional
        Largest number of steps from each start; default 100, for ``"time-varying"`` 200.
    tolerance : float, optional
        Relative decrease of the loss below which the search has converged; default 1e-9 for
        ``"operator"``, 1e-10 for ``"time-varying"``, 1e-12 for others.
    faults : {"bridge", "cut", "report", "keep"}
        What is done about faults of the records (spikes, dropouts, frozen and idle stretches):
        bridge what lasts up to 0.1 s and cut at what is longer, cut all, report only, or look for
        none. What was found is ``fit.faults``. Of recorded data a level of u is estimated too
        (``fit.levels``), and ``fit.records`` are without their means; keep leaves data as they are.
    decimate : "auto", "off" or int
        Keep every n-th sample behind a linear-phase low-pass filter. ``"auto"``: above 200 Hz by the
        number that comes nearest to 100 Hz for operators; polynomial structures, whose orders and
        delay count samples, take all samples unless a number is given.
        ``fit.records`` are the decimated records.
    progress : bool or callable
        True shows on standard error how far a search is; a callable gets the number of
        candidates done and the number of all.

    Returns
    -------
    OperatorFit, Fit or TimeVaryingFit
        The operator of a person, polynomials, gains that change. A result that is doubtful is no
        error: see its `verdict`.

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
    >>> fit = pyhoid.identify(runs, controlled_element="1/s")
    >>> fit.verdict.level, fit.form
    ('trustworthy', 'lead-lag')
    >>> fit.parameters["tau_e"].interval
    >>> fit = pyhoid.identify(record, "bj", nb=2, nd=1, nf=2, nk=29)
    >>> fit.operator.K_e
    0.0920 ± 0.0023
    """
    settings = {
        name: value for name, value in locals().items() if name not in ("records", "progress")
    }
    orders = {
        order: _options.order(order, value)
        for order, value in (("na", na), ("nb", nb), ("nc", nc), ("nd", nd), ("nf", nf), ("nk", nk))
        if value is not None
    }
    usual = {
        "instruments": (instruments, None),
        "form": (form, None),
        "neuromuscular": (neuromuscular, True),
        "prior": (prior, ...),
        "excitation": (excitation, None),
        "period": (period, None),
        "controlled_element": (controlled_element, None),
        "run_to_run": (run_to_run, None),
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
    given = {key: value for key, (value, default) in usual.items() if value is not default}
    given = {key: value for key, value in given.items() if value != usual[key][1]}
    name = _model(structure, method.lower(), {**given, **orders})
    settings["structure"] = name
    # Nothing that is known beforehand is what all others have.
    if given.get("prior", ...) is None:
        del given["prior"]
    _check(name, method.lower(), {**given, **orders})
    if name == "operator":
        return _operator(_options.as_records(records), settings, progress)
    prior = None if prior is ... else prior
    settings["prior"] = prior
    several = tuple(_options.as_records(records))
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
        delay=_options.delay(delay),
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
        max_iterations=None if max_iterations is None else int(max_iterations),
        tolerance=None if tolerance is None else float(tolerance),
        faults=faults,
        decimate=str(decimate),
        progress=_options.reporter(progress, "candidates"),
    )
    call = Call("identify", several, settings)
    if isinstance(found, _pyhoid.TimeVaryingFit):
        return TimeVaryingFit(found, several, settings, call)
    return Fit(found, several, settings, call)


def _operator(
    records: Sequence[Record], settings: Mapping[str, Any], progress: Progress
) -> OperatorFit:
    """The operator of a person, with the defaults that it has of its own."""
    own = {name: settings[name] for name in _OF_OPERATOR}
    own["form"] = own["form"] or "auto"
    if own["prior"] is ...:
        own["prior"] = "population"
    return operator_of(records, own, settings["criterion"], progress)


def identify_operator(
    records: Record | Sequence[Record], **options: Unpack[OperatorOptions]
) -> OperatorFit:
    """The same as `identify` without a structure: the operator of a person.

    >>> pyhoid.identify_operator(runs, controlled_element="1/s")
    """
    found: OperatorFit = identify(records, "operator", **options)
    return found
