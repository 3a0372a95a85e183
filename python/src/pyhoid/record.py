"""Records: evenly spaced samples of the signals of one run."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from difflib import get_close_matches
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from . import _pyhoid, _text
from ._arrays import FloatArray, signal
from .errors import DataError, OptionError

if TYPE_CHECKING:
    import pandas as pd
    import polars as pl
    import xarray as xr

    from ._literals import Detrending

__all__ = ["Record"]


def _is_frozen(array: FloatArray) -> bool:
    """Return whether no code can write to an array: the array owns its numbers or is a view of one that
    does, and none of these arrays is writeable."""
    at: Any = array
    while isinstance(at, np.ndarray):
        if at.flags.writeable:
            return False
        at = at.base
    return at is None or isinstance(at, bytes)


def _read_only(array: FloatArray) -> FloatArray:
    """Return a read-only array: a copy, unless the given array is already read-only."""
    if _is_frozen(array):
        return array
    own = np.array(array, dtype=np.float64, copy=True)
    own.flags.writeable = False
    # A view of a read-only array cannot be made writeable.
    return own.view()


def _is_instant(times: npt.NDArray[Any] | None) -> bool:
    return times is not None and times.dtype.kind in "mM"


def _seconds(times: npt.NDArray[Any]) -> npt.NDArray[Any]:
    """Convert times to s: durations directly, dates relative to the first date."""
    if times.dtype.kind not in "mM":
        try:
            return np.asarray(times, dtype=np.float64)
        except (TypeError, ValueError):
            raise DataError(
                f"the times are not numbers (the first is {times[0]!r}), expected s, dates or durations;"
                " convert text with pandas.to_datetime"
            ) from None
    if np.isnat(times).any():
        row = int(np.flatnonzero(np.isnat(times))[0])
        raise DataError(f"the time of row {row} is missing; fill it, or give sample_time")
    elapsed = times - times[0] if times.dtype.kind == "M" else times
    nanoseconds = elapsed.astype("timedelta64[ns]").astype(np.int64)
    # Conversion of decimals to times truncates to 1 ns; whole tenths of a millisecond must be kept.
    return np.asarray(np.round(nanoseconds / 1e9, 8), dtype=np.float64)


def _own(array: FloatArray) -> FloatArray:
    """Make an array read-only; no other code holds a reference to it."""
    array.flags.writeable = False
    return array.view()


class Record:
    """The signals of one run, with one value for each sample.

    The numbers belong to the record: arrays that other code can write to are copied, so that the record
    cannot change unexpectedly; read-only arrays (such as those of another record) are shared.

    Parameters
    ----------
    e : array_like, shape (N,), optional
        Input, the tracking error. Omit it for structures without an input (ar, ma, arma).
    u : array_like, shape (N,)
        Output, the control.
    sample_time : float
        Sample time Ts in s.
    start_time : float, default 0
        Time of the first sample in s.
    label : str, optional
        Name of the record for messages and reports.
    units : mapping of str to str, optional
        Units of the channels.
    roles : mapping of str to str, optional
        Roles of displayed channels for the person, such as ``{"f_t": "feedforward:0.5"}`` for a
        target that is displayed 0.5 s ahead. A result whose model leaves such a channel out is
        doubtful.
    **channels : array_like, shape (N,)
        Other channels by name, such as ``f_t`` for the forcing function.

    Raises
    ------
    DataError
        For values that are masked or not finite, channels of unequal lengths, or arrays with more than one
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
        roles: Mapping[str, str] | None = None,
        **channels: Any,
    ) -> None:
        self._fill(
            e=None if e is None else signal(e, "e"),
            u=signal(u, "u"),
            sample_time=float(sample_time),
            start_time=float(start_time),
            label=label,
            units=dict(units or {}),
            roles=dict(roles or {}),
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
        roles: dict[str, str] | None = None,
        input_name: str = "e",
        output_name: str = "u",
        input_lead: float = 0.0,
        own: bool = False,
    ) -> None:
        kept = _own if own else _read_only
        self.e: FloatArray | None = None if e is None else kept(e)
        self.u: FloatArray = kept(u)
        self.sample_time: float = sample_time
        self.start_time: float = start_time
        self.label: str = label
        self.units: dict[str, str] = units
        #: Roles of displayed channels for the person.
        self.roles: dict[str, str] = dict(roles or {})
        self.channels: dict[str, FloatArray] = {
            name: kept(values) for name, values in channels.items()
        }
        self.input_name: str = input_name
        self.output_name: str = output_name
        #: Time by which a sample of e is later than the sample of u in the same row, s: if the record was
        #: decimated, e is taken in the middle of its hold.
        self.input_lead: float = input_lead
        #: Processing applied to the numbers, when the record was read from a file and afterwards.
        self.steps: list[str] = []

    @classmethod
    def _of(cls, parts: Mapping[str, Any]) -> Record:
        record = cls.__new__(cls)
        record._fill(**parts, own=True)
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
        """Create a record from a table; other numeric columns become channels.

        `input` and `output` are columns, differences of two columns (``"r-y"``), or columns with a sign
        (``"-e"``).

        The sample time is `sample_time`, or follows from a column ``t`` or the index: times in s, a
        DatetimeIndex (whose first time becomes 0) or a TimedeltaIndex. The times must be evenly spaced.

        Examples
        --------
        >>> record = pyhoid.Record.from_pandas(pandas.read_csv("run1.csv"), input="error")
        """
        columns = {str(name): frame[name].to_numpy() for name in frame.columns}
        index = frame.index
        if index.dtype.kind in "mM" or "datetime64" in str(index.dtype):
            # Times with a time zone are converted to UTC.
            times = index.to_numpy(dtype="datetime64[ns]" if index.dtype.kind != "m" else None)
        else:
            times = np.asarray(index)
            times = times if times.dtype.kind == "f" else None
        return cls._of_table(columns, times, input=input, output=output, sample_time=sample_time)

    @classmethod
    def from_polars(
        cls,
        frame: pl.DataFrame,
        *,
        input: str | None = "e",
        output: str = "u",
        sample_time: float | None = None,
    ) -> Record:
        """Create a record from a table of polars; other numeric columns become channels.

        The sample time is `sample_time`, or follows from a column ``t``: times in s, dates with times, or
        durations.

        Examples
        --------
        >>> record = pyhoid.Record.from_polars(polars.read_ipc("run1.arrow"), input="error")
        """
        columns = {name: frame[name].to_numpy() for name in frame.columns}
        return cls._of_table(columns, None, input=input, output=output, sample_time=sample_time)

    @classmethod
    def _of_table(
        cls,
        columns: dict[str, npt.NDArray[Any]],
        index: npt.NDArray[Any] | None,
        *,
        input: str | None,
        output: str,
        sample_time: float | None,
    ) -> Record:
        """Create a record from columns by name, with separate times if there is no column t."""
        for name in (input, output):
            if name is not None and name not in columns:
                if "-" in name:
                    # A difference of columns or a column with a sign, as in files.
                    names = list(columns)
                    terms = _pyhoid.signal_of(name, names)
                    columns[name] = np.sum(
                        [sign * signal(columns[names[k]], names[k]) for sign, k in terms], axis=0
                    )
                    continue
                near = get_close_matches(name, columns, 1, 0.6)
                meant = f"; did you mean {near[0]}?" if near else ""
                raise DataError(
                    f"the table has no column {name}{meant}; it has {', '.join(columns)};"
                    " choose columns with input and output"
                )
        times = columns.pop("t", None)
        if times is None and (sample_time is None or _is_instant(index)):
            times = index
        times = None if times is None else _seconds(times)
        start = 0.0
        if sample_time is None:
            if times is None or len(times) < 2:
                raise OptionError("the table has no times: give sample_time in s, or a column t")
            # The same rules as for files apply, so that both give the same record.
            sample_time, row = _pyhoid.even_times(times)
            if sample_time is None:
                steps = np.diff(times)
                raise DataError(
                    f"the sampling is uneven: row {row} comes {steps[max(row, 1) - 1]:g} s after the"
                    f" previous row, expected {float(np.median(steps)):g} s;"
                    " write the table to a file and read it with resample=True, or give sample_time"
                )
        if times is not None:
            start = float(times[0])
        named = {
            name: values
            for name, values in columns.items()
            if name not in (input, output) and values.dtype.kind in "fiu"
        }
        record = cls.__new__(cls)
        # A column may have any name, even the name of a keyword.
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
        """Names of the channels: input, output, other channels."""
        first = [] if self.e is None else [self.input_name]
        return [*first, self.output_name, *self.channels]

    def span(self, start: float | None = None, stop: float | None = None) -> Record:
        """Return the samples with ``start <= t < stop`` (s), as views of the same arrays.

        Raises
        ------
        DataError
            If the span contains no samples.

        >>> record.span(5, 45)
        """

        # If a bound coincides with a sample, apart from rounding, it refers to this sample.
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
            roles=self.roles,
            channels={name: values[first:end] for name, values in self.channels.items()},
            input_name=self.input_name,
            output_name=self.output_name,
            input_lead=self.input_lead,
            own=True,
        )
        record.steps = list(self.steps)
        return record

    def with_signals(self, input: str, output: str) -> Record:
        """Return the record with other channels as its input (the error) and its output (the control).

        >>> record.with_signals("f_t", "u")
        """
        all_channels = {name: self[name] for name in self.names}
        for name in (input, output):
            if name not in all_channels:
                names = ", ".join(all_channels)
                raise DataError(f"the record has no channel {name}; it has {names}")
        if input == output:
            raise DataError(f"{input} is both input and output, expected two channels")
        record = Record.__new__(Record)
        record._fill(
            e=all_channels.pop(input),
            u=all_channels.pop(output),
            sample_time=self.sample_time,
            start_time=self.start_time,
            label=self.label,
            units=self.units,
            roles=self.roles,
            channels=all_channels,
            input_name=input,
            output_name=output,
            input_lead=self.input_lead,
            own=True,
        )
        record.steps = list(self.steps)
        return record

    def detrended(self, how: Detrending = "mean") -> Record:
        """Return the record with the ``"mean"`` or the ``"linear"`` trend of input and output removed.

        >>> record.detrended("linear")
        """
        record = Record._of(_pyhoid.detrended(self, how) | {"input_lead": self.input_lead})
        record.steps = list(self.steps)
        return record

    def decimated(self, decimate: int | str = "auto") -> Record:
        """Return the record at a lower rate: every n-th sample after a linear-phase low-pass filter.

        All channels have the same filter. The input is taken in the middle of the n samples over which it is
        then held, so that delays are unchanged. `identify`, `track` and `describe` do this automatically
        above 200 Hz.

        Parameters
        ----------
        decimate : "auto", "off" or int
            ``"auto"``: for rates above 200 Hz, the factor whose new rate is nearest to 100 Hz.

        >>> record.decimated(10)
        """
        found = _pyhoid.decimated(self, str(decimate))
        if found is None:
            return self
        parts, step = found
        record = Record._of(parts | {"input_lead": self.input_lead + parts["input_lead"]})
        record.steps = [*self.steps, step]
        return record

    def to_pandas(self) -> pd.DataFrame:
        """Return all channels as a table with the time in s as index.

        >>> record.to_pandas()
        """
        import pandas as pd

        return pd.DataFrame(
            {name: self[name] for name in self.names},
            index=pd.Index(self.time, name="t"),
            copy=False,
        )

    def to_polars(self) -> pl.DataFrame:
        """Return all channels as a table of polars, after the time in s as column ``t``.

        >>> record.to_polars()
        """
        import polars as pl

        return pl.DataFrame({"t": self.time, **{name: self[name] for name in self.names}})

    def to_xarray(self) -> xr.Dataset:
        """Return all channels over the coordinate ``t`` (s), with their units.

        >>> record.to_xarray()
        """
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
            "roles",
            "channels",
            "input_name",
            "output_name",
            "input_lead",
        )
        return (_record_of, ({key: getattr(self, key) for key in keys}, list(self.steps)))

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


def _record_of(parts: Mapping[str, Any], steps: Sequence[str] = ()) -> Record:
    """Restore a record from a pickle, with the same checks as for a new record."""
    record = Record._of(parts)
    record.steps = list(steps)
    _pyhoid.check_record(record)
    return record
