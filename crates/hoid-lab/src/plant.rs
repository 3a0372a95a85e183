//! The controlled element over one tick, and the conversion of device positions to u. The page executes the same
//! arithmetic operations in the same order (`page/src/plant.ts`), so both give identical bits.
//!
//! At tick k, with the held input u from the device, the disturbance d and the target f,
//!
//! `v = u + d`, `y = C x + D v`, `e = f - y`, then `x <- A x + B v`.
//!
//! Sums are accumulated from the first term to the last, and each product is rounded before it is added: IEEE 754
//! double precision then determines the result uniquely, in Rust and in ECMAScript. No other operations and no
//! transcendental functions occur, since matrices and signals are tables.

use serde::{Deserialize, Serialize};

/// Matrices of a controlled element over one tick.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Plant {
    /// Matrix A, row by row.
    pub a: Vec<f64>,
    /// Input matrix B.
    pub b: Vec<f64>,
    /// Output matrix C.
    pub c: Vec<f64>,
    /// Direct feedthrough D.
    pub d: f64,
}

impl Plant {
    /// Returns the number of states.
    pub fn order(&self) -> usize {
        self.b.len()
    }

    /// True if the dimensions of the matrices are consistent and the number of states is at most [`MAX_STATES`].
    pub fn is_valid(&self) -> bool {
        let n = self.order();
        n <= MAX_STATES && self.a.len() == n.saturating_mul(n) && self.c.len() == n
    }

    /// Computes y from the state and v.
    pub fn output(&self, x: &[f64], v: f64) -> f64 {
        let mut y = 0.0;
        for (c, x) in self.c.iter().zip(x) {
            y += c * x;
        }
        y + self.d * v
    }

    /// Advances the state by one tick.
    pub fn step(&self, x: &mut [f64], v: f64) {
        let rows = self.a.chunks_exact(self.order().max(1));
        let mut next = [0.0; MAX_STATES];
        for ((next, row), b) in next.iter_mut().zip(rows).zip(&self.b) {
            let mut sum = 0.0;
            for (a, x) in row.iter().zip(&*x) {
                sum += a * x;
            }
            *next = sum + b * v;
        }
        for (x, next) in x.iter_mut().zip(next) {
            *x = next;
        }
    }
}

/// Maximum number of states of a controlled element.
pub const MAX_STATES: usize = 16;

/// Map from the raw value of a device to u.
///
/// `w = (raw - centre)/span`, limited to -1 to 1; `|w| <= dead` gives 0, and larger values are rescaled so that full
/// deflection is unchanged; `u = gain w`. The gain includes sensitivity, direction and u at full deflection.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct InputMap {
    /// Value of the device at rest: pixels from the left edge, or 0 for a gamepad.
    pub centre: f64,
    /// Distance from the rest position to full deflection.
    pub span: f64,
    /// Dead zone as a fraction of the span, at least 0 and below 1.
    pub dead: f64,
    /// u at full deflection; a negative value reverses the direction.
    pub gain: f64,
}

impl InputMap {
    /// Returns u for a value of the device.
    pub fn u(&self, raw: f64) -> f64 {
        let w = ((raw - self.centre) / self.span).clamp(-1.0, 1.0);
        let size = if w < 0.0 { -w } else { w };
        if size <= self.dead {
            return 0.0;
        }
        let moved = (size - self.dead) / (1.0 - self.dead);
        if w < 0.0 {
            -(self.gain * moved)
        } else {
            self.gain * moved
        }
    }

    /// Returns a description of the problem if the map is invalid.
    pub fn fault(&self) -> Option<String> {
        let finite = [self.centre, self.span, self.dead, self.gain]
            .iter()
            .all(|v| v.is_finite());
        let sound = finite && self.span > 0.0 && (0.0..1.0).contains(&self.dead);
        (!sound).then(|| {
            format!(
                "input settings {self:?}, expected finite numbers, a span above zero and a dead zone from 0 to below 1"
            )
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn integrator_sums_held_inputs() {
        let plant = Plant {
            a: vec![1.0],
            b: vec![1e-3],
            c: vec![4.0],
            d: 0.5,
        };
        let mut x = [0.0];
        for _ in 0..1000 {
            plant.step(&mut x, 2.0);
        }
        // The state is the sum of 1000 terms of 2e-3, with a rounding error in each addition.
        assert!((plant.output(&x, 2.0) - 9.0).abs() < 1e-11);
    }

    #[test]
    fn dead_zone_keeps_full_deflection() {
        let map = InputMap {
            centre: 400.0,
            span: 200.0,
            dead: 0.1,
            gain: -3.0,
        };
        for (raw, u) in [
            (400.0, 0.0),
            (419.0, 0.0),
            (600.0, -3.0),
            (900.0, -3.0),
            (200.0, 3.0),
            (510.0, -1.5),
        ] {
            assert!((map.u(raw) - u).abs() < 1e-15, "{raw}");
        }
        assert_eq!(map.fault(), None);
        for bad in [
            InputMap { span: 0.0, ..map },
            InputMap { dead: 1.0, ..map },
            InputMap { gain: f64::NAN, ..map },
        ] {
            assert!(bad.fault().is_some());
        }
    }
}
