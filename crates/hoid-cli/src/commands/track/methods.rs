//! `hoid track --methods`: list of the recursive methods, with the options that help does not show.

use hoid::survey::{ListedMethod, is_option_for_comparison, list_methods};
use serde_json::{Value, json};

use crate::{args::flag, error::CliError, json, output};

/// Prints the methods, one per line, or as a JSON list.
pub fn list(as_json: bool) -> Result<(), CliError> {
    let all = list_methods();
    if as_json {
        return json::print(&Value::Array(all.iter().map(method_json).collect()));
    }
    let lines: String = all.iter().map(method_line).collect();
    output::print(&lines)
}

fn structure_names(one: &ListedMethod) -> Vec<&'static str> {
    one.spec.structures.iter().map(|structure| structure.name()).collect()
}

fn method_line(one: &ListedMethod) -> String {
    let mark = match (one.is_default, one.is_for_comparison) {
        (true, _) => "default",
        (_, true) => "survey",
        _ => "",
    };
    let spec = &one.spec;
    let hidden = spec.settings.iter().filter(|s| is_option_for_comparison(s.name));
    let hidden: Vec<String> = hidden.map(|s| format!("--{}", flag(s.name))).collect();
    let options = match hidden.as_slice() {
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
