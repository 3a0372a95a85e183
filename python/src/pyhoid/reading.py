"""Files: reading and writing of records, and surveys of files."""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from os import PathLike
from typing import TYPE_CHECKING, Any

from . import _options, _pyhoid
from ._other_files import readable
from .record import Record

__all__ = ["info", "read", "read_segments", "read_trials", "write"]

if TYPE_CHECKING:
    from typing_extensions import TypedDict, Unpack

    from ._literals import Detrending, Sparse

    class ReadOptions(TypedDict, total=False):
        """The keywords of `read`."""

        input: str | None
        output: str
        time: str | None
        trial: str | None
        sampling_frequency: float | None
        start: float | None
        stop: float | None
        resample: bool
        fill: bool
        sparse: Mapping[str, Sparse] | None
        columns: Sequence[str] | None
        drop_repeated: bool
        unit: Mapping[str, str] | None
        scale: Mapping[str, float | str] | None
        offset: Mapping[str, float | str] | None
        decimate: int | None
        new_sampling_frequency: float | None
        run_in: float
        detrend: Detrending


def read(
    path: str | PathLike[str],
    *,
    input: str | None = "e",
    output: str = "u",
    time: str | None = None,
    trial: str | None = None,
    sampling_frequency: float | None = None,
    start: float | None = None,
    stop: float | None = None,
    resample: bool = False,
    fill: bool = False,
    sparse: Mapping[str, Sparse] | None = None,
    columns: Sequence[str] | None = None,
    drop_repeated: bool = False,
    unit: Mapping[str, str] | None = None,
    scale: Mapping[str, float | str] | None = None,
    offset: Mapping[str, float | str] | None = None,
    decimate: int | None = None,
    new_sampling_frequency: float | None = None,
    run_in: float = 0.0,
    detrend: Detrending = "none",
) -> Record:
    """Read a record from a CSV, Parquet, NPZ, NPY, MATLAB .mat or XDF file.

    Compressed text (``.csv.gz``), Arrow and Feather (with polars) and Excel (with pandas) are also read.

    Parameters
    ----------
    path : path
    input, output : str
        Columns: a name, ``-name``, or a difference such as ``"r-y"``. With ``input=None`` only an output
        is read.
    time : str, optional
        Column of the time, with its unit if the file does not give it: ``"clock:ms"`` (s, ms, us, ns, min,
        h, days, iso, sec+nanosec). By default ``t``, or a column with another common name for time.
    trial : str, optional
        The trial to read from a file with several trials: ``"trial=3"``. `read_trials` reads all trials.
    sampling_frequency : float, optional
        Sampling frequency in Hz; by default from the column ``t`` (s).
    start, stop : float, optional
        Span to use, in s; `stop` itself is excluded.
    resample : bool
        Resample unevenly spaced samples to an even grid by linear interpolation.
    fill : bool
        Bridge missing values by linear interpolation.
    sparse : mapping, optional
        Columns logged at their own times and therefore missing in some rows, by name:
        ``{"u": "hold"}`` holds the last value, ``"linear"`` interpolates, ``"drop"`` drops those rows.
    columns : sequence of str, optional
        Columns to keep in addition to input, output and time; ``[]`` for none. The other columns of a
        long CSV file then take neither time nor memory. By default all columns are kept.
    drop_repeated : bool
        Drop duplicated rows, which have the same time.
    unit : mapping, optional
        Units that the file does not give, by channel: ``{"e": "deg", "u": "V"}``. The numbers are unchanged.
    scale : mapping, optional
        Factors by channel (``e`` and ``u`` are input and output): ``{"u": 12.5}``; with the new unit
        ``{"u": "12.5:deg"}``; or a conversion between units ``{"e": "rad:deg"}``.
    offset : mapping, optional
        Delay with which channels were recorded: in samples ``{"u": 1}`` or in seconds
        ``{"u": "0.0167s"}``.
    decimate : int, optional
        Keep every M-th sample, after a low-pass filter.
    new_sampling_frequency : float, optional
        New sampling frequency in Hz, after a low-pass filter.
    run_in : float
        Time dropped at the start, in s.
    detrend : {"none", "mean", "linear"}
        Trend removed from the input and the output, as the last step.

    Returns
    -------
    Record

    Raises
    ------
    FileError
        If the file is missing (`FileNotFoundError`) or cannot be read (`OSError`).
    FormatError
        If the content is not as expected; the message names the row.

    Warns
    -----
    UserWarning
        Problems that the user should know about: columns left out, problems with the sampling.
        `Record.steps` lists the processing applied to the numbers.

    Examples
    --------
    >>> record = pyhoid.read("run1.csv", input="r-y", output="stick", start=5.0, stop=45.0)
    """
    (record,) = _read(
        path,
        (),
        0.0,
        False,
        input=input,
        output=output,
        time=time,
        trial=trial,
        sampling_frequency=sampling_frequency,
        start=start,
        stop=stop,
        resample=resample,
        fill=fill,
        sparse=sparse,
        columns=columns,
        drop_repeated=drop_repeated,
        unit=unit,
        scale=scale,
        offset=offset,
        decimate=_options.whole("decimate", decimate),
        new_sampling_frequency=new_sampling_frequency,
        run_in=run_in,
        detrend=detrend,
    )
    return record


def read_segments(
    path: str | PathLike[str],
    mask: Sequence[str],
    *,
    shortest: float = 2.0,
    **options: Unpack[ReadOptions],
) -> list[Record]:
    """Read the valid segments of a file, between the problems of its sampling.

    Each segment is a record, to which `identify` gives its own initial states. Leaving samples out can
    bias the result: for example, without saturated samples the largest responses are missing.

    Parameters
    ----------
    path : path
    mask : sequence of str
        Kinds of samples to leave out: any of ``"missing"``, ``"gap"``, ``"stalled"`` and
        ``"saturated"`` (`info` shows which of them a file contains).
    shortest : float
        Length of the shortest segment to use, in s.
    **options
        As in `read`.

    Returns
    -------
    list of Record

    Raises
    ------
    FileError, FormatError
        As in `read`; also if no segment remains.

    Examples
    --------
    >>> fit = pyhoid.identify(pyhoid.read_segments("run1.csv", ["missing", "stalled"]))
    """
    return _read(path, [mask] if isinstance(mask, str) else mask, shortest, True, **options)


def read_trials(path: str | PathLike[str], **options: Unpack[ReadOptions]) -> list[Record]:
    """Read the trials of a file, each as a separate record.

    Parameters
    ----------
    path : path
    **options
        As in `read`. ``trial="trial"`` names the column that numbers the trials. With ``trial="t"``, which
        is the default, a trial starts where the time restarts.

    Returns
    -------
    list of Record

    Raises
    ------
    FileError, FormatError
        As in `read`.

    Examples
    --------
    >>> fit = pyhoid.identify(pyhoid.read_trials("session.csv", trial="trial"))
    """
    return _read(path, (), 0.0, True, **options)


def _read(
    path: str | PathLike[str],
    mask: Sequence[str],
    shortest: float,
    all_trials: bool,
    *,
    input: str | None = "e",
    output: str = "u",
    time: str | None = None,
    trial: str | None = None,
    sampling_frequency: float | None = None,
    start: float | None = None,
    stop: float | None = None,
    resample: bool = False,
    fill: bool = False,
    sparse: Mapping[str, str] | None = None,
    columns: Sequence[str] | None = None,
    drop_repeated: bool = False,
    unit: Mapping[str, str] | None = None,
    scale: Mapping[str, float | str] | None = None,
    offset: Mapping[str, float | str] | None = None,
    decimate: int | None = None,
    new_sampling_frequency: float | None = None,
    run_in: float = 0.0,
    detrend: str = "none",
) -> list[Record]:
    with readable(path) as file:
        found = _pyhoid.read(
            file,
            input=input,
            output=output,
            time=time,
            trial=trial,
            all_trials=all_trials,
            sampling_frequency=sampling_frequency,
            start=start,
            stop=stop,
            resample=resample,
            fill=fill,
            sparse=dict(sparse or {}),
            columns=None if columns is None else list(columns),
            detrend=detrend,
            drop_repeated=drop_repeated,
            unit=dict(unit or {}),
            scale={name: _plain_text(value) for name, value in (scale or {}).items()},
            offset={name: _plain_text(value) for name, value in (offset or {}).items()},
            decimate=_options.whole("decimate", decimate),
            new_sampling_frequency=new_sampling_frequency,
            run_in=float(run_in),
            mask=list(mask),
            shortest=float(shortest),
        )
    records = []
    for parts, steps, notes in found:
        for note in notes:
            warnings.warn(f"{path}: {note}", UserWarning, stacklevel=3)
        record = Record._of(parts)
        record.steps = steps
        records.append(record)
    return records


def _plain_text(value: float | str) -> str:
    return value if isinstance(value, str) else repr(float(value))


def write(path: str | PathLike[str], record: Record) -> None:
    """Write a record as CSV, Parquet, NPZ or .mat.

    The numbers are written with enough digits to be read back exactly.

    Raises
    ------
    FileError, FormatError

    Examples
    --------
    >>> pyhoid.write("run1.parquet", record)
    """
    _pyhoid.write(path, record)


def info(
    path: str | PathLike[str],
    *,
    input: str | None = None,
    output: str | None = None,
    excitation: str | None = None,
    controlled_element: str | None = None,
    time: str | None = None,
    trial: str | None = None,
    sampling_frequency: float | None = None,
) -> dict[str, Any]:
    """Describe the contents and the apparent layout of a file, as ``hoid info --json`` does.

    Parameters
    ----------
    path : path
    input, output, excitation : str, optional
        Columns that are known and need not be found; with ``excitation="none"`` no excitation is searched.
    controlled_element : str, optional
        Text such as ``"90/(s(s+6))"``. With it and a column y, the number of samples by which the control
        was recorded late can be determined.
    time, trial : str, optional
        As in `read`: the column of the time with its unit, and the column that defines the trials.
    sampling_frequency : float, optional
        Sampling frequency in Hz; by default from the column ``t`` (s).

    Returns
    -------
    dict
        ``format``; ``columns`` with unit, type, rows and range of values; ``samplings`` with frequency,
        gaps and jitter; ``trouble`` with the problems of the sampling, their positions, sizes and
        remedies; ``notes``; ``look`` with the columns of the error and the control, the excitation
        and its longest span of whole periods, the lateness of the control, and in ``read`` the
        keywords with which `read` reads the file accordingly (None if they are not certain).

    Raises
    ------
    FileError, FormatError

    Examples
    --------
    >>> look = pyhoid.info("run1.csv")["look"]
    >>> record = pyhoid.read("run1.csv", **look["read"])
    """
    with readable(path) as file:
        found = _pyhoid.info(
            file,
            input=input,
            output=output,
            excitation=excitation,
            controlled_element=controlled_element,
            time=time,
            trial=trial,
            sampling_frequency=sampling_frequency,
        )
    return found
