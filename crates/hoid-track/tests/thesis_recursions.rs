//! The recursions of the thesis as available to users, compared with a separate implementation of its equations, in
//! which P is a plain matrix and no code is shared with the library.
//!
//! ```text
//! RLS, eq. 25 and 5.26:  psi = [-u(t-1) -u(t-2) x(t) x(t-1)],  eps = u - psi' theta
//! RPEM, eq. 31 to 36:    w = B x - (F - 1) w,  v = u - w,  eps = v + d1 v(t-1)
//!                        psi = [xF(t) xF(t-1) -v(t-1) -wF(t-1) -wF(t-2)],  sF = (D/F) s, one filter
//! both:  g = P psi/(lambda + psi' P psi),  theta <- theta + g eps,  P <- (P - g psi' P)/lambda
//! ```
//!
//! with x(t) = e(t - nk); a step after which F or D is not stable is halved; w and v are computed again with the new
//! theta. The settings are those of the thesis: lambda = 1 - 1/256 and P0 = 0.1 I, started from the batch fit of [0,
//! 30.72] s.

#![allow(clippy::unwrap_used, clippy::print_stdout)]

use hoid_model::{
    Channel, Record,
    scenario::{Condition, Realisation, RemnantStrength, Scenario},
};
use hoid_sim::{RunSeed, Simulator};
use hoid_track::{Method, StartSource, Trace, TrackOptions, track};

const NK: usize = 29;
const LAMBDA: f64 = 1.0 - 1.0 / 256.0;
const P0: f64 = 0.1;

fn run(condition: Condition, order: usize, noise_level: f64, replication: u64) -> Record {
    let mut scenario = Scenario::condition(condition);
    scenario.realisation = Realisation::Output;
    scenario.remnant.order = order;
    if let RemnantStrength::Level { level, .. } = &mut scenario.remnant.strength {
        *level = noise_level;
    }
    let seed = RunSeed {
        seed: 46,
        replication,
        ..RunSeed::default()
    };
    Simulator::new(&scenario).unwrap().run(seed, false).unwrap()
}

/// Returns options with the settings of the thesis and additional settings.
fn thesis_options(method: Method, additional: &[(&str, &str)]) -> TrackOptions {
    let rpem = method == Method::rpem();
    let options = TrackOptions {
        start: StartSource::Span(Some((0.0, 30.72))),
        ..TrackOptions::default_for(method, NK)
    };
    let options = options.with(&[("memory", "256"), ("covariance", "0.1")]).unwrap();
    let own: &[(&str, &str)] = if rpem {
        &[("limit", "inf"), ("stable", "noise")]
    } else {
        &[]
    };
    options.with(own).unwrap().with(additional).unwrap()
}

/// P as a plain matrix, with its update.
struct PlainCovariance<const N: usize>([[f64; N]; N]);

impl<const N: usize> PlainCovariance<N> {
    fn new() -> Self {
        Self(std::array::from_fn(|i| {
            std::array::from_fn(|j| if i == j { P0 } else { 0.0 })
        }))
    }

    fn gain(&mut self, psi: &[f64; N]) -> [f64; N] {
        let along: [f64; N] = std::array::from_fn(|i| (0..N).map(|j| self.0[i][j] * psi[j]).sum());
        let denominator = LAMBDA + (0..N).map(|i| psi[i] * along[i]).sum::<f64>();
        for i in 0..N {
            for j in 0..N {
                self.0[i][j] = (self.0[i][j] - along[i] * along[j] / denominator) / LAMBDA;
            }
        }
        along.map(|value| value / denominator)
    }
}

fn delayed(record: &Record, k: usize) -> f64 {
    if k >= NK { record.input()[k - NK] } else { 0.0 }
}

fn rls(record: &Record, start: &[f64]) -> Vec<Vec<f64>> {
    let mut theta = <[f64; 4]>::try_from(start).unwrap();
    let (mut p, u) = (PlainCovariance::new(), record.output());
    let before = |k: usize, lag: usize| if k >= lag { u[k - lag] } else { 0.0 };
    let step = |k: usize| {
        let x_1 = if k > 0 { delayed(record, k - 1) } else { 0.0 };
        let psi = [-before(k, 1), -before(k, 2), delayed(record, k), x_1];
        let eps = u[k] - (0..4).map(|i| psi[i] * theta[i]).sum::<f64>();
        let gain = p.gain(&psi);
        (0..4).for_each(|i| theta[i] += gain[i] * eps);
        theta.to_vec()
    };
    (0..u.len()).map(step).collect()
}

/// theta = [b0, b1, d1, f1, f2].
fn is_stable(theta: &[f64; 5]) -> bool {
    let [_, _, d1, f1, f2] = *theta;
    d1.abs() < 1.0 && f2.abs() < 1.0 && f1.abs() < 1.0 + f2
}

fn rpem(record: &Record, start: &[f64]) -> Vec<Vec<f64>> {
    let mut theta = <[f64; 5]>::try_from(start).unwrap();
    let (mut p, u) = (PlainCovariance::new(), record.output());
    // x, v, w, and their values filtered by D/F, at the last two samples.
    let (mut x_1, mut v_1, mut w, mut x_f, mut w_f) = (0.0, 0.0, [0.0; 2], [0.0; 2], [0.0; 2]);
    let step = |k: usize| {
        let x = delayed(record, k);
        let response = |t: &[f64; 5]| t[0] * x + t[1] * x_1 - t[3] * w[0] - t[4] * w[1];
        let filtered =
            |t: &[f64; 5], s: f64, s_1: f64, past: [f64; 2]| s + t[2] * s_1 - t[3] * past[0] - t[4] * past[1];
        let x_now = filtered(&theta, x, x_1, x_f);
        let psi = [x_now, x_f[0], -v_1, -w_f[0], -w_f[1]];
        let eps = u[k] - response(&theta) + theta[2] * v_1;
        let gain = p.gain(&psi);
        let moved = |halvings: i32| std::array::from_fn(|i| theta[i] + gain[i] * eps * 0.5f64.powi(halvings));
        theta = (0..=12).map(moved).find(is_stable).unwrap_or(theta);
        let now = response(&theta);
        let w_now = filtered(&theta, now, w[0], w_f);
        (x_f, w_f) = ([x_now, x_f[0]], [w_now, w_f[0]]);
        (x_1, v_1, w) = (x, u[k] - now, [now, w[0]]);
        theta.to_vec()
    };
    (0..u.len()).map(step).collect()
}

/// Returns the largest difference in a coefficient over all rows.
fn difference(trace: &Trace, twin: &[Vec<f64>]) -> f64 {
    assert_eq!(trace.len(), twin.len());
    let of_row = |(k, row): (usize, &Vec<f64>)| {
        let pairs = trace.theta(k).iter().zip(row);
        pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
    };
    twin.iter().enumerate().map(of_row).fold(0.0, f64::max)
}

/// Returns the largest difference between the recursion of the program and the equations of the thesis.
fn difference_from_equations(method: &Method, record: &Record, additional: &[(&str, &str)]) -> f64 {
    let trace = track(record, &thesis_options(method.clone(), additional), 1).unwrap();
    let start = trace.start().unwrap().model().theta();
    let twin = match *method == Method::rls() {
        true => rls(record, start),
        false => rpem(record, start),
    };
    difference(&trace, &twin)
}

#[test]
fn thesis_settings_reproduce_the_thesis_equations() {
    let mut with_a_guard = [0.0_f64; 2];
    for (condition, order, level) in [
        (Condition::C1, 1, 0.01),
        (Condition::C4, 1, 0.1),
        (Condition::C4, 3, 0.2),
        (Condition::C6, 2, 0.1),
    ] {
        let record = run(condition, order, level, 0);
        for (method, most) in [Method::rls(), Method::rpem()].into_iter().zip(&mut with_a_guard) {
            let found = difference_from_equations(&method, &record, &[]);
            assert!(found < 1e-8, "{method} {condition:?} {order} {level}: {found:e}");
            let given = difference_from_equations(&method, &record, &[("windup_guard", "off")]);
            assert!(given < 1e-8, "{method}: {given:e}");
            println!("{method} {condition:?} {order} {level}: {found:.1e}");
            *most = most.max(difference_from_equations(&method, &record, &[("windup_guard", "1e4")]));
        }
    }
    println!(
        "with a guard of 1e4 P0 coefficients differ by {:.1e} (RLS), {:.1e} (RPEM)",
        with_a_guard[0], with_a_guard[1]
    );
    // Shows that the test can fail: with a guard the recursions differ.
    assert!(with_a_guard.iter().all(|most| *most > 1e-5), "{with_a_guard:?}");
}

/// Nothing is excited for an hour: P overflows and restarts, and all numbers stay finite. Least squares recovers. RPEM
/// need not recover: after P has grown for minutes, the first samples change the estimate arbitrarily, which the windup
/// guard prevents.
#[test]
fn estimates_stay_finite_during_an_hour_of_silence() {
    let run = run(Condition::C1, 1, 0.1, 1);
    let loud = run.len();
    let at = |signal: &[f64]| -> Vec<f64> {
        let silence = std::iter::repeat_n(0.0, 360_000);
        signal
            .iter()
            .copied()
            .chain(silence)
            .chain(signal.iter().copied())
            .collect()
    };
    let record = Record::new(
        run.sample_time(),
        Channel::new("e", "", at(run.input())),
        Channel::new("u", "", at(run.output())),
    )
    .unwrap();
    for method in [Method::rls(), Method::rpem()] {
        let trace = track(&record, &thesis_options(method.clone(), &[]), 64).unwrap();
        for k in 0..trace.len() {
            assert!(trace.theta(k).iter().all(|value| value.is_finite()), "{method} {k}");
        }
        if method == Method::rpem() {
            continue;
        }
        // Afterwards the estimate equals that of a run that starts at this time.
        let alone = track(&run, &thesis_options(method.clone(), &[]), loud).unwrap();
        let (last, first) = (trace.theta(trace.len() - 1), alone.theta(alone.len() - 1));
        for (a, b) in last.iter().zip(first) {
            assert!((a - b).abs() < 0.02 * (1.0 + b.abs()), "{method}: {last:?} {first:?}");
        }
    }
}

#[test]
fn invalid_windup_guard_is_refused_with_advice() {
    let refused = |method: Method, name: &str, text: &str| method.with(name, text).unwrap_err().to_string();
    for (text, says) in [
        ("0.5", "1 or more"),
        ("no", "off, or the largest allowed multiple"),
        ("NaN", "off, or the"),
        ("inf", "1 or more"),
    ] {
        let found = refused(Method::rpem(), "windup_guard", text);
        assert!(
            found.contains("windup_guard") && found.contains(says),
            "{text}: {found}"
        );
    }
    let without_p = thesis_options(Method::rls(), &[("forgetting", "window"), ("windup_guard", "100")]);
    let found = without_p.check().unwrap_err().to_string();
    assert!(
        found.contains("windup_guard") && found.contains("exponential"),
        "{found}"
    );
    // If no windup guard is requested, the window is accepted.
    assert!(
        thesis_options(Method::rls(), &[("forgetting", "window")])
            .check()
            .is_ok()
    );
}

/// Settings other than those of the thesis keep the windup guard: a start with the covariance of the fit, limited
/// innovations, and structures that the thesis does not have.
#[test]
fn settings_other_than_the_thesis_keep_the_guard() {
    let words = |options: TrackOptions| options.memory_as_text(hoid_model::SampleTime::AT_100_HZ);
    let is_off = |options: TrackOptions| words(options).ends_with("without a windup guard");
    assert!(is_off(thesis_options(Method::rls(), &[])));
    assert!(is_off(thesis_options(Method::rpem(), &[])));
    assert!(!is_off(TrackOptions::default_for(Method::rpem(), NK)));
    assert!(!is_off(thesis_options(Method::rpem(), &[("limit", "5")])));
    assert!(!is_off(thesis_options(Method::rls(), &[("windup_guard", "1e4")])));
    let fir = hoid_model::Structure::Fir;
    let options = TrackOptions {
        structure: fir,
        orders: fir.operator_orders(NK),
        ..thesis_options(Method::rls(), &[])
    };
    assert!(!is_off(options));
}
