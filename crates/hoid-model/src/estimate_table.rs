//! Estimates as a plain text table: name, value ± standard error, unit.
//!
//! The standard error determines the number of digits ([`crate::numbers`]); values are right-aligned, and standard
//! errors are left-aligned.

use std::fmt;

use crate::{
    estimate::Estimate,
    numbers::{DASH, with_uncertainty},
};

/// Writes one row per estimate: name, estimate and unit (empty if there is no unit). A line feed precedes each row
/// except the first.
///
/// # Errors
/// Any error returned by the formatter.
///
/// ```
/// use hoid_model::{estimate_table::write_rows, uncertainty::Estimate};
///
/// struct Table;
///
/// impl std::fmt::Display for Table {
///     fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
///         write_rows(f, [
///             ("K_e", Estimate::with_variance(0.09013, 1.44e-6), "deg/deg"),
///             ("tau_e", Estimate::fixed(0.28), "s"),
///         ])
///     }
/// }
///
/// assert_eq!(Table.to_string(), "K_e    0.0901 ± 0.0012  deg/deg\ntau_e    0.28           s");
/// ```
pub fn write_rows<N: AsRef<str>>(
    f: &mut fmt::Formatter<'_>,
    rows: impl IntoIterator<Item = (N, Estimate, &'static str)>,
) -> fmt::Result {
    let rows: Vec<(N, String, String, &str)> = rows
        .into_iter()
        .map(|(name, estimate, unit)| {
            let (value, error) = with_uncertainty(estimate.value, estimate.standard_error);
            let error = if error == DASH {
                String::new()
            } else {
                format!(" ± {error}")
            };
            (name, value, error, unit)
        })
        .collect();
    let widest = |width: fn(&(N, String, String, &'static str)) -> usize| rows.iter().map(width).max().unwrap_or(0);
    let of_name = widest(|row| row.0.as_ref().chars().count());
    let of_value = widest(|row| row.1.chars().count());
    let of_error = widest(|row| row.2.chars().count());
    for (i, (name, value, error, unit)) in rows.iter().enumerate() {
        let line = format!(
            "{:of_name$}  {value:>of_value$}{error:of_error$}  {unit}",
            name.as_ref()
        );
        f.write_str(if i > 0 { "\n" } else { "" })?;
        f.write_str(line.trim_end())?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use crate::uncertainty::{Estimate, OperatorEstimate};

    #[test]
    fn operator_table_digits_follow_the_errors() {
        let operator = OperatorEstimate {
            k_e: Estimate::with_variance(0.090_134, 0.0012_f64.powi(2)),
            t_l_s: Estimate::with_variance(0.4021, 0.0103_f64.powi(2)),
            k_e_dot: Estimate::with_variance(0.036_24, 0.000_52_f64.powi(2)),
            omega_nm_rad_s: Estimate::with_variance(11.2499, 0.0996_f64.powi(2)),
            zeta_nm: Estimate::with_variance(0.3512, 0.02_f64.powi(2)),
            tau_e_s: Estimate::fixed(0.28),
        };
        let expected = "\
K_e        0.0901 ± 0.0012
T_L         0.402 ± 0.010    s
K_e_dot   0.03624 ± 0.00052  s
omega_nm    11.25 ± 0.10     rad/s
zeta_nm     0.351 ± 0.020
tau_e        0.28            s";
        assert_eq!(operator.to_string(), expected);
    }

    #[test]
    fn estimate_is_printed_as_value_and_error() {
        assert_eq!(
            Estimate::with_variance(11.2499, 0.0996_f64.powi(2)).to_string(),
            "11.25 ± 0.10"
        );
        assert_eq!(Estimate::fixed(0.28).to_string(), "0.28");
        assert_eq!(Estimate::fixed(f64::NAN).to_string(), crate::numbers::DASH);
    }
}
