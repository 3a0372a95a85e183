//! Test of whether the recorded loop has the controlled element that is given for it.
//!
//! In a loop with the element `P = B/A`, target r and disturbance d, `e = r - P (u + d)`. In the Fourier coefficients
//! of a record, which need not be periodic,
//!
//! `A(s) E = C(s) R - B(s) e^{-s delta} h(s) (U + kappa D) + T(s)`, `s = j omega`,
//!
//! with the hold `h = e^{-s Ts/2} sinc(omega Ts/2)` of u between its samples and a polynomial T for the difference of
//! the states at both ends (R. Pintelon and J. Schoukens, *System Identification: A Frequency Domain Approach*, 2012,
//! section 6.3.2). It is linear in the coefficients of A, B, C, `B kappa` and T, which are found by least squares at
//! the frequencies of manual control; the delay is scanned, that of d as that of u or as
//! none, where u alone was recorded late. Rows are divided by `B h` of the round before, so that a
//! residual is that of a disturbance at u (C. K. Sanathanan and J. Koerner, IEEE Trans. Automatic Control 8 (1963)
//! 56-58), and weighted by its smoothed spectrum.
//!
//! A disturbance that was not recorded returns through the person, so that u is not independent of it: the element is
//! judged only if the recorded signals explain all but [`UNEXPLAINED`] of the power, as they do where the loop is
//! complete. C is free, since the coefficients of a target are those of A only if e is not scaled.

use std::f64::consts::PI;

use hoid_model::{Complex64, ContinuousTransferFunction, Finding, Record};

use super::other_inputs::TARGETS;
use crate::{
    frequency::{COMMON_EXCITATIONS, spectrum::coefficients},
    linalg::least_squares::{LeastSquares, add_scaled, dot},
};

/// Names of channels that hold a disturbance at u.
const DISTURBANCES: [&str; 3] = ["d", "f_d", "disturbance"];
/// Largest share of the power, as a disturbance at u, that the recorded signals may leave unexplained.
const UNEXPLAINED: f64 = 0.02;
/// Share that the steps of the delay leave of exact data: elements that leave less are alike.
const EXACT: f64 = 1e-4;
/// Frequencies of the test, rad/s: those at which people move u.
const BAND_RAD_S: (f64, f64) = (0.3, 12.0);
/// Frequencies at which two elements are compared, rad/s: where people close their loops.
const COMPARED_RAD_S: [f64; 7] = [0.5, 0.75, 1.1, 1.6, 2.4, 3.6, 5.4];
/// Largest difference of the logarithms of two responses: 10 % of the gain or 6 deg.
const SAME: f64 = 0.1;
/// Range of the delay of the element, s, and the step of the scan.
const DELAYS_S: (f64, f64, f64) = (-0.05, 0.3, 0.01);
/// Delay up to which e and u count as aligned, samples: recorders store one before or after the other.
const ALIGNED_SAMPLES: f64 = 1.5;
/// Half width of the smoothing of the residual spectrum, as a logarithm of the frequency.
const SMOOTHED: f64 = 0.35;
/// Rounds of weights.
const ROUNDS: usize = 3;
/// Number of frequencies above which more of a record, and further records, add nothing.
const MOST_FREQUENCIES: usize = 1000;
/// Largest degree of an element that is tested.
const MOST_POLES: usize = 4;

/// The controlled element of a recorded loop.
#[derive(Debug, Clone, PartialEq)]
pub struct RecordedElement {
    /// The element that e and u have, with the delay of the given one.
    pub element: ContinuousTransferFunction,
    /// Delay of the machine beyond that of the given element, s; negative if u was recorded late.
    pub delay_s: f64,
    /// Share of the power at u that it does not explain.
    pub unexplained: f64,
    /// The frequency at which its response differs most, except for the delay, rad/s, and its response there as a
    /// multiple of that of the given element.
    pub difference: (f64, Complex64),
    /// Delay within which e and u count as aligned, s.
    aligned_s: f64,
}

impl RecordedElement {
    /// True if it has the response of the given element, except for a delay.
    pub fn is_given(&self) -> bool {
        self.difference.1.ln().norm() <= SAME
    }

    /// Returns a doubt if it is not the given element, or e and u are not aligned.
    pub fn finding(&self, given: &ContinuousTransferFunction) -> Option<Finding> {
        let (omega, ratio) = self.difference;
        let late = 1e3 * self.delay_s;
        let beyond = match self.delay_s.abs() > self.aligned_s {
            true if late > 0.0 => format!(", {late:.0} ms later"),
            true => format!(", u recorded {:.0} ms late", -late),
            false => String::new(),
        };
        let loop_lost = "crossover and phase margin are not those of the recorded loop";
        let message = match (self.is_given(), beyond.is_empty()) {
            (true, true) => return None,
            (true, false) => format!("e returns from u by {given}{beyond}: {loop_lost}"),
            (false, _) => format!(
                "e returns from u by {}{beyond}, not by {given}: at {omega} rad/s {} times its gain and {:+.0} deg; \
                 {loop_lost}",
                self.element,
                three_digits(ratio.norm()),
                ratio.arg().to_degrees()
            ),
        };
        Some(Finding::doubt("controlled-element", message))
    }
}

/// Finds the element of the loop of these records. `None` if they do not determine it: signals of the loop are missing,
/// or the records are too short. `excitation` is the channel of a target or a disturbance.
pub fn recorded_element(
    records: &[Record],
    given: &ContinuousTransferFunction,
    excitation: Option<&str>,
) -> Option<RecordedElement> {
    let (m, n) = (given.num().len() - 1, given.den().len() - 1);
    let sample_time_s = records.first()?.sample_time().s();
    if n > MOST_POLES || records.iter().any(|record| record.input_channel().is_none()) {
        return None;
    }
    let exogenous = Exogenous::of(records, excitation);
    let mut spectra = Vec::new();
    let mut frequencies = 0;
    for record in records {
        if frequencies < MOST_FREQUENCIES {
            let found = Spectra::of(record, &exogenous)?;
            frequencies += found.omega.len();
            spectra.push(found);
        }
    }
    // From the simplest on: a single and a double integrator with their lags, the given orders, and one pole more.
    let mut orders = vec![(0, 1), (0, 2), (1, 2), (m, n.max(1)), (m, n + 1)];
    orders.sort_by_key(|&(m, n)| (m + n, n));
    orders.dedup();
    let fits: Vec<Fitted> = orders
        .iter()
        .filter_map(|&(m, n)| Fitted::of(&spectra, m, n, sample_time_s))
        .collect();
    let least = fits.iter().map(|fit| fit.unexplained).fold(f64::INFINITY, f64::min);
    let chosen = fits
        .into_iter()
        .find(|fit| fit.unexplained <= 2.0 * least + EXACT)
        .filter(|fit| fit.unexplained <= UNEXPLAINED)?;
    let element = chosen.element(given.delay_s())?;
    let ratio = |omega: f64| (omega, element.response(omega) / given.response(omega));
    let difference = COMPARED_RAD_S
        .map(ratio)
        .into_iter()
        .filter(|(_, ratio)| ratio.ln().norm().is_finite())
        .max_by(|a, b| a.1.ln().norm().total_cmp(&b.1.ln().norm()))?;
    Some(RecordedElement {
        delay_s: chosen.delay_s - given.delay_s(),
        unexplained: chosen.unexplained,
        element,
        difference,
        aligned_s: ALIGNED_SAMPLES * sample_time_s,
    })
}

/// Names of the channels that enter the loop from outside.
struct Exogenous {
    targets: Vec<String>,
    disturbances: Vec<String>,
}

impl Exogenous {
    /// The channels with names of targets and of disturbances that all records have. Other names may be either.
    fn of(records: &[Record], excitation: Option<&str>) -> Self {
        let moves = |name: &&str| {
            let is_signal = |record: &Record| record.channels().take(2).any(|channel| channel.name == *name);
            let varies = |record: &Record| {
                let values = record.channel(name)?;
                Some(values.iter().any(|value| *value != values[0]))
            };
            records.iter().all(|r| !is_signal(r) && varies(r).is_some())
                && records.iter().any(|r| varies(r) == Some(true))
        };
        let either = COMMON_EXCITATIONS.into_iter().chain(excitation);
        let of = |known: &[&str], others: &[&str]| -> Vec<String> {
            let is_other = |name: &&str| !known.contains(name) && !others.contains(name);
            let mut names: Vec<&str> = known.iter().copied().chain(either.clone().filter(is_other)).collect();
            names.dedup();
            names.into_iter().filter(moves).map(str::to_owned).collect()
        };
        Self {
            targets: of(&TARGETS, &DISTURBANCES),
            disturbances: of(&DISTURBANCES, &TARGETS),
        }
    }
}

/// Fourier coefficients of one record in the band.
struct Spectra {
    omega: Vec<f64>,
    e: Vec<Complex64>,
    u: Vec<Complex64>,
    targets: Vec<Vec<Complex64>>,
    disturbances: Vec<Vec<Complex64>>,
    /// The hold of u.
    hold: Vec<Complex64>,
}

impl Spectra {
    fn of(record: &Record, exogenous: &Exogenous) -> Option<Self> {
        let ts = record.sample_time().s();
        let most = (2.0 * PI * MOST_FREQUENCIES as f64 / (BAND_RAD_S.1 * ts)) as usize;
        let samples = record.len().min(most);
        let step = 2.0 * PI / (samples as f64 * ts);
        let highest = BAND_RAD_S.1.min(0.4 * PI / ts);
        let first = ((BAND_RAD_S.0 / step).ceil() as usize).max(2);
        let bins = first..=(highest / step).floor() as usize;
        let of = |values: &[f64]| -> Option<Vec<Complex64>> {
            let all = values[..samples]
                .iter()
                .all(|v| v.is_finite())
                .then(|| coefficients(&values[..samples]))?;
            all.get(bins.clone()).map(<[Complex64]>::to_vec)
        };
        let each = |names: &[String]| {
            names
                .iter()
                .map(|name| of(record.channel(name)?))
                .collect::<Option<Vec<_>>>()
        };
        let omega: Vec<f64> = bins.clone().map(|k| k as f64 * step).collect();
        let hold = |omega: &f64| {
            let half = 0.5 * omega * ts;
            Complex64::from_polar(half.sin() / half, -half)
        };
        Some(Self {
            e: of(record.input())?,
            u: of(record.output())?,
            targets: each(&exogenous.targets)?,
            disturbances: each(&exogenous.disturbances)?,
            hold: omega.iter().map(hold).collect(),
            omega,
        })
    }
}

/// An element of `m` zeros and `n` poles by least squares; coefficients by descending powers of s.
struct Fitted {
    num: Vec<f64>,
    den: Vec<f64>,
    delay_s: f64,
    unexplained: f64,
}

impl Fitted {
    fn of(spectra: &[Spectra], m: usize, n: usize, sample_time_s: f64) -> Option<Self> {
        let mut weights: Vec<Vec<f64>> = spectra.iter().map(|s| vec![1.0; s.omega.len()]).collect();
        let mut num = vec![1.0];
        let mut best = None;
        for round in 0..ROUNDS {
            let rows: Vec<Rows> = (spectra.iter().zip(&weights))
                .map(|(s, w)| Rows::of(s, w, &num, m, n))
                .collect();
            let (from, to, step) = DELAYS_S;
            let scan = (0..=((to - from) / step).round() as usize).map(|k| from + k as f64 * step);
            let found = least(scan.flat_map(|delay| Solved::all(&rows, delay)))?;
            let near = (-4..=4).map(|k| found.delay_s + 0.25 * f64::from(k) * step.min(sample_time_s));
            let found = least(near.flat_map(|delay| Solved::all(&rows, delay)))?;
            num = found.theta[n..=n + m].iter().rev().copied().collect();
            if round + 1 < ROUNDS {
                let mut rest = found.residuals.as_slice();
                for (w, s) in weights.iter_mut().zip(spectra) {
                    let (own, after) = rest.split_at(2 * s.omega.len());
                    rest = after;
                    smooth(w, own, &s.omega, found.power);
                }
            }
            best = Some(found);
        }
        let found = best?;
        let descending = |range: std::ops::Range<usize>| found.theta[range].iter().rev().copied();
        Some(Self {
            den: [1.0].into_iter().chain(descending(0..n)).collect(),
            num: descending(n..n + m + 1).collect(),
            delay_s: found.delay_s,
            unexplained: found.sum_of_squares / found.power,
        })
    }

    /// Returns the element with this delay, without terms that add nothing at the frequencies compared.
    fn element(&self, delay_s: f64) -> Option<ContinuousTransferFunction> {
        let without_small = |p: &[f64]| -> Vec<f64> {
            let sizes = |omega: f64| {
                p.iter()
                    .rev()
                    .enumerate()
                    .map(move |(i, c)| c.abs() * omega.powi(i as i32))
            };
            let matters = |i: usize| {
                [COMPARED_RAD_S[0], COMPARED_RAD_S[6]].into_iter().any(|omega| {
                    let largest = sizes(omega).fold(0.0, f64::max);
                    sizes(omega).nth(i).is_some_and(|size| size > 0.02 * largest)
                })
            };
            let last = p.len() - 1;
            let kept = p
                .iter()
                .enumerate()
                .map(|(i, c)| if matters(last - i) { *c } else { 0.0 });
            kept.map(three_digits).collect()
        };
        let found = ContinuousTransferFunction::new(&without_small(&self.num), &without_small(&self.den));
        found.and_then(|found| found.with_delay(delay_s)).ok()
    }
}

/// Rounds to three significant digits: the fit is a test, not an estimate for print.
fn three_digits(value: f64) -> f64 {
    if value == 0.0 {
        return value;
    }
    let unit = 10f64.powf(value.abs().log10().floor() - 2.0);
    // A quotient of integers where the unit is below one, which decimal digits end.
    if unit < 1.0 {
        (value / unit).round() / (1.0 / unit).round()
    } else {
        (value / unit).round() * unit
    }
}

/// The equations of one record: real and imaginary parts of all frequencies, without their components along T.
struct Rows<'a> {
    spectra: &'a Spectra,
    /// Factor of each frequency: weight over `B h`.
    factor: Vec<Complex64>,
    /// Orthonormal columns of T.
    transient: Vec<Vec<f64>>,
    m: usize,
    /// Columns that do not depend on the delay: of A, then of C; and the right-hand side `s^n E`.
    of_e: Vec<Vec<f64>>,
    of_targets: Vec<Vec<f64>>,
    right: Vec<f64>,
}

impl<'a> Rows<'a> {
    fn of(spectra: &'a Spectra, weights: &[f64], num: &[f64], m: usize, n: usize) -> Self {
        let s = |k: usize| Complex64::new(0.0, spectra.omega[k]);
        let all = 0..spectra.omega.len();
        let factor: Vec<Complex64> = all
            .clone()
            .map(|k| {
                let b = num.iter().fold(Complex64::new(0.0, 0.0), |sum, c| sum * s(k) + c);
                weights[k] / (b * spectra.hold[k])
            })
            .collect();
        let powers = |of: &[Complex64], i: usize| -> Vec<f64> {
            let value = |k: usize| of[k] * factor[k] * s(k).powu(i as u32);
            stacked(all.clone().map(value))
        };
        let ones = vec![Complex64::new(1.0, 0.0); spectra.omega.len()];
        let mut transient: Vec<Vec<f64>> = Vec::new();
        for i in 0..=n + 1 {
            let mut column = powers(&ones, i);
            let before = dot(&column, &column).sqrt();
            remove(&mut column, &transient);
            remove(&mut column, &transient);
            let norm = dot(&column, &column).sqrt();
            if norm > 1e-9 * before {
                column.iter_mut().for_each(|v| *v /= norm);
                transient.push(column);
            }
        }
        let free = |of: &[Complex64], i: usize| {
            let mut column = powers(of, i);
            remove(&mut column, &transient);
            column
        };
        Self {
            m,
            of_e: (0..n).map(|i| free(&spectra.e, i)).collect(),
            of_targets: spectra
                .targets
                .iter()
                .flat_map(|target| (0..=n).map(|i| free(target, i)).collect::<Vec<_>>())
                .collect(),
            right: free(&spectra.e, n),
            spectra,
            factor,
            transient,
        }
    }

    /// Columns of B and of `B kappa` at the delays of u and of the disturbances.
    fn of_inputs(&self, delay_s: f64, of_disturbances_s: f64) -> Vec<Vec<f64>> {
        let disturbances = self.spectra.disturbances.iter().map(|d| (d, of_disturbances_s));
        let inputs = [(&self.spectra.u, delay_s)].into_iter().chain(disturbances);
        let column = |of: &[Complex64], delay_s: f64, i: usize| {
            let value = |(k, &omega): (usize, &f64)| {
                let s = Complex64::new(0.0, omega);
                of[k] * self.spectra.hold[k] * self.factor[k] * s.powu(i as u32) * (-s * delay_s).exp()
            };
            let mut column = stacked(self.spectra.omega.iter().enumerate().map(value));
            remove(&mut column, &self.transient);
            column
        };
        inputs
            .flat_map(|(of, delay_s)| (0..=self.m).map(move |i| (of, delay_s, i)))
            .map(|(of, delay_s, i)| column(of, delay_s, i))
            .collect()
    }
}

/// Real parts, then imaginary parts.
fn stacked(values: impl Iterator<Item = Complex64> + Clone) -> Vec<f64> {
    values.clone().map(|v| v.re).chain(values.map(|v| v.im)).collect()
}

/// Removes the components along orthonormal columns.
fn remove(column: &mut [f64], orthonormal: &[Vec<f64>]) {
    for q in orthonormal {
        let along = dot(q, column);
        add_scaled(column, -along, q);
    }
}

/// The least-squares solution of all records at a delay.
struct Solved {
    /// `a_0 .. a_{n-1}`, `b_0 .. b_m` of u, then the others.
    theta: Vec<f64>,
    delay_s: f64,
    sum_of_squares: f64,
    /// Power of `B (U + kappa D)` and the residuals, of which the sum of squares is unexplained.
    power: f64,
    residuals: Vec<f64>,
}

impl Solved {
    /// The solutions with the disturbances as late as u, and on time.
    fn all(rows: &[Rows<'_>], delay_s: f64) -> impl Iterator<Item = Self> {
        let disturbed = rows.iter().any(|rows| !rows.spectra.disturbances.is_empty());
        let on_time = (disturbed && delay_s != 0.0).then_some(0.0);
        let cases = [Some(delay_s), on_time].into_iter().flatten();
        cases.filter_map(move |of_disturbances| Self::of(rows, delay_s, of_disturbances))
    }

    fn of(rows: &[Rows<'_>], delay_s: f64, of_disturbances_s: f64) -> Option<Self> {
        let blocks: Vec<Vec<Vec<f64>>> = rows
            .iter()
            .map(|rows| {
                let negative = rows.of_e.iter().map(|c| c.iter().map(|v| -v).collect::<Vec<_>>());
                let inputs = rows.of_inputs(delay_s, of_disturbances_s);
                let inputs = inputs.into_iter().map(|c| c.iter().map(|v| -v).collect());
                negative.chain(inputs).chain(rows.of_targets.iter().cloned()).collect()
            })
            .collect();
        let p = blocks.first()?.len();
        let column = |j: usize| -> Vec<f64> { blocks.iter().flat_map(|block| block[j].iter().copied()).collect() };
        let columns: Vec<Vec<f64>> = (0..p).map(column).collect();
        let right: Vec<f64> = rows.iter().flat_map(|rows| rows.right.iter().copied()).collect();
        let freedom: usize = p + rows.iter().map(|rows| rows.transient.len()).sum::<usize>();
        if right.len() < 3 * freedom || dot(&right, &right) == 0.0 {
            return None;
        }
        let solved = LeastSquares::factor(&mut columns.concat(), &mut right.clone());
        if !solved.has_full_rank() {
            return None;
        }
        let theta = solved.solution();
        let inputs = rows[0].of_e.len()..p - rows[0].of_targets.len();
        let mut residuals = right;
        (0..p).for_each(|j| add_scaled(&mut residuals, -theta[j], &columns[j]));
        let mut power = residuals.clone();
        inputs.for_each(|j| add_scaled(&mut power, theta[j], &columns[j]));
        Some(Self {
            sum_of_squares: dot(&residuals, &residuals),
            power: dot(&power, &power),
            theta,
            delay_s,
            residuals,
        })
    }
}

fn least(all: impl Iterator<Item = Solved>) -> Option<Solved> {
    all.min_by(|a, b| a.sum_of_squares.total_cmp(&b.sum_of_squares))
}

/// Weights from the smoothed spectrum of the residuals, which contain the weights before. Rounding has a floor, so
/// that exact data keep all frequencies.
fn smooth(weights: &mut [f64], residuals: &[f64], omega: &[f64], power: f64) {
    let n = omega.len();
    let own: Vec<f64> = (0..n)
        .map(|k| (residuals[k].powi(2) + residuals[n + k].powi(2)) / weights[k].powi(2))
        .collect();
    let floor = 1e-9 * power / n as f64;
    for (weight, at) in weights.iter_mut().zip(omega) {
        let near = (0..n).filter(|&k| (omega[k] / at).ln().abs() < SMOOTHED);
        let (sum, count) = near.fold((0.0, 0.0), |(sum, count), k| (sum + own[k], count + 1.0));
        *weight = 1.0 / (sum / count + floor).sqrt();
    }
}

#[cfg(test)]
#[path = "recorded_element/tests.rs"]
mod tests;
