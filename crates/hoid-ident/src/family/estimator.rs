//! Estimation of a person's operator from records: the searches over all forms. The [family module](super) describes
//! the steps.

use std::sync::Arc;

use hoid_model::{Detrend, Form, Record, Structure};

use super::{
    arx_response::ArxResponse,
    assembly::{ChosenForm, LineResults, OtherForm},
    channel::{ChannelFit, SeenChannel},
    channel_criterion::{ChannelInForm, ChannelLineFitter},
    channel_lines::{ChannelLines, have_separate_lines},
    channels::{FurtherInputs, choice::LineSelection},
    comparison::{Comparison, TriedForm},
    coordinates::GridDensity,
    intersample::Intersample,
    line_fit::{LineFit, sort_by_simplicity},
    lines::LineData,
    low_noise::{LowNoiseFits, Starts},
    noise::{Autoregression, NoiseProducts, Penalty},
    options::{FamilyEstimator, HIGHEST_NOISE_ORDER},
    prediction::{NoiseOrders, PredictionProblem},
    prediction_fit::PredictionFit,
    result::FamilyFit,
    starts::Start,
};
use crate::{
    IdentError, InitialState,
    criterion::{Data, Workspace},
    frequency::{DescribingFunction, RecordDescriptionOptions, describe_runs},
    informative_data, progress,
};

/// Maximum number of pairs (nc, nd) that are compared if nc is searched.
const MAX_NOISE_PAIRS: usize = 60;

/// Reason why the lines are not used if there is little noise.
const LOW_NOISE_REASON: &str = "the noise is weaker than the leakage";

/// Prepared searches for all forms.
struct PreparedSearches<'a> {
    prediction: PredictionProblem<'a>,
    starts: Vec<Start>,
    noise: NoiseOrders,
    /// Comparison of the forms of each further input.
    channels: Vec<ChannelFit>,
    channel_lines: Option<Arc<ChannelLines>>,
    /// Further inputs with a response, in the forms selected at the lines.
    in_form: Vec<ChannelInForm>,
    /// Reason why the lines are not used.
    no_lines: Option<String>,
}

impl FamilyEstimator {
    /// Fits one model to all records.
    ///
    /// # Errors
    /// [`IdentError`] for invalid records or options, and if no form could be fitted. Findings against a result are not
    /// errors but part of the result ([`FamilyFit::verdict`]).
    pub fn fit(&self, records: &[Record]) -> Result<FamilyFit, IdentError> {
        let described = self.excitation.as_ref().map(|channel| {
            let options = RecordDescriptionOptions {
                excitation: Some(channel.clone()),
                period_s: self.period_s,
                ..RecordDescriptionOptions::default()
            };
            describe_runs(records, &options).map(|found| found.function)
        });
        self.fit_with_response(records, described)
    }

    /// Like [`FamilyEstimator::fit`], but with a given describing function or the reason why there is none. The
    /// describing function may, for example, come from other spans of the same runs, or include a time offset that is
    /// not a whole number of samples.
    ///
    /// # Errors
    /// Same as [`FamilyEstimator::fit`].
    pub fn fit_with_response(
        &self,
        records: &[Record],
        describing: Option<Result<DescribingFunction, IdentError>>,
    ) -> Result<FamilyFit, IdentError> {
        let own = self.with_nd_for(records);
        let (records, seen) = own.prepare_records(records)?;
        // With further inputs, the ratio of u to e at a line depends on several responses.
        let (describing, no_lines) = match describing.filter(|_| seen.is_empty()) {
            None => (None, None),
            Some(Ok(found)) => (Some(found), None),
            Some(Err(error)) => (None, Some(error.to_string())),
        };
        let mut workspace = Workspace::borrow_from_thread();
        let PreparedSearches {
            prediction,
            starts,
            noise,
            channels,
            channel_lines,
            in_form,
            no_lines: why,
        } = own.prepare_searches(&records, &seen, describing.as_ref(), &mut workspace)?;
        let no_lines = no_lines.or(why);
        let at_lines = (channel_lines.as_ref()).map(|lines| own.channel_line_fitter(lines, &prediction));
        let count = starts.len();
        let mut tried: Vec<TriedForm<'_>> = Vec::with_capacity(count);
        for start in starts {
            progress::report_step("forms", tried.len(), count);
            let fit = own.fit_from_starts(&prediction, &start, noise, &mut workspace);
            tried.push(TriedForm {
                form: start.form,
                lines: start.lines,
                fit,
            });
        }
        progress::report_step("forms", count, count);
        let Comparison { best, figures } = Comparison::of(&tried, &prediction, *own.nd().end(), &mut workspace);
        let Some(best) = best else {
            return Err(tried
                .into_iter()
                .find_map(|t| t.fit.err())
                .unwrap_or(IdentError::NoFiniteLoss));
        };
        let gains = tried.iter().filter_map(TriedForm::dc_gain).collect();
        let weight = figures[best].weight;
        let TriedForm { lines, fit, .. } = tried.remove(best);
        let weights = figures.iter().enumerate().filter(|(i, _)| *i != best);
        let others = tried.into_iter().zip(weights).filter(|(_, (_, f))| f.weight > 0.0);
        let others = others.map(|(tried, (_, figures))| {
            Ok(OtherForm {
                fit: tried.fit?,
                lines: tried.lines,
                weight: figures.weight,
            })
        });
        let chosen = ChosenForm {
            fit: fit?,
            weight,
            lines: LineResults {
                describing: describing.as_ref(),
                channels: at_lines,
                in_form,
                fit: lines,
                missing_reason: no_lines,
            },
            others: others.collect::<Result<_, IdentError>>()?,
            gains,
            forms: figures,
            prediction: &prediction,
            channels,
            records: &records,
            excitation: own.excitation.as_deref(),
            run_to_run: match prediction.noise_free_share() {
                None => own.run_to_run,
                Some(_) => 0.0,
            },
            highest_order: *own.nd().end(),
        };
        chosen.result(&mut workspace)
    }

    /// Tests whether u responds to a channel in addition to the error, with the forms of this estimator. Also returns
    /// whether the channel and another signal are excited at separate lines.
    ///
    /// # Errors
    /// Same as [`FamilyEstimator::fit`].
    pub fn test_response(&self, records: &[Record], channel: SeenChannel) -> Result<(ChannelFit, bool), IdentError> {
        let asked = [channel.clone()];
        let with_channel = Self {
            channels: vec![channel],
            ..self.with_nd_for(records)
        };
        let (records, seen) = with_channel.prepare_records(records)?;
        let mut workspace = Workspace::borrow_from_thread();
        let mut begun = with_channel.prepare_searches(&records, &seen, None, &mut workspace)?;
        let apart = have_separate_lines(begun.channel_lines.as_deref(), &asked);
        let found = begun.channels.pop().ok_or(IdentError::NoFiniteLoss)?;
        Ok((found, apart))
    }

    /// Returns the records with the trend of e and u removed, together with the further inputs.
    fn prepare_records(&self, records: &[Record]) -> Result<(Vec<Record>, FurtherInputs<'_>), IdentError> {
        informative_data::common_sample_time(records)?;
        let records: Vec<Record> = records.iter().map(|r| r.clone().detrended(self.detrend)).collect();
        let (records, seen) = FurtherInputs::of(records, &self.channels, self.detrend)?;
        seen.check(&records)?;
        Ok((records, seen))
    }

    /// Returns the data and settings common to all fits at the lines of several inputs.
    fn channel_line_fitter<'l>(
        &'l self,
        lines: &'l Arc<ChannelLines>,
        prediction: &PredictionProblem<'_>,
    ) -> ChannelLineFitter<'l> {
        ChannelLineFitter {
            lines,
            neuromuscular: self.neuromuscular,
            delay_range_s: prediction.delay_range_s,
            sampling: (prediction.sample_time, prediction.intersample),
            prior: &self.prior,
            search: &self.search,
        }
    }

    /// Prepares the searches for all forms: determines the starts, the orders of the noise model, and the further
    /// inputs with a response.
    fn prepare_searches<'a>(
        &self,
        records: &'a [Record],
        seen: &'a FurtherInputs<'_>,
        describing: Option<&DescribingFunction>,
        workspace: &mut Workspace,
    ) -> Result<PreparedSearches<'a>, IdentError> {
        let forms = self.sorted_forms()?;
        let mut prediction = self.prediction(self.intersample, records, &forms)?;
        if self.initial_state != InitialState::Zero && !seen.is_empty() {
            let sampling = (prediction.sample_time, prediction.intersample);
            let of_channels = seen.first_regressed_sample(self.neuromuscular, sampling) + self.nd().end();
            prediction.first = prediction.first.max(of_channels);
        }
        self.check(records, prediction.first)?;
        let lines = describing.map(LineData::new);
        let mut begun = Vec::new();
        let mut channel_lines = None;
        // The response of the ARX model is used only for starts; if its regression fails, the starts from the lines
        // suffice.
        let response = if seen.is_empty() {
            match ArxResponse::of(records) {
                Err(error) if lines.is_none() => return Err(error),
                found => found.map_or(Vec::new(), |found| found.points),
            }
        } else {
            let mut responses = seen.responses(records)?;
            let sampling = (prediction.sample_time, prediction.intersample);
            begun = seen.starting_forms(&responses, self.neuromuscular, sampling, &self.search)?;
            prediction.channels = begun.iter().filter_map(|forms| forms.first().cloned()).collect();
            let found = seen.lines(self.excitation.as_deref(), self.period_s);
            channel_lines = found
                .map(|lines| seen.weighted_lines(&self.channel_line_fitter(&lines, &prediction), &begun, &responses));
            responses.swap_remove(0)
        };
        let mut starts = Vec::new();
        for &form in &forms {
            starts.push(self.prepare_start(form, lines.as_ref(), &response, &prediction, workspace)?);
        }
        let (mut channels, mut in_form) = (Vec::new(), Vec::new());
        if let Some(lines) = &channel_lines {
            let at = self.channel_line_fitter(lines, &prediction);
            let LineSelection {
                fits: compared,
                channels: in_use,
                in_form: forms_in_use,
            } = seen.choose_at_lines(&at, &forms, std::mem::take(&mut begun))?;
            for start in &mut starts {
                let Some(found) = at.fit(start.form, &forms_in_use) else {
                    continue;
                };
                let criterion = at.criterion(start.form, &forms_in_use);
                let operator = criterion.operator(&found.coordinates)?;
                start.coordinates.insert(0, operator.coordinates().to_vec());
                start.lines = Some(LineFit::from_channels(operator, &found, criterion.penalty()));
            }
            (channels, prediction.channels, in_form) = (compared, in_use, forms_in_use);
        }
        let little_noise = match seen.is_empty() {
            true => self.low_noise_prediction(&prediction, records, &mut starts, workspace)?,
            false => None,
        };
        let mut no_lines = None;
        let noise = match little_noise {
            Some(found) => {
                // The lines are not used, because leakage and aliasing at the lines exceed so little noise.
                starts.iter_mut().for_each(|start| start.lines = None);
                no_lines = lines.map(|_| LOW_NOISE_REASON.to_owned());
                prediction = found;
                prediction
                    .noise_free_share()
                    .map(|_| (*self.nc.start(), *self.nd().start()))
            }
            None => None,
        };
        let noise = noise.map_or_else(|| self.noise_orders(&prediction, &starts, workspace), Ok)?;
        if !seen.is_empty() && channel_lines.is_none() {
            let least = self.form_with_smallest_residual(&prediction, &starts, noise.1, workspace)?;
            let form = (starts[least].form, self.neuromuscular);
            let from = starts[least].coordinates.as_slice();
            channels = seen.choose(&mut prediction, begun, (form, from), noise, workspace)?;
        }
        Ok(PreparedSearches {
            prediction,
            starts,
            noise,
            channels,
            channel_lines,
            in_form,
            no_lines,
        })
    }

    /// Returns starting values of the first form, for use by other estimators: an operator fitted to the response of a
    /// high-order ARX model, and an autoregression of the rest of u. The order of the autoregression is the best order
    /// up to `highest`. `None` if the records do not determine these values.
    pub(crate) fn first_guess(&self, records: &[Record], highest: usize) -> Option<(Vec<f64>, Autoregression)> {
        let form = *self.forms.first()?;
        let prediction = self.prediction(self.intersample, records, &[form]).ok()?;
        self.check(records, prediction.first).ok()?;
        let response = ArxResponse::of(records).ok()?.points;
        let workspace = &mut Workspace::borrow_from_thread();
        let start = self.prepare_start(form, None, &response, &prediction, workspace).ok()?;
        let coordinates = start.coordinates.into_iter().next()?;
        let operator = (form, self.neuromuscular);
        let series = prediction.unexplained_output(operator, &coordinates, workspace).ok()?;
        let products = NoiseProducts::new(&series, highest);
        let order = products.best_order(1..=highest, Penalty::Schwarz)?;
        Some((coordinates, products.fit(order)?))
    }

    fn sorted_forms(&self) -> Result<Vec<Form>, IdentError> {
        let mut forms: Vec<Form> = (self.forms.iter().copied())
            .filter(|form| form.is_proper(self.neuromuscular))
            .collect();
        sort_by_simplicity(&mut forms);
        forms.dedup();
        if forms.is_empty() {
            return Err(IdentError::BadOption {
                option: "the forms of the operator".to_owned(),
                found: self.forms.iter().map(|f| f.name()).collect::<Vec<_>>().join(", "),
                expected: "gain, lag or lead-lag, because a pure derivative needs neuromuscular dynamics".to_owned(),
            });
        }
        Ok(forms)
    }

    /// Returns the records and the settings common to all forms, for this intersample behaviour of the error.
    fn prediction<'a>(
        &self,
        intersample: Intersample,
        records: &'a [Record],
        forms: &[Form],
    ) -> Result<PredictionProblem<'a>, IdentError> {
        let sample_time = records[0].sample_time();
        let shortest = intersample.shortest_delay_s(sample_time);
        let (low, high) = self.delay_range_s;
        let delay_range_s = (low.max(shortest), high.max(shortest));
        let first = PredictionProblem::first_residual(
            &forms.iter().map(|form| (*form, self.neuromuscular)).collect::<Vec<_>>(),
            (*self.nc.end(), *self.nd().end()),
            delay_range_s,
            self.initial_state,
            (sample_time, intersample),
        )?;
        Ok(PredictionProblem {
            data: Data::of(records),
            channels: Vec::new(),
            sample_time,
            intersample,
            course_is_known: intersample != Intersample::Auto,
            other_intersample: Vec::new(),
            little_noise: None,
            initial: self.initial_state,
            first,
            delay_range_s,
            prior: self.prior.clone(),
            individual: self.individual.clone(),
            search: self.search,
        })
    }

    /// Returns the data and settings for records with little noise; `None` if there is more noise. Determines the
    /// intersample behaviour of the error from the records, adds a level if the mean was removed, and replaces the
    /// starts by the results of output error searches.
    fn low_noise_prediction<'a>(
        &self,
        smooth: &PredictionProblem<'_>,
        records: &'a [Record],
        starts: &mut [Start],
        workspace: &mut Workspace,
    ) -> Result<Option<PredictionProblem<'a>>, IdentError> {
        let forms: Vec<Form> = starts.iter().map(|start| start.form).collect();
        let with_level = |intersample| {
            let mut found = self.prediction(intersample, records, &forms)?;
            let level = self.detrend == Detrend::Mean;
            found.data.iter_mut().for_each(|d| d.level = level);
            Ok::<_, IdentError>(found)
        };
        let mut from: Vec<Starts> = starts.iter().map(|s| (s.form, s.coordinates.clone())).collect();
        let clean = ArxResponse::from_noise_free(records, self.delay_range_s.1);
        if let Some(clean) = &clean {
            for (form, coordinates) in &mut from {
                let criterion = self.response_criterion(*form, &clean.points, &self.prior, smooth);
                let found = criterion.minima(&self.search, GridDensity::Dense).into_iter().next();
                coordinates.push(found.ok_or(IdentError::NoFiniteLoss)?.coordinates);
            }
        }
        let mut search = |prediction: &PredictionProblem<'_>, from: &[Starts]| {
            LowNoiseFits::of(prediction, self.neuromuscular, from, clean.is_some(), workspace)
        };
        let mut prediction = with_level(smooth.intersample)?;
        let Some(mut found) = search(&prediction, &from) else {
            return Ok(None);
        };
        found.move_to_results(&mut from, 0.0);
        if self.intersample == Intersample::Auto {
            let held = with_level(Intersample::Zoh)?;
            if let Some(mut other) = search(&held, &from) {
                let (course, is_known) = LowNoiseFits::choose_intersample(&found, &other);
                match course {
                    Intersample::Auto => {}
                    Intersample::Zoh => {
                        std::mem::swap(&mut found, &mut other);
                        prediction = held;
                        found.move_to_results(&mut from, 0.0);
                    }
                    Intersample::Foh => {
                        prediction = with_level(course)?;
                        found.move_to_results(&mut from, 0.5 * smooth.sample_time.s());
                    }
                }
                prediction.course_is_known = is_known;
                if !is_known {
                    prediction.other_intersample = other.coordinates(&forms);
                }
            }
        }
        for (start, (_, coordinates)) in starts.iter_mut().zip(from) {
            start.coordinates = coordinates;
        }
        prediction.little_noise = Some(found.share);
        Ok(Some(prediction))
    }

    fn check(&self, records: &[Record], first: usize) -> Result<(), IdentError> {
        let refuse = |option: &str, found: String, expected: &str| {
            Err(IdentError::BadOption {
                option: option.to_owned(),
                found,
                expected: expected.to_owned(),
            })
        };
        let (low, high) = self.delay_range_s;
        if !(low >= 0.0 && low <= high && high.is_finite()) {
            return refuse("the delay in s", format!("{low}..{high}"), "LO..HI with 0 <= LO <= HI");
        }
        if !(self.run_to_run.is_finite() && self.run_to_run >= 0.0) {
            let found = self.run_to_run.to_string();
            return refuse(
                "the variation from run to run",
                found,
                "a nonnegative fraction of the gain",
            );
        }
        let most = HIGHEST_NOISE_ORDER;
        for (name, range) in [("nc", &self.nc), ("nd", &self.nd())] {
            if range.is_empty() || *range.end() > most {
                let found = format!("{}..{}", range.start(), range.end());
                return refuse(
                    &format!("the noise order {name}"),
                    found,
                    &format!("LO..HI within 0..{most}, LO <= HI"),
                );
            }
        }
        let pairs = self.nc.clone().count() * self.nd().count();
        if *self.nc.end() > 0 && pairs > MAX_NOISE_PAIRS {
            return refuse(
                "the noise orders",
                format!("{pairs} pairs of nc and nd"),
                "60 or fewer pairs if nc is searched: narrow nc or nd",
            );
        }
        let orders = hoid_model::Orders {
            nb: 4,
            nd: *self.nd().end(),
            nf: 3,
            nk: 1,
            ..hoid_model::Orders::default()
        };
        for record in records {
            informative_data::check_record(
                Structure::BoxJenkins,
                &orders,
                record,
                first + 2 * (*self.nd().end() + 10),
            )?;
        }
        Ok(())
    }

    /// Fits a form from all its starts by prediction error and returns the best fit.
    fn fit_from_starts<'a>(
        &self,
        prediction: &PredictionProblem<'a>,
        start: &Start,
        noise: NoiseOrders,
        workspace: &mut Workspace,
    ) -> Result<PredictionFit<'a>, IdentError> {
        let mut best: Option<PredictionFit<'a>> = None;
        let mut refusal = IdentError::NoFiniteLoss;
        for coordinates in &start.coordinates {
            let known = best.as_ref().map_or(f64::INFINITY, PredictionFit::objective);
            match prediction.fit_below(known, (start.form, self.neuromuscular), noise, coordinates, workspace) {
                Ok(Some(fit)) if fit.objective() < known => best = Some(fit),
                Ok(_) => {}
                Err(error) => refusal = error,
            }
        }
        best.ok_or(refusal)
    }
}
