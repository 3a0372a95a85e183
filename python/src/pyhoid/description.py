"""Describing functions: the response of a person at the lines of the excitation."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from . import _options, _pyhoid, _text
from ._arrays import FloatArray
from ._faults import faults_of
from ._pickling import Call, restore, state_of
from .errors import OptionError
from .estimates import Estimate, estimates
from .record import Record
from .verdict import Reason, Verdict

if TYPE_CHECKING:
    import pandas as pd

    from ._literals import Faults

__all__ = ["DescribingFunction", "Description", "describe", "describing_function"]


#: Attributes of the native object that a pickle contains.
_ANSWERS = ("per_run", "remnant_spectrum", "figures")


class DescribingFunction:
    """The response of a person at the lines of the excitation. `describing_function` creates it.

    Columns are accessed by name and have one value for each line: ``omega`` (rad/s), ``harmonic``,
    ``response`` (complex), ``response_se``, ``coherence``, ``magnitude_db``, ``phase_deg``. Standard errors
    have the suffix ``_se``; they are NaN if there is only one run.

    Examples
    --------
    >>> found = pyhoid.describing_function(records, channel="f_t")
    >>> found.omega, found.response
    """

    def __init__(self, native: _pyhoid.DescribingFunction, call: Call | None = None) -> None:
        self._native = native
        self._call = call
        self.columns: dict[str, npt.NDArray[Any]] = native.columns()

    def __getstate__(self) -> dict[str, Any]:
        return state_of(self, _ANSWERS)

    def __setstate__(self, state: Any) -> None:
        restore(self, state, _ANSWERS)

    def __getitem__(self, name: str) -> npt.NDArray[Any]:
        return self.columns[name]

    def __len__(self) -> int:
        return len(self.columns["omega"])

    @property
    def omega(self) -> FloatArray:
        """Frequencies of the lines, rad/s."""
        return self.columns["omega"]

    @property
    def response(self) -> npt.NDArray[np.complex128]:
        """The response at the lines."""
        return self.columns["response"]

    @property
    def per_run(self) -> npt.NDArray[np.complex128]:
        """The response of each run (or period), shape (runs, lines)."""
        return np.array(self._native.per_run)

    @property
    def remnant_spectrum(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Frequencies (rad/s), power density of the remnant, and its standard error."""
        omega, density, error = self._native.remnant_spectrum
        return omega, density, error

    @property
    def figures(self) -> dict[str, Any]:
        """Number of runs, and estimates of off_line_share, noise_ratio, rms_e and rms_u."""
        found = dict(self._native.figures)
        runs = found.pop("runs")
        return {"runs": runs, **estimates(found)}

    def gain_lead_delay(
        self,
        *,
        lead: bool = True,
        weights: str = "coherence",
        delay: tuple[float, float] = (0.0, 1.0),
    ) -> dict[str, Any]:
        """Fit ``K (1 + T_L s) exp(-tau s)`` to the response at the lines.

        Returns the gain, the lead (s), the delay (s) and the misfit.

        Parameters
        ----------
        lead : bool
            False fixes T_L at 0.
        weights : {"coherence", "variance", "uniform"}
        delay : (float, float)
            Smallest and largest tau in s.

        >>> described.gain_lead_delay()
        """
        found = self._native.gain_lead_delay(lead=lead, weights=weights, delay=delay)
        return {
            name: Estimate(*pair) if isinstance(pair, tuple) else pair
            for name, pair in found.items()
        }

    def margins(
        self, num: str | Sequence[float], den: Sequence[float] | None = None
    ) -> dict[str, Estimate | None]:
        """Return the crossover frequency and the phase margin with a controlled element.

        `num` is the element as text, such as ``"90/(s(s+6))"``; or `num` and `den` are its coefficients
        in descending powers of s.

        >>> described.margins("90/(s(s+6))")
        """
        return estimates(self._native.margins(_options.controlled_element(num, den)))

    def to_pandas(self) -> pd.DataFrame:
        """Return the lines as a table.

        >>> described.to_pandas()
        """
        import pandas as pd

        return pd.DataFrame(self.columns)

    def _rows(self) -> list[list[str]]:
        return [
            [
                _text.number(float(self["omega"][k]), 4),
                repr(Estimate(float(self["magnitude_db"][k]), float(self["magnitude_db_se"][k]))),
                repr(Estimate(float(self["phase_deg"][k]), float(self["phase_deg_se"][k]))),
                _text.number(float(self["coherence"][k]), 3),
            ]
            for k in range(len(self))
        ]

    def __repr__(self) -> str:
        header = ["omega (rad/s)", "magnitude (dB)", "phase (deg)", "coherence"]
        return (
            f"Describing function at {len(self)} lines\n{_text.plain_table(header, self._rows())}"
        )

    def _repr_html_(self) -> str:
        header = ["omega (rad/s)", "magnitude (dB)", "phase (deg)", "coherence"]
        return _text.html_table(f"Describing function at {len(self)} lines", header, self._rows())


def describing_function(
    records: Record | Sequence[Record],
    *,
    channel: str | None = "f_t",
    harmonics: Sequence[int] | None = None,
    omega: Sequence[float] | None = None,
    period: float | None = None,
    least_amplitude: float = 0.05,
    averaging: str = "ratios",
    reference: str | None = None,
    realisation: str = "record",
    start: float | None = None,
    stop: float | None = None,
    offset_samples: float = 0.0,
    detrend: str = "none",
    smoothing_bins: int = 8,
) -> DescribingFunction:
    """Compute the describing function from e to u from Fourier coefficients at the lines.

    Parameters
    ----------
    records : Record or sequence of Record
        Runs with the same excitation.
    channel : str, optional
        Channel in whose spectrum the lines are searched; not used if the lines are given.
    harmonics, omega : sequence, optional
        The lines, as multiples of the fundamental or in rad/s; both need `period`.
    period : float, optional
        Period of the excitation in s.
    least_amplitude : float
        Smallest amplitude of a line, relative to the largest.
    averaging : {"ratios", "reference", "same-excitation"}
        Mean of U/E over the runs; cross spectra with the channel `reference`; or cross spectra of runs
        whose excitation has the same phases.
    reference : str, optional
        The channel for ``averaging="reference"``.
    realisation : {"record", "period"}
        Whether a whole record or a period counts as one run.
    start, stop : float, optional
        Span in s.
    offset_samples : float
        ``e[k]`` belongs to ``u[k + offset_samples]``.
    detrend : {"none", "mean", "linear"}
    smoothing_bins : int
        Number of bins averaged into one value of the remnant spectrum.

    Returns
    -------
    DescribingFunction

    Raises
    ------
    DataError
        If the span does not contain whole periods, or a line has no power.

    Examples
    --------
    >>> found = pyhoid.describing_function(records, channel="f_t")
    >>> found["magnitude_db"], found["coherence"]
    """
    settings = {name: value for name, value in locals().items() if name != "records"}
    given = harmonics is not None or omega is not None
    several = tuple(_options.as_records(records))
    there = list(several[0].channels) if several else []
    signals = (several[0].input_name, several[0].output_name) if several else ()
    if not given and several and channel is not None and channel not in (*there, *signals):
        raise OptionError(
            f"channel is {channel}, but the records have {', '.join(there) or 'only e and u'};"
            " name the recorded excitation, or use pyhoid.describe, which searches for it"
        )
    return DescribingFunction(
        _pyhoid.describing_function(
            several,
            harmonics=None if harmonics is None else [_options.whole("harmonics", h, 1) for h in harmonics],
            omega=None if omega is None else [float(w) for w in omega],
            period=period,
            channel=None if given else channel,
            least_amplitude=least_amplitude,
            averaging=averaging,
            reference=reference,
            realisation=realisation,
            start=start,
            stop=stop,
            offset_samples=offset_samples,
            detrend=detrend,
            smoothing_bins=_options.whole("smoothing_bins", smoothing_bins),
        ),
        Call("describing_function", several, settings),
    )


class Description:
    """A describing function with its loop and its reliability. `describe` creates it.

    Attributes
    ----------
    function : DescribingFunction
        Lines with standard errors and coherence, remnant, runs.
    phase_deg : ndarray
        Phase at each line in deg, without jumps from line to line.
    open_loop : dict or None
        Crossover frequency (rad/s), phase margin (deg), gain margin (dB) and its frequency, each an
        Estimate or None; None without a controlled element.
    remnant_share, noise_ratio : Estimate
        Share of the power of u at non-excited frequencies, and this share including the noise at the
        lines (P_n).
    verdict : Verdict
        Reliability of the result: `level`, `reasons`, `notes`, and `of` for each answer.
    excitation : str or None
        The channel of the excitation.
    period : float
        Period of the excitation, s.

    Examples
    --------
    >>> pyhoid.describe(records, excitation="f_t").remnant_share
    """

    def __init__(self, native: _pyhoid.Description, call: Call | None = None) -> None:
        self.function = DescribingFunction(native.function(), call)
        self._json: str = native.to_json()
        #: The settings that were used, by name.
        self.settings: dict[str, str] = {name: value for name, value, _ in native.settings}
        #: Faults found in the records: kind, channel, from, to, size, action.
        self.faults: list[dict[str, Any]] = faults_of(native)
        self.phase_deg: FloatArray = native.phase_deg
        found = native.open_loop
        self.open_loop: dict[str, Estimate | None] | None = (
            None if found is None else estimates(found)
        )
        share, ratio = native.remnant
        self.remnant_share = Estimate(*share)
        self.noise_ratio = Estimate(*ratio)
        self.verdict = Verdict._read(native.verdict)
        self.excitation, self.period = native.excitation

    @property
    def reasons(self) -> list[Reason]:
        """The reasons of the verdict."""
        return self.verdict.reasons

    @property
    def notes(self) -> list[Reason]:
        """The notes of the verdict."""
        return self.verdict.notes

    def to_json(self) -> str:
        """Return the object of ``hoid describe --json`` as text.

        >>> pyhoid.describe(record).to_json()
        """
        return self._json

    def __repr__(self) -> str:
        parts = [repr(self.verdict), repr(self.function)]
        parts.extend(f"{name}: {value}" for name, value in (self.open_loop or {}).items())
        parts.append(f"remnant: {self.remnant_share} of the power of u at non-excited frequencies")
        return "\n".join(parts)


def describe(
    records: Record | Sequence[Record],
    *,
    excitation: str | None = None,
    lines: Sequence[float] | None = None,
    period: float | None = None,
    controlled_element: str | tuple[Sequence[float], Sequence[float]] | None = None,
    start: float | None = None,
    stop: float | None = None,
    offset_samples: float = 0.0,
    detrend: str = "none",
    faults: Faults = "bridge",
    decimate: int | str = "auto",
) -> Description:
    """Describe how a person responds at the lines of a periodic excitation, without a model.

    This is ``hoid describe``. If there are three or more records, each is a run; otherwise each period
    of a record is a run.

    Parameters
    ----------
    records : Record or sequence of Record
        Runs of one person in one task, each over whole periods of the excitation.
    excitation : str, optional
        Channel of the recorded disturbance or target; by default the first channel with a common name
        that has lines.
    lines : sequence of float, optional
        Lines of the excitation in rad/s, which require `period`; by default the lines found.
    period : float, optional
        Period of the excitation in s.
    controlled_element : str or (array_like, array_like), optional
        Text such as ``"90/(s(s+6))"``, or numerator and denominator in descending powers of s; adds
        crossover and margins.
    start, stop : float, optional
        Span in s.
    offset_samples : float
        ``e[k]`` belongs to ``u[k + offset_samples]``.
    detrend : {"none", "mean", "linear"}
    faults : {"bridge", "cut", "report", "keep"}
        Treatment of faults in the records, as in `identify`.
    decimate : "auto", "off" or int
        As in `identify`. The response at the lines is the same at the original and the reduced rate.

    Returns
    -------
    Description

    Raises
    ------
    OptionError
        If no channel contains an excitation, or the lines are not harmonics of the period.
    DataError
        If the span does not contain whole periods, or a line has no power.

    Examples
    --------
    >>> found = pyhoid.describe(records, excitation="f_t", controlled_element="90/(s(s+6))")
    >>> found.open_loop["phase_margin_deg"]
    """
    settings = {name: value for name, value in locals().items() if name != "records"}
    several = tuple(_options.as_records(records))
    element = None
    if controlled_element is not None:
        element = _options.controlled_element(controlled_element)
    return Description(
        _pyhoid.describe(
            several,
            excitation=excitation,
            lines=None if lines is None else [float(w) for w in lines],
            period=period,
            controlled_element=element,
            start=start,
            stop=stop,
            # A ratio of Fourier coefficients does not include the hold, so the shift of the input is reversed.
            offset_samples=offset_samples + several[0].input_lead / several[0].sample_time,
            detrend=detrend,
            faults=faults,
            decimate=str(decimate),
        ),
        Call("describe", several, settings),
    )
