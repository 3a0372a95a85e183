"""Files: reading and writing records, and what is in a file."""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from os import PathLike
from typing import TYPE_CHECKING, Any

from . import _pyhoid
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

    Packed text (``.csv.gz``), Arrow and Feather (by polars) and Excel (by pandas) are read too.

    Parameters
    ----------
    path : path
    input, output : str
        Columns: a name, ``-name``, or a difference such as ``"r-y"``. ``input=None`` reads only an
        output.
    time : str, optional
        Column of the time, with its unit where that is not found: ``"clock:ms"`` (s, ms, us, ns,
        min, h, iso, sec+nanosec). Without it ``t``, or the column with a common name of a time.
    trial : str, optional
        The trial to read of a file with several: ``"trial=3"``. `read_trials` reads all.
    sampling_frequency : float, optional
        Hz; without it the column ``t`` (s) gives the sampling.
    start, stop : float, optional
        Span to use, in s, without `stop` itself.
    resample : bool
        Resample unevenly sampled data on an even grid by linear interpolation.
    fill : bool
        Bridge missing values by linear interpolation.
    sparse : mapping, optional
        Columns logged at instants of their own, so that some rows lack them, by name: ``{"u":
        "hold"}`` holds the last value, ``"linear"`` draws straight lines, ``"drop"`` drops the rows.
    columns : sequence of str, optional
        Columns to keep in addition to input, output and time; ``[]`` for none. Of a long CSV file the others
        take neither time nor memory. Without it all.
    drop_repeated : bool
        Drop rows that occur twice, with the same time.
    unit : mapping, optional
        Units that the file does not report, by channel: ``{"e": "deg", "u": "V"}``. No number changes.
    scale : mapping, optional
        Factors by channel (``e`` and ``u`` are input and output): ``{"u": 12.5}``, into a unit
        ``{"u": "12.5:deg"}``, or from unit to unit ``{"e": "rad:deg"}``.
    offset : mapping, optional
        By how much channels were recorded late: in samples ``{"u": 1}`` or in seconds
        ``{"u": "0.0167s"}``.
    decimate : int, optional
        Keep every M-th sample, after a low-pass filter.
    new_sampling_frequency : float, optional
        Another sampling frequency in Hz, after a low-pass filter.
    run_in : float
        Seconds dropped at the start.
    detrend : {"none", "mean", "linear"}
        The trend removed from input and output, as the last step.

    Returns
    -------
    Record

    Raises
    ------
    FileError
        When the file is missing (`FileNotFoundError`) or cannot be read (`OSError`).
    FormatError
        When the content is not as expected; the message names the row.

    Warns
    -----
    UserWarning
        What a person should know about the file: columns left out, trouble with the sampling.
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
        decimate=decimate,
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
    """Read the good segments of a file, between the problems of its sampling.

    Each segment is a record: `identify` gives each its own initial states. Leaving samples out can
    bias the result: without the samples at a rail, for example, the largest responses are gone.

    Parameters
    ----------
    path : path
    mask : sequence of str
        What is left out: any of ``"missing"``, ``"gap"``, ``"stalled"`` and ``"saturated"``
        (`info` shows what a file has).
    shortest : float
        Length in s of the shortest segment to use.
    **options
        As in `read`.

    Returns
    -------
    list of Record

    Raises
    ------
    FileError, FormatError
        As in `read`; also when no segment is left.

    Examples
    --------
    >>> fit = pyhoid.identify(pyhoid.read_segments("run1.csv", ["missing", "stalled"]))
    """
    return _read(path, [mask] if isinstance(mask, str) else mask, shortest, True, **options)


def read_trials(path: str | PathLike[str], **options: Unpack[ReadOptions]) -> list[Record]:
    """Read the trials of one file, each as a record of its own.

    Parameters
    ----------
    path : path
    **options
        As in `read`. ``trial="trial"`` names the column that counts the trials, ``"t"`` the places
        where the time starts again, which are found without it too.

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
            scale={name: _written(value) for name, value in (scale or {}).items()},
            offset={name: _written(value) for name, value in (offset or {}).items()},
            decimate=decimate,
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


def _written(value: float | str) -> str:
    return value if isinstance(value, str) else repr(float(value))


def write(path: str | PathLike[str], record: Record) -> None:
    """Write a record as CSV, Parquet, NPZ or .mat.

    The numbers have enough digits to read the same ones back.

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
    """Describe a file and what it looks like, as ``hoid info --json`` does.

    Parameters
    ----------
    path : path
    input, output, excitation : str, optional
        Columns that are known, which are not searched for; ``excitation="none"`` looks for none.
    controlled_element : str, optional
        As ``"90/(s(s+6))"``: with it and a column y it is found by how many samples the control was
        recorded late.
    time, trial : str, optional
        As in `read`: the column of the time with its unit, and what makes the trials of the file.
    sampling_frequency : float, optional
        Hz; without it the column ``t`` (s) gives the sampling.

    Returns
    -------
    dict
        ``format``; ``columns`` with unit, type, rows and the range of their values; ``samplings``
        with frequency, gaps and jitter; ``trouble`` with the problems of the sampling, where,
        how much, and the remedy; ``notes``; ``look`` with the columns of error and control, the
        excitation and its longest span of whole periods, by how much the control is late, and in
        ``read`` the keywords by which `read` takes the file so (None if that is not certain).

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
