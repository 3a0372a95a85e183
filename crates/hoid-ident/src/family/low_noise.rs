//! Recordings with little or no noise, such as simulations and the first attempts of new users.
//!
//! In such recordings the error of the frequency response that supplies the starts exceeds the noise. An autoregression
//! of the residual part of u would then model the operator instead of the noise. If a form leaves a small residual, all
//! forms are therefore first fitted by output error, `u = c + Y e + v` with v assumed white and without a prior (L.
//! Ljung, *System Identification*, 1999, section 8.4: the estimate is consistent in a closed loop if v vanishes). The
//! result is close to the true operator, and the fit with a noise model starts from there. Without any noise, the
//! result equals the true operator within the precision of the data, and also shows the intersample behaviour of the
//! error ([`Intersample`]).
//!
//! **Level.** Removing the means of e and u is correct only in a steady state, which a record does not start from: the
//! effect of the time before its first sample remains in u as a constant. If a mean was removed, a constant c is
//! therefore estimated for each record and eliminated together with the initial states
//! ([`crate::criterion::Data::level`]).

use hoid_model::Form;

use super::{
    coordinates::{self, GridDensity},
    intersample::Intersample,
    prediction::{EQUAL_RESIDUAL_POWER, PredictionProblem, ROUNDING_POWER},
};
use crate::{SearchOptions, criterion::Workspace, optimize::Objective};

/// Residual power of a start, relative to the power of u, below which output error searches are run.
const MAX_START_RESIDUAL_SHARE: f64 = 0.05;
/// Relative residual power of the best form below which there is little noise: no operator explains u of a person so
/// well.
const LOW_NOISE_SHARE: f64 = 5e-3;
/// Relative residual power below which the residual is rounding error and the search ends.
const ROUNDING_SHARE: f64 = 1e-25;
/// Number of grid points from which a form whose residual is not yet small is fitted again.
const ADDITIONAL_START_COUNT: usize = 4;
/// Number of rounds of these fits. The second round uses the best form of the first round.
const ROUND_COUNT: usize = 2;
/// Ratio of the residual powers for two intersample behaviours below which the difference is decisive. For a continuous
/// error neither model is right: the hold has the relative error `x^2/6` and linear interpolation `x^2/3` with
/// `x = omega Ts/2`, so the ratio of the residual powers is only 1/4.
const DECISIVE_RATIO: f64 = 0.02;
/// Ratio of the residual power of a form to the smallest residual power, above which the search may have ended in
/// another minimum.
const OTHER_MINIMUM_RATIO: f64 = 1.1;
/// Maximum number of steps of a search.
const MAX_STEPS: usize = 200;

/// A form with the starting coordinates of its searches.
pub(super) type Starts = (Form, Vec<Vec<f64>>);

/// Result of the searches for one form.
#[derive(Debug, Clone)]
pub(super) struct SearchResult {
    pub coordinates: Vec<f64>,
    /// Residual power relative to the power of u.
    share: f64,
}

/// Results of the output error fits of all forms, if there is little noise.
#[derive(Debug, Clone)]
pub(super) struct LowNoiseFits {
    /// Result of each form; `None` if its searches failed.
    pub ends: Vec<Option<SearchResult>>,
    /// Smallest residual power over all forms, relative to the power of u.
    pub share: f64,
    /// Smallest value of Schwarz's criterion over all forms.
    criterion: f64,
}

impl LowNoiseFits {
    /// Searches all forms by output error; `None` if there is more noise. `clean` is true if a high-order ARX model
    /// leaves almost no noise; the searches are then run even from starts with a large residual.
    pub fn of(
        prediction: &PredictionProblem<'_>,
        neuromuscular: bool,
        starts: &[Starts],
        clean: bool,
        workspace: &mut Workspace,
    ) -> Option<Self> {
        let search = Search {
            prediction,
            neuromuscular,
            power: prediction.power(),
        };
        let near = |workspace: &mut Workspace| {
            let mut all = starts
                .iter()
                .flat_map(|(form, all)| all.iter().map(move |x| (*form, x)));
            all.any(|(form, x)| {
                search
                    .residual_power(form, x, workspace)
                    .is_some_and(|share| share < MAX_START_RESIDUAL_SHARE)
            })
        };
        if !clean && !near(workspace) {
            return None;
        }
        let ends = starts
            .iter()
            .map(|(form, starts)| search.best_result(*form, starts, workspace));
        let mut ends: Vec<Option<SearchResult>> = ends.collect();
        for round in 0..ROUND_COUNT {
            let Some((best, share)) = smallest_share(&ends).filter(|(_, share)| clean || *share < LOW_NOISE_SHARE)
            else {
                break;
            };
            // A response without noise belongs exactly to some form. If no form fits exactly, the minimum of the best
            // form is also wrong, and this form is searched again.
            let none_is_found = clean && round > 0 && share >= ROUNDING_POWER;
            // A form whose residual is close to the smallest one is not searched again.
            let best_known = (starts[best].0, ends[best].clone()?.coordinates);
            for ((form, _), end) in starts.iter().zip(&mut ends) {
                let known = end.as_ref().map_or(f64::INFINITY, |end| end.share);
                if known < ROUNDING_POWER || (known < OTHER_MINIMUM_RATIO * share && !none_is_found) {
                    continue;
                }
                let more = search.grid_starts(*form, &best_known, workspace);
                *end = search
                    .best_result(*form, &more, workspace)
                    .filter(|end| end.share < known)
                    .or(end.take());
            }
        }
        let (_, share) = smallest_share(&ends).filter(|(_, share)| *share < LOW_NOISE_SHARE)?;
        let n = prediction.sample_count() as f64;
        let criterion = (ends.iter().zip(starts)).filter_map(|(end, (form, _))| {
            let size = form.coordinates(neuromuscular).len() as f64;
            Some(n * end.as_ref()?.share.max(EQUAL_RESIDUAL_POWER).ln() + n.ln() * size)
        });
        let criterion = criterion.fold(f64::INFINITY, f64::min);
        Some(Self { ends, share, criterion })
    }

    /// Replaces the starts of each form by the result of its searches, with a delay that is longer by `later_s`.
    pub fn move_to_results(&self, starts: &mut [Starts], later_s: f64) {
        for ((_, coordinates), end) in starts.iter_mut().zip(&self.ends) {
            if let Some(end) = end {
                let mut end = end.coordinates.clone();
                if let Some(delay) = end.last_mut() {
                    *delay += later_s;
                }
                *coordinates = vec![end];
            }
        }
    }

    /// Returns the result of each form whose searches did not fail, given the forms of the searches.
    pub fn coordinates(&self, forms: &[Form]) -> Vec<(Form, Vec<f64>)> {
        let ends = forms.iter().zip(&self.ends);
        ends.filter_map(|(form, end)| Some((*form, end.as_ref()?.coordinates.clone())))
            .collect()
    }

    /// Returns the intersample behaviour that fits better, given the searches with a smooth and with a held error, and
    /// whether the difference is decisive.
    pub fn choose_intersample(smooth: &Self, held: &Self) -> (Intersample, bool) {
        match held.share.max(ROUNDING_SHARE) / smooth.share.max(ROUNDING_SHARE) {
            ratio if ratio < DECISIVE_RATIO => (Intersample::Zoh, true),
            ratio if ratio > 1.0 / DECISIVE_RATIO => (Intersample::Foh, true),
            _ if held.criterion < smooth.criterion => (Intersample::Zoh, false),
            _ => (Intersample::Auto, false),
        }
    }
}

/// Returns the index and the relative residual power of the form with the smallest residual.
fn smallest_share(ends: &[Option<SearchResult>]) -> Option<(usize, f64)> {
    let shares = ends
        .iter()
        .enumerate()
        .filter_map(|(i, end)| Some((i, end.as_ref()?.share)));
    shares.min_by(|a, b| a.1.total_cmp(&b.1))
}

/// Output error searches for one intersample behaviour of the error.
struct Search<'p, 'a> {
    prediction: &'p PredictionProblem<'a>,
    neuromuscular: bool,
    power: f64,
}

impl Search<'_, '_> {
    /// Searches from these coordinates and returns the best result.
    fn best_result(&self, form: Form, starts: &[Vec<f64>], workspace: &mut Workspace) -> Option<SearchResult> {
        let criterion = self.prediction.criterion((form, self.neuromuscular), (0, 0));
        let search = SearchOptions {
            max_iterations: MAX_STEPS,
            ..self.prediction.search
        };
        let mut best: Option<SearchResult> = None;
        for start in starts {
            let eta = criterion.layout.common_eta(start, &[]);
            let Some(end) = criterion.search(eta, &search, None, workspace) else {
                continue;
            };
            let share = end.linearisation.sum_of_squares / self.power;
            if best.as_ref().is_none_or(|known| share < known.share) {
                let coordinates = criterion.layout.coordinates_of(&end.theta, 0);
                best = Some(SearchResult { coordinates, share });
            }
            if share < ROUNDING_SHARE {
                break;
            }
        }
        best
    }

    /// Returns those grid points of a form that leave the smallest residuals, each with its best gain. The grid is used
    /// as it is, and also with the neuromuscular system and the delay of another operator. Since u is linear in the
    /// gain, one step from a gain of zero gives the best gain.
    fn grid_starts(&self, form: Form, best_known: &(Form, Vec<f64>), workspace: &mut Workspace) -> Vec<Vec<f64>> {
        let (prediction, neuromuscular) = (self.prediction, self.neuromuscular);
        let criterion = prediction.criterion((form, neuromuscular), (0, 0));
        let limits = coordinates::limits(form, neuromuscular, prediction.delay_range_s, prediction.sample_time);
        let mut grid = coordinates::start_grid(form, neuromuscular, &limits, GridDensity::Default);
        // The neuromuscular system and the delay are the last coordinates of every form.
        let tail = 1 + if neuromuscular { 2 } else { 0 };
        let of_other = &best_known.1[best_known.1.len() - tail..];
        let mut moved: Vec<Vec<f64>> = (grid.iter())
            .map(|point| [&point[..point.len() - tail], of_other].concat())
            .collect();
        moved.dedup();
        grid.append(&mut moved);
        let mut all: Vec<(f64, Vec<f64>)> = Vec::new();
        for mut point in grid {
            point[0] = 0.0;
            let at = criterion.linearise(&criterion.layout.common_eta(&point, &[]), workspace);
            let gain = at.descent[0] / at.gram[0];
            let left = at.sum_of_squares - gain * at.descent[0];
            if gain.is_finite() && gain != 0.0 && left.is_finite() {
                point[0] = gain;
                all.push((left, point));
            }
        }
        all.sort_by(|a, b| a.0.total_cmp(&b.0));
        all.into_iter()
            .take(ADDITIONAL_START_COUNT)
            .map(|(_, point)| point)
            .collect()
    }

    /// Returns the power of the part of u that an operator does not explain, relative to the power of u.
    fn residual_power(&self, form: Form, coordinates: &[f64], workspace: &mut Workspace) -> Option<f64> {
        let left = self
            .prediction
            .unexplained_output((form, self.neuromuscular), coordinates, workspace);
        let squares: f64 = left.ok()?.iter().flatten().map(|v| v * v).sum();
        Some(squares / self.power)
    }
}

#[cfg(test)]
mod tests {
    use hoid_model::scenario::{Condition, Scenario};
    use hoid_model::{Channel, Detrend, FamilyOperator, Record, SampleTime, operator_family::ZohFamilyOperator};
    use hoid_sim::{RunSeed, Simulator};

    use crate::family::{
        FamilyEstimator, FamilyFit,
        simulated_operator::{Uniform, response_to},
    };

    use super::*;

    const X: [f64; 5] = [0.85, 0.3, 2.35, -1.14, 0.243];

    fn truth() -> FamilyOperator {
        FamilyOperator::new(Form::Lead, true, &X).unwrap()
    }

    /// Returns 25 s of [`record_of`] at 40 Hz.
    fn record(model: &ZohFamilyOperator, noise: f64) -> Record {
        record_of(model, SampleTime::new(0.025).unwrap(), (200, 1000), noise)
    }

    /// Returns a record of `n` samples: an error with a nonzero mean, this much white noise on u, and a level of u. The
    /// run starts `before` samples before the record, away from rest.
    fn record_of(model: &ZohFamilyOperator, ts: SampleTime, (before, n): (usize, usize), noise: f64) -> Record {
        let mut random = Uniform(7);
        let mut uniform = || random.between(-0.5, 0.5);
        let e: Vec<f64> = (0..before + n)
            .map(|t| t as f64 * ts.s() / 0.025)
            .map(|t| 0.2 + (0.012 * t).sin() + 0.6 * (0.07 * t).cos() + 0.2 * uniform())
            .collect();
        let w = response_to(model, &e);
        let u = w[before..].iter().map(|w| w + 0.7 + noise * uniform()).collect();
        Record::new(
            ts,
            Channel::new("e", "", e[before..].to_vec()),
            Channel::new("u", "", u),
        )
        .unwrap()
    }

    fn fit_record(record: Record) -> FamilyFit {
        let estimator = FamilyEstimator {
            forms: vec![Form::Gain, Form::Lead, Form::Lag, Form::LeadLag],
            ..FamilyEstimator::default()
        };
        estimator.fit(&[record]).unwrap()
    }

    fn largest_error(fit: &FamilyFit, delay_s: f64) -> f64 {
        let x = fit.operator(0).operator.coordinates();
        let expected = [&X[..4], &[delay_s]].concat();
        assert_eq!(fit.form, Form::Lead);
        x.iter().zip(expected).map(|(x, t)| (x - t).abs()).fold(0.0, f64::max)
    }

    #[test]
    fn noise_free_operator_is_found_with_its_intersample_model() {
        let ts = SampleTime::new(0.025).unwrap();
        let held = fit_record(record(&truth().zoh(ts).unwrap(), 0.0));
        assert!(largest_error(&held, 0.243) < 1e-10);
        assert_eq!((held.intersample, held.delay_if_linear_s(0)), (Intersample::Zoh, None));
        // For a piecewise linear error the estimated delay is half a sample longer than in `X`.
        let straight = fit_record(record(&truth().interpolate(ts).unwrap(), 0.0));
        assert!(largest_error(&straight, 0.243 + 0.0125) < 1e-10);
        assert_eq!(
            (straight.intersample, straight.delay_if_linear_s(0)),
            (Intersample::Foh, None)
        );
        for fit in [held, straight] {
            let kinds: Vec<&str> = fit.verdict.findings().iter().map(|f| f.kind).collect();
            assert_eq!(kinds, ["no-noise"]);
            assert_eq!((fit.weighed.len(), fit.run_to_run), (1, 0.0));
            assert!(fit.noise_free.is_some_and(|share| share < 1e-20) && fit.agreement.is_none());
        }
    }

    #[test]
    fn small_noise_is_modelled_and_errors_cover_the_truth() {
        let ts = SampleTime::new(0.025).unwrap();
        let fit = fit_record(record(&truth().zoh(ts).unwrap(), 1e-3));
        let c = fit.operator(0).covariance.clone().unwrap();
        for (i, (x, t)) in fit.operator(0).operator.coordinates().iter().zip(X).enumerate() {
            let error = c[i * 6].sqrt();
            assert!((x - t).abs() < 4.0 * error && error < 0.01, "{i}: {x} {t} {error}");
        }
        assert!(fit.noise_free.is_none() && fit.run_to_run > 0.0);
    }

    /// A lead compensates for the hold: its values for the two intersample behaviours differ by more than the errors
    /// due to noise.
    #[test]
    fn errors_cover_both_intersample_models_if_both_fit() {
        let ts = SampleTime::new(0.025).unwrap();
        let record = record(&truth().zoh(ts).unwrap(), 3e-3);
        let of = |intersample| {
            let estimator = FamilyEstimator {
                forms: vec![Form::Lead],
                intersample,
                ..FamilyEstimator::default()
            };
            estimator.fit(std::slice::from_ref(&record)).unwrap()
        };
        let lead = |fit: &FamilyFit| fit.operator(0).operator.coordinates()[1];
        let (held, straight, both) = (of(Intersample::Zoh), of(Intersample::Foh), of(Intersample::Auto));
        assert!(both.little_noise && !both.course_is_known);
        let error = |fit: &FamilyFit| fit.operator(0).covariance.as_ref().unwrap()[6].sqrt();
        let between = (lead(&held) - lead(&straight)).abs();
        assert!(
            error(&both) > 0.99 * between && between > 3.0 * error(&held),
            "{between} {} {}",
            error(&both),
            error(&held)
        );
    }

    #[test]
    fn operator_remnant_is_not_treated_as_small_noise() {
        let simulator = Simulator::new(&Scenario::condition(Condition::C1)).unwrap();
        let record = simulator.run(RunSeed::default(), false).unwrap();
        let fit = fit_record(record.detrended(Detrend::Mean));
        assert_eq!((fit.intersample, fit.noise_free), (Intersample::Auto, None));
        let tau = fit.operator(0).parameters.iter().find(|p| p.name == "tau_e").unwrap();
        assert!((fit.delay_if_linear_s(0).unwrap() - tau.value - 0.005).abs() < 1e-12);
    }

    #[test]
    fn residual_ratio_of_one_quarter_is_not_decisive() {
        let of = |share: f64, criterion: f64| LowNoiseFits {
            ends: Vec::new(),
            share,
            criterion,
        };
        let smooth = of(1e-6, 0.0);
        assert_eq!(
            LowNoiseFits::choose_intersample(&smooth, &of(2.5e-7, -9.0)),
            (Intersample::Zoh, false)
        );
        assert_eq!(
            LowNoiseFits::choose_intersample(&smooth, &of(2.5e-7, 9.0)),
            (Intersample::Auto, false)
        );
        assert_eq!(
            LowNoiseFits::choose_intersample(&smooth, &of(0.0, -9.0)),
            (Intersample::Zoh, true)
        );
        assert_eq!(
            LowNoiseFits::choose_intersample(&of(0.0, 0.0), &of(1e-9, 9.0)),
            (Intersample::Foh, true)
        );
    }

    /// Removing the mean of e causes a ramp in u that is as large as u itself.
    #[test]
    fn integration_of_a_nonzero_mean_error_is_found() {
        let ts = SampleTime::new(0.005).unwrap();
        let x = [3.4, 0.72, 0.333, 2.13, -0.775, 0.398];
        let truth = FamilyOperator::new(Form::QuadraticIntegral, true, &x).unwrap();
        for (course, expected) in [(Intersample::Zoh, x[5]), (Intersample::Auto, x[5] + 0.0025)] {
            let record = record_of(&course.discrete_model(&truth, None, ts).unwrap(), ts, (200, 6000), 0.0);
            let estimator = FamilyEstimator {
                forms: vec![Form::Lead2Lag, Form::QuadraticIntegral],
                ..FamilyEstimator::default()
            };
            let fit = estimator.fit(&[record]).unwrap();
            assert_eq!(fit.form, Form::QuadraticIntegral, "{course}");
            let expected = [&x[..5], &[expected]].concat();
            for (found, x) in fit.operator(0).operator.coordinates().iter().zip(expected) {
                assert!((found - x).abs() < 1e-7, "{course} {found} {x}");
            }
        }
    }
}
