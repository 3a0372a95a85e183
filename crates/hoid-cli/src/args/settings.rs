//! The options of recursive methods and batch estimators as flags, made from the registries of the library:
//! nothing is listed here.

use std::{collections::BTreeSet, marker::PhantomData};

use clap::{Arg, ArgAction, ArgMatches, Args, Command, FromArgMatches};
use hoid::analysis::registry::{CHANGE, OPERATOR, PEM, REMNANT, estimators};
use hoid::ident::{
    IvMethod,
    settings::{Kind, MethodSpec, Setting},
};
use hoid::survey;

use super::choices::value_parser_by_name;

/// The options of the recursive methods.
#[derive(Debug, Clone, Copy, Default)]
pub struct RecursiveMethods;

/// The options of the batch estimators.
#[derive(Debug, Clone, Copy, Default)]
pub struct BatchEstimators;

/// Commands and methods that have options.
pub trait Registry {
    /// Returns the available items in the order of the help.
    fn specs() -> Vec<MethodSpec>;

    /// Returns the options that the help does not show.
    fn hidden_options() -> BTreeSet<&'static str> {
        BTreeSet::new()
    }
}

impl Registry for RecursiveMethods {
    fn specs() -> Vec<MethodSpec> {
        survey::registry()
    }

    fn hidden_options() -> BTreeSet<&'static str> {
        survey::options_for_comparison()
    }
}

impl Registry for BatchEstimators {
    fn specs() -> Vec<MethodSpec> {
        estimators()
    }
}

/// Options as typed: names and strings, in the order of the registry.
#[derive(Debug, Clone, Default)]
pub struct SettingArgs<R = RecursiveMethods> {
    given: Vec<(&'static str, String)>,
    of: PhantomData<R>,
}

impl<R> SettingArgs<R> {
    /// Returns the name and the text of each option given.
    pub fn given_settings(&self) -> impl Iterator<Item = (&'static str, &str)> {
        self.given.iter().map(|(name, text)| (*name, text.as_str()))
    }

    /// Returns the text of an option, if it was given.
    pub fn text(&self, name: &str) -> Option<&str> {
        self.given_settings()
            .find(|(given, _)| *given == name)
            .map(|(_, text)| text)
    }
}

/// Returns the flag of an option: its name, except `for` for `answers` (a keyword argument cannot be called `for`).
pub fn flag(name: &str) -> String {
    match name {
        "answers" => "for".to_owned(),
        name => name.replace('_', "-"),
    }
}

/// Returns the names of estimators and methods as in the help, with one word for a group.
pub fn as_text(names: &[&str]) -> String {
    let operators = [OPERATOR, REMNANT, CHANGE];
    let polynomials: Vec<&str> = [PEM].into_iter().chain(IvMethod::ALL.map(IvMethod::name)).collect();
    let mut words: Vec<String> = Vec::new();
    let mut left = names.to_vec();
    for (group, word) in [(&operators[..], "operators"), (&polynomials[..], "polynomials")] {
        if group.iter().all(|name| left.contains(name)) {
            left.retain(|name| !group.contains(name));
            words.push(word.to_owned());
        }
    }
    words.extend(left.into_iter().map(|name| match name {
        REMNANT => "--noise remnant".to_owned(),
        CHANGE => "--change sigmoid".to_owned(),
        name => name.to_owned(),
    }));
    words.join(", ")
}

/// Returns the methods that have an option.
pub fn methods_with<'s>(name: &str, methods: &'s [MethodSpec]) -> Vec<&'s str> {
    let has = |spec: &&MethodSpec| spec.settings.iter().any(|setting| setting.name == name);
    methods.iter().filter(has).map(|spec| spec.name).collect()
}

/// Returns the command with a flag for each option of these methods.
pub fn with_settings(mut command: Command, methods: &[MethodSpec]) -> Command {
    let mut done = BTreeSet::new();
    for setting in methods.iter().flat_map(|spec| &spec.settings) {
        if done.insert(setting.name) {
            command = command.arg(argument(setting, methods));
        }
    }
    command
}

fn argument(setting: &Setting, methods: &[MethodSpec]) -> Arg {
    let arg = Arg::new(setting.name)
        .long(flag(setting.name))
        .help(help(setting, methods))
        .allow_hyphen_values(!matches!(setting.kind, Kind::Flag | Kind::NumberOrDefault(_)));
    match setting.kind {
        Kind::Flag => arg.action(ArgAction::SetTrue),
        Kind::Choice(words) => {
            let words = words.iter().map(|word| (*word, (*word).to_owned()));
            arg.value_name("NAME").value_parser(value_parser_by_name(words))
        }
        Kind::Count => arg.value_name("N"),
        Kind::Counts => arg.value_name("N|LO..HI"),
        Kind::NumberOrDefault(_) => arg.value_name("X").num_args(0..=1).default_missing_value("true"),
        Kind::NumberOrSpan => arg.value_name("X|LO..HI"),
        Kind::Delay => arg.value_name("N|Ss|LO..HI"),
        Kind::Names => arg.value_name("NAMES"),
        Kind::Guess => arg.value_name("VALUE:WEIGHT"),
        Kind::Element => arg.value_name("ELEMENT"),
        Kind::Number => arg.value_name("X"),
        Kind::Memory => arg.value_name("N|Ss|inf"),
        Kind::NumberOrOff => arg.value_name("X|off"),
        Kind::Span | Kind::OpenSpan => arg.value_name("LO..HI"),
        Kind::Channel => arg.value_name("CHANNEL"),
        Kind::Prior => arg.value_name("PRIOR"),
        Kind::Named(_) => arg.value_name("LIST"),
    }
}

/// Returns the help of an option, with the methods that have it unless all do, and with the default, which may differ
/// between methods.
fn help(setting: &Setting, methods: &[MethodSpec]) -> String {
    let mut text = setting.help.clone();
    if !setting.unit.is_empty() {
        text.push_str(&format!(", {}", setting.unit));
    }
    let of = methods_with(setting.name, methods);
    if of.len() < methods.len() {
        text.push_str(&format!(" [for {}]", as_text(&of)));
    }
    let mut defaults: Vec<(&str, Vec<&str>)> = Vec::new();
    for spec in methods {
        let Some(own) = spec.settings.iter().find(|own| own.name == setting.name) else {
            continue;
        };
        match defaults.iter_mut().find(|(default, _)| *default == own.default) {
            Some((_, names)) => names.push(spec.name),
            None => defaults.push((&own.default, vec![spec.name])),
        }
    }
    let words = match defaults.as_slice() {
        [(default, _)] => (*default).to_owned(),
        several => {
            let each = several
                .iter()
                .filter(|(default, _)| !default.is_empty())
                .map(|(default, names)| format!("{default} for {}", as_text(names)));
            each.collect::<Vec<_>>().join("; ")
        }
    };
    if !words.is_empty() && setting.kind != Kind::Flag {
        text.push_str(&format!(" [default: {words}]"));
    }
    text
}

impl<R: Registry> Args for SettingArgs<R> {
    fn augment_args(command: Command) -> Command {
        let hidden = R::hidden_options().into_iter();
        hidden.fold(with_settings(command, &R::specs()), |command, name| {
            command.mut_arg(name, |arg| arg.hide(true))
        })
    }

    fn augment_args_for_update(command: Command) -> Command {
        Self::augment_args(command)
    }
}

impl<R: Registry> FromArgMatches for SettingArgs<R> {
    fn from_arg_matches(matches: &ArgMatches) -> Result<Self, clap::Error> {
        let mut args = Self {
            given: Vec::new(),
            of: PhantomData,
        };
        args.update_from_arg_matches(matches)?;
        Ok(args)
    }

    fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> Result<(), clap::Error> {
        let mut done = BTreeSet::new();
        for setting in R::specs().into_iter().flat_map(|spec| spec.settings) {
            if !done.insert(setting.name) {
                continue;
            }
            let text = match setting.kind {
                Kind::Flag => matches.get_flag(setting.name).then(|| "true".to_owned()),
                _ => matches.get_one::<String>(setting.name).cloned(),
            };
            self.given.extend(text.map(|text| (setting.name, text)));
        }
        Ok(())
    }
}
