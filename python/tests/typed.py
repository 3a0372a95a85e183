"""Code that a type checker must accept; it is checked, not run."""

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


def script(folder: str) -> list[str]:
    """A typical script of a user."""
    runs = [pyhoid.read(f"{folder}/run{n}.csv", input="r-y", output="u", start=5) for n in (1, 2)]
    person = pyhoid.identify_operator(runs, form="lead", controlled_element="1/s")
    lines = [f"{person.form}: {person.verdict.level}", *person.verdict.reasons]
    for name, parameter in person.parameters.items():
        low, high = parameter.interval or (float("nan"), float("nan"))
        lines.append(f"{name} {parameter.value:.3g}, {low:.3g} to {high:.3g}")
    described = pyhoid.describing_function(runs)
    lines.append(f"{len(described.omega)} lines")
    fits: dict[str, pyhoid.Fit] = {"ARX": pyhoid.identify(runs, "arx", nk=10)}
    pyhoid.plots.bode(list(fits.values()))
    for record in runs:
        trace = pyhoid.track(record, "multiple-model", every=10)
        lines.append(f"{trace['t'][-1]} {trace['K_e'][-1]}")
    table = pyhoid.study("bias", f"{folder}/bias", replications=1)["fits"].to_dict()
    lines.extend(table)
    pages = pyhoid.group(folder, f"{folder}/group").pages
    return [*lines, *(str(page) for page in pages)]
