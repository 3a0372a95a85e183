//! Crossover frequency and phase margin of an operator of the family with its controlled element.
//!
//! `L(omega) = Y(j omega) Z(omega) Y_c(j omega)`, Z the hold of the error. The crossover is the
//! lowest frequency at which `|L|` falls through one, as for a describing function
//! ([`crate::frequency`]): a neuromuscular resonance may lift `|L|` above one again. Where `|L| = 1`
//! stays so while the coordinates x move,
//!
//! `d omega_c = -(d ln|L|/dx)/(d ln|L|/d omega)`,
//! `d phi_m = d arg L/dx + (d arg L/d omega) d omega_c`.

use hoid_model::{
    Complex64, ContinuousTransferFunction, FamilyOperator, SampleTime,
    uncertainty::{Estimate, variance_along},
};

use super::response_fit::hold;

/// Where crossovers are looked for, rad/s.
const RANGE_RAD_S: (f64, f64) = (0.05, 60.0);
/// Quantile of the normal distribution for 95 %.
const NORMAL: f64 = 1.959_963_984_540_054;
/// Points of the scan.
const POINTS: usize = 400;

/// Crossover and phase margin with their errors.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LoopMeasures {
    /// Crossover frequency omega_c, rad/s.
    pub crossover_rad_s: Estimate,
    /// Phase margin phi_m, deg, between -180 and 180.
    pub phase_margin_deg: Estimate,
    /// Quantile for the intervals of 95 %: Student's where the errors rest on few clusters.
    pub quantile: f64,
}

impl LoopMeasures {
    /// Interval of 95 % of the crossover frequency, rad/s.
    pub fn crossover_interval(&self) -> Option<(f64, f64)> {
        self.interval(self.crossover_rad_s)
    }

    /// Interval of 95 % of the phase margin, deg.
    pub fn phase_margin_interval(&self) -> Option<(f64, f64)> {
        self.interval(self.phase_margin_deg)
    }

    fn interval(&self, of: Estimate) -> Option<(f64, f64)> {
        let reach = self.quantile * of.standard_error?;
        Some((of.value - reach, of.value + reach))
    }
}

/// The measures of an operator whose coordinates have this covariance; `None` where `|L|` does not
/// fall through one.
pub fn loop_measures(
    operator: &FamilyOperator,
    covariance: Option<&[f64]>,
    element: &ContinuousTransferFunction,
    sample_time: SampleTime,
) -> Option<LoopMeasures> {
    let open_loop = |omega: f64| operator.response(omega) * hold(omega, sample_time) * element.response(omega);
    let highest = RANGE_RAD_S.1.min(0.9 * sample_time.nyquist_rad_s());
    let at = |i: usize| RANGE_RAD_S.0 * (highest / RANGE_RAD_S.0).powf(i as f64 / (POINTS as f64 - 1.0));
    let falls = |i: &usize| open_loop(at(*i)).norm() >= 1.0 && open_loop(at(i + 1)).norm() < 1.0;
    let bracket = (0..POINTS - 1).find(falls)?;
    let (mut low, mut high) = (at(bracket), at(bracket + 1));
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if open_loop(middle).norm() >= 1.0 {
            low = middle;
        } else {
            high = middle;
        }
    }
    let omega = 0.5 * (low + high);
    let margin = (-open_loop(omega)).arg().to_degrees();
    // d ln L / d omega by a central difference of a smooth function.
    let h = 1e-5 * omega;
    let slope: Complex64 = (open_loop(omega + h) / open_loop(omega - h)).ln() / (2.0 * h);
    let response = operator.response_and_gradient(omega);
    let relative: Vec<Complex64> = response.gradient.iter().map(|g| g / response.value).collect();
    let by_crossover: Vec<f64> = relative.iter().map(|r| -r.re / slope.re).collect();
    let by_margin: Vec<f64> = relative
        .iter()
        .zip(&by_crossover)
        .map(|(r, d)| (r.im + slope.im * d).to_degrees())
        .collect();
    let estimate = |value: f64, gradient: &[f64]| match covariance {
        Some(c) => Estimate::with_variance(value, variance_along(gradient, c)),
        None => Estimate::fixed(value),
    };
    Some(LoopMeasures {
        crossover_rad_s: estimate(omega, &by_crossover),
        phase_margin_deg: estimate(margin, &by_margin),
        quantile: NORMAL,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use hoid_model::Form;

    fn operator(x: &[f64]) -> FamilyOperator {
        FamilyOperator::new(Form::LeadLag, true, x).unwrap()
    }

    const X: [f64; 6] = [5.6, 0.6, 0.1, 2.7, -1.7, 0.14];

    #[test]
    fn a_gain_over_an_integrator_crosses_at_the_gain() {
        let gain = FamilyOperator::new(Form::Gain, true, &[2.0, 100.0_f64.ln(), 0.7_f64.ln(), 0.1]).unwrap();
        let element = ContinuousTransferFunction::new(&[1.0], &[1.0, 0.0]).unwrap();
        let found = loop_measures(&gain, None, &element, SampleTime::new(1e-4).unwrap()).unwrap();
        assert!((found.crossover_rad_s.value - 2.0).abs() < 1e-3);
        // 90 deg less the delay and 2 zeta/omega of the neuromuscular part.
        let expected = 90.0 - (2.0_f64 * (0.1 + 0.014)).to_degrees();
        assert!((found.phase_margin_deg.value - expected).abs() < 0.1);
    }

    #[test]
    fn errors_agree_with_finite_differences() {
        let element = ContinuousTransferFunction::new(&[1.0], &[1.0, 0.0]).unwrap();
        let ts = SampleTime::new(1.0 / 60.0).unwrap();
        for i in 0..6 {
            let mut covariance = vec![0.0; 36];
            covariance[i * 7] = 1e-8;
            let found = loop_measures(&operator(&X), Some(&covariance), &element, ts).unwrap();
            let at = |by: f64| {
                let mut x = X;
                x[i] += by;
                loop_measures(&operator(&x), None, &element, ts).unwrap()
            };
            let (up, down) = (at(1e-4), at(-1e-4));
            let slope = |get: fn(&LoopMeasures) -> f64| ((get(&up) - get(&down)) / 2e-4).abs();
            let error = |e: Estimate| e.standard_error.unwrap() / 1e-4;
            let crossover = slope(|m| m.crossover_rad_s.value);
            assert!((error(found.crossover_rad_s) - crossover).abs() < 1e-4 * (1.0 + crossover));
            let margin = slope(|m| m.phase_margin_deg.value);
            assert!(
                (error(found.phase_margin_deg) - margin).abs() < 1e-3 * (1.0 + margin),
                "{i}"
            );
        }
    }

    #[test]
    fn no_crossover_is_none() {
        let small = FamilyOperator::new(Form::Gain, true, &[1e-6, 2.4, -1.0, 0.1]).unwrap();
        let element = ContinuousTransferFunction::new(&[1.0], &[1.0, 1.0]).unwrap();
        assert_eq!(loop_measures(&small, None, &element, SampleTime::HUNDREDTH), None);
    }
}
