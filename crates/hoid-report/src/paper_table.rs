//! A result as a table for a paper: estimates with errors and intervals, in LaTeX (`.tex`, booktabs), Markdown (`.md`),
//! or as data (CSV and other table formats).
//!
//! The table is made from the JSON object of the result ([`hoid_analysis::json`]), so both agree. In LaTeX and Markdown
//! a value is rounded to the second significant digit of its error. In data files every number has all digits, and the
//! error is in the column after the value.

use std::path::Path;

use hoid_io::{ColumnValues, IoError, OutputColumn, OutputTable, check_table_path, write_atomically, write_table};
use hoid_model::numbers::{DASH, Z_95, format_plain, with_uncertainty};
use serde_json::{Map, Value};

/// A result as a table.
#[derive(Debug, Clone, PartialEq)]
pub struct PaperTable {
    /// Comments, one per line.
    comments: Vec<String>,
    columns: Vec<Column>,
}

#[derive(Debug, Clone, PartialEq)]
struct Column {
    name: String,
    cells: Cells,
}

#[derive(Debug, Clone, PartialEq)]
enum Cells {
    Text(Vec<String>),
    Number(Vec<f64>),
    /// Values with their standard errors; in data files the errors are in a separate column with this name.
    Estimate(Vec<[f64; 2]>, String),
    /// Ends of intervals with the standard errors that determine their digits.
    End(Vec<[f64; 2]>),
}

/// An estimate in the JSON object.
struct Row {
    quantity: String,
    value: f64,
    error: f64,
    interval: [f64; 2],
    unit: String,
    verdict: String,
}

impl PaperTable {
    /// Creates the table of a result from its JSON object; `None` if the object contains no estimate.
    pub fn of(object: &Map<String, Value>) -> Option<Self> {
        let text = |key: &str| object.get(key).and_then(Value::as_str).unwrap_or_default();
        let level = object.get("verdict").and_then(|verdict| verdict["level"].as_str());
        let comments = vec![format!(
            "hoid {}: {}, {}",
            text("hoid"),
            [text("kind"), text("group")].join(" ").trim(),
            level.unwrap_or_default()
        )];
        let columns = match (object.get("people"), object.get("lines")) {
            // The `people` of a design are listed in addition to the typical person, whom the table represents.
            _ if text("kind") == "design" => estimate_columns(object),
            _ if text("kind") == "comparison" => difference_columns(object.get("differences")?.as_array()?),
            (Some(people), _) => people_columns(people.as_array()?),
            (None, Some(lines)) if text("kind") == "description" => line_columns(lines.as_array()?),
            _ => estimate_columns(object),
        };
        let filled = columns.first().is_some_and(|column| column.cells.len() > 0);
        filled.then_some(Self { comments, columns })
    }

    /// Checks that the format given by the extension of a file name is known.
    ///
    /// # Errors
    /// [`IoError::UnknownFormat`] for any other extension.
    pub fn check_format(path: &Path) -> Result<(), IoError> {
        match Markup::of(path) {
            Some(_) => Ok(()),
            None => check_table_path(path),
        }
    }

    /// Writes the table atomically, in the format given by the extension.
    ///
    /// # Errors
    /// The errors of [`PaperTable::check_format`], and [`IoError`] if the file cannot be written.
    pub fn write(&self, path: &Path) -> Result<(), IoError> {
        match Markup::of(path) {
            Some(markup) => {
                let text = self.text(markup);
                write_atomically(path, |file| file.write_all(text.as_bytes()))
            }
            None => write_table(path, &self.data()),
        }
    }

    fn data(&self) -> OutputTable {
        let mut columns = Vec::new();
        for Column { name, cells } in &self.columns {
            let mut add = |name: &str, values| {
                columns.push(OutputColumn {
                    name: name.to_owned(),
                    values,
                });
            };
            let first = |pairs: &[[f64; 2]], index: usize| pairs.iter().map(|pair| pair[index]).collect();
            match cells {
                Cells::Text(all) => add(name, ColumnValues::Text(all.clone())),
                Cells::Number(all) => add(name, ColumnValues::Real(all.clone())),
                Cells::End(all) => add(name, ColumnValues::Real(first(all, 0))),
                Cells::Estimate(all, of_error) => {
                    add(name, ColumnValues::Real(first(all, 0)));
                    add(of_error, ColumnValues::Real(first(all, 1)));
                }
            }
        }
        OutputTable {
            comments: self.comments.clone(),
            columns,
        }
    }

    fn text(&self, markup: Markup) -> String {
        let shown: Vec<&Column> = self
            .columns
            .iter()
            .filter(|column| column.cells.has_content())
            .collect();
        let rows = self.columns.first().map_or(0, |column| column.cells.len());
        let headings = shown.iter().map(|column| markup.name(&column.name)).collect();
        let body = (0..rows).map(|row| shown.iter().map(|column| column.cells.cell(row, markup)).collect());
        let right: Vec<bool> = shown
            .iter()
            .map(|column| !matches!(column.cells, Cells::Text(_)))
            .collect();
        markup.table(&self.comments, &right, headings, body.collect())
    }
}

impl Cells {
    fn len(&self) -> usize {
        match self {
            Self::Text(all) => all.len(),
            Self::Number(all) => all.len(),
            Self::Estimate(all, _) | Self::End(all) => all.len(),
        }
    }

    /// True unless all cells are empty; LaTeX and Markdown tables omit an empty column.
    fn has_content(&self) -> bool {
        match self {
            Self::Text(all) => all.iter().any(|text| !text.is_empty()),
            Self::Number(all) => all.iter().any(|v| v.is_finite()),
            Self::Estimate(all, _) | Self::End(all) => all.iter().any(|pair| pair[0].is_finite()),
        }
    }

    fn cell(&self, row: usize, markup: Markup) -> String {
        match self {
            Self::Text(all) => markup.name(&all[row]),
            Self::Number(all) => markup.number(&format_plain(all[row]), DASH),
            Self::End(all) => markup.number(&with_uncertainty(all[row][0], Some(all[row][1])).0, DASH),
            Self::Estimate(all, _) => {
                let (value, error) = with_uncertainty(all[row][0], Some(all[row][1]));
                markup.number(&value, &error)
            }
        }
    }
}

fn column(name: &str, cells: Cells) -> Column {
    Column {
        name: name.to_owned(),
        cells,
    }
}

/// A number of the JSON object; NaN for null.
fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or(f64::NAN)
}

/// Columns for the parameters, including those of the operator, and the quantities of the loop.
fn estimate_columns(object: &Map<String, Value>) -> Vec<Column> {
    let none = Value::Null;
    let at = |object: &Map<String, Value>, key: &str| object.get(key).cloned().unwrap_or_default();
    let verdict = &object.get("verdict").unwrap_or(&none)["of"];
    // A trace is represented by its last row.
    let last = object
        .get("kind")
        .filter(|kind| *kind == "trace")
        .and(object.get("last"));
    let of = last.and_then(Value::as_object).unwrap_or(object);
    // An experiment is planned with the errors that include a person's variation from run to run.
    let is_design = object.get("kind").is_some_and(|kind| kind == "design");
    let error = if is_design {
        "standard_error_person"
    } else {
        "standard_error"
    };
    let row = |name: &str, p: &Value| row(name, p, error, verdict);
    let mut rows: Vec<Row> = Vec::new();
    for p in at(of, "parameters").as_array().into_iter().flatten() {
        rows.push(row(p["name"].as_str().unwrap_or_default(), p));
    }
    let known = |rows: &[Row], name: &str| rows.iter().any(|row| row.quantity == name);
    for (name, p) in at(of, "operator").as_object().into_iter().flatten() {
        if p["value"].is_number() && !known(&rows, name) && object.get("form").is_none() {
            rows.push(row(name, p));
        }
    }
    for (name, p) in at(of, "open_loop").as_object().into_iter().flatten() {
        if p["value"].is_number() {
            rows.push(row(name, p));
        }
    }
    let pairs = |of: &dyn Fn(&Row) -> f64| rows.iter().map(|row| [of(row), row.error]).collect();
    let texts = |of: &dyn Fn(&Row) -> &String| Cells::Text(rows.iter().map(|row| of(row).clone()).collect());
    vec![
        column("quantity", texts(&|row| &row.quantity)),
        column("value", Cells::Estimate(pairs(&|row| row.value), error.to_owned())),
        column("low", Cells::End(pairs(&|row| row.interval[0]))),
        column("high", Cells::End(pairs(&|row| row.interval[1]))),
        column("unit", texts(&|row| &row.unit)),
        column("verdict", texts(&|row| &row.verdict)),
    ]
}

fn row(name: &str, p: &Value, error: &str, verdict: &Value) -> Row {
    let (value, error) = (number(&p["value"]), number(&p[error]));
    let interval = match p["interval"].as_array().map(Vec::as_slice) {
        Some([low, high]) => [number(low), number(high)],
        _ => [value - Z_95 * error, value + Z_95 * error],
    };
    let (quantity, of_name) = match name {
        "crossover_rad_s" => ("crossover", "rad/s"),
        "phase_crossover_rad_s" => ("phase_crossover", "rad/s"),
        "phase_margin_deg" => ("phase_margin", "deg"),
        "smallest_phase_margin_deg" => ("smallest_phase_margin", "deg"),
        "gain_margin_db" => ("gain_margin", "dB"),
        "T_L" | "tau_e" | "T_I" => (name, "s"),
        "omega_nm" => (name, "rad/s"),
        other => (other, ""),
    };
    let is_open = p["determined"] == false;
    Row {
        quantity: quantity.to_owned(),
        value,
        error,
        interval,
        unit: p["unit"].as_str().unwrap_or(of_name).to_owned(),
        verdict: match verdict[quantity]["level"].as_str() {
            _ if is_open => "not determined".to_owned(),
            level => level.unwrap_or_default().replace('-', " "),
        },
    }
}

/// Columns for the lines of a describing function.
fn line_columns(lines: &[Value]) -> Vec<Column> {
    let all = |key: &str| lines.iter().map(|line| number(&line[key])).collect::<Vec<f64>>();
    let both = |value: &str, error: &str| {
        let pairs = all(value).into_iter().zip(all(error)).map(|(v, e)| [v, e]);
        Cells::Estimate(pairs.collect(), error.to_owned())
    };
    vec![
        column("omega_rad_s", Cells::Number(all("omega_rad_s"))),
        column("gain_db", both("gain_db", "gain_se_db")),
        column("phase_deg", both("phase_deg", "phase_se_deg")),
        column("coherence", Cells::Number(all("coherence"))),
    ]
}

/// Columns for the people of a group, one person per row.
fn people_columns(people: &[Value]) -> Vec<Column> {
    let text =
        |of: &dyn Fn(&Value) -> Option<String>| Cells::Text(people.iter().map(|p| of(p).unwrap_or_default()).collect());
    let key = |name: &'static str| move |p: &Value| p[name].as_str().map(str::to_owned);
    let mut columns: Vec<Column> = ["subject", "condition", "run", "form"]
        .into_iter()
        .map(|name| column(name, text(&key(name))))
        .collect();
    let mut estimate = |name: &str, of: &dyn Fn(&Value) -> Value| {
        let pairs = people.iter().map(|p| {
            let found = of(p);
            [number(&found["value"]), number(&found["standard_error"])]
        });
        columns.push(column(name, Cells::Estimate(pairs.collect(), format!("{name}_se"))));
    };
    let mut names: Vec<&String> = Vec::new();
    for name in people
        .iter()
        .filter_map(|p| p["parameters"].as_object())
        .flat_map(Map::keys)
    {
        if !names.contains(&name) {
            names.push(name);
        }
    }
    for name in names {
        estimate(name, &|p| match &p["parameters"][name] {
            open if open["determined"] == false => Value::Null,
            found => found.clone(),
        });
    }
    for name in ["crossover_rad_s", "phase_margin_deg"] {
        estimate(name, &|p| p["open_loop"][name].clone());
    }
    let level = |p: &Value| {
        p["verdict"]["level"]
            .as_str()
            .or(p["status"].as_str())
            .map(|level| level.replace('-', " "))
    };
    columns.push(column("verdict", text(&level)));
    columns
}

/// Columns for the differences of a comparison, one difference per row.
fn difference_columns(all: &[Value]) -> Vec<Column> {
    let text = |of: &dyn Fn(&Value) -> String| Cells::Text(all.iter().map(of).collect());
    let word = |d: &Value, key: &str| d[key].as_str().unwrap_or_default().to_owned();
    let ends = |index: usize| {
        Cells::End(
            all.iter()
                .map(|d| [number(&d["interval"][index]), number(&d["standard_error"])])
                .collect(),
        )
    };
    let numbers = |of: &dyn Fn(&Value) -> f64| Cells::Number(all.iter().map(of).collect());
    let values = all.iter().map(|d| [number(&d["value"]), number(&d["standard_error"])]);
    let people = |d: &Value| d["people"].as_array().map_or(0, Vec::len) as f64;
    vec![
        column("quantity", text(&|d| word(d, "quantity"))),
        column("unit", text(&|d| word(d, "unit"))),
        column("factor", text(&|d| word(d, "factor"))),
        column("levels", text(&|d| format!("{} - {}", word(d, "to"), word(d, "from")))),
        column(
            "difference",
            Cells::Estimate(values.collect(), "standard_error".to_owned()),
        ),
        column("low", ends(0)),
        column("high", ends(1)),
        column("n", numbers(&people)),
        column("df", numbers(&|d| number(&d["degrees_of_freedom"]))),
        column("t", numbers(&|d| number(&d["t"]))),
        column("p", numbers(&|d| number(&d["p"]))),
        column("p_adjusted", numbers(&|d| number(&d["p_adjusted"]))),
        column("bayes_factor", numbers(&|d| number(&d["bayes_factor"]))),
        column("effect", text(&|d| word(&d["effect_size"], "name"))),
        column("size", numbers(&|d| number(&d["effect_size"]["value"]))),
    ]
}

/// Markup language of a table.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Markup {
    Latex,
    Markdown,
}

impl Markup {
    fn of(path: &Path) -> Option<Self> {
        let extension = path.extension()?.to_str()?.to_ascii_lowercase();
        match extension.as_str() {
            "tex" => Some(Self::Latex),
            "md" => Some(Self::Markdown),
            _ => None,
        }
    }

    /// Returns a name or a word in this markup; a parameter becomes its symbol.
    fn name(self, text: &str) -> String {
        let text = match text {
            "low" => "95 % from",
            "high" => "to",
            other => other,
        };
        if self == Self::Markdown {
            return text.replace('|', "\\|");
        }
        let symbol = match text {
            "omega_rad_s" => "$\\omega$ (rad/s)",
            "omega_nm" => "$\\omega_\\mathrm{nm}$",
            "zeta_nm" => "$\\zeta_\\mathrm{nm}$",
            "tau_e" => "$\\tau_\\mathrm{e}$",
            "K_e_dot" => "$K_{\\dot e}$",
            "K_over_T_I" => "$K/T_\\mathrm{I}$",
            "K_e" => "$K_\\mathrm{e}$",
            "T_L" => "$T_\\mathrm{L}$",
            "T_I" => "$T_\\mathrm{I}$",
            "crossover" => "$\\omega_\\mathrm{c}$",
            "crossover_rad_s" => "$\\omega_\\mathrm{c}$ (rad/s)",
            "phase_margin" => "$\\varphi_\\mathrm{m}$",
            "phase_margin_deg" => "$\\varphi_\\mathrm{m}$ (deg)",
            "gain_db" => "gain (dB)",
            "phase_deg" => "phase (deg)",
            _ => return text.chars().fold(String::new(), |all, c| all + &escape_latex(c)),
        };
        symbol.to_owned()
    }

    fn number(self, value: &str, error: &str) -> String {
        match (self, error) {
            (_, _) if value == DASH => DASH.to_owned(),
            (Self::Markdown, DASH) => value.to_owned(),
            (Self::Markdown, _) => format!("{value} ± {error}"),
            (Self::Latex, DASH) => format!("${}$", latex_power(value)),
            (Self::Latex, _) => format!("${} \\pm {}$", latex_power(value), latex_power(error)),
        }
    }

    fn table(self, comments: &[String], right: &[bool], headings: Vec<String>, rows: Vec<Vec<String>>) -> String {
        let mut text = String::new();
        match self {
            Self::Latex => {
                for comment in comments {
                    text.push_str(&format!("% {comment}; needs \\usepackage{{booktabs}}\n"));
                }
                let places: String = right.iter().map(|right| if *right { 'r' } else { 'l' }).collect();
                text.push_str(&format!("\\begin{{tabular}}{{{places}}}\n\\toprule\n"));
                text.push_str(&format!("{} \\\\\n\\midrule\n", headings.join(" & ")));
                for row in rows {
                    text.push_str(&format!("{} \\\\\n", row.join(" & ").replace(DASH, "--")));
                }
                text.push_str("\\bottomrule\n\\end{tabular}\n");
            }
            Self::Markdown => {
                for comment in comments {
                    text.push_str(&format!("<!-- {comment} -->\n"));
                }
                let rule: Vec<&str> = right.iter().map(|right| if *right { "---:" } else { "---" }).collect();
                text.push_str(&format!("| {} |\n| {} |\n", headings.join(" | "), rule.join(" | ")));
                for row in rows {
                    text.push_str(&format!("| {} |\n", row.join(" | ")));
                }
            }
        }
        text
    }
}

/// Escapes a special character of LaTeX.
fn escape_latex(c: char) -> String {
    match c {
        '\\' => "\\textbackslash{}".to_owned(),
        '~' => "\\textasciitilde{}".to_owned(),
        '^' => "\\textasciicircum{}".to_owned(),
        '&' | '%' | '$' | '#' | '_' | '{' | '}' => format!("\\{c}"),
        other => other.to_string(),
    }
}

/// Formats `1.2e-7` as a power of ten.
fn latex_power(number: &str) -> String {
    match number.split_once('e') {
        Some((mantissa, exponent)) => format!("{mantissa} \\times 10^{{{exponent}}}"),
        None => number.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use serde_json::json;

    use super::*;

    fn table(object: Value) -> PaperTable {
        PaperTable::of(object.as_object().unwrap()).unwrap()
    }

    fn operator() -> PaperTable {
        table(json!({
            "hoid": "0.1", "kind": "operator", "form": "lead",
            "verdict": {"level": "trustworthy", "of": {"K_e": {"level": "trustworthy"}, "crossover": {"level": "doubtful"}}},
            "parameters": [
                {"name": "K_e", "unit": "V/deg", "value": 0.0897, "standard_error": 0.002, "interval": [0.0851, 0.0943]},
                {"name": "tau_e", "unit": "s", "value": 0.28, "standard_error": null, "determined": false},
            ],
            "operator": {"K_e": {"value": 0.0897, "standard_error": 0.002}},
            "open_loop": {"crossover_rad_s": {"value": 1.58, "standard_error": 0.034}, "stable": true},
        }))
    }

    #[test]
    fn tables_in_latex_and_markdown_match() {
        let latex = operator().text(Markup::Latex);
        assert_eq!(
            latex,
            "% hoid 0.1: operator, trustworthy; needs \\usepackage{booktabs}\n\\begin{tabular}{lrrrll}\n\\toprule\n\
             quantity & value & 95 \\% from & to & unit & verdict \\\\\n\\midrule\n\
             $K_\\mathrm{e}$ & $0.0897 \\pm 0.0020$ & $0.0851$ & $0.0943$ & V/deg & trustworthy \\\\\n\
             $\\tau_\\mathrm{e}$ & $0.28$ & -- & -- & s & not determined \\\\\n\
             $\\omega_\\mathrm{c}$ & $1.580 \\pm 0.034$ & $1.513$ & $1.647$ & rad/s & doubtful \\\\\n\
             \\bottomrule\n\\end{tabular}\n"
        );
        let markdown = operator().text(Markup::Markdown);
        assert!(
            markdown.contains("| K_e | 0.0897 ± 0.0020 | 0.0851 | 0.0943 | V/deg | trustworthy |"),
            "{markdown}"
        );
    }

    #[test]
    fn data_table_has_one_number_per_column() {
        let data = operator().data();
        let names: Vec<&str> = data.columns.iter().map(|column| column.name.as_str()).collect();
        assert_eq!(
            names,
            ["quantity", "value", "standard_error", "low", "high", "unit", "verdict"]
        );
        let Some(ColumnValues::Real(low)) = data.column("low") else {
            panic!("no numbers")
        };
        assert!((low[2] - (1.58 - Z_95 * 0.034)).abs() < 1e-12 && low[1].is_nan());
    }

    #[test]
    fn people_are_columns_and_undetermined_values_omitted() {
        let person = |subject: &str, lead: bool| {
            let mut p = json!({
                "subject": subject, "condition": "C_1", "form": "lead", "verdict": {"level": "not-determined"},
                "parameters": {"K_e": {"value": 1.0, "standard_error": 0.1, "determined": lead}},
                "open_loop": {"crossover_rad_s": {"value": 3.0, "standard_error": 0.25}},
            });
            if lead {
                p["parameters"]["T_L"] = json!({"value": 0.4, "standard_error": 0.02, "determined": true});
            }
            p
        };
        let group = table(json!({"hoid": "0.1", "group": "a", "people": [person("P1", false), person("P2", true)]}));
        let latex = group.text(Markup::Latex);
        assert!(
            latex.contains("P1 & C\\_1 & lead & -- & -- & $3.00 \\pm 0.25$ & not determined"),
            "{latex}"
        );
        assert!(
            latex.contains("P2 & C\\_1 & lead & $1.00 \\pm 0.10$ & $0.400 \\pm 0.020$ &"),
            "{latex}"
        );
        assert!(PaperTable::of(json!({"kind": "operator"}).as_object().unwrap()).is_none());
    }
}
