"""Pickles of results, for joblib, multiprocessing and dask.

A result has a native side that is computed and cannot be stored. Its pickle holds what the native
side reports about itself, and the call that made it. So a result comes back at once and with the same
digits; what is asked of it that was not reported before (a prediction on another record, a page) makes
the native side again, once, by the same call on the same data, and compares.
"""

from __future__ import annotations

import copy
import hashlib
import pickle
from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from . import _pyhoid
from .errors import DataError

__all__ = ["Call", "Recalled", "recalled", "same", "state_of"]


class Call(NamedTuple):
    """What made a native result: a function of this package by name, what it was given, and the way
    from its result to the native side that is meant."""

    function: str
    records: tuple[Any, ...]
    settings: dict[str, Any]
    path: tuple[str | int, ...] = ()

    def native(self) -> Any:
        """Make it again."""
        import pyhoid

        function: Callable[..., Any] = getattr(pyhoid, self.function)
        given = self.records[0] if self.function == "track" else list(self.records)
        found = function(given, **self.settings)
        if self.function == "describe":
            found = found.function
        found = found._native
        for step in self.path:
            found = found.fit(step) if isinstance(step, int) else getattr(found, step)
        return found

    def to(self, *path: str | int) -> Call:
        """The same call, and what is reached from its result."""
        return self._replace(path=(*self.path, *path))


class Recalled:
    """A native result out of a pickle."""

    def __init__(self, answers: Mapping[str, Any], call: Call | None) -> None:
        self._answers = dict(answers)
        self._call = call
        self._made: Any = None

    def _native(self) -> Any:
        if self._made is None:
            if self._call is None:
                raise DataError(
                    "a start fit of a tracker that results of a pickle has its numbers alone:"
                    " fit the record again by identify"
                )
            made = self._call.native()
            for name, value in self._answers.items():
                if name != "len" and not same(_answer(made, name), value):
                    raise DataError(
                        f"the result out of the pickle cannot be made again: {name} differs."
                        f" It was made by another version than {_pyhoid.__version__},"
                        " or its data have changed: make it again from the data"
                    )
            self._made = made
        return self._made

    def __getattr__(self, name: str) -> Any:
        if name.startswith("__"):
            raise AttributeError(name)
        answers = self.__dict__.get("_answers", {})
        if name in answers:
            # Those who change what they got change their own.
            return copy.deepcopy(answers[name])
        return getattr(self._native(), name)

    def __len__(self) -> int:
        return int(self._answers["len"])


def _answer(native: Any, name: str) -> Any:
    return len(native) if name == "len" else getattr(native, name)


def _seal(answers: Mapping[str, Any]) -> str:
    """A digest of the answers: a pickle that was cut or changed is known."""

    def told(value: Any) -> Any:
        if isinstance(value, np.ndarray):
            return (str(value.dtype), value.shape, value.tobytes())
        if isinstance(value, Mapping):
            return [(str(key), told(inner)) for key, inner in value.items()]
        if isinstance(value, (list, tuple)):
            return [told(inner) for inner in value]
        return repr(value)

    return hashlib.sha256(pickle.dumps(told(answers), protocol=4)).hexdigest()


def same(one: Any, other: Any) -> bool:
    """Whether two answers agree to the last digit; what is not a number agrees with itself."""
    if isinstance(one, np.ndarray) or isinstance(other, np.ndarray):
        one, other = np.asarray(one), np.asarray(other)
        if one.dtype.kind in "fc" and other.dtype.kind in "fc":
            return bool(np.array_equal(one, other, equal_nan=True))
        return bool(np.array_equal(one, other))
    if isinstance(one, Mapping) and isinstance(other, Mapping):
        return one.keys() == other.keys() and all(same(one[key], other[key]) for key in one)
    if isinstance(one, (list, tuple)) and isinstance(other, (list, tuple)):
        return len(one) == len(other) and all(same(a, b) for a, b in zip(one, other))
    if isinstance(one, float) and isinstance(other, float) and one != one:
        return other != other
    return bool(one == other)


def state_of(result: Any, names: Sequence[str]) -> dict[str, Any]:
    """The state of a result for its pickle: its own attributes, and what its native side reports."""
    own = dict(result.__dict__)
    native, call = own.pop("_native"), own.pop("_call", None)
    answers = {name: _answer(native, name) for name in names}
    return {
        "version": _pyhoid.__version__,
        "own": own,
        "call": call,
        "answers": answers,
        "seal": _seal(answers),
    }


def recalled(result: Any, state: Any, names: Sequence[str]) -> None:
    """Fill a result from the state in its pickle.

    Raises
    ------
    DataError
        When something is missing from the state, or the answers are not those that were sealed.
    """
    expected = {"version", "own", "call", "answers", "seal"}
    if not isinstance(state, dict) or set(state) != expected:
        raise DataError(
            f"this is not a pickle of a {type(result).__name__}: expected a state with"
            f" {', '.join(sorted(expected))}; pickle the result again"
        )
    answers = state["answers"]
    missing = [name for name in names if name not in answers]
    if missing or _seal(answers) != state["seal"]:
        what = f"lacks {', '.join(missing)}" if missing else "was changed since it was written"
        raise DataError(
            f"the pickle of this {type(result).__name__} {what} (made by pyhoid"
            f" {state['version']}, this is {_pyhoid.__version__}): make the result again"
        )
    result.__dict__.update(state["own"])
    result._call = state["call"]
    result._native = Recalled(answers, state["call"])
