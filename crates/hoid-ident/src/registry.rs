//! The registry of batch estimators: what each is called, what it is, and which options it takes.
//!
//! The command line takes names, help and placement of its flags from here, the book its page of
//! options, Python what belongs to what. A new instrumental-variable method is in the list by being
//! in [`IvMethod::ALL`].

use hoid_model::{Form, NamedChoice, Structure};

use crate::{
    criterion::InitialState,
    estimator::Focus,
    family::FamilyEstimator,
    iv::IvMethod,
    optimize::{SearchMethod, SearchOptions},
    settings::{Bounds, Kind, MethodSpec, Setting},
    sigmoid::SigmoidChange,
};

/// What is known of each batch estimator.
pub fn estimators() -> Vec<MethodSpec> {
    let instrumental = IvMethod::ALL.map(|method| MethodSpec {
        name: method.name(),
        help: method.help(),
        source: method.source(),
        structures: method.structures(),
        settings: vec![
            orders(),
            nk(),
            delay(),
            instruments(),
            max_iterations(SearchOptions::default()),
            tolerance(SearchOptions::default()),
        ],
    });
    let pem = MethodSpec {
        name: "pem",
        help: "prediction error method",
        source: "Ljung 1999, chapters 7 and 10; the reference text, section III",
        structures: &Structure::ALL,
        settings: [
            vec![
                orders(),
                nk(),
                delay(),
                initial_state(),
                start(),
                fix(),
                bound(),
                coefficient_prior(),
                robust(),
                focus(),
                stable(),
            ],
            search(SearchOptions::default()),
        ]
        .concat(),
    };
    let grey_box = MethodSpec {
        name: "grey-box",
        help: "operator and remnant in physical parameters, with a real delay",
        source: "Ljung 1999, section 4.3; the reference text, equation 4",
        structures: &[Structure::BoxJenkins],
        settings: [
            vec![delay(), remnant_order(), individual(), initial_state(), fix(), bound()],
            search(SearchOptions::default()),
        ]
        .concat(),
    };
    let family = MethodSpec {
        name: "family",
        help: "the operator of a person: form, parameters with prior, errors by runs, a verdict",
        source: "McRuer and Jex 1967; the reference text, equation 2.2",
        structures: &[Structure::BoxJenkins],
        settings: [
            vec![
                form(),
                neuromuscular(),
                operator_prior(),
                excitation(),
                period(),
                orders(),
                delay(),
                individual(),
                run_to_run(),
                initial_state(),
            ],
            search(FamilyEstimator::default().search),
        ]
        .concat(),
    };
    let sigmoid = MethodSpec {
        name: "time-varying",
        help: "the operator's gains change once, by a sigmoid; any form",
        source: "Zaal 2016; the reference text, section II",
        structures: &[Structure::BoxJenkins],
        settings: [
            vec![
                form(),
                neuromuscular(),
                operator_prior(),
                orders(),
                delay(),
                initial_state(),
                fix(),
                bound(),
            ],
            search(SigmoidChange::default().search),
        ]
        .concat(),
    };
    [pem]
        .into_iter()
        .chain(instrumental)
        .chain([family, grey_box, sigmoid])
        .collect()
}

/// An option of the registry by its name.
pub fn estimator_setting(name: &str) -> Option<Setting> {
    estimators()
        .into_iter()
        .flat_map(|spec| spec.settings)
        .find(|setting| setting.name == name)
}

fn setting(name: &'static str, kind: Kind, default: &str, help: &str) -> Setting {
    Setting {
        name,
        kind,
        unit: "",
        default: default.to_owned(),
        bounds: Bounds::Any,
        help: help.to_owned(),
    }
}

fn named<T: NamedChoice>() -> Vec<&'static str> {
    T::CHOICES.iter().map(|choice| choice.choice_name()).collect()
}

/// How the search of an estimator steps and ends, by its own defaults.
fn search(usual: SearchOptions) -> Vec<Setting> {
    vec![search_method(), max_iterations(usual), tolerance(usual)]
}

fn orders() -> Setting {
    setting(
        "orders",
        Kind::Named(&Kind::Count),
        "the operator's: bj nb=2,nd=1..4,nf=2; arx na=2,nb=2; grey-box nc=0,nd=0..24 of its noise",
        "Orders, each a number or a range to search, as nb=2,nc=0,nd=1..4,nf=2; nb counts b0, b1, ...",
    )
}

fn nk() -> Setting {
    let help = "Delay of b0 in samples, a number or a range to search";
    setting("nk", Kind::Count, "0.05 to 0.6 s", help)
}

fn instruments() -> Setting {
    setting(
        "instruments",
        Kind::Channel,
        "f_t where all records have it, else simulated",
        "Instruments: a channel that the noise does not reach, or `simulated` from the input, for an open loop",
    )
}

fn remnant_order() -> Setting {
    setting(
        "remnant_order",
        Kind::Count,
        "1..4",
        "Order m of the remnant, a number or a range to search",
    )
}

fn form() -> Setting {
    let mut words = vec!["auto"];
    words.extend(named::<Form>());
    let help = format!(
        "Form of the operator: {}; auto: the simplest that held-out runs do not refute, of time-varying lead",
        words.join(", ")
    );
    setting("form", Kind::Channel, "auto", &help)
}

fn neuromuscular() -> Setting {
    setting(
        "neuromuscular",
        Kind::Choice(&["yes", "no"]),
        "yes",
        "With neuromuscular dynamics omega_nm, zeta_nm",
    )
}

fn operator_prior() -> Setting {
    setting(
        "prior",
        Kind::Prior,
        "population; of time-varying none",
        "What is known of the person before the data: population (published people), none, a JSON result of another fit, or \
         NAME=CENTRE:SPREAD of omega_nm, zeta_nm, tau_e, T_L, T_I, as omega_nm=10.5:0.3 (the spread is relative)",
    )
}

fn excitation() -> Setting {
    setting(
        "excitation",
        Kind::Channel,
        "f_t, d, r ... where one has lines",
        "Column of the recorded disturbance or target, for the fit at its lines; none for no such fit",
    )
}

fn period() -> Setting {
    let help = "Period of the excitation";
    setting("period", Kind::Number, "found in it", help)
        .unit("s")
        .bounds(Bounds::PositiveFinite)
}

fn run_to_run() -> Setting {
    let usual = FamilyEstimator::default().run_to_run.to_string();
    let help =
        "What a person's gain varies by from run to run, as a part of it: in the error bars of fewer than five records";
    setting("run_to_run", Kind::Number, &usual, help).bounds(Bounds::AtLeast(0.0))
}

fn delay() -> Setting {
    setting(
        "delay",
        Kind::Span,
        "0.05..0.6; of the family 0.02..0.8",
        "Delay tau_e, or the shortest and the longest; of polynomials nk = tau_e/Ts + 1",
    )
    .unit("s")
    .bounds(Bounds::NonNegative)
}

fn individual() -> Setting {
    setting(
        "individual",
        Kind::Channel,
        "",
        "Parameters that each record has for itself, as K,T_L",
    )
}

fn initial_state() -> Setting {
    let rules = named::<InitialState>();
    let help = format!(
        "Initial states of each record: auto, {}; auto: estimate, and backcast for an output alone (ar, ma, arma)",
        rules.join(", ")
    );
    setting(
        "initial_state",
        Kind::Choice(&["auto", "zero", "estimate", "backcast"]),
        "auto",
        &help,
    )
}

fn start() -> Setting {
    let help = "Start of the search, all coefficients as f1=-1.9,f2=.92,b0=.04,...";
    setting("start", Kind::Named(&Kind::Number), "own starts", help)
}

fn fix() -> Setting {
    setting(
        "fix",
        Kind::Named(&Kind::Number),
        "",
        "Parameters held at a value, as d1=-0.85,f1=-1.9",
    )
}

fn bound() -> Setting {
    let help = "Bounds of parameters, as b0=0..0.2,f2=..0.99; an end may be left open";
    setting("bound", Kind::Named(&Kind::OpenSpan), "", help)
}

fn coefficient_prior() -> Setting {
    let help = "Guesses of coefficients with a weight W, as f1=-1.9:0.5: the loss grows by W (f1 + 1.9)^2";
    setting("coefficient_prior", Kind::Named(&Kind::Channel), "", help)
}

fn robust() -> Setting {
    let help = "Loss of Huber instead of squares: residuals beyond K standard deviations count linearly";
    setting("robust", Kind::Number, "", help).bounds(Bounds::Positive)
}

fn focus() -> Setting {
    let help = "What the model is to be good at: one-step prediction, or simulation from the input alone";
    setting(
        "focus",
        Kind::Choice(&["prediction", "simulation"]),
        Focus::default().name(),
        help,
    )
}

fn stable() -> Setting {
    let help = "Take only models that are stable from e to u (C and F always are stable)";
    setting("stable", Kind::Flag, "false", help)
}

fn search_method() -> Setting {
    setting(
        "search_method",
        Kind::Choice(&["auto", "gn", "lm", "grad"]),
        SearchMethod::default().name(),
        "How the search steps: gn Gauss-Newton, lm Levenberg-Marquardt, grad steepest descent",
    )
}

fn max_iterations(usual: SearchOptions) -> Setting {
    let usual = usual.max_iterations.to_string();
    setting(
        "max_iterations",
        Kind::Count,
        &usual,
        "Largest number of search steps from each start",
    )
}

fn tolerance(usual: SearchOptions) -> Setting {
    let usual = format!("{:e}", usual.tolerance);
    let help = "Relative decrease of the loss below which the search has converged";
    setting("tolerance", Kind::Number, &usual, help).bounds(Bounds::PositiveFinite)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_estimator_says_what_it_is_and_each_option_once() {
        let all = estimators();
        for spec in &all {
            assert!(
                !spec.help.is_empty() && !spec.source.is_empty() && !spec.structures.is_empty(),
                "{}",
                spec.name
            );
            for setting in &spec.settings {
                let same = spec.settings.iter().filter(|other| other.name == setting.name).count();
                assert!(same == 1 && !setting.help.is_empty(), "{} {}", spec.name, setting.name);
            }
        }
        let names: Vec<&str> = all.iter().map(|spec| spec.name).collect();
        assert_eq!(
            names,
            ["pem", "iv4", "sriv", "rivbj", "family", "grey-box", "time-varying"]
        );
    }

    #[test]
    fn words_of_a_choice_are_those_that_the_library_reads() {
        let words = |name: &str| match estimator_setting(name).map(|setting| setting.kind) {
            Some(Kind::Choice(words)) => words.to_vec(),
            other => panic!("{name}: {other:?}"),
        };
        assert_eq!(words("focus"), named::<Focus>());
        assert_eq!(words("search_method"), named::<SearchMethod>());
        assert_eq!(words("initial_state")[1..], named::<InitialState>());
    }
}
