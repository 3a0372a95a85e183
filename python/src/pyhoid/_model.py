"""Methods of every fitted model: prediction, simulation, validation, frequency response, conversion."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import numpy.typing as npt

from . import _options, _pyhoid
from ._arrays import FloatArray, signal
from .errors import NotConvertibleError
from .record import Record

if TYPE_CHECKING:
    import control

__all__ = ["QUALITY", "Correlation", "FrequencyResponse", "Model", "Series", "Validation"]

#: Measures of the quality of a fit.
QUALITY = ("vaf_simulation", "vaf_prediction", "nrmse_simulation", "nrmse_prediction")


class Series(NamedTuple):
    """Values on the time axis of a record, from sample `first` on.

    ``record.u[first:]`` has the same times as `values`.

    Examples
    --------
    >>> first, values = fit.predict(record)
    """

    first: int
    values: FloatArray


class FrequencyResponse(NamedTuple):
    """Frequency response from e to u with its standard errors.

    All arrays have shape (n,). Standard errors are NaN if there are none.

    Examples
    --------
    >>> fit.frequency_response([0.5, 1.0, 2.0]).magnitude_db
    """

    omega: FloatArray
    magnitude_db: FloatArray
    magnitude_db_se: FloatArray
    phase_deg: FloatArray
    phase_deg_se: FloatArray

    @property
    def response(self) -> npt.NDArray[np.complex128]:
        """The complex response."""
        phase = np.deg2rad(self.phase_deg)
        return np.asarray(
            10.0 ** (self.magnitude_db / 20.0) * (np.cos(phase) + 1j * np.sin(phase)),
            dtype=np.complex128,
        )


class Correlation(NamedTuple):
    """Correlation by lag, with the bound within which 99 % of the values for white residuals lie."""

    lags: npt.NDArray[np.int64]
    values: FloatArray
    bound_99: float


class Validation(NamedTuple):
    """A model validated on a record: simulation, prediction, and tests of the residuals.

    Examples
    --------
    >>> fit.validate(record).quality["vaf_prediction"]
    """

    first: int
    simulated: FloatArray
    predicted: FloatArray
    quality: dict[str, float]
    autocorrelation: Correlation
    cross_correlation: Correlation
    ljung_box: dict[str, float] | None
    coloured_residuals: bool
    under_modelled: bool
    feedback: bool


class Model:
    """A model from e to u with its noise model."""

    @property
    def _model(self) -> _pyhoid.Fit:
        """The polynomial model used for prediction."""
        raise NotImplementedError

    def _response(self, omega: FloatArray) -> Sequence[FloatArray]:
        return self._model.frequency_response(omega)

    def predict(self, record: Record, horizon: int = 1) -> Series:
        """Predict u, `horizon` samples ahead.

        Raises
        ------
        DataError
            For a record that is too short or has another sample time.

        >>> fit.predict(record)
        """
        return Series(*self._model.predict(record, horizon))

    def simulate(self, record: Record) -> Series:
        """Simulate the response to e alone, from the initial states that fit the record best.

        >>> fit.simulate(record)
        """
        return Series(*self._model.simulate(record))

    def residuals(self, record: Record) -> Series:
        """Return the one-step prediction errors.

        >>> fit.residuals(record).values.std()
        """
        return Series(*self._model.residuals(record))

    def validate(self, record: Record) -> Validation:
        """Simulate and predict a record, and test the residuals.

        >>> fit.validate(record).ljung_box["p_value"]
        """
        found = dict(self._model.validate(record))
        found["autocorrelation"] = Correlation(*found["autocorrelation"])
        found["cross_correlation"] = Correlation(*found["cross_correlation"])
        return Validation(**found)

    def quality_on(self, records: Record | Sequence[Record]) -> dict[str, float]:
        """Return the `quality` on other records.

        >>> fit.quality_on(record)["vaf_simulation"]
        """
        return self._model.quality(_options.as_records(records))

    def frequency_response(self, omega: Any = None) -> FrequencyResponse:
        """Return the frequency response from e to u.

        Parameters
        ----------
        omega : array_like, shape (n,), optional
            Frequencies in rad/s; by default 200 frequencies from 0.1 rad/s to the Nyquist frequency.

        >>> fit.frequency_response([1.0, 2.0]).response
        """
        if omega is None:
            omega = np.geomspace(0.1, np.pi / self._model.sample_time, 200)
        frequencies = signal(np.atleast_1d(omega) if np.isscalar(omega) else omega, "omega")
        return FrequencyResponse(frequencies, *self._response(frequencies))

    def to_control(self) -> control.TransferFunction:
        """Return the model from e to u as a transfer function of python-control, in z.

        Raises
        ------
        NotConvertibleError
            For a model without an input.

        >>> fit.to_control()
        """
        import control

        parts = self._model.polynomials
        if not parts["B"].size:
            raise NotConvertibleError(
                "the model has no input, and so no transfer function from e to u"
            )
        num = parts["B"]
        den = np.convolve(parts["A"], parts["F"])
        length = max(len(num), len(den))
        num, den = (np.pad(p, (0, length - len(p))) for p in (num, den))
        # The leading zeros of the numerator are the delay; trailing zeros of both cancel.
        while length > 1 and num[-1] == 0 and den[-1] == 0:
            num, den, length = num[:-1], den[:-1], length - 1
        return control.TransferFunction(num, den, self._model.sample_time)
