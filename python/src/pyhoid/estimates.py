"""Estimates with their standard errors, and operators and remnants that consist of them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple, TypeVar

from . import _text
from .errors import NotConvertibleError

if TYPE_CHECKING:
    from .record import Record

__all__ = ["Estimate", "Operator", "Remnant"]

_T = TypeVar("_T")

#: Units of parameters; for gains, the factor in addition to the units of u and e.
UNITS: Mapping[str, str] = {
    "K_e": "",
    "T_L": "s",
    "K_e_dot": "s",
    "omega_nm": "rad/s",
    "zeta_nm": "",
    "tau_e": "s",
    "T_n": "s",
    "K_n": "",
    "crossover_rad_s": "rad/s",
    "phase_crossover_rad_s": "rad/s",
    "phase_margin_deg": "deg",
    "gain_margin_db": "dB",
}


#: Parameters that are a ratio of u and e.
_GAINS = ("K", "K_e", "K_e_dot", "K_over_T_I", "K_I")


def unit_of(name: str, units: tuple[str, str] = ("", ""), own: str | None = None) -> str:
    """Return the unit of a parameter; for a gain only if the units of e and u are declared.

    `own` is the factor in addition to u/e; by default it follows from the name of the parameter.

    >>> unit_of("T_L"), unit_of("K_e")
    ('s', '')
    """
    own = UNITS.get(name, "") if own is None else own
    if name.rstrip("0123456789") not in _GAINS:
        return own
    e, u = units
    if not e or not u:
        return ""
    if own and e == u:
        return own
    if own == "1/s":
        return f"{u}/({e} s)"
    return f"{u} {own}/{e}" if own else f"{u}/{e}"


def channel_units(records: Sequence[Record]) -> tuple[str, str]:
    """Return the units of input and output, regardless of the column names; empty if none are given."""
    if not records:
        return ("", "")
    record, units = records[0], records[0].units
    return (
        units.get(record.input_name or "", "").strip(),
        units.get(record.output_name, "").strip(),
    )


class Estimate(NamedTuple):
    """A value and its standard error.

    The standard error is None if it does not exist: for a delay in whole samples, or an exact fit.

    Examples
    --------
    >>> fit.operator.K_e.value, fit.operator.K_e.standard_error
    """

    value: float
    standard_error: float | None

    def __repr__(self) -> str:
        value, error = _text.with_uncertainty(self.value, self.standard_error)
        return value if error == _text.DASH else f"{value} ± {error}"

    def __float__(self) -> float:
        return float(self.value)


def estimates(found: Mapping[str, Any]) -> dict[str, Estimate | None]:
    """Create estimates from the pairs that the native module returns."""
    return {name: None if pair is None else Estimate(*pair) for name, pair in found.items()}


class Named(Mapping[str, _T]):
    """Values by name, which are also accessible as attributes."""

    #: Name of the object in messages.
    _owner = "it"
    _all: dict[str, _T]

    def __getitem__(self, name: str) -> _T:
        return self._all[name]

    def __getattr__(self, name: str) -> _T:
        if name.startswith("_") or "_all" not in self.__dict__:
            raise AttributeError(name)
        try:
            return self._all[name]
        except KeyError:
            raise AttributeError(
                f"{self._owner} has no parameter {name}; it has {', '.join(self._all)}"
            ) from None

    def __iter__(self) -> Iterator[str]:
        return iter(self._all)

    def __len__(self) -> int:
        return len(self._all)


class _Converted(Named[Estimate]):
    """Estimates by name, or the reason why there are none."""

    _what = "the model"
    #: Units of e and u, from which the units of gains follow.
    _units: tuple[str, str] = ("", "")

    def __init__(
        self, found: Mapping[str, Any], units: tuple[str, str] = ("", "")
    ) -> None:
        self._units = units
        self.convertible: bool = bool(found["convertible"])
        self.reason: str | None = found.get("reason")
        self._all: dict[str, Estimate] = {
            name: Estimate(*pair) for name, pair in found.items() if isinstance(pair, tuple)
        }

    def _need(self) -> None:
        if not self.convertible:
            raise NotConvertibleError(f"{self._what} is not convertible: {self.reason}")

    def __getitem__(self, name: str) -> Estimate:
        self._need()
        return super().__getitem__(name)

    def __getattr__(self, name: str) -> Estimate:
        if name in UNITS and "_all" in self.__dict__ and not self.convertible:
            self._need()
        return super().__getattr__(name)

    def _rows(self) -> list[list[str]]:
        return [
            [
                name,
                *_text.with_uncertainty(estimate.value, estimate.standard_error),
                unit_of(name, self._units),
            ]
            for name, estimate in self._all.items()
        ]

    def __repr__(self) -> str:
        if not self.convertible:
            return f"{type(self).__name__}: not convertible: {self.reason}"
        return _text.plain_table(
            [type(self).__name__.lower(), "value", "standard error", "unit"], self._rows()
        )

    def _repr_html_(self) -> str:
        if not self.convertible:
            return f"<p>{type(self).__name__}: not convertible: {self.reason}</p>"
        return _text.html_table(
            type(self).__name__, ["", "value", "standard error", "unit"], self._rows()
        )


class Operator(_Converted):
    """The human operator of a model.

    The parameters are K_e (unit of u divided by that of e), T_L (s), K_e_dot (unit of K_e times s),
    omega_nm (rad/s), zeta_nm, tau_e (s).

    The operator is a mapping from names to `Estimate`; the entries are also attributes
    (``operator.K_e.value``). If the coefficients do not represent a continuous operator, `convertible` is
    False, `reason` gives the reason, and access to a parameter raises `NotConvertibleError`.

    Attributes
    ----------
    convertible : bool
    reason : str or None
    stable : bool
        Whether zeta_nm is positive.

    Examples
    --------
    >>> fit.operator.T_L
    """

    _what = "the operator"
    _owner = "Operator"

    def __init__(
        self, found: Mapping[str, Any], units: tuple[str, str] = ("", "")
    ) -> None:
        super().__init__(found, units)
        self.stable: bool = bool(found.get("stable", False))


class Remnant(_Converted):
    """The remnant of a noise model: T_n (s), K_n, and the order m of its filter.

    Attributes
    ----------
    order : int
    discretisation : str
        The discretisation that was inverted, ``"zoh"`` or ``"backward-euler"``.

    Examples
    --------
    >>> fit.remnant.T_n
    """

    _what = "the remnant"
    _owner = "Remnant"

    def __init__(self, found: Mapping[str, Any]) -> None:
        super().__init__(found)
        self.order: int = int(found.get("order", 0))
        self.discretisation: str = str(found.get("discretisation", ""))
