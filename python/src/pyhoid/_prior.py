"""Prior knowledge of a person, in the form of text."""

from __future__ import annotations

from collections.abc import Mapping
from os import PathLike, fspath
from typing import Any

from . import _options
from .errors import OptionError
from .operator_fit import OperatorFit

__all__ = ["prior_text"]


def prior_text(prior: Any) -> str:
    """Return a prior as text: words, a path, or the JSON of another fit.

    >>> prior_text({"omega_nm": (9, 0.2)})
    'omega_nm=9.0:0.2'
    """
    if prior is None:
        return "none"
    if isinstance(prior, OperatorFit):
        return prior.to_json()
    if isinstance(prior, (str, PathLike)):
        return fspath(prior)
    if isinstance(prior, Mapping):
        try:
            return _options.guesses("prior", prior) or "none"
        except OptionError:
            pass
    raise OptionError(
        f'prior is {prior!r}, expected "population", "none", text such as "omega_nm=10.5:0.3", '
        "(centre, spread) by name, a JSON result, or an OperatorFit"
    )
