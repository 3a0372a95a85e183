"""From recorded runs of a person to their operator: what `identify` does by default."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from os import PathLike, fspath
from pathlib import Path
from typing import TYPE_CHECKING, Any

from . import _options, _pyhoid
from ._pickling import Call
from .errors import FormatError, OptionError
from .operator_fit import OperatorFit
from .record import Record

if TYPE_CHECKING:
    from typing_extensions import TypedDict

    from ._literals import Faults, Form, InitialState, SearchMethod
    from ._options import Order, Progress

    class OperatorOptions(TypedDict, total=False):
        """The keywords of `identify` for the operator of a person."""

        form: Form | None
        neuromuscular: bool
        prior: Any
        excitation: str | None
        period: float | None
        controlled_element: str | tuple[Sequence[float], Sequence[float]] | None
        individual: Sequence[str]
        delay: float | tuple[float, float] | None
        nc: Order | None
        nd: Order | None
        run_to_run: float | None
        initial_state: InitialState
        search_method: SearchMethod
        max_iterations: int | None
        tolerance: float | None
        faults: Faults
        decimate: int | str
        progress: Progress


__all__ = ["operator_of", "prior_of"]

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


def operator_of(
    records: Sequence[Record], settings: Mapping[str, Any], criterion: str, progress: Progress
) -> OperatorFit:
    """The operator of a person, by the keywords of `identify`."""
    element = settings["controlled_element"]
    period, run_to_run, tolerance = (
        None if settings[name] is None else float(settings[name])
        for name in ("period", "run_to_run", "tolerance")
    )
    nc, nd = settings["nc"], settings["nd"]
    found = _pyhoid.identify_operator(
        records,
        form=settings["form"],
        neuromuscular=bool(settings["neuromuscular"]),
        prior=prior_of(settings["prior"]),
        excitation=settings["excitation"],
        period=period,
        controlled_element=None if element is None else _options.controlled_element(element),
        individual=list(settings["individual"]),
        delay=_options.delay(settings["delay"]),
        nc=_options.order("nc", 0 if nc is None else nc),
        nd=None if nd is None else _options.order("nd", nd),
        run_to_run=run_to_run,
        initial_state=settings["initial_state"],
        search_method=settings["search_method"],
        max_iterations=None if settings["max_iterations"] is None else int(settings["max_iterations"]),
        tolerance=tolerance,
        faults=settings["faults"],
        decimate=str(settings["decimate"]),
        criterion=criterion,
        progress=_options.reporter(progress, "fits"),
    )
    call = Call("identify", tuple(records), {"structure": "operator", **settings})
    return OperatorFit(found, records, dict(settings), call)
