"""The keywords of a recursion, common to `track` and `Tracker`.

The options of the methods are not listed here: they come from the registry of the library, from which
`_settings.py` is generated, and the library parses their values.
"""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

from . import _options, _pyhoid
from ._prior import prior_text
from .errors import FormatError, OptionError
from .operator_fit import OperatorFit

if TYPE_CHECKING:
    from ._settings import RecursiveMethod

__all__ = ["KEYWORDS", "current_name", "native_arguments"]

#: Keywords that all methods share, in the order of the signatures.
KEYWORDS = (
    "method",
    "structure",
    *("na", "nb", "nc", "nd", "nf", "nk"),
    "delay",
    "criterion",
    "start",
    "largest",
    "at",
    "controlled_element",
)

#: Keywords of the methods.
_OF_METHODS = {name for *_, keywords in _pyhoid.recursive_methods() for name in keywords}


def current_name(method: RecursiveMethod) -> RecursiveMethod:
    """Return the current name of a method; for an earlier name, warn the caller."""
    renamed = _pyhoid.renamed_method(method) if isinstance(method, str) else None
    if renamed is None:
        return method
    name, note = renamed
    warnings.warn(note, DeprecationWarning, stacklevel=3)
    return cast("RecursiveMethod", name)


def native_arguments(arguments: Mapping[str, Any], settings: Mapping[str, Any]) -> dict[str, Any]:
    """Return the keywords of a call in plain form: those common to all methods, and those of the method."""
    given = {name: arguments[name] for name in KEYWORDS}
    for name in settings:
        if name not in _OF_METHODS:
            raise TypeError(f"unexpected keyword argument {name!r}")
    start = given["start"]
    if isinstance(start, str) and start != "nothing":
        raise OptionError(f'start is {start!r}, expected all coefficients by name, or "nothing"')
    orders = {
        order: _options.order(order, value)
        for order in ("na", "nb", "nc", "nd", "nf", "nk")
        if (value := given[order]) is not None
    }
    settings = dict(settings)
    fit = None
    if settings.get("prior") is not None:
        settings["prior"], fit = _person(settings["prior"])
    texts = {name: _options.text(name, value) for name, value in settings.items()}
    return {
        "method": given["method"],
        "structure": given["structure"],
        "orders": orders,
        "delay": _options.delay(given["delay"]),
        "criterion": given["criterion"],
        "start": None
        if start is None or isinstance(start, str)
        else _options.numbers("start", start),
        "from_nothing": start == "nothing",
        "largest": float(given["largest"]),
        "at": [float(omega) for omega in given["at"]],
        "controlled_element": None
        if given["controlled_element"] is None
        else _options.controlled_element(given["controlled_element"]),
        "fit": fit,
        "settings": {
            # `lambda` is a reserved word in Python.
            "lambda" if name == "forgetting_factor" else name: text
            for name, text in texts.items()
            if text is not None
        },
    }


def _person(prior: Any) -> tuple[str | None, tuple[str, str] | None]:
    """Return prior knowledge of a person: a text, or the text of a fit with the name of its file.

    >>> _person({"omega_nm": (9, 0.2)})
    ('omega_nm=9.0:0.2', None)
    """
    text = prior_text(prior)
    if isinstance(prior, OperatorFit):
        return None, (text, "the fit")
    if not isinstance(prior, PathLike) and not text.lower().endswith(".json"):
        return text, None
    path = text
    try:
        return None, (Path(path).read_text(encoding="utf-8"), path)
    except OSError as error:
        raise OptionError(f"prior {path}: {error.strerror or error}") from None
    except UnicodeDecodeError:
        raise FormatError(f"prior {path} is not UTF-8 text") from None
