//! Results as text tables.

use hoid::analysis::{Account, Setting};
use hoid::ident::{
    Choice, Fit, GreyBoxFit, MarginEstimates,
    family::LoopShape,
    order_selection::Criterion,
    validation::{GoodnessOfFit, Validation},
};
use hoid::model::numbers::count_with_noun;
use hoid::model::{
    GainUnit, NotConvertible, Record, Verdict,
    margins::Crossings,
    uncertainty::{Estimate, OperatorEstimate, RemnantEstimate},
};
use hoid::report::numbers;

use crate::table::Rows;

/// Number of candidates of a search that are printed; the JSON contains all candidates.
const CANDIDATES_SHOWN: usize = 8;
/// Maximum number of faults of a record that are listed individually.
const FAULTS_SHOWN: usize = 10;

/// Returns an empty table in the style common to all output.
pub fn table(header: &[&str]) -> Rows {
    Rows::with_header(header)
}

/// Formats a value and its standard error with the digits that the error justifies.
pub fn with_uncertainty(e: &Estimate) -> (String, String) {
    numbers::with_uncertainty(e.value, e.standard_error)
}

/// Formats the verdict for the top of the page.
pub fn verdict(verdict: &Verdict) -> String {
    format!("{verdict}\n\n")
}

/// Hint at the end of a page that has further details.
pub const MORE_HINT: &str = "More with -v: other candidates, tests, all settings; --report DIR writes a page.\n";

/// Hint at the end of the page of an operator whose gains change; there is no report about such an operator.
pub const CHANGE_HINT: &str = "More with -v: search, residual tests, all settings; --trace FILE writes the gains.\n";

/// Hint at the end of a page whose only further details are the settings.
pub const SETTINGS_HINT: &str = "More with -v: all settings.\n";

/// Maximum number of records that are listed by name.
const RECORDS_SHOWN: usize = 4;

/// Lists the records used and the steps applied to them.
pub fn records(files: &[String], records: &[Record], accounts: &[Account], verbose: bool) -> String {
    let line = |((file, record), account): ((&String, &Record), &Account)| {
        let mut lines = format!(
            "{file}: {} samples of {} s from t = {:.4} s\n",
            record.len(),
            numbers::format_plain(record.sample_time().s()),
            record.time_s(0)
        );
        for step in &account.steps {
            lines.push_str(&format!("  {step}\n"));
        }
        for fault in account.faults.iter().take(FAULTS_SHOWN) {
            lines.push_str(&format!("  {fault}\n"));
        }
        if account.faults.len() > FAULTS_SHOWN {
            let more = account.faults.len() - FAULTS_SHOWN;
            lines.push_str(&format!("  and {}\n", count_with_noun(more, "more fault")));
        }
        lines
    };
    let shown = if records.len() > RECORDS_SHOWN {
        1
    } else {
        RECORDS_SHOWN
    };
    let all = files.iter().zip(records).zip(accounts);
    let quiet = |account: &Account| {
        account.faults.is_empty() && (account.steps.is_empty() || account.steps == accounts[0].steps)
    };
    let mut text = String::new();
    for (k, one) in all.enumerate() {
        // A record that has faults, or whose steps differ from those of the first record, is always listed.
        if verbose || k < shown || !quiet(one.1) {
            text.push_str(&line(one));
        }
    }
    if !verbose && records.len() > shown {
        let alike = !accounts[0].steps.is_empty() && accounts.iter().all(quiet);
        text.push_str(&format!(
            "{} records in total; the last is {}{}\n",
            records.len(),
            files[files.len() - 1],
            if alike { ", all prepared the same way" } else { "" }
        ));
    }
    text
}

/// Lists, for each record, the constant level of u that was estimated together with the fit, if there is one.
pub fn output_levels(files: &[String], accounts: &[Account]) -> String {
    let line = |(file, account): (&String, &Account)| {
        let level = account.level.as_ref()?;
        Some(format!(
            "{file}: level of u in addition to the response to e: {level}\n"
        ))
    };
    files.iter().zip(accounts).filter_map(line).collect()
}

/// Lists every setting that affects the result.
pub fn settings(settings: &[Setting]) -> String {
    let of = |given: bool| {
        let list = settings.iter().filter(|one| one.is_given == given);
        let list: Vec<String> = list.map(|one| format!("{}: {}", one.name, one.value)).collect();
        if list.is_empty() {
            "none".to_owned()
        } else {
            list.join("; ")
        }
    };
    format!("\nSettings given: {}.\nBy default: {}.\n", of(true), of(false))
}

/// Lists the orders m of the remnant that a grey-box fit tried; empty if there was only one.
pub fn remnant_orders(grey_box: &GreyBoxFit) -> String {
    if grey_box.candidates().len() < 2 {
        return String::new();
    }
    let mut rows = table(&["remnant order m", "loss", "AIC", "BIC", ""]);
    for candidate in grey_box.candidates() {
        let m = candidate.order.to_string();
        match &candidate.outcome {
            Ok(f) => rows.add_row([
                m,
                numbers::format_plain(f.loss),
                format!("{:.1}", f.aic),
                format!("{:.1}", f.bic),
                if f.converged { "" } else { "not converged" }.to_owned(),
            ]),
            Err(reason) => rows.add_row([m, String::new(), String::new(), String::new(), reason.to_string()]),
        };
    }
    format!("{rows}\n\n")
}

/// Lists the operators of all records except the first, if a grey-box fit has parameters that differ between records.
pub fn other_records(grey_box: &GreyBoxFit, files: &[String], gain: &GainUnit) -> String {
    let differs = |k: &usize| grey_box.operator_parameters(*k) != grey_box.operator_parameters(0);
    let mut text = String::new();
    for k in (1..files.len()).filter(differs) {
        text.push_str(&format!("{}:\n{}", files[k], operator(&grey_box.operator(k), gain)));
    }
    text
}

/// Lists the coefficients of a model.
pub fn coefficients(fit: &Fit) -> String {
    let what = if fit.is_grey_box() { "parameter" } else { "coefficient" };
    let all = fit.parameters();
    let named = all.iter().map(|(name, e)| (name.as_str(), String::new(), *e));
    format!("{}\n", estimates(what, named))
}

/// Describes how the search for the minimum ended.
pub fn search(fit: &Fit) -> String {
    let t = fit.termination();
    format!(
        "Search: {}, {}, start: {}.\n",
        t.reason,
        count_with_noun(t.iterations, "step"),
        fit.start()
    )
}

/// Returns a warning if the model is not stable; otherwise empty.
pub fn instability(fit: &Fit) -> &'static str {
    if fit.model().is_stable() {
        ""
    } else {
        "The model from e to u is not stable (a pole outside the unit circle).\n"
    }
}

/// Describes in one line the share of u that the model explains.
pub fn fit_line(fit: &Fit, q: &GoodnessOfFit) -> String {
    if fit.model().structure().has_input() {
        format!(
            "Fit: VAF of the prediction {:.2} %, of the simulation {:.2} %.\n",
            q.vaf_prediction, q.vaf_simulation
        )
    } else {
        format!("Fit: VAF of the prediction {:.2} %.\n", q.vaf_prediction)
    }
}

/// Lists loss and fit percentages.
pub fn quality(fit: &Fit, q: &GoodnessOfFit) -> String {
    let variance = if fit.is_robust() {
        "square of the robust scale (median absolute residual / 0.6745)".to_owned()
    } else {
        format!("divisor: residuals - parameters - {} initial states", fit.state_count())
    };
    let mut text = format!(
        "Loss {} over {} residuals; innovation variance {} ({variance}).\n",
        numbers::format_plain(fit.loss()),
        fit.residual_count(),
        numbers::format_plain(fit.innovation_variance()),
    );
    text.push_str(&if fit.model().structure().has_input() {
        format!(
            "VAF (no mean removed): simulation {:.2} %, prediction {:.2} %.  NRMSE fit (mean removed): simulation {:.2} %, \
             prediction {:.2} %.\n",
            q.vaf_simulation, q.vaf_prediction, q.nrmse_simulation, q.nrmse_prediction,
        )
    } else {
        format!(
            "Prediction: VAF (no mean removed) {:.2} %, NRMSE fit (mean removed) {:.2} %.\n",
            q.vaf_prediction, q.nrmse_prediction
        )
    });
    text
}

/// Half width of a 95 % interval of a normal distribution, in standard errors.
const NORMAL_95: f64 = 1.959_963_984_540_054;

/// Formats the ends of the 95 % interval that follows from the standard error, with three digits; empty without a
/// standard error.
pub fn interval(e: &Estimate) -> (String, String) {
    let end = |sign: f64| {
        let error = e.standard_error.filter(|error| error.is_finite());
        error.map_or_else(String::new, |error| {
            format_significant(e.value + sign * NORMAL_95 * error)
        })
    };
    (end(-1.0), end(1.0))
}

/// Formats a value with three significant digits, which suffice for an interval.
pub fn format_significant(value: f64) -> String {
    hoid::model::numbers::format_significant(value, 3)
}

/// Formats an estimate as `value ± standard error`.
pub fn plus_minus(e: &Estimate) -> String {
    match with_uncertainty(e) {
        (value, error) if error == numbers::DASH => value,
        (value, error) => format!("{value} ± {error}"),
    }
}

/// Returns a table of parameters, with name, value ± standard error, 95 % interval and unit in each row.
pub fn estimates<'a>(what: &str, all: impl IntoIterator<Item = (&'a str, String, Estimate)>) -> Rows {
    let all: Vec<(&str, String, Estimate)> = all.into_iter().collect();
    let with_units = all.iter().any(|(_, unit, _)| !unit.is_empty());
    let mut header = vec![what, "value", "95 % from", "to"];
    header.extend(with_units.then_some("unit"));
    let mut rows = table(&header);
    for (name, unit, e) in all {
        let (low, high) = interval(&e);
        let cells = [name.to_owned(), plus_minus(&e), low, high];
        rows.add_row(cells.into_iter().chain(with_units.then_some(unit)));
    }
    rows
}

/// Lists the parameters of the operator, or gives the reason why there are none.
pub fn operator(found: &Result<OperatorEstimate, NotConvertible>, gain: &GainUnit) -> String {
    match found {
        Ok(o) => {
            let named = o.rows().map(|(name, unit, e)| (name, gain.unit(name, unit), e));
            let rows = estimates("operator", named);
            let warning = if o.parameters().is_stable() {
                ""
            } else {
                "zeta_nm is not positive: the operator is not stable.\n"
            };
            format!("{rows}\n{warning}")
        }
        Err(reason) => format!("The model cannot be converted to an operator: {reason}.\n"),
    }
}

/// Gives T_n and K_n, or the reason why there are none.
pub fn remnant(found: &Result<RemnantEstimate, NotConvertible>) -> String {
    match found {
        Ok(r) => {
            let ((t_n, t_n_error), (k_n, k_n_error)) = (with_uncertainty(&r.t_n_s), with_uncertainty(&r.k_n));
            format!(
                "Remnant of order {} ({}): T_n = {t_n} s (standard error {t_n_error}), K_n = {k_n} ({k_n_error}).\n",
                r.order, r.discretisation
            )
        }
        Err(reason) => format!("The noise model cannot be converted to a remnant filter: {reason}.\n"),
    }
}

/// Gives crossover and margins in one line.
pub fn margins(m: &MarginEstimates) -> String {
    let shown = |value: &Estimate, unit: &str| {
        let (value, error) = match value.standard_error {
            Some(_) => with_uncertainty(value),
            None => (format!("{:.4}", value.value), String::new()),
        };
        let error = match error.as_str() {
            "" => error,
            error => format!(" (standard error {error})"),
        };
        format!("{value} {unit}{error}")
    };
    let crossover = match (&m.crossover_rad_s, &m.phase_margin_deg) {
        (Some(crossover), Some(margin)) => {
            let (crossover, margin) = (shown(crossover, "rad/s"), shown(margin, "deg"));
            format!("Crossover frequency {crossover}, phase margin {margin}")
        }
        _ => "No crossover: the loop gain does not cross 1 from above".to_owned(),
    };
    let gain = match (&m.gain_margin_db, &m.phase_crossover_rad_s) {
        (Some(margin), Some(at)) => format!("gain margin {} at {}", shown(margin, "dB"), shown(at, "rad/s")),
        _ => "no gain margin: the loop phase does not cross -180 deg from above".to_owned(),
    };
    format!("{crossover}; {gain}.\n")
}

/// Gives crossover and margins of a known loop in one line, and each crossover if there are several.
pub fn crossings(all: &Crossings) -> String {
    let mut line = margins(&all.margins().into());
    if all.gain.len() > 1 {
        let each = (all.gain.iter()).map(|c| format!("{:.4} rad/s ({:.1} deg)", c.omega_rad_s, c.margin));
        line.push_str(&format!(
            "The gain is one at {} frequencies (phase margins in parentheses): {}.\n",
            all.gain.len(),
            each.collect::<Vec<_>>().join(", ")
        ));
    }
    line
}

/// Describes properties of an estimated loop in addition to its lowest crossover: the other crossovers, the smallest
/// phase margin, the gain margin, and instability. For a stable loop with one crossover the text is empty, unless
/// `always` is set.
pub fn loop_shape(shape: &LoopShape, always: bool) -> String {
    if !always && shape.crossovers.len() < 2 && shape.is_stable() != Some(false) {
        return String::new();
    }
    let mut parts = Vec::new();
    if let ([_, others @ ..], Some((omega, margin))) = (shape.crossovers.as_slice(), shape.smallest_margin())
        && !others.is_empty()
    {
        let each = (others.iter()).map(|(w, m)| format!("{} rad/s ({:.0} deg)", format_significant(w.value), m.value));
        parts.push(format!("unit gain also at {}", each.collect::<Vec<_>>().join(", ")));
        parts.push(format!(
            "smallest phase margin {} deg, at {} rad/s",
            plus_minus(&margin),
            format_significant(omega.value)
        ));
    }
    if let Some((omega, db)) = &shape.gain_margin {
        parts.push(format!(
            "gain margin {} dB at {} rad/s",
            plus_minus(db),
            format_significant(omega.value)
        ));
    }
    if shape.is_stable() == Some(false) {
        parts.push("the closed loop is not stable".to_owned());
    }
    if parts.is_empty() {
        return String::new();
    }
    format!("This loop: {}.\n", parts.join("; "))
}

/// Lists poles and zeros with their natural frequency and damping.
pub fn roots(fit: &Fit) -> String {
    let ts = fit.model().sample_time().s();
    let mut rows = table(&["root", "real", "imaginary", "standard errors", "rad/s", "damping"]);
    let all = fit.roots();
    if all.is_empty() {
        return String::new();
    }
    for root in all {
        let what = match root.polynomial {
            'a' => "pole (A)",
            'f' => "pole (F)",
            'd' => "noise pole (D)",
            'c' => "noise zero (C)",
            _ => "zero (B)",
        };
        let errors = match root.standard_error {
            Some((re, im)) if re.is_finite() && im.is_finite() => {
                if root.value.im == 0.0 {
                    format!("{re:.1e}")
                } else {
                    format!("{re:.1e}, {im:.1e}")
                }
            }
            _ => "-".to_owned(),
        };
        let (frequency, damping) = match root.frequency_and_damping(ts) {
            Some((frequency, damping)) => (format!("{frequency:.3}"), format!("{damping:.3}")),
            None => ("-".to_owned(), "-".to_owned()),
        };
        rows.add_row([
            what.to_owned(),
            format!("{:.6}", root.value.re),
            format!("{:.6}", root.value.im),
            errors,
            frequency,
            damping,
        ]);
    }
    format!("{rows}\n")
}

/// Lists the residual tests of each record.
pub fn residual_tests(files: &[String], validations: &[Validation]) -> String {
    let mut rows = table(&["residuals of", "Ljung-Box Q", "degrees", "p", "signs"]);
    let (mut coloured, mut missed, mut feedback) = (false, false, false);
    for (file, v) in files.iter().zip(validations) {
        let signs = v.diagnostics();
        let mut words = Vec::new();
        for (there, seen, word) in [
            (signs.coloured_residuals, &mut coloured, "not white"),
            (signs.under_modelled, &mut missed, "follow the input"),
            (signs.feedback, &mut feedback, "feedback"),
        ] {
            *seen |= there;
            if there {
                words.push(word);
            }
        }
        let (q, degrees, p) = match v.ljung_box {
            Some(t) => (
                format!("{:.1}", t.statistic),
                t.degrees_of_freedom.to_string(),
                format!("{:.3}", t.p_value),
            ),
            None => ("-".to_owned(), "-".to_owned(), "-".to_owned()),
        };
        rows.add_row([file.clone(), q, degrees, p, words.join(", ")]);
    }
    let mut text = format!("{rows}\n");
    for (seen, sentence) in [
        (
            coloured,
            "Not white: use a richer noise model (larger nd or nc); in a closed loop, this also reduces the bias.\n",
        ),
        (
            missed,
            "Correlated with the input at positive lags: the model misses dynamics or has the wrong delay.\n",
        ),
        (
            feedback,
            "Correlated with the input at negative lags: there is feedback, as in every closed loop.\n",
        ),
    ] {
        if seen {
            text.push_str(sentence);
        }
    }
    text
}

/// Describes the range of delays in the 95 % likelihood interval of a search over nk, where tau_e = (nk - 1) Ts; empty
/// if there is no interval.
pub fn delay(choice: &Choice) -> String {
    let ts = choice.fit.model().sample_time().s();
    let seconds = |nk: usize| format_significant((nk as f64 - 1.0).max(0.0) * ts);
    choice.delay_interval().map_or_else(String::new, |(low, high)| {
        format!(
            "Delay, 95 % likelihood interval: nk = {low} to {high} (dead time {} to {} s).\n",
            seconds(low),
            seconds(high)
        )
    })
}

/// Lists the best candidates of a search.
pub fn candidates(choice: &Choice) -> String {
    let mut good: Vec<_> = choice
        .candidates
        .iter()
        .filter_map(|c| c.outcome.as_ref().ok().map(|f| (c.orders, f)))
        .collect();
    let key = choice.criterion.label();
    good.sort_by(|a, b| {
        let value = |f: &hoid::ident::order_selection::CandidateFigures| f.value(choice.criterion);
        value(a.1).total_cmp(&value(b.1))
    });
    // A selection criterion that is not among the default columns gets a separate column.
    let decides = !matches!(choice.criterion, Criterion::Loss | Criterion::Aic | Criterion::Bic);
    let mut header = vec!["candidate", "loss", "AIC", "BIC", ""];
    if decides {
        header.insert(4, key);
    }
    let mut rows = table(&header);
    for (orders, f) in good.iter().take(CANDIDATES_SHOWN) {
        let mut row = vec![
            orders.to_string(),
            numbers::format_plain(f.loss),
            format!("{:.1}", f.aic),
            format!("{:.1}", f.bic),
            if f.converged { "" } else { "not converged" }.to_owned(),
        ];
        if decides {
            row.insert(4, numbers::format_plain(f.value(choice.criterion)));
        }
        rows.add_row(row);
    }
    let failed = choice.candidates.len() - good.len();
    let mut text = format!(
        "Searched {} candidates, smallest {key} first; all on the same samples.\n{rows}\n",
        choice.candidates.len()
    );
    if failed > 0 {
        text.push_str(&format!(
            "{} could not be fitted; --json lists the reasons.\n",
            count_with_noun(failed, "candidate")
        ));
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn missing_margins_are_explained_in_words() {
        let known = |value: f64| {
            Some(Estimate {
                value,
                standard_error: None,
            })
        };
        let margins_of = |crossover: Option<Estimate>, gain: Option<Estimate>| {
            margins(&MarginEstimates {
                crossover_rad_s: crossover,
                phase_margin_deg: crossover,
                gain_margin_db: gain,
                phase_crossover_rad_s: gain,
            })
        };
        assert_eq!(
            margins_of(known(2.0), known(3.0)),
            "Crossover frequency 2.0000 rad/s, phase margin 2.0000 deg; gain margin 3.0000 dB at 3.0000 rad/s.\n"
        );
        assert_eq!(
            margins_of(known(2.0), None),
            "Crossover frequency 2.0000 rad/s, phase margin 2.0000 deg; no gain margin: the loop phase does not cross \
             -180 deg from above.\n"
        );
        assert!(
            margins_of(None, known(3.0)).starts_with("No crossover: the loop gain does not cross 1 from above; gain")
        );
    }
}
