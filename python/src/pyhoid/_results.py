"""What the results of `identify` share: records, settings, JSON both ways, equality, pickles.

A result is written as the JSON of ``hoid identify --json``, with a state from which the model comes back as
it was, every bit of it. Equality and pickles use that text.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from . import _pyhoid
from ._faults import faults_of, used
from .errors import DataError
from .estimates import channel_units
from .record import Record

__all__ = ["Result"]

_PARTS = {"version", "text", "records", "settings", "units"}


class Result:
    """A result of `identify`."""

    _native: Any
    #: The records as they were fitted; none of a result that was read from JSON.
    records: tuple[Record, ...]
    #: The settings that were used, by name.
    settings: dict[str, Any]
    #: Names of those that are not the default.
    given: frozenset[str]
    #: Units of e and u; empty if none is declared.
    units: tuple[str, str]
    #: Faults of the records that were searched for: record, kind, channel, from, to, samples, size,
    #: deviations, action, words.
    faults: list[dict[str, Any]]

    def __init__(
        self,
        native: Any,
        records: Sequence[Record] = (),
        settings: Mapping[str, Any] | None = None,
        units: tuple[str, str] | None = None,
    ) -> None:
        self._native = native
        # Those of a part of another result, or out of a pickle, are the records that it is of.
        self.records = used(native, records) or tuple(records)
        self.units = units or channel_units(self.records)
        own = native.settings
        self.settings = dict(settings or {name: value for name, value, _ in own})
        self.given = frozenset(name for name, _, given in own if given)
        self.faults = faults_of(native)

    def to_json(self) -> str:
        """The result as text: the object of ``hoid identify --json``, and the state of its model.

        `from_json` reads it again, and ``pyhoid.track(record, prior=...)``, ``hoid track --prior``,
        ``hoid stream --prior`` and ``hoid identify --prior`` take an operator's as a prior. The samples
        of the records are not in it.

        Raises
        ------
        DataError
            For a part of another result, such as ``operator.fit``: write that one.

        Examples
        --------
        >>> from pathlib import Path
        >>> Path("person.json").write_text(person.to_json())
        """
        text: str = self._native.to_json()
        return text

    def _text(self) -> str:
        state: str | None = getattr(self._native, "state", lambda: None)()
        return self.to_json() if state is None else state

    def __eq__(self, other: object) -> bool:
        """Equal where all that is written of both is."""
        if not isinstance(other, Result):
            return NotImplemented
        return type(self) is type(other) and self._text() == other._text()

    def __hash__(self) -> int:
        return hash(self._text())

    def __getstate__(self) -> dict[str, Any]:
        return {
            "version": _pyhoid.__version__,
            "text": self._text(),
            "records": self.records,
            "settings": self.settings,
            "units": self.units,
        }

    def __setstate__(self, state: Any) -> None:
        name = type(self).__name__
        if not isinstance(state, dict) or set(state) != _PARTS or not isinstance(state["text"], str):
            raise DataError(
                f"this is not a pickle of a {name}: expected a state with {', '.join(sorted(_PARTS))};"
                " pickle the result again"
            )
        text = state["text"]
        try:
            native = _pyhoid.from_json(text) if text.startswith("{") else _pyhoid.from_state(text)
        except DataError as error:
            raise DataError(
                f"the pickle of this {name} (made by pyhoid {state['version']}, this is"
                f" {_pyhoid.__version__}) cannot be read: {error}; make the result again"
            ) from None
        type(self).__init__(self, native, state["records"], state["settings"], state["units"])
