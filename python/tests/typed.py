"""What a type checker is to accept; it is checked, not run."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

import pyhoid


def use(e: npt.NDArray[np.float64], u: list[float]) -> float:
    record = pyhoid.Record(e=e, u=u, sample_time=0.01, f_t=np.zeros(3))
    fit = pyhoid.identify(record, "bj", nk=(20, 40), nd=range(1, 5))
    operator = fit.operator
    gain: float = operator.K_e.value if operator is not None else float("nan")
    covariance: npt.NDArray[np.float64] | None = fit.covariance
    response: npt.NDArray[np.complex128] = fit.frequency_response([1.0, 2.0]).response
    trace = pyhoid.track(record, "rpem", memory="2.56s", memory_of={"b": 256})
    column: npt.NDArray[np.float64] = trace["K_e"]
    tracker = pyhoid.Tracker("rpem", nk=29, sample_time=0.01)
    innovation: float = tracker.step(0.1, 0.2)
    person = pyhoid.identify_operator([record], prior={"omega_nm": (10.5, 0.3)}, nd=(0, 8))
    delay: float = person.parameters["tau_e"].value
    change = pyhoid.identify([record], "time-varying", delay=(0.2, 0.3)).change
    return (
        gain
        + innovation
        + delay
        + float(column[0])
        + float(abs(response[0]))
        + len(change)
        + (0 if covariance is None else 1)
    )
