//! The options of the recursive methods as flags, made from the registry of the library: nothing is
//! listed here.

use std::collections::BTreeSet;

use clap::{Arg, ArgAction, ArgMatches, Args, Command, FromArgMatches};
use hoid::ident::settings::{Kind, MethodSpec, Setting};
use hoid::track::Method;

use super::choices::by_name;

/// What was typed: name and text, in the order of the registry.
#[derive(Debug, Clone, Default)]
pub struct SettingArgs {
    given: Vec<(&'static str, String)>,
}

impl SettingArgs {
    /// Name and text of each.
    pub fn given(&self) -> impl Iterator<Item = (&'static str, &str)> {
        self.given.iter().map(|(name, text)| (*name, text.as_str()))
    }
}

/// The flag of an option.
pub fn flag(name: &str) -> String {
    name.replace('_', "-")
}

/// The methods that have an option.
pub fn methods_with<'s>(name: &str, methods: &'s [MethodSpec]) -> Vec<&'s str> {
    let has = |spec: &&MethodSpec| spec.settings.iter().any(|setting| setting.name == name);
    methods.iter().filter(has).map(|spec| spec.name).collect()
}

/// A command with a flag for each option of these methods.
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
        .allow_hyphen_values(setting.kind != Kind::Flag);
    match setting.kind {
        Kind::Flag => arg.action(ArgAction::SetTrue),
        Kind::Choice(words) => {
            let words = words.iter().map(|word| (*word, (*word).to_owned()));
            arg.value_name("NAME").value_parser(by_name(words))
        }
        Kind::Count => arg.value_name("N"),
        Kind::Number => arg.value_name("X"),
        Kind::Memory => arg.value_name("N|Ss|inf"),
        Kind::NumberOrOff => arg.value_name("X|off"),
        Kind::Span | Kind::OpenSpan => arg.value_name("LO..HI"),
        Kind::Channel => arg.value_name("CHANNEL"),
        Kind::Prior => arg.value_name("PRIOR"),
        Kind::Named(_) => arg.value_name("LIST"),
    }
}

/// Help, the methods that it is for where they are not all, and the default, which methods may have
/// for themselves.
fn help(setting: &Setting, methods: &[MethodSpec]) -> String {
    let mut text = setting.help.clone();
    if !setting.unit.is_empty() {
        text.push_str(&format!(", {}", setting.unit));
    }
    let of = methods_with(setting.name, methods);
    if of.len() < methods.len() {
        text.push_str(&format!(" [for {}]", of.join(", ")));
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
                .map(|(default, names)| format!("{} {default}", names.join(", ")));
            each.collect::<Vec<_>>().join("; ")
        }
    };
    if !words.is_empty() && setting.kind != Kind::Flag {
        text.push_str(&format!(" [default: {words}]"));
    }
    text
}

impl Args for SettingArgs {
    fn augment_args(command: Command) -> Command {
        with_settings(command, &Method::registry())
    }

    fn augment_args_for_update(command: Command) -> Command {
        Self::augment_args(command)
    }
}

impl FromArgMatches for SettingArgs {
    fn from_arg_matches(matches: &ArgMatches) -> Result<Self, clap::Error> {
        let mut args = Self::default();
        args.update_from_arg_matches(matches)?;
        Ok(args)
    }

    fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> Result<(), clap::Error> {
        let mut done = BTreeSet::new();
        for setting in Method::registry().into_iter().flat_map(|spec| spec.settings) {
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
