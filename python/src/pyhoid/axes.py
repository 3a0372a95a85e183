"""Several axes of one recording: the operator of each, and the coupling between them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from . import _options, _pyhoid
from .identification import _texts
from .operator_fit import OperatorFit
from .record import Record

__all__ = ["Axis", "Coupling", "identify_axes"]

if TYPE_CHECKING:
    from typing_extensions import Unpack

    from ._literals import Faults
    from ._settings import BatchSettings


@dataclass(frozen=True)
class Coupling:
    """The test of whether the control of an axis responds to the error of another axis."""

    #: Channel of the error of the other axis.
    input: str
    #: p-value of the test against no response; None if it was not tested.
    p_value: float | None
    #: Whether a response was found.
    responds: bool
    #: Reason why there was no test; empty if there was one.
    reason: str


@dataclass(frozen=True)
class Axis:
    """The operator of an axis, and the couplings of its control to the other axes."""

    #: Channel of the error.
    input: str
    #: Channel of the control.
    output: str
    #: Channel of the excitation of this axis.
    excitation: str | None
    #: The operator.
    fit: OperatorFit
    #: The responses of the control to the errors of the other axes.
    couplings: tuple[Coupling, ...]


def identify_axes(
    records: Record | Sequence[Record],
    pairs: Sequence[Sequence[str]],
    *,
    faults: Faults = "bridge",
    decimate: int | str = "auto",
    **settings: Unpack[BatchSettings],
) -> list[Axis]:
    """Identify the operator of each axis of a person who controls several, and test their coupling.

    This is ``hoid identify --pair``, with the same digits.

    Parameters
    ----------
    records : Record or sequence of Record
        Records that contain the signals of all axes.
    pairs : sequence of (str, str) or (str, str, str)
        For each axis the channels of the error, the control and, for the test of the coupling, its
        own excitation: ``[("ex", "ux", "rx"), ("ey", "uy", "ry")]``.
    faults, decimate, **settings
        As in `identify`, for each axis.

    Returns
    -------
    list of Axis
        In the order of `pairs`.

    Raises
    ------
    OptionError
        For fewer than two axes, a channel that two axes share, and options of other structures.
    DataError
        For a channel that a record does not have.

    Examples
    --------
    >>> axes = pyhoid.identify_axes(flight, [("ex", "ux", "rx"), ("ey", "uy", "ry")])
    >>> axes[0].fit.parameters["tau_e"], axes[0].couplings[0].responds
    """
    several = _options.as_records(records)
    named = [tuple(pair) for pair in pairs]
    of_axes = [[record.with_signals(*pair[:2]) for record in several] for pair in named if len(pair) > 1]
    found = _pyhoid.identify_axes(
        of_axes,
        [",".join(pair) for pair in named],
        options=_texts(dict(settings)),
        faults=faults,
        decimate=str(decimate),
    )
    return [
        Axis(
            pair[0],
            pair[1],
            pair[2] if len(pair) > 2 else None,
            OperatorFit(native, tuple(own)),
            tuple(Coupling(*coupling) for coupling in couplings),
        )
        for (native, couplings), pair, own in zip(found, named, of_axes, strict=True)
    ]
