//! Crossover frequency and phase margin of `L = H H_CE` between the lines.
//!
//! Magnitude in dB and phase are taken as straight lines over log omega between neighbouring lines.
//! The crossover is where the magnitude passes 0 dB; the phase margin is 180 deg plus the phase
//! there. Where there are several, the lowest at which the magnitude falls is given: the describing
//! function of one run scatters above the crossover, where coherence is low, and may pass 0 dB
//! there again. The phase is followed from one line to the next along the shorter way. A delay
//! bends the phase over log omega, so that between lines half an octave apart the straight line is
//! a degree or so too low; with the delay taken out before and put back after, it is not. Standard
//! errors are those of the jackknife over runs (`ratio.rs`); the spread is that of single runs.

use hoid_model::{Complex64, ContinuousTransferFunction, uncertainty::Estimate};

use super::{
    DescribingFunction,
    excitation::refuse,
    ratio::{deviation, jackknife},
};
use crate::IdentError;

/// An open loop at the lines.
#[derive(Debug, Clone, PartialEq)]
pub struct OpenLoop {
    /// The lines, rad/s.
    pub omega_rad_s: Vec<f64>,
    /// L of the average describing function.
    pub response: Vec<Complex64>,
    /// L of each run: `per_run[i][k]` of run i at line k.
    pub per_run: Vec<Vec<Complex64>>,
    /// L of all runs but one.
    without: Vec<Vec<Complex64>>,
}

/// Where `|L|` passes 1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Crossover {
    /// Frequency omega_c, rad/s.
    pub omega_rad_s: f64,
    /// Phase margin there, deg, between -180 and 180.
    pub phase_margin_deg: f64,
}

/// Crossover and phase margin with their uncertainty; `None` where no crossover lies between the
/// lines.
#[derive(Debug, Clone, PartialEq)]
pub struct DescribingMargins {
    /// Crossover frequency omega_c, rad/s.
    pub crossover_rad_s: Option<Estimate>,
    /// Phase margin phi_m, deg.
    pub phase_margin_deg: Option<Estimate>,
    /// Those of each run.
    pub per_run: Vec<Option<Crossover>>,
    /// Standard deviation of the crossover over the runs that have one, rad/s.
    pub crossover_spread_rad_s: Option<f64>,
    /// Standard deviation of the phase margin over these runs, deg.
    pub phase_margin_spread_deg: Option<f64>,
}

impl DescribingFunction {
    /// The open loop with a controlled element that is known.
    pub fn open_loop(&self, element: &ContinuousTransferFunction) -> OpenLoop {
        self.open_loop_with(|omega| element.response(omega))
    }

    /// The open loop with any frequency response over rad/s, such as that of the controlled element
    /// behind its hold.
    pub fn open_loop_with(&self, element: impl Fn(f64) -> Complex64) -> OpenLoop {
        let known: Vec<Complex64> = self.lines.iter().map(|l| element(l.omega_rad_s)).collect();
        self.loop_of(|k, _| known[k], |k, _| known[k])
    }

    /// The open loop with the controlled element that is estimated from the records.
    ///
    /// # Errors
    /// [`IdentError::BadOption`] when [`super::DescribingOptions::element`] did not name its
    /// channels.
    pub fn measured_open_loop(&self) -> Result<OpenLoop, IdentError> {
        let ratios: Vec<_> = self.lines.iter().filter_map(|l| l.element_ratio.as_ref()).collect();
        if ratios.len() < self.lines.len() {
            return refuse(
                "the controlled element",
                "no channel of its output",
                "one in the options of describe",
            );
        }
        let per_run: Vec<Vec<Complex64>> = ratios.iter().map(|r| r.per_run()).collect();
        Ok(self.loop_of(|k, without| ratios[k].value(without), |k, i| per_run[k][i]))
    }

    fn loop_of(
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
            without: if runs > 1 {
                (0..runs).map(|i| average(Some(i))).collect()
            } else {
                Vec::new()
            },
        }
    }
}

impl OpenLoop {
    /// Crossover frequency and phase margin.
    pub fn margins(&self) -> DescribingMargins {
        self.margins_with_delay(0.0)
    }

    /// The same with the phase interpolated apart from that of a delay in s, such as the one of
    /// [`DescribingFunction::fit_gain_lead_delay`].
    pub fn margins_with_delay(&self, delay_s: f64) -> DescribingMargins {
        let of = |response: &Vec<Complex64>| Crossover::of(&self.omega_rad_s, response, delay_s);
        let without: Vec<Option<Crossover>> = self.without.iter().map(of).collect();
        let per_run: Vec<Option<Crossover>> = self.per_run.iter().map(of).collect();
        let estimate = |get: fn(&Crossover) -> f64| {
            let others: Vec<Option<f64>> = without.iter().map(|c| c.as_ref().map(get)).collect();
            of(&self.response).map(|c| jackknife(get(&c), &others))
        };
        let spread = |get: fn(&Crossover) -> f64| {
            let known: Vec<f64> = per_run.iter().flatten().map(get).collect();
            deviation(&known)
        };
        DescribingMargins {
            crossover_rad_s: estimate(|c| c.omega_rad_s),
            phase_margin_deg: estimate(|c| c.phase_margin_deg),
            crossover_spread_rad_s: spread(|c| c.omega_rad_s),
            phase_margin_spread_deg: spread(|c| c.phase_margin_deg),
            per_run,
        }
    }
}

impl Crossover {
    /// The lowest crossover where the magnitude of an open loop falls, between ascending
    /// frequencies in rad/s at which its response is known; none where it does not. The phase of
    /// the delay in s is interpolated apart.
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_straight_line_is_crossed_where_it_is() {
        // k/s with a phase that is straight over log omega: exact by interpolation.
        let omega: [f64; 4] = [0.3, 1.0, 4.0, 11.0];
        let phase = |w: f64| -100.0 - 30.0 * w.ln();
        let response: Vec<Complex64> = omega
            .iter()
            .map(|w| Complex64::from_polar(2.5 / w, phase(*w).to_radians()))
            .collect();
        let found = Crossover::of(&omega, &response, 0.0).unwrap();
        assert!((found.omega_rad_s - 2.5).abs() < 1e-12);
        assert!((found.phase_margin_deg - (180.0 + phase(2.5))).abs() < 1e-10);
        // Around the negative axis, and beyond.
        let turned: Vec<Complex64> = response.iter().map(|l| l * Complex64::from_polar(1.0, -1.2)).collect();
        let found = Crossover::of(&omega, &turned, 0.0).unwrap();
        assert!((found.phase_margin_deg - (180.0 + phase(2.5) - 1.2_f64.to_degrees())).abs() < 1e-10);
    }

    #[test]
    fn a_delay_that_is_known_bends_nothing() {
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
    fn no_crossover_is_none() {
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
