"""Exceptions of hoid, by kind.

Every one is a `pyhoid.Error`; where Python people expect another base as well (`ValueError` for a wrong value, `OSError` for files), it is
that too. The messages name the quantity, what was found, what was expected, and the remedy.
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
    """Base of all exceptions of hoid."""


class OptionError(Error, ValueError):
    """An option out of its range, unknown, or without meaning beside the others."""


class DataError(Error, ValueError):
    """Data that cannot give a result: not finite, of unequal length, too short, without excitation."""


class EstimationError(Error, ArithmeticError):
    """An estimation that has no result: singular regressors, no finite loss."""


class NotConvertibleError(Error, ValueError):
    """A model that stands for no operator; the message says why."""


class FileError(Error, OSError):
    """A file that cannot be read or written."""


class FileMissingError(FileError, FileNotFoundError):
    """A file that is not there."""


class FormatError(Error, ValueError):
    """A file whose content is not what was expected; the message names the place in it."""


class StudyStateError(Error, RuntimeError):
    """A directory of a study that does not allow what was asked for: occupied, of another plan, with shards missing."""
