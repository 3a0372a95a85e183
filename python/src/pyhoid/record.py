"""Records: evenly sampled signals of one run."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from . import _pyhoid, _text
from ._arrays import FloatArray, signal
from .errors import DataError, OptionError

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr

__all__ = ["Record"]


def _read_only(array: FloatArray) -> FloatArray:
    view = array.view()
    view.flags.writeable = False
    return view


class Record:
    """The signals of one run, with one value for each sample.

    Contiguous arrays of float64 are not copied: do not change them afterwards.

    Parameters
    ----------
    e : array_like, shape (N,), optional
        Input, the tracking error. Leave it out for structures without an input (ar, ma, arma).
    u : array_like, shape (N,)
        Output, the control.
    sample_time : float
        Sample time Ts in s.
    start_time : float, default 0
        Time of the first sample in s.
    label : str, optional
        Name for messages and reports.
    units : mapping of str to str, optional
        Units of channels.
    **channels : array_like, shape (N,)
        Other channels by name, such as ``f_t`` for the forcing function.

    Raises
    ------
    DataError
        For values that are masked or not finite, unequal lengths, and arrays with more than one
        dimension. It is a `ValueError`.

    Examples
    --------
    >>> record = pyhoid.Record(e=error, u=control, sample_time=0.01)
    >>> fit = pyhoid.identify(record)
    """

    def __init__(
        self,
        *,
        u: Any,
        sample_time: float,
        e: Any = None,
        start_time: float = 0.0,
        label: str = "",
        units: Mapping[str, str] | None = None,
        **channels: Any,
    ) -> None:
        self._fill(
            e=None if e is None else signal(e, "e"),
            u=signal(u, "u"),
            sample_time=float(sample_time),
            start_time=float(start_time),
            label=label,
            units=dict(units or {}),
            channels={name: signal(values, name) for name, values in channels.items()},
        )
        _pyhoid.check_record(self)

    def _fill(
        self,
        *,
        e: FloatArray | None,
        u: FloatArray,
        sample_time: float,
        start_time: float,
        label: str,
        units: dict[str, str],
        channels: dict[str, FloatArray],
        input_name: str = "e",
        output_name: str = "u",
    ) -> None:
        self.e: FloatArray | None = None if e is None else _read_only(e)
        self.u: FloatArray = _read_only(u)
        self.sample_time: float = sample_time
        self.start_time: float = start_time
        self.label: str = label
        self.units: dict[str, str] = units
        self.channels: dict[str, FloatArray] = {
            name: _read_only(values) for name, values in channels.items()
        }
        self.input_name: str = input_name
        self.output_name: str = output_name
        #: What was done to the numbers when the record was read from a file.
        self.steps: list[str] = []

    @classmethod
    def _of(cls, parts: Mapping[str, Any]) -> Record:
        record = cls.__new__(cls)
        record._fill(**parts)
        return record

    @classmethod
    def from_pandas(
        cls,
        frame: pd.DataFrame,
        *,
        input: str | None = "e",
        output: str = "u",
        sample_time: float | None = None,
    ) -> Record:
        """Make a record from a table; other columns with numbers become channels.

        The sample time is `sample_time`, or that of a column ``t`` or an index of times in s, which
        must be even.
        """
        columns = {str(name): frame[name].to_numpy() for name in frame.columns}
        for name in (input, output):
            if name is not None and name not in columns:
                raise DataError(f"the table has no column {name}; it has {', '.join(columns)}")
        times = columns.pop("t", None)
        if times is None and sample_time is None:
            index = np.asarray(frame.index)
            times = index if index.dtype.kind == "f" else None
        start = 0.0
        if sample_time is None:
            if times is None or len(times) < 2:
                raise OptionError("the table has no times: give sample_time in s, or a column t")
            steps = np.diff(times)
            sample_time = float((times[-1] - times[0]) / (len(times) - 1))
            if not np.allclose(steps, sample_time, rtol=1e-3, atol=0):
                row = int(np.argmax(np.abs(steps - sample_time)))
                raise DataError(
                    f"the sampling is uneven: row {row + 1} comes {steps[row]:g} s after the one"
                    f" before, expected {sample_time:g} s;"
                    " write the table to a file and read it with resample=True, or give sample_time"
                )
            sample_time = float(f"{sample_time:.9g}")
        if times is not None:
            start = float(times[0])
        named = {
            name: values
            for name, values in columns.items()
            if name not in (input, output) and values.dtype.kind in "fiu"
        }
        record = cls.__new__(cls)
        # A column may have any name, even that of a keyword.
        record._fill(
            e=None if input is None else signal(columns[input], input),
            u=signal(columns[output], output),
            sample_time=float(sample_time),
            start_time=float(start),
            label="",
            units={},
            channels={name: signal(values, name) for name, values in named.items()},
        )
        _pyhoid.check_record(record)
        return record

    @property
    def time(self) -> FloatArray:
        """Times of the samples in s, shape (N,)."""
        return self.start_time + self.sample_time * np.arange(len(self), dtype=np.float64)

    def __len__(self) -> int:
        return len(self.u)

    def __getitem__(self, name: str) -> FloatArray:
        if name == self.output_name:
            return self.u
        if name == self.input_name and self.e is not None:
            return self.e
        try:
            return self.channels[name]
        except KeyError:
            raise KeyError(
                f"there is no channel {name}; the record has {', '.join(self.names)}"
            ) from None

    def __contains__(self, name: object) -> bool:
        return name in self.names

    @property
    def names(self) -> list[str]:
        """Names of the channels: input, output, others."""
        first = [] if self.e is None else [self.input_name]
        return [*first, self.output_name, *self.channels]

    def span(self, start: float | None = None, stop: float | None = None) -> Record:
        """The samples with ``start <= t < stop`` (s), as views of the same arrays.

        Raises
        ------
        DataError
            When the span has no samples.
        """

        # A bound that falls on a sample, apart from rounding, takes that sample.
        def index(time: float | None, usual: int) -> int:
            if time is None:
                return usual
            return max(int(np.ceil((time - self.start_time) / self.sample_time - 1e-6)), 0)

        first, end = index(start, 0), min(index(stop, len(self)), len(self))
        if first >= end:
            raise DataError(
                f"there are no samples from {start} to {stop} s;"
                f" the record runs from {self.start_time:g} to {self.time[-1]:g} s"
            )
        record = Record.__new__(Record)
        record._fill(
            e=None if self.e is None else self.e[first:end],
            u=self.u[first:end],
            sample_time=self.sample_time,
            start_time=self.start_time + first * self.sample_time,
            label=self.label,
            units=self.units,
            channels={name: values[first:end] for name, values in self.channels.items()},
            input_name=self.input_name,
            output_name=self.output_name,
        )
        return record

    def detrended(self, how: str = "mean") -> Record:
        """The record with the ``"mean"`` or the ``"linear"`` trend of input and output removed."""
        return Record._of(_pyhoid.detrended(self, how))

    def to_pandas(self) -> pd.DataFrame:
        """All channels as a table with the time in s as index."""
        import pandas as pd

        return pd.DataFrame(
            {name: self[name] for name in self.names},
            index=pd.Index(self.time, name="t"),
            copy=False,
        )

    def to_xarray(self) -> xr.Dataset:
        """All channels over the coordinate ``t`` (s), with their units."""
        import xarray as xr

        variables = {
            name: ("t", self[name], {"units": self.units.get(name, "")}) for name in self.names
        }
        return xr.Dataset(
            variables,
            coords={"t": ("t", self.time, {"units": "s"})},
            attrs={"sample_time": self.sample_time},
        )

    def __reduce__(self) -> tuple[Any, ...]:
        keys = (
            "e",
            "u",
            "sample_time",
            "start_time",
            "label",
            "units",
            "channels",
            "input_name",
            "output_name",
        )
        return (_record_of, ({key: getattr(self, key) for key in keys},))

    def _rows(self) -> list[list[str]]:
        rows = []
        for name in self.names:
            values = self[name]
            figures = (values.min(), values.max(), values.mean(), values.std())
            rows.append(
                [name, *(_text.number(float(v), 4) for v in figures), self.units.get(name, "")]
            )
        return rows

    def _title(self) -> str:
        label = f" {self.label}" if self.label else ""
        return (
            f"Record{label}: {len(self)} samples of {self.sample_time:g} s,"
            f" from {self.start_time:g} s"
        )

    def __repr__(self) -> str:
        header = ["channel", "least", "greatest", "mean", "sd", "unit"]
        return f"{self._title()}\n{_text.plain_table(header, self._rows())}"

    def _repr_html_(self) -> str:
        return _text.html_table(
            self._title(), ["", "least", "greatest", "mean", "sd", "unit"], self._rows()
        )


def _record_of(parts: Mapping[str, Any]) -> Record:
    return Record._of(parts)
