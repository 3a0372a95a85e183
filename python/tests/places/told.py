"""The output of an interface, and its comparison."""

from __future__ import annotations

import csv
import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from .tools import Tools

Floats = np.ndarray[Any, np.dtype[np.float64]]

#: s.
STEP = 0.01
#: Parameters of the operator, and their columns in a trace.
OPERATOR = ("K_e", "T_L", "K_e_dot", "omega_nm", "zeta_nm", "tau_e")
#: Controlled element, and the reported quantities of the loop.
ELEMENT = "90/(s(s+6))"
LOOP = ("crossover_rad_s", "phase_margin_deg")
OF_LOOP = tuple(f"{name}{end}" for name in LOOP for end in ("", "_se"))
COLUMNS = tuple(f"{name}{end}" for name in (*OPERATOR, *LOOP) for end in ("", "_se"))


class Missing(Exception):
    """A missing interface, with the reason."""


@dataclass(frozen=True)
class Run:
    """e and u of 82 s of C4."""

    path: Path
    e: list[float]
    u: list[float]

    @staticmethod
    def made(tools: Tools, folder: Path) -> Run:
        path = folder / "c4.csv"
        tools.hoid("simulate", "--condition", "C4", "--seed", 1, "--out", path)
        columns = table(path)
        return Run(path, columns["e"], columns["u"])

    def lines(self) -> Iterable[str]:
        return (f"{e!r},{u!r}\n" for e, u in zip(self.e, self.u, strict=True))


@dataclass(frozen=True)
class Told:
    """The estimate after each sample, or after the samples `at`; NaN if unknown."""

    rows: Floats
    columns: tuple[str, ...] = COLUMNS
    at: range | None = None
    #: Time of each sample, s.
    seconds: Floats | None = None
    #: Size of the distributed file in bytes, and its kind.
    size: tuple[int, str] | None = None

    def compared(self, expected: dict[str, list[float]]) -> Compared:
        """Compares with the columns of a trace, bit by bit."""
        wanted = np.array([expected[name] for name in self.columns]).T
        if self.at is not None:
            wanted = wanted[list(self.at)]
        same = (self.rows == wanted) | (np.isnan(self.rows) & np.isnan(wanted))
        scale = np.maximum(np.abs(wanted), 1e-300)
        off = np.where(same, 0.0, np.abs(self.rows - wanted) / scale).max(axis=0, initial=0.0)
        return Compared(
            len(self.rows),
            {name: float(by) for name, by in zip(self.columns, off, strict=True) if by != 0},
        )


@dataclass(frozen=True)
class Compared:
    """Samples compared, and the largest relative difference of each column that has one."""

    samples: int
    off: dict[str, float]


@dataclass(frozen=True)
class Place:
    name: str
    #: Unit of work whose time is reported.
    sample: str
    run: Callable[[Run, Tools], Told]
    #: Options of `hoid track` for the comparison.
    options: tuple[str, ...] = ("--controlled-element", ELEMENT)
    #: Columns that depend on other elementary functions (sine, arctangent), and their largest
    #: relative difference: rounding errors, which are larger in the error bars.
    other_functions: tuple[str, ...] = ()
    off: float = 1e-9


def table(path: Path) -> dict[str, list[float]]:
    """The columns of a file; an empty cell is NaN."""
    with path.open(newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(line for line in file if not line.startswith("#")))
    return {
        name: [float(row[name]) if row[name] else math.nan for row in rows]
        for name in rows[0]
        if name
    }


def expected(
    tools: Tools, run: Run, folder: Path, options: tuple[str, ...]
) -> dict[str, list[float]]:
    """The trace of `hoid track`."""
    trace = folder / "trace.csv"
    tools.hoid("track", run.path, "--out", trace, *options)
    return table(trace)
