//! Text output for the operator of a person.

use hoid::analysis::{Account, IdentifiedModel, Setting};
use hoid::ident::{
    ResponsePoint,
    family::{ChannelFit, ChannelRole, ClusterKind, FamilyFit, FormFigures, Intersample, LoopMeasures, Parameter},
    validation::GoodnessOfFit,
};
use hoid::model::{ContinuousTransferFunction, GainUnit, Record, uncertainty::Estimate};
use hoid::report::{
    numbers::{self, format_p_value},
    operator_sentence, undetermined_remark,
};

use crate::{error::CliError, text};

/// The delay for an error that is linear between its samples is printed in addition to tau_e only if the two delays
/// differ by at least this number of standard errors of tau_e; `MIN_DIFFERENCE_S` is the smallest such difference in s.
const MIN_DIFFERENCE_ERRORS: f64 = 2.0;
const MIN_DIFFERENCE_S: f64 = 0.007;

/// Frequencies in rad/s at which the product of the response to the target and the response of the controlled element
/// is printed.
const PRINTED_FREQUENCIES_RAD_S: [f64; 3] = [1.0, 2.5, 4.0];

/// An identified operator with all data of its page.
pub struct FamilyReport<'a> {
    pub identified: &'a IdentifiedModel,
    pub fit: &'a FamilyFit,
    pub files: &'a [String],
    /// The records of the fit, with their means removed.
    pub records: &'a [Record],
    pub accounts: &'a [Account],
    pub element: Option<&'a ContinuousTransferFunction>,
    pub validation: Option<(&'a str, GoodnessOfFit)>,
    pub settings: &'a [Setting],
}

impl FamilyReport<'_> {
    /// Returns the page; `verbose` adds details.
    pub fn page(&self, verbose: bool) -> Result<String, CliError> {
        let mut page = self.summary(verbose)?;
        if !verbose {
            page.push_str(text::MORE_HINT);
            return Ok(page);
        }
        page.push_str(&self.method_table());
        if self.fit.forms.len() > 1 {
            page.push_str(&format!("\n{}\n", form_table(&self.fit.forms, self.fit.form.name())));
        }
        page.push_str(&self.details()?);
        page.push_str(&text::output_levels(self.files, self.accounts));
        page.push_str(&text::settings(self.settings));
        Ok(page)
    }

    /// Returns the verdict, the parameters with their intervals, the loop, the fit, and the records that were analysed.
    fn summary(&self, verbose: bool) -> Result<String, CliError> {
        let fit = self.fit;
        let gain = self.records.first().map(GainUnit::of).unwrap_or_default();
        let mut page = text::verdict(&fit.verdict);
        page.push_str(&self.fit.title());
        page.push('\n');
        if let Some(words) = operator_sentence(self.identified) {
            page.push_str(&format!("{words}\n"));
        }
        for (k, of) in fit.operators.iter().enumerate() {
            if fit.operators.len() > 1 {
                page.push_str(&format!("{}:\n", self.files[k]));
            }
            page.push_str(&parameter_table(&of.parameters, &gain));
            page.push('\n');
        }
        page.push_str(&self.intersample_sentence());
        page.push_str(&self.channel_responses(&gain, verbose));
        if let Some(element) = self.element {
            let here = fit.loop_measures(0, element);
            page.push_str(&format!(
                "Open loop with {element}: {}\n",
                loop_measures_text(here.as_ref())
            ));
            page.push_str(&text::loop_shape(&fit.loop_shape(0, element), verbose));
        }
        page.push_str(&self.person_sentence());
        let quality = self.identified.quality()?;
        let coherence = fit.coherent_share;
        page.push_str(&format!(
            "Fit: VAF of the prediction {:.2} %{}{}.\n",
            quality.vaf_prediction,
            coherence.map_or_else(String::new, |share| format!(
                "; coherence of u with the excitation {share:.2}"
            )),
            // If the methods do not agree, the verdict contains a finding.
            match fit.agreement.is_some() && fit.verdict.findings().iter().all(|found| found.kind != "agreement") {
                true => "; the methods agree",
                false => "",
            },
        ));
        if let Some((file, q)) = &self.validation {
            page.push_str(&format!(
                "On {file}: VAF simulation {:.2} %, prediction {:.2} %.\n",
                q.vaf_simulation, q.vaf_prediction
            ));
        }
        page.push_str(&text::records(self.files, self.records, self.accounts, false));
        Ok(page)
    }

    /// Returns the responses to inputs other than the error.
    fn channel_responses(&self, gain: &GainUnit, verbose: bool) -> String {
        let mut page = String::new();
        for channel in &self.fit.channels {
            let (name, role) = (&channel.name, channel.role);
            match &channel.response {
                None => page.push_str(&format!(
                    "No response to {name} ({role}) was found ({} for the best of {} forms).\n",
                    format_p_value(channel.p_value),
                    channel.forms.len() - 1
                )),
                Some(of) => {
                    page.push_str(&format!("Response to {name} ({role}): {}\n", of.operator.form()));
                    page.push_str(&parameter_table(&of.parameters, gain));
                    page.push('\n');
                    page.push_str(&self.element_sentence(channel));
                }
            }
            if verbose {
                let mut rows = text::table(&["form", "loss", "AIC minus lowest"]);
                for form in &channel.forms {
                    rows.add_row([
                        form.form.map_or("no response", |form| form.name()).to_owned(),
                        form.loss.map_or_else(String::new, numbers::format_plain),
                        form.criterion.map_or_else(String::new, |c| format!("{c:.1}")),
                    ]);
                }
                page.push_str(&format!("{rows}\n"));
            }
        }
        page
    }

    /// Returns a sentence with the product of the response to the target and the response of the controlled element;
    /// empty unless both are known. The product is one if the response to the target alone makes the output follow the
    /// target.
    fn element_sentence(&self, channel: &ChannelFit) -> String {
        let Some(element) = self.element.filter(|_| channel.role == ChannelRole::Feedforward) else {
            return String::new();
        };
        let sampling = (self.fit.sample_time, self.fit.intersample);
        let Some(points) = channel.frequency_response(&PRINTED_FREQUENCIES_RAD_S, sampling) else {
            return String::new();
        };
        let one = |point: &ResponsePoint| {
            let of_element = element.response(point.omega_rad_s);
            let gain = 10_f64.powf(point.magnitude_db.value / 20.0) * of_element.norm();
            let phase = (point.phase_deg.value + of_element.arg().to_degrees() + 180.0).rem_euclid(360.0) - 180.0;
            let error = |e: Option<f64>| e.map_or_else(String::new, |e| format!(" ± {e:.0}"));
            let of_gain = point
                .magnitude_db
                .standard_error
                .map(|db| gain * db * std::f64::consts::LN_10 / 20.0);
            format!(
                "{} at {} rad/s ({phase:.0}{} deg)",
                value_with_error(gain, of_gain),
                point.omega_rad_s,
                error(point.phase_deg.standard_error)
            )
        };
        let all: Vec<String> = points.iter().map(one).collect();
        format!(
            "F·M of {} (gain 1 and phase 0 deg for perfect following of the target): {}.\n",
            channel.name,
            all.join(", ")
        )
    }

    /// Returns a sentence on the behaviour of the error between its samples for which tau_e is valid, with the delay
    /// for the other behaviour if the two delays differ noticeably; empty if they do not.
    fn intersample_sentence(&self) -> String {
        let fit = self.fit;
        let named = fit.operator(0).parameters.iter().find(|p| p.name == "tau_e");
        let Some((tau, straight)) = named.zip(fit.delay_if_linear_s(0)) else {
            return match fit.intersample {
                Intersample::Zoh => "tau_e applies to an error that is held between its samples.\n".to_owned(),
                _ => "tau_e applies to an error that is linear between its samples.\n".to_owned(),
            };
        };
        let half = straight - tau.value;
        if half < MIN_DIFFERENCE_S || half < MIN_DIFFERENCE_ERRORS * tau.standard_error.unwrap_or(f64::INFINITY) {
            return String::new();
        }
        format!(
            "tau_e applies to an error that is held between its samples; for an error logged from a faster or \
             continuous signal, tau_e is {} s (--intersample foh).\n",
            text::format_significant(straight)
        )
    }

    /// Returns a sentence with the standard errors for the person where they differ from those for the analysed runs;
    /// empty without run-to-run variation and for a fit with several operators.
    fn person_sentence(&self) -> String {
        let fit = self.fit;
        if fit.run_to_run == 0.0 || fit.operators.len() > 1 {
            return String::new();
        }
        let error = |name: &str, estimate: Estimate, error: f64| {
            let (_, error) = numbers::with_uncertainty(estimate.value, Some(error));
            format!("{name} ± {error}")
        };
        let parameters = fit.operator(0).parameters.iter().filter(|p| p.determined);
        let wider = parameters.filter(|p| p.standard_error_person != p.standard_error);
        let mut all: Vec<String> = wider
            .filter_map(|p| Some(error(&p.name, p.estimate(), p.standard_error_person?)))
            .collect();
        let here = self.element.and_then(|element| fit.loop_measures(0, element));
        if let Some(m) = here {
            let [crossover, margin] = m.of_person;
            all.extend(crossover.map(|s| error("crossover", m.crossover_rad_s, s)));
            all.extend(margin.map(|s| error("phase margin", m.phase_margin_deg, s)));
        }
        let runs = if self.records.len() == 1 {
            "this run"
        } else {
            "these runs"
        };
        match all.as_slice() {
            [] => String::new(),
            all => format!(
                "These errors apply to {runs}. With a run-to-run variation of the gain of about {:.0} %, the errors \
                 for the person are: {}.\n",
                100.0 * fit.run_to_run,
                all.join(", ")
            ),
        }
    }

    /// Returns a table of the parameters by prediction error and by the other methods; empty if no other method gave a
    /// result.
    fn method_table(&self) -> String {
        let fit = self.fit;
        let gain = self.records.first().map(GainUnit::of).unwrap_or_default();
        let lines = fit.lines.as_ref().map(|lines| lines.parameters());
        let instrumental = (fit.instrumental.as_ref())
            .filter(|found| found.termination.converged())
            .map(|found| found.parameters());
        if lines.is_none() && instrumental.is_none() {
            return String::new();
        }
        let columns = [("at the lines", lines), ("RIV-BJ", instrumental)];
        let others: Vec<_> = columns.into_iter().filter_map(|(head, of)| Some((head, of?))).collect();
        let heads: Vec<&str> = ["parameter", "prediction error"]
            .into_iter()
            .chain(others.iter().map(|(head, _)| *head))
            .collect();
        let mut rows = text::table(&heads);
        for (k, here) in fit.operator(0).parameters.iter().enumerate() {
            let other_values = others.iter().filter_map(|(_, of)| of.get(k));
            let other_values = other_values.map(|(_, there)| value_with_error(there.value, there.standard_error));
            rows.add_row(
                [
                    name_with_unit(here, &gain),
                    value_with_error(here.value, here.standard_error),
                ]
                .into_iter()
                .chain(other_values),
            );
        }
        let mut page = format!("\n{rows}\n");
        if let Some(element) = self.element {
            if fit.lines.is_some() {
                let at_lines = fit.loop_measures_at_lines(element);
                page.push_str(&format!(
                    "Open loop from the fit at the lines: {}\n",
                    loop_measures_text(at_lines.as_ref())
                ));
            }
            if fit.instrumental.as_ref().is_some_and(|i| i.termination.converged()) {
                let by_instruments = fit.loop_measures_by_instruments(element);
                page.push_str(&format!(
                    "Open loop by RIV-BJ: {}\n",
                    loop_measures_text(by_instruments.as_ref())
                ));
            }
        }
        if let Some(lines) = &fit.lines {
            let reduced = lines.reduced_chi_squared();
            page.push_str(&format!(
                "At the lines: chi^2 = {:.1} with {} degrees of freedom{}.\n",
                lines.chi_squared,
                lines.degrees_of_freedom,
                reduced.map_or(String::new(), |r| format!(" ({r:.2} each)"))
            ));
        }
        if let Some(agreement) = &fit.agreement {
            let pairs = agreement.pairs.iter().map(|pair| {
                format!(
                    "{} and {} {}",
                    pair.methods.0.phrase(),
                    pair.methods.1.phrase(),
                    format_p_value(pair.p_value)
                )
            });
            page.push_str(&format!(
                "Agreement of the methods over {} that the data determine: {}; joint test {}.\n",
                numbers::count_with_noun(agreement.rows.len(), "coordinate"),
                pairs.collect::<Vec<_>>().join(", "),
                format_p_value(agreement.p_value)
            ));
        }
        page
    }

    fn details(&self) -> Result<String, CliError> {
        let fit = self.fit;
        let mut page = String::from("\n");
        if let Some(free) = &fit.free_model {
            page.push_str(&format!(
                "Box-Jenkins model of the same orders: loss {} (operator: {}), likelihood-ratio statistic {:.1} with \
                 {} degrees of freedom ({}).\n",
                numbers::format_plain(free.loss),
                numbers::format_plain(fit.loss),
                free.likelihood_ratio,
                free.degrees_of_freedom,
                format_p_value(free.p_value)
            ));
        }
        let clusters = match fit.cluster_kind {
            ClusterKind::Runs => format!("{} runs", fit.clusters),
            ClusterKind::Blocks => format!("{} blocks of the records", fit.clusters),
        };
        page.push_str(&format!(
            "Standard errors from the scatter of {clusters}: variances {:.2} times as large as for white residuals. \
             Student's 95 % intervals.\n",
            fit.inflation
        ));
        let quality = self.identified.quality()?;
        page.push_str(&format!(
            "VAF prediction {:.2} %, simulation {:.2} %. The simulation VAF carries little information about people, \
             because an operator with a lag integrates the offset and drift of e{}.\n",
            quality.vaf_prediction,
            quality.vaf_simulation,
            fit.coherent_share.map_or(String::new(), |share| format!(
                "; at the lines the mean coherence of u with the excitation is {:.2}",
                share
            ))
        ));
        page.push_str(&format!("Search: {}.\n", fit.termination));
        let entries = fit.prior.entries();
        let entry = |e: &hoid::ident::family::ParameterPrior| {
            format!(
                "{} = {} within a factor of {:.2}",
                e.parameter,
                e.centre,
                e.spread.exp()
            )
        };
        let mut sources: Vec<&str> = entries.iter().map(|e| e.source.as_str()).collect();
        sources.dedup();
        page.push_str(&match entries {
            [] => "Prior: none.\n".to_owned(),
            all => format!(
                "Prior: {} ({}).\n",
                all.iter().map(entry).collect::<Vec<_>>().join(", "),
                sources.join("; ")
            ),
        });
        Ok(page)
    }
}

fn name_with_unit(p: &Parameter, gain: &GainUnit) -> String {
    match gain.unit(&p.name, p.unit) {
        unit if unit.is_empty() => p.name.clone(),
        unit => format!("{} ({unit})", p.name),
    }
}

/// Formats a value and its error with the digits that the error justifies; a value smaller than its error gets no
/// spurious digits.
fn value_with_error(value: f64, error: Option<f64>) -> String {
    match error {
        _ if value.is_infinite() => "infinite".to_owned(),
        Some(error) if error > value.abs() => "not known".to_owned(),
        Some(_) => {
            let (value, error) = numbers::with_uncertainty(value, error);
            format!("{value} ± {error}")
        }
        None => numbers::format_plain(value),
    }
}

/// Formats parameters with their intervals, the share of the prior, and whether they are determined.
fn parameter_table(of: &[Parameter], gain: &GainUnit) -> String {
    let mut rows = text::table(&["parameter", "value", "95 % from", "to", "from prior"]);
    for p in of {
        let end = |v: f64| {
            if v.is_infinite() {
                "open".to_owned()
            } else {
                text::format_significant(v)
            }
        };
        let (low, high) = p
            .interval
            .map_or_else(Default::default, |(low, high)| (end(low), end(high)));
        let share = if p.prior_share > 0.0 {
            format!("{:.0} %", 100.0 * p.prior_share)
        } else {
            String::new()
        };
        let value = match undetermined_remark(p) {
            "" => value_with_error(p.value, p.standard_error),
            why => why.to_owned(),
        };
        rows.add_row([name_with_unit(p, gain), value, low, high, share]);
    }
    rows.to_string()
}

fn loop_measures_text(found: Option<&LoopMeasures>) -> String {
    let Some(m) = found else {
        return "no crossover".to_owned();
    };
    let interval = |of: Option<(f64, f64)>| match of {
        Some((low, high)) => format!(
            " (95 %: {} to {})",
            text::format_significant(low),
            text::format_significant(high)
        ),
        None => String::new(),
    };
    format!(
        "crossover {} rad/s{}, phase margin {} deg{}",
        value_with_error(m.crossover_rad_s.value, m.crossover_rad_s.standard_error),
        interval(m.crossover_interval),
        value_with_error(m.phase_margin_deg.value, m.phase_margin_deg.standard_error),
        interval(m.phase_margin_interval),
    )
}

fn form_table(all: &[FormFigures], chosen: &str) -> String {
    let mut rows = text::table(&[
        "form",
        "weight",
        "loss",
        "criterion",
        "held out",
        "chi^2",
        "degrees",
        "",
    ]);
    let least = all.iter().filter_map(|f| f.criterion).fold(f64::INFINITY, f64::min);
    for f in all {
        let number = |v: Option<f64>| v.map_or(String::new(), |v| format!("{v:.1}"));
        let sign = if f.form.name() == chosen { "chosen" } else { "" };
        rows.add_row([
            f.form.to_string(),
            if f.weight > 0.0 {
                format!("{:.2}", f.weight)
            } else {
                String::new()
            },
            f.loss.map_or("none".to_owned(), numbers::format_plain),
            f.criterion.map_or(String::new(), |c| format!("+{:.1}", c - least)),
            number(f.held_out),
            number(f.chi_squared),
            f.degrees_of_freedom.map_or(String::new(), |d| d.to_string()),
            sign.to_owned(),
        ]);
    }
    rows.to_string()
}
