//! The remnant gain K_n for a given noise level P_n (appendix A of the thesis).
//!
//! With `S = 1/(1 + H_HO H_CE)`, unit white noise drawn once per sample (with its power spread evenly over 0 to pi/Ts),
//! and
//!
//! - `V_f = 1/2 sum A_k^2 |S H_HO (j omega_k)|^2`, the variance of u due to the forcing function,
//! - `V_u = Ts/pi  integral_0^{pi/Ts} |S|^2 / (1 + T_n^2 omega^2)^m d omega`, the variance of u due to the remnant with
//!   K_n = 1,
//! - `V_n = Ts/pi  integral_0^{pi/Ts} 1 / (1 + T_n^2 omega^2)^m d omega`, the variance of the remnant itself,
//!
//! the two definitions of P_n give
//!
//! - `P_n = var(u_n)/var(u)`: `K_n^2 = P_n/(1 - P_n) V_f/V_u` (eq. 43, A.14), for every P_n from 0
//!   to below 1;
//! - `P_n = var(n)/var(u)`: `K_n^2 = P_n V_f / (V_n - P_n V_u)` (A.17), for P_n from 0 to below
//!   `V_n/V_u`.
//!
//! All quantities are computed for the continuous loop, as in the thesis. V_n has a closed form. V_u is integrated by
//! the adaptive Gauss-Kronrod rule of 7 and 15 points to a relative tolerance of 1e-10, from a partition at the local
//! maxima of the integrand: the peaks near crossover and at lightly damped closed-loop modes. S is evaluated from
//! polynomials as `D / (D + N e^{-j omega tau})`. At a pole of the open loop on the imaginary axis this expression is
//! 0, whereas `1/(1 + infinity)` would not be a number.

use num_complex::Complex64;

use crate::{
    ContinuousTransferFunction, ModelError, SampleTime, margins::closed_loop_is_stable, remnant::RemnantFilter,
};

/// Definition of the noise level P_n.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum NoiseDefinition {
    /// `var(u_n)/var(u)`: share of the variance of u that the remnant causes through the loop (eq. 43, A.14).
    #[default]
    Response,
    /// `var(n)/var(u)`: variance of the remnant itself, relative to that of u (A.17).
    Remnant,
}

crate::named_choice!(NoiseDefinition, "noise definition", 2, { Response => "response", Remnant => "remnant" });

/// One sinusoid of the forcing function.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SpectralLine {
    /// Amplitude A_k, deg.
    pub amplitude: f64,
    /// Frequency omega_k, rad/s.
    pub omega_rad_s: f64,
}

/// Relative tolerance of the integral.
const RELATIVE_TOLERANCE: f64 = 1e-10;

/// Computes the remnant gain K_n for a noise level P_n.
///
/// `order` and `time_constant_s` describe the remnant filter, and `lines` describes the forcing function; `sample_time`
/// is the time between two draws of the noise. K_n is 0 for a level of 0.
///
/// # Errors
/// [`ModelError::OutOfRange`] for a level below 0 (or not below 1 for [`NoiseDefinition::Response`]), a remnant order
/// other than 1 to 4, an invalid time constant or line, or a forcing function that does not excite u;
/// [`ModelError::UnstableLoop`] if the loop of the operator and the controlled element is unstable;
/// [`ModelError::UnreachableNoiseLevel`] for a level that [`NoiseDefinition::Remnant`] cannot reach.
#[allow(clippy::too_many_arguments)]
pub fn remnant_gain(
    level: f64,
    definition: NoiseDefinition,
    order: usize,
    time_constant_s: f64,
    operator: &ContinuousTransferFunction,
    controlled_element: &ContinuousTransferFunction,
    lines: &[SpectralLine],
    sample_time: SampleTime,
) -> Result<f64, ModelError> {
    let (limit, expected) = match definition {
        NoiseDefinition::Response => (1.0, "0 or more and less than 1"),
        NoiseDefinition::Remnant => (f64::INFINITY, "0 or more"),
    };
    if !(level >= 0.0 && level < limit) {
        return Err(ModelError::OutOfRange {
            quantity: "noise level P_n",
            found: level,
            expected,
        });
    }
    RemnantFilter::new(1.0, time_constant_s, order)?;
    for line in lines {
        let checks = [
            ("amplitude of a sine of the forcing function", line.amplitude, true),
            (
                "frequency of a sine of the forcing function in rad/s",
                line.omega_rad_s,
                line.omega_rad_s > 0.0,
            ),
        ];
        for (quantity, found, in_range) in checks {
            if !(found.is_finite() && in_range) {
                return Err(ModelError::OutOfRange {
                    quantity,
                    found,
                    expected: "a finite number, positive for a frequency",
                });
            }
        }
    }
    // A level of zero requires a gain of zero, even in an unstable loop.
    if level == 0.0 {
        return Ok(0.0);
    }
    if !closed_loop_is_stable(&operator.series(controlled_element)) {
        return Err(ModelError::UnstableLoop {
            reason: "not all closed-loop poles lie in the open left half plane (Nyquist); lower the gain or the delay"
                .to_owned(),
        });
    }
    let closed = ClosedLoop {
        operator,
        controlled_element,
    };
    let forced: f64 = lines
        .iter()
        .map(|l| 0.5 * (l.amplitude * closed.response_to_target(l.omega_rad_s)).powi(2))
        .sum();
    if !(forced.is_finite() && forced > 0.0) {
        return Err(ModelError::OutOfRange {
            quantity: "variance of u due to the forcing function",
            found: forced,
            expected: "a positive number: a noise level needs a forcing function that excites the operator",
        });
    }
    let band = sample_time.nyquist_rad_s();
    let weight = |omega: f64| (1.0 + (time_constant_s * omega).powi(2)).powi(-(order as i32));
    let by_noise = integrate(|omega| closed.sensitivity(omega).powi(2) * weight(omega), band) / band;
    let own = remnant_integral(order, time_constant_s * band) / (time_constant_s * band);
    let squared = match definition {
        NoiseDefinition::Response => level / (1.0 - level) * forced / by_noise,
        NoiseDefinition::Remnant => {
            let largest = own / by_noise;
            if level >= largest {
                return Err(ModelError::UnreachableNoiseLevel {
                    requested_level: level,
                    order,
                    largest,
                });
            }
            level * forced / (by_noise * (largest - level))
        }
    };
    if squared.is_finite() {
        Ok(squared.sqrt())
    } else {
        Err(ModelError::OutOfRange {
            quantity: "remnant gain K_n squared",
            found: squared,
            expected: "a finite number; check the operator and the controlled element",
        })
    }
}

/// Closed loop, for the computation of the magnitudes of its responses from polynomials.
struct ClosedLoop<'a> {
    operator: &'a ContinuousTransferFunction,
    controlled_element: &'a ContinuousTransferFunction,
}

impl ClosedLoop<'_> {
    /// Returns `|1/(1 + H_HO H_CE)|`.
    fn sensitivity(&self, omega: f64) -> f64 {
        let [_, den_operator, den_element, characteristic] = self.at(omega);
        (den_operator * den_element / characteristic).norm()
    }

    /// Returns `|H_HO/(1 + H_HO H_CE)|`.
    fn response_to_target(&self, omega: f64) -> f64 {
        let [num_operator, _, den_element, characteristic] = self.at(omega);
        (num_operator * den_element / characteristic).norm()
    }

    /// Returns the numerator and the denominator of the operator without delay, the denominator of the element, and the
    /// characteristic function.
    fn at(&self, omega: f64) -> [Complex64; 4] {
        let s = Complex64::new(0.0, omega);
        let horner = |p: &[f64]| p.iter().fold(Complex64::new(0.0, 0.0), |sum, &c| sum * s + c);
        let (num_o, den_o) = (horner(self.operator.num()), horner(self.operator.den()));
        let element = self.controlled_element;
        let (num_e, den_e) = (horner(element.num()), horner(element.den()));
        let delay = Complex64::from_polar(1.0, -omega * (self.operator.delay_s() + element.delay_s()));
        [num_o, den_o, den_e, den_o * den_e + num_o * num_e * delay]
    }
}

/// Returns `integral_0^x dt / (1 + t^2)^m`.
fn remnant_integral(order: usize, x: f64) -> f64 {
    let mut integral = x.atan();
    for k in 2..=order {
        let twice = 2.0 * (k - 1) as f64;
        integral = x / (twice * (1.0 + x * x).powi(k as i32 - 1)) + (twice - 1.0) / twice * integral;
    }
    integral
}

/// Nodes of the 15-point Kronrod rule on [-1, 1], from the outermost to 0; every second node belongs to the Gauss rule.
const NODES: [f64; 8] = [
    0.991_455_371_120_812_6,
    0.949_107_912_342_758_5,
    0.864_864_423_359_769_1,
    0.741_531_185_599_394_4,
    0.586_087_235_467_691_1,
    0.405_845_151_377_397_2,
    0.207_784_955_007_898_47,
    0.0,
];
const KRONROD_WEIGHTS: [f64; 8] = [
    0.022_935_322_010_529_224,
    0.063_092_092_629_978_55,
    0.104_790_010_322_250_18,
    0.140_653_259_715_525_92,
    0.169_004_726_639_267_9,
    0.190_350_578_064_785_4,
    0.204_432_940_075_298_9,
    0.209_482_141_084_727_82,
];
const GAUSS_WEIGHTS: [f64; 4] = [
    0.129_484_966_168_869_7,
    0.279_705_391_489_276_64,
    0.381_830_050_505_118_9,
    0.417_959_183_673_469_4,
];

/// An interval with its integral and the difference between the Gauss and Kronrod rules.
struct Interval {
    from: f64,
    to: f64,
    integral: f64,
    error: f64,
}

impl Interval {
    fn new(f: &impl Fn(f64) -> f64, from: f64, to: f64) -> Self {
        let (centre, half) = (0.5 * (from + to), 0.5 * (to - from));
        let middle = f(centre);
        let mut kronrod = KRONROD_WEIGHTS[7] * middle;
        let mut gauss = GAUSS_WEIGHTS[3] * middle;
        for i in 0..7 {
            let pair = f(centre - half * NODES[i]) + f(centre + half * NODES[i]);
            kronrod += KRONROD_WEIGHTS[i] * pair;
            if i % 2 == 1 {
                gauss += GAUSS_WEIGHTS[i / 2] * pair;
            }
        }
        Self {
            from,
            to,
            integral: half * kronrod,
            error: half * (kronrod - gauss).abs(),
        }
    }
}

const MAX_INTERVALS: usize = 4000;

/// Returns the integral from 0 to `band` of a smooth non-negative f that varies on a logarithmic scale.
fn integrate(f: impl Fn(f64) -> f64, band: f64) -> f64 {
    const INTERVALS_PER_DECADE: usize = 24;
    const DECADE_COUNT: usize = 5;
    let points = INTERVALS_PER_DECADE * DECADE_COUNT;
    let at = |i: usize| band * 10f64.powf((i as f64 - points as f64) / INTERVALS_PER_DECADE as f64);
    let values: Vec<f64> = (0..=points).map(|i| f(at(i))).collect();
    let mut edges = vec![0.0];
    for i in 0..points {
        let peak = i > 0 && values[i] >= values[i - 1] && values[i] >= values[i + 1];
        // There is at least one edge of an interval per decade, so that no scale is overlooked.
        if peak || i % INTERVALS_PER_DECADE == 0 {
            edges.push(at(i));
        }
    }
    edges.push(band);
    let mut intervals: Vec<Interval> = edges.windows(2).map(|e| Interval::new(&f, e[0], e[1])).collect();
    while intervals.len() < MAX_INTERVALS {
        let total: f64 = intervals.iter().map(|i| i.integral).sum();
        // Each interval may contribute an equal share of the tolerance to the error; intervals that exceed this share
        // are halved.
        let allowed = RELATIVE_TOLERANCE * total / intervals.len() as f64;
        let (good, poor): (Vec<Interval>, Vec<Interval>) = intervals.into_iter().partition(|i| i.error <= allowed);
        intervals = good;
        if poor.is_empty() {
            break;
        }
        for i in poor {
            let middle = 0.5 * (i.from + i.to);
            intervals.push(Interval::new(&f, i.from, middle));
            intervals.push(Interval::new(&f, middle, i.to));
        }
    }
    intervals.iter().map(|i| i.integral).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{forcing::ForcingFunction, scenario::OperatingState};

    fn ts() -> SampleTime {
        SampleTime::new(0.01).unwrap()
    }

    /// Table 1: amplitudes in deg, frequencies as multiples of 2 pi / 81.92 s.
    fn forcing() -> Vec<SpectralLine> {
        ForcingFunction::reference().lines()
    }

    fn tf(num: &[f64], den: &[f64]) -> ContinuousTransferFunction {
        ContinuousTransferFunction::new(num, den).unwrap()
    }

    fn states() -> [(ContinuousTransferFunction, ContinuousTransferFunction); 2] {
        [OperatingState::s1(), OperatingState::s2()].map(|state| {
            let element = state.controlled_element.transfer_function();
            (state.operator.transfer_function().unwrap(), element.unwrap())
        })
    }

    fn gain(level: f64, definition: NoiseDefinition, order: usize, state: usize) -> Result<f64, ModelError> {
        let (operator, element) = &states()[state];
        remnant_gain(level, definition, order, 0.06, operator, element, &forcing(), ts())
    }

    #[test]
    fn gains_match_the_response_definition() {
        // Expected K_n with the first definition of P_n, for s1 and then s2 at P_n = .01, .1, .2, .3.
        let table = [
            [0.02302, 0.07636, 0.11453, 0.14996, 0.04212, 0.13971, 0.20956, 0.27438],
            [0.02977, 0.09875, 0.14812, 0.19394, 0.04975, 0.16500, 0.24751, 0.32406],
            [0.03328, 0.11039, 0.16559, 0.21681, 0.05323, 0.17654, 0.26481, 0.34671],
            [0.03590, 0.11905, 0.17858, 0.23382, 0.05573, 0.18482, 0.27724, 0.36299],
        ];
        for (m, row) in (1..).zip(table) {
            for (i, expected) in row.into_iter().enumerate() {
                let level = [0.01, 0.1, 0.2, 0.3][i % 4];
                let found = gain(level, NoiseDefinition::Response, m, i / 4).unwrap();
                // The tolerance is half a unit of the last printed digit.
                assert!(
                    (found - expected).abs() <= 5.1e-6,
                    "m {m}, P_n {level}: {found} and {expected}"
                );
            }
        }
    }

    #[test]
    fn gains_match_the_remnant_definition() {
        // Expected K_n with the second definition at P_n = 0.1, m = 1..4.
        let table = [
            [0.08682, 0.12207, 0.14175, 0.15574],
            [0.19926, 0.28993, 0.34465, 0.38536],
        ];
        for (s, row) in table.into_iter().enumerate() {
            for (m, expected) in (1..).zip(row) {
                let found = gain(0.1, NoiseDefinition::Remnant, m, s).unwrap();
                assert!((found - expected).abs() <= 5.1e-6, "m {m}: {found} and {expected}");
            }
        }
    }

    #[test]
    fn integrals_agree_with_scipy() {
        // V_u of s1 and s2 for m = 1 and 4, and V_n for m = 4, by scipy.integrate.quad with a tolerance of 1e-13; V_f
        // is the same at all levels.
        let expected = [
            (0, 1, 0.10113885417079896_f64, 0.005307028936817029),
            (0, 4, 0.041602794077966486, 0.005307028936817029),
            (1, 1, 0.1484450183150057, 0.026076841167706963),
            (1, 4, 0.08481886390054608, 0.026076841167706963),
        ];
        for (s, m, by_noise, forced) in expected {
            let found = gain(0.5, NoiseDefinition::Response, m, s).unwrap();
            // The integral is accurate to 1e-10, and the gain to half of this value.
            assert!((found / (forced / by_noise).sqrt() - 1.0).abs() < 1e-10);
        }
        let own = remnant_integral(4, 6.0 * std::f64::consts::PI) / (6.0 * std::f64::consts::PI);
        assert!((own - 0.026041666657780883).abs() < 1e-13);
        for m in 1..=4 {
            let by_rule = integrate(|t| (1.0 + t * t).powi(-(m as i32)), 20.0);
            assert!((by_rule / remnant_integral(m, 20.0) - 1.0).abs() < 1e-12);
        }
    }

    #[test]
    fn unreachable_level_error_gives_the_largest_level() {
        for m in 1..=4 {
            for s in 0..2 {
                let Err(ModelError::UnreachableNoiseLevel { largest, order, .. }) =
                    gain(3.0, NoiseDefinition::Remnant, m, s)
                else {
                    panic!("a level of 3 was reached");
                };
                assert_eq!(order, m);
                assert!(gain(largest * (1.0 - 1e-6), NoiseDefinition::Remnant, m, s).unwrap() > 10.0);
                assert!(gain(largest, NoiseDefinition::Remnant, m, s).is_err());
            }
        }
        // V_n/V_u of s1 for m = 1, computed with scipy.
        let Err(ModelError::UnreachableNoiseLevel { largest, .. }) = gain(0.9, NoiseDefinition::Remnant, 1, 0) else {
            panic!("a level of 0.9 was reached");
        };
        assert!((largest - 0.7961479556766449).abs() < 1e-9);
    }

    #[test]
    fn open_loop_gains_follow_from_variances() {
        // Without a controlled element, u = H_HO f_t + n. Therefore var(u_n) = var(n), and both definitions are equal.
        let [(operator, _), _] = states();
        let none = tf(&[0.0], &[1.0, 1.0]);
        let line = [SpectralLine {
            amplitude: 2.0,
            omega_rad_s: 3.0,
        }];
        let by = |definition| remnant_gain(0.2, definition, 2, 0.06, &operator, &none, &line, ts()).unwrap();
        let (response, remnant) = (by(NoiseDefinition::Response), by(NoiseDefinition::Remnant));
        assert!((response / remnant - 1.0).abs() < 1e-10);
        let x = 6.0 * std::f64::consts::PI;
        let expected = (0.25 * 2.0 * operator.response(3.0).norm_sqr() / (remnant_integral(2, x) / x)).sqrt();
        assert!((response / expected - 1.0).abs() < 1e-10);
    }

    #[test]
    fn sharp_peaks_are_integrated() {
        // Just below the gain at which the loop becomes unstable, the integrand has a peak of relative width 1e-6. V_u
        // is dominated by this peak and is inversely proportional to the distance from this gain.
        let [(operator, element), _] = states();
        let margin = crate::margins::margins(|w| operator.series(&element).response(w), (0.1, 100.0));
        let limit = 10f64.powf(margin.gain_margin_db.unwrap() / 20.0);
        let at = |distance: f64| {
            let louder = operator.series(&tf(&[limit * (1.0 - distance)], &[1.0]));
            let own = remnant_gain(
                0.1,
                NoiseDefinition::Response,
                1,
                0.06,
                &louder,
                &element,
                &forcing(),
                ts(),
            )
            .unwrap();
            own.powi(-2) * distance
        };
        // The deviation from the limit is of the order of the distance.
        assert!((at(1e-5) / at(1e-6) - 1.0).abs() < 1e-3, "{} {}", at(1e-5), at(1e-6));
    }

    #[test]
    fn invalid_arguments_are_refused() {
        let [(operator, element), _] = states();
        let call = |level, definition, order, time, lines: &[SpectralLine]| {
            remnant_gain(level, definition, order, time, &operator, &element, lines, ts())
        };
        let f = forcing();
        assert_eq!(call(0.0, NoiseDefinition::Response, 1, 0.06, &f), Ok(0.0));
        for level in [-0.1, 1.0, f64::NAN, f64::INFINITY] {
            assert!(call(level, NoiseDefinition::Response, 1, 0.06, &f).is_err(), "{level}");
        }
        for level in [-0.1, f64::NAN, f64::INFINITY] {
            assert!(call(level, NoiseDefinition::Remnant, 1, 0.06, &f).is_err(), "{level}");
        }
        assert!(call(0.1, NoiseDefinition::Response, 0, 0.06, &f).is_err());
        assert!(call(0.1, NoiseDefinition::Response, 5, 0.06, &f).is_err());
        assert!(call(0.1, NoiseDefinition::Response, 1, -0.06, &f).is_err());
        assert!(call(0.1, NoiseDefinition::Response, 1, 0.06, &[]).is_err());
        for (amplitude, omega_rad_s) in [(f64::NAN, 1.0), (1.0, 0.0), (1.0, f64::INFINITY)] {
            let line = SpectralLine { amplitude, omega_rad_s };
            assert!(call(0.1, NoiseDefinition::Response, 1, 0.06, &[line]).is_err());
        }
        let louder = operator.series(&tf(&[3.0], &[1.0]));
        let unstable = remnant_gain(0.1, NoiseDefinition::Response, 1, 0.06, &louder, &element, &f, ts());
        assert!(matches!(unstable, Err(ModelError::UnstableLoop { .. })));
    }
}
