"""The keywords of a recursion, which `track` and `Tracker` share."""

from __future__ import annotations

from collections.abc import Mapping
from types import SimpleNamespace
from typing import Any

from . import _options
from .errors import OptionError

__all__ = ["KEYWORDS", "Memory", "plain"]

Memory = float | str

#: Their names, in the order of the signatures.
KEYWORDS = (
    "method",
    "structure",
    *("na", "nb", "nc", "nd", "nf", "nk"),
    "criterion",
    "start",
    *("memory", "forgetting_factor", "memory_of", "forgetting", "drift", "rate"),
    *("covariance", "pseudo_linear", "stable", "bound", "track_delay"),
    *("window", "refit", "limit", "alarm", "largest"),
)

#: What the keywords about forgetting belong to.
_FORGETS = (
    'a recursion that forgets; method="window" has window, forgetting="gradient" has rate,'
    ' and "adaptive", "ekf" and "ukf" have a model of the change'
)


def plain(arguments: Mapping[str, Any]) -> dict[str, Any]:
    """The keywords among the arguments of a call, in plain form, checked against each other."""
    keywords = {name: arguments[name] for name in KEYWORDS}
    given = SimpleNamespace(**keywords)
    method, way = given.method.lower(), given.forgetting.lower().replace("_", "-")
    windowed, adaptive = method == "window", method == "adaptive"
    remembers = not windowed and method not in ("adaptive", "ekf", "ukf") and way != "gradient"
    for keyword, wrong, belongs in (
        ("window", given.window is not None and not windowed, 'method="window"'),
        ("refit", given.refit is not None and not windowed, 'method="window"'),
        (
            "memory",
            (given.memory is not None or given.forgetting_factor is not None) and not remembers,
            _FORGETS,
        ),
        ("memory_of", given.memory_of is not None and not remembers, _FORGETS),
        (
            "bound",
            given.bound is not None and method not in ("physical", "adaptive", "ekf", "ukf"),
            'method="physical", "adaptive", "ekf" or "ukf"',
        ),
        ("alarm", given.alarm is not None and not adaptive, 'method="adaptive"'),
        (
            "track_delay",
            given.track_delay is not None and method != "physical",
            'method="physical"',
        ),
        ("drift", given.drift is not None and way != "random-walk", 'forgetting="random-walk"'),
        ("rate", given.rate is not None and way != "gradient", 'forgetting="gradient"'),
    ):
        if wrong:
            raise OptionError(f"{keyword} belongs to {belongs}")
    if isinstance(given.start, str) and given.start != "nothing":
        raise OptionError(
            f'start is {given.start!r}, expected all coefficients by name, or "nothing"'
        )
    orders = {
        order: _options.order(order, value)
        for order in ("na", "nb", "nc", "nd", "nf", "nk")
        if (value := keywords[order]) is not None
    }
    return {
        "method": method,
        "structure": given.structure,
        "orders": orders,
        "criterion": given.criterion,
        "start": None
        if given.start is None or isinstance(given.start, str)
        else _options.numbers("start", given.start),
        "from_nothing": given.start == "nothing",
        "memory": None if given.memory is None else _options.memory(given.memory),
        "forgetting_factor": given.forgetting_factor,
        "memory_of": {
            key: _options.memory(value) for key, value in (given.memory_of or {}).items()
        },
        "forgetting": way,
        "drift": None if given.drift is None else _options.numbers("drift", given.drift),
        "rate": given.rate,
        "covariance": given.covariance,
        "pseudo_linear": bool(given.pseudo_linear),
        "stable": given.stable,
        "bound": _options.bounds(given.bound or {}),
        "track_delay": _options.span("track_delay", given.track_delay),
        "window": None if given.window is None else _options.memory(given.window),
        "refit": given.refit,
        "limit": given.limit,
        "alarm": given.alarm,
        "largest": float(given.largest),
    }
