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

    # Initial covariance P: X times the unit matrix, in units of the innovation variance
    # (thesis: 0.1). For rls, rpem, physical, fused.
    covariance: float | None

    # Limit on innovations, in standard deviations. For rls, rpem, physical, multiple-model,
    # adaptive, fused.
    limit: float | None

    # Limit on the growth of each variance in P while its parameter is not excited, relative to
    # the initial value; off: no limit. For rls, rpem, physical.
    windup_guard: float | Literal["off"] | None

    # Memory of individual parameters, or of all parameters with one letter, such as
    # b0=256,f=inf,K_e=5s. For rls, rpem, physical, rriv, fused.
    memory_of: Mapping[str, float | str] | None

    # Memory of all parameters, after which the weight of a sample is 1/e: samples (256),
    # seconds (2.56s) or inf. For rls, rpem, physical, rriv, fused.
    memory: float | str | None

    # Forgetting factor instead of a memory: lambda = 1 - 1/N for a memory of N samples. For
    # rls, rpem, physical, rriv, fused.
    forgetting_factor: float | None

    # Type of forgetting; window, variable and directional use the shortest memory. For rls,
    # rpem, physical.
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

    # For random-walk: drift of a parameter in one second (standard deviation), such as
    # K_e=.01,K_e_dot=.01. For rls, rpem, physical.
    drift: Mapping[str, float] | None

    # For gradient: step size. For rls, rpem, physical.
    rate: float | None

    # Guard: hold back outliers of e and u, exclude spans without tracking, and restart the
    # estimate after them. For rls, rpem, physical, multiple-model, adaptive.
    guard: Literal["yes", "no"] | None

    # Filters for psi: gradient (D/(C F) as one filter), cascade (1/F, then D/C; for
    # comparison), or pseudo-linear (none: extended least squares). For rpem.
    regressor: Literal["gradient", "cascade", "pseudo-linear"] | None

    # Polynomials kept stable: predictor (C and F), or noise (D too). For rpem, physical, fused.
    stable: Literal["predictor", "noise"] | None

    # Range in which tau_e is also tracked (physical: as a parameter; rpem, multiple-model: in
    # whole samples). For rpem, physical, multiple-model.
    track_delay: tuple[float, float] | None

    # Bounds of physical parameters, such as omega_nm=5..30,zeta_nm=0.1..2; either end may be
    # omitted. For physical, multiple-model, ekf, ukf, dual-ekf.
    bound: Mapping[str, tuple[float | None, float | None]] | None

    # Window length, in samples or seconds. For window.
    window: float | str | None

    # Samples between fits. For window.
    refit: int | None

    # Channel from outside the loop that provides the instruments. For rriv.
    instruments: str | None

    # Log odds at which a change is declared. For multiple-model.
    alarm: float | None

    # Smooth a recorded run: use the whole run for each estimate, not only the past (hypotheses
    # run from both ends). For multiple-model.
    smooth: bool | None

    # Accepted false alarms per hour (lower: fewer changes are detected, and later). For
    # adaptive.
    false_alarms: float | None

    # Length of past data that are replayed (0: each sample is used once, as on a
    # microcontroller). For adaptive.
    replay: float | None

    # Prior knowledge of the person: population, none, NAME=CENTRE:SPREAD for omega_nm, zeta_nm,
    # tau_e, T_I (relative spread), or a file from hoid identify --json. For adaptive.
    prior: str | PathLike[str] | Mapping[str, tuple[float, float]] | OperatorFit | None

    # Drift of K_e and K_e_dot per root second, relative to their start. For dual-ekf.
    gain_drift: float | None

    # Drift of omega_nm and zeta_nm per root second, relative to their start. For dual-ekf.
    nms_drift: float | None

    # Drift of tau_e per root second, relative to its start, with a Padé approximation. For
    # dual-ekf.
    delay_drift: float | None

    # Noise added to e at the input of the neuromuscular system, relative to the size of e. For
    # dual-ekf.
    state_noise: float | None

    # Root mean square of e. For dual-ekf.
    error_size: float | None

    # Order of the Padé approximation of the delay, 1 to 3; 0 for whole samples. For dual-ekf.
    pade: int | None

    # Time constant for learning a weight. For linear-network.
    learning: float | None


class BatchSettings(TypedDict, total=False):
    """Options of the batch estimators."""

    # Noise model: autoregression (ar), autoregression and moving average of order nc (arma), or
    # remnant of order m (remnant). For operators.
    noise: Literal["ar", "arma", "remnant"] | None

    # Change in the operator: none, or one sigmoid change in its gains (hoid identify then
    # rejects --figure, --validate, --horizon and --report). For operators.
    change: Literal["none", "sigmoid"] | None

    # Form of the operator; auto: average over the forms that the data allow (with --change
    # sigmoid: lead). For operator, change="sigmoid".
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
            "canals",
            "canals-rate",
        ]
        | None
    )

    # Include neuromuscular dynamics (omega_nm, zeta_nm). For operator, change="sigmoid".
    neuromuscular: Literal["yes", "no"] | None

    # Prior knowledge of the person: population (published data), none, a JSON result of another
    # fit, or NAME=CENTRE:SPREAD for omega_nm, zeta_nm, tau_e, T_L, T_I, such as
    # omega_nm=10.5:0.3 (relative spread). For operator, change="sigmoid".
    prior: str | PathLike[str] | Mapping[str, tuple[float, float]] | OperatorFit | None

    # Delay tau_e (for polynomials instead of nk = tau_e/Ts + 1) or a range to search.
    delay: float | tuple[float, float] | None

    # Behaviour of e between samples: held (zoh), linear (foh: e was logged from a faster or
    # continuous signal; tau_e is half a sample longer), or auto (zoh or foh if noise-free data
    # show which applies, else smooth, with tau_e as for a held e). For operator.
    intersample: Literal["auto", "zoh", "foh"] | None

    # Relative run-to-run variation of a person's gain; added to the error bars if there are
    # fewer than five records. For operator.
    run_to_run: float | None

    # Role of each input other than the error: r=feedforward (displayed target;
    # r=feedforward:0.5 with 0.5 s of preview), motion, output; /FORM restricts the response to
    # one form, such as r=feedforward/derivative. For operator.
    role: Sequence[str] | None

    # Parameters that differ between records, such as K,T_L. For operator, noise="remnant".
    individual: Sequence[str] | None

    # Initial states of each record; auto: estimate, but backcast for structures without an
    # input (ar, ma, arma). For operators, pem.
    initial_state: Literal["auto", "zero", "estimate", "backcast"] | None

    # Search: Gauss-Newton (gn), Levenberg-Marquardt (lm), steepest descent (grad). For
    # operators, pem.
    search_method: Literal["auto", "gn", "lm", "grad"] | None

    # Maximum search steps from each start.
    max_iterations: int | None

    # Relative decrease of the loss for convergence.
    tolerance: float | None

    # Column of the recorded disturbance or target for the fit at its lines; none: no fit at
    # lines. For operator.
    excitation: str | None

    # Period of the excitation. For operator.
    period: float | None

    # Controlled element, such as 90/(s(s+6)) or 90/1,6,0 (NUM/DEN in descending powers of s):
    # adds crossover frequency and margins. For polynomials, operator, noise="remnant".
    controlled_element: str | tuple[Sequence[float], Sequence[float]] | None

    # Quantities in the verdict: response,crossover,phase_margin or parameters, such as tau_e.
    answers: Sequence[str] | None

    # Order m of the remnant, or a range to search. For noise="remnant".
    remnant_order: int | tuple[int, int] | range | None

    # Parameters fixed at a value, such as d1=-0.85,f1=-1.9. For noise="remnant",
    # change="sigmoid", pem.
    fix: Mapping[str, float] | None

    # Bounds of parameters, such as b0=0..0.2,f2=..0.99; either end may be omitted. For
    # noise="remnant", change="sigmoid", pem.
    bound: Mapping[str, tuple[float | None, float | None]] | None

    # Delay of b0 in samples (29) or dead time in s (0.28s), or a range (20..40, 0.1s..0.4s) to
    # search. For polynomials.
    nk: int | tuple[int, int] | range | str | None

    # Criterion that selects among the candidates. For polynomials.
    criterion: Literal["loss", "aic", "aicc", "bic", "fpe", "mdl", "yic"] | None

    # Purpose of the model: one-step prediction, or simulation from the input alone. For pem.
    focus: Literal["prediction", "simulation"] | None

    # Start of the search: all coefficients, such as f1=-1.9,f2=.92,b0=.04,.... For pem.
    start: Mapping[str, float] | None

    # Prior values and weights of coefficients: f1=-1.9:0.5 adds 0.5 (f1 + 1.9)^2 to the loss.
    # For pem.
    coefficient_prior: Mapping[str, tuple[float, float]] | None

    # Huber loss instead of squares, linear beyond X standard deviations (1.345 if X is
    # omitted). For pem.
    robust: float | bool | None

    # Accept only models that are stable from e to u (C and F are always stable). For pem.
    stable: bool | None

    # Instruments: a channel independent of the noise, or `simulated` from the input (for an
    # open loop). For iv4, sriv, rivbj.
    instruments: str | None


#: The methods, as the documentation of `track` lists them.
METHODS = """``"rls"``: recursive least squares;
        ``"rpem"``: recursive prediction-error method, for every structure;
        ``"physical"``: recursive prediction-error method in the operator's parameters;
        ``"window"``: repeated batch fit of a moving window;
        ``"rriv"``: recursive refined instrumental variable;
        ``"multiple-model"``: a bank of hypotheses about when the person changed, which sets its
        own memory and reports changes;
        ``"adaptive"``: gains in a basis common to all people, with its own noise model; needs
        no start fit;
        ``"fused"``: least squares for B with the poles of rpem, for comparison;
        ``"ekf"``: extended Kalman filter that estimates state and parameters, for comparison;
        ``"ukf"``: unscented Kalman filter that estimates state and parameters, for comparison;
        ``"dual-ekf"``: two alternating extended Kalman filters, one for the state and one for
        the parameters, for comparison;
        ``"linear-network"``: single linear layer that learns K_e and K_e_dot after a known
        neuromuscular part, for comparison."""

#: The options, as the documentation of `track` lists them.
SETTINGS = """covariance : float
            Initial covariance P: X times the unit matrix, in units of the innovation variance
            (thesis: 0.1). For rls, rpem, physical, fused.
        limit : float
            Limit on innovations, in standard deviations. For rls, rpem, physical,
            multiple-model, adaptive, fused.
        windup_guard : float | Literal['off']
            Limit on the growth of each variance in P while its parameter is not excited,
            relative to the initial value; off: no limit. For rls, rpem, physical.
        memory_of : Mapping[str, float | str]
            Memory of individual parameters, or of all parameters with one letter, such as
            b0=256,f=inf,K_e=5s. For rls, rpem, physical, rriv, fused.
        memory : float | str
            Memory of all parameters, after which the weight of a sample is 1/e: samples (256),
            seconds (2.56s) or inf. For rls, rpem, physical, rriv, fused.
        forgetting_factor : float
            Forgetting factor instead of a memory: lambda = 1 - 1/N for a memory of N samples.
            For rls, rpem, physical, rriv, fused.
        forgetting : Literal['exponential', 'random-walk', 'window', 'variable', 'directional', 'gradient']
            Type of forgetting; window, variable and directional use the shortest memory. For
            rls, rpem, physical.
        drift : Mapping[str, float]
            For random-walk: drift of a parameter in one second (standard deviation), such as
            K_e=.01,K_e_dot=.01. For rls, rpem, physical.
        rate : float
            For gradient: step size. For rls, rpem, physical.
        guard : Literal['yes', 'no']
            Guard: hold back outliers of e and u, exclude spans without tracking, and restart
            the estimate after them. For rls, rpem, physical, multiple-model, adaptive.
        regressor : Literal['gradient', 'cascade', 'pseudo-linear']
            Filters for psi: gradient (D/(C F) as one filter), cascade (1/F, then D/C; for
            comparison), or pseudo-linear (none: extended least squares). For rpem.
        stable : Literal['predictor', 'noise']
            Polynomials kept stable: predictor (C and F), or noise (D too). For rpem, physical,
            fused.
        track_delay : tuple[float, float]
            Range in which tau_e is also tracked (physical: as a parameter; rpem,
            multiple-model: in whole samples). For rpem, physical, multiple-model.
        bound : Mapping[str, tuple[float | None, float | None]]
            Bounds of physical parameters, such as omega_nm=5..30,zeta_nm=0.1..2; either end may
            be omitted. For physical, multiple-model, ekf, ukf, dual-ekf.
        window : float | str
            Window length, in samples or seconds. For window.
        refit : int
            Samples between fits. For window.
        instruments : str
            Channel from outside the loop that provides the instruments. For rriv.
        alarm : float
            Log odds at which a change is declared. For multiple-model.
        smooth : bool
            Smooth a recorded run: use the whole run for each estimate, not only the past
            (hypotheses run from both ends). For multiple-model.
        false_alarms : float
            Accepted false alarms per hour (lower: fewer changes are detected, and later). For
            adaptive.
        replay : float
            Length of past data that are replayed (0: each sample is used once, as on a
            microcontroller). For adaptive.
        prior : str | PathLike[str] | Mapping[str, tuple[float, float]] | OperatorFit
            Prior knowledge of the person: population, none, NAME=CENTRE:SPREAD for omega_nm,
            zeta_nm, tau_e, T_I (relative spread), or a file from hoid identify --json. For
            adaptive.
        gain_drift : float
            Drift of K_e and K_e_dot per root second, relative to their start. For dual-ekf.
        nms_drift : float
            Drift of omega_nm and zeta_nm per root second, relative to their start. For
            dual-ekf.
        delay_drift : float
            Drift of tau_e per root second, relative to its start, with a Padé approximation.
            For dual-ekf.
        state_noise : float
            Noise added to e at the input of the neuromuscular system, relative to the size of
            e. For dual-ekf.
        error_size : float
            Root mean square of e. For dual-ekf.
        pade : int
            Order of the Padé approximation of the delay, 1 to 3; 0 for whole samples. For
            dual-ekf.
        learning : float
            Time constant for learning a weight. For linear-network."""

#: The options, as the documentation of `identify` lists them.
BATCH_SETTINGS = """noise : Literal['ar', 'arma', 'remnant']
            Noise model: autoregression (ar), autoregression and moving average of order nc
            (arma), or remnant of order m (remnant). For operators.
        change : Literal['none', 'sigmoid']
            Change in the operator: none, or one sigmoid change in its gains (hoid identify then
            rejects --figure, --validate, --horizon and --report). For operators.
        form : Literal['auto', 'gain', 'lead', 'lead2', 'lag', 'lead-lag', 'lead2-lag', 'quadratic-integral', 'lead-droop', 'derivative', 'derivative-lead', 'canals', 'canals-rate']
            Form of the operator; auto: average over the forms that the data allow (with
            --change sigmoid: lead). For operator, change="sigmoid".
        neuromuscular : Literal['yes', 'no']
            Include neuromuscular dynamics (omega_nm, zeta_nm). For operator, change="sigmoid".
        prior : str | PathLike[str] | Mapping[str, tuple[float, float]] | OperatorFit
            Prior knowledge of the person: population (published data), none, a JSON result of
            another fit, or NAME=CENTRE:SPREAD for omega_nm, zeta_nm, tau_e, T_L, T_I, such as
            omega_nm=10.5:0.3 (relative spread). For operator, change="sigmoid".
        delay : float | tuple[float, float]
            Delay tau_e (for polynomials instead of nk = tau_e/Ts + 1) or a range to search.
        intersample : Literal['auto', 'zoh', 'foh']
            Behaviour of e between samples: held (zoh), linear (foh: e was logged from a faster
            or continuous signal; tau_e is half a sample longer), or auto (zoh or foh if
            noise-free data show which applies, else smooth, with tau_e as for a held e). For
            operator.
        run_to_run : float
            Relative run-to-run variation of a person's gain; added to the error bars if there
            are fewer than five records. For operator.
        role : Sequence[str]
            Role of each input other than the error: r=feedforward (displayed target;
            r=feedforward:0.5 with 0.5 s of preview), motion, output; /FORM restricts the
            response to one form, such as r=feedforward/derivative. For operator.
        individual : Sequence[str]
            Parameters that differ between records, such as K,T_L. For operator,
            noise="remnant".
        initial_state : Literal['auto', 'zero', 'estimate', 'backcast']
            Initial states of each record; auto: estimate, but backcast for structures without
            an input (ar, ma, arma). For operators, pem.
        search_method : Literal['auto', 'gn', 'lm', 'grad']
            Search: Gauss-Newton (gn), Levenberg-Marquardt (lm), steepest descent (grad). For
            operators, pem.
        max_iterations : int
            Maximum search steps from each start.
        tolerance : float
            Relative decrease of the loss for convergence.
        excitation : str
            Column of the recorded disturbance or target for the fit at its lines; none: no fit
            at lines. For operator.
        period : float
            Period of the excitation. For operator.
        controlled_element : str | tuple[Sequence[float], Sequence[float]]
            Controlled element, such as 90/(s(s+6)) or 90/1,6,0 (NUM/DEN in descending powers of
            s): adds crossover frequency and margins. For polynomials, operator,
            noise="remnant".
        answers : Sequence[str]
            Quantities in the verdict: response,crossover,phase_margin or parameters, such as
            tau_e.
        remnant_order : int | tuple[int, int] | range
            Order m of the remnant, or a range to search. For noise="remnant".
        fix : Mapping[str, float]
            Parameters fixed at a value, such as d1=-0.85,f1=-1.9. For noise="remnant",
            change="sigmoid", pem.
        bound : Mapping[str, tuple[float | None, float | None]]
            Bounds of parameters, such as b0=0..0.2,f2=..0.99; either end may be omitted. For
            noise="remnant", change="sigmoid", pem.
        nk : int | tuple[int, int] | range | str
            Delay of b0 in samples (29) or dead time in s (0.28s), or a range (20..40,
            0.1s..0.4s) to search. For polynomials.
        criterion : Literal['loss', 'aic', 'aicc', 'bic', 'fpe', 'mdl', 'yic']
            Criterion that selects among the candidates. For polynomials.
        focus : Literal['prediction', 'simulation']
            Purpose of the model: one-step prediction, or simulation from the input alone. For
            pem.
        start : Mapping[str, float]
            Start of the search: all coefficients, such as f1=-1.9,f2=.92,b0=.04,.... For pem.
        coefficient_prior : Mapping[str, tuple[float, float]]
            Prior values and weights of coefficients: f1=-1.9:0.5 adds 0.5 (f1 + 1.9)^2 to the
            loss. For pem.
        robust : float | bool
            Huber loss instead of squares, linear beyond X standard deviations (1.345 if X is
            omitted). For pem.
        stable : bool
            Accept only models that are stable from e to u (C and F are always stable). For pem.
        instruments : str
            Instruments: a channel independent of the noise, or `simulated` from the input (for
            an open loop). For iv4, sriv, rivbj."""
