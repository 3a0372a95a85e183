"""A recursive estimate over a record: columns by name, tables, figures, report page."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from . import _options, _pyhoid, _text
from ._arrays import FloatArray
from ._decimation import rate_note
from ._faults import fitted_records
from .estimates import Estimate, Operator, channel_units, unit_of
from ._pickling import Call, restore, state_of
from .fit import Fit
from .record import Record
from .verdict import Verdict

if TYPE_CHECKING:
    import pandas as pd
    import polars as pl
    import xarray as xr
    from matplotlib.axes import Axes

__all__ = ["Trace"]


#: Attributes of the native object that a pickle contains.
_ANSWERS = (
    "len",
    "method",
    "structure",
    "orders",
    "parameter_names",
    "operator_names",
    "updated_from",
    "counts",
    "faults",
    "changes",
    "failures",
    "no_crossover",
    "covariance_choice",
    "innovation_variance",
)


class Trace:
    """The estimate at each stored sample, with its uncertainty. `track` creates it.

    Columns are accessed by name: ``trace["K_e"]``, and ``trace["K_e_se"]`` for its standard errors. All
    columns have shape (N,) and are NaN if a row has no operator. With `at` and `controlled_element` there
    are also ``trace["gain_db@2.5"]``, ``trace["phase_deg@2.5"]``, ``trace["crossover_rad_s"]`` and
    ``trace["phase_margin_deg"]``. ``"adaptive"`` adds columns such as ``trace["omega_nm_determined"]``,
    which are 1 where the data determine the parameter.

    Attributes
    ----------
    record : Record
        The record that was tracked.
    settings : dict
        The keywords of the call, including defaults.

    Examples
    --------
    >>> trace = pyhoid.track(record)
    >>> trace.time, trace["K_e"], trace["K_e_se"]
    """

    def __init__(
        self,
        native: _pyhoid.Trace,
        record: Record,
        settings: Mapping[str, Any] | None = None,
        call: Call | None = None,
    ) -> None:
        self._native = native
        self._call = call
        # For an unchanged record, the given object itself is returned.
        (self.record,) = fitted_records(native, [record])
        self.settings: dict[str, Any] = dict(settings or {})
        self._columns: dict[str, npt.NDArray[Any]] | None = None
        self._verdict: Verdict | None = None

    def __getstate__(self) -> dict[str, Any]:
        # Everything that a table and a summary show is computed before the pickle is written.
        _ = self.columns, self.verdict
        return state_of(self, _ANSWERS)

    def __setstate__(self, state: Any) -> None:
        restore(self, state, _ANSWERS)

    @property
    def columns(self) -> dict[str, npt.NDArray[Any]]:
        """All columns by name, in the order of a trace file."""
        if self._columns is None:
            self._columns = self._native.columns()
        return self._columns

    def __getitem__(self, name: str) -> npt.NDArray[Any]:
        try:
            return self.columns[name]
        except KeyError:
            raise KeyError(
                f"there is no column {name}; the trace has {', '.join(self.columns)}"
            ) from None

    def __contains__(self, name: object) -> bool:
        return name in self.columns

    def __len__(self) -> int:
        return len(self._native)

    @property
    def time(self) -> FloatArray:
        """Times of the rows in s."""
        return self["t"]

    @property
    def method(self) -> str:
        """Name of the recursive method."""
        return self._native.method

    @property
    def structure(self) -> str:
        """Structure of the model."""
        return self._native.structure

    @property
    def orders(self) -> dict[str, int]:
        """Orders na, nb, nc, nd, nf and nk."""
        return self._native.orders

    @property
    def covariance_choice(self) -> dict[str, Any] | None:
        """The start covariances tried with `validate`: ``covariance``, the one selected; ``candidates``,
        each with the VAF in % of the second run; ``from`` and ``to``, the span that was compared, in s from
        its first sample. None without `validate`."""
        return self._native.covariance_choice

    @property
    def parameter_names(self) -> list[str]:
        """Names of the coefficients."""
        return self._native.parameter_names

    @property
    def operator_names(self) -> list[str]:
        """Names of the operator's parameters."""
        return self._native.operator_names

    @property
    def response_names(self) -> list[str]:
        """Names of the gain and phase at the frequencies of `at`, and of the crossover and margin,
        as far as they were requested, without their errors."""
        starts = ("gain_db@", "phase_deg@", "crossover_rad_s", "phase_margin_deg")
        return [n for n in self.columns if n.startswith(starts) and not n.endswith("_se")]

    @property
    def no_crossover(self) -> tuple[int, str | None] | None:
        """Number of rows without a crossover, and the most frequent reason; None without a controlled
        element."""
        return self._native.no_crossover

    @property
    def updated_from(self) -> float:
        """Time in s after which the estimate was updated."""
        return self._native.updated_from

    @property
    def counts(self) -> dict[str, int]:
        """Counts: samples, skipped, held, restarts, steps_shortened."""
        return self._native.counts

    @property
    def faults(self) -> list[dict[str, Any]]:
        """Faults that the guard found in e and u, and its actions.

        Each has its kind, its channel, the times `from` and `to` in s, its size and the action.
        """
        return self._native.faults

    @property
    def verdict(self) -> Verdict:
        """Reliability of the trace: `level`, `reasons`, `notes`, and `of` for each answer."""
        if self._verdict is None:
            self._verdict = Verdict._read(self._native.verdict)
        return self._verdict

    @property
    def changes(self) -> list[dict[str, Any]]:
        """The changes that ``"adaptive"`` or ``"multiple-model"`` declared.

        Each has the time `t` of its declaration, how long before that it occurred, the odds, the quantities
        that changed (`changed`), and the gains before and after with their standard errors.
        """
        return self._native.changes

    @property
    def innovation_variance(self) -> FloatArray:
        """The tracked innovation variance of each row."""
        return self._native.innovation_variance

    @property
    def start(self) -> Fit | None:
        """The batch fit from which the recursion started."""
        native = self._native.start
        if native is None:
            return None
        return Fit(native, [self.record])

    def operator(self, row: int = -1) -> Operator | None:
        """Return the operator of a row, by default the last.

        >>> trace.operator()
        """
        found = self._native.operator(row if row >= 0 else row + len(self))
        return None if found is None else Operator(found, channel_units([self.record]))

    def to_pandas(self) -> pd.DataFrame:
        """Return all columns with the time in s as index.

        >>> trace.to_pandas()
        """
        import pandas as pd

        columns = {name: values for name, values in self.columns.items() if name != "t"}
        return pd.DataFrame(columns, index=pd.Index(self.time, name="t"), copy=False)

    def to_polars(self) -> pl.DataFrame:
        """Return all columns as a table of polars.

        >>> trace.to_polars()
        """
        import polars as pl

        return pl.DataFrame(dict(self.columns))

    def _unit(self, name: str) -> str:
        """Return the unit of a column."""
        base = name.removesuffix("_se")
        of_response = {"gain_db": "dB", "phase_deg": "deg"}.get(base.partition("@")[0])
        return of_response or unit_of(base, channel_units([self.record]))

    def to_xarray(self) -> xr.Dataset:
        """Return all columns over the coordinate ``t`` (s).

        >>> trace.to_xarray()
        """
        import xarray as xr

        variables = {
            name: ("t", values, {"units": self._unit(name)})
            for name, values in self.columns.items()
            if name != "t"
        }
        attributes = {"method": self.method, "structure": self.structure}
        return xr.Dataset(
            variables, coords={"t": ("t", self.time, {"units": "s"})}, attrs=attributes
        )

    def to_json(self) -> str:
        """Return the result as text: the object of ``hoid track --json``.

        >>> from pathlib import Path
        >>> Path("trace.json").write_text(trace.to_json())
        """
        return self._native.to_json()

    def write(self, path: str | PathLike[str], comments: Sequence[str] = ()) -> None:
        """Write the columns as CSV, Parquet, NPZ or .mat, as ``hoid track`` does.

        >>> trace.write("trace.csv")
        """
        self._native.write(path, list(comments))

    def plot(
        self, names: Sequence[str] | None = None, axes: Sequence[Axes] | None = None
    ) -> Sequence[Axes]:
        """Plot the parameters over time with their bands; see `pyhoid.plots`.

        >>> axes = trace.plot(["K_e", "K_e_dot"])
        """
        from . import plots

        return plots.trace(self, names, axes=axes)

    def report(self, directory: str | PathLike[str], *, title: str | None = None) -> Path:
        """Write the report page of the trace, ``report.html``, to a directory.

        It is the same page as ``hoid track --report`` writes. It compares the trace with batch fits of the
        start and of the last third of the record, and with the true values if the record contains them.

        Parameters
        ----------
        directory : path
            Created if it does not exist.
        title : str, optional
            Heading of the page.

        Returns
        -------
        Path
            Path of the page.

        Raises
        ------
        FileError
            If the page cannot be written.

        >>> page = trace.report("out")
        """
        return Path(self._native.report(Path(directory), title=title))

    def _rows(self) -> list[list[str]]:
        moved = np.flatnonzero(self.time >= self.updated_from)
        first = int(moved[0]) if moved.size else 0
        picked = np.unique(np.linspace(first, len(self) - 1, 8).round().astype(int))
        names = (
            self.operator_names if bool(np.any(self["convertible"])) else self.parameter_names[:6]
        )
        rows = []
        for row in picked:
            cells = [
                repr(Estimate(float(self[n][row]), float(self[f"{n}_se"][row]))) for n in names
            ]
            rows.append([f"{self.time[row]:.2f}", *cells])
        return [["t in s", *names], *rows]

    def __repr__(self) -> str:
        if not len(self):
            return f"Trace by {self.method}: no rows"
        header, *rows = self._rows()
        title = f"Trace by {self.method}, {self.structure}: {len(self)} rows"
        rate = rate_note([self.record])
        title = f"{title}\n{rate}" if rate else title
        return f"{title}\n{_text.plain_table(header, rows)}"

    def _repr_html_(self) -> str:
        header, *rows = self._rows()
        return _text.html_table(
            f"Trace by {self.method}, {self.structure}: {len(self)} rows", header, rows
        )
