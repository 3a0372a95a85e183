"""Exceptions of pyhoid, by kind.

Each is a `pyhoid.Error`, and also a `ValueError` for a wrong value or an `OSError` for a file. The
messages name the quantity, what was found, the expected value, and the remedy.
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
    """An option that is out of range, unknown, or does not fit the other options."""


class DataError(Error, ValueError):
    """Data that cannot give a result: not finite, unequal lengths, too short, no excitation."""


class EstimationError(Error, ArithmeticError):
    """An estimation without a result: singular regressors, no finite loss."""


class NotConvertibleError(Error, ValueError):
    """A model that does not represent an operator; the message gives the reason."""


class FileError(Error, OSError):
    """A file that cannot be read or written."""


class FileMissingError(FileError, FileNotFoundError):
    """A file that does not exist."""


class FormatError(Error, ValueError):
    """A file with unexpected content; the message names the place in it."""


class StudyStateError(Error, RuntimeError):
    """A study directory in which the request is not possible.

    It is occupied, belongs to another plan, or lacks shards.
    """
