//! Columns of a parameter in the table `people`: its value, standard error of these runs (`_se`) and of the person
//! (`_se_person`), 95 % interval (`_low`, `_high`), share of the prior (`_prior_share`), and whether the data determine
//! it (`_determined`). Parameters of the response to a further input have the name of the input in front, `r_tau_f`.

use hoid_ident::family::Parameter;
use hoid_io::OutputTable;

use super::tables::{numbers, texts};
use crate::columns::Rows;

/// Ends of the names of its columns of numbers.
const REAL: [&str; 6] = ["", "_se", "_se_person", "_low", "_high", "_prior_share"];
/// End of the name of its column of texts.
const DETERMINED: &str = "_determined";

/// Names of the columns of numbers of a parameter.
pub(super) fn real_names(name: &str) -> impl Iterator<Item = String> {
    REAL.into_iter().map(move |end| format!("{name}{end}"))
}

/// Name of the column of texts of a parameter.
pub(super) fn text_name(name: &str) -> String {
    format!("{name}{DETERMINED}")
}

/// Writes a parameter to the current row, under this name.
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
    for (end, value) in REAL.iter().zip(values) {
        rows.real(&format!("{name}{end}"), value);
    }
    rows.text(&text_name(name), if p.determined { "yes" } else { "no" });
}

/// Reads a parameter from the columns `prefix` + name; `None` if its cell is empty.
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
        determined: texts(table, &text_name(&column))
            .get(row)
            .is_some_and(|text| text == "yes"),
        averaged_over: Vec::new(),
    })
}
