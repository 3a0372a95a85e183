//! Polynomial structures, fitted by the prediction-error method or by instrumental variables; orders and delay are
//! given or searched.

use hoid_ident::{
    Choice, Estimator, Fit, IdentError, InitialState, InstrumentalVariable, Instruments, IvMethod, Loss, SearchOptions,
    diagnostics::second_opinion,
    order_selection::{OrderRanges, default_operator_ranges, fit_or_choose},
    progress,
    settings::MethodSpec,
};
use hoid_model::{
    ContinuousTransferFunction, FaultHandling, Orders, SampleTime, Structure, Verdict, VerdictLevel, theta_from_start,
};

use super::{
    BatchEstimator, FittedModel,
    polynomial_options::{self, Polynomials},
    registry_settings,
};
use crate::{
    AnalysisError,
    answers::{AnswerStatus, Answers, operator_answers},
    identification::Identification,
    level::Level,
    names::PEM,
    options::{self, AnalysisOption},
    quality::SystemKind,
    recordings::Recordings,
    repair::is_multilevel_input,
    settings::Setting,
};

/// A polynomial model, and the table of candidates if orders were searched.
#[derive(Debug, Clone, serde::Serialize, serde::Deserialize)]
pub struct PolynomialFit {
    /// The fitted model.
    pub fit: Fit,
    /// The table of candidates.
    pub choice: Option<Choice>,
}

impl Answers for PolynomialFit {
    fn answers(&self, _record: usize, element: Option<&ContinuousTransferFunction>) -> Vec<AnswerStatus> {
        operator_answers(&self.fit, element)
    }
}

impl Polynomials {
    /// Returns the ranges in which orders and delay are searched, for a sample time.
    ///
    /// # Errors
    /// [`AnalysisError`] if the structure does not have an order, or if there are too many combinations.
    pub fn ranges(&self, sample_time: SampleTime) -> Result<OrderRanges, AnalysisError> {
        let mut orders = self.orders.clone();
        if let Some((low, high)) = self.delay_s {
            if orders.contains_key("nk") {
                return Err(AnalysisError::Options {
                    reason: "nk and delay are the same quantity in samples and in s; give only one of them".to_owned(),
                });
            }
            if !(0.0 <= low && low <= high && high.is_finite()) {
                return Err(AnalysisError::Options {
                    reason: format!("delay is {low} to {high} s; expected 0 s or more, with the shorter delay first"),
                });
            }
            orders.insert("nk".to_owned(), sample_time.nk(low)..=sample_time.nk(high));
        }
        let options = |error: hoid_ident::IdentError| AnalysisError::Options {
            reason: error.to_string(),
        };
        let default = default_operator_ranges(self.template.structure, sample_time);
        let ranges = default.with_named_orders(&orders).map_err(options)?;
        ranges.candidate_count().map_err(options)?;
        Ok(ranges)
    }

    fn estimator(&self, combinations: &[Orders]) -> Result<Estimator, AnalysisError> {
        let refuse = |reason: String| AnalysisError::Options { reason };
        let start = match (&self.start, combinations) {
            (None, _) => None,
            (Some(start), [orders]) => Some(
                theta_from_start(&orders.parameter_names(), start)
                    .map_err(|reason| refuse(format!("--start {reason}")))?,
            ),
            (Some(_), _) => {
                return Err(refuse(
                    "--start applies to a single model, but a range of orders or delays is searched; give --nk and \
                     --orders as single numbers"
                        .to_owned(),
                ));
            }
        };
        Ok(Estimator {
            orders: combinations[0],
            start,
            ..self.template.clone()
        })
    }
}

impl BatchEstimator for Polynomials {
    type Fit = PolynomialFit;
    const OF: SystemKind = SystemKind::System;

    fn specs() -> Vec<MethodSpec> {
        let [of_prediction, of_instruments] = polynomial_options::method_option_names();
        let all = registry_settings(Self::options_of_analysis());
        let without = |others: &[&str]| {
            let own = all.iter().filter(|setting| !others.contains(&setting.name));
            own.cloned().collect()
        };
        let pem = MethodSpec {
            name: PEM,
            help: "polynomials by the prediction error method",
            source: "Ljung 1999, chapters 7 and 10; the thesis, section III",
            structures: &Structure::ALL,
            settings: without(&of_instruments),
        };
        let instrumental = IvMethod::ALL.map(|method| MethodSpec {
            name: method.name(),
            help: method.help(),
            source: method.source(),
            structures: method.structures(),
            settings: without(&of_prediction),
        });
        [pem].into_iter().chain(instrumental).collect()
    }

    fn options_of_analysis() -> Vec<AnalysisOption<Self>> {
        let mut all = options::estimator_options();
        all.extend([options::controlled_element_option(), options::answers_option()]);
        all
    }

    fn counts_samples(&self) -> bool {
        true
    }

    fn search(&self) -> &SearchOptions {
        &self.template.search
    }

    fn initial_state(&self) -> &'static str {
        self.template.initial_state.map_or("auto", InitialState::name)
    }

    fn with_defaults(&self) -> Self {
        Self::new(self.template.structure)
    }

    fn structure(&self) -> Setting {
        // The default estimator is not a polynomial structure, so the user must have requested this structure.
        Setting::new("structure", self.template.structure.name()).with_given(true)
    }

    fn fit(with: &Identification<Self>, data: &mut Recordings) -> Result<FittedModel<PolynomialFit>, AnalysisError> {
        let how = &with.estimator;
        let mut level = Level::remove(data, how.template.structure.has_input(), with.faults);
        let records = &data.records;
        let sample_time = records[0].sample_time();
        let ranges = how.ranges(sample_time)?;
        let combinations = ranges.combinations()?;
        // Instrumental-variable methods use data without means and estimate no level.
        let mut estimator = Estimator {
            level: !level.is_kept() && how.method.is_none(),
            ..how.estimator(&combinations)?
        };
        let used = with.settings(sample_time);
        let mut found = Vec::new();
        let told = progress::counter("candidates", combinations.len());
        let search = |estimator: &Estimator| fit_or_choose(estimator, &ranges, how.criterion, records, &told);
        let (mut fit, choice) = match search(&estimator) {
            // If a regressor cannot be distinguished from a level, such as a constant e, the means are removed and no
            // level is estimated.
            Err(IdentError::SingularRegressors { .. }) if estimator.level => {
                estimator.level = false;
                search(&estimator)?
            }
            other => other?,
        };
        if let Some(method) = how.method {
            let instruments = how
                .instruments
                .clone()
                .unwrap_or_else(|| Instruments::default_for(records));
            found.push(Setting::new("method", format!("{method}, {instruments}")).with_given(true));
            if choice.is_some() {
                found.push(Setting::new("orders chosen by", "the prediction error method"));
            }
            let instrumental = InstrumentalVariable {
                instruments,
                max_iterations: estimator.search.max_iterations,
                ..InstrumentalVariable::new(method, fit.orders())
            };
            fit = instrumental.fit(records)?;
        }
        if estimator.level {
            level.remove_remaining_level(data, |record| fit.constant_part(record))?;
        }
        let records = &data.records;
        let mut verdict = fit.verdict(records, choice.as_ref())?;
        let steps = records.iter().all(is_multilevel_input);
        if steps {
            // A step test has information only after its steps, so a finding on the influence of one stretch does not
            // apply.
            let others = verdict.findings().iter().filter(|finding| finding.kind != "stretch");
            verdict = Verdict::of(others.cloned().collect());
        }
        // The second fit uses the prediction-error method with a squared loss; for other methods and losses it is not
        // made.
        let is_asked_again =
            how.method.is_none() && estimator.loss == Loss::Quadratic && !steps && fit.rounding_error_share().is_none();
        if with.faults != FaultHandling::Keep && is_asked_again {
            let element = with.controlled_element.as_ref();
            verdict = verdict.append(second_opinion::polynomial_findings(&estimator, &fit, records, element));
            // If no level was estimated, the effect of a level on the result is checked.
            if level.is_kept() && !data.were_detrended() {
                verdict = verdict.append(second_opinion::level_finding(&estimator, &fit, records));
            }
        }
        // The direct estimate of the operator takes longer than most polynomials, and a fit that is already in doubt does
        // not need it.
        let is_believed = verdict.level == VerdictLevel::Trustworthy && fit.rounding_error_share().is_none();
        if with.faults != FaultHandling::Keep && !steps && is_believed {
            verdict = verdict.append(second_opinion::operator_finding(&fit, records));
        }
        found.extend(level.report(data, |_, record| fit.level(record)));
        Ok(FittedModel {
            fit: PolynomialFit { fit, choice },
            verdict,
            described: None,
            removed_trend: level.detrend(),
            settings: used,
            found,
        })
    }
}
