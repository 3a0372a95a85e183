//! Random numbers from a seed, and u of an operator without noise, for tests and studies of the batch estimators.

use hoid_model::operator_family::ZohFamilyOperator;

/// Uniform random numbers from a linear congruential generator.
pub struct Uniform(pub u64);

impl Uniform {
    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        low + (high - low) * (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }

    pub fn log_uniform(&mut self, low: f64, high: f64) -> f64 {
        self.between(low.ln(), high.ln()).exp()
    }

    /// Returns a sum of twelve uniform numbers: normal except for its tails, variance one.
    pub fn normal(&mut self) -> f64 {
        (0..12).map(|_| self.between(0.0, 1.0)).sum::<f64>() - 6.0
    }
}

/// Returns `u(k) = sum b_i e(k - nk - i) - sum f_i u(k - i)`, started at rest.
pub fn response_to(model: &ZohFamilyOperator, e: &[f64]) -> Vec<f64> {
    let mut u = vec![0.0; e.len()];
    for k in 0..e.len() {
        let input = (model.b.iter().enumerate()).map(|(i, b)| k.checked_sub(model.nk + i).map_or(0.0, |at| b * e[at]));
        let past = (model.f.iter().enumerate()).map(|(i, f)| k.checked_sub(1 + i).map_or(0.0, |at| -f * u[at]));
        u[k] = input.sum::<f64>() + past.sum::<f64>();
    }
    u
}
