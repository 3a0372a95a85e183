//! Checks the page of the book that lists the rows of the thesis: each listed item is made, each item made is listed,
//! and the stated totals agree with the rows.
#![allow(clippy::unwrap_used)]

use std::{collections::BTreeSet, path::Path};

use hoid_thesis::{CLAIMS_NAME, reproduction::items};

/// Returns the cells of the rows of the tables under a heading.
fn rows<'a>(page: &'a str, heading: &str) -> Vec<Vec<&'a str>> {
    let section = page.split(&format!("\n## {heading}\n")).nth(1).unwrap();
    let section = section.split("\n## ").next().unwrap();
    let lines = section.lines().filter(|line| line.starts_with('|')).skip(2);
    lines
        .map(|line| line.trim_matches('|').split('|').map(str::trim).collect())
        .collect()
}

/// Expands ranges such as `C.1` to `C.16`; any other text is returned unchanged.
fn expand_range(first: &str, last: &str) -> Vec<String> {
    let (letter, from) = first.rsplit_once('.').unwrap_or(("", first));
    let to: u32 = last.rsplit_once('.').map_or(last, |(_, n)| n).parse().unwrap();
    (from.parse().unwrap()..=to).map(|n| format!("{letter}.{n}")).collect()
}

/// Returns the number of rows of the thesis in a cell such as `Figs. 1, 2.1` or `Figs. C.1 to C.16`.
fn row_count(cell: &str) -> usize {
    let (_, numbers) = cell.split_once(' ').unwrap();
    let of = |part: &str| {
        part.split_once(" to ")
            .map_or(1, |(first, last)| expand_range(first, last).len())
    };
    numbers.split(", ").map(of).sum()
}

/// Returns the names between backticks, with ranges expanded.
fn quoted_names(cell: &str) -> Vec<String> {
    let parts: Vec<&str> = cell.split('`').collect();
    let mut names = Vec::new();
    for at in (1..parts.len()).step_by(2) {
        if at >= 2 && parts[at - 1] == " to " {
            names.pop();
            names.extend(expand_range(parts[at - 2], parts[at]));
        } else {
            names.push(parts[at].to_owned());
        }
    }
    names
}

#[test]
fn documented_rows_match_the_program() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let page = std::fs::read_to_string(root.join("docs/src/thesis/rows.md")).unwrap();
    let [tables, figures, formulas, proposals] = ["Tables", "Figures", "Formulas", "Proposals"].map(|h| rows(&page, h));

    let total = |rows: &[Vec<&str>]| rows.iter().map(|row| row_count(row[0])).sum::<usize>();
    let numbers = [total(&tables), total(&figures), formulas.len(), proposals.len()];
    let [t, f, g, p] = numbers;
    let all = numbers.iter().sum::<usize>();
    let sentence =
        format!("The text has {all} rows: {t} tables, {f} figures, {g} groups of formulas and {p} proposals.");
    assert!(page.contains(&sentence), "{sentence}");

    let made: BTreeSet<String> = items().into_iter().map(|item| item.name).collect();
    let plans: BTreeSet<&str> = hoid_thesis::plans::TEXT_PLANS.iter().map(|plan| plan.name).collect();
    let mut named: BTreeSet<String> = tables
        .iter()
        .chain(&figures)
        .flat_map(|row| quoted_names(row[1]))
        .collect();
    for name in &named {
        assert!(made.contains(name), "{name} is named and not made");
    }
    for name in formulas.iter().chain(&proposals).flat_map(|row| quoted_names(row[2])) {
        if name.starts_with("hoid-") {
            assert!(root.join("crates").join(&name).is_file(), "{name} is not a file");
        } else if made.contains(&name) || plans.contains(name.as_str()) {
            named.insert(name);
        } else {
            // The listed options and methods exist in the program.
            let options = include_str!("../../../docs/src/reference/command-line.md");
            assert!(name == CLAIMS_NAME || options.contains(&name), "{name} is nothing");
        }
    }
    let own = "lead-change".to_owned();
    let missing: Vec<&String> = made
        .iter()
        .filter(|name| !named.contains(*name) && **name != own)
        .collect();
    assert!(missing.is_empty(), "made and not on the page: {missing:?}");
}
