//! Crossover frequency and margins of `L = H H_CE` by interpolation between the lines.
//!
//! Magnitude in dB and phase are interpolated linearly over log omega between neighbouring lines. The crossover is the
//! frequency at which the magnitude passes 0 dB; the phase margin is 180 deg plus the phase at this frequency. If there
//! are several crossovers, the lowest one with a falling magnitude is returned: the describing function of one run
//! scatters above the crossover, where coherence is low, and may pass 0 dB there again. The phase is unwrapped from one
//! line to the next by the smaller change. A delay makes the phase curved over log omega: between lines half an octave
//! apart, linear interpolation gives a phase that is about a degree too low. Removing the delay before the
//! interpolation and adding it afterwards avoids this error. The gain margin is the negative magnitude at the frequency
//! at which the phase falls through -180 deg, found in the same way; if there are several such frequencies, the gain
//! margin nearest to 0 dB is returned. Standard errors come from the jackknife over runs (`ratio.rs`); the spread is
//! the standard deviation of single runs.

use hoid_model::{Complex64, ContinuousTransferFunction};

use super::{
    DescribingFunction,
    excitation::refuse,
    ratio::{jackknife, standard_deviation},
};
use crate::{IdentError, derived_quantities::MarginEstimates};

/// Frequency response of an open loop at the lines.
#[derive(Debug, Clone, PartialEq)]
pub struct OpenLoop {
    /// Frequencies of the lines, rad/s.
    pub omega_rad_s: Vec<f64>,
    /// L at each line, computed from the average describing function.
    pub response: Vec<Complex64>,
    /// L of each run: `per_run[i][k]` is the value of run i at line k.
    pub per_run: Vec<Vec<Complex64>>,
    /// L at each line, computed from the averages over all runs except run i, for each i.
    leave_one_out: Vec<Vec<Complex64>>,
}

/// A frequency at which `|L|` passes 1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Crossover {
    /// Frequency omega_c, rad/s.
    pub omega_rad_s: f64,
    /// Phase margin at the frequency omega_c, deg, between -180 and 180.
    pub phase_margin_deg: f64,
}

/// Crossover and margins with their standard errors, and their spread over the runs.
#[derive(Debug, Clone, PartialEq)]
pub struct DescribingMargins {
    /// Crossover and margins; a quantity is `None` if its crossing does not exist between the lines.
    pub estimates: MarginEstimates,
    /// Crossover of each run; `None` for a run without a crossover.
    pub per_run: Vec<Option<Crossover>>,
    /// Standard deviation of the crossover over the runs that have a crossover, rad/s.
    pub crossover_spread_rad_s: Option<f64>,
    /// Standard deviation of the phase margin over the runs that have a crossover, deg.
    pub phase_margin_spread_deg: Option<f64>,
}

impl DescribingFunction {
    /// Returns the open loop with a known controlled element.
    pub fn open_loop(&self, element: &ContinuousTransferFunction) -> OpenLoop {
        self.open_loop_with(|omega| element.response(omega))
    }

    /// Returns the open loop with an element given by its frequency response as a function of rad/s, such as the
    /// response of the controlled element with its hold.
    pub fn open_loop_with(&self, element: impl Fn(f64) -> Complex64) -> OpenLoop {
        let known: Vec<Complex64> = self.lines.iter().map(|l| element(l.omega_rad_s)).collect();
        self.build_open_loop(|k, _| known[k], |k, _| known[k])
    }

    /// Returns the open loop with the controlled element estimated from the records.
    ///
    /// # Errors
    /// [`IdentError::BadOption`] if [`super::DescribingOptions::element`] does not name the channels of the element.
    pub fn measured_open_loop(&self) -> Result<OpenLoop, IdentError> {
        let ratios: Vec<_> = self.lines.iter().filter_map(|l| l.element_ratio.as_ref()).collect();
        if ratios.len() < self.lines.len() {
            return refuse(
                "the controlled element",
                "no output channel",
                "an output channel, named in the options of describe",
            );
        }
        let per_run: Vec<Vec<Complex64>> = ratios.iter().map(|r| r.run_ratios()).collect();
        Ok(self.build_open_loop(|k, without| ratios[k].value(without), |k, i| per_run[k][i]))
    }

    fn build_open_loop(
        &self,
        element: impl Fn(usize, Option<usize>) -> Complex64,
        of_run: impl Fn(usize, usize) -> Complex64,
    ) -> OpenLoop {
        let lines = || self.lines.iter().enumerate();
        let average = |without| {
            lines()
                .map(|(k, l)| l.ratio.value(without) * element(k, without))
                .collect()
        };
        let runs = self.runs.len();
        OpenLoop {
            omega_rad_s: self.lines.iter().map(|l| l.omega_rad_s).collect(),
            response: average(None),
            per_run: (0..runs)
                .map(|i| lines().map(|(k, l)| l.per_run[i] * of_run(k, i)).collect())
                .collect(),
            leave_one_out: if runs > 1 {
                (0..runs).map(|i| average(Some(i))).collect()
            } else {
                Vec::new()
            },
        }
    }
}

impl OpenLoop {
    /// Returns the crossover frequency, the phase margin and the gain margin.
    pub fn margins(&self) -> DescribingMargins {
        self.margins_with_delay(0.0)
    }

    /// Returns the margins, with the phase of a delay in s removed during the interpolation.
    /// [`DescribingFunction::fit_gain_lead_delay`] gives such a delay.
    pub fn margins_with_delay(&self, delay_s: f64) -> DescribingMargins {
        let of = |response: &Vec<Complex64>| Crossover::of(&self.omega_rad_s, response, delay_s);
        let without: Vec<Option<Crossover>> = self.leave_one_out.iter().map(of).collect();
        let per_run: Vec<Option<Crossover>> = self.per_run.iter().map(of).collect();
        let estimate = |get: fn(&Crossover) -> f64| {
            let others: Vec<Option<f64>> = without.iter().map(|c| c.as_ref().map(get)).collect();
            of(&self.response).map(|c| jackknife(get(&c), &others))
        };
        let turning = |response: &Vec<Complex64>| PhaseCrossover::of(&self.omega_rad_s, response, delay_s);
        let turning_without: Vec<Option<PhaseCrossover>> = self.leave_one_out.iter().map(turning).collect();
        let of_turning = |get: fn(&PhaseCrossover) -> f64| {
            let others: Vec<Option<f64>> = turning_without.iter().map(|c| c.as_ref().map(get)).collect();
            turning(&self.response).map(|c| jackknife(get(&c), &others))
        };
        let spread = |get: fn(&Crossover) -> f64| {
            let known: Vec<f64> = per_run.iter().flatten().map(get).collect();
            standard_deviation(&known)
        };
        DescribingMargins {
            estimates: MarginEstimates {
                crossover_rad_s: estimate(|c| c.omega_rad_s),
                phase_margin_deg: estimate(|c| c.phase_margin_deg),
                phase_crossover_rad_s: of_turning(|c| c.omega_rad_s),
                gain_margin_db: of_turning(|c| c.gain_margin_db),
            },
            crossover_spread_rad_s: spread(|c| c.omega_rad_s),
            phase_margin_spread_deg: spread(|c| c.phase_margin_deg),
            per_run,
        }
    }
}

impl Crossover {
    /// Returns the lowest crossover of an open loop at which its magnitude falls; `None` if there is no such crossover.
    /// The response is given at ascending frequencies in rad/s. The phase of the delay in s is removed during the
    /// interpolation.
    pub fn of(omega_rad_s: &[f64], response: &[Complex64], delay_s: f64) -> Option<Self> {
        let mut pairs = omega_rad_s.windows(2).zip(response.windows(2));
        pairs.find_map(|(w, l)| {
            let (above, below) = (l[0].norm().ln(), l[1].norm().ln());
            if !(above >= 0.0 && below < 0.0 && (above - below).is_finite()) {
                return None;
            }
            let part = above / (above - below);
            let at = w[0] * (part * (w[1] / w[0]).ln()).exp();
            let by_delay = |omega: f64| Complex64::from_polar(1.0, -delay_s * omega);
            let rest = l[1] / l[0] / by_delay(w[1] - w[0]);
            let turn = (-l[0] * by_delay(at - w[0])).arg() + part * rest.arg();
            let found = Self {
                omega_rad_s: at,
                phase_margin_deg: Complex64::from_polar(1.0, turn).arg().to_degrees(),
            };
            found.phase_margin_deg.is_finite().then_some(found)
        })
    }
}

/// A frequency at which the phase of L falls through -180 deg.
#[derive(Debug, Clone, Copy, PartialEq)]
struct PhaseCrossover {
    omega_rad_s: f64,
    gain_margin_db: f64,
}

impl PhaseCrossover {
    /// Returns the crossing at which the phase falls through -180 deg with the magnitude nearest to 1; `None` if there
    /// is no such crossing.
    fn of(omega_rad_s: &[f64], response: &[Complex64], delay_s: f64) -> Option<Self> {
        let of_pair = |(w, l): (&[f64], &[Complex64])| {
            let by_delay = |omega: f64| Complex64::from_polar(1.0, -delay_s * omega);
            let rest = (l[1] / l[0] / by_delay(w[1] - w[0])).arg();
            // Phase plus 180 deg, at a fraction of the interval between two lines in log omega.
            let ratio = (w[1] / w[0]).ln();
            let above = |part: f64| {
                let turned = part * rest - delay_s * w[0] * ((part * ratio).exp() - 1.0);
                (-l[0]).arg() + turned
            };
            if !(above(0.0) >= 0.0 && above(1.0) < 0.0) {
                return None;
            }
            let (mut low, mut high) = (0.0, 1.0);
            for _ in 0..60 {
                let middle = 0.5 * (low + high);
                if above(middle) >= 0.0 {
                    low = middle;
                } else {
                    high = middle;
                }
            }
            let logs = (l[0].norm().ln(), l[1].norm().ln());
            let found = Self {
                omega_rad_s: w[0] * (low * ratio).exp(),
                gain_margin_db: -20.0 / std::f64::consts::LN_10 * (logs.0 + low * (logs.1 - logs.0)),
            };
            (found.omega_rad_s.is_finite() && found.gain_margin_db.is_finite()).then_some(found)
        };
        let pairs = omega_rad_s.windows(2).zip(response.windows(2));
        pairs
            .filter_map(of_pair)
            .min_by(|a, b| a.gain_margin_db.abs().total_cmp(&b.gain_margin_db.abs()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn crossover_of_a_log_linear_response_is_exact() {
        // The magnitude is that of k/s, and the phase is linear over log omega, so the interpolation is exact.
        let omega: [f64; 4] = [0.3, 1.0, 4.0, 11.0];
        let phase = |w: f64| -100.0 - 30.0 * w.ln();
        let response: Vec<Complex64> = omega
            .iter()
            .map(|w| Complex64::from_polar(2.5 / w, phase(*w).to_radians()))
            .collect();
        let found = Crossover::of(&omega, &response, 0.0).unwrap();
        assert!((found.omega_rad_s - 2.5).abs() < 1e-12);
        assert!((found.phase_margin_deg - (180.0 + phase(2.5))).abs() < 1e-10);
        // The response is rotated about the origin across the negative axis.
        let turned: Vec<Complex64> = response.iter().map(|l| l * Complex64::from_polar(1.0, -1.2)).collect();
        let found = Crossover::of(&omega, &turned, 0.0).unwrap();
        assert!((found.phase_margin_deg - (180.0 + phase(2.5) - 1.2_f64.to_degrees())).abs() < 1e-10);
    }

    #[test]
    fn known_delay_makes_the_interpolation_exact() {
        let omega = [0.7, 3.0, 9.0];
        let response: Vec<Complex64> = omega
            .iter()
            .map(|w| Complex64::new(0.0, -4.0 / w) * Complex64::from_polar(1.0, -0.3 * w))
            .collect();
        let found = Crossover::of(&omega, &response, 0.3).unwrap();
        assert!((found.omega_rad_s - 4.0).abs() < 1e-12);
        assert!((found.phase_margin_deg - (90.0 - 1.2_f64.to_degrees())).abs() < 1e-10);
        assert!(Crossover::of(&omega, &response, 0.0).unwrap().phase_margin_deg < found.phase_margin_deg - 1.0);
        assert_eq!(Crossover::of(&omega, &response, f64::NAN), None);
    }

    #[test]
    fn gain_margin_is_taken_where_the_phase_falls_below_minus_180() {
        // For 4/s with a delay of 0.3 s the phase is -180 deg at pi/0.6, where the gain is 4 * 0.6/pi.
        let omega = [0.7, 3.0, 9.0, 14.0];
        let response: Vec<Complex64> = omega
            .iter()
            .map(|w| Complex64::new(0.0, -4.0 / w) * Complex64::from_polar(1.0, -0.3 * w))
            .collect();
        let at = std::f64::consts::PI / 0.6;
        let found = PhaseCrossover::of(&omega, &response, 0.3).unwrap();
        assert!((found.omega_rad_s - at).abs() < 1e-12);
        assert!((found.gain_margin_db + 20.0 * (4.0 / at).log10()).abs() < 1e-12);
        // If the delay is not removed, the phase is interpolated linearly over log omega from 3 to 9 rad/s.
        let straight = PhaseCrossover::of(&omega, &response, 0.0).unwrap();
        let part = (0.5 * std::f64::consts::PI - 0.9) / 1.8;
        assert!((straight.omega_rad_s - 3.0 * 3.0_f64.powf(part)).abs() < 1e-12);
        assert_eq!(PhaseCrossover::of(&omega[..2], &response[..2], 0.3), None);
        let rising: Vec<Complex64> = response.iter().map(|l| l.conj()).collect();
        assert_eq!(PhaseCrossover::of(&omega, &rising, -0.3), None);
        let broken = [Complex64::new(f64::NAN, 0.0); 2];
        assert_eq!(PhaseCrossover::of(&[1.0, 2.0], &broken, 0.0), None);
        assert_eq!(PhaseCrossover::of(&[], &[], 0.0), None);
    }

    #[test]
    fn missing_crossover_gives_none() {
        let omega = [1.0, 2.0];
        let small = [Complex64::new(0.5, 0.0), Complex64::new(0.1, 0.0)];
        assert_eq!(Crossover::of(&omega, &small, 0.0), None);
        let rising = [Complex64::new(0.1, 0.0), Complex64::new(2.0, 0.0)];
        assert_eq!(Crossover::of(&omega, &rising, 0.0), None);
        let broken = [Complex64::new(f64::NAN, 0.0), Complex64::new(0.0, 0.0)];
        assert_eq!(Crossover::of(&omega, &broken, 0.0), None);
        assert_eq!(Crossover::of(&[], &[], 0.0), None);
    }
}
