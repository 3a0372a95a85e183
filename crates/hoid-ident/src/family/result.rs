//! Result of a fit of the family.

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
    instrumental::InstrumentalFit,
    intersample::Intersample,
    line_fit::LineFit,
    loop_shape::{KnownResponse, LoopShape},
    mixture::{Component, Mixture},
    open_loop::{LoopMeasures, loop_measures},
    parameter::Parameter,
    prior::OperatorPrior,
};
use crate::{Fit, ResponsePoint, Termination};

/// An operator of one or several records.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct OperatorOfRecord {
    /// The operator.
    pub operator: FamilyOperator,
    /// Covariance of its coordinates by rows: clustered, with the part of the prior. `None` if the
    /// information is singular.
    pub covariance: Option<Vec<f64>>,
    /// The same from the model alone, as if residuals were white and nothing varied.
    pub model_based: Option<Vec<f64>>,
    /// Its parameters, averaged over the forms that the data leave ([`FamilyFit::weighed`]).
    pub parameters: Vec<Parameter>,
    /// The same model as polynomials, for prediction and simulation.
    pub polynomial_fit: Fit,
}

/// A form that the data leave, with its weight and its operators.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct WeighedForm {
    /// The form.
    pub form: Form,
    /// Its weight; those of all forms make one.
    pub weight: f64,
    /// One for all records, or one for each.
    pub operators: Vec<OperatorInForm>,
}

/// The operator of a record in one of the forms, by this form alone.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct OperatorInForm {
    /// The operator.
    pub operator: FamilyOperator,
    /// Covariance of its coordinates by rows.
    pub covariance: Option<Vec<f64>>,
    /// Its parameters.
    pub parameters: Vec<Parameter>,
}

/// Whether the form can be distinguished from a Box-Jenkins model of the same orders.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct FreeModel {
    /// Loss of Box-Jenkins with the orders and the delay of the fit.
    pub loss: f64,
    /// `n ln(V/V_bj)/kappa`: the likelihood ratio, in units of the inflated variance.
    pub likelihood_ratio: f64,
    /// Parameters that Box-Jenkins has more.
    pub degrees_of_freedom: usize,
    /// Probability of a ratio as large where the form is right.
    pub p_value: f64,
}

/// The result of [`super::FamilyEstimator::fit`].
#[derive(Debug, Clone, serde::Serialize, serde::Deserialize)]
pub struct FamilyFit {
    /// The form in front, or the one that was given.
    pub form: Form,
    /// True with the neuromuscular part.
    pub neuromuscular: bool,
    /// Orders nc and nd of the noise model.
    pub noise_orders: (usize, usize),
    /// Coefficients c and d of the noise model `v = (C/D) eps`.
    pub noise: (Vec<f64>, Vec<f64>),
    /// The operator: one for all records, or one for each where some parameters are individual.
    pub operators: Vec<OperatorOfRecord>,
    /// The prior.
    pub prior: OperatorPrior,
    /// The forms that were compared, simplest first.
    pub forms: Vec<FormFigures>,
    /// Those that the data leave, over which estimates are averaged: the one in front first.
    pub weighed: Vec<WeighedForm>,
    /// Results of the channels in addition to the error, in the order in which they were requested.
    #[serde(default)]
    pub channels: Vec<ChannelFit>,
    /// Variation of the gain of the person beyond these runs, as a part of it: standard deviation of their mean. Zero
    /// where errors are those of the scatter between runs, which hold it.
    pub run_to_run: f64,
    /// The fit at the lines of the excitation, of the same form.
    pub lines: Option<LineFit>,
    /// Why there is none.
    pub no_lines: Option<String>,
    /// The operator of the same form by refined instrumental variables, where an excitation was
    /// recorded.
    pub instrumental: Option<InstrumentalFit>,
    /// Why there is none.
    pub no_instrumental: Option<String>,
    /// The methods next to each other.
    pub agreement: Option<Agreement>,
    /// Box-Jenkins of the same orders.
    pub free_model: Option<FreeModel>,
    /// Clusters of the error bars.
    pub cluster_kind: ClusterKind,
    /// How many clusters.
    pub clusters: usize,
    /// kappa: clustered over model-based variances.
    pub inflation: f64,
    /// Largest ratio of a clustered to a model-based standard error.
    pub error_ratio: Option<f64>,
    /// Loss `V = sum eps^2/n`.
    pub loss: f64,
    /// Unbiased innovation variance.
    pub innovation_variance: f64,
    /// Number n of residuals.
    pub residuals: usize,
    /// Part of the power of u at the lines that the excitation explains: mean squared coherence.
    pub coherent_share: Option<f64>,
    /// How the search ended.
    pub termination: Termination,
    /// Intersample behaviour of the error, as it was fitted.
    #[serde(default)]
    pub intersample: Intersample,
    /// Whether the data show that, or it was reported; else the delay may be half a sample longer
    /// ([`FamilyFit::delay_if_straight_s`]).
    #[serde(default)]
    pub course_is_known: bool,
    /// Amount by which e was moved when its rate was lowered, for a hold that is longer than the recorded one, s.
    #[serde(default)]
    pub lead_s: f64,
    /// Share of the power of u that the operator leaves, where that is not noise.
    #[serde(default)]
    pub noise_free: Option<f64>,
    /// Whether there is so little noise that errors of the model would exceed it.
    #[serde(default)]
    pub little_noise: bool,
    /// Time between two samples.
    pub sample_time: SampleTime,
    /// Verdict on the result.
    pub verdict: Verdict,
}

/// An operator with its noise model, in a line.
pub(super) fn title(form: Form, neuromuscular: bool, (nc, nd): (usize, usize)) -> String {
    let muscles = if neuromuscular {
        " with neuromuscular dynamics"
    } else {
        ""
    };
    format!("Operator: {form}{muscles}; noise nc = {nc}, nd = {nd}")
}

impl FamilyFit {
    /// Form and noise model in a line; [`Fit::title`] of its polynomials states the same.
    pub fn title(&self) -> String {
        title(self.form, self.neuromuscular, self.noise_orders)
    }

    /// The channels with a response, each in the form that was found.
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

    /// The operator of a record; of records beyond them, the last.
    pub fn operator(&self, record: usize) -> &OperatorOfRecord {
        &self.operators[record.min(self.operators.len() - 1)]
    }

    /// Crossover frequency and phase margin of a record with a controlled element, averaged over the forms; `None` if
    /// the loop of the best form has no crossover.
    pub fn loop_measures(&self, record: usize, element: &ContinuousTransferFunction) -> Option<LoopMeasures> {
        let each = self.weighed.iter().map(|form| {
            let of = form.of(record)?;
            let found = self.measured(&of.operator, of.covariance.as_deref(), element)?;
            Some((form.weight, found))
        });
        let each: Vec<Option<(f64, LoopMeasures)>> = each.collect();
        each.first()?.as_ref()?;
        LoopMeasures::averaged(&each.into_iter().flatten().collect::<Vec<_>>(), self.clusters)
    }

    /// The same by the best form alone.
    pub fn loop_measures_in_front(&self, record: usize, element: &ContinuousTransferFunction) -> Option<LoopMeasures> {
        let of = self.operator(record);
        self.measured(&of.operator, of.covariance.as_deref(), element)
    }

    /// Delay tau_e in s of a record if its error runs straight from sample to sample, logged from what is faster or
    /// continuous: half a sample longer, as it was recorded, where nothing shows or reports what it does.
    pub fn delay_if_straight_s(&self, record: usize) -> Option<f64> {
        let of = self.operator(record);
        let averaged = of.parameters.iter().find(|p| p.name == Coordinate::Delay.parameter());
        let tau = averaged.map_or_else(|| of.operator.tau_e_s(), |tau| tau.value);
        (!self.course_is_known).then(|| tau + 0.5 * self.sample_time.s() - self.lead_s)
    }

    /// Gain and phase of the operator of a record from e to u at frequencies in rad/s, held over a sample,
    /// averaged over the forms: of `ln H` the mean, and its error with what the forms differ by.
    pub fn frequency_response(&self, record: usize, omega_rad_s: &[f64]) -> Vec<ResponsePoint> {
        let front = &self.operator(record).operator;
        let point = |&omega: &f64| {
            let middle = front.response(omega);
            // For each form ln of its response over that of the best form, with variances of gain and phase.
            let of = |form: &WeighedForm| {
                let of = form.of(record)?;
                let found = of.operator.response_and_gradient(omega);
                let relative = of.covariance.as_deref().map(|c| found.relative_covariance(c));
                let off = (found.value / middle).ln();
                Some((form.weight, [off.re, off.im], relative))
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
            let held = middle * self.intersample.response(omega, self.sample_time);
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

    /// Finding from the loop of a record with a controlled element: a record that stays bounded was made in a stable
    /// loop, which has a crossover and no phase margin below zero, and a person's has none above 120 deg. `None` if
    /// nothing is against it.
    pub fn loop_finding(&self, record: usize, element: &ContinuousTransferFunction) -> Option<Finding> {
        let reach = (self.loop_measures_in_front(record, element))
            .and_then(|found| found.phase_margin_interval)
            .map_or(0.0, |(low, high)| 0.5 * (high - low));
        self.loop_shape(record, element).doubt(reach)
    }

    /// Every crossing of the loop of a record with a controlled element, and whether it is stable, by the best form.
    pub fn loop_shape(&self, record: usize, element: &ContinuousTransferFunction) -> LoopShape {
        let of = self.operator(record);
        let known = |omega: f64| {
            let found = of.operator.response_and_gradient(omega);
            KnownResponse {
                value: found.value * self.intersample.response(omega, self.sample_time),
                relative: of.covariance.as_deref().map(|c| found.relative_covariance(c)),
            }
        };
        LoopShape::of(known, element, self.sample_time)
    }

    /// Crossover frequency and phase margin of the fit at the lines.
    pub fn loop_measures_at_lines(&self, element: &ContinuousTransferFunction) -> Option<LoopMeasures> {
        let lines = self.lines.as_ref()?;
        self.measured(&lines.operator, lines.covariance.as_deref(), element)
    }

    /// Crossover frequency and phase margin by refined instrumental variables.
    pub fn loop_measures_by_instruments(&self, element: &ContinuousTransferFunction) -> Option<LoopMeasures> {
        let found = self.instrumental.as_ref()?;
        self.measured(&found.operator, found.covariance.as_deref(), element)
    }

    fn measured(
        &self,
        operator: &FamilyOperator,
        covariance: Option<&[f64]>,
        element: &ContinuousTransferFunction,
    ) -> Option<LoopMeasures> {
        let measures = loop_measures(operator, covariance, element, (self.sample_time, self.intersample))?;
        Some(measures.of_few(self.clusters).with_run_to_run(self.run_to_run))
    }

    /// A coordinate of a record with its standard error.
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
    /// The operator of a record; of records beyond them, the last.
    pub fn of(&self, record: usize) -> Option<&OperatorInForm> {
        self.operators.get(record).or(self.operators.last())
    }
}

#[cfg(test)]
mod tests {
    use hoid_model::{
        Form,
        scenario::{Condition, Scenario},
    };
    use hoid_sim::{RunSeed, Simulator};

    use crate::family::FamilyEstimator;

    #[test]
    fn the_polynomials_have_the_title_of_the_operator() {
        let simulator = Simulator::new(&Scenario::condition(Condition::C1)).unwrap();
        let record = simulator.run(RunSeed::default(), false).unwrap();
        let estimator = FamilyEstimator {
            forms: vec![Form::Lead],
            nd: 1..=1,
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
