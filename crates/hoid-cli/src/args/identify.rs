//! Options of `hoid identify`.

use std::{ops::RangeInclusive, path::PathBuf};

use clap::Args;
use hoid::ident::{
    Focus, InitialState, IvMethod, SearchMethod, estimator_setting, estimators,
    order_selection::Criterion,
    settings::{Kind, MethodSpec, Setting},
};
use hoid::io::{readable_endings, writable_endings};
use hoid::model::{ContinuousTransferFunction, Form, Structure, remnant::RemnantDiscretisation};

use super::{
    choices::{by_name, choice_of},
    figure::FigureArgs,
    reading::{FaultArgs, MaskArgs, ReadArgs},
    show::ShowArgs,
};
use crate::orders::{DelayRange, parse_delay, parse_horizon, parse_range, parse_seconds};

#[derive(Debug, Args)]
pub struct IdentifyArgs {
    #[arg(required = true, value_name = "RECORD", help = format!(
        "Record files: {}; several share one model and have initial states of their own",
        readable_endings()
    ))]
    pub records: Vec<PathBuf>,
    #[command(flatten)]
    pub read: ReadArgs,
    #[command(flatten)]
    pub mask: MaskArgs,
    #[command(flatten)]
    pub faults: FaultArgs,
    /// What is fitted: grey-box (the operator in physical parameters: the family of operators of
    /// people, or with --remnant-order the operator of a gain and a lead), a polynomial structure, or
    /// time-varying (the operator's gains change once, by a sigmoid) [default: grey-box; that of
    /// --method; bj with options that polynomials alone have, as --nk]
    #[arg(long, value_name = "NAME", value_parser = by_name(ModelKind::named()))]
    pub structure: Option<ModelKind>,
    /// How: pem the prediction error method; iv4 (for arx), sriv (for oe), rivbj (for bj)
    /// instrumental variables
    #[arg(long, value_name = "NAME", default_value = "pem", value_parser = by_name(fit_methods()))]
    pub method: std::option::Option<IvMethod>,
    #[arg(long, help = about("instruments"), value_name = "CHANNEL|simulated")]
    pub instruments: Option<String>,
    #[arg(long, help = about("form"), value_name = "FORM", default_value = "auto", value_parser = by_name(forms()))]
    pub form: std::option::Option<Form>,
    #[arg(long, help = about("neuromuscular"), value_name = "YES|NO", default_value = "yes", action = clap::ArgAction::Set, value_parser = by_name([("yes", true), ("no", false)]))]
    pub neuromuscular: bool,
    #[arg(long, help = about("prior"), value_name = "PRIOR", allow_hyphen_values = true)]
    pub prior: Option<String>,
    #[arg(long, help = about("excitation"), value_name = "COLUMN|none")]
    pub excitation: Option<String>,
    #[arg(long, help = about("period"), value_name = "S")]
    pub period: Option<f64>,
    #[arg(long, help = about("run_to_run"), value_name = "SHARE")]
    pub run_to_run: Option<f64>,
    #[arg(long, help = about("remnant_order"), value_name = "M|LO..HI", value_parser = parse_range)]
    pub remnant_order: Option<RangeInclusive<usize>>,
    #[arg(long, help = about("delay"), value_name = "S|LO..HI", value_parser = parse_seconds, conflicts_with = "nk")]
    pub delay: Option<(f64, f64)>,
    #[arg(long, help = about("individual"), value_name = "NAMES", value_delimiter = ',')]
    pub individual: Vec<String>,
    #[arg(long, value_name = "FILE", help = format!(
        "Write what changes (K_e, T_L, K_e_dot; K, T_L of another form) over time into this file, for time-varying: {}",
        writable_endings()
    ))]
    pub trace: Option<PathBuf>,
    #[arg(long, help = about("orders"), value_name = "LIST")]
    pub orders: Option<String>,
    #[arg(long, help = format!("{}; or dead time in s: 0.28s, 0.2s..0.4s", about("nk")), value_name = "N|Ss|LO..HI", value_parser = parse_delay)]
    pub nk: Option<DelayRange>,
    /// What decides between candidates when something is searched
    #[arg(long, value_name = "NAME", default_value = "bic", value_parser = choice_of(&Criterion::ALL))]
    pub criterion: Criterion,
    #[arg(long, help = about("initial_state"), value_name = "RULE", default_value = "auto", value_parser = by_name(initial_states()))]
    pub initial_state: std::option::Option<InitialState>,
    #[arg(long, help = about("start"), value_name = "LIST", allow_hyphen_values = true)]
    pub start: Option<String>,
    #[arg(long, help = about("fix"), value_name = "LIST", allow_hyphen_values = true)]
    pub fix: Option<String>,
    #[arg(long, help = about("bound"), value_name = "LIST", allow_hyphen_values = true)]
    pub bound: Option<String>,
    #[arg(long, help = about("coefficient_prior"), value_name = "LIST", allow_hyphen_values = true)]
    pub coefficient_prior: Option<String>,
    #[arg(long, help = about("robust"), value_name = "K", num_args = 0..=1, default_missing_value = "1.345")]
    pub robust: Option<f64>,
    #[arg(long, help = about("focus"), value_name = "WHAT", default_value = "prediction", value_parser = choice_of(&Focus::ALL))]
    pub focus: Focus,
    #[arg(long, help = about("stable"))]
    pub stable: bool,
    #[arg(long, help = about("search_method"), value_name = "METHOD", default_value = "auto", value_parser = choice_of(&SearchMethod::ALL))]
    pub search_method: SearchMethod,
    #[arg(long, help = about("max_iterations"), value_name = "N")]
    pub max_iterations: Option<usize>,
    #[arg(long, help = about("tolerance"), value_name = "X")]
    pub tolerance: Option<f64>,
    /// Discretisation that is inverted to get T_n and K_n from the noise model
    #[arg(long, value_name = "NAME", default_value = "zoh", value_parser = choice_of(&RemnantDiscretisation::ALL))]
    pub remnant_discretisation: RemnantDiscretisation,
    /// Controlled element in s, as 90/(s(s+6)), or NUM/DEN by descending powers of s, as 90/1,6,0:
    /// adds crossover frequency and margins
    #[arg(long, value_name = "ELEMENT", allow_hyphen_values = true)]
    pub controlled_element: Option<ContinuousTransferFunction>,
    #[command(flatten)]
    pub picture: FigureArgs,
    /// Also judge the prediction K samples ahead
    #[arg(long, value_name = "K", value_parser = parse_horizon)]
    pub horizon: Option<usize>,
    /// Another record to judge the model on
    #[arg(long, value_name = "FILE")]
    pub validate: Option<PathBuf>,
    /// Write a report (HTML) into this directory
    #[arg(long, value_name = "DIR")]
    pub report: Option<PathBuf>,
    #[command(flatten)]
    pub show: ShowArgs,
}

/// What `identify` fits.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ModelKind {
    /// A polynomial structure.
    Polynomial(Structure),
    /// An operator of the family of people.
    Family,
    /// A gain with a lead, and its remnant of order m, in physical parameters.
    GreyBox,
    /// An operator with gains that change once.
    TimeVarying,
}

impl ModelKind {
    /// Whether orders and delay are numbers of samples.
    pub fn counts_samples(self) -> bool {
        matches!(self, Self::Polynomial(_))
    }

    /// The names that are typed, in the order of the help page.
    fn named() -> impl Iterator<Item = (&'static str, Self)> {
        let structures = Structure::ALL.map(|structure| (structure.name(), Self::Polynomial(structure)));
        let others = [("grey-box", Self::Family), ("time-varying", Self::TimeVarying)];
        structures.into_iter().chain(others)
    }
}

/// The forms by name; auto is none of them.
fn forms() -> impl Iterator<Item = (&'static str, Option<Form>)> {
    [("auto", None)]
        .into_iter()
        .chain(Form::ALL.map(|form| (form.name(), Some(form))))
}

/// Instrumental variables by name, and the prediction error method, which is none of them.
fn fit_methods() -> impl Iterator<Item = (&'static str, Option<IvMethod>)> {
    let instruments = IvMethod::ALL.map(|method| (method.name(), Some(method)));
    [("pem", None)].into_iter().chain(instruments)
}

/// The rules for initial states by name; automatic is none of them.
fn initial_states() -> impl Iterator<Item = (&'static str, Option<InitialState>)> {
    let rules = InitialState::ALL.map(|rule| (rule.name(), Some(rule)));
    [("auto", None)].into_iter().chain(rules)
}

/// Help of an option, from the registry of estimators: what it does, what it belongs to where that
/// is not all, its default.
fn about(name: &str) -> String {
    let all = estimators();
    let Some(setting) = estimator_setting(name) else {
        return String::new();
    };
    let of = estimators_with(name, &all);
    let mut text = setting.help;
    if !setting.unit.is_empty() {
        text.push_str(&format!(", {}", setting.unit));
    }
    if of.len() < all.len() {
        text.push_str(&format!(" [for {}]", of.join(", ")));
    }
    // Where clap knows the default it prints it itself.
    let known = matches!(setting.kind, Kind::Choice(_) | Kind::Flag) || name == "form";
    if !known && !setting.default.is_empty() {
        text.push_str(&format!(" [default: {}]", defaults(name, &all)));
    }
    text
}

/// The default of an option, by the estimators where they differ.
fn defaults(name: &str, all: &[MethodSpec]) -> String {
    let mut values: Vec<(String, Vec<&str>)> = Vec::new();
    for spec in all {
        let own = spec.settings.iter().filter(|setting| setting.name == name);
        for Setting { default, .. } in own {
            match values.iter_mut().find(|(known, _)| known == default) {
                Some((_, of)) => of.push(spec.name),
                None => values.push((default.clone(), vec![spec.name])),
            }
        }
    }
    match values.as_slice() {
        [(only, _)] => only.clone(),
        several => {
            let of = |(value, names): &(String, Vec<&str>)| format!("{value} for {}", names.join(", "));
            several.iter().map(of).collect::<Vec<_>>().join("; ")
        }
    }
}

/// The estimators that have an option.
pub fn estimators_with<'s>(name: &str, all: &'s [MethodSpec]) -> Vec<&'s str> {
    let has = |spec: &&MethodSpec| spec.settings.iter().any(|setting| setting.name == name);
    all.iter().filter(has).map(|spec| spec.name).collect()
}
