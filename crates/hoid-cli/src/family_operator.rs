//! Text output for an operator of the family that corresponds to given polynomials.

use hoid::ident::family::{FamilyConversion, PoleRole};
use hoid::model::{GainUnit, NotConvertible};

use crate::text;

/// A conversion to an operator of the family, or the reason why it is not possible.
pub type ConversionResult = Result<FamilyConversion, NotConvertible>;

/// Formats a conversion as a table and sentences.
pub fn to_text(found: &ConversionResult, gain: &GainUnit) -> String {
    let found = match found {
        Ok(found) => found,
        Err(reason) => return format!("The model cannot be converted to an operator: {reason}.\n"),
    };
    let all = found.parameters();
    let named = all.iter().map(|(name, unit, e)| (*name, gain.unit(name, unit), *e));
    let rows = text::estimates("operator", named);
    let mut page = format!("Form {}.\n{rows}\n", found.operator.form());
    for pole in &found.real_poles {
        let words = match pole.role {
            PoleRole::Lag => format!("is the lag, T_I = {:.4} s", pole.rate.recip()),
            PoleRole::Neuromuscular => "belongs to the neuromuscular system, which is overdamped".to_owned(),
        };
        page.push_str(&format!("The real pole s = -{:.4} 1/s {words}.\n", pole.rate));
    }
    page.push_str(&if found.mismatch < 1e-6 {
        "The polynomials are the exact model of this operator.\n".to_owned()
    } else {
        format!(
            "The exact model of this operator differs from the polynomials by at most {:.1} % of the response.\n",
            100.0 * found.mismatch
        )
    });
    page
}
