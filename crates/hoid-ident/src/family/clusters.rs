//! Scores and information of runs, or of blocks of them.
//!
//! `g_c = sum psi eps` and `G_c = sum psi psi'` over cluster c.
//!
//! **Clusters** are the records if there are five or more. Fewer records are cut into blocks of equal length, about
//! eight in all, none shorter than four seconds: longer than the memory of residuals and of the loop. Variances
//! estimated from so few blocks are themselves uncertain; blocks therefore give one number, the inflation kappa of all
//! variances (`covariances`), at least one. The variation from one run to the next cannot be determined from one run:
//! the variation of people's gain is added with the value observed in other data (`covariances`).

use statrs::distribution::{ContinuousCDF, StudentsT};

use super::layout::FamilyLayout;
use crate::{
    IdentError,
    criterion::Workspace,
    grey_box::{objective::PhysicalCriterion, parametrisation::Parametrisation},
    linalg::least_squares::dot,
};

/// Number of records from which on each record is a cluster.
const FEWEST_RECORDS: usize = 5;
/// Blocks into which fewer records are cut.
const BLOCKS: usize = 8;
/// Shortest block, s.
const SHORTEST_BLOCK_S: f64 = 4.0;

/// Degrees of freedom of standard errors from the scatter of n clusters.
pub(super) fn freedom(clusters: usize) -> f64 {
    clusters.saturating_sub(1).max(1) as f64
}

/// Quantile of Student's distribution for 95 % with n clusters.
pub(super) fn quantile(clusters: usize) -> f64 {
    StudentsT::new(0.0, 1.0, freedom(clusters)).map_or(1.96, |t| t.inverse_cdf(0.975))
}

/// Type of the clusters.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub enum ClusterKind {
    /// Each record is a cluster.
    Runs,
    /// Blocks of records.
    Blocks,
}

/// Scores and information of each cluster.
#[derive(Debug, Clone)]
pub(super) struct Clusters {
    pub kind: ClusterKind,
    /// `(g_c, G_c)`.
    pub parts: Vec<(Vec<f64>, Vec<f64>)>,
}

impl Clusters {
    pub fn of(
        criterion: &PhysicalCriterion<'_, FamilyLayout>,
        eta: &[f64],
        workspace: &mut Workspace,
    ) -> Result<Self, IdentError> {
        let (p, records) = (eta.len(), criterion.data.len());
        let kind = if records >= FEWEST_RECORDS {
            ClusterKind::Runs
        } else {
            ClusterKind::Blocks
        };
        let shortest = (SHORTEST_BLOCK_S / criterion.layout.sample_time.s()).ceil() as usize;
        let mut parts = Vec::new();
        for record in 0..records {
            let mapped = criterion.model_of(eta, record)?;
            let of_theta = criterion.of_record(&mapped, record);
            let residuals = of_theta.residuals_of(&mapped.theta, 0, workspace);
            let psi = of_theta.jacobian(&mapped.theta, 0, workspace);
            let positions = criterion.layout.positions(record);
            let n = residuals.len();
            // Blocks longer than the memory of loop and noise have nearly independent scores.
            let wanted = match kind {
                ClusterKind::Runs => 1,
                ClusterKind::Blocks => BLOCKS.div_ceil(records).min(n / shortest.max(1)).max(1),
            };
            for block in 0..wanted {
                let span = block * n / wanted..(block + 1) * n / wanted;
                let part: Vec<&[f64]> = psi.iter().map(|column| &column[span.clone()]).collect();
                let q = part.len();
                let scores: Vec<f64> = part.iter().map(|c| dot(c, &residuals[span.clone()])).collect();
                let mut gram = vec![0.0; q * q];
                for i in 0..q {
                    for j in 0..=i {
                        gram[i * q + j] = dot(part[i], part[j]);
                        gram[j * q + i] = gram[i * q + j];
                    }
                }
                // Chain rule: psi_eta = psi_theta dtheta/deta, summed into the elements of eta that the record uses.
                let (mut g, mut big) = (vec![0.0; p], vec![0.0; p * p]);
                for (column, &place) in mapped.columns.iter().zip(positions) {
                    g[place] += dot(column, &scores);
                    let product: Vec<f64> = (0..q).map(|k| dot(&gram[k * q..(k + 1) * q], column)).collect();
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
