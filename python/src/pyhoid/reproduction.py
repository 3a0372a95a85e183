"""Reproduction of the tables, figures and claims of the thesis."""

from __future__ import annotations

from collections.abc import Sequence
from os import PathLike
from pathlib import Path
from typing import NamedTuple

from . import _options, _pyhoid
from ._options import Progress
from .errors import StudyStateError
from .studies import Results, Table

__all__ = ["Reproduction", "reproduce"]


class Reproduction(NamedTuple):
    """The result of `reproduce`.

    Examples
    --------
    >>> pyhoid.reproduce("out", only=["fig-5"]).figures["fig-5"]
    """

    #: The page that shows the whole reproduction.
    page: Path
    #: Image files by name, as in ``figures["fig-11"]``; `pyhoid.plots.reference` draws them again.
    figures: dict[str, Path]
    #: Tables, and the numbers of each figure, by name.
    tables: dict[str, Table]
    #: Results of the studies by name.
    studies: dict[str, Results]
    #: Number of claims that hold, hold in part, do not hold and cannot be tested; None if not requested.
    claims: dict[str, int] | None


def reproduce(
    directory: str | PathLike[str],
    *,
    only: Sequence[str] = (),
    replications: int = 100,
    jobs: int | None = None,
    recordings: str | PathLike[str] | None = None,
    progress: Progress = False,
) -> Reproduction:
    """Reproduce the tables, figures and claims of the thesis (Ortiz Moya 2023).

    This is ``hoid reproduce``. Completed studies are not run again; an interrupted study
    continues.

    Parameters
    ----------
    directory : path
    only : sequence of str
        Tables, figures, appendices, studies, ``"experiment"``, or ``"claims"``; by default everything.
    replications : int
        Number of replications of each cell.
    jobs : int, optional
        Number of threads; by default one per core.
    recordings : path, optional
        Recorded people in place of virtual people, with ``only="experiment"``: a directory with the
        manifest that ``hoid group init`` writes, or a manifest.
    progress : bool or callable

    Returns
    -------
    Reproduction

    Raises
    ------
    OptionError
        For an unknown name.
    StudyStateError
        If the directory holds studies with another number of replications.

    Examples
    --------
    >>> made = pyhoid.reproduce("out", only=["fig-5", "table-2"], replications=10)
    """
    if isinstance(only, str):
        only = [only]
    target = Path(directory)
    made = _pyhoid.reproduce(
        target,
        only=list(only),
        replications=_options.whole("replications", replications),
        jobs=_options.whole("jobs", jobs),
        recordings=None if recordings is None else Path(recordings),
        progress=_options.reporter(progress, "estimates"),
    )
    if made is None:
        raise StudyStateError(
            f"the reproduction was stopped; completed parts are in {target};"
            " make the same call again to continue"
        )
    page, _, tally = made
    names = ("hold", "hold, and more so", "hold in part", "do not hold", "cannot be tested")
    data = [*(target / "tables").glob("*.csv"), *(target / "figures").glob("*.csv")]
    return Reproduction(
        page=Path(page),
        figures={file.stem: file for file in sorted((target / "figures").glob("*.svg"))},
        tables={file.stem: Table(file) for file in sorted(data, key=lambda file: file.stem)},
        studies={
            found.name: Results(found)
            for found in sorted((target / "studies").glob("*"))
            if found.is_dir()
        },
        claims=None if tally is None else dict(zip(names, tally, strict=True)),
    )
