"""Conversion of options as users write them to the plain types that the native module takes."""

from __future__ import annotations

import math
import operator
import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, cast

from .errors import DataError, OptionError
from .record import Record

__all__ = [
    "Order",
    "Progress",
    "as_records",
    "controlled_element",
    "guesses",
    "numbers",
    "order",
    "reporter",
    "settings",
    "span",
    "text",
    "whole",
]

Order = int | tuple[int, int] | range
Progress = bool | Callable[[int, int], object]


def order(name: str, value: Any) -> tuple[int, int]:
    """Return an order as the two ends of a range of orders, both included."""
    if isinstance(value, range):
        if value.step != 1 or not len(value):
            raise OptionError(f"{name} is {value}, expected a nonempty range with step 1")
        return value[0], value[-1]
    ends = value if isinstance(value, (tuple, list)) else (value, value)
    if len(ends) != 2:
        raise OptionError(
            f"{name} is {value!r}, expected a whole number or a pair (least, greatest)"
        )
    try:
        low, high = (operator.index(end) for end in ends)
    except TypeError:
        raise OptionError(f"{name} is {value!r}, expected whole numbers") from None
    if low < 0 or high < low:
        raise OptionError(
            f"{name} is {value!r}, expected nonnegative numbers, the smaller first"
        )
    return low, high


#: Largest whole number that the native module takes.
_LARGEST = 2**64 - 1


def whole(name: str, value: Any, least: int = 0, largest: int = _LARGEST) -> Any:
    """Return a whole number within its limits; None stays None.

    >>> whole("seed", 7)
    7
    """
    if value is None:
        return None
    try:
        number = operator.index(value)
    except TypeError:
        raise OptionError(f"{name} is {value!r}, expected a whole number") from None
    if not least <= number <= largest:
        raise OptionError(f"{name} is {number}, expected a whole number from {least} to {largest}")
    return number


def roles(
    record: Record, inputs: Sequence[str] | None, roles: Mapping[str, str] | None
) -> list[str]:
    """Return the inputs other than the error with their roles, in the form that the library reads.

    >>> roles(record, ["e", "r"], {"r": "feedforward:0.5"})
    ['r=feedforward:0.5']
    """
    named = dict(roles or {})
    error = record.input_name
    names = list(inputs) if inputs is not None else [error, *(name for name in named if name != error)]
    if isinstance(inputs, str) or not names or names[0] not in (error, "e"):
        raise OptionError(
            f"inputs is {inputs!r}, expected the error first: [{error!r}, ...]"
            " (choose another column as the error when you read the record)"
        )
    if named.pop(names[0], "feedback") != "feedback":
        raise OptionError(f"roles: {names[0]} is the feedback and has no other role")
    unknown = sorted(set(named) - set(names[1:]))
    if unknown:
        raise OptionError(f"roles: {unknown[0]} is not one of the inputs {names}")
    return [f"{name}={named.get(name, 'feedforward')}" for name in names[1:]]


def controlled_element(
    element: str | Sequence[float] | tuple[Sequence[float], Sequence[float]],
    den: Sequence[float] | None = None,
) -> str | tuple[list[float], list[float]]:
    """Return a controlled element as text, or as numerator and denominator."""
    if isinstance(element, str):
        if den is not None:
            raise OptionError(f"the controlled element {element!r} already has a denominator: leave den out")
        return element
    try:
        parts: tuple[Any, ...] = tuple(element) if den is None else (element, den)
        if len(parts) != 2:
            raise TypeError
        return [float(v) for v in parts[0]], [float(v) for v in parts[1]]
    except (TypeError, ValueError):
        raise OptionError(
            f"the controlled element is {element!r}, expected text such as '90/(s(s+6))', "
            "or numerator and denominator in descending powers of s"
        ) from None


def numbers(name: str, values: Mapping[str, Any]) -> dict[str, float]:
    """Return numbers by name."""
    try:
        return {str(key): float(value) for key, value in values.items()}
    except (TypeError, ValueError, AttributeError):
        raise OptionError(
            f'{name} is {values!r}, expected numbers by name, such as {{"f1": -1.9}}'
        ) from None


def guesses(name: str, values: Any) -> str | None:
    """Return pairs of numbers by name as NAME=VALUE:WEIGHT; None if there are none.

    >>> guesses("coefficient_prior", {"f1": (-1.9, 0.5)})
    'f1=-1.9:0.5'
    """
    if isinstance(values, str):
        return values
    try:
        pairs = [f"{key}={float(v)!r}:{float(weight)!r}" for key, (v, weight) in values.items()]
    except (AttributeError, TypeError, ValueError):
        raise OptionError(
            f'{name} is {values!r}, expected pairs by name, such as {{"f1": (-1.9, 0.5)}}'
        ) from None
    return ",".join(pairs) or None


def span(name: str, value: Any) -> tuple[float, float] | None:
    """Return two finite numbers, the smaller first."""
    if value is None:
        return None
    try:
        low, high = (float(end) for end in value)
    except (TypeError, ValueError):
        raise OptionError(f"{name} is {value!r}, expected a pair of numbers") from None
    if not (math.isfinite(low) and math.isfinite(high) and low <= high):
        raise OptionError(f"{name} is {value!r}, expected two finite numbers, the smaller first")
    return low, high


def delay(value: Any) -> tuple[float, float] | None:
    """Return a delay in s as the shortest and the longest delay.

    >>> delay(0.28), delay((0.1, 0.4))
    ((0.28, 0.28), (0.1, 0.4))
    """
    return span("delay", (value, value) if isinstance(value, (int, float)) else value)


def text(name: str, value: Any) -> str | None:
    """Return a value in the form of the command line; None if it carries no information.

    >>> text("memory_of", {"b": 256, "f": "inf"})
    'b=256,f=inf'
    >>> text("bound", {"omega_nm": (5, None)})
    'omega_nm=5..'
    """
    if value is None or value is False or (isinstance(value, Mapping) and not value):
        return None
    if isinstance(value, str):
        return value
    if value is True:
        return "true"
    if isinstance(value, Mapping):
        return ",".join(f"{key}={text(name, one)}" for key, one in value.items())
    if isinstance(value, (tuple, list)) and len(value) == 2:
        low, high = ("" if end is None else text(name, end) for end in value)
        return f"{low}..{high}"
    try:
        return str(operator.index(cast(Any, value)))
    except TypeError:
        pass
    try:
        return repr(float(cast(Any, value)))
    except (TypeError, ValueError):
        raise OptionError(
            f"{name} is {value!r}, expected a number, text, a pair, or values by name"
        ) from None


def as_records(records: Record | Sequence[Record]) -> list[Record]:
    """Return one record or several as a list."""
    several = [records] if isinstance(records, Record) else records
    if not isinstance(several, Iterable) or isinstance(several, (str, bytes)):
        raise DataError(
            f"expected a pyhoid.Record or a sequence of records, found {type(records).__name__};"
            " make one with pyhoid.Record(e=, u=, sample_time=)"
        )
    several = list(several)
    for one in several:
        if not isinstance(one, Record):
            raise DataError(
                f"expected a pyhoid.Record, found {type(one).__name__};"
                " make one with pyhoid.Record(e=, u=, sample_time=)"
            )
    if not several:
        raise DataError("there is no record; give one or more")
    return several


def settings(given: Mapping[str, Any]) -> list[tuple[str, str]]:
    """Return settings by name, as a report page lists them: those that were given or have a default."""
    return [
        (name, str(value))
        for name, value in given.items()
        if value is not None and value != {} and value != ()
    ]


def reporter(progress: Any, what: str) -> Callable[[int, int], object] | None:
    """Return the function that is called with the completed and the total amount of work."""
    if progress is None or progress is False:
        return None
    if progress is not True:
        if not callable(progress):
            raise OptionError(
                f"progress is {progress!r}, expected True, False or a callable (done, total)"
            )
        return progress  # type: ignore[no-any-return]

    def show(done: int, total: int) -> None:
        # On a terminal, one line is overwritten repeatedly; elsewhere only the last line is written.
        end = "\n" if done >= total else "\r"
        if sys.stderr.isatty() or end == "\n":
            sys.stderr.write(f"{done} of {total} {what}{end}")
            sys.stderr.flush()

    return show
