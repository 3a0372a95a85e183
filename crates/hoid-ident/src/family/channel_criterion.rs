//! Fit of an operator with several inputs at the lines of the excitations.
//!
//! The criterion is
//!
//! `chi^2 = sum 2 |mean u - sum_i Y_i(j omega) mean x_i|^2 / var` plus the prior,
//!
//! over the lines of [`ChannelLines`], where the means and variances are defined. The gains enter linearly, so the
//! search starts from their best values for a grid of the other coordinates.

use std::sync::Arc;

use hoid_model::{
    Complex64, FamilyOperator, Form, ModelError, SampleTime, delayed_operator::whole_samples,
    operator_family::Coordinate,
};

use super::{
    channel_lines::{ChannelLines, Line},
    coordinates::{self, GridDensity},
    intersample::Intersample,
    layout::{ChannelInLayout, FamilyLayout},
    prior::OperatorPrior,
};
use crate::{
    SearchOptions,
    criterion::Workspace,
    grey_box::{objective::Penalty, parametrisation::Parametrisation},
    linalg::least_squares::{covariance_of_free, solve_symmetric},
    optimize::{Linearisation, Minimum, Objective, minimise},
};

/// Number of starts from which the search runs to completion.
const SEARCH_COUNT: usize = 4;
/// Number of rounds in which the variances are updated.
const ROUND_COUNT: usize = 2;

/// The criterion chi^2 at the lines, as a function of the coordinates of the operator and its channels.
#[derive(Debug, Clone)]
pub(super) struct ChannelCriterion {
    lines: Arc<ChannelLines>,
    layout: FamilyLayout,
    /// For each channel of the layout, the index of its further input.
    places: Vec<usize>,
    /// Preview of each channel of the layout, s.
    leads_s: Vec<f64>,
    limits: Vec<(f64, f64)>,
    penalty: Vec<Penalty>,
    /// Factor by which the variances of the lines are multiplied.
    excess: f64,
}

/// The operator and its channels at the minimum of the criterion.
#[derive(Debug, Clone)]
pub(super) struct ChannelMinimum {
    /// Coordinates of the operator, followed by the coordinates of the channels.
    pub coordinates: Vec<f64>,
    pub chi_squared: f64,
    /// Number of real equations, two per line.
    pub equations: usize,
    pub minimum: Minimum,
    /// Covariance of the coordinates by rows; zero for coordinates at a bound.
    pub covariance: Option<Vec<f64>>,
}

impl ChannelMinimum {
    /// Returns the degrees of freedom: the number of equations minus the number of coordinates.
    pub fn degrees_of_freedom(&self) -> usize {
        self.equations.saturating_sub(self.coordinates.len())
    }

    /// Returns chi^2 per degree of freedom, at least one.
    pub fn excess(&self) -> f64 {
        match self.degrees_of_freedom() {
            0 => 1.0,
            freedom => (self.chi_squared / freedom as f64).max(1.0),
        }
    }

    /// Returns Akaike's criterion, `chi^2 + 2 p`.
    pub fn criterion(&self) -> f64 {
        self.chi_squared + 2.0 * self.coordinates.len() as f64
    }
}

/// A further input in one form, as part of a fit at the lines.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct ChannelInForm {
    /// Index of the input among the requested channels.
    pub index: usize,
    pub form: Form,
    pub lead_s: f64,
    pub delay_range_s: (f64, f64),
}

/// Data and settings common to all fits at the lines.
#[derive(Debug, Clone, Copy)]
pub(super) struct ChannelLineFitter<'l> {
    pub lines: &'l Arc<ChannelLines>,
    pub neuromuscular: bool,
    pub delay_range_s: (f64, f64),
    pub sampling: (SampleTime, Intersample),
    pub prior: &'l OperatorPrior,
    pub search: &'l SearchOptions,
}

impl ChannelLineFitter<'_> {
    /// Returns the criterion for these forms, including the prior.
    pub fn criterion(&self, form: Form, channels: &[ChannelInForm]) -> ChannelCriterion {
        let (sample_time, _) = self.sampling;
        let limits = coordinates::limits(form, self.neuromuscular, self.delay_range_s, sample_time);
        let of = |channel: &ChannelInForm| {
            let all = coordinates::limits(channel.form, self.neuromuscular, channel.delay_range_s, sample_time);
            let own = own_coordinates(channel.form, self.neuromuscular);
            ChannelInLayout {
                form: channel.form,
                limits: own.iter().map(|&i| all[i]).collect(),
                start: own.iter().map(|_| 0.0).collect(),
                place: 0,
            }
        };
        let layout = FamilyLayout::new((form, self.neuromuscular), (0, 0), 1, &[], &limits, self.sampling)
            .with_channels(&channels.iter().map(of).collect::<Vec<_>>());
        ChannelCriterion {
            lines: Arc::clone(self.lines),
            limits: layout.limits().to_vec(),
            penalty: self.prior.penalties(form, self.neuromuscular),
            places: channels.iter().map(|channel| channel.index).collect(),
            leads_s: channels.iter().map(|channel| channel.lead_s).collect(),
            layout,
            excess: 1.0,
        }
    }

    /// Returns the lines with their variances. The part of u that is not explained is computed first with the responses
    /// `begun`, then with the best fit of these forms.
    pub fn weighted_lines(
        &self,
        (form, channels): (Form, &[ChannelInForm]),
        begun: impl Fn(f64) -> Vec<Complex64>,
    ) -> Arc<ChannelLines> {
        let mut lines = self.lines.as_ref().clone();
        lines.weigh(begun);
        let inputs = channels.iter().map(|c| c.index + 1).max().unwrap_or(0);
        for _ in 0..ROUND_COUNT {
            let shared = Arc::new(lines.clone());
            let at = ChannelLineFitter {
                lines: &shared,
                ..*self
            };
            if let Some(found) = at.fit(form, channels) {
                lines.weigh(|omega| at.responses((form, channels), &found, inputs, omega));
            }
        }
        Arc::new(lines)
    }

    /// Returns the responses of a fit to the error and to `inputs` further inputs at the frequency `omega`.
    fn responses(
        &self,
        (form, channels): (Form, &[ChannelInForm]),
        found: &ChannelMinimum,
        inputs: usize,
        omega: f64,
    ) -> Vec<Complex64> {
        let mut all = vec![Complex64::new(0.0, 0.0); inputs + 1];
        let criterion = self.criterion(form, channels);
        let Ok(operators) = criterion.operators(&found.coordinates) else {
            return all;
        };
        let (sample_time, intersample) = self.sampling;
        let hold = intersample.response(omega, sample_time);
        let places = std::iter::once((0, 0.0)).chain(channels.iter().map(|c| (c.index + 1, c.lead_s)));
        for (operator, (place, lead_s)) in operators.iter().zip(places) {
            all[place] = operator.response(omega) * hold * Complex64::from_polar(1.0, omega * lead_s);
        }
        all
    }

    /// Searches from the best points of a grid and returns the best result; `None` if every search fails.
    pub fn fit(&self, form: Form, channels: &[ChannelInForm]) -> Option<ChannelMinimum> {
        let criterion = self.criterion(form, channels);
        let mut starts: Vec<(f64, Vec<f64>)> = (criterion.grid().into_iter())
            .filter_map(|mut start| Some((criterion.optimise_gains(&mut start)?, start)))
            .collect();
        starts.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut best: Option<Minimum> = None;
        for (_, start) in starts.into_iter().take(SEARCH_COUNT) {
            let known = best.as_ref().map(|b| b.linearisation.sum_of_squares);
            if let Some(found) = minimise(&criterion, start, self.search, None, &mut Workspace::default())
                && known.is_none_or(|known| found.linearisation.sum_of_squares < known)
            {
                best = Some(found);
            }
        }
        criterion.result(best?)
    }
}

/// Returns the indices of the coordinates that a channel does not share with other channels: all except those of the
/// neuromuscular system.
pub(super) fn own_coordinates(form: Form, neuromuscular: bool) -> Vec<usize> {
    let all = form.coordinates(neuromuscular);
    let own = |i: &usize| !matches!(all[*i], Coordinate::LogOmega | Coordinate::LogZeta);
    (0..all.len()).filter(own).collect()
}

impl ChannelCriterion {
    /// Returns the largest number of runs that contain the same line.
    pub fn run_count(&self) -> usize {
        self.lines.runs
    }

    /// Returns the prior of the operator.
    pub fn penalty(&self) -> &[Penalty] {
        &self.penalty
    }

    /// Returns the operator from e to u at the coordinates x.
    ///
    /// # Errors
    /// The errors of [`FamilyOperator::new`].
    pub fn operator(&self, x: &[f64]) -> Result<FamilyOperator, ModelError> {
        self.layout.operator(x, 0)
    }

    /// Returns the criterion without a prior, with the variances multiplied by `excess`.
    pub fn without_prior(mut self, excess: f64) -> Self {
        self.penalty.clear();
        self.excess = excess;
        self
    }

    /// Returns the starting points of the searches.
    fn grid(&self) -> Vec<Vec<f64>> {
        let (form, muscles) = (self.layout.form, self.layout.neuromuscular);
        let of_operator = &self.limits[..self.layout.operator_element_count()];
        let mut grid = coordinates::start_grid(form, muscles, of_operator, GridDensity::Default);
        for channel in &self.layout.channels {
            let coordinates = channel.form.coordinates(muscles);
            let mut whole = vec![(0.0, 0.0); coordinates.len()];
            let own = own_coordinates(channel.form, muscles);
            own.iter()
                .zip(&channel.limits)
                .for_each(|(&i, limit)| whole[i] = *limit);
            let all = coordinates::start_grid(channel.form, muscles, &whole, GridDensity::Default);
            let mut points: Vec<Vec<f64>> = (all.iter()).map(|x| own.iter().map(|&i| x[i]).collect()).collect();
            points.dedup();
            grid = grid
                .into_iter()
                .flat_map(|head| points.iter().map(move |tail| [head.as_slice(), tail].concat()))
                .collect();
        }
        grid
    }

    /// Returns the operators at x: the operator from the error to u, followed by the operators of the channels.
    fn operators(&self, x: &[f64]) -> Result<Vec<FamilyOperator>, ModelError> {
        let mut all = vec![self.layout.operator(x, 0)?];
        for channel in &self.layout.channels {
            all.push(self.layout.channel(x, channel, 0)?);
        }
        Ok(all)
    }

    /// Returns the mean of u at one line over the runs, and the mean input of each operator, multiplied by the response
    /// of the hold and the phase factor of the preview.
    fn inputs(&self, line: &Line) -> (Complex64, Vec<Complex64>) {
        let n = line.runs.len() as f64;
        let omega = line.omega_rad_s;
        let hold = self.layout.intersample.response(omega, self.layout.sample_time);
        let mean = |i: usize| line.runs.iter().map(|run| run.inputs[i]).sum::<Complex64>() / n * hold;
        let u = line.runs.iter().map(|run| run.u).sum::<Complex64>() / n;
        let of_channels = (self.places.iter().zip(&self.leads_s))
            .map(|(&place, lead_s)| mean(place + 1) * Complex64::from_polar(1.0, omega * lead_s));
        (u, std::iter::once(mean(0)).chain(of_channels).collect())
    }

    /// Sets the gains to their best values for the other coordinates, which is a linear problem, and returns the value
    /// of the criterion.
    fn optimise_gains(&self, x: &mut [f64]) -> Option<f64> {
        let places: Vec<usize> = std::iter::once(0)
            .chain(self.layout.channels.iter().map(|c| c.place))
            .collect();
        places.iter().for_each(|&place| x[place] = 1.0);
        let operators = self.operators(x).ok()?;
        let mut total = Linearisation::empty(places.len());
        for line in &self.lines.lines {
            let (u, inputs) = self.inputs(line);
            let slopes: Vec<Complex64> = (operators.iter().zip(&inputs))
                .map(|(operator, input)| operator.response(line.omega_rad_s) * input)
                .collect();
            total.add_complex(2.0 / line.variance, u, &slopes);
        }
        let gains = solve_symmetric(&total.gram, &total.descent)?;
        places.iter().zip(gains).for_each(|(&place, gain)| x[place] = gain);
        let value = self.linearise(x, &mut Workspace::default()).sum_of_squares;
        value.is_finite().then_some(value)
    }

    fn result(&self, minimum: Minimum) -> Option<ChannelMinimum> {
        let x = minimum.theta.clone();
        let p = x.len();
        let free: Vec<usize> = (0..p)
            .filter(|&i| self.limits[i].0 < x[i] && x[i] < self.limits[i].1)
            .collect();
        let alone = self.clone().without_prior(1.0);
        let chi_squared = alone.linearise(&x, &mut Workspace::default()).sum_of_squares;
        chi_squared.is_finite().then(|| ChannelMinimum {
            chi_squared,
            equations: 2 * self.lines.lines.len(),
            covariance: covariance_of_free(&minimum.linearisation.gram, &free, p),
            coordinates: x,
            minimum,
        })
    }
}

impl Objective for ChannelCriterion {
    fn is_feasible(&self, x: &[f64]) -> bool {
        x.iter().all(|v| v.is_finite())
            && self.operators(x).is_ok_and(|all| {
                let held =
                    |operator: &FamilyOperator| whole_samples(operator.tau_e_s(), self.layout.sample_time).is_ok();
                all.iter().all(held)
            })
    }

    fn linearise(&self, x: &[f64], _: &mut Workspace) -> Linearisation {
        let mut total = Linearisation::empty(x.len());
        let Ok(operators) = self.operators(x) else {
            total.sum_of_squares = f64::NAN;
            return total;
        };
        let channels = self
            .layout
            .channels
            .iter()
            .map(|channel| self.layout.channel_indices(channel, 0));
        let places: Vec<Vec<usize>> = std::iter::once((0..self.layout.coordinate_count()).collect())
            .chain(channels)
            .collect();
        for line in &self.lines.lines {
            let (mut off, inputs) = self.inputs(line);
            let mut slopes = vec![Complex64::new(0.0, 0.0); x.len()];
            for ((operator, input), places) in operators.iter().zip(inputs).zip(&places) {
                let model = operator.response_and_gradient(line.omega_rad_s);
                off -= model.value * input;
                for (&place, g) in places.iter().zip(&model.gradient) {
                    slopes[place] += g * input;
                }
            }
            total.add_complex(2.0 / (line.variance * self.excess), off, &slopes);
        }
        for penalty in &self.penalty {
            penalty.add_to(x, &mut total);
        }
        total
    }

    fn output_power(&self) -> f64 {
        let of = |line: &Line| 2.0 * self.inputs(line).0.norm_sqr() / (line.variance * self.excess);
        self.lines.lines.iter().map(of).sum()
    }

    fn limits(&self) -> Option<&[(f64, f64)]> {
        Some(&self.limits)
    }
}
