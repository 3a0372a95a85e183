"""Faults of recorded data, mended before a fit."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from . import _pyhoid
from .record import Record
from .verdict import Verdict

_LEVELS = ("trustworthy", "doubtful", "not determined")


def mended(
    records: Sequence[Record], handling: str
) -> tuple[tuple[Record, ...], list[dict[str, Any]], Verdict]:
    """Records without their faults, what was found, and what that says of a fit."""
    segments, found, says = _pyhoid.repair(records, handling)
    spoilt = {place for place, _ in found}
    # A record without faults stays the object that was given.
    kept = [Record._of(parts) if place in spoilt else records[place] for place, parts in segments]
    faults = [{"record": place, **fault} for place, fault in found]
    return tuple(kept), faults, Verdict(*says)


def joined(one: Verdict, other: Verdict) -> Verdict:
    """Both verdicts in one: the graver level, and all that speaks for it.

    What is wrong with a record stands before what follows from it, in the fit.
    """
    level = max(one.level, other.level, key=_LEVELS.index)
    return Verdict(level, [*one.reasons, *other.reasons], [*one.notes, *other.notes])
