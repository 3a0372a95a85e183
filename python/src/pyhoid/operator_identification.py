"""From recorded runs of a person to their operator."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from os import PathLike, fspath
from pathlib import Path
from typing import TYPE_CHECKING, Any

from . import _faults, _options, _pyhoid
from ._decimation import decimated
from ._options import Order
from ._pickling import Call
from .errors import FormatError, OptionError
from .operator_fit import OperatorFit
from .record import Record

if TYPE_CHECKING:
    from ._literals import Faults, Form, InitialState, SearchMethod

__all__ = ["identify_operator"]

_Entries = list[tuple[str, float, float, str]]
#: Name, value, standard error, whether it is determined of each parameter of a fit; its source.
_OfFit = tuple[list[tuple[str, float | None, float | None, bool]], str]


def _of_file(path: str) -> _OfFit:
    """The prior of a file that `hoid identify --json` has written."""
    try:
        found = json.loads(Path(path).read_text(encoding="utf-8"))
        rows = [
            (p["name"], p["value"], p["standard_error"], bool(p["determined"]))
            for p in found["parameters"]
        ]
    except FileNotFoundError:
        raise OptionError(f"prior {path}: there is no such file") from None
    except (ValueError, KeyError, TypeError) as error:
        raise FormatError(
            f"prior {path}: {error!r}; give the output of `hoid identify --json`"
        ) from None
    return rows, path


def prior_of(prior: Any) -> str | _Entries | _OfFit:
    """A prior in the plain form that the native module takes."""
    if prior is None:
        return "none"
    if isinstance(prior, OperatorFit):
        rows: list[tuple[str, float | None, float | None, bool]] = [
            (name, p.value, p.standard_error, p.determined) for name, p in prior.parameters.items()
        ]
        return rows, "an earlier fit"
    if isinstance(prior, Mapping):
        try:
            return [
                (str(name), float(centre), float(spread), "given by the user")
                for name, (centre, spread) in prior.items()
            ]
        except (TypeError, ValueError):
            raise OptionError(
                f"prior is {prior!r}, expected (centre, spread) by name, "
                'such as {"omega_nm": (10.5, 0.3)}'
            ) from None
    if isinstance(prior, (str, PathLike)):
        path = fspath(prior)
        if not isinstance(prior, str) or path.lower().endswith(".json"):
            return _of_file(path)
        return prior
    raise OptionError(
        f'prior is {prior!r}, expected "population", "none", text such as "omega_nm=10.5:0.3", '
        "(centre, spread) by name, a JSON result, or an OperatorFit"
    )


def identify_operator(
    records: Record | Sequence[Record],
    *,
    form: Form = "auto",
    neuromuscular: bool = True,
    prior: str
    | PathLike[str]
    | Mapping[str, tuple[float, float]]
    | OperatorFit
    | None = "population",
    excitation: str | None = None,
    period: float | None = None,
    controlled_element: str | tuple[Sequence[float], Sequence[float]] | None = None,
    individual: Sequence[str] = (),
    delay: tuple[float, float] | None = None,
    nc: Order = 0,
    nd: Order | None = None,
    run_to_run: float | None = None,
    initial_state: InitialState = "auto",
    search_method: SearchMethod = "auto",
    max_iterations: int = 100,
    tolerance: float = 1e-9,
    faults: Faults = "bridge",
    decimate: int | str = "auto",
) -> OperatorFit:
    """The operator of a recorded person: form, parameters with errors that hold, and a verdict.

    It is ``hoid identify`` without a structure: a family of operators with a rich noise model,
    fitted by prediction error and, where the excitation is periodic and recorded, at its lines
    too. The mean of e and u is taken out of each record.

    Parameters
    ----------
    records : Record or sequence of Record
        Runs of one person in one task.
    form : str
        ``"auto"``, the simplest form that the data do not refute, or one of ``"gain"``,
        ``"lead"``, ``"lead2"``, ``"lag"``, ``"lead-lag"``, ``"lead2-lag"``,
        ``"quadratic-integral"``, ``"lead-droop"``.
    neuromuscular : bool
        With neuromuscular dynamics omega_nm, zeta_nm.
    prior : str, path, mapping, OperatorFit or None
        What is known of the person before the data: ``"population"`` (published people),
        ``"none"``, text such as ``"omega_nm=10.5:0.3"``, ``{"omega_nm": (10.5, 0.3)}`` (centre,
        and standard deviation of the logarithm) of omega_nm, zeta_nm, tau_e, T_L, T_I, the JSON
        result of ``hoid identify --json``, or another fit.
    excitation : str, optional
        Channel of the recorded disturbance or target; by default the first of the usual names
        that has lines; ``"none"`` for no fit at lines.
    period : float, optional
        Its period in s; by default found from its lines.
    controlled_element : str or (array_like, array_like), optional
        As text, such as ``"90/(s(s+6))"``, or numerator and denominator by descending powers of s:
        adds crossover and phase margin.
    individual : sequence of str
        Parameters that each record has for itself.
    delay : (float, float), optional
        Shortest and longest tau_e in s; default 0.02 to 0.8.
    nc, nd : int or (int, int) or range
        Orders of the noise model, which Akaike's criterion chooses; nd by default from 0 to 24, or
        to 8 where nc is not 0.
    run_to_run : float, optional
        Variation of a person's gain from one run to the next, as a part of it; it stands in the
        errors of fewer than five records. Default 0.06.
    initial_state : {"auto", "zero", "estimate", "backcast"}
    search_method : {"auto", "gn", "lm", "grad"}
    max_iterations : int
    tolerance : float
        Relative decrease of the loss below which the search has converged.
    faults : {"bridge", "cut", "report", "keep"}
        What is done about faults of the records, as in `identify`.
    decimate : "auto", "off" or int
        Keep every n-th sample behind a linear-phase low-pass filter; ``"auto"``: above 200 Hz by the
        number that comes nearest to 100 Hz. ``fit.records`` are the decimated records, and their
        ``steps`` say what was done.

    Returns
    -------
    OperatorFit

    Raises
    ------
    OptionError
        For options without meaning (a `ValueError`).
    DataError
        For records that cannot give a result (a `ValueError`).
    EstimationError
        When no form could be fitted. A result that is doubtful is none: see `OperatorFit.verdict`.

    Examples
    --------
    >>> fit = pyhoid.identify_operator(runs, controlled_element="1/s")
    >>> fit.verdict.level, fit.form
    ('trustworthy', 'lead-lag')
    >>> fit.parameters["tau_e"].interval
    """
    settings = {name: value for name, value in locals().items() if name != "records"}
    several, of_faults, says = _faults.mended(_options.as_records(records), faults)
    several = decimated(several, decimate)
    element = None
    if controlled_element is not None:
        element = _options.controlled_element(controlled_element)
    found = _pyhoid.identify_operator(
        several,
        form=form,
        neuromuscular=bool(neuromuscular),
        prior=prior_of(prior),
        excitation=excitation,
        period=None if period is None else float(period),
        controlled_element=element,
        individual=list(individual),
        delay=_options.span("delay", delay),
        nc=_options.order("nc", nc),
        nd=None if nd is None else _options.order("nd", nd),
        run_to_run=None if run_to_run is None else float(run_to_run),
        initial_state=initial_state,
        search_method=search_method,
        max_iterations=int(max_iterations),
        tolerance=float(tolerance),
        second_opinion=faults != "keep",
    )
    again = settings | {"faults": "keep" if faults == "keep" else "report", "decimate": "off"}
    fit = OperatorFit(found, several, settings, Call("identify_operator", several, again))
    fit.faults, fit.verdict = of_faults, _faults.joined(says, fit.verdict)
    return fit
