//! Design of the most informative forcing function.
//!
//! If the remnant is a share of the variance of u, the errors depend on the distribution of the power of u over the
//! lines, and not on its size (`information`): with the shares q of the lines in the response of u to the forcing
//! function the information is `I = sum q_k M_k`. The requested quantities are parameters, crossover or margin, with
//! gradients g and accepted errors s; the design minimises `J = sum over wanted g' I^-1 g/s^2`, the sum of the squared
//! ratios of errors to accepted errors.
//!
//! - **Amplitudes.** J is convex in q. From equal shares, `q_k <- q_k sqrt(d_k/sum q d)`,
//!   `d_k = sum g' I^-1 M_k I^-1 g/s^2`, decreases J in every step (D. M. Titterington, *Applied Statistics* 27 (1978)
//!   227-234; Y. Yu, *Ann. Stat.* 38 (2010) 1593-1606). Each line keeps at least a part of an equal share, for people
//!   who differ from the assumed operator.
//! - **Frequencies.** Each line in turn is moved to multiples near it and keeps the one with the smallest J (V. V.
//!   Fedorov, *Theory of Optimal Experiments*, 1972), on condition that no line is a harmonic of another.
//! - **Limits.** If a target has much power above the crossover frequency, people lower their crossover frequency (D.
//!   T. McRuer and H. R. Jex, *IEEE Trans. Human Factors in Electronics* 8 (1967) 231-249): lines there form a shelf,
//!   with amplitudes up to a given part of the geometric mean of those below. Lines below are between half and twice
//!   that mean. The size is then the largest that satisfies the limits of the rms of e and u.

use std::f64::consts::TAU;

use hoid_model::forcing::{ForcingFunction, Sinusoid};
use hoid_numerics::statistics::mean;
use nalgebra::{DMatrix, DVector};

use super::{
    DesignError, Expected, Task, Wanted,
    information::{Loop, inverse},
    lines::{crest_factor, multiples, set_phases},
    periods,
};

/// Options of the design of a forcing function.
#[derive(Debug, Clone, PartialEq)]
pub struct Designing {
    /// The requested quantities; if empty, all parameters, each relative to its value.
    pub wanted: Vec<Wanted>,
    /// Period in s: the duration of a run, or an integer fraction of it.
    pub period_s: f64,
    /// Number of lines.
    pub lines: usize,
    /// The lowest and the highest frequency, rad/s.
    pub band_rad_s: (f64, f64),
    /// Largest amplitude of a line above the crossover, relative to the geometric mean of those below.
    pub shelf: f64,
    /// Largest rms of e and of u; without limits the forcing function has an rms of one.
    pub most_rms: [Option<f64>; 2],
    /// Start of the search for phases: each gives other phases of the same lines, so that a signal is not learned.
    pub seed: u64,
}

impl Default for Designing {
    fn default() -> Self {
        Self {
            wanted: Vec::new(),
            period_s: 81.92,
            lines: 10,
            band_rad_s: (0.2, 18.0),
            shelf: 0.2,
            most_rms: [None; 2],
            seed: 0,
        }
    }
}

/// A forcing function with its expected errors.
#[derive(Debug, Clone, PartialEq)]
pub struct Designed {
    /// The forcing function.
    pub forcing: ForcingFunction,
    /// Peak divided by rms.
    pub crest_factor: f64,
    /// Expected errors for one period.
    pub expected: Expected,
    /// Number of periods until every requested quantity has its accepted error; at least one.
    pub periods: usize,
}

/// Largest ratio of the amplitude of a line below the crossover to their geometric mean; its inverse is the smallest.
const WITHIN: f64 = 2.0;
/// Part of an equal share that each line keeps at least.
const LEAST_SHARE: f64 = 0.1;
/// Steps of the iteration of the shares, and steps if a line is moved for a trial.
const STEPS: usize = 400;
const STEPS_OF_TRIAL: usize = 60;
/// Multiples by which a line is moved, and number of rounds.
const MOVES: [i64; 6] = [-4, -2, -1, 1, 2, 4];
const ROUNDS: usize = 3;
/// Least relative improvement for which a line is moved.
const WORTH: f64 = 1e-3;

impl Designing {
    /// Designs the forcing function.
    ///
    /// # Errors
    /// [`DesignError`] as for [`super::expected`], and if a requested quantity does not exist.
    pub fn run(&self, task: &Task) -> Result<Designed, DesignError> {
        let least = (self.band_rad_s.0 * self.period_s / TAU).ceil();
        let largest = (self.band_rad_s.1 * self.period_s / TAU).floor();
        if !(least >= 1.0 && largest > least && largest < 1e5) {
            return Err(DesignError::OutOfRange {
                quantity: "highest frequency of the lines in whole periods of the forcing function",
                found: largest,
                expected: "above the lowest, which is one or more, and below 100000",
            });
        }
        let all = Loop::of(task)?;
        let search = Search {
            all: &all,
            gradients: self.gradients(&all)?,
            period_s: self.period_s,
            shelf: self.shelf,
        };
        let mut places = multiples(least as u32, largest as u32, self.lines);
        let (mut shares, mut best) = search.shares(&places, STEPS)?;
        for _ in 0..ROUNDS {
            let before = best;
            for k in 0..places.len() {
                for by in MOVES {
                    let moved = i64::from(places[k]) + by;
                    let others = || {
                        places
                            .iter()
                            .enumerate()
                            .filter(|(j, _)| *j != k)
                            .map(|(_, m)| i64::from(*m))
                    };
                    let inside = moved >= least as i64 && moved <= largest as i64;
                    if !inside || others().any(|m| moved % m == 0 || m % moved == 0) {
                        continue;
                    }
                    let mut trial = places.clone();
                    trial[k] = moved as u32;
                    if let Ok((found, criterion)) = search.shares(&trial, STEPS_OF_TRIAL)
                        && criterion < best * (1.0 - WORTH)
                    {
                        (places, shares, best) = (trial, found, criterion);
                    }
                }
            }
            if best >= before {
                break;
            }
        }
        let (found, _) = search.shares(&places, STEPS).unwrap_or((shares, best));
        let mut lines = search.lines(&places, &found);
        lines.sort_by(|a, b| a.omega_rad_s.total_cmp(&b.omega_rad_s));
        let of_one = all.expected(&ForcingFunction::new(lines.clone())?, self.period_s)?;
        let limits = [of_one.rms_e, of_one.rms_u].into_iter().zip(self.most_rms);
        let scale = limits
            .filter_map(|(rms, most)| Some(most? / rms))
            .fold(f64::INFINITY, f64::min);
        if scale.is_finite() {
            lines.iter_mut().for_each(|line| line.amplitude_deg *= scale);
        }
        set_phases(&mut lines, self.period_s, self.seed);
        let forcing = ForcingFunction::new(lines)?;
        let expected = all.expected(&forcing, self.period_s)?;
        Ok(Designed {
            crest_factor: crest_factor(forcing.sinusoids(), self.period_s),
            periods: periods(&expected, &self.wanted),
            expected,
            forcing,
        })
    }

    /// Gradients of the requested quantities, each divided by the accepted error.
    fn gradients(&self, all: &Loop<'_>) -> Result<Vec<DVector<f64>>, DesignError> {
        let known = all.gradients();
        let of = |wanted: &Wanted| {
            let (_, gradient, scale) = known.iter().find(|(name, _, _)| *name == wanted.name).ok_or_else(|| {
                let names: Vec<&str> = known.iter().map(|(name, _, _)| *name).collect();
                DesignError::NotThere {
                    name: wanted.name.clone(),
                    expected: names.join(", "),
                }
            })?;
            if !(wanted.error.is_finite() && wanted.error > 0.0) {
                return Err(DesignError::OutOfRange {
                    quantity: "error that is accepted",
                    found: wanted.error,
                    expected: "a positive number",
                });
            }
            Ok(gradient / (scale * wanted.error))
        };
        if self.wanted.is_empty() {
            let parameters = known
                .iter()
                .filter(|(name, _, _)| !matches!(*name, "crossover" | "phase_margin"));
            return Ok(parameters.map(|(_, gradient, scale)| gradient / *scale).collect());
        }
        self.wanted.iter().map(of).collect()
    }
}

struct Search<'a> {
    all: &'a Loop<'a>,
    gradients: Vec<DVector<f64>>,
    period_s: f64,
    shelf: f64,
}

impl Search<'_> {
    fn omega(&self, multiple: u32) -> f64 {
        f64::from(multiple) * TAU / self.period_s
    }

    /// Returns the best shares of lines at these frequencies, and J.
    fn shares(&self, places: &[u32], steps: usize) -> Result<(Vec<f64>, f64), DesignError> {
        let by_share: Vec<DMatrix<f64>> = places
            .iter()
            .map(|m| self.all.information_by_share(self.omega(*m)))
            .collect();
        let n = places.len();
        let mut shares = vec![1.0 / n as f64; n];
        let mut last = f64::INFINITY;
        for step in 0..steps {
            let information = by_share.iter().zip(&shares).fold(
                DMatrix::zeros(by_share[0].nrows(), by_share[0].ncols()),
                |sum, (m, q)| sum + m * *q,
            );
            let covariance = inverse(&information).ok_or(DesignError::NotIdentifiable {
                lines: n,
                coordinates: information.nrows(),
            })?;
            let directions: Vec<DVector<f64>> = self.gradients.iter().map(|g| &covariance * g).collect();
            let criterion: f64 = directions.iter().zip(&self.gradients).map(|(c, g)| c.dot(g)).sum();
            last = criterion;
            if step + 1 == steps {
                break;
            }
            let slope = |m: &DMatrix<f64>| -> f64 { directions.iter().map(|c| (m * c).dot(c)).sum() };
            let moved: Vec<f64> = by_share
                .iter()
                .zip(&shares)
                .map(|(m, q)| q * (slope(m) / criterion).sqrt())
                .collect();
            let whole: f64 = moved.iter().sum();
            let least = LEAST_SHARE / n as f64;
            shares = moved.iter().map(|q| (q / whole).max(least)).collect();
            self.limit(places, &mut shares);
        }
        Ok((shares, last))
    }

    /// Limits the amplitudes of the lines, redistributes the rest, and normalises the sum to one.
    fn limit(&self, places: &[u32], shares: &mut [f64]) {
        let lines: Vec<(f64, bool)> = places
            .iter()
            .map(|m| (self.omega(*m), self.omega(*m) > self.all.crossover_rad_s))
            .map(|(omega, beyond)| (self.all.control_by_power(omega), beyond))
            .collect();
        let below = lines.iter().zip(shares.iter()).filter(|((_, beyond), _)| !beyond);
        let logarithms: Vec<f64> = below.map(|((control, _), q)| (q / control).ln()).collect();
        if !logarithms.is_empty() {
            let level = mean(&logarithms).exp();
            for ((control, beyond), q) in lines.iter().zip(shares.iter_mut()) {
                let power = *q / control;
                *q = control
                    * match beyond {
                        true => power.min(self.shelf * self.shelf * level),
                        false => power.clamp(level / (WITHIN * WITHIN), level * WITHIN * WITHIN),
                    };
            }
        }
        let whole: f64 = shares.iter().sum();
        shares.iter_mut().for_each(|q| *q /= whole);
    }

    /// Returns lines with these shares and a total rms of one.
    fn lines(&self, places: &[u32], shares: &[f64]) -> Vec<Sinusoid> {
        let power = |(m, q): (&u32, &f64)| q / self.all.control_by_power(self.omega(*m));
        let powers: Vec<f64> = places.iter().zip(shares).map(power).collect();
        let whole: f64 = powers.iter().sum();
        let line = |(m, p): (&u32, &f64)| Sinusoid {
            amplitude_deg: (2.0 * p / whole).sqrt(),
            omega_rad_s: self.omega(*m),
            phase_rad: 0.0,
        };
        places.iter().zip(&powers).map(line).collect()
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::{super::information::tests::task, *};

    #[test]
    fn a_design_tells_more_than_the_lines_of_the_text() {
        let task = task(0.2);
        let designed = Designing::default().run(&task).unwrap();
        let text = super::super::expected(&task, &ForcingFunction::reference(), 81.92).unwrap();
        let sum = |of: &Expected| -> f64 {
            of.parameters
                .iter()
                .map(|p| (p.estimate.standard_error.unwrap() / p.estimate.value).powi(2))
                .sum()
        };
        println!(
            "J {} for {}, crest factor {}",
            sum(&designed.expected),
            sum(&text),
            designed.crest_factor
        );
        assert!(sum(&designed.expected) < 0.7 * sum(&text));
        assert!(designed.crest_factor < 2.5 && designed.periods == 1);
        assert!((designed.forcing.rms_deg() - 1.0).abs() < 1e-9);
        assert_eq!(designed, Designing::default().run(&task).unwrap());
        // The shelf above the crossover, and no dominant line.
        let crossover = designed.expected.crossover_rad_s.value;
        let amplitudes = |beyond: bool| -> Vec<f64> {
            let of = designed
                .forcing
                .sinusoids()
                .iter()
                .filter(|l| (l.omega_rad_s > crossover) == beyond);
            of.map(|l| l.amplitude_deg).collect()
        };
        let below = amplitudes(false);
        let level = mean(&below.iter().map(|a| a.ln()).collect::<Vec<_>>()).exp();
        assert!(
            amplitudes(true).iter().all(|a| *a < 0.25 * level),
            "{:?}",
            designed.forcing
        );
        assert!(
            below.iter().all(|a| (0.4 * level..2.5 * level).contains(a)),
            "{:?}",
            designed.forcing
        );
    }

    #[test]
    fn what_is_wanted_is_told_better() {
        let task = task(0.2);
        let of = |name: &str| {
            let wanted = vec![Wanted {
                name: name.to_owned(),
                error: 0.02,
            }];
            let designed = Designing {
                wanted,
                ..Designing::default()
            }
            .run(&task)
            .unwrap();
            let error = |name: &str| designed.expected.relative_error(name).unwrap();
            assert_eq!(designed.periods, (error(name) / 0.02).powi(2).ceil().max(1.0) as usize);
            [error("crossover"), error("omega_nm")]
        };
        let (crossover, omega) = (of("crossover"), of("omega_nm"));
        assert!(
            crossover[0] < omega[0] && omega[1] < crossover[1],
            "{crossover:?} {omega:?}"
        );
        let wanted = vec![Wanted {
            name: "T_I".to_owned(),
            error: 0.1,
        }];
        let error = Designing {
            wanted,
            ..Designing::default()
        }
        .run(&task)
        .unwrap_err();
        assert!(error.to_string().contains("crossover, phase_margin"), "{error}");
    }

    #[test]
    fn limits_are_kept() {
        let task = task(0.2);
        let of = |most_rms| {
            Designing {
                most_rms,
                ..Designing::default()
            }
            .run(&task)
            .unwrap()
            .expected
        };
        let small = of([Some(0.5), Some(100.0)]);
        assert!((small.rms_e - 0.5).abs() < 1e-9 && small.rms_u < 100.0);
        let weak = of([None, Some(0.1)]);
        assert!((weak.rms_u - 0.1).abs() < 1e-9);
        let error = Designing {
            band_rad_s: (3.0, 2.0),
            ..Designing::default()
        }
        .run(&task)
        .unwrap_err();
        assert!(matches!(error, DesignError::OutOfRange { .. }));
        assert!(matches!(
            Designing {
                lines: 1,
                ..Designing::default()
            }
            .run(&task),
            Err(DesignError::NotIdentifiable { .. })
        ));
    }
}
