//! Procedure of the thesis for one run of the experiment.

use hoid_ident::{Estimator, Fit, validation::vaf};
use hoid_model::{
    OperatorParameters, Orders, Record, Structure, remnant::RemnantDiscretisation, uncertainty::OperatorEstimate,
};
use hoid_numerics::statistics::mean;
use hoid_track::{Method, StartSource, TrackOptions, track_from};

use crate::ThesisError;

/// Length of the first and the last span of a run, which are used for the batch fits, as a fraction of the run: 30.72
/// of 81.92 s.
const SPAN_SHARE: f64 = 0.375;
/// Number of samples between stored estimates.
const STORED_SAMPLE_INTERVAL: usize = 32;
/// Memory length and initial covariance P0, as in section V.B.
const RECURSION_SETTINGS: [(&str, &str); 2] = [("memory", "256"), ("covariance", "0.1")];

/// Coefficients and operator at one time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct State {
    /// Coefficients a1, a2 (f1, f2 of a Box-Jenkins model), b0, b1.
    pub discrete: [f64; 4],
    /// Parameters K_e, T_L, K_e_dot, omega_nm, zeta_nm; NaN if the model cannot be converted.
    pub operator: [f64; 5],
}

/// A recursive estimate over time.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct RecursiveTrace {
    /// Times, s.
    pub times_s: Vec<f64>,
    /// Coefficients and operator at each time.
    pub states: Vec<State>,
    /// Variances of a1, a2, b0, b1 and, if the model has it, d1 at each time.
    pub variances: Vec<[f64; 5]>,
}

/// The simulated operator of a run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Truth {
    /// Delay including the delay of the hold, samples.
    pub nk: usize,
    /// Operator at the start and at the end of the run.
    pub states: [State; 2],
}

/// Results of one run; arrays are by structure (ARX, Box-Jenkins), then by span.
#[derive(Debug, Clone, PartialEq)]
pub struct RunOutcome {
    /// The two spans of the batch fits, s.
    pub spans_s: [(f64, f64); 2],
    /// Delay n_k* by structure, samples.
    pub nk: [usize; 2],
    /// Selected delay by structure and span, samples.
    pub nk_by_span: [[usize; 2]; 2],
    /// Time constant T_n* of the Box-Jenkins model (s); NaN if neither span gives one.
    pub t_n_s: f64,
    /// Batch fits with the delay n_k*, by structure and span.
    pub batch: [[State; 2]; 2],
    /// Recursive estimates by RLS and RPEM.
    pub traces: [RecursiveTrace; 2],
    /// The simulated operator; `None` for recorded people.
    pub truth: Option<Truth>,
}

/// Applies the procedure of section VI to one run, trying all delays from the first to the last.
///
/// # Errors
/// [`ThesisError::Estimator`] if a model cannot be fitted or tracked.
pub fn evaluate(record: &Record, delays: (usize, usize)) -> Result<RunOutcome, ThesisError> {
    let spans_s = spans_s(record);
    let span = |(from_s, to_s): (f64, f64)| record.span(from_s, to_s);
    let spans = [span(spans_s[0])?, span(spans_s[1])?];
    let arx = evaluate_structure(record, &spans, Structure::Arx, delays)?;
    let bj = evaluate_structure(record, &spans, Structure::BoxJenkins, delays)?;
    Ok(RunOutcome {
        spans_s,
        nk: [arx.nk, bj.nk],
        nk_by_span: [arx.nk_by_span, bj.nk_by_span],
        t_n_s: bj.t_n_s,
        batch: [arx.batch, bj.batch],
        traces: [arx.trace, bj.trace],
        truth: truth(record),
    })
}

/// Returns the two spans of a record for the batch fits, s.
fn spans_s(record: &Record) -> [(f64, f64); 2] {
    let from_s = record.time_s(0);
    let length_s = record.len() as f64 * record.sample_time().s();
    let (first, last) = (SPAN_SHARE * length_s, (1.0 - SPAN_SHARE) * length_s);
    [(from_s, from_s + first), (from_s + last, from_s + length_s)]
}

/// Results for one structure.
struct StructureResults {
    nk: usize,
    nk_by_span: [usize; 2],
    t_n_s: f64,
    batch: [State; 2],
    trace: RecursiveTrace,
}

fn evaluate_structure(
    record: &Record,
    spans: &[Record; 2],
    structure: Structure,
    delays: (usize, usize),
) -> Result<StructureResults, ThesisError> {
    let best = [
        best_delay(&spans[0], structure, delays)?,
        best_delay(&spans[1], structure, delays)?,
    ];
    let nk_of_span = best.each_ref().map(|fit| fit.orders().nk);
    // Half a sample is rounded up.
    let nk = (nk_of_span[0] + nk_of_span[1]).div_ceil(2);
    let t_n_s = time_constant(&best);
    let estimator = Estimator::new(structure, structure.operator_orders(nk));
    let fits = [
        estimator.fit(std::slice::from_ref(&spans[0]))?,
        estimator.fit(std::slice::from_ref(&spans[1]))?,
    ];
    Ok(StructureResults {
        nk,
        nk_by_span: nk_of_span,
        t_n_s,
        batch: fits.each_ref().map(state_of_fit),
        trace: track_from_fit(record, &fits[0])?,
    })
}

/// Returns the fit of a span with the delay that gives the highest VAF of the simulated output (eq. 39).
fn best_delay(span: &Record, structure: Structure, (first, last): (usize, usize)) -> Result<Fit, ThesisError> {
    let mut best: Option<(f64, Fit)> = None;
    let mut failed = None;
    for nk in first..=last {
        let estimator = Estimator::new(structure, structure.operator_orders(nk));
        let fit = match estimator.fit(std::slice::from_ref(span)) {
            Ok(fit) => fit,
            Err(error) => {
                failed = Some(error);
                continue;
            }
        };
        let simulated = fit.simulate(span)?;
        let found = vaf(&span.output()[simulated.first..], &simulated.values);
        if best.as_ref().is_none_or(|(most, _)| found > *most) {
            best = Some((found, fit));
        }
    }
    match (best, failed) {
        (Some((_, fit)), _) => Ok(fit),
        (None, Some(error)) => Err(error.into()),
        (None, None) => Err(ThesisError::Unsuited {
            method: "the delay search",
            quantity: "the range".to_owned(),
            found: format!("{first} to {last}"),
            expected: "a first delay that is not longer than the last".to_owned(),
        }),
    }
}

/// Returns the mean of the available remnant time constants, retrieved by backward Euler; NaN if there is none.
fn time_constant(fits: &[Fit; 2]) -> f64 {
    let of = |fit: &Fit| {
        fit.remnant(RemnantDiscretisation::BackwardEuler)
            .ok()
            .map(|r| r.t_n_s.value)
    };
    let all: Vec<f64> = fits.iter().filter_map(of).collect();
    mean(&all)
}

/// Tracks a record by RLS or RPEM, starting from the fit of the first span.
fn track_from_fit(record: &Record, start: &Fit) -> Result<RecursiveTrace, ThesisError> {
    let (structure, orders) = (start.model().structure(), start.orders());
    let options = match structure {
        Structure::BoxJenkins => {
            let text = [("stable", "predictor-and-noise"), ("limit", "inf")];
            TrackOptions::new(Method::rpem(), structure, orders).with(&text)?
        }
        _ => TrackOptions::new(Method::rls(), structure, orders),
    };
    let options = TrackOptions {
        start: StartSource::Span(Some(spans_s(record)[0])),
        ..options.with(&RECURSION_SETTINGS)?
    };
    let trace = track_from(record, &options, STORED_SAMPLE_INTERVAL, Some(start))?;
    let places = parameter_indices(&orders);
    let mut course = RecursiveTrace::default();
    for row in 0..trace.len() {
        let theta = trace.theta(row);
        let operator = trace.operator_values(row).ok().map(|found| found.parameters());
        course.times_s.push(trace.times_s()[row]);
        course.states.push(State {
            discrete: std::array::from_fn(|i| places[i].map_or(f64::NAN, |p| theta[p])),
            operator: operator_values(operator),
        });
        let n = theta.len();
        let covariance = trace.covariance(row);
        let variance = |index: Option<usize>| match (index, &covariance) {
            (Some(p), Some(all)) => all[p * n + p],
            _ => f64::NAN,
        };
        course.variances.push(places.map(variance));
    }
    Ok(course)
}

/// Returns the positions of a1, a2 (or f1, f2), b0, b1 and d1 in theta.
fn parameter_indices(orders: &Orders) -> [Option<usize>; 5] {
    let names = orders.parameter_names();
    let of = |wanted: &[&str]| names.iter().position(|name| wanted.contains(&name.as_str()));
    [
        of(&["a1", "f1"]),
        of(&["a2", "f2"]),
        of(&["b0"]),
        of(&["b1"]),
        of(&["d1"]),
    ]
}

fn state_of_fit(fit: &Fit) -> State {
    let places = parameter_indices(&fit.orders());
    let theta = fit.model().theta();
    State {
        discrete: std::array::from_fn(|i| places[i].map_or(f64::NAN, |p| theta[p])),
        operator: operator_values(fit.operator().ok().map(|found| found.parameters())),
    }
}

fn operator_values(operator: Option<OperatorParameters>) -> [f64; 5] {
    operator.map_or([f64::NAN; 5], |found| {
        let rows = OperatorEstimate::from(found).rows();
        [0, 1, 2, 3, 4].map(|i| rows[i].2.value)
    })
}

/// Returns the simulated operator; `None` if the record does not contain its parameters.
fn truth(record: &Record) -> Option<Truth> {
    let states = [true_state(record, 0)?, true_state(record, record.len() - 1)?];
    let tau_s = *record.channel("tau_e")?.first()?;
    Some(Truth {
        nk: (tau_s / record.sample_time().s()).round() as usize + 1,
        states,
    })
}

/// Returns the simulated operator at a sample.
fn true_state(record: &Record, k: usize) -> Option<State> {
    let of = |name: &str| record.channel(name)?.get(k).copied();
    let operator = OperatorParameters {
        k_e: of("K_e")?,
        t_l_s: of("T_L")?,
        omega_nm_rad_s: of("omega_nm")?,
        zeta_nm: of("zeta_nm")?,
        tau_e_s: of("tau_e")?,
    };
    let held = operator.discretise(record.sample_time()).ok().map(|found| found.zoh);
    Some(State {
        discrete: held.map_or([f64::NAN; 4], |h| [h.f1, h.f2, h.b0, h.b1]),
        operator: operator_values(Some(operator)),
    })
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use hoid_model::scenario::{Condition, RemnantStrength, Scenario};
    use hoid_sim::{RunSeed, Simulator};

    use super::*;

    fn run(level: f64) -> Record {
        let mut scenario = Scenario::condition(Condition::C4);
        scenario.remnant.order = 1;
        if let RemnantStrength::Level { level: of, .. } = &mut scenario.remnant.strength {
            *of = level;
        }
        let seed = RunSeed {
            seed: 9,
            ..RunSeed::default()
        };
        Simulator::new(&scenario).unwrap().run(seed, false).unwrap()
    }

    #[test]
    fn procedure_finds_the_operator_without_remnant() {
        let found = evaluate(&run(0.0), (27, 31)).unwrap();
        let truth = found.truth.unwrap();
        assert_eq!((found.nk[0], truth.nk), (29, 29));
        assert_eq!(found.nk_by_span[0], [29, 29]);
        for (found, of_text) in found.spans_s.iter().zip([(0.0, 30.72), (51.2, 81.92)]) {
            assert!((found.0 - of_text.0).abs() + (found.1 - of_text.1).abs() < 1e-9);
        }
        for span in 0..2 {
            for (a, b) in found.batch[0][span].discrete.iter().zip(truth.states[span].discrete) {
                assert!((a - b).abs() < 1e-3, "{span}: {a} {b}");
            }
        }
    }

    #[test]
    fn delay_and_time_constant_are_found_with_small_remnant() {
        let found = evaluate(&run(0.05), (26, 32)).unwrap();
        assert!((28..=30).contains(&found.nk[1]), "{:?}", found.nk);
        // The remnant is held exactly, so d1 gives T_n* = .055 by backward Euler; the standard error is .006.
        assert!((found.t_n_s - 0.055).abs() < 0.02, "{}", found.t_n_s);
        let [rls, rpem] = &found.traces;
        assert_eq!((rls.times_s.len(), rpem.times_s.len()), (256, 256));
        assert!(rls.variances[0][4].is_nan() && rpem.variances[0][4] > 0.0);
        let last = rpem.states[255].operator[2];
        assert!((last / 0.084 - 1.0).abs() < 0.3, "{last}");
    }

    #[test]
    fn empty_delay_range_is_refused() {
        assert!(evaluate(&run(0.05), (30, 29)).is_err());
    }
}
