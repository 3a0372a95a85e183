//! All cases of the challenge.
//!
//! Unless specified otherwise, a change starts at 45 s and takes half a second. A change that makes most loops unstable
//! (such as doubling the delay on `1/s^2`) is applied only to people whose loop remains stable; other people are drawn
//! again ([`draw`](super::draw)).

use super::{
    case::{Case, Course, DelayKnown, Forcing, Form, Imperfection, OperatorChange, Sampling, Spectrum, Theme},
    operator::{Parameter, Plant},
};

/// Default start of a change (s); `CHANGE_DURATION_S` is its default duration.
const DEFAULT_CHANGE_S: f64 = 45.0;
const CHANGE_DURATION_S: f64 = 0.5;

fn operator_change(parameter: Parameter, factor: f64) -> OperatorChange {
    OperatorChange {
        at_s: DEFAULT_CHANGE_S,
        takes_s: CHANGE_DURATION_S,
        parameter,
        factor,
    }
}

/// All cases, in the order of the tables.
pub fn cases() -> Vec<Case> {
    let mut all = remnants();
    all.extend(changes());
    all.extend(courses());
    all.extend(changes_in_remnants());
    all.extend(delays());
    all.extend(loops());
    all.extend(rates());
    all
}

/// Name and description of a kind of remnant or imperfection, with its spectrum, course and imperfection.
type Kind = (&'static str, &'static str, Spectrum, Course, Imperfection);

/// All remnants, and all imperfections of the stick and the recorder.
const KINDS: [Kind; 21] = {
    use Course as C;
    use Imperfection as B;
    use Spectrum as S;
    [
        ("lag-1", "1/(T_n s + 1), steady", S::Lag(1), C::Steady, B::None),
        ("lag-2", "1/(T_n s + 1)^2, steady", S::Lag(2), C::Steady, B::None),
        ("lag-3", "1/(T_n s + 1)^3, steady", S::Lag(3), C::Steady, B::None),
        (
            "rich",
            "lag, peak at omega_nm and slow drift, steady",
            S::Rich,
            C::Steady,
            B::None,
        ),
        (
            "wander-20",
            "standard deviation ±20 % in 15 s",
            S::Lag(1),
            C::Wander(0.2),
            B::None,
        ),
        (
            "wander-30",
            "standard deviation ±30 % in 15 s",
            S::Lag(1),
            C::Wander(0.3),
            B::None,
        ),
        (
            "steps",
            "standard deviation times 1.5 in every second span of 15 s",
            S::Lag(1),
            C::Steps(1.5),
            B::None,
        ),
        (
            "error",
            "standard deviation proportional to |e|",
            S::Lag(1),
            C::Error,
            B::None,
        ),
        (
            "control",
            "standard deviation proportional to the running rms of u",
            S::Rich,
            C::Control,
            B::None,
        ),
        (
            "impulsive",
            "one sample in fifty seven times as large",
            S::Lag(1),
            C::Impulsive,
            B::None,
        ),
        (
            "pulsed",
            "80 % of the variance in two pulses a second",
            S::Lag(1),
            C::Pulsed,
            B::None,
        ),
        (
            "intermittent",
            "on and off for 2 s each",
            S::Lag(1),
            C::Intermittent,
            B::None,
        ),
        (
            "tremor",
            "a narrow peak at 50 to 60 rad/s besides",
            S::Tremor,
            C::Steady,
            B::None,
        ),
        (
            "drift",
            "the stick walks by .05 rms of u in a root second",
            S::Lag(1),
            C::Steady,
            B::Drift(0.05),
        ),
        (
            "offset",
            "e and u recorded with offsets of .5 of their rms",
            S::Lag(1),
            C::Steady,
            B::Offset(0.5),
        ),
        (
            "quantised",
            "the stick reads in steps of a fifth of the rms of u",
            S::Lag(1),
            C::Steady,
            B::Quantised(0.2),
        ),
        (
            "saturated",
            "the stick ends at 1.6 rms of u",
            S::Lag(1),
            C::Steady,
            B::Saturated(1.6),
        ),
        (
            "glitch-5",
            "a sample of u off by 5 innovations every 50 s",
            S::Lag(1),
            C::Steady,
            B::Glitches(5.0),
        ),
        (
            "glitch-50",
            "a sample of u off by 50 innovations every 50 s",
            S::Lag(1),
            C::Steady,
            B::Glitches(50.0),
        ),
        ("missing", "e and u are NaN for 3 s", S::Lag(1), C::Steady, B::Missing),
        ("silent", "e and u are zero for 3 s", S::Lag(1), C::Steady, B::Silent),
    ]
};

fn case_of_kind(theme: Theme, name: String, (_, meaning, spectrum, course, imperfection): Kind) -> Case {
    Case {
        spectrum,
        course,
        imperfection,
        ..Case::baseline(theme, name, meaning)
    }
}

fn remnants() -> Vec<Case> {
    let mut all: Vec<Case> = (KINDS.into_iter())
        .map(|kind| case_of_kind(Theme::Remnants, format!("none-{}", kind.0), kind))
        .collect();
    all.push(Case {
        length_s: 330.0,
        ..Case::baseline(
            Theme::Remnants,
            "none-long",
            "no one changes for 300 s after the start span",
        )
    });
    all.push(Case {
        ratio: 0.6,
        spectrum: Spectrum::Rich,
        ..Case::baseline(Theme::Remnants, "none-strong", "a remnant twice as strong")
    });
    all
}

fn changes() -> Vec<Case> {
    use Parameter::{Delay, Gain, KE, KEDot, Omega, Zeta};
    let named = [
        ("K_e", KE),
        ("K_e_dot", KEDot),
        ("gain", Gain),
        ("omega", Omega),
        ("zeta", Zeta),
        ("delay", Delay),
    ];
    let mut all = Vec::new();
    for (name, parameter) in named {
        for (percent, factor) in [(10, 1.1), (30, 1.3), (100, 2.0)] {
            // The parameter is increased if the loop then remains stable, otherwise decreased.
            let factor = if parameter == Gain || parameter == KE {
                1.0 / factor
            } else {
                factor
            };
            let meaning = format!("{name} of the operator alone times {factor:.2}");
            all.push(Case {
                operator_changes: vec![operator_change(parameter, factor)],
                ..Case::baseline(Theme::Changes, format!("change-{name}-{percent}"), meaning)
            });
        }
    }
    all
}

fn courses() -> Vec<Case> {
    let default = |name, meaning| Case::baseline(Theme::Courses, name, meaning);
    let twice = operator_change(Parameter::KEDot, 2.0);
    let six = (0..6)
        .map(|i| OperatorChange {
            at_s: 40.0 + 12.0 * f64::from(i),
            factor: if i % 2 == 0 { 1.8 } else { 1.0 / 1.8 },
            ..twice
        })
        .collect();
    vec![
        Case {
            operator_changes: vec![OperatorChange {
                at_s: 40.0,
                takes_s: 40.0,
                ..twice
            }],
            ..default("slow-drift", "K_e_dot doubles within 40 s")
        },
        Case {
            length_s: 120.0,
            operator_changes: six,
            ..default("six-changes", "K_e_dot times 1.8 and back, every 12 s")
        },
        Case {
            operator_changes: vec![OperatorChange { at_s: 15.0, ..twice }],
            ..default("within-start", "K_e_dot doubles in the middle of the start span")
        },
        Case {
            operator_changes: vec![OperatorChange { at_s: 80.0, ..twice }],
            ..default("near-end", "K_e_dot doubles 10 s before the end")
        },
        Case {
            imperfection: Imperfection::Polarity(DEFAULT_CHANGE_S),
            ..default("polarity", "u is recorded with the wrong sign from 45 s on")
        },
        Case {
            imperfection: Imperfection::Missing,
            operator_changes: vec![OperatorChange { at_s: 60.0, ..twice }],
            ..default("missing-change", "K_e_dot doubles as 3 s of NaN start")
        },
        Case {
            imperfection: Imperfection::IdleStart(15.0),
            ..default("idle-start", "nothing happens in the first 15 s")
        },
        Case {
            imperfection: Imperfection::IdleStart(15.0),
            delay: DelayKnown::No,
            ..default("idle-start-unknown", "the same, the delay unknown")
        },
    ]
}

fn changes_in_remnants() -> Vec<Case> {
    let twice = operator_change(Parameter::KEDot, 2.0);
    let with_change = |kind: Kind| Case {
        operator_changes: vec![twice],
        ..case_of_kind(Theme::ChangesInRemnants, format!("change-in-{}", kind.0), kind)
    };
    (KINDS.into_iter())
        .filter(|kind| !["lag-1", "missing", "silent"].contains(&kind.0))
        .map(|kind| {
            let case = with_change(kind);
            Case {
                meaning: format!("K_e_dot doubles; {}", case.meaning),
                ..case
            }
        })
        .collect()
}

fn delays() -> Vec<Case> {
    let default = |name, meaning| Case {
        operator_changes: vec![operator_change(Parameter::KEDot, 1.5)],
        ..Case::baseline(Theme::Delays, name, meaning)
    };
    vec![
        Case {
            delay: DelayKnown::Fraction,
            ..default("delay-half", "half a sample next to the report")
        },
        Case {
            rate_hz: 60.0,
            delay: DelayKnown::Fraction,
            ..default("delay-half-60", "the same at 60 Hz")
        },
        Case {
            rate_hz: 60.0,
            sampling: Sampling::Continuous,
            ..default("continuous-60", "a person who sees and acts all the time, 60 Hz")
        },
        Case {
            sampling: Sampling::Continuous,
            ..default("continuous-100", "the same at 100 Hz")
        },
        Case {
            delay: DelayKnown::No,
            ..default("delay-unknown", "the delay is not told")
        },
        Case {
            rate_hz: 60.0,
            sampling: Sampling::Continuous,
            delay: DelayKnown::No,
            spectrum: Spectrum::Rich,
            ..default(
                "all-unknown-60",
                "a continuous person at 60 Hz with a rich remnant and an unknown delay",
            )
        },
    ]
}

fn loops() -> Vec<Case> {
    let default = |name, meaning, plant, form| Case {
        plant,
        form,
        operator_changes: vec![operator_change(Parameter::Gain, 1.0 / 1.6)],
        ..Case::baseline(Theme::Loops, name, meaning)
    };
    let mut all = vec![
        default("gain-on-integrator", "1/s, a gain alone", Plant::Integrator, Form::Gain),
        default(
            "lead-lag-on-integrator",
            "1/s, gain, lead and lag: people",
            Plant::Integrator,
            Form::LeadLag,
        ),
        default("lead-on-lagged", "1/(s(s+1)), gain and lead", Plant::Lagged, Form::Lead),
        default(
            "lead2-lag-on-lagged",
            "1/(s(s+1)), gain, two leads and a lag: people",
            Plant::Lagged,
            Form::Lead2Lag,
        ),
        default("gain-on-unstable", "1/(s-1), a gain alone", Plant::Unstable, Form::Gain),
        default(
            "stick-dynamics",
            "1/s^2, the dynamics of a stick besides",
            Plant::DoubleIntegrator,
            Form::StickDynamics,
        ),
        default(
            "third-order",
            "1/s^2, a neuromuscular system of third order",
            Plant::DoubleIntegrator,
            Form::ThirdOrder,
        ),
    ];
    // With an unstable plant the gain may only increase: at too low a gain the loop is unstable.
    for case in all.iter_mut().filter(|case| case.plant == Plant::Unstable) {
        case.operator_changes = vec![operator_change(Parameter::Gain, 1.4)];
    }
    for (name, meaning, forcing) in [
        ("target", "1/s^2, a target in place of the disturbance", Forcing::Target),
        ("mcruer", "1/s^2, McRuer's forcing function", Forcing::McRuer),
    ] {
        all.push(Case {
            forcing,
            operator_changes: vec![operator_change(Parameter::KEDot, 1.6)],
            ..Case::baseline(Theme::Loops, name, meaning)
        });
    }
    all
}

fn rates() -> Vec<Case> {
    let of = |rate: u32| Case {
        rate_hz: f64::from(rate),
        operator_changes: vec![operator_change(Parameter::KEDot, 1.6)],
        ..Case::baseline(
            Theme::Rates,
            format!("rate-{rate}"),
            format!("{rate} Hz, K_e_dot times 1.6"),
        )
    };
    [50, 60, 250, 500, 1000].map(of).into()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn case_names_are_unique_and_changes_lie_within_the_run() {
        let all = cases();
        for (i, case) in all.iter().enumerate() {
            assert!(all[..i].iter().all(|other| other.name != case.name), "{}", case.name);
            assert!(!case.meaning.is_empty());
            let changes = case.change_times_s();
            assert!(
                changes.is_sorted() && changes.iter().all(|t| *t > 0.0 && *t < case.length_s),
                "{}",
                case.name
            );
        }
    }
}
