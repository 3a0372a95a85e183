//! Comparison of recordings that have not been analysed by `hoid group`.

use std::path::Path;

use hoid_study::group::Manifest;

use super::{CompareError, ComparisonOptions, GroupEstimates, Quantity, group_estimates::forms};

impl ComparisonOptions {
    /// Returns the estimates of recordings. The runs are analysed by `analyse` in a directory below `directory`. If
    /// parameters are compared and people differ in their form, the runs are analysed once more in the common form.
    ///
    /// `analyse` runs [`hoid_study::group::run_group`] on a manifest in the given directory. A directory with complete
    /// results is not analysed again.
    ///
    /// # Errors
    /// The errors of `analyse` and of [`GroupEstimates::read`].
    pub fn estimates_of<E: From<CompareError>>(
        &self,
        manifest: &Manifest,
        directory: &Path,
        mut analyse: impl FnMut(&Manifest, &Path) -> Result<(), E>,
    ) -> Result<GroupEstimates, E> {
        let mut estimates_in = |manifest: &Manifest, name: &str| -> Result<GroupEstimates, E> {
            let place = directory.join(name);
            analyse(manifest, &place)?;
            Ok(GroupEstimates::read(&place)?)
        };
        let estimates = estimates_in(manifest, "group")?;
        let of_one_form = |quantity: &Quantity| !quantity.is_form_independent();
        if !self.quantities.iter().any(of_one_form) || forms(estimates.cells.iter(), None).len() < 2 {
            return Ok(estimates);
        }
        let Some(common) = estimates.common_form() else {
            return Ok(estimates);
        };
        let mut in_form = manifest.clone();
        common.form.name().clone_into(&mut in_form.analysis.form);
        let parameters = estimates_in(&in_form, &format!("group-{}", common.form.name()))?;
        Ok(estimates.with_parameters_of(parameters, common))
    }
}
