"""Files that Python reads but hoid does not: Arrow and Feather, Excel.

Common Python packages read these files. Their content is passed on as a file that hoid reads, so
that every option of `read` and every check of the data is the same. A message names the file that the
user gave.
"""

from __future__ import annotations

import shutil
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from os import PathLike, fspath
from pathlib import Path
from typing import Any

from .errors import Error, FileError, FileMissingError, FormatError

__all__ = ["readable"]


def _write_parquet(table: Any, path: Path, directory: Path) -> Path:
    made = directory / f"{path.stem}.parquet"
    table.write_parquet(made, compression="snappy")
    return made


def _arrow(path: Path, directory: Path) -> Path:
    try:
        import polars
    except ModuleNotFoundError:
        raise FormatError(
            f"{path}: reading Arrow or Feather needs polars, which is not installed:"
            " pip install polars"
        ) from None
    try:
        table = polars.read_ipc(path)
    except Exception as error:
        raise FormatError(f"{path} cannot be read as Arrow: {error}") from error
    return _write_parquet(table, path, directory)


def _excel(path: Path, directory: Path) -> Path:
    try:
        import pandas

        table = pandas.read_excel(path)
    except ImportError as error:
        raise FormatError(
            f"{path}: reading Excel needs pandas and a package for this format ({error});"
            " install them, or save the sheet as CSV"
        ) from None
    except Exception as error:
        raise FormatError(f"{path} cannot be read as Excel: {error}") from error
    made = directory / f"{path.stem}.csv"
    table.to_csv(made, index=False)
    return made


#: Reading function for each file extension.
_READERS: dict[str, Callable[[Path, Path], Path]] = {
    "arrow": _arrow,
    "feather": _arrow,
    "ipc": _arrow,
    "xlsx": _excel,
    "xls": _excel,
    "ods": _excel,
}


@contextmanager
def readable(path: str | PathLike[str]) -> Iterator[str | PathLike[str]]:
    """Provide a file with the same content that hoid reads, until the context ends."""
    ending = Path(fspath(path)).suffix.lower().lstrip(".")
    reader = _READERS.get(ending)
    if reader is None:
        yield path
        return
    given = Path(fspath(path))
    if not given.exists():
        raise FileMissingError(f"{path} cannot be read: there is no such file; check the name")
    directory = Path(tempfile.mkdtemp(prefix="hoid-"))
    try:
        try:
            made = reader(given, directory)
        except OSError as error:
            if isinstance(error, Error):
                raise
            raise FileError(f"{path} cannot be read: {error}; check the permissions") from error
        try:
            yield made
        except Error as error:
            # The message names the file that the user gave.
            raise type(error)(str(error).replace(str(made), str(path))) from None
    finally:
        shutil.rmtree(directory, ignore_errors=True)
