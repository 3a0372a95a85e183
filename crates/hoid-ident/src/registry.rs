//! The registry of batch estimators: what each is called, what it is, and which options it takes.
//!
//! Flags and help of the command line, keys of plans, keywords of Python, the page of options and the names of
//! printed settings are made from this list. A new instrumental-variable method is in it by being in
//! [`IvMethod::ALL`].

use hoid_model::{Form, Structure};

use crate::{
    criterion::InitialState,
    estimator::Focus,
    family::{FamilyEstimator, Intersample},
    grey_box::GreyBox,
    iv::IvMethod,
    optimize::{SearchMethod, SearchOptions},
    order_selection::Criterion,
    settings::{Bounds, Kind, MethodSpec, Setting},
    sigmoid::SigmoidChange,
};

/// Words for a form.
static FORMS: [&str; Form::NAMES.len() + 1] = or_auto(Form::NAMES);
/// Words for a rule of initial states.
static INITIAL_STATES: [&str; InitialState::NAMES.len() + 1] = or_auto(InitialState::NAMES);

/// `auto`, and these names.
const fn or_auto<const N: usize, const M: usize>(names: [&'static str; N]) -> [&'static str; M] {
    let (mut all, mut i) = (["auto"; M], 0);
    while i < N {
        all[i + 1] = names[i];
        i += 1;
    }
    all
}

/// The operator of a person.
pub const OPERATOR: &str = "operator";
/// The same with its remnant of order m as noise: a gain with a lead.
pub const REMNANT: &str = "operator noise=remnant";
/// The same with gains that change once.
pub const CHANGE: &str = "operator change=sigmoid";
/// Polynomials by the prediction error method.
pub const PEM: &str = "pem";

/// What is known of each batch estimator.
pub fn estimators() -> Vec<MethodSpec> {
    let family = MethodSpec {
        name: OPERATOR,
        help: "the operator of a person: form, parameters with prior, errors by runs, a verdict",
        source: "McRuer and Jex 1967; the reference text, equation 2.2",
        structures: &[Structure::BoxJenkins],
        settings: [
            vec![
                noise(),
                change(),
                form(),
                neuromuscular(),
                operator_prior("population"),
                excitation(),
                period(),
                controlled_element(),
                orders("nc=0,nd=0..24 of its noise"),
                delay(FamilyEstimator::default().delay_range_s),
                intersample(),
                individual(),
                run_to_run(),
                answers(),
                initial_state(),
            ],
            search(FamilyEstimator::default().search),
        ]
        .concat(),
    };
    let grey_box = MethodSpec {
        name: REMNANT,
        help: "operator and remnant in physical parameters, with a real delay",
        source: "Ljung 1999, section 4.3; the reference text, equation 4",
        structures: &[Structure::BoxJenkins],
        settings: [
            vec![
                noise(),
                change(),
                remnant_order(),
                controlled_element(),
                delay(GreyBox::new(1..=4).delay_range_s),
                individual(),
                answers(),
                initial_state(),
                fix(),
                bound(),
            ],
            search(GreyBox::new(1..=4).search),
        ]
        .concat(),
    };
    let sigmoid = MethodSpec {
        name: CHANGE,
        help: "the operator's gains change once, by a sigmoid; any form",
        source: "Zaal 2016; the reference text, section II",
        structures: &[Structure::BoxJenkins],
        settings: [
            vec![
                noise(),
                change(),
                form(),
                neuromuscular(),
                operator_prior("none"),
                orders("nd=1 of its noise"),
                delay(SigmoidChange::default().delay_range_s),
                answers(),
                initial_state(),
                fix(),
                bound(),
            ],
            search(SigmoidChange::default().search),
        ]
        .concat(),
    };
    let polynomials = || {
        vec![
            orders("the operator's: bj nb=2,nd=1..4,nf=2; arx na=2,nb=2"),
            nk(),
            polynomial_delay(),
            criterion(),
            controlled_element(),
            answers(),
        ]
    };
    let pem = MethodSpec {
        name: PEM,
        help: "polynomials by the prediction error method",
        source: "Ljung 1999, chapters 7 and 10; the reference text, section III",
        structures: &Structure::ALL,
        settings: [
            polynomials(),
            vec![
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
    let instrumental = IvMethod::ALL.map(|method| MethodSpec {
        name: method.name(),
        help: method.help(),
        source: method.source(),
        structures: method.structures(),
        settings: [
            polynomials(),
            vec![
                instruments(),
                max_iterations(SearchOptions::default()),
                tolerance(SearchOptions::default()),
            ],
        ]
        .concat(),
    });
    [family, grey_box, sigmoid, pem]
        .into_iter()
        .chain(instrumental)
        .collect()
}

/// An estimator by its name.
pub fn estimator_spec(name: &str) -> Option<MethodSpec> {
    estimators().into_iter().find(|spec| spec.name == name)
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

/// How the search of an estimator steps and ends, by its own defaults.
fn search(usual: SearchOptions) -> Vec<Setting> {
    vec![search_method(), max_iterations(usual), tolerance(usual)]
}

fn noise() -> Setting {
    let help =
        "Noise of the operator: ar an autoregression, arma with a moving average (nc), remnant the remnant of order m";
    setting("noise", Kind::Choice(&["ar", "arma", "remnant"]), "ar", help)
}

fn change() -> Setting {
    let help = "Whether the operator changes: not at all, or its gains once, by a sigmoid";
    setting("change", Kind::Choice(&["none", "sigmoid"]), "none", help)
}

fn controlled_element() -> Setting {
    let help = "Controlled element in s, as 90/(s(s+6)), or NUM/DEN by descending powers of s, as 90/1,6,0: adds \
                crossover frequency and margins";
    setting("controlled_element", Kind::Element, "", help)
}

fn criterion() -> Setting {
    let help = "What decides between candidates when something is searched";
    setting(
        "criterion",
        Kind::Choice(&Criterion::NAMES),
        Criterion::Bic.name(),
        help,
    )
}

fn orders(usual: &str) -> Setting {
    setting(
        "orders",
        Kind::Named(&Kind::Counts),
        usual,
        "Orders, each a number or a range to search, as nb=2,nc=0,nd=1..4,nf=2; nb counts b0, b1, ...",
    )
}

fn nk() -> Setting {
    let help =
        "Delay of b0 in samples (29), or dead time in s (0.28s); a number or a range (20..40, 0.1s..0.4s) to search";
    setting("nk", Kind::Delay, "0.05 to 0.6 s", help)
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
        Kind::Counts,
        "1..4",
        "Order m of the remnant, a number or a range to search",
    )
}

fn form() -> Setting {
    let help = "Form of the operator; auto: estimates are averaged over the forms that the data leave, of one that changes lead";
    setting("form", Kind::Choice(&FORMS), "auto", help)
}

fn neuromuscular() -> Setting {
    setting(
        "neuromuscular",
        Kind::Choice(&["yes", "no"]),
        "yes",
        "With neuromuscular dynamics omega_nm, zeta_nm",
    )
}

fn operator_prior(usual: &str) -> Setting {
    setting(
        "prior",
        Kind::Prior,
        usual,
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

fn delay((low, high): (f64, f64)) -> Setting {
    delay_of(&format!("{low}..{high}"))
}

fn intersample() -> Setting {
    let help = "What e does between its samples: zoh is held, foh runs straight (logged from what is faster or continuous; tau_e is \
                half a sample longer); auto: smooth, with the delay of a held one, and what data without noise show";
    setting("intersample", Kind::Choice(&Intersample::NAMES), "auto", help)
}

fn polynomial_delay() -> Setting {
    delay_of("")
}

fn delay_of(usual: &str) -> Setting {
    let help = "Delay tau_e, or the shortest and the longest; of polynomials in place of nk = tau_e/Ts + 1";
    setting("delay", Kind::NumberOrSpan, usual, help)
        .unit("s")
        .bounds(Bounds::NonNegative)
}

fn answers() -> Setting {
    let help =
        "What the verdict is about: response, crossover, phase_margin, parameters by their names, as crossover,tau_e";
    setting("answers", Kind::Names, "response and loop", help)
}

fn individual() -> Setting {
    setting(
        "individual",
        Kind::Names,
        "",
        "Parameters that each record has for itself, as K,T_L",
    )
}

fn initial_state() -> Setting {
    let help = "Initial states of each record; auto: estimate, and backcast for an output alone (ar, ma, arma)";
    setting("initial_state", Kind::Choice(&INITIAL_STATES), "auto", help)
}

fn start() -> Setting {
    let help = "Start of the search, all coefficients as f1=-1.9,f2=.92,b0=.04,...";
    setting("start", Kind::Named(&Kind::Number), "own starts", help).bounds(Bounds::Finite)
}

fn fix() -> Setting {
    setting(
        "fix",
        Kind::Named(&Kind::Number),
        "",
        "Parameters held at a value, as d1=-0.85,f1=-1.9",
    )
    .bounds(Bounds::Finite)
}

fn bound() -> Setting {
    let help = "Bounds of parameters, as b0=0..0.2,f2=..0.99; an end may be left open";
    setting("bound", Kind::Named(&Kind::OpenSpan), "", help)
}

fn coefficient_prior() -> Setting {
    let help = "Guesses of coefficients with a weight W, as f1=-1.9:0.5: the loss grows by W (f1 + 1.9)^2";
    setting("coefficient_prior", Kind::Named(&Kind::Guess), "", help)
}

fn robust() -> Setting {
    let help = "Loss of Huber instead of squares: residuals beyond so many standard deviations count linearly; of no number 1.345";
    setting("robust", Kind::NumberOrUsual("1.345"), "", help).bounds(Bounds::Positive)
}

fn focus() -> Setting {
    let help = "What the model is to be good at: one-step prediction, or simulation from the input alone";
    setting("focus", Kind::Choice(&Focus::NAMES), Focus::default().name(), help)
}

fn stable() -> Setting {
    let help = "Take only models that are stable from e to u (C and F always are stable)";
    setting("stable", Kind::Flag, "false", help)
}

fn search_method() -> Setting {
    setting(
        "search_method",
        Kind::Choice(&SearchMethod::NAMES),
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
    use hoid_model::NamedChoice;

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
        assert_eq!(names, [OPERATOR, REMNANT, CHANGE, PEM, "iv4", "sriv", "rivbj"]);
    }

    fn named<T: NamedChoice>() -> Vec<&'static str> {
        T::CHOICES.iter().map(|choice| choice.choice_name()).collect()
    }

    #[test]
    fn words_of_a_choice_are_those_that_the_library_reads() {
        let words = |name: &str| match estimator_setting(name).map(|setting| setting.kind) {
            Some(Kind::Choice(words)) => words.to_vec(),
            other => panic!("{name}: {other:?}"),
        };
        assert_eq!(words("form")[1..], named::<Form>());
        assert_eq!(words("focus"), named::<Focus>());
        assert_eq!(words("search_method"), named::<SearchMethod>());
        assert_eq!(words("criterion"), named::<Criterion>());
        assert_eq!(words("initial_state")[1..], named::<InitialState>());
    }
}
