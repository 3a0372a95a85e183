//! Orders, delays and noise levels in the figures of the thesis, and their labels.

/// Delays in the figures, samples.
pub(super) const DELAYS: [usize; 5] = [26, 27, 28, 29, 30];

/// Noise levels in the figures.
pub(super) const NOISE_LEVELS: [f64; 4] = [0.0, 0.1, 0.2, 0.3];
/// Remnant orders in all figures.
pub(super) const REMNANT_ORDERS: [usize; 4] = [1, 2, 3, 4];

/// Titles of the columns, `m^0 = 1` to `m^0 = 4`.
pub(super) fn order_titles() -> Vec<String> {
    REMNANT_ORDERS.iter().map(|m| format!("m^0 = {m}")).collect()
}

/// Name of a noise level, such as `P_n = 0.1`.
pub(super) fn level_name(level: f64) -> String {
    format!("P_n = {level}")
}
