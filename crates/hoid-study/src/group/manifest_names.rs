//! Options in messages about a person, in the form of the manifest: `--form lead` is `analysis.form = "lead"`, and
//! `--input r` is `conditions.C1.roles = ["r=feedforward"]`. Options without a key in the manifest belong to
//! `hoid identify`, which takes the runs of the person.

use hoid_model::option_names::{NamedOption, Renamed, literal, literal_entries, rename_options};

/// Keys of the manifest with a single value, by their option.
const KEYS: [(&str, &str); 19] = [
    ("form", "analysis.form"),
    ("prior", "analysis.prior"),
    ("output", "read.output"),
    ("time", "read.time"),
    ("trial", "read.trial"),
    ("fs", "read.sampling_hz"),
    ("from", "read.from_s"),
    ("to", "read.to_s"),
    ("detrend", "read.detrend"),
    ("faults", "read.faults"),
    ("sparse", "read.sparse"),
    ("resample", "read.resample"),
    ("fill", "read.fill"),
    ("scale", "prepare.scale"),
    ("offset", "prepare.offset"),
    ("decimate", "prepare.decimate"),
    ("new-fs", "prepare.rate_hz"),
    ("run-in", "prepare.run_in_s"),
    ("drop-repeated", "prepare.drop_repeated"),
];
/// Keys of a condition.
const CONDITION_KEYS: [(&str, &str); 2] = [
    ("controlled-element", "controlled_element"),
    ("excitation", "excitation"),
];
/// Options without a value, whose keys are true or false.
const FLAGS: [&str; 3] = ["resample", "fill", "drop-repeated"];
/// Options whose keys are tables.
const TABLES: [&str; 3] = ["sparse", "scale", "offset"];

/// Returns the message about a person in a condition with keys of the manifest in place of options.
pub(super) fn in_manifest(message: &str, condition: &str) -> String {
    rename_options(message, |option| rename(option, condition))
}

fn rename(option: NamedOption<'_>, condition: &str) -> Option<Renamed> {
    let NamedOption { name, value, .. } = option;
    if option.is_in_command() {
        return None;
    }
    let table = match condition {
        "" => "conditions.NAME".to_owned(),
        name => format!("conditions.{}", toml_key(name)),
    };
    let find = |keys: &'static [(&'static str, &'static str)]| {
        keys.iter().find(|(typed, _)| *typed == name).map(|(_, key)| *key)
    };
    let key = match name {
        "input" => match value {
            Some(column) => {
                return Some(Renamed::WithValue(format!(
                    "{table}.roles = [\"{column}=feedforward\"]"
                )));
            }
            None => "read.input".to_owned(),
        },
        "role" => format!("{table}.roles"),
        // A group does not cut its runs.
        "faults" if value == Some("cut") => return Some(Renamed::Name("hoid identify --faults".to_owned())),
        _ => match (find(&KEYS), find(&CONDITION_KEYS)) {
            (Some(key), _) => key.to_owned(),
            (None, Some(key)) => format!("{table}.{key}"),
            (None, None) => return Some(Renamed::Name(format!("hoid identify --{name}"))),
        },
    };
    Some(match value {
        _ if FLAGS.contains(&name) => Renamed::Name(format!("{key} = true")),
        None => Renamed::Name(key),
        Some(value) => Renamed::WithValue(format!("{key} = {}", toml_value(name, value))),
    })
}

/// Returns a name as a key of TOML.
fn toml_key(name: &str) -> String {
    let is_bare = name.chars().all(|c| c.is_ascii_alphanumeric() || c == '_' || c == '-');
    if is_bare { name.to_owned() } else { format!("{name:?}") }
}

fn toml_value(option: &str, value: &str) -> String {
    if option == "role" {
        return format!("[{value:?}]");
    }
    if !TABLES.contains(&option) {
        return literal(value);
    }
    let entries = literal_entries(value, |name, value| format!("{} = {value}", toml_key(name)));
    format!("{{ {entries} }}")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::group::Manifest;

    /// Every key that a message may name is a key of the manifest, with the value that the message states.
    #[test]
    fn named_keys_are_read() {
        for typed in [
            "--form lead-lag",
            "--prior none",
            "--trial t",
            "--fs 100",
            "--from 5",
            "--to 60",
            "--detrend mean",
            "--faults keep",
            "--faults cut",
            "--sparse r=hold",
            "--resample",
            "--fill",
            "--scale e=0.5,u=rad:deg",
            "--offset u=1",
            "--decimate 2",
            "--new-fs 50",
            "--run-in 5",
            "--drop-repeated",
            "--input r",
            "--role r=feedforward",
            "--excitation f_t",
        ] {
            let said = in_manifest(&format!("add {typed}"), "C 1");
            let line = said.strip_prefix("add ").unwrap();
            let run = "[[runs]]\nfile = \"a.csv\"\nsubject = \"P\"\ncondition = \"C 1\"\nrun = \"1\"\n";
            let text = format!("name = \"g\"\n{line}\n{run}");
            match line.strip_prefix("hoid identify ") {
                Some(rest) => assert_eq!(rest, typed),
                None => assert!(
                    Manifest::parse(&text, "group.toml").is_ok(),
                    "{typed}: {line}: {:?}",
                    Manifest::parse(&text, "")
                ),
            }
        }
        assert_eq!(
            in_manifest("without --controlled-element (90/(s(s+6)), say)", "C 1"),
            "without conditions.\"C 1\".controlled_element (90/(s(s+6)), say)"
        );
        assert_eq!(
            in_manifest("longer runs; --form, --neuromuscular no", "C1"),
            "longer runs; analysis.form, hoid identify --neuromuscular no"
        );
    }
}
