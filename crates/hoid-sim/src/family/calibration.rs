//! Gains at which each part of the remnant has its share of the variance of u.
//!
//! Part i with gain 1 contributes `V_i = sum over k of h_i(k)^2` to the variance of u, where h_i is the response of u,
//! through the closed loop, to one unit of w at sample 0. The sinusoids of the target and the disturbance contribute
//! `V_0 = sum of A^2/2 |u/f|^2` at their frequencies, with the responses of the sampled loop. For a target to which the
//! person responds with F, `e/f = (1 - P F)/(1 + B P)` and `u/f = (B + F)/(1 + B P)`, where B is the response to the
//! error. With a response M to motion, `1 + B P` is `1 + (B - M) P` and `e/f` has `M + F` in place of F. All parts are
//! independent, so with shares p_i
//!
//! `var u = (V_0 + sum of K_j^2 V_j of given gains) / (1 - sum of p_i)`, `K_i^2 = p_i var u / V_i`.
//!
//! The response h_i also shows whether the loop is stable, since it then decays to zero.

use hoid_model::{
    Complex64, FamilyOperator, ModelError,
    family_scenario::{FamilyScenario, PartStrength},
    operator_family::ZohFamilyOperator,
    polynomial,
};

use super::{
    noise::{Shaping, ShapingState},
    zoh_loop::{Inputs, LoopState, Outputs, ZohLoop},
};

/// Initial horizon in samples.
const INITIAL_HORIZON: usize = 512;
/// Horizon in samples within which the response of a stable loop must decay.
const MAX_HORIZON: usize = 1 << 20;
/// Fraction of the energy that may remain in the second half of the horizon for a response to count as decayed. The
/// fraction beyond the horizon is then about the square of this value.
const MAX_TAIL_ENERGY: f64 = 1e-7;

/// Mean squares of u, of its steps from sample to sample, and of e.
type MeanSquares = [f64; 3];

/// Strength of the remnant in one state (initial or final) of the scenario.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Calibration {
    /// Gain K of each part.
    pub gains: Vec<f64>,
    /// Mean squares of u, of its step from one sample to the next, and of e.
    pub mean_squares: MeanSquares,
}

impl Calibration {
    pub fn of(
        held: &ZohLoop,
        scenario: &FamilyScenario,
        shapings: &[Shaping],
        is_last: bool,
        seen: Option<&FamilyOperator>,
    ) -> Result<Self, ModelError> {
        // This call checks the stability of the loop even if there is no remnant.
        response_energies(held, &Shaping::White)?;
        let mut sum = line_powers(held, scenario, seen)?;
        let mut energies = Vec::with_capacity(shapings.len());
        let mut shares = 0.0;
        for (shaping, part) in shapings.iter().zip(&scenario.remnant) {
            let own = response_energies(held, shaping)?;
            match part.strength {
                PartStrength::Share(share) => shares += share,
                PartStrength::Gain { initial, last } => {
                    let gain = if is_last { last } else { initial };
                    sum = add(sum, scaled(own, gain * gain));
                }
            }
            energies.push(own);
        }
        if sum[0] == 0.0 && shares > 0.0 {
            return Err(ModelError::OutOfRange {
                quantity: "variance of u without the remnant parts that are given as a share of this variance",
                found: 0.0,
                expected: "more than zero: give a target, a disturbance or a remnant part with a gain",
            });
        }
        let variance = sum[0] / (1.0 - shares);
        let mut mean_squares = sum;
        let mut gains = Vec::with_capacity(energies.len());
        for (own, part) in energies.iter().zip(&scenario.remnant) {
            gains.push(match part.strength {
                PartStrength::Gain { initial, last } => {
                    if is_last {
                        last
                    } else {
                        initial
                    }
                }
                PartStrength::Share(share) => {
                    let square = share * variance / own[0];
                    mean_squares = add(mean_squares, scaled(*own, square));
                    square.sqrt()
                }
            });
        }
        Ok(Self { gains, mean_squares })
    }
}

fn add(a: MeanSquares, b: MeanSquares) -> MeanSquares {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

fn scaled(a: MeanSquares, by: f64) -> MeanSquares {
    a.map(|x| by * x)
}

/// Returns the sums of the squared responses of u, of its steps and of e to one unit of w.
fn response_energies(held: &ZohLoop, shaping: &Shaping) -> Result<MeanSquares, ModelError> {
    let mut state = LoopState::at_rest(held, held.longest_delay());
    let mut shaped = ShapingState::at_rest(shaping);
    let (mut total, mut before, mut w) = ([0.0; 3], 0.0, 1.0);
    let mut horizon = INITIAL_HORIZON;
    let mut done = 0;
    loop {
        let mut block = [0.0; 3];
        while done < horizon {
            let remnant = shaped.step(shaping, w);
            w = 0.0;
            let inputs = Inputs {
                remnant,
                ..Inputs::default()
            };
            let Outputs { e, u, .. } = held.step(&mut state, inputs);
            block = add(block, [u * u, (u - before) * (u - before), e * e]);
            before = u;
            done += 1;
        }
        total = add(total, block);
        let unstable = |reason: &str| ModelError::UnstableLoop {
            reason: reason.to_owned(),
        };
        if !total[0].is_finite() {
            return Err(unstable("the response of u to a unit of remnant grows without bound"));
        }
        if horizon > INITIAL_HORIZON && block[0] <= MAX_TAIL_ENERGY * total[0] {
            return Ok(total);
        }
        if horizon >= MAX_HORIZON {
            return Err(unstable("the response of u to a unit of remnant does not decay"));
        }
        horizon *= 2;
    }
}

/// Returns the frequency response of a held operator; `backward` is the factor of a delay of one sample.
fn zoh_response(held: &ZohFamilyOperator, backward: Complex64) -> Complex64 {
    let denominator = 1.0 + backward * polynomial::value(&held.f, backward);
    polynomial::value(&held.b, backward) * backward.powu(held.nk as u32) / denominator
}

/// Returns the mean squares due to the target and the disturbance.
fn line_powers(
    held: &ZohLoop,
    scenario: &FamilyScenario,
    seen: Option<&FamilyOperator>,
) -> Result<MeanSquares, ModelError> {
    let seen = seen.map(|seen| seen.zoh(scenario.sample_time)).transpose()?;
    let mut sum = [0.0; 3];
    for (excitation, is_target) in [(&scenario.target, true), (&scenario.disturbance, false)] {
        for line in excitation.function.sinusoids() {
            let omega = line.omega_rad_s;
            let missing = || ModelError::OutOfRange {
                quantity: "frequency of a sinusoid in rad/s",
                found: omega,
                expected: "a frequency that is not a pole of the operator or of the controlled element",
            };
            let [y, p] = held.responses(omega).ok_or_else(missing)?;
            let m = held.motion_response(omega).ok_or_else(missing)?;
            let closed = 1.0 + (y - m) * p;
            let backward = Complex64::from_polar(1.0, -omega * scenario.sample_time.s());
            let (of_e, of_u) = match (is_target, &seen) {
                (true, Some(seen)) => {
                    // The preview changes only the phase of F relative to f, which affects e.
                    let shown_s = scenario.feedforward.as_ref().map_or(0.0, |seen| seen.preview_s);
                    let f = zoh_response(seen, backward) * Complex64::from_polar(1.0, omega * shown_s);
                    ((1.0 - p * (m + f)) / closed, (y + f) / closed)
                }
                (true, None) if scenario.motion.is_some() => ((1.0 - p * m) / closed, y / closed),
                (true, None) => (1.0 / closed, y / closed),
                (false, _) => (-p / closed, -(y - m) * p / closed),
            };
            let power = (line.amplitude_deg * of_u.norm()).powi(2) / 2.0;
            let step = (Complex64::from_polar(1.0, omega * scenario.sample_time.s()) - 1.0).norm_sqr();
            let of_error = (line.amplitude_deg * of_e.norm()).powi(2) / 2.0;
            sum = add(sum, [power, power * step, of_error]);
        }
    }
    Ok(sum)
}
