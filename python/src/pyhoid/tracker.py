"""Online recursive estimates."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from . import _pyhoid, _recursion, _text
from ._arrays import FloatArray, signal
from ._options import Order
from .estimates import Estimate, Operator
from .fit import Fit
from .record import Record

if TYPE_CHECKING:
    from typing_extensions import Unpack

    from ._literals import Criterion
    from ._settings import MethodSettings, RecursiveMethod, Structure

__all__ = ["Tracker"]


class Tracker(_pyhoid.Tracker):
    """A recursive estimator that processes one sample at a time.

    The default method, ``"adaptive"``, gives its first estimate after one second. Other methods without a
    given start collect `warm_up` seconds, fit them, and continue from there; until then `ready` is False. A
    tracker can be pickled, and then continues with the same digits.

    Parameters
    ----------
    method, structure, ...
        As in `track`.
    sample_time : float, default 0.01
        Ts in s.
    warm_up : float, default 20
        Time collected before the start fit, in s.
    at : sequence of float
        Frequencies in rad/s at which `responses` gives the gain and phase.
    controlled_element : str or (sequence of float, sequence of float), optional
        Controlled element, as in `track`; with it, `crossover` and `phase_margin` are available.
    decimate : "auto", "off" or int
        As in `track`: above 200 Hz every n-th sample is tracked by default, and the estimate lags by .15 s.
        Between these samples the estimate stays constant and `step` returns NaN. `decimation` describes
        the reduction.
    record : Record, optional
        A record from which the tracker starts, instead of the warm-up: its fit is the start, and the
        filters have processed it.

    Examples
    --------
    >>> tracker = pyhoid.Tracker("rpem", nk=29, nd=1, sample_time=0.01)
    >>> for e, u in samples:
    ...     innovation = tracker.step(e, u)
    """

    _options: dict[str, Any]

    def __new__(
        cls,
        method: RecursiveMethod = "adaptive",
        *,
        sample_time: float = 0.01,
        warm_up: float = 20.0,
        record: Record | None = None,
        structure: Structure | None = None,
        na: Order | None = None,
        nb: Order | None = None,
        nc: Order | None = None,
        nd: Order | None = None,
        nf: Order | None = None,
        nk: Order | None = None,
        delay: float | tuple[float, float] | None = None,
        criterion: Criterion = "bic",
        start: Mapping[str, float] | str | None = None,
        largest: float = 1e6,
        at: Sequence[float] = (),
        controlled_element: str | tuple[Sequence[float], Sequence[float]] | None = None,
        decimate: int | str = "auto",
        **settings: Unpack[MethodSettings],
    ) -> Tracker:
        """See the class."""
        method = _recursion.current_name(method)
        options = _recursion.native_arguments(locals(), settings) | {"decimate": str(decimate)}
        return cls._made(options, float(sample_time), float(warm_up), record)

    @classmethod
    def _made(
        cls, options: dict[str, Any], sample_time: float, warm_up: float, record: Record | None
    ) -> Tracker:
        tracker: Tracker = super().__new__(cls, options, sample_time, warm_up, record)
        tracker._options = options
        return tracker

    def update(self, e: Any, u: Any, f_t: Any = None, *, update: bool = True) -> FloatArray:
        """Process samples one after the other.

        Parameters
        ----------
        e, u : array_like, shape (N,)
        f_t : array_like, shape (N,), optional
            Forcing function, from which ``"rriv"`` computes its instruments.
        update : bool
            False updates only the filters and keeps the estimate constant.

        Returns
        -------
        ndarray, shape (N,)
            Innovations; NaN at faults (values that are not finite or beyond `largest`) and during
            the warm-up.

        >>> innovations = tracker.update(record.e, record.u)
        """
        reference = None if f_t is None else signal(f_t, "f_t")
        return self.take_all(signal(e, "e"), signal(u, "u"), reference, update)

    @property
    def estimates(self) -> dict[str, Estimate]:
        """Coefficients with their standard errors."""
        return {name: Estimate(*pair) for name, pair in self.parameters}

    @property
    def responses(self) -> dict[float, tuple[Estimate, Estimate]]:
        """Gain in dB and phase in deg at the frequencies of `at`; empty before the first estimate.

        Examples
        --------
        >>> tracker = pyhoid.Tracker("adaptive", at=(1, 2.5), sample_time=0.01)
        >>> gain, phase = tracker.responses[2.5]
        """
        told = {omega: self.response(omega) for omega in self.at}
        return {
            omega: (Estimate(*found[0]), Estimate(*found[1]))
            for omega, found in told.items()
            if found is not None
        }

    @property
    def crossover(self) -> Estimate | None:
        """Crossover frequency in rad/s.

        None without a controlled element, or if there is no crossover; then `no_crossover` gives the reason.
        """
        found = self.open_loop
        return None if found is None or found[0] is None else Estimate(*found[0][0])

    @property
    def phase_margin(self) -> Estimate | None:
        """Phase margin in deg; None if `crossover` is None."""
        found = self.open_loop
        return None if found is None or found[0] is None else Estimate(*found[0][1])

    @property
    def no_crossover(self) -> str | None:
        """Reason why there is currently no crossover."""
        found = self.open_loop
        return None if found is None else found[1]

    @property
    def start_fit(self) -> Fit | None:
        """The batch fit from which the tracker started.

        None if the start was given or the tracker was restored from a pickle.
        """
        native = self.start
        return None if native is None else Fit(native, [])

    @property
    def settings(self) -> dict[str, Any]:
        """The keywords of the tracker, including defaults; a prior from a fit is given by its source."""
        shared = {
            name: self._options[name] for name in _recursion.KEYWORDS if name in self._options
        }
        settings = shared | self._options["orders"] | self._options["settings"]
        if self._options["fit"] is not None:
            settings["prior"] = self._options["fit"][1]
        told: dict[str, Any] = settings
        return told

    def operator_estimate(self) -> Operator | None:
        """Return the operator with standard errors; None if the structure cannot represent one.

        >>> tracker.operator_estimate()
        """
        found = self.operator
        return None if found is None else Operator(found)

    def __reduce__(self) -> tuple[Any, ...]:
        return (_restored, (type(self), self._options, self.sample_time, *self.saved()))

    def __repr__(self) -> str:
        title = f"Tracker by {self.method}, {self.structure}"
        if not self.ready:
            return f"{title}: warming up, {self.counts['samples']} samples so far"
        rows = [[name, repr(estimate)] for name, estimate in self.estimates.items()]
        title = f"{title}: {self.counts['samples']} samples"
        return f"{title}\n{_text.plain_table(['parameter', 'estimate'], rows)}"


def _restored(
    kind: type[Tracker],
    options: dict[str, Any],
    sample_time: float,
    orders: dict[str, int] | None,
    numbers: FloatArray,
) -> Tracker:
    # The saved numbers contain the length of the warm-up, so any valid length can be given here.
    tracker = kind._made(options, sample_time, max(20.0, sample_time), None)
    tracker.restore(orders, numbers)
    return tracker
