//! Exact elimination of the initial states of a record.
//!
//! The unknown past of a record enters the residuals linearly: the nf past values of w through the free responses of
//! `1/F` (as `-(D/C) h`, where h is the impulse response of `1/F`), and the nc past innovations through the free
//! responses of `1/C`. If G is the matrix of these responses and `G = Q R`, the least squares states are
//! `x = -R^-1 Q' eps_0` and the residuals are `eps = (I - Q Q') eps_0`. The responses decay, so Q is short compared
//! with the record. Source: G. H. Golub and V. Pereyra, *SIAM J. Numer. Anal.* 10 (1973) 413-432.
//!
//! With a stationary past ([`crate::criterion::stationary_noise`]) the states of the noise model have a known
//! covariance `sigma^2 L L'`. They equal `L z`, where z has the covariance `sigma^2 I` and counts as additional
//! residuals. The columns of G for these states, G_n, are then replaced by `[I; G_n L]`.
//!
//! A level of u, the constant that is not a response to e, also enters linearly and is eliminated together with the
//! states. Any constant is the response of `1/F` to another constant plus a free response of `1/F`, so the column of
//! the level is `-(D/C) (1/F) 1`, and w contains the level. With a pole close to one (an integration), `(1/F) 1` is a
//! ramp: the response to a mean that was removed from e. If this ramp were expressed by a constant and free responses,
//! it would be a difference of numbers that are larger by the factor `1/(1 - pole)`, and `psi' psi` would lose all
//! digits. The response to the level does not decay, so its basis vector is as long as the record.

use std::sync::Arc;

use hoid_core::filter::{divide_from, divide_in_place};

use crate::{
    criterion::{stationary_noise::StationaryNoise, whitening::whiten},
    linalg::vectors::{add_scaled, dot},
};

/// Orthonormal basis of the responses to the initial states of a record, and the map from this basis to the states.
#[derive(Debug, Default)]
pub(crate) struct InitialStateResponses {
    /// Basis vectors. The first `prior_rows` elements belong to the states z of stationary noise, the others to the
    /// residuals from the first residual on. Beyond the end of a vector the elements are zero.
    q: Vec<Vec<f64>>,
    /// Coefficients of the retained columns of G in this basis: `G[:, kept[k]] = sum over l <= k of Q_l r[k][l]`.
    r: Vec<Vec<f64>>,
    kept_columns: Vec<usize>,
    /// Impulse response of 1/F for each input.
    h: Vec<Vec<f64>>,
    /// For each state of a filter `1/F`: the index of the input, and the index of the state within the filter. In G
    /// these states come first, before those of the noise model.
    input_states: Vec<(usize, usize)>,
    /// Index of the level among the columns of G, and its response `(1/F) 1`.
    level: Option<(usize, Vec<f64>)>,
    prior_rows: usize,
}

/// Assumptions about the past of a record.
pub(crate) struct InitialHistory<'a> {
    pub c: &'a [f64],
    /// The polynomial D of the whitening filter D/C.
    pub d: &'a [f64],
    /// F of each input.
    pub f: &'a [&'a [f64]],
    /// Number of samples from the first value of w to the first residual.
    pub lead: usize,
    /// Covariance of the initial state of stationary noise; `None` if nothing is assumed about the past of the noise.
    pub noise: Option<&'a StationaryNoise>,
    /// Square roots of the residual weights, from the first residual on; `None` if all weights are equal.
    pub weights: Option<&'a [f64]>,
    /// True if u has a level.
    pub level: bool,
}

/// The last responses that were computed: records of the same length have the same responses.
#[derive(Debug, Default)]
pub(super) struct LastResponses {
    /// C, D and the F of each input.
    polynomials: Vec<Vec<f64>>,
    /// Lead, rows, and whether there is a level.
    size: (usize, usize, bool),
    responses: Arc<InitialStateResponses>,
}

impl LastResponses {
    /// Returns the responses, computed only if they differ from the last ones. With weights or a stationary past they
    /// are always computed.
    pub fn of(&mut self, past: &InitialHistory<'_>, rows: usize) -> Arc<InitialStateResponses> {
        if past.noise.is_some() || past.weights.is_some() {
            return Arc::new(InitialStateResponses::of(past, rows));
        }
        let polynomials = || [past.c, past.d].into_iter().chain(past.f.iter().copied());
        let size = (past.lead, rows, past.level);
        if self.size != size || !polynomials().eq(self.polynomials.iter().map(Vec::as_slice)) {
            *self = Self {
                polynomials: polynomials().map(<[f64]>::to_vec).collect(),
                size,
                responses: Arc::new(InitialStateResponses::of(past, rows)),
            };
        }
        self.responses.clone()
    }
}

impl InitialStateResponses {
    /// Computes an orthonormal basis of the responses of the first `rows` residuals to the initial values of w of each
    /// input, to the states of the noise model, and to the level, if u has one.
    ///
    /// Any free response of 1/F is a combination of copies of its impulse response `h` that start at the first nf
    /// samples. This basis remains linearly independent even for f_nf = 0.
    pub fn of(past: &InitialHistory<'_>, rows: usize) -> Self {
        let InitialHistory { c, d, f, lead, .. } = *past;
        let mut columns: Vec<Vec<f64>> = Vec::new();
        let mut responses_of_inputs = Vec::with_capacity(f.len());
        let mut of_inputs = Vec::new();
        for (input, f) in f.iter().enumerate() {
            let h = if f.is_empty() {
                Vec::new()
            } else {
                impulse_response(f, rows + lead)
            };
            let longest = if c.is_empty() { h.len() + d.len() } else { usize::MAX };
            let mut padded = h.clone();
            padded.resize(longest.min(rows + lead), 0.0);
            let mut s = vec![0.0; padded.len()];
            whiten(c, d, &padded, &mut s, 0);
            // w increases with the state, and the residual decreases with w.
            s.iter_mut().for_each(|v| *v = -*v);
            for i in 0..f.len() {
                // The response to state i starts i samples after w.
                columns.push(shifted_response(&s, i, lead, rows));
                of_inputs.push((input, i));
            }
            responses_of_inputs.push(h);
        }
        let prior_rows = past.noise.map_or(0, StationaryNoise::state_count);
        let unknown = if past.noise.is_some() { prior_rows } else { c.len() };
        if unknown > 0 {
            let k = impulse_response(c, rows);
            let responses: Vec<Vec<f64>> = (0..unknown).map(|j| shifted_response(&k, j, 0, rows)).collect();
            match past.noise {
                None => columns.extend(responses),
                Some(noise) => columns.extend((0..unknown).map(|j| noise.response(&responses, j))),
            }
        }
        let level = past.level.then(|| {
            let mut response = vec![1.0; rows + lead];
            divide_in_place(f.first().copied().unwrap_or_default(), &mut response);
            (columns.len(), response)
        });
        if let Some((_, response)) = &level {
            let mut column = vec![0.0; response.len()];
            whiten(&[], d, response, &mut column, 0);
            column.drain(..lead);
            divide_in_place(c, &mut column);
            column.iter_mut().for_each(|v| *v = -*v);
            columns.push(column);
        }
        if let Some(weights) = past.weights {
            for column in &mut columns {
                column.iter_mut().zip(weights).for_each(|(x, w)| *x *= w);
            }
        }
        let mut free = Self {
            h: responses_of_inputs,
            input_states: of_inputs,
            level,
            prior_rows,
            ..Self::default()
        };
        for (index, column) in columns.into_iter().enumerate() {
            let mut whole = vec![0.0; prior_rows];
            // With a stationary past, the column of each noise state starts with a column of the identity matrix.
            if let Some(z) = index
                .checked_sub(free.input_states.len())
                .and_then(|state| whole.get_mut(state))
            {
                *z = 1.0;
            }
            whole.extend(column);
            free.orthonormalise(index, whole);
        }
        free
    }

    /// Modified Gram-Schmidt, applied twice for orthogonality to rounding. A column that depends linearly on the
    /// previous columns is dropped.
    fn orthonormalise(&mut self, index: usize, mut column: Vec<f64>) {
        let size = dot(&column, &column).sqrt();
        let mut r = vec![0.0; self.q.len()];
        for _ in 0..2 {
            for (q, rk) in self.q.iter().zip(&mut r) {
                let common = q.len().min(column.len());
                let component = dot(&q[..common], &column[..common]);
                *rk += component;
                if column.len() < q.len() {
                    column.resize(q.len(), 0.0);
                }
                add_scaled(&mut column[..q.len()], -component, q);
            }
        }
        let rest = dot(&column, &column).sqrt();
        if rest.is_nan() || rest <= 1e-10 * size {
            return;
        }
        column.iter_mut().for_each(|v| *v /= rest);
        r.push(rest);
        self.q.push(column);
        self.r.push(r);
        self.kept_columns.push(index);
    }

    /// Adds the contribution of the least squares initial states to the signals: to w of each input and to v, from the
    /// first regressed sample on, and to eps (weighted if there are weights), from the first residual on. Returns z,
    /// which is empty unless the past is stationary.
    pub fn eliminate(&self, w: &mut [&mut [f64]], v: &mut [f64], eps: &mut [f64]) -> Vec<f64> {
        let components: Vec<f64> = self.basis().map(|q| dot(q, &eps[..q.len()])).collect();
        for (q, &component) in self.basis().zip(&components) {
            add_scaled(&mut eps[..q.len()], -component, q);
        }
        let z = (0..self.prior_rows)
            .map(|i| -self.q.iter().zip(&components).map(|(q, c)| q[i] * c).sum::<f64>())
            .collect();
        // R x = -Q' eps by back substitution.
        let mut states: Vec<f64> = components.iter().map(|c| -c).collect();
        for k in (0..states.len()).rev() {
            states[k] /= self.r[k][k];
            for l in 0..k {
                states[l] -= self.r[k][l] * states[k];
            }
        }
        // The states of the noise model change neither w nor v.
        for (&index, &x) in self.kept_columns.iter().zip(&states) {
            if let Some((_, response)) = self.level.as_ref().filter(|(place, _)| *place == index) {
                if let Some(w) = w.first_mut() {
                    add_scaled(w, x, response);
                }
                add_scaled(v, -x, response);
            } else if let Some(&(input, late)) = self.input_states.get(index)
                && late < v.len()
            {
                add_scaled(&mut w[input][late..], x, &self.h[input]);
                add_scaled(&mut v[late..], -x, &self.h[input]);
            }
        }
        z
    }

    /// True if all responses have decayed after the given number of rows.
    pub fn have_decayed(&self, rows: usize) -> bool {
        /// Relative magnitude below which a response counts as decayed.
        const DECAY_THRESHOLD: f64 = 1e-15;
        /// Number of samples over which the amplitude of an oscillating response is assessed.
        const OSCILLATION_WINDOW_SAMPLES: usize = 128;
        let dead = |response: &[f64]| {
            response.len() < rows
                || response[response.len().saturating_sub(OSCILLATION_WINDOW_SAMPLES)..]
                    .iter()
                    .all(|x| x.abs() < DECAY_THRESHOLD)
        };
        // No scaling is needed: a basis vector has unit length, and an impulse response starts at one.
        self.h.iter().all(|h| h.len() < rows) && self.basis().all(dead)
    }

    /// Returns the rows of the orthonormal basis that belong to residuals. Each vector starts at the first residual;
    /// beyond its end it is zero.
    pub fn basis(&self) -> impl Iterator<Item = &[f64]> {
        self.q.iter().map(|q| &q[self.prior_rows..])
    }
}

/// Returns `response(t + lead - delay)` for t = 0 .. rows, truncated at the end of the response.
fn shifted_response(response: &[f64], delay: usize, lead: usize, rows: usize) -> Vec<f64> {
    let mut column = vec![0.0; delay.saturating_sub(lead).min(rows)];
    let from = lead.saturating_sub(delay).min(response.len());
    column.extend_from_slice(&response[from..]);
    column.truncate(rows);
    column
}

/// Returns the impulse response of `1/D`, truncated when it has decayed to 1e-16 of its largest value or has `longest`
/// samples.
fn impulse_response(d: &[f64], longest: usize) -> Vec<f64> {
    const BLOCK_LENGTH: usize = 128;
    let order = d.len();
    let mut h = vec![0.0; order];
    h.reserve(longest.min(4096));
    let mut largest = 1.0_f64;
    while h.len() < order + longest {
        let from = h.len();
        let to = (from + BLOCK_LENGTH).min(order + longest);
        h.resize(to, 0.0);
        if from == order {
            h[from] = 1.0;
        }
        divide_from(d, &mut h, from);
        let size = h[from..].iter().fold(0.0_f64, |m, y| m.max(y.abs()));
        largest = largest.max(size);
        if size < 1e-16 * largest {
            break;
        }
    }
    h.drain(..order);
    h
}
