"""Design of an experiment: the number and length of the runs, and the forcing function."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from os import PathLike, fspath
from pathlib import Path
from typing import TYPE_CHECKING, Any

from . import _options, _pyhoid
from ._json_result import JsonResult

if TYPE_CHECKING:
    from typing import Literal

    import pandas as pd

__all__ = ["ExperimentDesign", "design"]


class ExperimentDesign(JsonResult):
    """A forcing function and the expected errors. `design` creates it.

    Examples
    --------
    >>> designed = pyhoid.design(controlled_element="4/s", wanted={"tau_e": 0.05})
    >>> designed.runs_needed, designed.errors["tau_e"]
    """

    def _read(self, found: dict[str, Any]) -> None:
        super()._read(found)
        #: Form of the typical person's operator.
        self.form: str = found["form"]
        #: Number of runs, and length of a run in s.
        self.runs: int = found["runs"]
        self.length: float = found["length_s"]
        #: Number of runs needed for the accepted errors of all requested quantities.
        self.runs_needed: int = found["runs_needed"]
        #: Standard deviation of one person from run to run, relative to the quantity.
        self.run_to_run: float = found["run_to_run"]
        #: Source of this standard deviation.
        self.run_to_run_source: str = found["run_to_run_source"]
        #: Ratio of peak to rms of the forcing function.
        self.crest_factor: float = found["crest_factor"]
        #: Each line: omega_rad_s, amplitude, phase_rad, and the response of the person with its errors.
        self.lines: list[dict[str, Any]] = found["lines"]
        #: Response of the operator between the lines, with its errors.
        self.response: list[dict[str, Any]] = found["response"]
        #: Response to a displayed target between the lines, with its errors; empty without such a target.
        self.response_to_target: list[dict[str, Any]] = found["response_to_target"]
        #: The person with the largest errors, if there are several people.
        self.worst: dict[str, Any] | None = found["worst"]
        #: Expected errors for the other people.
        self.people: list[dict[str, Any]] = found["people"]
        #: Expected errors with another forcing function, if ``against`` is given.
        self.against: dict[str, Any] | None = found["against"]
        #: Number of people and runs needed to find a difference, if ``difference`` is given.
        self.difference: dict[str, Any] | None = found["difference"]
        self._parameters: list[dict[str, Any]] = _rows(found)

    @property
    def errors(self) -> dict[str, float]:
        """Standard error of each quantity for the person over all runs, by name.

        >>> designed.errors["crossover"]
        """
        return {row["quantity"]: row["standard_error_person"] for row in self._parameters}

    def to_dataframe(
        self,
        table: Literal[
            "errors", "lines", "response", "response_to_target", "people", "power"
        ] = "errors",
    ) -> pd.DataFrame:
        """Return a table of the result: errors of the typical person, lines, response to the error and to
        a displayed target, errors of each person, or power over runs and people.

        >>> designed.to_dataframe("lines")
        """
        import pandas as pd

        if table == "errors":
            return pd.DataFrame(self._parameters)
        if table == "people":
            rows = [{"person": one["name"], **row} for one in self.people for row in _rows(one)]
            return pd.DataFrame(rows)
        if table == "power":
            power = self.difference["table"] if self.difference else []
            rows = [
                {"runs": row["runs"], "people": int(people), "power": value}
                for row in power
                for people, value in row["power"].items()
            ]
            return pd.DataFrame(rows, columns=["runs", "people", "power"])
        return pd.DataFrame(getattr(self, table))

    def to_svg(self, figure: Literal["response", "runs"] = "response") -> str:
        """Draw a figure as the text of an SVG file: the lines with the response of the person, or the
        errors over the number of runs.

        >>> from pathlib import Path
        >>> Path("design.svg").write_text(designed.to_svg())
        """
        response, runs = _pyhoid.design_figures_of(self._text)
        return {"response": response, "runs": runs}[figure]

    def write(self, directory: str | PathLike[str]) -> None:
        """Write scenario.toml, lab.toml (for ``hoid lab --config``), forcing.csv and design.json.

        >>> designed.write("design")
        """
        scenario, lab, forcing = _pyhoid.design_files_of(self._text, "scenario.toml")
        path = Path(directory)
        path.mkdir(parents=True, exist_ok=True)
        files = {
            "scenario.toml": scenario,
            "lab.toml": lab,
            "forcing.csv": forcing,
            "design.json": self._text,
        }
        for name, text in files.items():
            if text:
                (path / name).write_text(text)

    def to_json(self) -> str:
        """Return the object of ``hoid design --json``, which `from_json` reads.

        >>> text = designed.to_json()
        """
        return self._text

    @classmethod
    def from_json(cls, text: str) -> ExperimentDesign:
        """Read a design that `to_json` wrote or ``hoid design --json`` printed.

        Raises
        ------
        DataError
            For a text that is not a result, was changed, or comes from another version.

        Examples
        --------
        >>> again = pyhoid.ExperimentDesign.from_json(designed.to_json())
        """
        _pyhoid.design_files_of(text, "scenario.toml")
        return cls(text)

    def __repr__(self) -> str:
        runs = f"{self.runs} run{'s' if self.runs != 1 else ''} of {self.length:g} s"
        rows = [
            f"{r['quantity']}: {r['value']:.4g} ± {r['standard_error_person']:.2g} {r['unit']}"
            for r in self._parameters
        ]
        return "\n".join([f"Expected errors of {runs}", *(row.rstrip() for row in rows)])


def _rows(found: Mapping[str, Any]) -> list[dict[str, Any]]:
    loop = found["open_loop"]
    named = [
        ("crossover", "rad/s", loop["crossover_rad_s"]),
        ("phase_margin", "deg", loop["phase_margin_deg"]),
        *((p["name"], p["unit"], p) for p in found["parameters"]),
    ]
    return [
        {
            "quantity": name,
            "value": _number(one["value"]),
            "standard_error": _number(one["standard_error"]),
            "standard_error_person": _number(one["standard_error_person"]),
            "unit": unit,
        }
        for name, unit, one in named
    ]


def _number(value: float | None) -> float:
    # JSON cannot represent infinity, such as the T_I of a pure integration.
    return float("nan") if value is None else value


def design(
    people: str | PathLike[str] = "population",
    *,
    controlled_element: str | tuple[Sequence[float], Sequence[float]] | None = None,
    wanted: Mapping[str, float] | str | Sequence[str] = (),
    difference: Mapping[str, float] | str | None = None,
    power: float = 0.8,
    alpha: float = 0.05,
    between_people: float | str | PathLike[str] | None = None,
    run_to_run: float | str | PathLike[str] | None = None,
    condition: str | None = None,
    form: str | None = None,
    disturbance: bool = False,
    display: Literal["compensatory", "pursuit", "preview"] = "compensatory",
    length: float = 81.92,
    runs: int | None = None,
    lines: int = 10,
    spacing: int = 3,
    band: tuple[float, float] = (0.2, 18.0),
    shelf: float = 0.2,
    max_rms_e: float | None = None,
    max_u: float | None = None,
    remnant_share: float = 0.2,
    remnant_time_constant: float = 0.06,
    against: str | PathLike[str] | None = None,
    seed: int = 0,
) -> ExperimentDesign:
    """Design an experiment: the number and length of the runs, and the forcing function.

    Parameters
    ----------
    people : str or path
        ``"population"`` (typical people, adapted to the controlled element), a scenario (``.toml``), a fit
        (``.json``), the directory that `group` wrote, or its ``population.json``.
    controlled_element : str or (array_like, array_like)
        Text such as ``"90/(s(s+6))"``, or numerator and denominator; by default from the scenario or group.
    wanted : mapping, str, or sequence of str
        Accepted standard errors: ``{"tau_e": 0.05, "phase_margin": 2}``, or ``"tau_e=5%"``; in deg
        for the margin, in s for ``tau_f``, otherwise relative. Without it, all parameters are
        requested.
    difference : mapping or str
        A difference between two conditions that the experiment should find: ``{"crossover": 0.5}`` in the
        unit of the quantity, or ``"crossover=10%"`` of its value.
    power, alpha : float
        Probability of finding the difference, and the significance level of the test.
    between_people : float, str or path
        Relative standard deviation, over people, of the difference, or a file that contains it: a
        comparison as JSON, the result of a group with several conditions, or a ``population.json``.
        By default it comes from ``people`` if they provide it; otherwise it is 0.1.
    run_to_run : float, str or path
        Relative standard deviation of one person from run to run, or a directory that `group` wrote, whose
        runs determine it. It is part of the errors for the person, which determine the number of runs. By
        default it comes from ``people`` if they provide it; otherwise it is 0.13.
    condition : str
        Name of the condition, for a group with several conditions.
    form : str
        Form of the population's operator; by default the form that people typically adopt with the element.
    disturbance : bool
        True if the forcing function enters at the input of the controlled element; otherwise it is the target.
    display : {"compensatory", "pursuit", "preview"}
        Display of the task. For ``"pursuit"`` and ``"preview"``, a target and a disturbance with separate
        lines are designed, and the errors of the response to the target (``K_f``, ``tau_f``) are also
        predicted.
    length : float
        Length of a run in s, the period of the forcing function.
    runs : int
        Number of runs; by default the number needed for the accepted errors.
    lines, spacing, band, shelf
        Number of lines, their smallest distance in multiples of 1/length, their lowest and highest frequency
        in rad/s, and the largest amplitude above the crossover relative to the mean amplitude below it.
    max_rms_e, max_u : float
        Largest rms of e and largest rms of u.
    remnant_share, remnant_time_constant : float
        Share of the variance of u due to the remnant, and time constant of the remnant in s.
    against : str or path
        Another forcing function: ``"reference"``, a scenario, or a table of lines.
    seed : int
        Seed of the search for phases.

    Returns
    -------
    ExperimentDesign

    Raises
    ------
    OptionError, FileError, DataError

    Examples
    --------
    >>> designed = pyhoid.design(controlled_element="4/s", wanted={"tau_e": 0.05})
    >>> print(designed)
    """
    element = (
        None if controlled_element is None else _options.controlled_element(controlled_element)
    )
    text = _pyhoid.design(
        fspath(people),
        condition=condition,
        controlled_element=element,
        form=form,
        wanted=_assignments(wanted),
        disturbance=disturbance,
        remnant=(remnant_share, remnant_time_constant),
        length=length,
        runs=_options.whole("runs", runs),
        lines=_options.whole("lines", lines),
        spacing=_options.whole("spacing", spacing, 1, 2**32 - 1),
        band=band,
        shelf=shelf,
        limits=(max_rms_e, max_u),
        against=None if against is None else fspath(against),
        difference=None if difference is None else ",".join(_assignments(difference)),
        statistics=(power, alpha, None if between_people is None else str(between_people)),
        run_to_run=None if run_to_run is None else str(run_to_run),
        display=display,
        seed=_options.whole("seed", seed),
    )
    return ExperimentDesign(text)


def _assignments(given: Mapping[str, float] | str | Sequence[str]) -> list[str]:
    if isinstance(given, str):
        return given.split(",")
    if isinstance(given, Mapping):
        return [f"{name}={value!r}" for name, value in given.items()]
    return list(given)
