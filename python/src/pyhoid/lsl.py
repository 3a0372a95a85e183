"""LabStreamingLayer: samples of a person in, estimates out.

The stream of a person has one channel for e and one for u, identified by their labels; without labels
they are the first two channels. A `Tracker` processes each sample, and each estimate is sent with the
time stamp of its sample, so that both are aligned in a recording. LabStreamingLayer itself converts time
stamps to the clock of this computer. Lost samples are detected by the time stamps, bridged by the
tracker, and counted.

>>> tracker = pyhoid.Tracker(sample_time=0.01, controlled_element="90/(s(s+6))")
>>> counts = pyhoid.lsl.stream("person", "estimate", tracker)  # until the person's stream ends

It needs pylsl (``pip install pyhoid[lsl]``).
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Any

from .errors import DataError, OptionError
from .estimates import Estimate
from .tracker import Tracker

__all__ = ["CHANNELS", "stream"]

_OPERATOR = ("K_e", "T_L", "K_e_dot", "omega_nm", "zeta_nm", "tau_e")

#: Labels of the channels of the estimate; standard errors end in ``_se``; unknown values are NaN.
CHANNELS = (
    *(f"{name}{end}" for name in _OPERATOR for end in ("", "_se")),
    *("crossover_rad_s", "crossover_rad_s_se", "phase_margin_deg", "phase_margin_deg_se"),
    *("innovation", "lost"),
)

#: Longest gap that is bridged, s.
_LONGEST_GAP = 10.0


def stream(
    lsl_in: str,
    lsl_out: str,
    tracker: Tracker,
    *,
    e: str = "e",
    u: str = "u",
    patience: float = 10.0,
) -> dict[str, int]:
    """Track the person of a stream and send the estimates as another stream, until the stream ends.

    Parameters
    ----------
    lsl_in, lsl_out : str
        Names of the streams.
    tracker : Tracker
        Tracker that processes the samples; its sample time must be that of the stream.
    e, u : str
        Labels of the channels; without labels, e is the first channel and u the second.
    patience : float
        Seconds without a stream or a sample after which the stream is considered ended.

    Returns
    -------
    dict of str to int
        Number of ``samples``, number of ``lost`` samples among them, and number of ``late`` samples,
        which were left out.

    Raises
    ------
    DataError
        If there is no stream of that name, or the stream lacks these channels.
    OptionError
        If the tracker has another sample time.
    """
    pylsl = _pylsl()
    found = pylsl.resolve_byprop("name", lsl_in, timeout=patience)
    if not found:
        raise DataError(f"no stream {lsl_in!r} appeared within {patience} s; check its name and the network")
    inlet = pylsl.StreamInlet(found[0], processing_flags=pylsl.proc_clocksync)
    try:
        info = inlet.info(timeout=patience)
        indices = _channel_indices(info.get_channel_labels() or [], info.channel_count(), (e, u))
        rate = info.nominal_srate()
        if rate > 0 and abs(rate * tracker.sample_time - 1) > 0.05:
            raise OptionError(
                f"the stream has a rate of {rate} Hz, but the tracker has"
                f" {1 / tracker.sample_time} Hz; create the tracker with the sample time of the stream"
            )
        outlet = _outlet(pylsl, lsl_out, 1 / tracker.sample_time)
        return _run(inlet, outlet, tracker, indices, patience)
    finally:
        inlet.close_stream()


def _pylsl() -> Any:
    try:
        import pylsl
    except ImportError:
        raise OptionError("pyhoid.lsl needs pylsl: pip install pyhoid[lsl]") from None
    return pylsl


def _channel_indices(
    labels: Sequence[str | None], count: int, names: tuple[str, str]
) -> tuple[int, int]:
    """Return the positions of e and u among the channels.

    >>> _channel_indices(["u", "e"], 2, ("e", "u")), _channel_indices([], 3, ("e", "u"))
    ((1, 0), (0, 1))
    """
    known = [label for label in labels if label]
    if not known and count >= 2:
        return 0, 1
    for name in names:
        if name not in known:
            raise DataError(
                f"the stream has the channels {', '.join(known) or count}, expected {name}; "
                "choose with e= and u="
            )
    first, second = (list(labels).index(name) for name in names)
    return first, second


def _outlet(pylsl: Any, name: str, rate: float) -> Any:
    info = pylsl.StreamInfo(name, "Estimate", len(CHANNELS), rate, "double64", f"hoid-{name}")
    channels = info.desc().append_child("channels")
    for label in CHANNELS:
        channels.append_child("channel").append_child_value("label", label)
    return pylsl.StreamOutlet(info)


def _run(
    inlet: Any, outlet: Any, tracker: Tracker, indices: tuple[int, int], patience: float
) -> dict[str, int]:
    counts = {"samples": 0, "lost": 0, "late": 0}
    last: float | None = None
    while True:
        values, stamp = inlet.pull_sample(timeout=patience)
        if values is None:
            return counts
        steps = 1 if last is None else round((stamp - last) / tracker.sample_time)
        if steps < 1:
            counts["late"] += 1
            continue
        longest = round(_LONGEST_GAP / tracker.sample_time)
        for _ in range(min(steps - 1, longest)):
            tracker.step(math.nan, math.nan)
        counts["lost"] += min(steps - 1, longest)
        counts["samples"] += 1
        last = stamp
        innovation = tracker.step(float(values[indices[0]]), float(values[indices[1]]))
        estimate = [*_numbers(tracker), innovation, float(counts["lost"])]
        outlet.push_sample(estimate, stamp)


def _numbers(tracker: Tracker) -> Iterator[float]:
    operator = tracker.operator_estimate() if tracker.ready else None
    there = operator is not None and operator.convertible
    for name in _OPERATOR:
        yield from _pair(operator[name] if there and operator is not None else None)
    yield from _pair(tracker.crossover if tracker.ready else None)
    yield from _pair(tracker.phase_margin if tracker.ready else None)


def _pair(estimate: Estimate | None) -> tuple[float, float]:
    if estimate is None:
        return math.nan, math.nan
    value, error = estimate
    return value, math.nan if error is None else error
