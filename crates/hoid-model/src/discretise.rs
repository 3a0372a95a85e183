//! Discretisation of general transfer functions (Table 5.2 of the reference text).
//!
//! | method | rule |
//! |---|---|
//! | forward Euler | `s = (z - 1)/Ts` |
//! | backward Euler | `s = (z - 1)/(Ts z)` |
//! | Tustin | `s = (2/Ts) (z - 1)/(z + 1)` |
//! | Tustin prewarped | `s = omega_p / tan(omega_p Ts/2) (z - 1)/(z + 1)`: exact at `omega_p` |
//! | zero-order hold | exact for an input that is constant over each sample |
//! | first-order hold | exact for an input that is linear over each sample (the triangle hold) |
//! | matched | poles and zeros by `z = e^{s Ts}` |
//!
//! **First-order hold.** `H(z) = (z - 1)^2 / (Ts z) Z{H(s)/s^2}` (Franklin, Powell, Workman, *Digital Control of Dynamic
//! Systems*, 3rd ed., 1998, section 6.3.2). The formula printed in Table 5.2, `(z - 1)^2/Ts^2 Z{H/s^2}`, lacks the z and has
//! one Ts too many: it is `z/Ts` times the right one.
//!
//! **Holds.** With `p = s/alpha`, alpha the larger of 1/Ts and the magnitude of the poles, the controllable canonical form has
//! entries of order one. The exponential of its matrix extended by input and input slope gives `Phi`, `Gamma_1`, `Gamma_2`
//! (Van Loan 1978). The way back to polynomials is the Faddeev-LeVerrier recursion on `Phi - I`, in powers of `delta = z - 1`,
//! and a Taylor shift: in powers of z the coefficients of a finely sampled system are differences of binomials, in powers of
//! delta they are not, so that numerators of size `(Ts/T)^n / n!` keep their digits. Holds take any delay: what is left of
//! whole samples moves the instant at which the output is read (the modified z-transform, Jury 1964).
//!
//! **Matched.** Of the r zeros at infinity r - 1 go to z = -1 and one stays at infinity, which leaves one sample of delay: the
//! modified matched method of Franklin, Powell and Workman (section 6.2) and of MATLAB's `c2d(..., 'matched')`. The gain makes
//! both responses equal at s = 0; with k poles (or zeros) there, `s^k H(s)` and `((z - 1)/Ts)^k H(z)` are equal in the limit of
//! small real s, so that the velocity or acceleration constant is kept. Both cases are the one product over poles and zeros
//! `p / (e^{p Ts} - 1)`, which is 1/Ts at p = 0.

use nalgebra::{DMatrix, DVector};
use num_complex::Complex64;

use crate::{ContinuousTransferFunction, DiscreteTransferFunction, ModelError, SampleTime, polynomial};

/// How a continuous transfer function becomes a discrete one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Method {
    /// Rectangle rule at the start of the sample.
    ForwardEuler,
    /// Rectangle rule at the end of the sample.
    BackwardEuler,
    /// Trapezoid rule (bilinear transformation).
    Tustin,
    /// Trapezoid rule scaled to be exact at one frequency.
    TustinPrewarped {
        /// The frequency omega_p in rad/s, between 0 and pi/Ts.
        omega_rad_s: f64,
    },
    /// Exact for an input that is held over each sample.
    ZeroOrderHold,
    /// Exact for an input that is linear over each sample.
    FirstOrderHold,
    /// Poles and zeros by `z = e^{s Ts}`.
    Matched,
}

/// Longest delay that is written out as leading zeros of a numerator.
const LONGEST_DELAY_SAMPLES: f64 = 1e6;

/// The discrete transfer function of `h` by one of the methods of Table 5.2. The numerator starts with as many zeros as there
/// are samples of delay.
///
/// # Errors
/// [`ModelError::OutOfRange`] when the delay is no whole number of samples (the two holds take any delay) or the prewarping
/// frequency does not lie between 0 and pi/Ts; [`ModelError::TransferFunction`] when the method sends a pole to infinity or the
/// result is not finite.
pub fn discretise(
    h: &ContinuousTransferFunction,
    sample_time: SampleTime,
    method: Method,
) -> Result<DiscreteTransferFunction, ModelError> {
    let ts = sample_time.s();
    if h.delay_s() / ts > LONGEST_DELAY_SAMPLES {
        return Err(ModelError::OutOfRange {
            quantity: "delay tau in s",
            found: h.delay_s(),
            expected: "at most a million samples; check the units of delay and sample time",
        });
    }
    let held = matches!(method, Method::ZeroOrderHold | Method::FirstOrderHold);
    let (whole, fraction) = match sample_time.whole_samples(h.delay_s()) {
        Some(samples) => (samples, 0.0),
        None if held => ((h.delay_s() / ts).floor() as usize, (h.delay_s() / ts).fract()),
        None => {
            return Err(ModelError::OutOfRange {
                quantity: "delay tau in s",
                found: h.delay_s(),
                expected: "a whole number of samples for this method: round it, change the sample time, or use the zero-order \
                           or first-order hold, which take any delay",
            });
        }
    };
    let (num, den) = match method {
        Method::ForwardEuler => substitute(h, 1.0 / ts, [0.0, 1.0])?,
        Method::BackwardEuler => substitute(h, 1.0 / ts, [1.0, 0.0])?,
        Method::Tustin => substitute(h, 2.0 / ts, [1.0, 1.0])?,
        Method::TustinPrewarped { omega_rad_s } => {
            if !(omega_rad_s > 0.0 && omega_rad_s < sample_time.nyquist_rad_s()) {
                return Err(ModelError::OutOfRange {
                    quantity: "prewarping frequency omega_p in rad/s",
                    found: omega_rad_s,
                    expected: "a frequency between 0 and pi/Ts",
                });
            }
            substitute(h, omega_rad_s / (omega_rad_s * ts / 2.0).tan(), [1.0, 1.0])?
        }
        Method::ZeroOrderHold | Method::FirstOrderHold => {
            hold(h, ts, fraction, method == Method::FirstOrderHold).ok_or_else(|| no_finite_result(h))?
        }
        Method::Matched => matched(h, ts).ok_or_else(|| no_finite_result(h))?,
    };
    if num.iter().chain(&den).any(|c| !c.is_finite()) {
        return Err(no_finite_result(h));
    }
    let delayed: Vec<f64> = std::iter::repeat_n(0.0, whole).chain(num).collect();
    DiscreteTransferFunction::new(&delayed, &den, sample_time)
}

fn no_finite_result(h: &ContinuousTransferFunction) -> ModelError {
    ModelError::TransferFunction {
        found: format!("{:?} / {:?}", h.num(), h.den()),
        expected: "poles whose image e^{s Ts} is a finite number; use a shorter sample time or slower unstable poles"
            .to_owned(),
    }
}

/// Numerator and denominator, by descending powers of z, after `s = c (z - 1) / q(z)`.
fn substitute(h: &ContinuousTransferFunction, c: f64, q: [f64; 2]) -> Result<(Vec<f64>, Vec<f64>), ModelError> {
    let order = h.den().len() - 1;
    let den = substitute_in_polynomial(h.den(), order, c, q);
    let powers = (0..=order).rev().map(|k| c.powi(k as i32));
    let size: f64 = h.den().iter().zip(powers).map(|(a, c)| (a * c).abs()).sum();
    // The leading coefficient is the denominator at s = c (backward Euler, Tustin): zero when a pole lies there.
    if q[0] != 0.0 && den[0].abs() <= 1e-13 * size {
        return Err(ModelError::TransferFunction {
            found: format!("{:?} / {:?}", h.num(), h.den()),
            expected: format!(
                "no pole at s = {c} 1/s, which this method sends to infinity; use a shorter sample time or a hold"
            ),
        });
    }
    Ok((substitute_in_polynomial(h.num(), order, c, q), den))
}

/// `q(z)^order p(s)` for p by descending powers of s, of degree `order` or less.
fn substitute_in_polynomial(p: &[f64], order: usize, c: f64, q: [f64; 2]) -> Vec<f64> {
    let mut result = vec![p[0]];
    let mut q_power = vec![1.0];
    for &coefficient in &p[1..] {
        result = polynomial::product(&result, &[c, -c]);
        q_power = polynomial::product(&q_power, &q);
        for (r, q) in result.iter_mut().zip(&q_power) {
            *r += coefficient * q;
        }
    }
    for _ in p.len()..=order {
        result = polynomial::product(&result, &q);
    }
    result
}

/// The system behind a hold with a delay of a `fraction` of a sample, by ascending powers of `z^-1`; a fraction other than zero
/// makes the numerator one longer. `None` when the matrix exponential is not finite.
fn hold(h: &ContinuousTransferFunction, ts: f64, fraction: f64, triangle: bool) -> Option<(Vec<f64>, Vec<f64>)> {
    let n = h.den().len() - 1;
    let feedthrough = if h.num().len() == n + 1 { h.num()[0] } else { 0.0 };
    let magnitude = (1..=n).map(|k| h.den()[k].abs().powf(1.0 / k as f64));
    let alpha = magnitude.fold(1.0 / ts, f64::max);

    // Controllable canonical form in p = s/alpha; x[i] = p^i / den(p) u.
    let mut extended = DMatrix::zeros(n + 2, n + 2);
    let mut output = DVector::zeros(n);
    let offset = n + 1 - h.num().len();
    let mut power = 1.0;
    for k in 1..=n {
        power *= alpha;
        let b = if k >= offset { h.num()[k - offset] } else { 0.0 };
        output[n - k] = (b - feedthrough * h.den()[k]) / power;
        extended[(n - 1, n - k)] = -h.den()[k] / power * (alpha * ts);
    }
    for i in 1..n {
        extended[(i - 1, i)] = alpha * ts;
    }
    if n > 0 {
        extended[(n - 1, n)] = alpha * ts;
    }
    extended[(n, n + 1)] = 1.0;

    let over_sample = Propagation::new(&extended, 1.0)?;
    let mut difference = over_sample.phi.clone();
    for i in 0..n {
        difference[(i, i)] -= 1.0;
    }
    // The triangle hold feeds u(k) and u(k + 1) into the state; x - Gamma_2 u needs u(k) alone.
    let drive = if triangle {
        &over_sample.constant + &difference * &over_sample.slope
    } else {
        over_sample.constant.clone()
    };
    let (row, direct, ahead) = if fraction == 0.0 {
        let direct = if triangle {
            feedthrough + output.dot(&over_sample.slope)
        } else {
            feedthrough
        };
        (output, direct, 0.0)
    } else {
        let part = 1.0 - fraction;
        let inside = Propagation::new(&extended, part)?;
        let row = inside.phi.transpose() * &output;
        let constant = feedthrough + output.dot(&inside.constant);
        if triangle {
            let ahead = feedthrough * part + output.dot(&inside.slope);
            (row.clone(), constant - ahead + row.dot(&over_sample.slope), ahead)
        } else {
            (row, constant, 0.0)
        }
    };

    let (proper, characteristic) = transfer_function_in_delta(&row, &difference, &drive);
    let den = from_delta_to_z(&characteristic);
    let proper = from_delta_to_z(&proper);
    let mut num: Vec<f64> = den.iter().map(|d| direct * d).collect();
    for (i, b) in proper.iter().enumerate() {
        num[i + 1] += b;
    }
    if fraction != 0.0 {
        // What is read within the sample was driven by the input at its start; `ahead` belongs to the input at its end.
        num.insert(0, 0.0);
        for (n, d) in num.iter_mut().zip(&den) {
            *n += ahead * d;
        }
    }
    Some((num, den))
}

/// State after a part of a sample: `phi x(0) + constant u(0) + slope (u(1) - u(0))`.
struct Propagation {
    phi: DMatrix<f64>,
    constant: DVector<f64>,
    slope: DVector<f64>,
}

impl Propagation {
    fn new(extended: &DMatrix<f64>, part: f64) -> Option<Self> {
        let scaled = extended * part;
        if scaled.iter().any(|v| !v.is_finite()) {
            return None;
        }
        let e = scaled.exp();
        if e.iter().any(|v| !v.is_finite()) {
            return None;
        }
        let n = extended.nrows() - 2;
        Some(Self {
            phi: e.view((0, 0), (n, n)).into_owned(),
            constant: e.view((0, n), (n, 1)).column(0).into_owned(),
            slope: e.view((0, n + 1), (n, 1)).column(0).into_owned(),
        })
    }
}

/// Numerator (degree n - 1) and denominator (degree n) of `row (delta I - m)^-1 column` by descending powers of delta, by the
/// Faddeev-LeVerrier recursion.
fn transfer_function_in_delta(row: &DVector<f64>, m: &DMatrix<f64>, column: &DVector<f64>) -> (Vec<f64>, Vec<f64>) {
    let n = m.nrows();
    let (mut num, mut den) = (Vec::with_capacity(n), vec![1.0]);
    let mut adjugate = DMatrix::identity(n, n);
    for k in 1..=n {
        num.push(row.dot(&(&adjugate * column)));
        let mut next = m * &adjugate;
        let c = -next.trace() / k as f64;
        for i in 0..n {
            next[(i, i)] += c;
        }
        den.push(c);
        adjugate = next;
    }
    (num, den)
}

/// A polynomial by descending powers of `delta = z - 1`, in powers of z.
fn from_delta_to_z(p: &[f64]) -> Vec<f64> {
    let mut result: Vec<f64> = Vec::with_capacity(p.len());
    for &c in p {
        result.push(0.0);
        for i in (1..result.len()).rev() {
            let higher = result[i - 1];
            result[i] -= higher;
        }
        if let Some(last) = result.last_mut() {
            *last += c;
        }
    }
    result
}

/// Poles and zeros by `z = e^{s Ts}`, by descending powers of z. `None` when the roots are not found.
fn matched(h: &ContinuousTransferFunction, ts: f64) -> Option<(Vec<f64>, Vec<f64>)> {
    let poles = polynomial::roots(h.den())?;
    let leading = h.num()[0];
    if leading == 0.0 {
        return Some((vec![0.0], image(&poles, ts)));
    }
    let zeros = polynomial::roots(h.num())?;
    let at_infinity = poles.len() - zeros.len();
    let gain = leading * static_ratio(&zeros, ts) / static_ratio(&poles, ts);
    let mut num = image(&zeros, ts);
    if at_infinity > 0 {
        for _ in 1..at_infinity {
            num = polynomial::product(&num, &[0.5, 0.5]);
        }
        num.insert(0, 0.0);
    }
    Some((num.iter().map(|c| gain * c).collect(), image(&poles, ts)))
}

/// `prod (z - e^{p Ts})` by descending powers of z.
fn image(roots: &[Complex64], ts: f64) -> Vec<f64> {
    polynomial::from_roots(&roots.iter().map(|p| (p * ts).exp()).collect::<Vec<_>>())
}

/// `prod p / (e^{p Ts} - 1)`, the product that a factor `s - p` brings over its image at s = 0.
fn static_ratio(roots: &[Complex64], ts: f64) -> f64 {
    let ratio = |p: &Complex64| {
        let z = p * ts;
        if z.norm() < 1e-8 {
            return (1.0 - z / 2.0) / ts;
        }
        // e^z - 1 without cancellation for small z.
        let sine = (z.im / 2.0).sin();
        let real = z.re.exp_m1() * z.im.cos() - 2.0 * sine * sine;
        p / Complex64::new(real, z.re.exp() * z.im.sin())
    };
    roots.iter().map(ratio).product::<Complex64>().re
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ts(s: f64) -> SampleTime {
        SampleTime::new(s).unwrap()
    }

    fn tf(num: &[f64], den: &[f64]) -> ContinuousTransferFunction {
        ContinuousTransferFunction::new(num, den).unwrap()
    }

    struct Case {
        name: String,
        method: Method,
        h: ContinuousTransferFunction,
        sample_time: SampleTime,
        num: Vec<f64>,
        den: Vec<f64>,
        scipy_num: Vec<f64>,
        scipy_den: Vec<f64>,
    }

    /// From fixtures/discretise/make.py: exact values in 60 digits (mpmath), and those of scipy.signal.cont2discrete.
    fn cases() -> Vec<Case> {
        let numbers = |text: &str| -> Vec<f64> { text.split_whitespace().map(|v| v.parse().unwrap()).collect() };
        include_str!("../../../fixtures/discretise/discretise.csv")
            .lines()
            .skip(1)
            .map(|line| {
                let field: Vec<&str> = line.split(';').collect();
                Case {
                    name: format!("{} {}", field[0], field[1]),
                    method: match field[1] {
                        "zoh" => Method::ZeroOrderHold,
                        "foh" => Method::FirstOrderHold,
                        "bilinear" => Method::Tustin,
                        "euler" => Method::ForwardEuler,
                        "backward_diff" => Method::BackwardEuler,
                        other => panic!("{other}"),
                    },
                    sample_time: ts(field[2].parse().unwrap()),
                    h: tf(&numbers(field[3]), &numbers(field[4])),
                    num: numbers(field[5]),
                    den: numbers(field[6]),
                    scipy_num: numbers(field[7]),
                    scipy_den: numbers(field[8]),
                }
            })
            .collect()
    }

    fn largest(p: &[f64]) -> f64 {
        p.iter().fold(0.0, |m, c| m.max(c.abs()))
    }

    fn assert_close(name: &str, found: &[f64], expected: &[f64], tolerance: f64) {
        assert_eq!(found.len(), expected.len(), "{name}: {found:?} and {expected:?}");
        for (a, b) in found.iter().zip(expected) {
            assert!(
                (a - b).abs() <= tolerance * largest(expected),
                "{name}: {found:?} and {expected:?}, off by {:e}",
                (a - b).abs() / largest(expected)
            );
        }
    }

    #[test]
    fn agrees_with_exact_values() {
        let cases = cases();
        assert!(cases.len() >= 40);
        for case in &cases {
            let d = discretise(&case.h, case.sample_time, case.method).unwrap();
            // Orders 1 to 6 at Ts = 0.01 s: a few roundings; the numerators of order 6 are of size 1e-8 to 1e-12.
            assert_close(&case.name, d.num(), &case.num, 1e-14);
            assert_close(&case.name, d.den(), &case.den, 2e-15);
        }
    }

    #[test]
    fn agrees_with_scipy() {
        for case in cases() {
            let d = discretise(&case.h, case.sample_time, case.method).unwrap();
            // ss2tf takes a numerator as the difference of two denominators: absolute errors of 1e-15 times binomials.
            let size = largest(&case.scipy_den) + largest(&case.scipy_num);
            for (ours, theirs) in [(d.num(), &case.scipy_num), (d.den(), &case.scipy_den)] {
                assert_eq!(ours.len(), theirs.len());
                for (a, b) in ours.iter().zip(theirs) {
                    assert!((a - b).abs() < 1e-12 * size, "{}: {ours:?} and {theirs:?}", case.name);
                }
            }
        }
    }

    #[test]
    fn delay_of_whole_samples_is_leading_zeros() {
        let h = tf(&[4.0, 11.0], &[1.0, 7.9, 126.0]);
        for method in [
            Method::ForwardEuler,
            Method::BackwardEuler,
            Method::Tustin,
            Method::TustinPrewarped { omega_rad_s: 4.0 },
            Method::ZeroOrderHold,
            Method::FirstOrderHold,
            Method::Matched,
        ] {
            let plain = discretise(&h, ts(0.01), method).unwrap();
            let late = discretise(&h.clone().with_delay(0.28).unwrap(), ts(0.01), method).unwrap();
            assert_eq!(late.den(), plain.den());
            assert!(late.num()[..28].iter().all(|&b| b == 0.0));
            assert_eq!(&late.num()[28..], plain.num());
            let odd = discretise(&h.clone().with_delay(0.285).unwrap(), ts(0.01), method);
            let held = matches!(method, Method::ZeroOrderHold | Method::FirstOrderHold);
            assert_eq!(odd.is_ok(), held, "{method:?}");
        }
    }

    /// Response at the samples to a unit step (zero-order hold) or a unit ramp (first-order hold).
    fn response_to(h: &DiscreteTransferFunction, input: impl Fn(usize) -> f64, samples: usize) -> Vec<f64> {
        let mut y: Vec<f64> = Vec::new();
        for k in 0..samples {
            let forced: f64 = h
                .num()
                .iter()
                .enumerate()
                .filter(|(i, _)| *i <= k)
                .map(|(i, b)| b * input(k - i))
                .sum();
            let free: f64 = h
                .den()
                .iter()
                .enumerate()
                .skip(1)
                .filter(|(i, _)| *i <= k)
                .map(|(i, a)| a * y[k - i])
                .sum();
            y.push(forced - free);
        }
        y
    }

    #[test]
    fn holds_with_a_fraction_of_a_sample_of_delay() {
        // 0.7 + 2/(s + 3) with a delay of 2.3 samples, by hand: step and ramp start at t = 0, so that nothing is approximated.
        let sample_time = ts(0.1);
        let delay = 0.23;
        let h = tf(&[0.7, 4.1], &[1.0, 3.0]).with_delay(delay).unwrap();
        let step = response_to(
            &discretise(&h, sample_time, Method::ZeroOrderHold).unwrap(),
            |_| 1.0,
            30,
        );
        // The triangle hold joins u(-1) = 0 to u(0) by a line; the ramp has u(0) = 0.
        let ramp = response_to(
            &discretise(&h, sample_time, Method::FirstOrderHold).unwrap(),
            |k| 0.1 * k as f64,
            30,
        );
        for k in 0..30 {
            let t = 0.1 * k as f64 - delay;
            let (s, r) = if t < 0.0 {
                (0.0, 0.0)
            } else {
                let lag = 1.0 - (-3.0 * t).exp();
                (0.7 + 2.0 / 3.0 * lag, 0.7 * t + 2.0 / 3.0 * (t - lag / 3.0))
            };
            // Accumulated rounding of 30 recursions.
            assert!((step[k] - s).abs() < 1e-13, "{k}: {} and {s}", step[k]);
            assert!((ramp[k] - r).abs() < 1e-13, "{k}: {} and {r}", ramp[k]);
        }
    }

    #[test]
    fn prewarped_tustin_is_exact_at_its_frequency() {
        let systems = [
            tf(&[4.5, 11.4], &[1.0, 7.875, 126.5625]),
            tf(&[1.0], &[1.0, 0.0, 0.0]),
            tf(&[2.0, 1.0], &[1.0, 3.0]),
        ];
        for h in &systems {
            for omega in [0.5, 11.25, 150.0] {
                let d = discretise(h, ts(0.01), Method::TustinPrewarped { omega_rad_s: omega }).unwrap();
                let error = (d.response(omega) - h.response(omega)).norm() / h.response(omega).norm();
                // Rounding of coefficients over (z - 1)^2 at z = e^{0.005j}.
                assert!(error < 1e-10, "{h:?} at {omega}: {error:e}");
                let plain = discretise(h, ts(0.01), Method::Tustin).unwrap();
                assert!((plain.response(omega) - h.response(omega)).norm() / h.response(omega).norm() > error);
            }
        }
        for omega in [0.0, -1.0, 100.0 * std::f64::consts::PI, f64::NAN] {
            assert!(discretise(&systems[0], ts(0.01), Method::TustinPrewarped { omega_rad_s: omega }).is_err());
        }
    }

    #[test]
    fn matched_has_the_images_of_poles_and_zeros() {
        let sample_time = ts(0.1);
        // 3 (s + 2) / ((s + 1) (s^2 + 2 s + 26)): one finite zero, two at infinity.
        let h = tf(&[3.0, 6.0], &polynomial::product(&[1.0, 1.0], &[1.0, 2.0, 26.0]));
        let d = discretise(&h, sample_time, Method::Matched).unwrap();
        for s in [Complex64::new(-1.0, 0.0), Complex64::new(-1.0, 5.0)] {
            let backward = (-s * 0.1).exp();
            assert!(polynomial::value(d.den(), backward).norm() < 1e-13);
        }
        // Zeros at e^{-0.2} and -1, and one sample of delay.
        assert_eq!(d.num()[0], 0.0);
        assert!(polynomial::value(d.num(), Complex64::new(0.2f64.exp(), 0.0)).norm() < 1e-15);
        assert!(polynomial::value(d.num(), Complex64::new(-1.0, 0.0)).norm() < 1e-15);
        assert!((d.response(0.0) - h.response(0.0)).norm() < 1e-13);

        // Biproper: no delay is added. Pole at s = 0: the velocity constant lim s H(s) = 5/4 is kept.
        let lead = discretise(&tf(&[2.0, 1.0], &[1.0, 3.0]), sample_time, Method::Matched).unwrap();
        assert!(lead.num()[0] != 0.0);
        assert!((lead.response(0.0).re - 1.0 / 3.0).abs() < 1e-14);
        let servo = discretise(&tf(&[5.0], &[1.0, 4.0, 0.0]), sample_time, Method::Matched).unwrap();
        let near = Complex64::from_polar(1.0, -1e-6);
        let velocity =
            (1.0 / near - 1.0) / 0.1 * polynomial::value(servo.num(), near) / polynomial::value(servo.den(), near);
        assert!((velocity - 1.25).norm() < 1e-5);
        // The matched integrators are Ts/(z - 1) and Ts^2 (z + 1) / (2 (z - 1)^2).
        let double = discretise(&tf(&[1.0], &[1.0, 0.0, 0.0]), sample_time, Method::Matched).unwrap();
        assert_close("double integrator", double.num(), &[0.0, 0.005, 0.005], 1e-14);
        assert_close("double integrator", double.den(), &[1.0, -2.0, 1.0], 1e-14);
        let zero = discretise(&tf(&[0.0], &[1.0, 1.0]), sample_time, Method::Matched).unwrap();
        assert_eq!(zero.num(), &[0.0]);
    }

    #[test]
    fn static_gains_and_degenerate_systems() {
        for method in [
            Method::ForwardEuler,
            Method::Tustin,
            Method::ZeroOrderHold,
            Method::FirstOrderHold,
            Method::Matched,
        ] {
            let gain = discretise(&tf(&[3.0], &[2.0]), ts(0.01), method).unwrap();
            assert_eq!((gain.num(), gain.den()), (&[1.5][..], &[1.0][..]), "{method:?}");
            let stable = discretise(&tf(&[4.5, 11.4], &[1.0, 7.875, 126.5625]), ts(0.01), method).unwrap();
            assert!((stable.response(0.0).re - 11.4 / 126.5625).abs() < 1e-12, "{method:?}");
        }
        // Poles at 1/Ts and 2/Ts have no image under backward Euler and Tustin.
        let fast = |p: f64| tf(&[1.0], &[1.0, -p]);
        assert!(discretise(&fast(100.0), ts(0.01), Method::BackwardEuler).is_err());
        assert!(discretise(&fast(200.0), ts(0.01), Method::Tustin).is_err());
        assert!(discretise(&fast(100.0), ts(0.01), Method::Tustin).is_ok());
        // e^{1e6} overflows; a fast stable pole does not.
        for method in [Method::ZeroOrderHold, Method::FirstOrderHold, Method::Matched] {
            assert!(discretise(&fast(1e8), ts(0.01), method).is_err(), "{method:?}");
            assert!(discretise(&fast(-1e6), ts(0.01), method).is_ok(), "{method:?}");
        }
        let late = tf(&[1.0], &[1.0, 1.0]).with_delay(1e12).unwrap();
        assert!(discretise(&late, ts(0.01), Method::ZeroOrderHold).is_err());
    }
}
