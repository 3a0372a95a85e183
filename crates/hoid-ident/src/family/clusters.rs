//! Scores and information matrices of clusters: runs, or blocks of runs.
//!
//! `g_c = sum psi eps` and `G_c = sum psi psi'`, with sums over the samples of cluster c.
//!
//! **Clusters** are the records if there are at least five. Fewer records are divided into blocks of equal length,
//! about eight in total and at least four seconds each, which is longer than the memory of the residuals and of the
//! loop. Variances that are estimated from so few blocks are uncertain. The blocks therefore determine only one number,
//! the inflation kappa of all variances (`covariances`), which is at least one. Since a few records cannot show how
//! people vary from run to run, the variation of the gain is added with a value from other data.

use statrs::distribution::{ContinuousCDF, StudentsT};

use super::layout::FamilyLayout;
use crate::{
    IdentError,
    criterion::Workspace,
    grey_box::{objective::PhysicalCriterion, parametrisation::Parametrisation},
    linalg::{
        products::{LaggedColumn, gram},
        vectors::dot,
    },
};

/// Minimum number of records for which each record is a cluster.
const MIN_RECORDS: usize = 5;
/// Approximate total number of blocks into which fewer records are divided.
const BLOCK_COUNT: usize = 8;
/// Duration of the shortest block, s.
const SHORTEST_BLOCK_S: f64 = 4.0;

/// Returns the degrees of freedom of standard errors that are based on the scatter of n clusters.
pub(super) fn degrees_of_freedom(clusters: usize) -> f64 {
    clusters.saturating_sub(1).max(1) as f64
}

/// Returns the 97.5 % quantile of Student's distribution for n clusters, which is half the width of a 95 % interval in
/// standard errors.
pub(super) fn quantile(clusters: usize) -> f64 {
    StudentsT::new(0.0, 1.0, degrees_of_freedom(clusters)).map_or(1.96, |t| t.inverse_cdf(0.975))
}

/// Type of the clusters.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub enum ClusterKind {
    /// Each record is a cluster.
    Runs,
    /// Each cluster is a block of a record.
    Blocks,
}

/// Scores and information matrices of the clusters.
#[derive(Debug, Clone)]
pub(super) struct Clusters {
    pub kind: ClusterKind,
    /// Score g_c and information matrix G_c of each cluster.
    pub parts: Vec<(Vec<f64>, Vec<f64>)>,
}

impl Clusters {
    pub fn of(
        criterion: &PhysicalCriterion<'_, FamilyLayout>,
        eta: &[f64],
        workspace: &mut Workspace,
    ) -> Result<Self, IdentError> {
        let (p, records) = (eta.len(), criterion.data.len());
        let kind = if records >= MIN_RECORDS {
            ClusterKind::Runs
        } else {
            ClusterKind::Blocks
        };
        let shortest = (SHORTEST_BLOCK_S / criterion.layout.sample_time.s()).ceil() as usize;
        let mut parts = Vec::new();
        for record in 0..records {
            let mapped = criterion.model_of(eta, record)?;
            let of_theta = criterion.record_criterion(&mapped, record);
            let residuals = of_theta.residuals_of(&mapped.theta, 0, workspace);
            let psi = of_theta.jacobian(&mapped.theta, 0, workspace);
            let positions = criterion.layout.positions(record);
            let n = residuals.len();
            // Blocks longer than the memory of the loop and of the noise have nearly independent scores.
            let wanted = match kind {
                ClusterKind::Runs => 1,
                ClusterKind::Blocks => BLOCK_COUNT.div_ceil(records).min(n / shortest.max(1)).max(1),
            };
            for block in 0..wanted {
                let span = block * n / wanted..(block + 1) * n / wanted;
                // Products of the columns of psi and, in the last row, of the residuals with these columns.
                let all = psi.iter().chain([&residuals]).map(|column| LaggedColumn {
                    values: &column[span.clone()],
                    is_shift_of_previous: false,
                });
                let products = gram(&all.collect::<Vec<_>>());
                let q = psi.len();
                let row = |k: usize| &products[k * (q + 1)..][..q];
                // Chain rule: psi_eta = psi_theta dtheta/deta, added to the elements of eta that the record depends on.
                let (mut g, mut big) = (vec![0.0; p], vec![0.0; p * p]);
                for (column, &place) in mapped.columns.iter().zip(positions) {
                    g[place] += dot(column, row(q));
                    let product: Vec<f64> = (0..q).map(|k| dot(row(k), column)).collect();
                    for (other, &at) in mapped.columns.iter().zip(positions) {
                        big[place * p + at] += dot(other, &product);
                    }
                }
                parts.push((g, big));
            }
        }
        Ok(Self { kind, parts })
    }
}
