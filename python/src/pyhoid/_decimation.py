"""Records at the rate at which they are used."""

from __future__ import annotations

from collections.abc import Sequence

from .record import Record

__all__ = ["said"]


def said(records: Sequence[Record]) -> str:
    """What was done to the rate of the records, as a line; empty if nothing was."""
    steps = [
        step.partition(":")[0] for one in records for step in one.steps if "decimated by" in step
    ]
    return "\n".join(dict.fromkeys(steps))
