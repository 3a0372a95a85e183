//! Responses to several inputs at the lines of the excitations, without a noise model.
//!
//! Let a target r and a disturbance d have separate lines. In run k, the Fourier coefficients at a line are divided by
//! the coefficient X_k of the exciting signal: `u_k = U_k/X_k` and `x_ik = X_ik/X_k`. These ratios are the same in all
//! runs except for the remnant. The means over the runs satisfy
//!
//! `mean u = sum_i Y_i(j omega) mean x_i + n`
//!
//! at each line. The lines of d determine the response to the error; the lines of r determine the sum of the response
//! to the error and the response to r (M. M. van Paassen and M. Mulder, *Identification of Human Operator Control
//! Behaviour in Multiple-Loop Tracking Tasks*, IFAC Man-Machine Systems, 1998). The variance of n follows from
//! `|u_k - sum_i Y_i x_ik|^2` over the runs, and from the same quantity in the bins next to the line; the two are
//! combined as in [`super::lines`].
//!
//! The remnant also enters e, so a single run would give a ratio of two noisy numbers; averaging over the runs before
//! the division reduces this error.

use std::sync::Arc;

use hoid_model::{
    Complex64, FamilyOperator, Form, ModelError, Record, SampleTime, delayed_operator::whole_samples,
    operator_family::Coordinate,
};
use hoid_numerics::statistics::upper_median;

use super::{
    channel::SeenChannel,
    coordinates::{self, GridDensity},
    intersample::Intersample,
    layout::{ChannelInLayout, FamilyLayout},
    lines::{MIN_RUNS, shrunk_variance},
    prior::OperatorPrior,
};
use crate::{
    SearchOptions,
    criterion::Workspace,
    frequency::{COMMON_EXCITATIONS, Excitation, LineDetectionOptions, Window, greatest_common_divisor},
    grey_box::{objective::Penalty, parametrisation::Parametrisation},
    linalg::least_squares::solve_symmetric,
    optimize::{Linearisation, Minimum, Objective, minimise},
};

/// Number of starts from which the search runs to completion.
const SEARCH_COUNT: usize = 4;
/// Number of neighbouring bins from which the remnant at a line is estimated.
const NEIGHBOUR_COUNT: usize = 8;
/// Number of rounds in which the variances are updated.
const ROUND_COUNT: usize = 2;

/// Fourier coefficients of u and of all inputs, with the error as the first input.
#[derive(Debug, Clone)]
struct Coefficients {
    u: Complex64,
    inputs: Vec<Complex64>,
}

impl Coefficients {
    /// Returns the part of u that the responses do not explain.
    fn residual(&self, responses: &[Complex64]) -> Complex64 {
        self.inputs
            .iter()
            .zip(responses)
            .fold(self.u, |left, (x, h)| left - x * h)
    }
}

/// A line of one exciting signal, in all runs that contain this line.
#[derive(Debug, Clone)]
struct Line {
    exciter: usize,
    omega_rad_s: f64,
    /// Fourier coefficients at the line in each run, divided by the coefficient of the exciting signal.
    runs: Vec<Coefficients>,
    /// Fourier coefficients in the neighbouring bins of each run, divided by the coefficient of the exciting signal at
    /// the line.
    neighbours: Vec<Vec<Coefficients>>,
    /// Variance of n, the part of the mean of u over the runs that the responses do not explain.
    variance: f64,
}

/// Lines of all excitations of the loop.
#[derive(Debug, Clone, Default)]
pub(super) struct ChannelLines {
    lines: Vec<Line>,
    /// Largest number of runs that contain the same line.
    pub runs: usize,
    /// Names of the signals that have lines.
    pub exciters: Vec<String>,
}

impl ChannelLines {
    /// Finds the lines of the `exciting` channels and of the excitation in these records. The excitation is the given
    /// channel or, if none is given, any channel with one of the common names. `None` if no signal has lines of its
    /// own.
    pub fn of(
        records: &[Record],
        (channels, exciting): (&[String], &[String]),
        (excitation, period_s): (Option<&str>, Option<f64>),
    ) -> Option<Self> {
        let common = COMMON_EXCITATIONS.into_iter().filter(|_| excitation.is_none());
        let mut exciters: Vec<String> = exciting.to_vec();
        for name in excitation.into_iter().chain(common) {
            let is_signal = records[0].channels().take(2).any(|signal| signal.name == name);
            if !is_signal && !exciters.iter().any(|known| known == name) {
                exciters.push(name.to_owned());
            }
        }
        let search = LineDetectionOptions {
            period_s,
            ..LineDetectionOptions::default()
        };
        let found: Vec<Vec<Option<Excitation>>> = (records.iter())
            .map(|record| {
                let of = |name: &String| Excitation::detect(record, name, &search).ok();
                exciters.iter().map(of).collect()
            })
            .collect();
        let mut all = Self {
            lines: Vec::new(),
            runs: 0,
            exciters: Vec::new(),
        };
        for (record, of) in records.iter().zip(&found) {
            all.add(record, of, (channels, &exciters), records.len())?;
        }
        all.runs = all.lines.iter().map(|line| line.runs.len()).max()?;
        let has_lines = |k: &usize| all.lines.iter().any(|line| line.exciter == *k);
        all.exciters = (0..exciters.len())
            .filter(has_lines)
            .map(|k| exciters[k].clone())
            .collect();
        Some(all)
    }

    fn add(
        &mut self,
        record: &Record,
        found: &[Option<Excitation>],
        (channels, exciters): (&[String], &[String]),
        records: usize,
    ) -> Option<()> {
        let n = record.len();
        let span_s = n as f64 * record.sample_time().s();
        // Indices of the lines of an excitation among the frequency bins of the whole record.
        let bins = |of: &Excitation| -> Vec<usize> {
            let periods = (span_s / of.period_s()).round() as usize;
            of.harmonics().iter().map(|harmonic| harmonic * periods).collect()
        };
        let all: Vec<Vec<usize>> = found
            .iter()
            .map(|of| of.as_ref().map(bins).unwrap_or_default())
            .collect();
        let periods = found
            .iter()
            .flatten()
            .map(|of| (span_s / of.period_s()).round() as usize);
        let periods = periods.fold(0, greatest_common_divisor).max(1);
        let whole = Window {
            first: 0,
            samples: n,
            periods,
        };
        let windows = if records < MIN_RUNS {
            whole.single_periods()
        } else {
            vec![whole]
        };
        for window in windows {
            let of = |values: &[f64]| window.coefficients(values, 0.0);
            let u = of(record.output());
            let mut inputs = vec![of(record.input())];
            for name in channels {
                inputs.push(of(record.channel(name)?));
            }
            let here = |bin: usize| bin / (periods / window.periods);
            let is_line = |bin: usize| all.iter().flatten().any(|line| here(*line) == bin);
            for (exciter, name) in exciters.iter().enumerate() {
                let own = &all[exciter];
                if own.is_empty() {
                    continue;
                }
                let excites = of(record.channel(name)?);
                for &line in own {
                    let shared = (0..all.len()).any(|other| other != exciter && all[other].contains(&line));
                    let at = here(line);
                    if shared || 2 * at >= window.samples {
                        continue;
                    }
                    let over = |bin: usize| Coefficients {
                        u: u[bin] / excites[at],
                        inputs: inputs.iter().map(|x| x[bin] / excites[at]).collect(),
                    };
                    let mut neighbours: Vec<usize> = (1..u.len()).filter(|bin| !is_line(*bin)).collect();
                    neighbours.sort_by_key(|bin| bin.abs_diff(at));
                    neighbours.truncate(NEIGHBOUR_COUNT);
                    let neighbours = neighbours.into_iter().map(over).collect();
                    let omega = std::f64::consts::TAU * line as f64 / span_s;
                    self.insert_run(exciter, omega, over(at), neighbours);
                }
            }
        }
        Some(())
    }

    fn insert_run(&mut self, exciter: usize, omega_rad_s: f64, run: Coefficients, neighbours: Vec<Coefficients>) {
        let known = |line: &&mut Line| line.exciter == exciter && (line.omega_rad_s / omega_rad_s - 1.0).abs() < 1e-4;
        match self.lines.iter_mut().find(known) {
            Some(line) => {
                line.runs.push(run);
                line.neighbours.push(neighbours);
            }
            None => self.lines.push(Line {
                exciter,
                omega_rad_s,
                runs: vec![run],
                neighbours: vec![neighbours],
                variance: f64::NAN,
            }),
        }
    }

    /// Computes, at each line, the variance of the part of the mean of u that the given responses to all inputs do not
    /// explain.
    fn weigh(&mut self, responses: impl Fn(f64) -> Vec<Complex64>) {
        let of = |line: &Line| {
            let h = responses(line.omega_rad_s);
            let n = line.runs.len() as f64;
            let left: Vec<Complex64> = line.runs.iter().map(|run| run.residual(&h)).collect();
            let mean = left.iter().sum::<Complex64>() / n;
            let squares: f64 = left.iter().map(|x| (x - mean).norm_sqr()).sum();
            let of_runs = (n > 1.0).then(|| squares / (n * (n - 1.0)));
            let power = |bins: &Vec<Coefficients>| {
                bins.iter().map(|bin| bin.residual(&h).norm_sqr()).sum::<f64>() / bins.len().max(1) as f64
            };
            let neighbours = line.neighbours.iter().map(power).sum::<f64>() / (n * n);
            (of_runs, neighbours)
        };
        let all: Vec<(Option<f64>, f64)> = self.lines.iter().map(of).collect();
        let mut ratios: Vec<f64> = (all.iter())
            .filter_map(|(of_runs, neighbours)| Some((*of_runs)? / neighbours))
            .filter(|r| r.is_finite())
            .collect();
        let excess = match upper_median(&mut ratios) {
            Some(median) if self.runs >= MIN_RUNS => median.max(1.0),
            _ => 1.0,
        };
        for (line, (of_runs, neighbours)) in self.lines.iter_mut().zip(all) {
            line.variance = shrunk_variance(line.runs.len(), of_runs, neighbours, excess);
        }
    }
}

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
        let part: Vec<f64> = (free.iter())
            .flat_map(|&i| free.iter().map(move |&j| (i, j)))
            .map(|(i, j)| minimum.linearisation.gram[i * p + j])
            .collect();
        let covariance = || {
            let mut covariance = vec![0.0; p * p];
            for (k, &i) in free.iter().enumerate() {
                let mut unit = vec![0.0; free.len()];
                unit[k] = 1.0;
                let column = solve_symmetric(&part, &unit)?;
                free.iter().zip(column).for_each(|(&j, v)| covariance[j * p + i] = v);
            }
            Some(covariance)
        };
        let alone = self.clone().without_prior(1.0);
        let chi_squared = alone.linearise(&x, &mut Workspace::default()).sum_of_squares;
        chi_squared.is_finite().then(|| ChannelMinimum {
            chi_squared,
            equations: 2 * self.lines.lines.len(),
            covariance: covariance(),
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

/// True if every target among the further inputs has lines of its own, and as many further signals have lines as there
/// are other responses. The responses can then be distinguished without assuming a form.
pub(super) fn have_separate_lines(lines: Option<&ChannelLines>, channels: &[SeenChannel]) -> bool {
    lines.is_some_and(|lines| {
        let mut targets = channels.iter().filter(|channel| channel.role.excites());
        targets.all(|target| lines.exciters.contains(&target.name)) && lines.exciters.len() > channels.len()
    })
}
