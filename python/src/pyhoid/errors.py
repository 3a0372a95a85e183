"""Exceptions of pyhoid, by kind.

Each is a `pyhoid.Error`, and also a `ValueError` for an invalid value or an `OSError` for a file. The
messages name the quantity, the value found, the expected value, and the remedy.
"""

from __future__ import annotations

__all__ = [
    "DataError",
    "Error",
    "EstimationError",
    "FileError",
    "FileMissingError",
    "FormatError",
    "NotConvertibleError",
    "OptionError",
    "StudyStateError",
]


class Error(Exception):
    """Base of all exceptions of pyhoid."""


class OptionError(Error, ValueError):
    """An option that is out of range, unknown, or inconsistent with other options."""


class DataError(Error, ValueError):
    """Data that cannot give a result: not finite, of unequal lengths, too short, or without excitation."""


class EstimationError(Error, ArithmeticError):
    """An estimation without a result: singular regressors, or no finite loss."""


class NotConvertibleError(Error, ValueError):
    """A model that does not represent an operator; the message gives the reason."""


class FileError(Error, OSError):
    """A file that cannot be read or written."""


class FileMissingError(FileError, FileNotFoundError):
    """A file that does not exist."""


class FormatError(Error, ValueError):
    """A file with unexpected content; the message names the position in the file."""


class StudyStateError(Error, RuntimeError):
    """A study directory for which the request is not possible.

    The directory is occupied, belongs to another plan, or lacks shards.
    """
