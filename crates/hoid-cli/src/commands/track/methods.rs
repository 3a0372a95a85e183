//! `hoid track --methods`: list of the recursive methods, with the options that help does not show.

use std::collections::BTreeSet;

use hoid::survey::{ListedMethod, list_methods, options_for_comparison};
use serde_json::{Value, json};

use crate::{args::flag, error::CliError, json, output};

/// Prints the methods, one per line, or as a JSON list.
pub fn list(as_json: bool) -> Result<(), CliError> {
    let all = list_methods();
    if as_json {
        return json::print(&Value::Array(all.iter().map(method_json).collect()));
    }
    let hidden = options_for_comparison();
    let lines: String = all.iter().map(|one| method_line(one, &hidden)).collect();
    output::print(&lines)
}

fn structure_names(one: &ListedMethod) -> Vec<&'static str> {
    one.spec.structures.iter().map(|structure| structure.name()).collect()
}

fn method_line(one: &ListedMethod, hidden: &BTreeSet<&str>) -> String {
    let mark = match (one.is_default, one.is_for_comparison) {
        (true, _) => "default",
        (_, true) => "survey",
        _ => "",
    };
    let spec = &one.spec;
    let further = spec.settings.iter().filter(|s| hidden.contains(s.name));
    let further: Vec<String> = further.map(|s| format!("--{}", flag(s.name))).collect();
    let options = match further.as_slice() {
        [] => String::new(),
        all => format!("; further options: {}", all.join(", ")),
    };
    format!(
        "{:15} {mark:8} {} ({}; {}{options})\n",
        spec.name,
        spec.help,
        structure_names(one).join(", "),
        spec.source
    )
}

fn method_json(one: &ListedMethod) -> Value {
    let spec = &one.spec;
    json!({
        "name": spec.name,
        "help": spec.help,
        "source": spec.source,
        "structures": structure_names(one),
        "default": one.is_default,
        "survey": one.is_for_comparison,
    })
}
