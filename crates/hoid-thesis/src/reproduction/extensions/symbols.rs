//! Symbols of the operator's parameters, and the noise level of a cell.

/// Columns with the operator's parameters, and the symbols of these parameters.
pub(super) const OPERATOR: [(&str, &str); 5] = [
    ("K_e", "K_e"),
    ("T_L", "T_L"),
    ("K_e_dot", "K_{\u{117}}"),
    ("omega_nm", "\u{3c9}_{nm}"),
    ("zeta_nm", "\u{3b6}_{nm}"),
];

/// Returns the noise level of a cell from its axes; `None` if there is none.
pub(super) fn noise_level_of(axes: &[hoid_study::plan::Axis]) -> Option<f64> {
    axes.iter()
        .find(|axis| axis.key == "remnant_noise_level")?
        .value
        .parse()
        .ok()
}
