//! Initial states of a record, eliminated exactly.
//!
//! The unknown past of a record enters the residuals linearly: the nf past values of w through the free responses of
//! `1/F` (as `-(D/C) h`, h the impulse response of `1/F`), the nc past innovations through those of `1/C`. With G the
//! matrix of these responses and `G = Q R`, the least squares states are `x = -R^-1 Q' eps_0` and the residuals
//! `eps = (I - Q Q') eps_0`. The responses die away, so that Q is short compared with the record. Source: G. H. Golub
//! and V. Pereyra, *SIAM J. Numer. Anal.* 10 (1973) 413-432.
//!
//! With a stationary past ([`crate::criterion::stationary_noise`]) the states of the noise model
//! have a known covariance `sigma^2 L L'`: they are `L z` with z of variance sigma^2, and z counts
//! as further residuals. G then has the rows `[I; G L]` for them.
//!
//! A level of u, the constant that is not a response to e, also enters linearly, through `-(D/C) 1`, and is eliminated
//! with the states. It does not die away: its basis vector is as long as the record.

use hoid_core::filter::{SecondOrder, divide_in_place};

use crate::{
    criterion::stationary_noise::StationaryNoise,
    linalg::least_squares::{add_scaled, dot},
};

/// Orthonormal basis of the responses to the initial states of a record, and the map back to the
/// states.
#[derive(Debug, Default)]
pub(crate) struct InitialStateResponses {
    /// Basis vectors: first the [`InitialStateResponses::prior_rows`] of z, then those from the first residual on;
    /// beyond their end they are zero.
    q: Vec<Vec<f64>>,
    /// `G[:, kept[k]] = sum over l <= k of Q_l r[k][l]`.
    r: Vec<Vec<f64>>,
    kept: Vec<usize>,
    /// Impulse response of 1/F for each input.
    h: Vec<Vec<f64>>,
    /// Input and number of each state of a 1/F; those of the noise model come after them.
    of_inputs: Vec<(usize, usize)>,
    /// Place of the level.
    level: Option<usize>,
    prior_rows: usize,
}

/// Assumptions about the past of a record.
pub(crate) struct InitialHistory<'a> {
    pub c: &'a [f64],
    /// The polynomial that whitens v together with C.
    pub d: &'a [f64],
    /// F of each input.
    pub f: &'a [&'a [f64]],
    /// Samples from the first value of w to the first residual.
    pub lead: usize,
    /// The past of stationary noise; `None` if nothing is known about it.
    pub noise: Option<&'a StationaryNoise>,
    /// Square roots of the weights of the residuals, from the first residual on; `None` if all weights are equal.
    pub weights: Option<&'a [f64]>,
    /// True if u has a level.
    pub level: bool,
}

impl InitialStateResponses {
    /// Computes the responses of `rows` residuals, from the first one on, to the nf initial values of the w of each
    /// input and to the states of the noise model.
    ///
    /// Any free response of 1/F is a combination of its impulse response `h` started at the first
    /// nf samples (that basis stays independent even where f_nf = 0).
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
            let mut s = h.clone();
            s.resize((h.len() + d.len()).min(rows + lead), 0.0);
            for (i, di) in d.iter().enumerate() {
                add_scaled(s.get_mut(i + 1..).unwrap_or_default(), *di, &h);
            }
            if !c.is_empty() {
                s.resize(rows + lead, 0.0);
                divide_in_place(c, &mut s);
            }
            // w grows with a state, the residual falls with w.
            s.iter_mut().for_each(|v| *v = -*v);
            for i in 0..f.len() {
                // The state enters i samples after w starts.
                columns.push(shifted(&s, i, lead, rows));
                of_inputs.push((input, i));
            }
            responses_of_inputs.push(h);
        }
        let prior_rows = past.noise.map_or(0, StationaryNoise::states);
        let unknown = if past.noise.is_some() { prior_rows } else { c.len() };
        if unknown > 0 {
            let k = impulse_response(c, rows);
            let responses: Vec<Vec<f64>> = (0..unknown).map(|j| shifted(&k, j, 0, rows)).collect();
            match past.noise {
                None => columns.extend(responses),
                Some(noise) => columns.extend((0..unknown).map(|j| noise.response(&responses, j))),
            }
        }
        if past.level {
            let mut level = vec![-1.0; rows + lead];
            let ones = vec![-1.0; rows + lead];
            for (i, di) in d.iter().enumerate() {
                add_scaled(level.get_mut(i + 1..).unwrap_or_default(), *di, &ones);
            }
            level.drain(..lead);
            divide_in_place(c, &mut level);
            columns.push(level);
        }
        if let Some(weights) = past.weights {
            for column in &mut columns {
                column.iter_mut().zip(weights).for_each(|(x, w)| *x *= w);
            }
        }
        let mut free = Self {
            h: responses_of_inputs,
            of_inputs,
            level: past.level.then(|| columns.len() - 1),
            prior_rows,
            ..Self::default()
        };
        for (index, column) in columns.into_iter().enumerate() {
            let mut whole = vec![0.0; prior_rows];
            // For a state of the noise.
            if let Some(z) = index
                .checked_sub(free.of_inputs.len())
                .and_then(|state| whole.get_mut(state))
            {
                *z = 1.0;
            }
            whole.extend(column);
            free.orthonormalise(index, whole);
        }
        free
    }

    /// Modified Gram-Schmidt, twice for orthogonality to rounding; a column that depends on the others is dropped.
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
        self.kept.push(index);
    }

    /// Adds the best initial states to the signals: to the w of each input and to v from the first regressed sample on,
    /// and to eps (weighted, if there are weights) from the first residual on. Returns z, which is empty if the past is
    /// not random.
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
        // States of the noise model and a level have no effect on w.
        for (&index, &x) in self.kept.iter().zip(&states) {
            if Some(index) == self.level {
                v.iter_mut().for_each(|v| *v -= x);
            } else if let Some(&(input, late)) = self.of_inputs.get(index)
                && late < v.len()
            {
                add_scaled(&mut w[input][late..], x, &self.h[input]);
                add_scaled(&mut v[late..], -x, &self.h[input]);
            }
        }
        z
    }

    /// True if all responses have died away after a given number of rows.
    pub fn have_died(&self, rows: usize) -> bool {
        /// Share of its size below which a response has died away.
        const DEAD: f64 = 1e-15;
        /// Number of samples that show the amplitude of an oscillation.
        const SWING: usize = 128;
        let dead = |response: &[f64]| {
            response.len() < rows
                || response[response.len().saturating_sub(SWING)..]
                    .iter()
                    .all(|x| x.abs() < DEAD)
        };
        // A basis vector has unit length, and the first value of an impulse response is one.
        self.h.iter().all(|h| h.len() < rows) && self.basis().all(dead)
    }

    /// Returns the orthonormal basis in the rows of the residuals; each vector starts at the first residual, and beyond
    /// its end it is zero.
    pub fn basis(&self) -> impl Iterator<Item = &[f64]> {
        self.q.iter().map(|q| &q[self.prior_rows..])
    }
}

/// Returns `response(t + lead - delay)` for t = 0 .. rows, truncated where the response ends.
fn shifted(response: &[f64], delay: usize, lead: usize, rows: usize) -> Vec<f64> {
    let mut column = vec![0.0; delay.saturating_sub(lead).min(rows)];
    let from = lead.saturating_sub(delay).min(response.len());
    column.extend_from_slice(&response[from..]);
    column.truncate(rows);
    column
}

/// Impulse response of `1/D`, until it has died away (1e-16 of its largest value) or its length is `longest`.
fn impulse_response(d: &[f64], longest: usize) -> Vec<f64> {
    const BLOCK: usize = 128;
    let order = d.len();
    let mut h = vec![0.0; order];
    h.reserve(longest.min(4096));
    let mut largest = 1.0_f64;
    let mut second = SecondOrder::new(d.first().copied().unwrap_or(0.0), d.get(1).copied().unwrap_or(0.0));
    let mut impulse = 1.0;
    while h.len() < order + longest {
        let from = h.len();
        let to = (from + BLOCK).min(order + longest);
        match order {
            2 => {
                h.resize(to, 0.0);
                let (blocks, rest) = h[from..].as_chunks_mut::<4>();
                for block in blocks {
                    *block = second.four([std::mem::take(&mut impulse), 0.0, 0.0, 0.0]);
                }
                for value in rest {
                    *value = second.one(std::mem::take(&mut impulse));
                }
            }
            _ => {
                for t in from..to {
                    let past: f64 = d.iter().enumerate().map(|(i, di)| di * h[t - 1 - i]).sum();
                    h.push(f64::from(u8::from(t == order)) - past);
                }
            }
        }
        let size = h[from..].iter().fold(0.0_f64, |m, y| m.max(y.abs()));
        largest = largest.max(size);
        if size < 1e-16 * largest {
            break;
        }
    }
    h.drain(..order);
    h
}
