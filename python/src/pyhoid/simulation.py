"""Simulation of closed-loop runs of a scenario, and margins of its loop."""

from __future__ import annotations

from collections.abc import Sequence
from os import PathLike
from typing import Any

from . import _options, _pyhoid
from .errors import OptionError
from .record import Record

__all__ = ["margins", "simulate"]


def _base(condition: str | None, scenario: str | PathLike[str] | None) -> dict[str, Any]:
    if (condition is None) == (scenario is None):
        raise OptionError('give either condition, such as "C4", or scenario')
    # A text of several lines is a scenario itself; any other text is the name of its file.
    text = scenario if isinstance(scenario, str) and "\n" in scenario else None
    return {
        "condition": condition,
        "scenario_file": None if text is not None else scenario,
        "scenario_text": text,
    }


def simulate(
    condition: str | None = None,
    *,
    scenario: str | PathLike[str] | None = None,
    remnant_order: int | None = None,
    noise_level: float | None = None,
    noise_definition: str | None = None,
    remnant_time_constant: float | None = None,
    sample_time: float | None = None,
    realisation: str | None = None,
    feedforward: str | None = None,
    disturbance: float | None = None,
    seed: int = 0,
    cell: int = 0,
    replication: int = 0,
    keep_run_in: bool = False,
) -> Record:
    """Simulate one closed-loop run of a human operator.

    Parameters
    ----------
    condition : {"C1", ..., "C6"}, optional
        A condition of the thesis (Ortiz Moya 2023, Table 4.4).
    scenario : path or str, optional
        A scenario file (TOML), or the text of a scenario.
    remnant_order : int, optional
        Order m of the remnant filter, 1 to 4; by default 1 or that of the scenario.
    noise_level : float, optional
        Noise level P_n, 0 for a run without remnant; by default 0.1 or that of the scenario.
    noise_definition : {"response", "remnant"}, optional
        Definition of P_n: var(u_n)/var(u) or var(n)/var(u).
    remnant_time_constant : float, optional
        Time constant T_n in s; by default 0.06.
    sample_time : float, optional
        Sample time Ts in s; by default 0.01.
    realisation : {"input", "output"}, optional
        Position of the gain K_c in the controlled element, which matters if K_c changes.
    feedforward : str, optional
        Response to a displayed target: its form and gain, then other parameters by name, such as
        ``"derivative:0.15,tau_f=0.1,preview=0.25"``.
    disturbance : float, optional
        Rms in deg of a disturbance at the input of the controlled element of a condition, at lines
        between those of the target.
    seed, cell, replication : int
        Numbers that select the random stream; runs with different replications are independent.
    keep_run_in : bool
        Keep the samples with t < 0.

    Returns
    -------
    Record
        e, u, x, n, f_t, and the true parameters at every sample.

    Raises
    ------
    OptionError

    Examples
    --------
    >>> record = pyhoid.simulate("C4", remnant_order=1, noise_level=0.1, seed=0)
    """
    parts = _pyhoid.simulate(
        **_base(condition, scenario),
        remnant_order=_options.whole("remnant_order", remnant_order),
        noise_level=noise_level,
        noise_definition=noise_definition,
        remnant_time_constant=remnant_time_constant,
        sample_time=sample_time,
        realisation=realisation,
        feedforward=feedforward,
        disturbance=disturbance,
        seed=_options.whole("seed", seed),
        cell=_options.whole("cell", cell),
        replication=_options.whole("replication", replication),
        keep_run_in=keep_run_in,
    )
    return Record._of(parts)


def margins(
    condition: str | None = None,
    *,
    scenario: str | PathLike[str] | None = None,
    state: str = "initial",
    noise_levels: Sequence[float] = (0.01, 0.1, 0.2, 0.3),
    noise_definition: str = "response",
) -> dict[str, Any]:
    """Return the crossover frequency, the margins and the remnant gains of a scenario.

    Parameters
    ----------
    condition, scenario
        As in `simulate`.
    state : {"initial", "last"}
        State to evaluate, for a scenario that changes.
    noise_levels : sequence of float
        Noise levels P_n for which the remnant gains are computed.
    noise_definition : {"response", "remnant"}

    Returns
    -------
    dict
        ``crossover_rad_s``, ``phase_margin_deg``, ``gain_margin_db``, ``phase_crossover_rad_s``
        (None if there is none), and ``remnant_gain``, a list of dicts with ``remnant_order``,
        ``noise_level``, ``definition`` and ``K_n``.

    Examples
    --------
    >>> pyhoid.margins("C1")["phase_margin_deg"]
    """
    return _pyhoid.margins(
        **_base(condition, scenario),
        state=state,
        noise_levels=[float(level) for level in noise_levels],
        noise_definition=noise_definition,
    )
