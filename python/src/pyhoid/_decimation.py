"""Records at the sampling frequency at which they are used."""

from __future__ import annotations

from collections.abc import Sequence

from .record import Record

__all__ = ["rate_note"]


def rate_note(records: Sequence[Record]) -> str:
    """Describe in one line how the rate of the records was reduced; empty if it was kept."""
    steps = [
        step.partition(":")[0] for one in records for step in one.steps if "decimated by" in step
    ]
    return "\n".join(dict.fromkeys(steps))
