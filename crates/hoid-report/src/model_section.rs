//! One model on a page: the fit, its records, and additional information.

use hoid_ident::{
    Choice, Fit, MarginEstimates,
    validation::{GoodnessOfFit, Validation},
};
use hoid_model::{OperatorParameters, Record};

/// One model on a page.
#[derive(Debug, Clone, PartialEq)]
pub struct ModelSection<'a> {
    /// Heading and legend text, such as `BJ(nb=2, nd=1, nf=2, nk=29)`.
    pub name: String,
    /// The model.
    pub fit: &'a Fit,
    /// The records of the fit.
    pub records: &'a [Record],
    /// The search that selected the orders of the model, if there was one.
    pub candidates: Option<&'a Choice>,
    /// The true operator, if known (for simulated records).
    pub truth: Option<OperatorParameters>,
    /// Margins of the loop formed by this model and the controlled element, if known.
    pub margins: Option<MarginEstimates>,
}

impl ModelSection<'_> {
    /// The validation of the model on each of its records, or the reason why the validation failed.
    pub(crate) fn validate(&self) -> Vec<Result<Validation, String>> {
        let validation = |record| self.fit.validate(record).map_err(|e| e.to_string());
        self.records.iter().map(validation).collect()
    }

    /// VAF and NRMSE over all records together, or the reason why they cannot be computed.
    pub(crate) fn quality(&self, validations: &[Result<Validation, String>]) -> Result<GoodnessOfFit, String> {
        if self.records.is_empty() {
            return Err("no record was given".to_owned());
        }
        let validations = validations.iter().map(|v| v.as_ref().map_err(Clone::clone));
        let validations: Vec<&Validation> = validations.collect::<Result<_, _>>()?;
        Ok(GoodnessOfFit::pooled(self.records.iter().zip(validations)))
    }
}

/// The true operator, if the records contain the true parameters and these are constant throughout (simulated runs
/// without a change).
pub fn known_operator(records: &[Record]) -> Option<OperatorParameters> {
    let constant = |name: &str| {
        let first = *records.first()?.channel(name)?.first()?;
        // Far from its midpoint a sigmoid still changes the last digits.
        let same = |v: &f64| (v - first).abs() <= 1e-6 * first.abs();
        records
            .iter()
            .all(|r| r.channel(name).is_some_and(|c| c.iter().all(same)))
            .then_some(first)
    };
    Some(OperatorParameters {
        k_e: constant("K_e")?,
        t_l_s: constant("T_L")?,
        omega_nm_rad_s: constant("omega_nm")?,
        zeta_nm: constant("zeta_nm")?,
        tau_e_s: constant("tau_e")?,
    })
}
