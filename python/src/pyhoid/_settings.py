"""The estimators and recursive methods and their options, made from the registries of the library.

`HOID_UPDATE_DOCS=1 cargo test -p hoid-cli` renews this file; it is not edited by hand.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from os import PathLike
from typing import TYPE_CHECKING, Literal, TypedDict

if TYPE_CHECKING:
    from .operator_fit import OperatorFit

__all__ = [
    "BATCH_SETTINGS",
    "METHODS",
    "SETTINGS",
    "BatchSettings",
    "MethodSettings",
    "RecursiveMethod",
    "Structure",
]

#: A recursive method.
RecursiveMethod = Literal[
    "rls",
    "rpem",
    "physical",
    "window",
    "rriv",
    "multiple-model",
    "adaptive",
    "fused",
    "ekf",
    "ukf",
    "dual-ekf",
    "linear-network",
]

#: A polynomial structure.
Structure = Literal[
    "fir",
    "ar",
    "ma",
    "arx",
    "arma",
    "armax",
    "ararx",
    "ararmax",
    "oe",
    "bj",
    "general",
]


class MethodSettings(TypedDict, total=False):
    """Options of the recursive methods."""

    # Covariance P at the start: X times the unit matrix, in units of the innovation variance
    # (the thesis: 0.1). For rls, rpem, physical, fused.
    covariance: float | None

    # Standard deviations beyond which an innovation moves the estimate no further. For rls,
    # rpem, physical, multiple-model, adaptive, fused.
    limit: float | None

    # How far each variance in P may grow where nothing excites its parameter, as a multiple of
    # its initial value; off: without end. For rls, rpem, physical.
    windup_guard: float | Literal["off"] | None

    # Memory of single parameters, or of all of one letter, as b0=256,f=inf,K_e=5s. For rls,
    # rpem, physical, rriv, fused.
    memory_of: Mapping[str, float | str] | None

    # Memory of all parameters, in which the weight of a sample falls to 1/e: samples (256),
    # seconds (2.56s) or inf. For rls, rpem, physical, rriv, fused.
    memory: float | str | None

    # Factor of forgetting instead of a memory: lambda = 1 - 1/memory in samples. For rls, rpem,
    # physical, rriv, fused.
    forgetting_factor: float | None

    # How it forgets; window, variable and directional take the shortest memory. For rls, rpem,
    # physical.
    forgetting: (
        Literal[
            "exponential",
            "random-walk",
            "window",
            "variable",
            "directional",
            "gradient",
        ]
        | None
    )

    # For forgetting by a random walk: by how much a parameter drifts in one second (standard
    # deviation), as K_e=.01,K_e_dot=.01. For rls, rpem, physical.
    drift: Mapping[str, float] | None

    # For forgetting by the gradient: step size. For rls, rpem, physical.
    rate: float | None

    # Guard: outliers of e and u are held back, spans that no tracking makes are left out, and
    # the estimate starts again after them. For rls, rpem, physical, multiple-model, adaptive.
    guard: Literal["yes", "no"] | None

    # Signals of psi: gradient (D/(C F) as one filter), cascade (1/F before D/C; for
    # comparison), or pseudo-linear (without filters: extended least squares). For rpem.
    regressor: Literal["gradient", "cascade", "pseudo-linear"] | None

    # Polynomials kept stable: predictor (C and F), or noise (D too). For rpem, physical, fused.
    stable: Literal["predictor", "noise"] | None

    # Follow the delay tau_e too, within this range: as a parameter by physical, in whole
    # samples by rpem and multiple-model. For rpem, physical, multiple-model.
    track_delay: tuple[float, float] | None

    # Bounds of physical parameters, as omega_nm=5..30,zeta_nm=0.1..2; an end may be left open.
    # For physical, multiple-model, ekf, ukf, dual-ekf.
    bound: Mapping[str, tuple[float | None, float | None]] | None

    # Length of the window: samples or seconds. For window.
    window: float | str | None

    # Samples between two fits. For window.
    refit: int | None

    # Channel of the signal from outside the loop of which the instruments are made. For rriv.
    instruments: str | None

    # Logarithm of the odds from which a change is declared. For multiple-model.
    alarm: float | None

    # At each sample what all of a recorded run shows about it, by hypotheses run from both
    # ends, in place of the prediction from the past alone. For multiple-model.
    smooth: bool | None

    # False alarms in an hour that are accepted: a lower number finds fewer changes, later. For
    # adaptive.
    false_alarms: float | None

    # Time that is read again and again; 0 for a recursion that reads each sample once, as a
    # microcontroller does. For adaptive.
    replay: float | None

    # Prior knowledge of the person before the first sample: population, none,
    # NAME=CENTRE:SPREAD of omega_nm, zeta_nm, tau_e, T_I (the spread is relative), or an
    # earlier fit of them, a file that hoid identify --json has printed. For adaptive.
    prior: str | PathLike[str] | Mapping[str, tuple[float, float]] | OperatorFit | None

    # Drift of K_e and K_e_dot in a root second, share of their start. For dual-ekf.
    gain_drift: float | None

    # Drift of omega_nm and zeta_nm in a root second, share of their start. For dual-ekf.
    nms_drift: float | None

    # Drift of tau_e in a root second, share of its start, behind a Padé approximation. For
    # dual-ekf.
    delay_drift: float | None

    # Error that enters the neuromuscular part next to e, share of the size of e. For dual-ekf.
    state_noise: float | None

    # Root mean square of e. For dual-ekf.
    error_size: float | None

    # Order of the Padé approximation of the delay, 1 to 3; 0 for whole samples. For dual-ekf.
    pade: int | None

    # Time constant with which a weight is learned. For linear-network.
    learning: float | None


class BatchSettings(TypedDict, total=False):
    """Options of the batch estimators."""

    # Noise of the operator: ar an autoregression, arma with a moving average (nc), remnant the
    # remnant of order m. For operators.
    noise: Literal["ar", "arma", "remnant"] | None

    # Whether the operator changes: not at all, or its gains once, by a sigmoid. For operators.
    change: Literal["none", "sigmoid"] | None

    # Form of the operator; auto: estimates are averaged over the forms that the data leave, of
    # one that changes lead. For operator, change="sigmoid".
    form: (
        Literal[
            "auto",
            "gain",
            "lead",
            "lead2",
            "lag",
            "lead-lag",
            "lead2-lag",
            "quadratic-integral",
            "lead-droop",
            "derivative",
            "derivative-lead",
        ]
        | None
    )

    # With neuromuscular dynamics omega_nm, zeta_nm. For operator, change="sigmoid".
    neuromuscular: Literal["yes", "no"] | None

    # What is known of the person before the data: population (published people), none, a JSON
    # result of another fit, or NAME=CENTRE:SPREAD of omega_nm, zeta_nm, tau_e, T_L, T_I, as
    # omega_nm=10.5:0.3 (the spread is relative). For operator, change="sigmoid".
    prior: str | PathLike[str] | Mapping[str, tuple[float, float]] | OperatorFit | None

    # Delay tau_e, or the shortest and the longest; of polynomials in place of nk = tau_e/Ts +
    # 1.
    delay: float | tuple[float, float] | None

    # What e does between its samples: zoh is held, foh runs straight (logged from what is
    # faster or continuous; tau_e is half a sample longer); auto: smooth, with the delay of a
    # held one, and what data without noise show. For operator.
    intersample: Literal["auto", "zoh", "foh"] | None

    # What a person's gain varies by from run to run, as a part of it: in the error bars of
    # fewer than five records. For operator.
    run_to_run: float | None

    # Inputs except the error, and what they are to the person: r=feedforward (a target that is
    # seen; r=feedforward:0.5 with 0.5 s of its future), motion, output; one form alone as
    # r=feedforward/derivative. For operator.
    role: Sequence[str] | None

    # Parameters that each record has for itself, as K,T_L. For operator, noise="remnant".
    individual: Sequence[str] | None

    # Initial states of each record; auto: estimate, and backcast for an output alone (ar, ma,
    # arma). For operators, pem.
    initial_state: Literal["auto", "zero", "estimate", "backcast"] | None

    # How the search steps: gn Gauss-Newton, lm Levenberg-Marquardt, grad steepest descent. For
    # operators, pem.
    search_method: Literal["auto", "gn", "lm", "grad"] | None

    # Largest number of search steps from each start.
    max_iterations: int | None

    # Relative decrease of the loss below which the search has converged.
    tolerance: float | None

    # Column of the recorded disturbance or target, for the fit at its lines; none for no such
    # fit. For operator.
    excitation: str | None

    # Period of the excitation. For operator.
    period: float | None

    # Controlled element in s, as 90/(s(s+6)), or NUM/DEN by descending powers of s, as
    # 90/1,6,0: adds crossover frequency and margins. For polynomials, operator,
    # noise="remnant".
    controlled_element: str | tuple[Sequence[float], Sequence[float]] | None

    # What the verdict is about: response, crossover, phase_margin, parameters by their names,
    # as crossover,tau_e.
    answers: Sequence[str] | None

    # Order m of the remnant, a number or a range to search. For noise="remnant".
    remnant_order: int | tuple[int, int] | range | None

    # Parameters held at a value, as d1=-0.85,f1=-1.9. For noise="remnant", change="sigmoid",
    # pem.
    fix: Mapping[str, float] | None

    # Bounds of parameters, as b0=0..0.2,f2=..0.99; an end may be left open. For
    # noise="remnant", change="sigmoid", pem.
    bound: Mapping[str, tuple[float | None, float | None]] | None

    # Delay of b0 in samples (29), or dead time in s (0.28s); a number or a range (20..40,
    # 0.1s..0.4s) to search. For polynomials.
    nk: int | tuple[int, int] | range | str | None

    # What decides between candidates when something is searched. For polynomials.
    criterion: Literal["loss", "aic", "aicc", "bic", "fpe", "mdl", "yic"] | None

    # What the model is to be good at: one-step prediction, or simulation from the input alone.
    # For pem.
    focus: Literal["prediction", "simulation"] | None

    # Start of the search, all coefficients as f1=-1.9,f2=.92,b0=.04,.... For pem.
    start: Mapping[str, float] | None

    # Guesses of coefficients with a weight W, as f1=-1.9:0.5: the loss grows by W (f1 + 1.9)^2.
    # For pem.
    coefficient_prior: Mapping[str, tuple[float, float]] | None

    # Loss of Huber instead of squares: residuals beyond a given number of standard deviations
    # count linearly; of no number 1.345. For pem.
    robust: float | bool | None

    # Take only models that are stable from e to u (C and F always are stable). For pem.
    stable: bool | None

    # Instruments: a channel that the noise does not reach, or `simulated` from the input, for
    # an open loop. For iv4, sriv, rivbj.
    instruments: str | None


#: The methods, as the documentation of `track` lists them.
METHODS = """``"rls"``: recursive least squares;
        ``"rpem"``: recursive prediction-error method, for every structure;
        ``"physical"``: recursive prediction-error method in the operator's parameters;
        ``"window"``: a batch fit of the last seconds, again and again;
        ``"rriv"``: recursive refined instrumental variable;
        ``"multiple-model"``: a bank of hypotheses of when the person changed, which sets its
        memory itself and reports changes;
        ``"adaptive"``: gains in a basis that people share, with a noise model of its own;
        starts without a fit;
        ``"fused"``: least squares for B with the poles of rpem, for comparison;
        ``"ekf"``: extended Kalman filter of state and parameters, for comparison;
        ``"ukf"``: unscented Kalman filter of state and parameters, for comparison;
        ``"dual-ekf"``: two extended Kalman filters that take turns, of state and of parameters,
        for comparison;
        ``"linear-network"``: single linear layer that learns K_e and K_e_dot after a known
        neuromuscular part, for comparison."""

#: The options, as the documentation of `track` lists them.
SETTINGS = """covariance : float
            Covariance P at the start: X times the unit matrix, in units of the innovation
            variance (the thesis: 0.1). For rls, rpem, physical, fused.
        limit : float
            Standard deviations beyond which an innovation moves the estimate no further. For
            rls, rpem, physical, multiple-model, adaptive, fused.
        windup_guard : float | Literal['off']
            How far each variance in P may grow where nothing excites its parameter, as a
            multiple of its initial value; off: without end. For rls, rpem, physical.
        memory_of : Mapping[str, float | str]
            Memory of single parameters, or of all of one letter, as b0=256,f=inf,K_e=5s. For
            rls, rpem, physical, rriv, fused.
        memory : float | str
            Memory of all parameters, in which the weight of a sample falls to 1/e: samples
            (256), seconds (2.56s) or inf. For rls, rpem, physical, rriv, fused.
        forgetting_factor : float
            Factor of forgetting instead of a memory: lambda = 1 - 1/memory in samples. For rls,
            rpem, physical, rriv, fused.
        forgetting : Literal['exponential', 'random-walk', 'window', 'variable', 'directional', 'gradient']
            How it forgets; window, variable and directional take the shortest memory. For rls,
            rpem, physical.
        drift : Mapping[str, float]
            For forgetting by a random walk: by how much a parameter drifts in one second
            (standard deviation), as K_e=.01,K_e_dot=.01. For rls, rpem, physical.
        rate : float
            For forgetting by the gradient: step size. For rls, rpem, physical.
        guard : Literal['yes', 'no']
            Guard: outliers of e and u are held back, spans that no tracking makes are left out,
            and the estimate starts again after them. For rls, rpem, physical, multiple-model,
            adaptive.
        regressor : Literal['gradient', 'cascade', 'pseudo-linear']
            Signals of psi: gradient (D/(C F) as one filter), cascade (1/F before D/C; for
            comparison), or pseudo-linear (without filters: extended least squares). For rpem.
        stable : Literal['predictor', 'noise']
            Polynomials kept stable: predictor (C and F), or noise (D too). For rpem, physical,
            fused.
        track_delay : tuple[float, float]
            Follow the delay tau_e too, within this range: as a parameter by physical, in whole
            samples by rpem and multiple-model. For rpem, physical, multiple-model.
        bound : Mapping[str, tuple[float | None, float | None]]
            Bounds of physical parameters, as omega_nm=5..30,zeta_nm=0.1..2; an end may be left
            open. For physical, multiple-model, ekf, ukf, dual-ekf.
        window : float | str
            Length of the window: samples or seconds. For window.
        refit : int
            Samples between two fits. For window.
        instruments : str
            Channel of the signal from outside the loop of which the instruments are made. For
            rriv.
        alarm : float
            Logarithm of the odds from which a change is declared. For multiple-model.
        smooth : bool
            At each sample what all of a recorded run shows about it, by hypotheses run from
            both ends, in place of the prediction from the past alone. For multiple-model.
        false_alarms : float
            False alarms in an hour that are accepted: a lower number finds fewer changes,
            later. For adaptive.
        replay : float
            Time that is read again and again; 0 for a recursion that reads each sample once, as
            a microcontroller does. For adaptive.
        prior : str | PathLike[str] | Mapping[str, tuple[float, float]] | OperatorFit
            Prior knowledge of the person before the first sample: population, none,
            NAME=CENTRE:SPREAD of omega_nm, zeta_nm, tau_e, T_I (the spread is relative), or an
            earlier fit of them, a file that hoid identify --json has printed. For adaptive.
        gain_drift : float
            Drift of K_e and K_e_dot in a root second, share of their start. For dual-ekf.
        nms_drift : float
            Drift of omega_nm and zeta_nm in a root second, share of their start. For dual-ekf.
        delay_drift : float
            Drift of tau_e in a root second, share of its start, behind a Padé approximation.
            For dual-ekf.
        state_noise : float
            Error that enters the neuromuscular part next to e, share of the size of e. For
            dual-ekf.
        error_size : float
            Root mean square of e. For dual-ekf.
        pade : int
            Order of the Padé approximation of the delay, 1 to 3; 0 for whole samples. For
            dual-ekf.
        learning : float
            Time constant with which a weight is learned. For linear-network."""

#: The options, as the documentation of `identify` lists them.
BATCH_SETTINGS = """noise : Literal['ar', 'arma', 'remnant']
            Noise of the operator: ar an autoregression, arma with a moving average (nc),
            remnant the remnant of order m. For operators.
        change : Literal['none', 'sigmoid']
            Whether the operator changes: not at all, or its gains once, by a sigmoid. For
            operators.
        form : Literal['auto', 'gain', 'lead', 'lead2', 'lag', 'lead-lag', 'lead2-lag', 'quadratic-integral', 'lead-droop', 'derivative', 'derivative-lead']
            Form of the operator; auto: estimates are averaged over the forms that the data
            leave, of one that changes lead. For operator, change="sigmoid".
        neuromuscular : Literal['yes', 'no']
            With neuromuscular dynamics omega_nm, zeta_nm. For operator, change="sigmoid".
        prior : str | PathLike[str] | Mapping[str, tuple[float, float]] | OperatorFit
            What is known of the person before the data: population (published people), none, a
            JSON result of another fit, or NAME=CENTRE:SPREAD of omega_nm, zeta_nm, tau_e, T_L,
            T_I, as omega_nm=10.5:0.3 (the spread is relative). For operator, change="sigmoid".
        delay : float | tuple[float, float]
            Delay tau_e, or the shortest and the longest; of polynomials in place of nk =
            tau_e/Ts + 1.
        intersample : Literal['auto', 'zoh', 'foh']
            What e does between its samples: zoh is held, foh runs straight (logged from what is
            faster or continuous; tau_e is half a sample longer); auto: smooth, with the delay
            of a held one, and what data without noise show. For operator.
        run_to_run : float
            What a person's gain varies by from run to run, as a part of it: in the error bars
            of fewer than five records. For operator.
        role : Sequence[str]
            Inputs except the error, and what they are to the person: r=feedforward (a target
            that is seen; r=feedforward:0.5 with 0.5 s of its future), motion, output; one form
            alone as r=feedforward/derivative. For operator.
        individual : Sequence[str]
            Parameters that each record has for itself, as K,T_L. For operator, noise="remnant".
        initial_state : Literal['auto', 'zero', 'estimate', 'backcast']
            Initial states of each record; auto: estimate, and backcast for an output alone (ar,
            ma, arma). For operators, pem.
        search_method : Literal['auto', 'gn', 'lm', 'grad']
            How the search steps: gn Gauss-Newton, lm Levenberg-Marquardt, grad steepest
            descent. For operators, pem.
        max_iterations : int
            Largest number of search steps from each start.
        tolerance : float
            Relative decrease of the loss below which the search has converged.
        excitation : str
            Column of the recorded disturbance or target, for the fit at its lines; none for no
            such fit. For operator.
        period : float
            Period of the excitation. For operator.
        controlled_element : str | tuple[Sequence[float], Sequence[float]]
            Controlled element in s, as 90/(s(s+6)), or NUM/DEN by descending powers of s, as
            90/1,6,0: adds crossover frequency and margins. For polynomials, operator,
            noise="remnant".
        answers : Sequence[str]
            What the verdict is about: response, crossover, phase_margin, parameters by their
            names, as crossover,tau_e.
        remnant_order : int | tuple[int, int] | range
            Order m of the remnant, a number or a range to search. For noise="remnant".
        fix : Mapping[str, float]
            Parameters held at a value, as d1=-0.85,f1=-1.9. For noise="remnant",
            change="sigmoid", pem.
        bound : Mapping[str, tuple[float | None, float | None]]
            Bounds of parameters, as b0=0..0.2,f2=..0.99; an end may be left open. For
            noise="remnant", change="sigmoid", pem.
        nk : int | tuple[int, int] | range | str
            Delay of b0 in samples (29), or dead time in s (0.28s); a number or a range (20..40,
            0.1s..0.4s) to search. For polynomials.
        criterion : Literal['loss', 'aic', 'aicc', 'bic', 'fpe', 'mdl', 'yic']
            What decides between candidates when something is searched. For polynomials.
        focus : Literal['prediction', 'simulation']
            What the model is to be good at: one-step prediction, or simulation from the input
            alone. For pem.
        start : Mapping[str, float]
            Start of the search, all coefficients as f1=-1.9,f2=.92,b0=.04,.... For pem.
        coefficient_prior : Mapping[str, tuple[float, float]]
            Guesses of coefficients with a weight W, as f1=-1.9:0.5: the loss grows by W (f1 +
            1.9)^2. For pem.
        robust : float | bool
            Loss of Huber instead of squares: residuals beyond a given number of standard
            deviations count linearly; of no number 1.345. For pem.
        stable : bool
            Take only models that are stable from e to u (C and F always are stable). For pem.
        instruments : str
            Instruments: a channel that the noise does not reach, or `simulated` from the input,
            for an open loop. For iv4, sriv, rivbj."""
