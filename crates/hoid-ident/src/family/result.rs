//! Result of the estimation of a person's operator.

use std::f64::consts::{LN_10, PI};

use hoid_model::{
    ContinuousTransferFunction, FamilyOperator, Finding, Form, SampleTime, Verdict, operator_family::Coordinate,
    uncertainty::Estimate,
};

use super::{
    agreement::Agreement,
    channel::{ChannelFit, SeenChannel},
    choice::FormFigures,
    clusters::ClusterKind,
    deviation::ResponseDeviation,
    instrumental::InstrumentalFit,
    intersample::Intersample,
    known_response::KnownResponse,
    line_fit::LineFit,
    loop_shape::LoopShape,
    mixture::{Component, Mixture},
    open_loop::{LoopMeasures, loop_measures},
    parameter::Parameter,
    prior::OperatorPrior,
};
use crate::{Fit, ResponsePoint, Termination};

/// The operator of one record, or of all records.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct OperatorOfRecord {
    /// The operator in the best form.
    pub operator: FamilyOperator,
    /// Covariance of the coordinates by rows, from clusters and with the contribution of the prior. `None` if the
    /// information matrix is singular.
    pub covariance: Option<Vec<f64>>,
    /// Model-based covariance of the coordinates by rows, valid for white residuals and a person who does not vary.
    pub model_based: Option<Vec<f64>>,
    /// Parameters of the operator, averaged over the forms that the data do not reject ([`FamilyFit::weighed`]).
    pub parameters: Vec<Parameter>,
    /// The same model in polynomial form, for prediction and simulation.
    pub polynomial_fit: Fit,
}

/// A form that the data do not reject, with its weight and its operators.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct WeighedForm {
    /// The form.
    pub form: Form,
    /// Weight of the form; the weights of all forms sum to one.
    pub weight: f64,
    /// Operators in this form: one for all records, or one for each record.
    pub operators: Vec<OperatorInForm>,
}

/// The operator of a record in one form, without averaging.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct OperatorInForm {
    /// The operator.
    pub operator: FamilyOperator,
    /// Covariance of the coordinates by rows.
    pub covariance: Option<Vec<f64>>,
    /// Parameters of the operator.
    pub parameters: Vec<Parameter>,
    /// Deviation of the response from the form; `None` if the form fits the lines, or without lines.
    #[serde(default)]
    pub deviation: Option<ResponseDeviation>,
}

/// Test of the form against a Box-Jenkins model of the same orders.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct FreeModel {
    /// Loss of a Box-Jenkins model with the orders and the delay of the fit.
    pub loss: f64,
    /// Likelihood ratio `n ln(V/V_bj)/kappa`, based on the inflated variance.
    pub likelihood_ratio: f64,
    /// Number of parameters that the Box-Jenkins model has in addition.
    pub degrees_of_freedom: usize,
    /// Probability of a likelihood ratio at least as large if the form is right.
    pub p_value: f64,
}

/// Result of [`super::FamilyEstimator::fit`].
#[derive(Debug, Clone, serde::Serialize, serde::Deserialize)]
pub struct FamilyFit {
    /// The best form, or the given one.
    pub form: Form,
    /// True if the operator has a neuromuscular part.
    pub neuromuscular: bool,
    /// Orders nc and nd of the noise model.
    pub noise_orders: (usize, usize),
    /// Coefficients c and d of the noise model `v = (C/D) eps`.
    pub noise: (Vec<f64>, Vec<f64>),
    /// Estimated operators: one for all records, or one for each record if some parameters are individual.
    pub operators: Vec<OperatorOfRecord>,
    /// Prior knowledge that was used.
    pub prior: OperatorPrior,
    /// Criteria of the forms that were compared, simplest form first.
    pub forms: Vec<FormFigures>,
    /// The forms that the data do not reject, best form first; estimates are averaged over these forms.
    pub weighed: Vec<WeighedForm>,
    /// Results of the further inputs, in the order in which they were requested.
    #[serde(default)]
    pub channels: Vec<ChannelFit>,
    /// Relative standard deviation of the mean gain of these runs that their scatter does not show. Zero if the errors
    /// are computed from the scatter between runs, which includes the person's variation from run to run.
    pub run_to_run: f64,
    /// Fit of the best form at the lines of the excitation.
    pub lines: Option<LineFit>,
    /// Reason why there is no fit at the lines.
    pub no_lines: Option<String>,
    /// Operator of the best form by refined instrumental variables, if an excitation was recorded.
    pub instrumental: Option<InstrumentalFit>,
    /// Reason why there is no operator by instrumental variables.
    pub no_instrumental: Option<String>,
    /// Comparison of the estimation methods.
    pub agreement: Option<Agreement>,
    /// Test against a Box-Jenkins model of the same orders.
    pub free_model: Option<FreeModel>,
    /// Type of the clusters from which the error bars are computed.
    pub cluster_kind: ClusterKind,
    /// Number of clusters.
    pub clusters: usize,
    /// Inflation kappa: ratio of the variances from clusters to the model-based variances.
    pub inflation: f64,
    /// Largest ratio of a standard error from clusters to a model-based standard error.
    pub error_ratio: Option<f64>,
    /// Loss `V = sum eps^2/n`.
    pub loss: f64,
    /// Unbiased innovation variance.
    pub innovation_variance: f64,
    /// Number n of residuals.
    pub residuals: usize,
    /// Mean squared coherence at the lines: the fraction of the power of u that the excitation explains there.
    pub coherent_share: Option<f64>,
    /// Termination of the search.
    pub termination: Termination,
    /// Intersample behaviour of the error that the fit assumes.
    #[serde(default)]
    pub intersample: Intersample,
    /// True if the intersample behaviour was given or determined from the data. Otherwise the delay may be half a
    /// sample longer ([`FamilyFit::delay_if_linear_s`]).
    #[serde(default)]
    pub course_is_known: bool,
    /// Time in s by which e was advanced when the sampling frequency was lowered, because the new hold is longer than
    /// the hold of the recording.
    #[serde(default)]
    pub lead_s: f64,
    /// Power of the residual relative to the power of u if the residual is not noise; `None` if there is noise.
    #[serde(default)]
    pub noise_free: Option<f64>,
    /// True if there is so little noise that errors of the model would exceed the noise.
    #[serde(default)]
    pub little_noise: bool,
    /// Sample time of the records.
    pub sample_time: SampleTime,
    /// Verdict on the result.
    pub verdict: Verdict,
}

/// Formats an operator and its noise model as one line of text.
pub(super) fn title(form: Form, neuromuscular: bool, (nc, nd): (usize, usize)) -> String {
    let muscles = if neuromuscular {
        " with neuromuscular dynamics"
    } else {
        ""
    };
    format!("Operator: {form}{muscles}; noise nc = {nc}, nd = {nd}")
}

impl FamilyFit {
    /// Returns the form and the noise model as one line of text, equal to [`Fit::title`] of the polynomial form.
    pub fn title(&self) -> String {
        title(self.form, self.neuromuscular, self.noise_orders)
    }

    /// Returns the channels with a response, each in the form that was selected.
    pub fn channels_in_use(&self) -> Vec<SeenChannel> {
        let of = |channel: &ChannelFit| {
            Some(SeenChannel {
                name: channel.name.clone(),
                role: channel.role,
                preview_s: channel.preview_s,
                forms: vec![channel.response.as_ref()?.operator.form()],
            })
        };
        self.channels.iter().filter_map(of).collect()
    }

    /// Returns the operator of a record; for an index beyond the last operator, the last operator.
    pub fn operator(&self, record: usize) -> &OperatorOfRecord {
        &self.operators[record.min(self.operators.len() - 1)]
    }

    /// Returns the crossover frequency and the phase margin of the operator of a record with a controlled element,
    /// averaged over the forms. `None` if the loop has no crossover in the best form.
    pub fn loop_measures(&self, record: usize, element: &ContinuousTransferFunction) -> Option<LoopMeasures> {
        let each = self.weighed.iter().map(|form| {
            let of = form.of(record)?;
            Some((form.weight, self.measures_of_form(of, element)?))
        });
        let each: Vec<Option<(f64, LoopMeasures)>> = each.collect();
        each.first()?.as_ref()?;
        LoopMeasures::average(&each.into_iter().flatten().collect::<Vec<_>>(), self.clusters)
    }

    /// Like [`Self::loop_measures`], for the best form only.
    pub fn loop_measures_of_best_form(
        &self,
        record: usize,
        element: &ContinuousTransferFunction,
    ) -> Option<LoopMeasures> {
        self.measures_of_form(self.weighed.first()?.of(record)?, element)
    }

    /// Returns the delay tau_e in s of a record for an error that is linear between samples, logged from a continuous
    /// signal or one with a higher sampling frequency; this delay is half a sample longer. `None` if the intersample
    /// behaviour is known.
    pub fn delay_if_linear_s(&self, record: usize) -> Option<f64> {
        let of = self.operator(record);
        let averaged = of.parameters.iter().find(|p| p.name == Coordinate::Delay.parameter());
        let tau = averaged.map_or_else(|| of.operator.tau_e_s(), |tau| tau.value);
        (!self.course_is_known).then(|| tau + 0.5 * self.sample_time.s() - self.lead_s)
    }

    /// Returns the gain and phase of the response from e to u of the operator of a record, at frequencies in rad/s,
    /// including the intersample behaviour of the error. The result is the mean of `ln H` over the forms, and its error
    /// includes the differences between the forms.
    pub fn frequency_response(&self, record: usize, omega_rad_s: &[f64]) -> Vec<ResponsePoint> {
        let front = &self.operator(record).operator;
        let point = |&omega: &f64| {
            let held = front.response(omega) * self.intersample.response(omega, self.sample_time);
            // For each form: ln of its response relative to the response of the best form, with the variances of gain
            // and phase.
            let of = |form: &WeighedForm| {
                let of = form.of(record)?;
                let found = self.known_response(of, omega);
                let off = (found.value / held).ln();
                Some((form.weight, [off.re, off.im], found.relative))
            };
            let all: Vec<_> = self.weighed.iter().filter_map(of).collect();
            let along = |part: usize| {
                let component = |&(weight, off, relative): &(f64, [f64; 2], Option<[[f64; 2]; 2]>)| Component {
                    weight,
                    estimate: Estimate {
                        value: off[part],
                        standard_error: relative.map(|c| c[part][part].max(0.0).sqrt()),
                    },
                    interval: None,
                };
                let mixture = Mixture::of(&all.iter().map(component).collect::<Vec<_>>(), self.clusters);
                mixture.map_or(Estimate::fixed(0.0), |mixture| mixture.estimate)
            };
            let scaled = |from: f64, unit: f64, e: Estimate| Estimate {
                value: from + unit * e.value,
                standard_error: e.standard_error.map(|s| unit * s),
            };
            ResponsePoint {
                omega_rad_s: omega,
                magnitude_db: scaled(20.0 * held.norm().log10(), 20.0 / LN_10, along(0)),
                phase_deg: scaled(held.arg().to_degrees(), 180.0 / PI, along(1)),
            }
        };
        omega_rad_s.iter().map(point).collect()
    }

    /// Returns evidence against the operator from the loop of a record with a controlled element; `None` if there is no
    /// such evidence. A record that remains bounded must come from a stable loop, which has a crossover and a positive
    /// phase margin, and a person's phase margin is at most 120 deg.
    pub fn loop_finding(&self, record: usize, element: &ContinuousTransferFunction) -> Option<Finding> {
        let reach = (self.loop_measures_of_best_form(record, element))
            .and_then(|found| found.phase_margin_interval)
            .map_or(0.0, |(low, high)| 0.5 * (high - low));
        self.loop_shape(record, element).finding(reach)
    }

    /// Returns all crossings and the stability of the loop of a record with a controlled element, for the best form.
    pub fn loop_shape(&self, record: usize, element: &ContinuousTransferFunction) -> LoopShape {
        let of = self.operator(record);
        let deviation = self
            .weighed
            .first()
            .and_then(|best| best.of(record)?.deviation.as_ref());
        let known = |omega: f64| {
            let sampling = (self.sample_time, self.intersample);
            KnownResponse::of(&of.operator, (of.covariance.as_deref(), deviation), sampling, omega)
        };
        LoopShape::of(known, element, self.sample_time)
    }

    /// Returns the crossover frequency and the phase margin of the operator fitted at the lines; `None` without such a
    /// fit or without a crossover.
    pub fn loop_measures_at_lines(&self, element: &ContinuousTransferFunction) -> Option<LoopMeasures> {
        let lines = self.lines.as_ref()?;
        self.measures_of_operator(&lines.operator, lines.covariance.as_deref(), element)
    }

    /// Returns the crossover frequency and the phase margin of the operator estimated by refined instrumental
    /// variables; `None` without this operator or without a crossover.
    pub fn loop_measures_by_instruments(&self, element: &ContinuousTransferFunction) -> Option<LoopMeasures> {
        let found = self.instrumental.as_ref()?;
        self.measures_of_operator(&found.operator, found.covariance.as_deref(), element)
    }

    fn measures_of_operator(
        &self,
        operator: &FamilyOperator,
        covariance: Option<&[f64]>,
        element: &ContinuousTransferFunction,
    ) -> Option<LoopMeasures> {
        let measures = loop_measures(operator, covariance, element, (self.sample_time, self.intersample))?;
        Some(self.with_errors_of_runs(measures))
    }

    fn measures_of_form(&self, of: &OperatorInForm, element: &ContinuousTransferFunction) -> Option<LoopMeasures> {
        let measures = LoopMeasures::of_response(|omega| self.known_response(of, omega), element, self.sample_time)?;
        Some(self.with_errors_of_runs(measures))
    }

    /// Returns the sampled response in one form, with the deviation of the person from this form.
    fn known_response(&self, of: &OperatorInForm, omega_rad_s: f64) -> KnownResponse {
        let known = (of.covariance.as_deref(), of.deviation.as_ref());
        KnownResponse::of(&of.operator, known, (self.sample_time, self.intersample), omega_rad_s)
    }

    fn with_errors_of_runs(&self, measures: LoopMeasures) -> LoopMeasures {
        measures
            .with_student_intervals(self.clusters)
            .with_run_to_run(self.run_to_run)
    }

    /// Returns a coordinate of the operator of a record, with its standard error; `None` if the form does not have the
    /// coordinate.
    pub fn coordinate(&self, record: usize, wanted: Coordinate) -> Option<Estimate> {
        let of = self.operator(record);
        let all = self.form.coordinates(self.neuromuscular);
        let i = all.iter().position(|c| *c == wanted)?;
        let x = of.operator.coordinates();
        Some(match &of.covariance {
            Some(c) => Estimate::with_variance(x[i], c[i * x.len() + i]),
            None => Estimate::fixed(x[i]),
        })
    }
}

impl WeighedForm {
    /// Returns the operator of a record; for an index beyond the last operator, the last operator.
    pub fn of(&self, record: usize) -> Option<&OperatorInForm> {
        self.operators.get(record).or(self.operators.last())
    }
}

#[cfg(test)]
mod tests {
    use hoid_model::{
        ContinuousTransferFunction, FamilyOperator, Form,
        scenario::{Condition, Scenario},
    };
    use hoid_sim::{RunSeed, Simulator};

    use crate::family::{FamilyEstimator, loop_measures};

    /// A person with a lead is fitted by a gain: the response, the crossover and the phase margin follow the lines
    /// within their errors.
    #[test]
    fn response_follows_the_lines_if_the_form_is_wrong() {
        let simulator = Simulator::new(&Scenario::condition(Condition::C1)).unwrap();
        let run = |replication| {
            simulator
                .run(
                    RunSeed {
                        replication,
                        ..RunSeed::default()
                    },
                    false,
                )
                .unwrap()
        };
        let estimator = FamilyEstimator {
            forms: vec![Form::Gain],
            excitation: Some("f_t".to_owned()),
            ..FamilyEstimator::default()
        };
        let fit = estimator.fit(&(0..6).map(run).collect::<Vec<_>>()).unwrap();
        let truth = FamilyOperator::new(Form::Lead, true, &[0.09, 0.4, 11.25_f64.ln(), 0.35_f64.ln(), 0.28]).unwrap();
        let element = ContinuousTransferFunction::new(&[90.0], &[1.0, 6.0, 0.0]).unwrap();
        let sampling = (fit.sample_time, fit.intersample);
        let off = |measures: crate::family::LoopMeasures| {
            let exact = loop_measures(&truth, None, &element, sampling).unwrap();
            let errors = |own: hoid_model::uncertainty::Estimate, exact: f64| {
                (own.value - exact).abs() / own.standard_error.unwrap()
            };
            errors(measures.crossover_rad_s, exact.crossover_rad_s.value)
                .max(errors(measures.phase_margin_deg, exact.phase_margin_deg.value))
        };
        let own = fit.operator(0);
        let by_form = off(loop_measures(&own.operator, own.covariance.as_deref(), &element, sampling).unwrap());
        let found = off(fit.loop_measures(0, &element).unwrap());
        assert!(by_form > 4.0 && found < 2.0, "{by_form} {found}");
        let deviation = fit.weighed[0].operators[0].deviation.as_ref().unwrap();
        assert!(deviation.size() > 0.1, "{}", deviation.size());
        for point in fit.frequency_response(0, &[1.0, 2.5, 4.0]) {
            let exact =
                truth.response(point.omega_rad_s) * fit.intersample.response(point.omega_rad_s, fit.sample_time);
            let off =
                (point.magnitude_db.value - 20.0 * exact.norm().log10()) / point.magnitude_db.standard_error.unwrap();
            assert!(off.abs() < 3.0, "{point:?} {off}");
        }
    }

    #[test]
    fn polynomial_fit_has_the_title_of_the_operator_fit() {
        let simulator = Simulator::new(&Scenario::condition(Condition::C1)).unwrap();
        let record = simulator.run(RunSeed::default(), false).unwrap();
        let estimator = FamilyEstimator {
            forms: vec![Form::Lead],
            nd: Some(1..=1),
            ..FamilyEstimator::default()
        };
        let fit = estimator.fit(&[record]).unwrap();
        assert_eq!(
            fit.title(),
            "Operator: lead with neuromuscular dynamics; noise nc = 0, nd = 1"
        );
        assert_eq!(fit.operator(0).polynomial_fit.title(), fit.title());
    }
}
