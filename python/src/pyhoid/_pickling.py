"""Pickles of results, for joblib, multiprocessing and dask.

A result has a native object that is computed and cannot be stored. Its pickle holds everything that the
native object reports about itself, and the call that created it. A result is therefore restored at once
and with the same digits. If it is used for anything else (a prediction on another record, a report
page), the native object is recreated once, by the same call on the same data, and compared.
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

__all__ = ["Call", "RestoredNative", "restore", "same", "state_of"]


class Call(NamedTuple):
    """The call that created a native result: the name of a function of this package, its arguments, and
    the attributes that lead from the function's result to the native object."""

    function: str
    records: tuple[Any, ...]
    settings: dict[str, Any]
    path: tuple[str | int, ...] = ()

    def native(self) -> Any:
        """Repeat the call and return the native object."""
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
        """Return the call that leads from the same result to one of its parts."""
        return self._replace(path=(*self.path, *path))


class RestoredNative:
    """A native result restored from a pickle."""

    def __init__(self, answers: Mapping[str, Any], call: Call | None) -> None:
        self._answers = dict(answers)
        self._call = call
        self._made: Any = None

    def _native(self) -> Any:
        if self._made is None:
            if self._call is None:
                raise DataError(
                    "the start fit of an unpickled tracker has only its numbers, not its record:"
                    " fit the record again with identify"
                )
            made = self._call.native()
            for name, value in self._answers.items():
                if name != "len" and not same(_answer(made, name), value):
                    raise DataError(
                        f"the result in the pickle cannot be reproduced: {name} differs."
                        f" It was made by a version other than {_pyhoid.__version__},"
                        " or its data have changed: make the result again from the data"
                    )
            self._made = made
        return self._made

    def __getattr__(self, name: str) -> Any:
        if name.startswith("__"):
            raise AttributeError(name)
        answers = self.__dict__.get("_answers", {})
        if name in answers:
            # The caller gets a copy, so that changes to it have no effect here.
            return copy.deepcopy(answers[name])
        return getattr(self._native(), name)

    def __len__(self) -> int:
        return int(self._answers["len"])


def _answer(native: Any, name: str) -> Any:
    return len(native) if name == "len" else getattr(native, name)


def _seal(answers: Mapping[str, Any]) -> str:
    """Return a digest of the answers, by which a truncated or changed pickle is detected."""

    def plain(value: Any) -> Any:
        if isinstance(value, np.ndarray):
            return (str(value.dtype), value.shape, value.tobytes())
        if isinstance(value, Mapping):
            return [(str(key), plain(inner)) for key, inner in value.items()]
        if isinstance(value, (list, tuple)):
            return [plain(inner) for inner in value]
        return repr(value)

    return hashlib.sha256(pickle.dumps(plain(answers), protocol=4)).hexdigest()


def same(one: Any, other: Any) -> bool:
    """Return whether two answers are identical; NaN counts as equal to itself."""
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
    """Return the state for a pickle: the attributes of the result, and what its native object reports."""
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


def restore(result: Any, state: Any, names: Sequence[str]) -> None:
    """Restore a result from the state in its pickle.

    Raises
    ------
    DataError
        If something is missing from the state, or the answers do not match their digest.
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
    result._native = RestoredNative(answers, state["call"])
