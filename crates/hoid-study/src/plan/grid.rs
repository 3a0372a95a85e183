//! Grids in TOML: where a list replaces a single value, each of its entries is used in turn.
//!
//! A table of a plan is split into its leaves, such as `remnant.order = [1, 2]`. A leaf with a list is an axis, unless
//! the key requires a list as its value. All combinations are formed; the first axis in the file varies slowest. Each
//! combination is written as a table without lists, one key per line. For each of these lines, the corresponding line
//! of the plan is stored, so messages can refer to the line that the user wrote.

use toml::{
    Spanned,
    de::{DeTable, DeValue},
};

use super::problem::PlanProblem;

/// Largest number of combinations of one table; it prevents a typing error from exhausting the memory.
const MAX_COMBINATIONS: usize = 1_000_000;

/// One combination of the entries of the lists in a table.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Variant {
    /// The table without lists.
    pub text: String,
    /// For each line of `text`, the corresponding line of the plan, counted from 1.
    pub lines: Vec<usize>,
    /// The selected entry of each list, in the order of the file.
    pub axes: Vec<Axis>,
}

/// A key with a list, and the entry selected from it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Axis {
    /// Path of the key from the top of the table, joined by `_`.
    pub key: String,
    /// The entry: text without quotes, a number as written in the plan, or the `name` of a table.
    pub value: String,
}

struct Leaf {
    path: Vec<String>,
    /// Each entry as written in the plan, and as displayed.
    entries: Vec<(String, String)>,
    is_axis: bool,
    /// Position of the key in the plan.
    start: usize,
}

impl Variant {
    /// Returns the line of the plan that corresponds to a line of `text`; 1 if there is none.
    pub fn line(&self, of_text: usize) -> usize {
        let at = of_text.saturating_sub(1).min(self.lines.len().saturating_sub(1));
        self.lines.get(at).copied().unwrap_or(1)
    }

    /// Returns the first line of the plan that contains a key, given as in `text`, or a key below it.
    pub fn line_of_key(&self, key: &str) -> Option<usize> {
        let at = self.text.lines().position(|line| {
            line.strip_prefix(key)
                .is_some_and(|rest| rest.trim_start().starts_with(['=', '.']))
        })?;
        self.lines.get(at).copied()
    }

    /// Deserialises the table; a problem is reported with the line of the plan.
    pub fn read<T: serde::de::DeserializeOwned>(&self) -> Result<T, PlanProblem> {
        toml::from_str(&self.text).map_err(|error| {
            let line = error.span().map_or(1, |span| line_at(&self.text, span.start));
            PlanProblem {
                line: Some(self.line(line)),
                reason: error.message().trim_end().to_owned(),
            }
        })
    }
}

/// Returns the line of the byte at position `byte` of the text, counted from 1.
pub fn line_at(text: &str, byte: usize) -> usize {
    1 + text.as_bytes()[..byte.min(text.len())]
        .iter()
        .filter(|b| **b == b'\n')
        .count()
}

/// Returns all combinations of the entries of the lists in a table. Lists and tables of the keys in `whole` (full
/// names, joined by dots) are kept unchanged.
pub fn variants(table: &Spanned<DeTable<'_>>, source: &str, whole: &[&str]) -> Result<Vec<Variant>, PlanProblem> {
    let mut leaves = Vec::new();
    collect(table.get_ref(), source, whole, &mut Vec::new(), &mut leaves)?;
    leaves.sort_by_key(|leaf| leaf.start);
    let mut count = 1usize;
    for leaf in &leaves {
        count = count.saturating_mul(leaf.entries.len());
        if count > MAX_COMBINATIONS {
            return Err(PlanProblem {
                line: Some(line_at(source, leaf.start)),
                reason: format!(
                    "the lists of this table give more than {MAX_COMBINATIONS} combinations; expected fewer: shorten a list or split the plan"
                ),
            });
        }
    }
    let first_line = line_at(source, table.span().start);
    Ok((0..count)
        .map(|index| combination(index, count, &leaves, source, first_line))
        .collect())
}

fn combination(index: usize, count: usize, leaves: &[Leaf], source: &str, first_line: usize) -> Variant {
    let mut variant = Variant {
        text: String::new(),
        lines: Vec::new(),
        axes: Vec::new(),
    };
    let (mut rest, mut block) = (index, count);
    for leaf in leaves {
        block /= leaf.entries.len();
        let (written, shown) = &leaf.entries[rest / block];
        rest %= block;
        if leaf.is_axis {
            variant.axes.push(Axis {
                key: leaf.path.join("_"),
                value: shown.clone(),
            });
        }
        let key: Vec<String> = leaf.path.iter().map(|part| quote_key(part)).collect();
        let line = format!("{} = {written}\n", key.join("."));
        let at = line_at(source, leaf.start);
        // All lines of an entry refer to the line of its key. If a list spans several lines, the lines of its later
        // entries are not known, and a user looks for the first line.
        variant.lines.extend(line.lines().map(|_| at));
        variant.text.push_str(&line);
    }
    if variant.lines.is_empty() {
        variant.lines.push(first_line);
    }
    variant
}

fn collect(
    table: &DeTable<'_>,
    source: &str,
    whole: &[&str],
    path: &mut Vec<String>,
    leaves: &mut Vec<Leaf>,
) -> Result<(), PlanProblem> {
    for (key, value) in table.iter() {
        path.push(key.get_ref().to_string());
        let start = key.span().start;
        let as_it_stands = whole.contains(&path.join(".").as_str());
        match value.get_ref() {
            DeValue::Table(inner) if !as_it_stands => collect(inner, source, whole, path, leaves)?,
            DeValue::Array(array) if !as_it_stands => {
                if array.is_empty() {
                    return Err(PlanProblem {
                        line: Some(line_at(source, start)),
                        reason: format!(
                            "{} is an empty list, expected at least one entry: leave the key out to use the default",
                            path.join(".")
                        ),
                    });
                }
                leaves.push(Leaf {
                    path: path.clone(),
                    entries: array.iter().map(|entry| entry_texts(entry, source)).collect(),
                    is_axis: true,
                    start,
                });
            }
            _ => leaves.push(Leaf {
                path: path.clone(),
                entries: vec![entry_texts(value, source)],
                is_axis: false,
                start,
            }),
        }
        path.pop();
    }
    Ok(())
}

/// Returns an entry as TOML, and as displayed.
fn entry_texts(entry: &Spanned<DeValue<'_>>, source: &str) -> (String, String) {
    let written = inline_toml(entry, source);
    let shown = match entry.get_ref() {
        DeValue::String(text) => text.to_string(),
        DeValue::Table(table) => table
            .iter()
            .find(|(key, _)| key.get_ref().as_ref() == "name")
            .and_then(|(_, value)| value.get_ref().as_str().map(str::to_owned))
            .unwrap_or_else(|| written.clone()),
        _ => written.clone(),
    };
    (written, shown)
}

/// Writes a value on one line. A table under a separate heading has no contiguous text in the plan, so its text is
/// assembled.
fn inline_toml(value: &Spanned<DeValue<'_>>, source: &str) -> String {
    match value.get_ref() {
        DeValue::Table(table) => {
            let mut fields: Vec<_> = table.iter().collect();
            fields.sort_by_key(|(key, _)| key.span().start);
            let fields: Vec<String> = fields
                .into_iter()
                .map(|(key, value)| format!("{} = {}", quote_key(key.get_ref()), inline_toml(value, source)))
                .collect();
            format!("{{ {} }}", fields.join(", "))
        }
        DeValue::Array(array) => {
            let entries: Vec<String> = array.iter().map(|entry| inline_toml(entry, source)).collect();
            format!("[{}]", entries.join(", "))
        }
        _ => source[value.span()].to_owned(),
    }
}

fn quote_key(key: &str) -> String {
    let bare = !key.is_empty() && key.bytes().all(|b| b.is_ascii_alphanumeric() || b == b'_' || b == b'-');
    if bare { key.to_owned() } else { format!("{key:?}") }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(text: &str, whole: &[&str]) -> Result<Vec<Variant>, PlanProblem> {
        variants(&DeTable::parse(text).unwrap(), text, whole)
    }

    #[test]
    fn lists_become_axes_in_file_order() {
        let text = "condition = ['C2', \"C1\"]\nname = \"x\"\n[remnant]\norder = [1,\n 2]\nnoise_level = 0.1\n";
        let all = of(text, &[]).unwrap();
        let shown: Vec<String> = all
            .iter()
            .map(|v| v.axes.iter().map(|a| format!("{}={} ", a.key, a.value)).collect())
            .collect();
        assert_eq!(
            shown,
            [
                "condition=C2 remnant_order=1 ",
                "condition=C2 remnant_order=2 ",
                "condition=C1 remnant_order=1 ",
                "condition=C1 remnant_order=2 "
            ]
        );
        assert_eq!(
            all[3].text,
            "condition = \"C1\"\nname = \"x\"\nremnant.order = 2\nremnant.noise_level = 0.1\n"
        );
        assert_eq!(all[3].lines, [1, 2, 4, 6]);
        assert_eq!(all[3].line_of_key("remnant.noise_level"), Some(6));
    }

    #[test]
    fn list_valued_keys_are_kept() {
        let text = "span_s = [0, 30.72]\n[[forcing]]\namplitude_deg = 1.0\n[[forcing]]\namplitude_deg = 2.0\n";
        let all = of(text, &["span_s", "forcing"]).unwrap();
        assert_eq!(all.len(), 1);
        assert_eq!(
            all[0].text,
            "span_s = [0, 30.72]\nforcing = [{ amplitude_deg = 1.0 }, { amplitude_deg = 2.0 }]\n"
        );
    }

    #[test]
    fn tables_in_a_list_are_labelled_by_name() {
        let text = "start = [{ name = \"IC1\", b0 = 0.1 }, { b0 = 0.2 }]";
        let all = of(text, &[]).unwrap();
        assert_eq!(all[0].axes[0].value, "IC1");
        assert_eq!(all[1].axes[0].value, "{ b0 = 0.2 }");
    }

    #[test]
    fn empty_lists_and_too_many_cells_are_refused() {
        let problem = of("a = 1\nb = []", &[]).unwrap_err();
        assert_eq!(problem.line, Some(2));
        assert!(problem.reason.contains("empty list"), "{}", problem.reason);
        let long = format!("[{}]", vec!["1"; 1001].join(", "));
        let problem = of(&format!("a = {long}\nb = {long}"), &[]).unwrap_err();
        assert_eq!(problem.line, Some(2));
    }
}
