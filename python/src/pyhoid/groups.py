"""Groups of recorded runs by subject and condition, and virtual experiments for trying them out."""

from __future__ import annotations

from collections.abc import Sequence
from os import PathLike
from pathlib import Path

from . import _options, _pyhoid
from ._options import Progress
from .errors import StudyStateError
from .studies import Results

__all__ = ["group", "group_manifest", "simulate_group", "simulate_people"]


def group(
    manifest: str | PathLike[str],
    directory: str | PathLike[str],
    *,
    jobs: int | None = None,
    resume: bool = False,
    csv: bool = False,
    progress: Progress = False,
) -> Results:
    """Analyse many recorded runs by subject and condition.

    Parameters
    ----------
    manifest : path
        The file ``group.toml`` or its directory; `group_manifest` creates its text.
    directory : path
        Directory to which the tables and pages are written.
    jobs, resume, csv, progress
        As in `study`.

    Returns
    -------
    Results
        ``people``, ``estimates``, ``averages``, ``delays``, ``trace-averages``, ...;
        `Results.pages` contains the page of the group, ``report.html``, and one for each subject.

    Raises
    ------
    FileError, OptionError, StudyStateError

    Examples
    --------
    >>> found = pyhoid.group("runs", "results")
    >>> found["people"].to_pandas()
    """
    file = Path(manifest)
    file = file / "group.toml" if file.is_dir() else file
    finished, estimates = _pyhoid.group(
        file,
        Path(directory),
        jobs=_options.whole("jobs", jobs),
        resume=resume,
        csv=csv,
        progress=_options.reporter(progress, "runs"),
    )
    if not finished:
        raise StudyStateError(
            f"the group was stopped; completed parts are in {directory}; continue with resume=True"
        )
    return Results(directory, finished=finished, estimates=estimates)


def group_manifest(
    directory: str | PathLike[str], pattern: str = "{subject}_{condition}_{run}.csv"
) -> tuple[str, list[str]]:
    """Return the manifest of a directory as TOML text, and the files that it does not list.

    The manifest lists the files whose names match the pattern.

    Examples
    --------
    >>> text, others = pyhoid.group_manifest("runs", "{subject}_{condition}_{run}.csv")
    """
    return _pyhoid.group_manifest(Path(directory), pattern)


def simulate_group(
    directory: str | PathLike[str],
    *,
    subjects: int = 3,
    conditions: Sequence[str] = ("C1", "C2", "C3", "C4", "C5", "C6"),
    runs: int = 5,
    between_subjects: float = 0.1,
    between_runs: float = 0.03,
    remnant_order: int = 1,
    noise_level: float = 0.1,
    seed: int = 1,
    trouble: Sequence[str] = (),
) -> int:
    """Simulate a virtual experiment.

    Writes a file for each run, the true parameters to ``truth.csv``, and a manifest for `group`.

    Parameters
    ----------
    directory : path
        Created if it does not exist.
    subjects, runs : int
        Number of subjects, and number of runs for each subject and condition.
    conditions : sequence of str
    between_subjects, between_runs : float
        Spread of the parameters between subjects and between the runs of a subject; 0.1 is 10 %.
    remnant_order : int
    noise_level : float
        P_n = var(u_n) / var(u).
    seed : int
    trouble : sequence of str
        Sampling defects: any of ``"jitter"``, ``"missing"``, ``"repeated"``, ``"slow-clock"``,
        ``"saturated"``, ``"quantised"`` and ``"stalled"``.

    Returns
    -------
    int
        Number of runs.

    Raises
    ------
    OptionError
        For an invalid experiment.
    StudyStateError
        If the directory already holds an experiment.

    Examples
    --------
    >>> pyhoid.simulate_group("runs", subjects=5, conditions=["C1", "C4"])
    """
    return _pyhoid.simulate_group(
        Path(directory),
        subjects=_options.whole("subjects", subjects),
        conditions=list(conditions),
        runs=_options.whole("runs", runs),
        between_subjects=float(between_subjects),
        between_runs=float(between_runs),
        remnant_order=_options.whole("remnant_order", remnant_order),
        noise_level=float(noise_level),
        seed=_options.whole("seed", seed),
        trouble=list(trouble),
    )


def simulate_people(
    directory: str | PathLike[str],
    *,
    subjects: int = 3,
    plants: Sequence[str] = ("integrator", "lagged-integrator", "double-integrator"),
    form: str | None = None,
    remnants: Sequence[str] = ("lag", "broad-band", "signal-dependent", "pulsed", "intermittent"),
    remnant_share: tuple[float, float] = (0.05, 0.5),
    sample_time: float = 1 / 60,
    runs: int = 5,
    between_runs: float = 0.03,
    seed: int = 1,
    trouble: Sequence[str] = (),
) -> int:
    """Simulate people with realistic operators and remnants.

    People are drawn from the family of operators, with parameters in published ranges. Writes a
    file with the columns t, e, u, d, y for each run, the true parameters to ``truth.csv``, and a
    manifest for `group`.

    Parameters
    ----------
    directory : path
        Created if it does not exist.
    subjects, runs : int
        Number of subjects, and number of runs for each subject and controlled element.
    plants : sequence of str
        Controlled elements: ``"integrator"`` 1/s, ``"lagged-integrator"`` 1/(s(s+1)),
        ``"double-integrator"`` 1/s^2.
    form : str, optional
        Form of all operators; by default the forms that people typically adopt with each element.
    remnants : sequence of str
        Kinds of remnant, which alternate over the subjects.
    remnant_share : tuple of float
        Smallest and largest share of the variance of u due to the remnant.
    sample_time : float
        Sample time in s.
    between_runs : float
        Spread of the parameters between the runs of a subject; 0.1 is 10 %.
    seed : int
    trouble : sequence of str
        As in `simulate_group`.

    Returns
    -------
    int
        Number of runs.

    Raises
    ------
    OptionError
        For an invalid experiment.
    StudyStateError
        If the directory already holds an experiment.

    Examples
    --------
    >>> pyhoid.simulate_people("runs", subjects=3, plants=["integrator"])
    """
    return _pyhoid.simulate_people(
        Path(directory),
        subjects=_options.whole("subjects", subjects),
        plants=list(plants),
        form=form,
        remnants=list(remnants),
        remnant_share=(float(remnant_share[0]), float(remnant_share[1])),
        sample_time=float(sample_time),
        runs=_options.whole("runs", runs),
        between_runs=float(between_runs),
        seed=_options.whole("seed", seed),
        trouble=list(trouble),
    )
