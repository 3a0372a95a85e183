"""Records at the rate at which they are used."""

from __future__ import annotations

from collections.abc import Sequence

from . import _pyhoid
from .record import Record

__all__ = ["decimated", "said"]


def decimated(
    records: Sequence[Record], decimate: int | str, *, counts_samples: bool = False
) -> tuple[Record, ...]:
    """The records as an estimator takes them.

    What counts samples (polynomials, a delay nk) is decimated by a number alone.
    """
    if counts_samples and _pyhoid.decimation_is_auto(str(decimate)):
        return tuple(records)
    return tuple(record.decimated(decimate) for record in records)


def said(records: Sequence[Record]) -> str:
    """What was done to the rate of the records, as a line; empty where nothing was."""
    steps = [
        step.partition(":")[0] for one in records for step in one.steps if "decimated by" in step
    ]
    return "\n".join(dict.fromkeys(steps))
