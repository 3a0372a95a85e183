"""What a result is worth."""

from __future__ import annotations

from typing import NamedTuple

__all__ = ["Verdict"]


class Verdict(NamedTuple):
    """What a result is worth, and why.

    `level` is ``"trustworthy"``, ``"doubtful"`` or ``"not determined"``; `reasons` report what speaks
    against the result, `notes` additional notes.

    Examples
    --------
    >>> level, reasons, notes = fit.verdict
    """

    level: str
    reasons: list[str]
    notes: list[str]

    def __repr__(self) -> str:
        parts = [f"Verdict: {self.level}", *(f"- {reason}" for reason in self.reasons)]
        parts.extend(f"  (note: {note})" for note in self.notes)
        return "\n".join(parts)
