//! The simulated settings of the claims, and the queries for their estimates.

use hoid_study::Query;

/// Noise levels of the batch plans, except 0.
pub(super) const LEVELS: [f64; 3] = [0.1, 0.2, 0.3];
/// Orders of the simulated remnant.
pub(super) const ORDERS: [usize; 4] = [1, 2, 3, 4];
/// Orders for which ARX has enough poles.
pub(super) const HIGHER: [usize; 3] = [2, 3, 4];
/// Delays of the batch plans, samples.
pub(super) const DELAYS: [usize; 6] = [25, 26, 27, 28, 29, 30];
/// The simulated delay, samples.
pub(super) const TRUE_DELAY: usize = 29;
/// Coefficients by the names of the text.
pub(super) const DISCRETE: [&str; 4] = ["a1", "a2", "b0", "b1"];
/// Neuromuscular parameters.
pub(super) const NMS: [&str; 2] = ["omega_nm", "zeta_nm"];
/// Noise levels of the plan of V.B.
pub(super) const RECURSIVE_LEVELS: [f64; 3] = [0.01, 0.1, 0.2];
/// Without remnant there is one record, for any m0.
pub(super) const WITHOUT_REMNANT: Setting = Setting {
    condition: "C1",
    m0: 1,
    level: 0.0,
};

/// A simulated setting of a plan: condition, order of the remnant, noise level.
#[derive(Debug, Clone, Copy)]
pub(super) struct Setting {
    pub condition: &'static str,
    pub m0: usize,
    pub level: f64,
}

pub(super) fn settings(conditions: &[&'static str], orders: &[usize], levels: &[f64]) -> Vec<Setting> {
    let mut all = Vec::new();
    for condition in conditions {
        for m0 in orders {
            all.extend(levels.iter().map(|level| Setting {
                condition,
                m0: *m0,
                level: *level,
            }));
        }
    }
    all
}

/// The name of a quantity of models with F: a1 and a2 of the text are f1 and f2 there.
pub(super) fn with_f(quantity: &str) -> String {
    match quantity
        .strip_suffix("a1")
        .map(|stem| (stem, "f1"))
        .or_else(|| quantity.strip_suffix("a2").map(|stem| (stem, "f2")))
    {
        Some((stem, coefficient)) => format!("{stem}{coefficient}"),
        None => quantity.to_owned(),
    }
}

impl Setting {
    pub fn query(self, quantity: &str) -> Query {
        Query::of(quantity)
            .condition(self.condition)
            .remnant_order(self.m0)
            .noise_level(self.level)
    }

    /// The batch fit of an ARX model.
    pub fn arx(self, quantity: &str, nk: usize) -> Query {
        self.query(quantity).name("ARX").nk(nk)
    }

    /// The batch fit of a Box-Jenkins model with m* and nk*.
    pub fn bj(self, quantity: &str, nd: usize, nk: usize) -> Query {
        self.query(&with_f(quantity)).name("BJ").nd(nd).nk(nk)
    }

    /// Recursive least squares.
    pub fn rls(self, quantity: &str) -> Query {
        self.query(quantity).name("RLS")
    }

    /// The recursive prediction-error method.
    pub fn rpem(self, quantity: &str) -> Query {
        self.query(&with_f(quantity)).name("RPEM")
    }

    pub fn label(self, more: &str) -> String {
        let comma = if more.is_empty() { "" } else { ", " };
        format!(
            "{}, m0 = {}, P_n = {}{comma}{more}",
            self.condition, self.m0, self.level
        )
    }
}

/// The relative bias of a parameter.
pub(super) fn bias_of(parameter: &str) -> String {
    format!("bias_{parameter}")
}
