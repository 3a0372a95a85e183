"""The keywords of a recursion, which `track` and `Tracker` share.

The options of the methods are not listed here: they are those of the registry of the library
(`_settings.py` is made from it), and their values are read there.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from . import _options, _pyhoid
from .errors import OptionError

__all__ = ["KEYWORDS", "plain"]

#: Keywords that all methods share, in the order of the signatures.
KEYWORDS = (
    "method",
    "structure",
    *("na", "nb", "nc", "nd", "nf", "nk"),
    "criterion",
    "start",
    "largest",
)

#: Keywords of the methods.
_OF_METHODS = {name for *_, keywords in _pyhoid.recursive_methods() for name in keywords}


def plain(arguments: Mapping[str, Any], settings: Mapping[str, Any]) -> dict[str, Any]:
    """The keywords of a call in plain form: those that all methods share, and those of the method."""
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
    texts = {name: _options.text(name, value) for name, value in settings.items()}
    return {
        "method": given["method"],
        "structure": given["structure"],
        "orders": orders,
        "criterion": given["criterion"],
        "start": None
        if start is None or isinstance(start, str)
        else _options.numbers("start", start),
        "from_nothing": start == "nothing",
        "largest": float(given["largest"]),
        # What is said of a row, so that a tracker has none.
        "at": [float(omega) for omega in arguments.get("at", ())],
        "settings": {
            # Python keeps the word lambda for itself.
            "lambda" if name == "forgetting_factor" else name: text
            for name, text in texts.items()
            if text is not None
        },
    }
