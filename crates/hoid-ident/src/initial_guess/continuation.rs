//! A start from averaged records, which have fewer samples and whose loss has fewer minima.
//!
//! Input and output are filtered by the same moving average over K samples and decimated by K. At low frequencies the
//! system between them stays the same, with its poles raised to the power K. On these records the search is completed
//! from a few points of the pole grid, at about 1/K of the cost. The K-th roots of the resulting poles are the start of
//! the search on the original records. The delay becomes a fraction of a sample, so B has one additional coefficient.
//!
//! The result is only a start. It is poor for a system that is fast compared with K samples; for such a system other
//! starts are tried as well.

use hoid_model::{Complex64, Orders, SampleTime, polynomial, polynomial_model::monic};

use crate::{
    criterion::{Block, Criterion, Data, InitialState, Workspace, first_residual},
    initial_guess::pole_grid::pole_grid,
    multistart::{LinearisationClient, MultiStart, Start},
    optimize::Linearisation,
    optimize::{Objective, SearchMethod, SearchOptions},
};

/// Minimum number of samples of each averaged record.
const MIN_AVERAGED_SAMPLES: usize = 800;
/// Largest number K of samples that are averaged.
const LARGEST_AVERAGING_FACTOR: usize = 8;
/// Largest number of coefficients of D for the averaged records.
const LARGEST_ND: usize = 2;
/// Number of points of the pole grid from which searches on the averaged records are made.
const SEARCHED_POINT_COUNT: usize = 2;
/// Limits of the searches on the averaged records.
const SEARCH_OPTIONS: SearchOptions = SearchOptions {
    method: SearchMethod::LevenbergMarquardt,
    max_iterations: 30,
    tolerance: 1e-6,
};

/// A pole z of the averaged records is well inside the remaining band if `|ln z|` is below this limit (the Nyquist
/// frequency is pi).
const SLOW_POLE_LIMIT: f64 = 1.3;

/// Poles estimated from the averaged records.
#[derive(Debug, Default)]
pub(crate) struct SlowPoles {
    /// Polynomials F, best first. Empty if the records are too short, or if the model has poles outside F.
    pub f: Vec<Vec<f64>>,
    /// True if all poles of the best F are slow compared with the averaging, so the averaged records determine F nearly
    /// as well as the original records do.
    pub complete: bool,
}

/// Returns candidates for F from the averaged records.
pub(crate) fn slow_poles(criterion: &Criterion<'_>, sample_time: SampleTime, workspace: &mut Workspace) -> SlowPoles {
    let Some(averaged) = AveragedRecords::of(criterion, sample_time) else {
        return SlowPoles::default();
    };
    let low = averaged.criterion();
    let mut continuation = Continuation::new(&averaged, &low);
    while let Some(theta) = continuation.evaluation_point() {
        let there = match continuation.block() {
            Some(block) => low.linearise_block(theta, block, workspace),
            None => low.linearise(theta, workspace),
        };
        continuation.update(there, workspace);
    }
    continuation.into_slow_poles()
}

/// The averaged records of a criterion.
pub(crate) struct AveragedRecords {
    factor: usize,
    orders: Orders,
    sample_time: SampleTime,
    records: Vec<[Vec<f64>; 2]>,
}

impl AveragedRecords {
    /// Averages the records of a criterion; `None` if they are too short, or if the model has poles outside F.
    pub fn of(criterion: &Criterion<'_>, sample_time: SampleTime) -> Option<Self> {
        let shortest = criterion.data.iter().map(|d| d.u.len()).min().unwrap_or(0);
        let factor = (shortest / MIN_AVERAGED_SAMPLES).min(LARGEST_AVERAGING_FACTOR);
        let o = criterion.orders;
        if factor < 2 || o.nf == 0 || o.na > 0 {
            return None;
        }
        let orders = Orders {
            nb: o.nb + 1,
            nd: (o.nc + o.nd).min(LARGEST_ND),
            nf: o.nf,
            nk: o.nk / factor,
            ..Orders::default()
        };
        let needed = first_residual(&orders, InitialState::Estimate) + orders.parameter_count() + orders.nf;
        let sample_time = SampleTime::new(sample_time.s() * factor as f64).ok()?;
        (shortest / factor > needed).then(|| Self {
            factor,
            orders,
            sample_time,
            records: (criterion.data.iter())
                .map(|d| [averaged(d.e, factor), averaged(d.u, factor)])
                .collect(),
        })
    }

    /// Returns the criterion of the averaged records.
    pub fn criterion(&self) -> Criterion<'_> {
        Criterion {
            orders: self.orders,
            data: self.records.iter().map(|[e, u]| Data::new(e, u)).collect(),
            initial: InitialState::Estimate,
            first: first_residual(&self.orders, InitialState::Estimate),
            weights: None,
            further: Vec::new(),
        }
    }
}

/// Search on the averaged records. The points of the pole grid are ranked with one noise model, which is estimated at
/// the first point; searches then start from the best points.
pub(crate) struct Continuation<'c> {
    averaged_criterion: &'c Criterion<'c>,
    factor: usize,
    grid: Vec<Vec<f64>>,
    /// Noise model for the ranking; `None` until it has been estimated.
    noise: Option<Vec<f64>>,
    /// Current point of the pole grid; `None` after the last point.
    trial: Option<Start>,
    tried_count: usize,
    ranked_starts: Vec<Start>,
    searches: Option<MultiStart<'c>>,
}

impl<'c> Continuation<'c> {
    /// Creates the search on the averaged records; `averaged_criterion` is their criterion.
    pub fn new(averaged: &AveragedRecords, averaged_criterion: &'c Criterion<'c>) -> Self {
        let grid = pole_grid(averaged_criterion.orders.nf, averaged.sample_time);
        let mut continuation = Self {
            averaged_criterion,
            factor: averaged.factor,
            grid: grid.into_iter().map(|(_, f)| f).collect(),
            noise: (averaged_criterion.orders.nd == 0).then(Vec::new),
            trial: None,
            tried_count: 0,
            ranked_starts: Vec::new(),
            searches: None,
        };
        continuation.start_next_trial();
        continuation
    }

    /// Proceeds to the next point of the grid or, after the last point, to the searches.
    fn start_next_trial(&mut self) {
        let o = &self.averaged_criterion.orders;
        let start = |noise: &[f64], f: &[f64], left| {
            Start::with_unknown("pole grid", [&vec![0.0; o.nb], noise, f].concat(), left)
        };
        self.trial = match (&self.noise, self.grid.get(self.tried_count)) {
            (None, Some(f)) => Some(start(&vec![0.0; o.nd], f, vec![Block::D, Block::B])),
            (Some(noise), Some(f)) => Some(start(noise, f, vec![Block::B])),
            (_, None) => None,
        };
        if self.trial.is_none() {
            let mut ranked = std::mem::take(&mut self.ranked_starts);
            ranked.sort_by(|a, b| a.value.total_cmp(&b.value));
            ranked.truncate(SEARCHED_POINT_COUNT);
            let starts = ranked.into_iter().map(|start| start.with_unknown_noise(o)).collect();
            self.searches = Some(MultiStart::new(
                self.averaged_criterion,
                *o,
                &SEARCH_OPTIONS,
                SEARCHED_POINT_COUNT,
                starts,
            ));
        }
    }

    /// Returns the poles that the search has found, converted to the original sample time.
    pub fn into_slow_poles(self) -> SlowPoles {
        let o = &self.averaged_criterion.orders;
        let mut minima = self.searches.map(|searches| searches.minima).unwrap_or_default();
        minima.sort_by(|(_, a), (_, b)| {
            a.linearisation
                .sum_of_squares
                .total_cmp(&b.linearisation.sum_of_squares)
        });
        let f: Vec<Vec<f64>> = minima
            .into_iter()
            .filter_map(|(_, minimum)| root_of_poles(&minimum.theta[o.parameter_count() - o.nf..], self.factor))
            .filter(|f| hoid_core::stability::roots_inside(f, 1.0))
            .collect();
        let slow = |f: &Vec<f64>| {
            polynomial::roots(&monic(f))
                .is_some_and(|z| z.iter().all(|z| z.ln().norm() * (self.factor as f64) < SLOW_POLE_LIMIT))
        };
        SlowPoles {
            complete: f.first().is_some_and(slow),
            f,
        }
    }
}

impl LinearisationClient for Continuation<'_> {
    fn criterion(&self) -> &Criterion<'_> {
        self.averaged_criterion
    }

    fn evaluation_point(&self) -> Option<&[f64]> {
        match (&self.trial, &self.searches) {
            (Some(trial), _) => Some(&trial.theta),
            (None, Some(searches)) => searches.evaluation_point(),
            (None, None) => None,
        }
    }

    fn block(&self) -> Option<Block> {
        match (&self.trial, &self.searches) {
            (Some(trial), _) => trial.next_block(),
            (None, Some(searches)) => searches.block(),
            (None, None) => None,
        }
    }

    fn update(&mut self, there: Linearisation, workspace: &mut Workspace) {
        let o = &self.averaged_criterion.orders;
        let Some(mut trial) = self.trial.take() else {
            if let Some(searches) = &mut self.searches {
                searches.update(there, workspace);
            }
            return;
        };
        trial.update(o, &there);
        if trial.next_block().is_some() {
            self.trial = Some(trial);
            return;
        }
        let known = trial.value.is_finite();
        if self.noise.is_none() && known {
            // The ranking starts again at the first point, now with the noise model.
            self.noise = Some(trial.theta[Block::D.range(o)].to_vec());
            self.tried_count = 0;
        } else {
            self.ranked_starts.extend(known.then_some(trial));
            self.tried_count += 1;
        }
        self.start_next_trial();
    }
}

/// Returns the means of successive groups of `factor` samples; an incomplete group at the end is omitted.
fn averaged(x: &[f64], factor: usize) -> Vec<f64> {
    let scale = 1.0 / factor as f64;
    x.chunks_exact(factor)
        .map(|group| group.iter().sum::<f64>() * scale)
        .collect()
}

/// Returns the polynomial whose roots are the principal K-th roots of the roots of f; `None` if a root of f is zero or
/// on the negative real axis, where the result would not be real.
fn root_of_poles(f: &[f64], factor: usize) -> Option<Vec<f64>> {
    let k = factor as f64;
    let roots: Option<Vec<Complex64>> = polynomial::roots(&monic(f))?
        .into_iter()
        .map(|z| {
            let usable = z.norm() > 1e-6 && (z.re > 0.0 || z.im.abs() > 1e-9 * z.norm());
            usable.then(|| Complex64::from_polar(z.norm().powf(1.0 / k), z.arg() / k))
        })
        .collect();
    let coefficients = polynomial::from_roots(&roots?);
    (coefficients.len() == f.len() + 1).then(|| coefficients[1..].to_vec())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn root_of_poles_inverts_their_power() {
        let poles = [
            Complex64::new(0.95, 0.06),
            Complex64::new(0.95, -0.06),
            Complex64::new(0.8, 0.0),
        ];
        let f = polynomial::from_roots(&poles);
        let slow = polynomial::from_roots(&poles.map(|z| z.powu(8)));
        let back = root_of_poles(&slow[1..], 8).unwrap();
        for (a, b) in back.iter().zip(&f[1..]) {
            assert!((a - b).abs() < 1e-9);
        }
        // A pole on the negative axis and a pole at the origin have no root that gives a model.
        assert!(root_of_poles(&[0.5], 8).is_none());
        assert!(root_of_poles(&[-0.5, 0.0], 8).is_none());
    }

    #[test]
    fn averages_omit_the_remainder() {
        assert_eq!(averaged(&[1.0, 3.0, 5.0, 7.0, 9.0], 2), [2.0, 6.0]);
        assert!(averaged(&[1.0], 2).is_empty());
    }
}
