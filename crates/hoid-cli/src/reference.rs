//! Pages and types generated from the registry of methods: the page of options in the book, and the keywords of the
//! Python package.
//!
//! `HOID_UPDATE_DOCS=1 cargo test -p hoid-cli` updates these pages and types.

use hoid::analysis::registry::estimators;
use hoid::ident::settings::{Kind, MethodSpec, Setting};
use hoid::survey::registry;

use crate::args::as_text;

/// Returns the type of a value as text.
fn kind_as_text(kind: Kind) -> String {
    match kind {
        Kind::Flag => "flag".to_owned(),
        Kind::Count => "whole number".to_owned(),
        Kind::Number => "number".to_owned(),
        Kind::NumberOrDefault(default) => format!("number; {default} if none is given"),
        Kind::Counts => "whole number or `LO..HI`".to_owned(),
        Kind::NumberOrSpan => "number or `LO..HI`".to_owned(),
        Kind::Delay => "samples (`29`, `20..40`) or seconds (`0.28s`, `0.1s..0.4s`)".to_owned(),
        Kind::Memory => "`256` samples, `2.56s` or `inf`".to_owned(),
        Kind::NumberOrOff => "number or `off`".to_owned(),
        Kind::Span => "`LO..HI`".to_owned(),
        Kind::OpenSpan => "`LO..HI`; either end may be omitted".to_owned(),
        Kind::Choice(words) => words
            .iter()
            .map(|word| format!("`{word}`"))
            .collect::<Vec<_>>()
            .join(", "),
        Kind::Channel => "name of a channel".to_owned(),
        Kind::Names => "`NAME,NAME,...`".to_owned(),
        Kind::Guess => "`VALUE:WEIGHT`".to_owned(),
        Kind::Element => "`90/(s(s+6))` or `90/1,6,0`".to_owned(),
        Kind::Prior => "`population`, `none`, `NAME=CENTRE:SPREAD,...`, or a file of `identify --json`".to_owned(),
        Kind::Named(of) => format!("`NAME=VALUE,...`, each {}", kind_as_text(*of)),
    }
}

/// Returns the page of options for the book.
fn options_page(methods: &[MethodSpec]) -> String {
    let mut page = "# Options of estimators and recursive methods\n\nThe recursive methods come first, the batch \
                    estimators after them. An option of a recursive method is a flag of `hoid track` and `hoid stream` \
                    (with hyphens), a key of an estimator in a plan, and a keyword of `pyhoid.track` and \
                    `pyhoid.Tracker`. In a plan, the key of a time range includes the unit (`track_delay_s`); in \
                    Python, `lambda` is called `forgetting_factor`. An option of a batch estimator is a flag of `hoid \
                    identify` and a keyword of `pyhoid.identify` (where `orders` are `na`, `nb`, ...). Options of \
                    `operator`, with or without a change, and of the instrumental-variable methods are also keys of an \
                    estimator in a plan.\n"
        .to_owned();
    for spec in methods.iter().chain(&estimators()) {
        let structures: Vec<&str> = spec.structures.iter().map(|structure| structure.name()).collect();
        page.push_str(&format!(
            "\n## {}\n\nDescription: {}.\nStructures: {}.\nSource: {}.\n\n",
            spec.name,
            spec.help,
            structures.join(", "),
            spec.source
        ));
        page.push_str("| option | type | unit | default | bounds | effect |\n|---|---|---|---|---|---|\n");
        for setting in &spec.settings {
            let bounds = match setting.kind {
                Kind::Count | Kind::Number | Kind::NumberOrOff | Kind::Span | Kind::Named(Kind::Number) => {
                    setting.bounds.to_string()
                }
                _ => String::new(),
            };
            page.push_str(&format!(
                "| `{}` | {} | {} | {} | {bounds} | {} |\n",
                setting.name,
                kind_as_text(setting.kind),
                setting.unit,
                setting.default,
                setting.help
            ));
        }
    }
    page
}

/// Returns the keyword of an option in Python, where `lambda` is reserved.
fn keyword(name: &str) -> &str {
    match name {
        "lambda" => "forgetting_factor",
        name => name,
    }
}

fn python_type(kind: Kind) -> String {
    match kind {
        Kind::Flag => "bool".to_owned(),
        Kind::Count => "int".to_owned(),
        Kind::Number => "float".to_owned(),
        Kind::NumberOrDefault(_) => "float | bool".to_owned(),
        Kind::Counts => "int | tuple[int, int] | range".to_owned(),
        Kind::NumberOrSpan => "float | tuple[float, float]".to_owned(),
        Kind::Delay => "int | tuple[int, int] | range | str".to_owned(),
        Kind::Memory => "float | str".to_owned(),
        Kind::NumberOrOff => "float | Literal[\"off\"]".to_owned(),
        Kind::Span => "tuple[float, float]".to_owned(),
        Kind::OpenSpan => "tuple[float | None, float | None]".to_owned(),
        Kind::Choice(words) => format!("Literal[{}]", quoted(words)),
        Kind::Channel => "str".to_owned(),
        Kind::Names => "Sequence[str]".to_owned(),
        Kind::Guess => "tuple[float, float]".to_owned(),
        Kind::Element => "str | tuple[Sequence[float], Sequence[float]]".to_owned(),
        Kind::Prior => "str | PathLike[str] | Mapping[str, tuple[float, float]] | OperatorFit".to_owned(),
        Kind::Named(of) => format!("Mapping[str, {}]", python_type(*of)),
    }
}

fn quoted(words: &[&str]) -> String {
    words
        .iter()
        .map(|word| format!("\"{word}\""))
        .collect::<Vec<_>>()
        .join(", ")
}

/// Wraps text into lines of at most 96 columns, each indented by `indent`.
fn wrapped(text: &str, indent: &str) -> String {
    let mut lines = vec![indent.to_owned()];
    for word in text.split_whitespace() {
        let last = lines.len() - 1;
        if lines[last].len() > indent.len() && lines[last].len() + 1 + word.len() > 96 {
            lines.push(format!("{indent}{word}"));
        } else {
            let space = if lines[last].len() > indent.len() { " " } else { "" };
            lines[last] += &format!("{space}{word}");
        }
    }
    lines.join("\n")
}

/// The options of several methods; each option occurs once, with the methods that have it.
struct Keywords<'a> {
    settings: Vec<(&'a Setting, Vec<&'a str>)>,
    methods: usize,
}

impl<'a> Keywords<'a> {
    /// Collects the options of the methods, except those in `without`, which have a different form in Python.
    fn of(methods: &'a [MethodSpec], without: &[&str]) -> Self {
        let mut settings: Vec<(&Setting, Vec<&str>)> = Vec::new();
        for spec in methods {
            for setting in spec.settings.iter().filter(|setting| !without.contains(&setting.name)) {
                match settings.iter_mut().find(|(known, _)| known.name == setting.name) {
                    Some((_, of)) => of.push(spec.name),
                    None => settings.push((setting, vec![spec.name])),
                }
            }
        }
        Self {
            settings,
            methods: methods.len(),
        }
    }

    fn option_description(&self, setting: &Setting, of: &[&str]) -> String {
        let of = if of.len() < self.methods {
            let words = as_text(of)
                .replace("--noise remnant", "noise=\"remnant\"")
                .replace("--change sigmoid", "change=\"sigmoid\"");
            format!(" For {words}.")
        } else {
            String::new()
        };
        format!("{}.{of}", setting.help)
    }

    /// Returns the Python class that contains the types of the keywords.
    fn typed_dict(&self, class: &str, doc: &str) -> String {
        let mut text = format!("\n\nclass {class}(TypedDict, total=False):\n    \"\"\"{doc}\"\"\"\n");
        for (setting, of) in &self.settings {
            let kind = python_type(setting.kind);
            let line = format!("    {}: {kind} | None", keyword(setting.name));
            let line = match (line.len() > 100, setting.kind) {
                (true, Kind::Choice(words)) => format!(
                    "    {}: (\n        Literal[\n{}        ]\n        | None\n    )",
                    keyword(setting.name),
                    words
                        .iter()
                        .map(|word| format!("            \"{word}\",\n"))
                        .collect::<String>()
                ),
                _ => line,
            };
            text.push_str(&format!(
                "\n{}\n{line}\n",
                wrapped(&self.option_description(setting, of), "    # ")
            ));
        }
        text
    }

    /// Returns the paragraphs of a docstring that describe the keywords.
    fn docstring(&self, name: &str, function: &str) -> String {
        let paragraphs: Vec<String> = self
            .settings
            .iter()
            .map(|(setting, of)| {
                let head = format!(
                    "        {} : {}",
                    keyword(setting.name),
                    python_type(setting.kind).replace('"', "'")
                );
                format!(
                    "{head}\n{}",
                    wrapped(&self.option_description(setting, of), "            ")
                )
            })
            .collect();
        format!(
            "#: The options, as the documentation of `{function}` lists them.\n{name} = \"\"\"{}\"\"\"\n",
            paragraphs.join("\n").trim_start()
        )
    }
}

/// Returns the module with the keywords of the Python package.
fn python_settings(methods: &[MethodSpec], batch: &[MethodSpec]) -> String {
    let names: Vec<&str> = methods.iter().map(|spec| spec.name).collect();
    let structures = hoid::model::Structure::ALL.map(|structure| structure.name());
    let one_a_line = |words: &[&str]| {
        words
            .iter()
            .map(|word| format!("    \"{word}\",\n"))
            .collect::<String>()
    };
    let recursive = Keywords::of(methods, &[]);
    // In Python, the orders have their own keywords.
    let batch = Keywords::of(batch, &["orders"]);
    let methods_text: Vec<String> = methods
        .iter()
        .map(|spec| wrapped(&format!("``\"{}\"``: {};", spec.name, spec.help), "        "))
        .collect();
    format!(
        "\"\"\"The estimators and recursive methods and their options, made from the registries of the library.\n\n\
         `HOID_UPDATE_DOCS=1 cargo test -p hoid-cli` renews this file; it is not edited by hand.\n\"\"\"\n\n\
         from __future__ import annotations\n\nfrom collections.abc import Mapping, Sequence\nfrom os import PathLike\n\
         from typing import TYPE_CHECKING, Literal, TypedDict\n\n\
         if TYPE_CHECKING:\n    from .operator_fit import OperatorFit\n\n\
         __all__ = [\n    \"BATCH_SETTINGS\",\n    \"METHODS\",\n    \"SETTINGS\",\n    \"BatchSettings\",\n    \
         \"MethodSettings\",\n    \"RecursiveMethod\",\n    \"Structure\",\n]\n\n\
         #: A recursive method.\nRecursiveMethod = Literal[\n{}]\n\n\
         #: A polynomial structure.\nStructure = Literal[\n{}]\n{}{}\n\n\
         #: The methods, as the documentation of `track` lists them.\nMETHODS = \"\"\"{}.\"\"\"\n\n{}\n{}",
        one_a_line(&names),
        one_a_line(&structures),
        recursive.typed_dict("MethodSettings", "Options of the recursive methods."),
        batch.typed_dict("BatchSettings", "Options of the batch estimators."),
        methods_text.join("\n").trim_start().trim_end_matches(';'),
        recursive.docstring("SETTINGS", "track"),
        batch.docstring("BATCH_SETTINGS", "identify"),
    )
}

#[cfg(test)]
mod tests {
    use clap::{Command, CommandFactory};
    use hoid::ident::settings::Bounds;

    use super::*;
    use crate::args::{Cli, flag, with_settings};

    fn assert_up_to_date(path: &str, expected: &str) {
        let path = format!("{}/../../{path}", env!("CARGO_MANIFEST_DIR"));
        if std::env::var_os("HOID_UPDATE_DOCS").is_some() {
            std::fs::write(&path, expected).unwrap();
        }
        let found = std::fs::read_to_string(&path).unwrap_or_default();
        assert_eq!(
            found, expected,
            "run HOID_UPDATE_DOCS=1 cargo test -p hoid-cli to renew {path}"
        );
    }

    #[test]
    fn documented_options_are_current() {
        assert_up_to_date("docs/src/reference/options.md", &options_page(&registry()));
    }

    #[test]
    fn python_options_are_current() {
        assert_up_to_date(
            "python/src/pyhoid/_settings.py",
            &python_settings(&registry(), &estimators()),
        );
    }

    /// Every option of the registry of estimators is a flag of `hoid identify`, with the same default if clap has one.
    #[test]
    fn identify_has_all_registry_options() {
        let mut cli = Cli::command();
        cli.build();
        let identify = cli.find_subcommand("identify").unwrap();
        for setting in estimators().into_iter().flat_map(|spec| spec.settings) {
            let name = flag(setting.name);
            let flag = identify
                .get_arguments()
                .find(|arg| arg.get_long() == Some(name.as_str()));
            let flag = flag.unwrap_or_else(|| panic!("identify has no --{name}"));
            let help = flag.get_help().unwrap().to_string();
            assert!(help.starts_with(&setting.help), "--{name}: {help}");
            if let Some(default) = flag.get_default_values().first() {
                let default = default.to_str().unwrap();
                let same = default == setting.default || default.parse::<f64>().ok() == setting.default.parse().ok();
                assert!(
                    same || setting.kind == Kind::Flag,
                    "--{name}: {default} {}",
                    setting.default
                );
            }
        }
    }

    /// An option that is declared once is available in all interfaces.
    #[test]
    fn new_option_appears_everywhere() {
        let mut methods = registry();
        let dummy = Setting::of("tremor_band", &(8.0, 12.0))
            .unit("s")
            .bounds(Bounds::NonNegative)
            .help(&["Frequencies that count as tremor"]);
        methods[5].settings.push(dummy);
        let help = with_settings(Command::new("track"), &methods)
            .render_long_help()
            .to_string();
        assert!(
            help.contains("--tremor-band <LO..HI>") && help.contains("[default: 8..12]"),
            "{help}"
        );
        let schema = hoid::study::plan_schema_of(&methods);
        assert!(schema.contains("\"tremor_band_s\"") && schema.contains("count as tremor. For multiple-model."));
        let python = python_settings(&methods, &estimators());
        assert!(python.contains("    tremor_band: tuple[float, float] | None\n"));
        assert!(options_page(&methods).contains("| `tremor_band` | `LO..HI` | s | 8..12 |"));
    }

    #[test]
    fn new_batch_option_appears_everywhere() {
        let mut batch = estimators();
        let dummy = Setting::of("tremor_band", &(8.0, 12.0)).help(&["Frequencies that count as tremor"]);
        batch[0].settings.push(dummy);
        let help = with_settings(Command::new("identify"), &batch)
            .render_long_help()
            .to_string();
        assert!(
            help.contains("--tremor-band <LO..HI>") && help.contains("[for operator]"),
            "{help}"
        );
        let python = python_settings(&registry(), &batch);
        assert!(python.contains("    # Frequencies that count as tremor. For operator.\n    tremor_band: "));
        assert!(options_page(&batch).contains("| `tremor_band` | `LO..HI` |  | 8..12 |"));
    }

    #[test]
    fn new_method_appears_everywhere() {
        let mut methods = registry();
        methods.push(MethodSpec {
            name: "setpoint",
            help: "a method that is new",
            ..methods[0].clone()
        });
        assert!(python_settings(&methods, &estimators()).contains("    \"setpoint\",\n"));
        assert!(options_page(&methods).contains("\n## setpoint\n\nDescription: a method that is new.\n"));
    }
}
