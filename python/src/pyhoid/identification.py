"""Batch fits: from records to the operator of a person, or to a polynomial model.

The options of the estimators are not listed here: they come from the registry of the library, from which
`_settings.py` is generated, and the library parses their values.
"""

from __future__ import annotations

import json
import warnings
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, Literal, overload

from . import _options, _pyhoid
from ._options import Order, Progress
from ._prior import prior_text
from ._settings import BATCH_SETTINGS
from .comparison import Comparison
from .errors import OptionError
from .experiment import ExperimentDesign
from .fit import Fit
from .operator_fit import OperatorFit
from .record import Record
from .time_varying import TimeVaryingFit

__all__ = ["from_json", "identify", "identify_operator"]

#: Type of each keyword of the batch estimators, from the registry of the library.
_KINDS = {
    name: kind for *_, keywords in _pyhoid.batch_estimators() for name, kind in keywords.items()
}

if TYPE_CHECKING:
    from typing_extensions import Unpack

    from ._literals import BatchMethod, Faults, ModelStructure
    from ._settings import BatchSettings, Structure

    class IdentifyOptions(BatchSettings, total=False):
        """The keywords of `identify`."""

        na: Order | None
        nb: Order | None
        nc: Order | None
        nd: Order | None
        nf: Order | None
        method: BatchMethod
        faults: Faults
        decimate: int | str
        progress: Progress
        inputs: Sequence[str] | None
        roles: Mapping[str, str] | None


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
    **options: Unpack[IdentifyOptions],
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
    method: BatchMethod = "pem",
    faults: Faults = "bridge",
    decimate: int | str = "auto",
    progress: Progress = False,
    inputs: Sequence[str] | None = None,
    roles: Mapping[str, str] | None = None,
    **settings: Unpack[BatchSettings],
) -> OperatorFit | Fit | TimeVaryingFit:
    """Identify the operator of a person, or a polynomial model, from one or several records.

    This is ``hoid identify`` with the same options, defaults and digits. Without a structure it identifies
    the operator of a person: a family of operators with a flexible noise model is fitted by the prediction
    error method and, if the excitation is periodic and recorded, also at its lines. The form is selected by
    evidence, and the result has a verdict. The mean of e and u is removed from each record.

    Parameters
    ----------
    records : Record or sequence of Record
        Several records share one model, each with its own initial states.
    structure : str, optional
        ``"operator"`` (the default), or polynomials: ``"arx"``, ``"armax"``, ``"oe"``, ``"bj"``, ``"fir"``,
        ``"ar"``, ``"ma"``, ``"arma"``, ``"ararx"``, ``"ararmax"``, ``"general"``. The default is that of
        `method`, or ``"bj"`` with options that only polynomials have, such as nk. ``"grey-box"`` and
        ``"family"`` are other names for ``"operator"``; ``"time-varying"`` is ``"operator"`` with
        ``change="sigmoid"``.
    na, nb, nc, nd, nf : int or (int, int) or range, optional
        Orders. A pair is a range to be searched, both ends included. nb counts b0, b1, ...
        Orders of ``"bj"`` that are omitted are searched: nk from 0.05 to 0.6 s, nd from 1 to 4. For
        ``"operator"``, nc and nd are the orders of the noise model, selected by Akaike's criterion; the
        default range of nd is 0 to 0.5 s (at least 24), or 0 to 8 if nc is not 0.
    method : {{"pem", "iv4", "sriv", "rivbj"}}
        Prediction error method (Ljung 1999), or instrumental variables: iv4 for arx, sriv for oe,
        rivbj for bj (Young 2011).
    faults : {{"bridge", "cut", "report", "keep"}}
        Treatment of faults in the records (spikes, dropouts, frozen and idle stretches): ``"bridge"``
        bridges faults of up to 0.1 s and cuts the record at longer ones; ``"cut"`` cuts it at all faults;
        ``"report"`` only reports them; ``"keep"`` does not search for faults. The faults found are in
        ``fit.faults``. For recorded data, the constant of u is also estimated (``fit.levels``), and
        ``fit.records`` have their means removed; with ``"keep"`` the data are unchanged.
    decimate : "auto", "off" or int
        Keep every n-th sample after a linear-phase low-pass filter. For operators, ``"auto"`` reduces
        rates above 200 Hz by the factor whose new rate is nearest to 100 Hz. Polynomial structures,
        whose orders and delay count samples, use all samples unless a number is given.
        ``fit.records`` are the decimated records.
    progress : bool or callable
        True shows the progress of a search on standard error; a callable receives the number of
        completed candidates and the number of all candidates.
    inputs : sequence of str, optional
        Signals that the person perceives, for ``"operator"``: the error first, then channels of the
        records, such as ``["e", "r"]``. All responses are fitted jointly: ``fit.channels``.
    roles : dict of str to str, optional
        Role of each further input: ``"feedforward"`` (the default; ``"feedforward:0.5"`` if 0.5 s of its
        future are displayed), ``"motion"`` or ``"output"``; ``"feedforward/derivative"`` fits only one form.
    **settings
        {settings}

    Returns
    -------
    OperatorFit, Fit or TimeVaryingFit
        The operator of a person, polynomials, or an operator with changing gains. A doubtful result is
        not an error: see its `verdict`.

    Raises
    ------
    OptionError
        For options that are out of range or inconsistent with each other (a `ValueError`).
    DataError
        For records that cannot give a result (a `ValueError`).
    EstimationError
        If there is no result, for example because of singular regressors.

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
    orders = [
        f"{name}={_options.text(name, _options.order(name, value))}"
        for name, value in (("na", na), ("nb", nb), ("nc", nc), ("nd", nd), ("nf", nf))
        if value is not None
    ]
    several = tuple(_options.as_records(records))
    given: dict[str, Any] = dict(settings)
    if inputs is not None or roles is not None:
        given["role"] = [*given.get("role", ()), *_options.roles(several[0], inputs, roles)]
    found, notes = _pyhoid.identify(
        several,
        structure=structure,
        method=method,
        options=_texts(given) | ({"orders": ",".join(orders)} if orders else {}),
        faults=faults,
        decimate=str(decimate),
        progress=_options.reporter(progress, "candidates"),
    )
    for note in notes:
        warnings.warn(note, DeprecationWarning, stacklevel=2)
    return _result(found, several)


identify.__doc__ = (identify.__doc__ or "").format(settings=BATCH_SETTINGS)


def from_json(text: str) -> OperatorFit | Fit | TimeVaryingFit | Comparison | ExperimentDesign:
    """Restore a result that its `to_json` wrote or ``hoid identify --json`` printed.

    The results of ``hoid compare --json`` and ``hoid design --json`` are restored, too.

    The restored result is equal to the written one, and gives the same predictions, simulations and
    validations. It does not contain the samples of its records. The JSON of a trace, a description
    or a group does not contain the whole result, so it is refused.

    Parameters
    ----------
    text : str
        JSON text of the result.

    Raises
    ------
    DataError
        For a text that is not a result, was changed, or comes from another version.

    Examples
    --------
    >>> from pathlib import Path
    >>> fit = pyhoid.from_json(Path("person.json").read_text())
    """
    saved = _object(text)
    if saved.get("kind") == "comparison":
        return Comparison.from_json(text)
    if saved.get("kind") == "design":
        return ExperimentDesign.from_json(text)
    records = saved.get("records")
    units = [record.get("units", {}) for record in records] if isinstance(records, list) else []
    first = units[0] if units else {}
    return _result(_pyhoid.from_json(text), (), (first.get("input", ""), first.get("output", "")))


def _object(text: str) -> dict[str, Any]:
    """Return the object of a JSON text, without a check of its content."""
    try:
        found = json.loads(text)
    except (ValueError, TypeError):
        return {}
    return found if isinstance(found, dict) else {}


def _result(
    native: Any, records: Sequence[Record], units: tuple[str, str] | None = None
) -> OperatorFit | Fit | TimeVaryingFit:
    if isinstance(native, _pyhoid.TimeVaryingFit):
        return TimeVaryingFit(native, records, units=units)
    if isinstance(native, _pyhoid.OperatorFit):
        return OperatorFit(native, records, units=units)
    return Fit(native, records, units=units)


def identify_operator(
    records: Record | Sequence[Record], **options: Unpack[IdentifyOptions]
) -> OperatorFit:
    """Identify the operator of a person, as `identify` does without a structure.

    >>> pyhoid.identify_operator(runs, controlled_element="1/s")
    """
    found: OperatorFit = identify(records, "operator", **options)
    return found


def _texts(settings: Mapping[str, Any]) -> dict[str, str]:
    """Return options as texts in the form that the library reads, without those that carry no information.

    >>> _texts({"nk": (20, 40), "individual": ("K", "T_L"), "stable": False, "neuromuscular": False})
    {'nk': '20..40', 'individual': 'K,T_L', 'neuromuscular': 'no'}
    """
    texts: dict[str, str] = {}
    for name, value in settings.items():
        if name not in _KINDS or name == "orders":
            raise TypeError(f"identify() got an unexpected keyword argument {name!r}")
        text = _text(name, _KINDS[name], value)
        if text is not None:
            texts[name] = text
    return texts


def _text(name: str, kind: str, value: Any) -> str | None:
    if kind == "prior":
        return prior_text(value)
    if value is None or (kind == "flag" and not value):
        return None
    if kind == "choice" and isinstance(value, bool):
        return "yes" if value else "no"
    if kind == "counts" and not isinstance(value, str):
        low, high = _options.order(name, value)
        return str(low) if low == high else f"{low}..{high}"
    if kind == "names":
        names = [value] if isinstance(value, str) else value
        return ",".join(str(one) for one in names) or None
    if kind == "element":
        element = _options.controlled_element(value)
        return element if isinstance(element, str) else "/".join(map(_row, element))
    if kind == "guesses":
        return _options.guesses(name, value)
    return _options.text(name, value)


def _row(coefficients: Sequence[float]) -> str:
    return ",".join(repr(float(v)) for v in coefficients)
