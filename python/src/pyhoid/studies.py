"""Monte Carlo studies: plans, shards, merged tables."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping, Sequence
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from . import _options, _pyhoid
from ._options import Progress
from .errors import StudyStateError

if TYPE_CHECKING:
    import pandas as pd
    import polars as pl
    import pyarrow as pa

__all__ = ["Plan", "Results", "Table", "merge", "plan", "plans", "results", "study"]

Plan = _pyhoid.Plan


class Table(Mapping[str, Any]):
    """A table of results: columns by name, as arrays.

    Parameters
    ----------
    path : path
        Path of the file, which is read when a column is first accessed.

    Examples
    --------
    >>> table = pyhoid.results("out")["fits"]
    >>> table["K_e"]
    """

    def __init__(self, path: str | PathLike[str]) -> None:
        self.path = Path(path)
        self._columns: dict[str, Any] | None = None

    def to_dict(self) -> dict[str, Any]:
        """Return all columns by name.

        >>> results["fits"].to_dict()["K_e"]
        """
        if self._columns is None:
            self._columns = {
                name: np.asarray(values, dtype=object) if isinstance(values, list) else values
                for name, values in _pyhoid.read_table(self.path).items()
            }
        return self._columns

    def to_pandas(self) -> pd.DataFrame:
        """Return the table as a pandas DataFrame.

        >>> results["fits"].to_pandas()
        """
        import pandas as pd

        return pd.DataFrame(self.to_dict())

    def to_polars(self) -> pl.DataFrame:
        """Return the table as a polars DataFrame.

        >>> results["fits"].to_polars()
        """
        import polars as pl

        return pl.DataFrame({name: _listed(values) for name, values in self.to_dict().items()})

    def to_arrow(self) -> pa.Table:
        """Return the table as an Arrow table.

        >>> results["fits"].to_arrow()
        """
        import pyarrow as pa

        return pa.table({name: _listed(values) for name, values in self.to_dict().items()})

    def __getitem__(self, name: str) -> Any:
        try:
            return self.to_dict()[name]
        except KeyError:
            raise KeyError(
                f"there is no column {name}; the table has {', '.join(self.to_dict())}"
            ) from None

    def __iter__(self) -> Iterator[str]:
        return iter(self.to_dict())

    def __len__(self) -> int:
        return len(self.to_dict())

    def __repr__(self) -> str:
        columns = self.to_dict()
        rows = len(next(iter(columns.values()))) if columns else 0
        return f"<pyhoid.Table {self.path.name}: {rows} rows, columns {', '.join(columns)}>"


def _listed(values: Any) -> Any:
    return list(values) if getattr(values, "dtype", None) == object else values


class Results(Mapping[str, Table]):
    """The tables of a directory by name: ``results["fits"]``, or ``results.fits``.

    Attributes
    ----------
    directory : Path
    finished : bool
        False for a shard that has not been merged.
    estimates : int
        Number of estimates made by this run.
    pages : list of Path
        The pages of a group, in the directory of the tables.

    Examples
    --------
    >>> pyhoid.results("out").fits.to_pandas()
    """

    def __init__(
        self, directory: str | PathLike[str], *, finished: bool = True, estimates: int = 0
    ) -> None:
        self.directory = Path(directory)
        self.finished = finished
        self.estimates = estimates
        files = sorted([*self.directory.glob("*.parquet"), *self.directory.glob("*.csv")])
        self.pages = sorted(self.directory.glob("*.html"))
        self._tables = {file.stem: Table(file) for file in files}

    def __getitem__(self, name: str) -> Table:
        try:
            return self._tables[name]
        except KeyError:
            raise KeyError(
                f"there is no table {name}; the directory has {', '.join(self._tables) or 'none'}"
            ) from None

    def __getattr__(self, name: str) -> Table:
        tables = self.__dict__.get("_tables", {})
        if name in tables:
            return tables[name]  # type: ignore[no-any-return]
        raise AttributeError(
            f"there is no table {name}; the directory has {', '.join(tables) or 'none'}"
        )

    def __iter__(self) -> Iterator[str]:
        return iter(self._tables)

    def __len__(self) -> int:
        return len(self._tables)

    def __repr__(self) -> str:
        return f"<pyhoid.Results {self.directory}: tables {', '.join(self._tables) or 'none yet'}>"


def plan(source: str | PathLike[str] | Plan, *, replications: int | None = None) -> Plan:
    """Load a plan of Monte Carlo runs.

    Parameters
    ----------
    source : path, str or Plan
        A file (TOML), the text of a plan, or the name of a plan included with hoid (see `plans`).
    replications : int, optional
        Replaces the number of replications in the plan.

    Raises
    ------
    OptionError
        For an invalid plan; the message names the line.

    Examples
    --------
    >>> pyhoid.plan("plan.toml", replications=10).estimates
    """
    replications = _options.whole("replications", replications)
    if isinstance(source, Plan):
        return source if replications is None else Plan(text=source.text, replications=replications)
    text = os.fspath(source)
    if "\n" in text:
        return Plan(text=text, replications=replications)
    if Path(text).exists():
        return Plan(path=Path(text), replications=replications)
    if text.endswith(".toml"):
        return Plan(path=Path(text), replications=replications)
    return Plan(name=text, replications=replications)


def plans() -> dict[str, str]:
    """Return the names and titles of the plans included with hoid.

    Examples
    --------
    >>> pyhoid.plans()
    """
    return dict(_pyhoid.plan_names())


def study(
    source: str | PathLike[str] | Plan,
    directory: str | PathLike[str],
    *,
    shard: str | tuple[int, int] | None = None,
    jobs: int | None = None,
    replications: int | None = None,
    resume: bool = False,
    csv: bool = False,
    progress: Progress = False,
) -> Results:
    """Run a study or one of its shards, and write the tables to a directory.

    An interrupt stops the study within a second; with ``resume=True`` it then continues, with nothing lost
    or computed twice.

    Parameters
    ----------
    source : path, str or Plan
        As in `plan`.
    directory : path
    shard : str or (int, int), optional
        ``"2/7"`` or ``(2, 7)`` runs the second of seven shards; `merge` joins them.
    jobs : int, optional
        Number of threads; by default one per core.
    replications : int, optional
        Replaces the number of replications in the plan.
    resume : bool
        Whether a stopped study is continued.
    csv : bool
        Whether the tables are written as CSV instead of Parquet.
    progress : bool or callable

    Returns
    -------
    Results

    Raises
    ------
    OptionError
        For an invalid plan.
    StudyStateError
        If the directory holds a study and `resume` is False.

    Examples
    --------
    >>> results = pyhoid.study("plan.toml", "out", replications=10)
    """
    found = plan(source, replications=replications)
    share = f"{shard[0]}/{shard[1]}" if isinstance(shard, tuple) else shard
    target = Path(directory)
    finished, estimates, tables = found.run(
        target,
        shard=share,
        jobs=_options.whole("jobs", jobs),
        resume=resume,
        csv=csv,
        progress=_options.reporter(progress, "estimates"),
    )
    if not finished:
        raise StudyStateError(
            f"{found.name} was stopped; completed parts are in {target}; continue with resume=True"
        )
    return Results(target, finished=bool(tables), estimates=estimates)


def merge(
    shards: Sequence[str | PathLike[str]], directory: str | PathLike[str], *, csv: bool = False
) -> Results:
    """Merge the shards of a study.

    Raises
    ------
    StudyStateError
        If shards belong to different plans, or if a shard is missing or duplicated.

    Examples
    --------
    >>> pyhoid.merge(["shard-1", "shard-2"], "out")
    """
    finished, estimates, _ = _pyhoid.merge_shards(
        [Path(shard) for shard in shards], Path(directory), csv
    )
    return Results(directory, finished=finished, estimates=estimates)


def results(directory: str | PathLike[str]) -> Results:
    """Return the tables in the directory of a study or a group.

    Raises
    ------
    StudyStateError
        If the directory contains no tables.

    Examples
    --------
    >>> pyhoid.results("out")["fits"].to_pandas()
    """
    found = Results(directory)
    if not found:
        raise StudyStateError(
            f"{directory} holds no tables: expected the directory of a finished study or group"
        )
    return found
