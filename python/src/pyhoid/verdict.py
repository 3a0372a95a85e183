"""Reliability of a result."""

from __future__ import annotations

from typing import NamedTuple

__all__ = ["Verdict"]


class Verdict(NamedTuple):
    """Reliability of a result, with the reasons.

    `level` is ``"trustworthy"``, ``"doubtful"`` or ``"not determined"``; `reasons` contains the reasons
    against trusting the result, `notes` contains additional notes.

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
