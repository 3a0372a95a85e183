//! `hoid design`: the most informative forcing function for an operator, and the expected errors.

use std::path::Path;

use hoid::design::experiment::{
    DesignOptions, DesignRequest, DifferencePlan, DifferenceRequest, EntryPoint, Expected, ExpectedQuantity,
    ExperimentDesign, Remnant, SpreadSource,
};
use hoid::model::numbers::{DASH, count_with_noun};
use hoid::report::{PaperTable, design_figure, runs_figure};
use serde_json::Value;

use super::{figure, output_paths, paper_table};
use crate::{args::DesignArgs, error::CliError, json, output, table::Rows, text};

/// Tables with the estimates that `--out` writes, in addition to the scenario.
const TABLE_FILES: [&str; 2] = ["design.csv", "design.md"];
const SCENARIO_FILE: &str = "scenario.toml";

pub fn run(args: &DesignArgs) -> Result<(), CliError> {
    if let Some(figure) = &args.picture.figure {
        figure::check(figure)?;
    }
    paper_table::check(&args.show)?;
    let spreads = [&args.between_people, &args.run_to_run].into_iter().flatten();
    let spreads = spreads.filter_map(|spread| match spread {
        SpreadSource::File(path) => Some(path.as_path()),
        SpreadSource::Part(_) => None,
    });
    let inputs: Vec<&Path> = args.people.path().into_iter().chain(spreads).collect();
    let files = [args.picture.figure.as_deref(), args.show.table.as_deref()];
    output_paths::check(&inputs, &files, &[])?;
    if let Some(out) = &args.out {
        hoid::io::check_output_directory(out, &inputs)?;
    }
    let found = request(args).run()?;
    if let Some(path) = &args.picture.figure {
        figure::write(path, &design_figure(&found), args.picture.width)?;
    }
    if let Some(out) = &args.out {
        write_all(&found, out)?;
    }
    paper_table::write(&args.show, || Ok(found.json()))?;
    if args.show.json {
        json::print(&Value::Object(found.json()))
    } else {
        output::show(&page(&found, args.show.verbose))
    }
}

fn request(args: &DesignArgs) -> DesignRequest {
    DesignRequest {
        people: args.people.clone(),
        condition: args.condition.clone(),
        controlled_element: args.controlled_element.clone(),
        form: args.form,
        enters: if args.disturbance {
            EntryPoint::Disturbance
        } else {
            EntryPoint::Target
        },
        remnant: Remnant {
            share: args.remnant_share,
            time_constant_s: args.remnant_time_constant,
            ..Remnant::default()
        },
        designing: DesignOptions {
            requested_quantities: args.wanted.clone(),
            period_s: args.length,
            lines: args.lines,
            spacing: args.spacing,
            band_rad_s: args.band,
            shelf: args.shelf,
            max_rms: [args.max_rms_e, args.max_u],
            seed: args.seed,
            ..DesignOptions::default()
        },
        run_to_run: args.run_to_run.clone(),
        runs: args.runs.map(|runs| runs as usize),
        against: args.against.clone(),
        display: args.display,
        difference: args.difference.clone().map(|sought| DifferenceRequest {
            sought,
            power: args.power,
            alpha: args.alpha,
            between_people: args.between_people.clone(),
        }),
    }
}

fn write_all(found: &ExperimentDesign, out: &Path) -> Result<(), CliError> {
    hoid::io::make_directory(out)?;
    let write =
        |name: &str, text: &str| hoid::io::write_atomically(&out.join(name), |file| file.write_all(text.as_bytes()));
    write("design.json", &format!("{}\n", found.to_json()))?;
    write(SCENARIO_FILE, &found.scenario())?;
    match found.lab_config(SCENARIO_FILE) {
        Some(lab) => write("lab.toml", &lab)?,
        None => output::add_notice(
            "",
            "lab.toml was not written: a run in the lab must last a multiple of 0.01 s; change --length".to_owned(),
        ),
    }
    write("forcing.csv", &found.forcing_csv())?;
    write("design.svg", &design_figure(found))?;
    write("runs.svg", &runs_figure(found))?;
    if let Some(plan) = &found.difference {
        write("power.csv", &plan.csv())?;
    }
    if let Some(table) = PaperTable::of(&found.json()) {
        for name in TABLE_FILES {
            table.write(&out.join(name))?;
        }
    }
    output::add_notice("", format!("design: {}", out.display()));
    Ok(())
}

fn page(found: &ExperimentDesign, verbose: bool) -> String {
    let counted = count_with_noun(found.runs, "run");
    let mut page = format!(
        "Expected errors of {counted} of {} s, {} ({})\n{}\n{}",
        found.length_s,
        found.person,
        found.task.state.operator.form(),
        error_table(found),
        signal_sizes(found)
    );
    page.push_str(&required_runs(found));
    if let Some(plan) = &found.difference {
        page.push_str(&difference_text(plan));
    }
    if let Some(seen) = &found.task.feedforward {
        page.push_str(&format!(
            "The parameters ..._f describe the response to the target ({}, preview {} s); target and disturbance have \
             separate lines.\n",
            seen.operator.form(),
            seen.preview_s
        ));
    }
    page.push_str(&format!(
        "\nThe forcing function, crest factor {:.2}\n{}\n\
         The error of the runs follows from the information in these lines. The error for the person also includes a \
         run-to-run variation of {} % ({}).\n",
        found.crest_factor,
        line_table(found),
        text::format_significant(100.0 * found.run_to_run),
        found.run_to_run_source,
    ));
    for reason in found.verdict.reasons().chain(found.verdict.notes()) {
        page.push_str(&format!("- {reason}\n"));
    }
    if verbose {
        page.push_str(&text::settings(&found.settings));
    }
    page
}

fn error_table(found: &ExperimentDesign) -> Rows {
    let others = [
        found.worst.as_ref().map(|w| (format!("of {}", w.name), &w.expected)),
        found
            .against
            .as_ref()
            .map(|o| (format!("with {}", o.name), &o.expected)),
    ];
    let others: Vec<(String, &Expected)> = others.into_iter().flatten().collect();
    let mut header = vec!["", "value", "error of the runs", "for the person", "relative"];
    header.extend(others.iter().map(|(name, _)| name.as_str()));
    let mut rows = text::table(&header);
    for q in &found.expected.quantities {
        let error = |error: Option<f64>| error.map_or_else(String::new, text::format_significant);
        let mut cells = vec![
            label(q),
            text::format_significant(q.estimate.value),
            error(q.estimate.standard_error),
            error(q.standard_error_person),
            format_relative_error(q.standard_error_person.unwrap_or(f64::NAN) / q.estimate.value.abs()),
        ];
        cells.extend(others.iter().map(|(_, e)| {
            let other = e.estimate(q.name).and_then(|e| e.standard_error);
            error(other)
        }));
        rows.add_row(cells);
    }
    rows
}

fn label(q: &ExpectedQuantity) -> String {
    let name = match q.name {
        "phase_margin" => "phase margin",
        name => name,
    };
    match q.unit {
        "" => name.to_owned(),
        unit => format!("{name} ({unit})"),
    }
}

fn format_relative_error(error: f64) -> String {
    if error.is_finite() {
        format!("{:.1} %", 100.0 * error)
    } else {
        DASH.to_owned()
    }
}

fn signal_sizes(found: &ExperimentDesign) -> String {
    let of = |e: &Expected| (text::format_significant(e.rms_e), text::format_significant(e.rms_u));
    let (e, u) = of(&found.expected);
    let other = found.against.as_ref().map_or_else(String::new, |o| {
        let (e, u) = of(&o.expected);
        format!(" (with {}: {e}, {u})", o.name)
    });
    format!("Expected rms: e {e}, u {u}{other}.\n")
}

/// Returns a sentence with the number of runs needed to reach the accepted errors of the requested quantities.
fn required_runs(found: &ExperimentDesign) -> String {
    if found.wanted.is_empty() {
        return String::new();
    }
    let mut needed = format!(
        "The requested errors require {}.\n",
        count_with_noun(found.runs_needed, "run")
    );
    if let Some(worst) = &found.worst {
        let runs = count_with_noun(worst.runs_needed, "run");
        needed.push_str(&format!("For {} they require {runs}.\n", worst.name));
    }
    if let Some(other) = &found.against {
        let runs = count_with_noun(other.runs_needed, "run");
        needed.push_str(&format!("With {} they require {runs}.\n", other.name));
    }
    needed
}

/// Formats the number of people and runs needed to detect a difference, and the table of the power of the test.
fn difference_text(plan: &DifferencePlan) -> String {
    let sought = &plan.request.sought.name;
    let unit = match sought.as_str() {
        "crossover" => " rad/s",
        "phase_margin" => " deg",
        _ => "",
    };
    let size = format!("{sought} of {}{unit}", text::format_significant(plan.size));
    let answer = match plan.recommended_row() {
        Some(row) => {
            let runs = count_with_noun(row.runs, "run");
            match row.people {
                Some(people) => format!("{people} people, each with {runs} per condition"),
                None => format!("more than 1000 people, each with {runs} per condition"),
            }
        }
        None => String::new(),
    };
    let people: Vec<String> = plan.people.iter().map(|n| format!("n = {n}")).collect();
    let mut header = vec!["runs", "needed"];
    header.extend(people.iter().map(String::as_str));
    let mut rows = text::table(&header);
    for row in &plan.rows {
        let needed = row.people.map_or_else(|| "> 1000".to_owned(), |n| n.to_string());
        let mut cells = vec![row.runs.to_string(), needed];
        cells.extend(row.power.iter().map(|p| format!("{p:.2}")));
        rows.add_row(cells);
    }
    format!(
        "\nDetecting a difference in {size} between two conditions requires {answer} (power {}, alpha {}).\n{rows}\n\
         Power of a paired t test with n people. Standard deviations of a person's difference: {} between people ({}), \
         {} from run to run, {} from the expected error of a run.\n",
        plan.request.power,
        plan.request.alpha,
        text::format_significant(plan.between_people),
        plan.between_source,
        text::format_significant(plan.run_to_run),
        text::format_significant(plan.error_of_run),
    )
}

fn line_table(found: &ExperimentDesign) -> Rows {
    let mut lines = text::table(&["line (rad/s)", "periods per run", "amplitude", "phase (rad)", "enters"]);
    for designed in &found.lines {
        let line = designed.line;
        lines.add_row([
            format!("{:.4}", line.omega_rad_s),
            format!("{:.0}", line.omega_rad_s * found.length_s / std::f64::consts::TAU),
            text::format_significant(line.amplitude_deg),
            format!("{:.3}", line.phase_rad),
            designed.enters.name().to_owned(),
        ]);
    }
    lines
}
