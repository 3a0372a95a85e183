"""Comparison of conditions and of people, from recordings with their manifest or the results of a group."""

from __future__ import annotations

import tempfile
from collections.abc import Mapping, Sequence
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

from . import _options, _pyhoid
from ._json_result import JsonResult
from ._options import Progress
from .errors import OptionError

if TYPE_CHECKING:
    from typing import Literal

    import pandas as pd

__all__ = ["Comparison", "compare"]

#: A factor: its name, ``"name:level=a,b;level=c"``, or levels and their members by name.
Factor = str | Mapping[str, Mapping[str, Sequence[str]]]


class Comparison(JsonResult):
    """Differences between conditions and between people. `compare` creates it.

    Examples
    --------
    >>> found = pyhoid.compare("results")
    >>> found.to_dataframe()[["quantity", "value", "low", "high", "p_adjusted"]]
    """

    def _read(self, found: dict[str, Any]) -> None:
        super()._read(found)
        #: Each difference: quantity, unit, factor, from, to, value, standard_error, interval, t, p, p_adjusted ...
        self.differences: list[dict[str, Any]] = found["differences"]
        #: The mean over people for each quantity and condition.
        self.means: list[dict[str, Any]] = found["means"]
        #: The estimates for people from which means and differences are computed.
        self.estimates: list[dict[str, Any]] = found["estimates"]
        #: Changes from run to run, with ``covariate="run"``.
        self.learning: list[dict[str, Any]] = found["learning"]
        #: Missing estimates, with the reasons.
        self.left_out: list[dict[str, Any]] = found["left_out"]

    @property
    def sentences(self) -> list[str]:
        """Each difference as a sentence for a paper."""
        return [difference["sentence"] for difference in self.differences]

    def to_dataframe(
        self, table: Literal["differences", "means", "estimates", "learning", "left_out"] = "differences"
    ) -> pd.DataFrame:
        """Return a table of the result with a row for each entry; ends of intervals are ``low`` and ``high``.

        >>> found.to_dataframe("estimates")
        """
        import pandas as pd

        return pd.DataFrame([_flat(row) for row in getattr(self, table)])

    def mixed_model(self, quantity: str, fixed: str = "C(condition)", data: pd.DataFrame | None = None) -> Any:
        """Fit a linear mixed model to the estimates, with an intercept for each person
        (statsmodels, REML).

        All estimates have the same weight, regardless of their standard errors. The model allows designs that
        `compare` does not support.

        Parameters
        ----------
        quantity : str
            A quantity that was compared.
        fixed : str
            The fixed effects, as a formula over the columns of ``to_dataframe("estimates")``.
        data : pandas.DataFrame, optional
            The table ``to_dataframe("estimates")``, with additional columns.

        Returns
        -------
        statsmodels.regression.mixed_linear_model.MixedLMResults

        Raises
        ------
        OptionError
            For a quantity that was not compared.

        Examples
        --------
        >>> found.mixed_model("crossover").summary()
        >>> rows = found.to_dataframe("estimates")
        >>> rows["trained"] = rows["subject"].isin(["P09", "P11"])
        >>> found.mixed_model("crossover", "condition + trained", rows).params
        """
        from statsmodels.formula.api import mixedlm  # type: ignore[import-untyped]

        rows = self.to_dataframe("estimates") if data is None else data
        known = sorted(set(rows["quantity"]))
        if quantity not in known:
            raise OptionError(f"quantity: found {quantity!r}, expected {', '.join(known)}")
        rows = rows[rows["quantity"] == quantity]
        return mixedlm(f"value ~ {fixed}", rows, groups=rows["subject"]).fit(reml=True)

    def to_svg(self) -> str:
        """Draw people by condition with the mean and its interval, as the text of an SVG file.

        >>> from pathlib import Path
        >>> Path("people.svg").write_text(found.to_svg())
        """
        return _pyhoid.comparison_figure_of(self._text)

    def to_json(self) -> str:
        """Return the object of ``hoid compare --json``, which `from_json` reads.

        >>> text = found.to_json()
        """
        return self._text

    @classmethod
    def from_json(cls, text: str) -> Comparison:
        """Read a comparison that `to_json` wrote or ``hoid compare --json`` printed.

        Raises
        ------
        DataError
            For a text that is not a result, was changed, or comes from another version.

        Examples
        --------
        >>> again = pyhoid.Comparison.from_json(found.to_json())
        """
        _pyhoid.comparison_figure_of(text)
        return cls(text)

    def __repr__(self) -> str:
        return "\n".join([repr(self.verdict), *self.sentences])


def _flat(row: Mapping[str, Any]) -> dict[str, Any]:
    flat = dict(row)
    if "interval" in flat:
        flat["low"], flat["high"] = flat.pop("interval")
    size = flat.pop("effect_size", None)
    if "sentence" in flat:
        flat["effect_size"], flat["size"] = (size["name"], size["value"]) if size else (None, None)
        flat["people"] = len(flat["people"])
        flat["unweighted"] = flat["unweighted"]["value"]
    return flat


def compare(
    results: str | PathLike[str],
    *,
    factor: Factor | Sequence[str] | None = None,
    variation: Literal["within", "between"] | None = None,
    of: str | Sequence[str] = (),
    covariate: Literal["run"] | None = None,
    adjust: Literal["holm", "none"] = "holm",
    weights: Literal["penalised", "reml"] = "penalised",
    directory: str | PathLike[str] | None = None,
    jobs: int | None = None,
    progress: Progress = False,
) -> Comparison:
    """Test whether conditions or people differ.

    Parameters
    ----------
    results : path
        Recordings with their manifest (the file ``group.toml`` or its directory), which are first
        analysed; or the directory that `group` wrote, or a file with the output of ``hoid group --json``.
    factor : str, mapping, or sequence of str
        The variable in which conditions or people differ: ``"axis:roll=C1r,C2r;pitch=C1p,C2p"``, or
        ``{"axis": {"roll": ["C1r", "C2r"], "pitch": ["C1p", "C2p"]}}``. With several factors, their
        interactions are also compared. Without a factor each condition is a level.
    variation : {"within", "between"}
        Whether each person is in all levels or in one; by default determined from the results.
    of : str or sequence of str
        ``"crossover"``, ``"phase_margin"``, ``"tau_e"`` (the default is these three), ``"gain_db@2.5"``,
        ``"phase_deg@2.5"``, ``"rms_e"``, ``"rms_u"``, or parameters such as ``"K"``, ``"T_L"``. To compare
        parameters, recordings are analysed in one form, chosen by the evidence from all people.
    covariate : {"run"}
        Removes the effect of learning over the runs, and reports it.
    adjust : {"holm", "none"}
        Adjustment of the p-values for multiple tests.
    weights : {"penalised", "reml"}
        Estimate of the variance between people from which the weights are computed: kept away from
        zero, or by restricted maximum likelihood (REML), with which the intervals are too short for
        few people.
    directory : path, optional
        Directory in which the results of recordings are kept for the next comparison; without it they are
        removed.
    jobs, progress
        Used if recordings are analysed, as in `study`.

    Returns
    -------
    Comparison

    Raises
    ------
    OptionError, FileError, DataError

    Examples
    --------
    >>> found = pyhoid.compare("results", of=["crossover", "tau_e"])
    >>> print(found)
    """
    if factor is None:
        factors = []
    elif isinstance(factor, str):
        factors = [factor]
    elif isinstance(factor, Mapping):
        factors = [_typed(name, levels) for name, levels in factor.items()]
    else:
        factors = list(factor)
    with tempfile.TemporaryDirectory(prefix="hoid-") as removed:
        text = _pyhoid.compare(
            Path(results),
            factors=factors,
            variation=variation,
            of=of.split(",") if isinstance(of, str) else list(of),
            covariate=covariate,
            adjust=adjust,
            weights=weights,
            directory=Path(directory or removed),
            jobs=_options.whole("jobs", jobs),
            progress=_options.reporter(progress, "runs"),
        )
    return Comparison(text)


def _typed(name: str, levels: Mapping[str, Sequence[str]]) -> str:
    return f"{name}:" + ";".join(f"{level}={','.join(members)}" for level, members in levels.items())
