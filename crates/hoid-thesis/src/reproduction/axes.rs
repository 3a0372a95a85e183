//! Orders, delays and noise levels of the figures of the text, and their labels.

/// Delays of the figures.
pub(super) const DELAYS: [usize; 5] = [26, 27, 28, 29, 30];

/// Noise levels of the figures.
pub(super) const LEVELS: [f64; 4] = [0.0, 0.1, 0.2, 0.3];
/// Remnant orders of all figures.
pub(super) const REMNANT_ORDERS: [usize; 4] = [1, 2, 3, 4];

/// `m^0 = 1` to `m^0 = 4`.
pub(super) fn order_titles() -> Vec<String> {
    REMNANT_ORDERS.iter().map(|m| format!("m^0 = {m}")).collect()
}

/// `P_n = 0.1`.
pub(super) fn level_name(level: f64) -> String {
    format!("P_n = {level}")
}
