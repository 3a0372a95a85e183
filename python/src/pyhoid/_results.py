"""Common parts of the results of `identify`: records, settings, JSON, equality, pickles.

A result is written as the JSON of ``hoid identify --json``, together with a state from which the model is
restored exactly. Equality and pickles use this text.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from . import _pyhoid
from ._faults import faults_of, fitted_records
from .errors import DataError
from .estimates import channel_units
from .record import Record

__all__ = ["Result"]

_PARTS = {"version", "text", "records", "settings", "units"}


class Result:
    """A result of `identify`."""

    _native: Any
    #: The records as they were fitted; empty for a result that was read from JSON.
    records: tuple[Record, ...]
    #: The settings that were used, by name.
    settings: dict[str, Any]
    #: Names of the settings that differ from the default.
    given: frozenset[str]
    #: Units of e and u; empty if none is declared.
    units: tuple[str, str]
    #: Faults found in the records: record, kind, channel, from, to, samples, size,
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
        # A part of another result, or a result from a pickle, gets its records from that result.
        self.records = fitted_records(native, records) or tuple(records)
        self.units = units or channel_units(self.records)
        own = native.settings
        self.settings = dict(settings or {name: value for name, value, _ in own})
        self.given = frozenset(name for name, _, given in own if given)
        self.faults = faults_of(native)

    def to_json(self) -> str:
        """Return the result as text: the object of ``hoid identify --json``, and the state of its model.

        `from_json` restores the result. ``pyhoid.track(record, prior=...)``, ``hoid track --prior``,
        ``hoid stream --prior`` and ``hoid identify --prior`` accept the text for an operator as a prior. The
        text does not contain the samples of the records.

        Raises
        ------
        DataError
            For a part of another result, such as ``operator.fit``: write the whole result instead.

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
        """Return whether the two results have the same JSON and the same state."""
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
