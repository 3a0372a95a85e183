//! `hoid demo`: the complete analysis of a simulated run of condition C4, in which the controlled
//! element and the operator change at 40.96 s.

use std::path::PathBuf;

use hoid::analysis::relative_errors;
use hoid::ident::{Choice, Estimator, Fit, choose_orders, order_selection};
use hoid::io::{make_directory, write_record};
use hoid::model::{
    GainUnit, Record, Structure,
    scenario::{Condition, Scenario},
    uncertainty::OperatorEstimate,
};
use hoid::report::{BatchLine, ModelSection, Report, TraceSection, TrackReport, known_operator, numbers, write_report};
use hoid::sim::{RunSeed, Simulator};
use hoid::track::{Method, OPERATOR_COLUMNS, StartSource, Trace, TrackOptions, track};

use crate::{args::DemoArgs, commands::output_paths, error::CliError, output, text};

/// Spans of the thesis (V.B) that are entirely before or after the change, s.
const STAGE_SPANS_S: [(&str, f64, f64); 2] = [("before", 0.0, 30.72), ("after", 51.2, 81.92)];

struct Stage {
    name: &'static str,
    record: Record,
    arx: Fit,
    choice: Choice,
}

pub fn run(args: &DemoArgs) -> Result<(), CliError> {
    output_paths::check(&[], &[], &[Some(&args.out)])?;
    let scenario = Scenario::condition(Condition::C4);
    let run_seed = RunSeed {
        seed: args.seed,
        ..RunSeed::default()
    };
    let record = Simulator::new(&scenario)?.run(run_seed, false)?;
    make_directory(&args.out)?;
    let path = args.out.join("c4.csv");
    write_record(&path, &record)?;
    output::show(&format!(
        "Simulated {}: {} samples of {} s; the controlled element changes at 40.96 s and the operator with it.\n\
         Record: {}\n\n",
        scenario.name,
        record.len(),
        record.sample_time().s(),
        path.display()
    ))?;
    let stages = STAGE_SPANS_S
        .into_iter()
        .map(|(name, from, to)| identify(name, record.span(from, to)?))
        .collect::<Result<Vec<Stage>, CliError>>()?;
    output::print(&stage_table(&stages))?;
    let traces = track_stages(&record, &stages)?;
    output::print(&trace_error_table(&record, &traces))?;
    let page = write_stage_report(args, &stages)?;
    let page_of_traces = write_trace_report(args, &record, &stages, &traces)?;
    output::show(&format!(
        "Report: {}\nTracking: {}\n",
        page.display(),
        page_of_traces.display()
    ))?;
    Ok(())
}

/// Computes traces of the whole run with the default method, without prior information, and with the two methods of the
/// thesis, which start from the batch fit before the change.
fn track_stages(record: &Record, stages: &[Stage]) -> Result<Vec<(String, Trace)>, CliError> {
    let (_, from, to) = STAGE_SPANS_S[0];
    let nk = stages[0].choice.fit.orders().nk;
    [Method::adaptive(), Method::rls(), Method::rpem()]
        .into_iter()
        .map(|method| {
            let structure = method.default_structure();
            let (options, note) = if method.is_self_starting() {
                let options = TrackOptions::without_prior(method.clone(), record.sample_time());
                (options, "no prior information".to_owned())
            } else {
                let options = TrackOptions {
                    start: StartSource::Span(Some((from, to))),
                    ..TrackOptions::new(method.clone(), structure, structure.operator_orders(nk))
                };
                (options, structure.label())
            };
            Ok((format!("{}, {note}", method.name()), track(record, &options, 1)?))
        })
        .collect()
}

/// Returns a table of the RMS relative error of each trace, evaluated from the end of the first span on, or from the
/// first update of the estimate if that is later.
fn trace_error_table(record: &Record, traces: &[(String, Trace)]) -> String {
    let mut rows = text::table(&[
        "tracked by",
        "K_e",
        "T_L",
        "K_e_dot",
        "omega_nm",
        "zeta_nm",
        "rows with an operator",
    ]);
    for (name, trace) in traces {
        let operators: Vec<_> = (0..trace.len()).map(|row| trace.operator(row)).collect();
        let from_s = trace.updated_from_s().max(STAGE_SPANS_S[0].2);
        let first = trace.times_s().partition_point(|t| *t < from_s);
        let errors = relative_errors(record, trace, &operators, first, &OPERATOR_COLUMNS);
        let error = |column: &str| errors.iter().find(|(name, _)| *name == column);
        let mut row = vec![name.clone()];
        row.extend(OPERATOR_COLUMNS.map(|c| error(c).map_or("-".to_owned(), |(_, e)| format!("{:.0} %", 100.0 * e))));
        let convert = operators[first..].iter().filter(|o| o.is_ok()).count();
        row.push(format!("{convert} of {}", trace.len() - first));
        rows.add_row(row);
    }
    format!(
        "The whole run, tracked sample by sample: RMS relative error from {} s on\n{rows}\n\n",
        STAGE_SPANS_S[0].2
    )
}

fn write_trace_report(
    args: &DemoArgs,
    record: &Record,
    stages: &[Stage],
    traces: &[(String, Trace)],
) -> Result<PathBuf, CliError> {
    let batch = |name: &str| -> Vec<BatchLine<'_>> {
        stages
            .iter()
            .zip(STAGE_SPANS_S)
            .map(|(stage, (_, from_s, to_s))| BatchLine {
                from_s,
                to_s,
                fit: if name.starts_with(Method::rls().name()) {
                    &stage.arx
                } else {
                    &stage.choice.fit
                },
            })
            .collect()
    };
    let report = TrackReport {
        title: "A person who adapts: condition C4, tracked".to_owned(),
        settings: vec![
            ("seed".to_owned(), args.seed.to_string()),
            (
                "start".to_owned(),
                format!("batch fit of {} to {} s", STAGE_SPANS_S[0].1, STAGE_SPANS_S[0].2),
            ),
            ("hoid".to_owned(), env!("CARGO_PKG_VERSION").to_owned()),
        ],
        record,
        traces: traces
            .iter()
            .map(|(name, trace)| TraceSection {
                name: name.clone(),
                trace,
                batch: batch(name),
            })
            .collect(),
        verdict: None,
        notes: Vec::new(),
    };
    Ok(write_report(&args.out.join("tracking"), &report.to_html()?)?)
}

/// Fits a Box-Jenkins model with nk and nd selected as by default in `hoid identify`, and an ARX model with the same
/// delay.
fn identify(name: &'static str, record: Record) -> Result<Stage, CliError> {
    let structure = Structure::BoxJenkins;
    let ranges = order_selection::default_operator_ranges(structure, record.sample_time());
    let records = [record];
    let template = Estimator::new(structure, structure.operator_orders(1));
    let choice = choose_orders(&template, &ranges, order_selection::Criterion::Bic, &records)?;
    let nk = choice.fit.orders().nk;
    let arx = Estimator::new(Structure::Arx, Structure::Arx.operator_orders(nk)).fit(&records)?;
    let [record] = records;
    Ok(Stage {
        name,
        record,
        arx,
        choice,
    })
}

fn stage_table(stages: &[Stage]) -> String {
    let mut text = String::new();
    for stage in stages {
        let bj = &stage.choice.fit;
        text.push_str(&format!(
            "{} the change, {:.2} to {:.2} s: BJ({}) chosen from {} candidates by BIC\n",
            stage.name,
            stage.record.time_s(0),
            stage.record.time_s(stage.record.len()),
            bj.orders(),
            stage.choice.candidates.len(),
        ));
        let mut rows = text::table(&["operator", "true", "ARX", "Box-Jenkins", "standard error", "unit"]);
        let truth = known_operator(std::slice::from_ref(&stage.record));
        let gain = GainUnit::of(&stage.record);
        let (arx, bj) = (stage.arx.operator(), bj.operator());
        match (&bj, truth) {
            (Ok(bj), Some(t)) => {
                let truth = OperatorEstimate::from(t).rows();
                for (i, (name, unit, e)) in bj.rows().into_iter().enumerate() {
                    let (value, error) = text::with_uncertainty(&e);
                    let by_arx = match &arx {
                        Ok(o) => numbers::format_plain(o.rows()[i].2.value),
                        Err(_) => "not convertible".to_owned(),
                    };
                    let unit = gain.unit(name, unit);
                    rows.add_row([
                        name,
                        &numbers::format_plain(truth[i].2.value),
                        &by_arx,
                        &value,
                        &error,
                        &unit,
                    ]);
                }
                text.push_str(&format!("{rows}\n\n"));
            }
            _ => text.push_str(&text::operator(&bj, &gain)),
        }
    }
    text
}

fn write_stage_report(args: &DemoArgs, stages: &[Stage]) -> Result<PathBuf, CliError> {
    let mut models = Vec::new();
    for stage in stages {
        let records = std::slice::from_ref(&stage.record);
        let truth = known_operator(records);
        for (name, fit, candidates) in [
            ("ARX", &stage.arx, None),
            ("BJ", &stage.choice.fit, Some(&stage.choice)),
        ] {
            models.push(ModelSection {
                name: format!("{name} {}", stage.name),
                fit,
                records,
                candidates,
                truth,
                margins: None,
            });
        }
    }
    let setting = |name: &str, value: String| (name.to_owned(), value);
    let report = Report {
        title: "A person who adapts: condition C4, simulated".to_owned(),
        settings: vec![
            setting("condition", "C4: s1 to s2 at 40.96 s, G = 100 1/s".to_owned()),
            setting("remnant", "order 1, T_n = 0.06 s, P_n = 0.1".to_owned()),
            setting("seed", args.seed.to_string()),
            setting("hoid", env!("CARGO_PKG_VERSION").to_owned()),
        ],
        models,
        fit_summary: None,
        pictures: Vec::new(),
        notes: vec![
            "Before: 0 to 30.72 s. After: 51.20 to 81.92 s. The delay and the order of the noise model are searched \
             for Box-Jenkins; ARX uses the same delay."
                .to_owned(),
        ],
    };
    Ok(write_report(&args.out, &report.to_html()?)?)
}
