//! The simulated settings for the claims, and queries for the estimates in these settings.

use hoid_study::Query;

/// Nonzero noise levels in the batch plans.
pub(super) const NOISE_LEVELS: [f64; 3] = [0.1, 0.2, 0.3];
/// Orders of the simulated remnant.
pub(super) const REMNANT_ORDERS: [usize; 4] = [1, 2, 3, 4];
/// Orders of the simulated remnant above one.
pub(super) const HIGHER_REMNANT_ORDERS: [usize; 3] = [2, 3, 4];
/// Delays in the batch plans, samples.
pub(super) const DELAYS: [usize; 6] = [25, 26, 27, 28, 29, 30];
/// The simulated delay, samples.
pub(super) const TRUE_DELAY: usize = 29;
/// Coefficients by their names in the thesis.
pub(super) const DISCRETE_PARAMETERS: [&str; 4] = ["a1", "a2", "b0", "b1"];
/// Neuromuscular parameters.
pub(super) const NMS_PARAMETERS: [&str; 2] = ["omega_nm", "zeta_nm"];
/// Noise levels in the plan for section V.B.
pub(super) const RECURSIVE_NOISE_LEVELS: [f64; 3] = [0.01, 0.1, 0.2];
/// Setting without remnant, for which there is one record regardless of m0.
pub(super) const WITHOUT_REMNANT: Setting = Setting {
    condition: "C1",
    m0: 1,
    level: 0.0,
};

/// A simulated setting in a plan: condition, order of the remnant, noise level.
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

/// Name of a quantity for models with F, in which a1 and a2 of the thesis are called f1 and f2.
pub(super) fn name_with_f(quantity: &str) -> String {
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

    /// Query for the batch fit of an ARX model.
    pub fn arx(self, quantity: &str, nk: usize) -> Query {
        self.query(quantity).name("ARX").nk(nk)
    }

    /// Query for the batch fit of a Box-Jenkins model with m* (`nd`) and nk* (`nk`).
    pub fn bj(self, quantity: &str, nd: usize, nk: usize) -> Query {
        self.query(&name_with_f(quantity)).name("BJ").nd(nd).nk(nk)
    }

    /// Query for recursive least squares.
    pub fn rls(self, quantity: &str) -> Query {
        self.query(quantity).name("RLS")
    }

    /// Query for the recursive prediction-error method.
    pub fn rpem(self, quantity: &str) -> Query {
        self.query(&name_with_f(quantity)).name("RPEM")
    }

    pub fn label(self, more: &str) -> String {
        let comma = if more.is_empty() { "" } else { ", " };
        format!(
            "{}, m0 = {}, P_n = {}{comma}{more}",
            self.condition, self.m0, self.level
        )
    }
}

/// Name of the quantity that is the relative bias of a parameter.
pub(super) fn bias_of(parameter: &str) -> String {
    format!("bias_{parameter}")
}
