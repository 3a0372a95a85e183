//! `hoid identify --change sigmoid`: an operator whose gains change once.

use hoid::analysis::{Account, Identification, IdentifiedModel, Recordings, Setting};
use hoid::ident::{
    SigmoidChange, SigmoidFit,
    validation::{LjungBox, whiteness},
};
use hoid::io::write_record;
use hoid::model::numbers::count_with_noun;
use hoid::model::{Channel, Form, GainUnit, Record, Verdict};
use hoid::report::numbers;
use serde_json::Value;

use crate::{args::IdentifyArgs, commands::paper_table, error::CliError, json, output, text};

pub fn run(
    args: &IdentifyArgs,
    identification: &Identification<SigmoidChange>,
    read: Recordings,
) -> Result<(), CliError> {
    let identified = output::run_with_spinner("fitting", || identification.run(read))?;
    let IdentifiedModel { fit, verdict, data, .. } = &identified;
    let records = data.records.as_slice();
    if let Some(path) = &args.trace {
        write_record(path, &trace(fit, &records[0])?)?;
        output::print_message(&format!("trace of {}: {}", args.records[0].display(), path.display()));
    }
    let test = |record: &Record| Ok(whiteness(&fit.residuals(record)?.values, fit.d().len()));
    let tests = records
        .iter()
        .map(test)
        .collect::<Result<Vec<Option<LjungBox>>, CliError>>()?;
    let found = SigmoidReport {
        fit,
        verdict,
        files: &data.names,
        records,
        accounts: &data.accounts,
        tests: &tests,
        settings: &identified.settings,
    };
    paper_table::write(&args.show, || Ok(identified.json()?))?;
    if args.show.json {
        json::print(&Value::Object(identified.json()?))?;
    } else {
        output::show(&found.page(args.show.verbose))?;
    }
    CliError::check_verdict(verdict)
}

/// Returns the changing parameters at each sample of a record, each with its standard error if that is known at all
/// samples.
fn trace(fit: &SigmoidFit, record: &Record) -> Result<Record, CliError> {
    let gains = fit.trace(record);
    let mut trace: Option<Record> = None;
    let all = gains.first().map(|g| g.gains.as_slice()).unwrap_or_default();
    for (i, of) in all.iter().enumerate() {
        let values = gains.iter().map(|g| g.gains[i].estimate.value).collect();
        let errors: Option<Vec<f64>> = gains.iter().map(|g| g.gains[i].estimate.standard_error).collect();
        let value = Channel::new(of.name, of.unit, values);
        let error = errors.map(|errors| Channel::new(format!("{}_se", of.name), of.unit, errors));
        for channel in [Some(value), error].into_iter().flatten() {
            trace = Some(match trace {
                None => Record::from_output(record.sample_time(), channel)?.starting_at(record.time_s(0)),
                Some(trace) => trace.with_channel(channel)?,
            });
        }
    }
    // Every form has at least one gain, so there is a trace.
    Ok(trace.unwrap_or_else(|| record.clone()))
}

/// Returns the table of the operator's parameters before and after the change.
fn before_after_table(fit: &SigmoidFit) -> String {
    let mut rows = text::table(&["parameter", "before the change", "", "after it", "", "unit"]);
    let (before, after) = (fit.initial_operator(), fit.last_operator());
    for (a, b) in before.parameters.iter().zip(&after.parameters) {
        let cells = |e| {
            let (value, error) = text::with_uncertainty(e);
            [value, if error.is_empty() { error } else { format!("± {error}") }]
        };
        let ([a1, a2], [b1, b2]) = (cells(&a.estimate), cells(&b.estimate));
        rows.add_row([a.name.to_owned(), a1, a2, b1, b2, a.unit.to_owned()]);
    }
    rows.to_string()
}

/// An identified change with all data of its page.
struct SigmoidReport<'a> {
    fit: &'a SigmoidFit,
    verdict: &'a Verdict,
    files: &'a [String],
    records: &'a [Record],
    accounts: &'a [Account],
    /// Whiteness test of the residuals of each record.
    tests: &'a [Option<LjungBox>],
    settings: &'a [Setting],
}

impl SigmoidReport<'_> {
    /// Returns the page; `verbose` adds details.
    fn page(&self, verbose: bool) -> String {
        let Self {
            fit,
            verdict,
            files,
            records,
            accounts,
            tests,
            settings,
        } = *self;
        let mut page = text::verdict(verdict);
        let gain = records.first().map(GainUnit::of).unwrap_or_default();
        let mut rows = text::table(&["parameter", "value", "95 % from", "to", "unit"]);
        let mut remarks: Vec<(String, Vec<String>)> = Vec::new();
        for p in fit.parameters() {
            let (low, high) = text::interval(&p.estimate);
            let unit = gain.unit(&p.name, p.unit);
            rows.add_row([p.name.clone(), text::plus_minus(&p.estimate), low, high, unit]);
            if let Some(remark) = p.remark.map(|r| r.to_string()) {
                match remarks.iter_mut().find(|(known, _)| *known == remark) {
                    Some((_, names)) => names.push(p.name.clone()),
                    None => remarks.push((remark, vec![p.name.clone()])),
                }
            }
        }
        let of_form = match fit.form() {
            Form::Lead => String::new(),
            form => format!(" of the form {form}"),
        };
        page.push_str(&format!(
            "Operator{of_form} whose gains change once (sigmoid)\n{rows}\n"
        ));
        for (remark, names) in &remarks {
            page.push_str(&format!("{}: {remark}.\n", names.join(", ")));
        }
        if fit.form() != Form::Lead && fit.has_change() {
            page.push_str(&format!("{}\n", before_after_table(fit)));
        }
        let interval = |name: &str, unit: &str, interval: Option<(f64, f64)>| {
            interval.map_or(String::new(), |(low, high)| {
                format!("{name}: 95 % likelihood interval {low:.4} to {high:.4} {unit}.\n")
            })
        };
        page.push_str(&interval("t_M", "s", fit.midpoint_interval()));
        page.push_str(&interval("G", "1/s", fit.rate_interval()));
        let c = fit.comparison();
        page.push_str(&format!(
        "Compared with a constant operator: 2 ln(likelihood ratio) = {:.1} for {} more parameters, BIC {} by {:.1}.\n",
        c.likelihood_ratio,
        c.extra_parameters,
        if c.bic_difference > 0.0 { "lower" } else { "higher" },
        c.bic_difference.abs()
    ));
        if !fit.has_change() {
            page.push_str("The records show no change.\n");
        }
        page.push_str(&text::records(files, records, accounts, false));
        if !verbose {
            page.push_str(text::CHANGE_HINT);
            return page;
        }
        let t = fit.termination();
        page.push_str(&format!(
            "\nSearch: {}, {}, start: {}.\n",
            t.reason,
            count_with_noun(t.iterations, "step"),
            fit.start()
        ));
        page.push_str(&format!(
            "Loss {} over {} residuals; innovation variance {}.\n",
            numbers::format_plain(fit.loss()),
            fit.residual_count(),
            numbers::format_plain(fit.innovation_variance())
        ));
        // Residuals of the size of rounding errors contain no information.
        if fit.covariance().is_some() {
            let mut coloured = false;
            for (file, test) in files.iter().zip(tests) {
                let Some(t) = test else { continue };
                coloured |= t.p_value < 0.01;
                page.push_str(&format!(
                    "Residuals of {file}: Ljung-Box Q = {:.1} with {} degrees of freedom, p = {:.3}.\n",
                    t.statistic, t.degrees_of_freedom, t.p_value
                ));
            }
            if coloured {
                page.push_str(
                    "The residuals are not white, and too small a noise model can cause an apparent change; try \
                     --orders nd=2 or more.\n",
                );
            }
        }
        page.push_str(&text::settings(settings));
        page
    }
}
