"""Reliability of a result."""

from __future__ import annotations

import json
import warnings
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

__all__ = ["Reason", "Verdict"]


class Reason(str):
    """A finding about a result: its sentence, with `kind`, `severity`, and the span to which it refers.

    Attributes
    ----------
    kind : str
        Name for programs, which does not change between versions, such as ``"delay-at-bound"``.
    severity : {"note", "doubt", "undetermined"}
        Severity of the finding.
    start, stop : float or None
        Span of the record to which the finding refers, s; None if it refers to no span.

    Examples
    --------
    >>> [reason.kind for reason in fit.verdict.reasons]
    """

    kind: str
    severity: str
    start: float | None
    stop: float | None

    def __new__(
        cls,
        message: str,
        kind: str = "",
        severity: str = "",
        start: float | None = None,
        stop: float | None = None,
    ) -> Reason:
        reason = super().__new__(cls, message)
        reason.kind, reason.severity, reason.start, reason.stop = kind, severity, start, stop
        return reason

    @property
    def message(self) -> str:
        """The sentence as a plain text."""
        return str(self)

    @classmethod
    def _read(cls, found: dict[str, Any] | str, severity: str) -> Reason:
        if isinstance(found, str):  # a file of an earlier version
            return cls(found, severity=severity)
        keys = ("message", "kind", "severity", "from", "to")
        return cls(*(found.get(key) for key in keys))  # type: ignore[arg-type]


@dataclass(frozen=True, repr=False, eq=False)
class Verdict:
    """Reliability of a result, with the reasons.

    Attributes
    ----------
    level : {"trustworthy", "doubtful", "not determined"}
        Reliability of the result.
    reasons, notes : list of Reason
        Reasons against trusting the result, and additional notes. Each is a text with its ``kind``,
        ``severity``, ``start`` and ``stop``.
    of : dict of Verdict
        Verdict on each answer: ``"response"``, ``"crossover"``, ``"phase_margin"`` and each parameter.

    Examples
    --------
    >>> level, reasons, notes = fit.verdict
    >>> fit.verdict.of["tau_e"].level
    """

    level: str
    reasons: list[Reason]
    notes: list[Reason]
    of: dict[str, Verdict] = field(default_factory=dict)

    @classmethod
    def _read(cls, found: dict[str, Any] | str) -> Verdict:
        """Build the verdict from its JSON."""
        if isinstance(found, str):
            found = json.loads(found)
        assert isinstance(found, dict)
        return cls(
            found["level"],
            [Reason._read(one, "doubt") for one in found.get("reasons", [])],
            [Reason._read(one, "note") for one in found.get("notes", [])],
            {name: cls._read(answer) for name, answer in found.get("of", {}).items()},
        )

    def __iter__(self) -> Iterator[Any]:
        return iter((self.level, self.reasons, self.notes))

    def __eq__(self, other: object) -> bool:
        if isinstance(other, str):
            warnings.warn(
                "the verdict of a description is now an object: compare its level",
                DeprecationWarning,
                stacklevel=2,
            )
            return self.level == other
        if not isinstance(other, Verdict):
            return NotImplemented
        return (*self, self.of) == (*other, other.of)

    __hash__ = None  # type: ignore[assignment]

    def __repr__(self) -> str:
        parts = [f"Verdict: {self.level}", *(f"- {reason}" for reason in self.reasons)]
        parts.extend(f"  (note: {note})" for note in self.notes)
        return "\n".join(parts)
