//! Columns of a parameter in the table `people`: its value, its standard errors for these runs (`_se`) and for the
//! person (`_se_person`), its 95 % interval (`_low`, `_high`), the share of the prior (`_prior_share`), and whether the
//! data determine it (`_determined`). The name of a parameter of the response to a further input is preceded by the
//! name of the input, such as `r_tau_f`.

use hoid_ident::family::Parameter;
use hoid_io::OutputTable;

use super::tables::{numbers, texts};
use crate::columns::Rows;

/// Suffixes of the numeric columns of a parameter.
const NUMERIC_SUFFIXES: [&str; 6] = ["", "_se", "_se_person", "_low", "_high", "_prior_share"];
/// Suffix of the text column of a parameter.
const DETERMINED_SUFFIX: &str = "_determined";

/// Returns the names of the numeric columns of a parameter.
pub(super) fn numeric_column_names(name: &str) -> impl Iterator<Item = String> {
    NUMERIC_SUFFIXES.into_iter().map(move |end| format!("{name}{end}"))
}

/// Returns the name of the text column of a parameter.
pub(super) fn text_column_name(name: &str) -> String {
    format!("{name}{DETERMINED_SUFFIX}")
}

/// Writes a parameter to its columns in the current row; `name` is the name of the first column.
pub(super) fn write(rows: &mut Rows, name: &str, p: &Parameter) {
    let or_empty = |value: Option<f64>| value.unwrap_or(f64::NAN);
    let (low, high) = p.interval.unwrap_or((f64::NAN, f64::NAN));
    let values = [
        p.value,
        or_empty(p.standard_error),
        or_empty(p.standard_error_person),
        low,
        high,
        p.prior_share,
    ];
    for (end, value) in NUMERIC_SUFFIXES.iter().zip(values) {
        rows.set_real(&format!("{name}{end}"), value);
    }
    rows.set_text(&text_column_name(name), if p.determined { "yes" } else { "no" });
}

/// Reads a parameter from the columns whose names start with `prefix` and its name; `None` if its value is empty.
pub(super) fn read(
    table: &OutputTable,
    row: usize,
    prefix: &str,
    (name, unit): (&str, &'static str),
) -> Option<Parameter> {
    let column = format!("{prefix}{name}");
    let any = |end: &str| {
        let values = numbers(table, &format!("{column}{end}"));
        values.get(row).copied().filter(|v| !v.is_nan())
    };
    Some(Parameter {
        name: name.to_owned(),
        unit,
        value: any("")?,
        standard_error: any("_se"),
        standard_error_person: any("_se_person"),
        interval: any("_low").zip(any("_high")),
        prior_share: any("_prior_share").unwrap_or(0.0),
        determined: texts(table, &text_column_name(&column))
            .get(row)
            .is_some_and(|text| text == "yes"),
        averaged_over: Vec::new(),
    })
}
