//! Output for a finished group, as a page of text and as a JSON object.

use hoid::ident::family::Parameter;
use hoid::model::{Form, numbers::count_with_noun};
use hoid::report::{PeopleTable, people_table};
use hoid::study::group::{GroupSummary, Manifest, Person, PersonChannel, RunEntry, RunFailure, RunFault};
use serde_json::{Map, Value, json};

use crate::{json, text};

/// A finished group with the files written for it.
pub struct GroupReport<'a> {
    pub manifest: &'a Manifest,
    pub summary: &'a GroupSummary,
    pub tables: Vec<String>,
    pub pages: Vec<String>,
}

impl GroupReport<'_> {
    /// Returns the page: failures and doubtful results, followed by the people.
    pub fn page(&self, verbose: bool) -> String {
        let GroupSummary {
            runs,
            failures,
            people,
            verdict,
            ..
        } = self.summary;
        let read = match failures.len() {
            0 => "all read".to_owned(),
            n => format!("{n} not read"),
        };
        let mut page = format!("{verdict}\n\n{}: {runs} runs, {read}\n", self.manifest.name);
        let table = people_table(people.iter());
        if !table.rows.is_empty() {
            let last = table.headings.len() - 1;
            let in_loop: Vec<usize> = (0..table.parameters).chain([last]).collect();
            let parameters: Vec<usize> = [0, 1].into_iter().chain(table.parameters..last).collect();
            page.push_str(&format!(
                "\nOperators, each from all runs of a person in a condition\n{}\n{}\n\
                 Value \u{b1} standard error from the scatter between runs. Values that the data do not determine are \
                 in parentheses or are given as bounds (> is a 95 % limit). In brackets: Student's 95 % intervals.\n",
                format_columns(&table, &in_loop),
                format_columns(&table, &parameters),
            ));
        }
        if verbose {
            page.push_str("\nFiles:\n");
            for file in self.pages.iter().chain(&self.tables) {
                page.push_str(&format!("  {file}\n"));
            }
        } else if let Some(first) = self.pages.first() {
            page.push_str(&format!(
                "Report: {first}; {} and {} in the same directory, listed with -v.\n",
                count_with_noun(self.pages.len() - 1, "page"),
                count_with_noun(self.tables.len(), "table")
            ));
        }
        page
    }

    pub fn json(&self) -> Map<String, Value> {
        let summary = self.summary;
        let failure =
            |f: &RunFailure| json!({"subject": f.subject, "condition": f.condition, "run": f.run, "reason": f.reason});
        let record = |run: &RunEntry| json!({"file": run.file, "subject": run.subject, "condition": run.condition, "run": run.run});
        let records = self.manifest.runs.iter().filter(|run| run.counts).map(record);
        let warning = |fault: &RunFault| json!(format!("{}: {}", fault.file, fault.description));
        let data = json!({
            "faults": summary.faults.iter().map(fault_json).collect::<Vec<_>>(),
            "warnings": summary.faults.iter().map(warning).collect::<Vec<_>>(),
        });
        let settings = self.manifest.settings();
        let mut map = json::envelope_of_parts("group", records.collect(), &data, &summary.verdict, &settings);
        let mut set = |key: &str, value: Value| map.insert(key.to_owned(), value);
        set("group", json!(self.manifest.name));
        set("runs", json!(summary.runs));
        set("failures", summary.failures.iter().map(failure).collect());
        set("people", summary.people.iter().map(person_json).collect());
        set("tables", json!(self.tables));
        set("reports", json!(self.pages));
        map
    }
}

fn fault_json(fault: &RunFault) -> Value {
    json!({
        "record": fault.file,
        "kind": fault.kind,
        "channel": fault.channel,
        "from": json::optional(fault.from_s),
        "size": json::number(fault.size),
        "words": fault.description,
    })
}

/// Formats some columns of the table of people, since all columns would be too wide for a screen.
fn format_columns(table: &PeopleTable, columns: &[usize]) -> String {
    let headings: Vec<&str> = columns.iter().map(|i| table.headings[*i].as_str()).collect();
    let mut rows = text::table(&headings);
    for cells in &table.rows {
        rows.add_row(columns.iter().map(|i| cells[*i].as_str()));
    }
    rows.to_string()
}

fn person_json(p: &Person) -> Value {
    let mut map = Map::new();
    let mut set = |key: &str, value: Value| map.insert(key.to_owned(), value);
    set("subject", json!(p.subject));
    set("condition", json!(p.condition));
    set("run", json!(p.run));
    set("runs", json!(p.runs));
    set("status", json!(p.status.name()));
    if !p.reason.is_empty() {
        set("reason", json!(p.reason));
    }
    let Some(verdict) = &p.verdict else {
        return Value::Object(map);
    };
    set("form", json!(p.form));
    let parameters: Map<String, Value> = p
        .parameters
        .iter()
        .map(|q| (q.name.clone(), parameter_json(q)))
        .collect();
    set("parameters", Value::Object(parameters));
    if !p.channels.is_empty() {
        set("channels", p.channels.iter().map(channel_json).collect());
    }
    if let (Some(crossover), Some(margin)) = (p.crossover_rad_s, p.phase_margin_deg) {
        set(
            "open_loop",
            json!({
                "crossover_rad_s": json::estimate_with_interval(&crossover, p.crossover_interval),
                "phase_margin_deg": json::estimate_with_interval(&margin, p.phase_margin_interval),
            }),
        );
    }
    set("chi2", json::optional(p.chi2.map(|(chi2, _)| chi2)));
    set("dof", json!(p.chi2.map(|(_, dof)| dof)));
    set("kappa", json::optional(p.kappa));
    set("noise_order", json!(p.noise_order));
    set("verdict", json::verdict(verdict));
    Value::Object(map)
}

/// Returns the response to a further input as a JSON object.
fn channel_json(of: &PersonChannel) -> Value {
    let parameters: Map<String, Value> = of
        .parameters
        .iter()
        .map(|q| (q.name.clone(), parameter_json(q)))
        .collect();
    json!({
        "input": of.name,
        "role": of.role.name(),
        "preview": json::number(of.preview_s),
        "form": of.form.map(Form::name),
        "parameters": parameters,
        "p_value": json::number(of.p_value),
    })
}

/// Returns a parameter as a JSON object, in which an unbounded end of the interval is null.
fn parameter_json(p: &Parameter) -> Value {
    json!({
        "value": json::number(p.value),
        "standard_error": json::optional(p.standard_error),
        "unit": p.unit,
        "interval": p.interval.map(|(low, high)| [json::number(low), json::number(high)]),
        "determined": p.determined,
        "prior_share": json::number(p.prior_share),
    })
}
