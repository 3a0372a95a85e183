//! Interface between the criterion and the physical parameters: polynomials as functions of the parameters.

use std::ops::Range;

use hoid_model::{ModelError, Orders, SampleTime};

use crate::criterion::further_input::InputOrders;

/// Orders and theta of one record for a given eta, and the derivatives of theta, with a column for each slot of the
/// record.
#[derive(Debug, Clone)]
pub(crate) struct MappedPolynomials {
    pub orders: Orders,
    /// Orders of the further inputs, whose coefficients are at the end of theta.
    pub further: Vec<InputOrders>,
    pub theta: Vec<f64>,
    pub columns: Vec<Vec<f64>>,
}

/// Sampling intervals to which the delays are restricted; empty if there is no restriction.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct DelayIntervals<'s> {
    /// Indices of the delays in eta.
    pub delays: &'s [usize],
    pub samples: &'s [usize],
}

impl DelayIntervals<'_> {
    /// Returns the sampling interval chosen for the delay at index `slot` of eta; `None` if there is no restriction.
    pub fn sampling_interval(&self, slot: usize) -> Option<usize> {
        let index = self.delays.iter().position(|&delay| delay == slot)?;
        self.samples.get(index).copied()
    }
}

impl MappedPolynomials {
    /// Returns the covariance of theta by rows, `J C J'`, from the covariance C of eta; `indices` are the indices in
    /// eta of the slots of the record.
    pub fn covariance_of_theta(&self, of_eta: &[f64], p: usize, indices: &[usize]) -> Vec<f64> {
        let columns = &self.columns;
        let of = |row: usize, other: usize| -> f64 {
            let pairs = indices.iter().enumerate().flat_map(|(i, &a)| {
                indices
                    .iter()
                    .enumerate()
                    .map(move |(j, &b)| columns[i][row] * of_eta[a * p + b] * columns[j][other])
            });
            pairs.sum()
        };
        let rows = 0..self.theta.len();
        rows.clone()
            .flat_map(|row| rows.clone().map(move |other| (row, other)))
            .map(|(row, other)| of(row, other))
            .collect()
    }
}

/// Relation between the physical parameters eta of one or several records and the polynomials.
pub(crate) trait Parametrisation: Clone {
    /// Returns the index in eta of each slot of a record.
    fn positions(&self, record: usize) -> &[usize];
    /// Returns the lower and the upper bound of each element of eta.
    fn limits(&self) -> &[(f64, f64)];
    /// Returns the indices of the delays in eta.
    fn delay_indices(&self) -> Vec<usize>;
    /// Returns the index in eta of the delay of a record.
    fn delay_index(&self, record: usize) -> usize;
    /// Returns the sample time.
    fn sample_time(&self) -> SampleTime;
    /// Returns the delay in samples at which the sampling interval 0 starts: -0.5 if e is interpolated (the response is
    /// then half a sample later), 0 by default.
    fn first_interval_start(&self) -> f64 {
        0.0
    }
    /// Returns the orders of the polynomials if the first coefficient of B has the delay nk.
    fn orders(&self, nk: usize) -> Orders;
    /// Returns the ranges of indices in eta that contain a polynomial C, which must be stable and is not restricted by
    /// limits.
    fn stable_blocks(&self) -> Vec<Range<usize>>;
    /// Returns the orders of the further inputs at their shortest delays; there are none by default.
    fn further_input_orders(&self) -> Vec<InputOrders> {
        Vec::new()
    }
    /// Returns the polynomials of one record, with its delays in the given sampling intervals. Records with the same
    /// indices in eta have the same polynomials.
    ///
    /// # Errors
    /// [`ModelError`] if there is no model for this eta.
    fn map(&self, eta: &[f64], record: usize, held: DelayIntervals<'_>) -> Result<MappedPolynomials, ModelError>;
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn covariance_of_a_linear_map_matches_hand_calculation() {
        // theta = [x + 2 y, x - y] of eta = [y, other, x].
        let mapped = MappedPolynomials {
            orders: Orders::default(),
            further: Vec::new(),
            theta: vec![0.0; 2],
            columns: vec![vec![1.0, 1.0], vec![2.0, -1.0]],
        };
        let (xx, yy, xy) = (4.0, 9.0, 1.5);
        let of_eta = [yy, 7.0, xy, 7.0, 7.0, 7.0, xy, 7.0, xx];
        let expected = [
            xx + 4.0 * xy + 4.0 * yy,
            xx + xy - 2.0 * yy,
            xx + xy - 2.0 * yy,
            xx - 2.0 * xy + yy,
        ];
        assert_eq!(mapped.covariance_of_theta(&of_eta, 3, &[2, 0]), expected);
    }
}
