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

use hoid_model::{Complex64, Record};
use hoid_numerics::statistics::upper_median;

use super::{
    channel::SeenChannel,
    lines::{MIN_RUNS, shrunk_variance},
};
use crate::frequency::{COMMON_EXCITATIONS, Excitation, LineDetectionOptions, Window, greatest_common_divisor};

/// Number of neighbouring bins from which the remnant at a line is estimated.
const NEIGHBOUR_COUNT: usize = 8;

/// Fourier coefficients of u and of all inputs, with the error as the first input.
#[derive(Debug, Clone)]
pub(super) struct Coefficients {
    pub u: Complex64,
    pub inputs: Vec<Complex64>,
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
pub(super) struct Line {
    exciter: usize,
    pub omega_rad_s: f64,
    /// Fourier coefficients at the line in each run, divided by the coefficient of the exciting signal.
    pub runs: Vec<Coefficients>,
    /// Fourier coefficients in the neighbouring bins of each run, divided by the coefficient of the exciting signal at
    /// the line.
    neighbours: Vec<Vec<Coefficients>>,
    /// Variance of n, the part of the mean of u over the runs that the responses do not explain.
    pub variance: f64,
}

/// Lines of all excitations of the loop.
#[derive(Debug, Clone, Default)]
pub(super) struct ChannelLines {
    pub lines: Vec<Line>,
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
    pub fn weigh(&mut self, responses: impl Fn(f64) -> Vec<Complex64>) {
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

/// True if every target among the further inputs has lines of its own, and as many further signals have lines as there
/// are other responses. The responses can then be distinguished without assuming a form.
pub(super) fn have_separate_lines(lines: Option<&ChannelLines>, channels: &[SeenChannel]) -> bool {
    lines.is_some_and(|lines| {
        let mut targets = channels.iter().filter(|channel| channel.role.excites());
        targets.all(|target| lines.exciters.contains(&target.name)) && lines.exciters.len() > channels.len()
    })
}
