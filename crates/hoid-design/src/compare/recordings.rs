//! Estimates of recordings that are compared without an analysis by `hoid group` first.

use std::path::Path;

use hoid_study::group::Manifest;

use super::{CompareError, Comparing, GroupEstimates, Quantity, group_estimates::forms};

impl Comparing {
    /// Estimates of recordings: the runs are analysed by `analyse` into directories below `directory`, and if parameters
    /// are compared and people differ in their form, once more in the common form.
    ///
    /// `analyse` runs [`hoid_study::group::run_group`] on the manifest, into the directory; a completed directory is
    /// not analysed again.
    ///
    /// # Errors
    /// Those of `analyse`, and of [`GroupEstimates::read`].
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
        let of_one_form = |quantity: &Quantity| !quantity.is_of_any_form();
        if !self.of.iter().any(of_one_form) || forms(estimates.cells.iter()).len() < 2 {
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
