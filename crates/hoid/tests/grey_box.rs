//! The grey box on simulated runs: bias, spread compared with the Cramér-Rao bound, coverage, choice of m, fractional
//! delays, constraints, several records, and rejected input.
#![allow(clippy::unwrap_used, clippy::print_stdout)]

use hoid::{
    ident::{Constraint, GreyBox, GreyBoxFit, IdentError, Reason},
    model::{
        Complex64, remnant_gain::NoiseDefinition, scenario::RemnantStrength, second_order::ZohStates,
        uncertainty::Estimate,
    },
    prelude::*,
};

const PARAMETER_NAMES: [&str; 8] = ["K_e", "T_L", "K_e_dot", "omega_nm", "zeta_nm", "tau_e", "T_n", "K_n"];

fn runs(condition: Condition, m0: usize, n: u64) -> Vec<Record> {
    let mut scenario = Scenario::condition(condition);
    scenario.remnant.order = m0;
    scenario.remnant.strength = RemnantStrength::Level {
        level: 0.1,
        definition: NoiseDefinition::Response,
    };
    let simulator = Simulator::new(&scenario).unwrap();
    (0..n)
        .map(|replication| {
            let run_seed = RunSeed {
                seed: 2025,
                cell: (condition as u64) << 8 | m0 as u64,
                replication,
            };
            simulator.run(run_seed, false).unwrap()
        })
        .collect()
}

fn grey_box(m: usize) -> GreyBox {
    GreyBox::new(m..=m)
}

/// Returns the estimates with their true values, in the order of [`PARAMETER_NAMES`].
fn estimates_with_truth(fit: &GreyBoxFit, record: &Record, condition: Condition) -> [(Estimate, f64); 8] {
    let truth = Scenario::condition(condition).initial.operator;
    let (o, r) = (fit.operator(0).unwrap(), fit.remnant(0).unwrap());
    [
        (o.k_e, truth.k_e),
        (o.t_l_s, truth.t_l_s),
        (o.k_e_dot, truth.k_e_dot()),
        (o.omega_nm_rad_s, truth.omega_nm_rad_s),
        (o.zeta_nm, truth.zeta_nm),
        (o.tau_e_s, truth.tau_e_s),
        (r.t_n_s, 0.06),
        (r.k_n, record.channel("K_n").unwrap()[0]),
    ]
}

fn median(values: &[f64]) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let n = sorted.len();
    (sorted[(n - 1) / 2] + sorted[n / 2]) / 2.0
}

/// Fits with known m in both conditions: the medians are within 5 %, the spread agrees with the information matrix, and
/// the intervals have the nominal coverage.
fn check_bias_and_efficiency(m0: usize) {
    let n = 100;
    let mut inside = [0; 8];
    for condition in [Condition::C1, Condition::C2] {
        let mut relative = vec![Vec::new(); 8];
        let mut variance = [0.0; 8];
        let mut expected = [0.0; 8];
        for record in runs(condition, m0, n) {
            let fit = grey_box(m0).fit(std::slice::from_ref(&record)).unwrap();
            assert!(fit.termination().converged(), "{:?}", fit.termination());
            for (i, (e, truth)) in estimates_with_truth(&fit, &record, condition).into_iter().enumerate() {
                let se = e.standard_error.unwrap();
                relative[i].push(e.value / truth - 1.0);
                variance[i] += (e.value - truth).powi(2) / n as f64;
                // The average of sigma^2 times the inverse information matrix is the Cramér-Rao bound of these runs.
                expected[i] += se * se / n as f64;
                inside[i] += u64::from((e.value - truth).abs() < 1.96 * se);
            }
        }
        for (i, name) in PARAMETER_NAMES.iter().enumerate() {
            let (bias, ratio) = (median(&relative[i]), variance[i] / expected[i]);
            println!(
                "{condition:?} m={m0} {name:8} median bias {:+.2} %  spread {:.2} %  mean square error / bound {ratio:.2}",
                100.0 * bias,
                100.0 * (relative[i].iter().map(|r| r * r).sum::<f64>() / n as f64).sqrt()
            );
            assert!(bias.abs() < 0.05, "{name}: {bias}");
            // A variance from 100 runs has a standard error of 14 %; the tolerance is four standard errors.
            assert!((0.44..1.56).contains(&ratio), "{name}: {ratio}");
        }
    }
    let shares = inside.map(|c| c as f64 / (2 * n) as f64);
    println!("m={m0}: coverage of nominal 95 % intervals {shares:.3?} for {PARAMETER_NAMES:?}");
    // With 200 runs the standard error is 1.5 %; the tolerance is four standard errors.
    assert!(shares.iter().all(|s| (0.89..=1.0).contains(s)), "{shares:?}");
}

#[test]
fn first_order_remnant_fits_are_unbiased() {
    check_bias_and_efficiency(1);
}

#[test]
fn second_order_remnant_fits_are_unbiased() {
    check_bias_and_efficiency(2);
}

#[test]
fn third_order_remnant_fits_are_unbiased() {
    check_bias_and_efficiency(3);
}

#[test]
fn fourth_order_remnant_fits_are_unbiased() {
    check_bias_and_efficiency(4);
}

#[test]
fn remnant_order_is_found() {
    let n = 12;
    for m0 in 1..=4 {
        let right = runs(Condition::C1, m0, n)
            .iter()
            .filter(|record| {
                let fit = GreyBox::new(1..=4).fit(std::slice::from_ref(*record)).unwrap();
                assert_eq!(fit.candidates().len(), 4);
                let least = fit.candidates().iter().map(|c| c.outcome.as_ref().unwrap().loss);
                assert_eq!(fit.loss(), least.fold(f64::INFINITY, f64::min));
                fit.order() == m0
            })
            .count();
        println!("m0={m0}: right order in {right} of {n} runs");
        assert!(right as u64 >= n - 1, "m0 = {m0}: {right} of {n}");
    }
}

#[test]
fn white_remnant_is_distinguished_from_coloured() {
    let signals = simulate_delay(0.3, 4000, 0.004);
    let fit = GreyBox::new(0..=2).fit(&[signals]).unwrap();
    assert_eq!(fit.order(), 0);
    assert!(fit.remnant(0).is_none());
    assert!((fit.innovation_variance().sqrt() / 0.004 - 1.0).abs() < 0.05);
}

/// The operator with a delay of `tau` in open loop. The held input is integrated exactly over the parts of each sample
/// before and after a new value reaches the system, so the simulation does not use the discrete model under test.
fn simulate_delay(tau: f64, n: usize, noise: f64) -> Record {
    simulate_operator([0.09, 0.036, 11.25, 0.35, tau], n, noise, 0)
}

/// As [`simulate_delay`], for `[K_e, K_e_dot, omega_nm, zeta_nm, tau_e]`.
fn simulate_operator([k_e, k_e_dot, omega, zeta, tau]: [f64; 5], n: usize, noise: f64, replication: u64) -> Record {
    let l = (tau / 0.01 + 1e-9).floor() as usize;
    let delta = tau - 0.01 * l as f64;
    let over =
        |t: f64| (t > 1e-12).then(|| ZohStates::new(2.0 * zeta * omega, omega * omega, SampleTime::new(t).unwrap()));
    let (old, new) = (over(delta), over(0.01 - delta));
    let e: Vec<f64> = (0..n)
        .map(|k| {
            (1..=10)
                .map(|i| (f64::from(i * i) * 0.19 * 0.01 * k as f64 + f64::from(i)).sin() / f64::from(i))
                .sum()
        })
        .collect();
    let deviates = RunSeed {
        seed: 3,
        cell: 1,
        replication,
    }
    .white_noise(n);
    let input = |k: usize, lag: usize| if k >= lag { e[k - lag] } else { 0.0 };
    let (mut x, mut u) = ([0.0; 2], Vec::with_capacity(n));
    for k in 0..n {
        u.push(omega * omega * (k_e * x[0] + k_e_dot * x[1]) + noise * deviates[k]);
        for (part, value) in [(old, input(k, l + 1)), (new, input(k, l))] {
            if let Some(part) = part {
                x = part.step(x, value);
            }
        }
    }
    Record::new(
        SampleTime::AT_100_HZ,
        Channel::new("e", "deg", e),
        Channel::new("u", "deg", u),
    )
    .unwrap()
}

#[test]
fn every_delay_is_exact_without_noise() {
    for tau in [0.28, 0.2837, 0.2899, 0.115, 0.4003] {
        for initial_state in [InitialState::Estimate, InitialState::Zero] {
            let fit = GreyBox {
                initial_state,
                ..grey_box(0)
            }
            .fit(&[simulate_delay(tau, 3000, 0.0)])
            .unwrap();
            assert_eq!(fit.termination().reason, Reason::ExactFit, "{tau}");
            let o = fit.operator_parameters(0).unwrap();
            println!("tau_e {tau}: {o:?} from {}", fit.start());
            for (found, truth) in [
                (o.k_e, 0.09),
                (o.t_l_s, 0.4),
                (o.omega_nm_rad_s, 11.25),
                (o.zeta_nm, 0.35),
                (o.tau_e_s, tau),
            ] {
                // The residuals are 1e-13 of the output.
                assert!(
                    (found / truth - 1.0).abs() < 1e-8,
                    "{tau} {initial_state:?}: {found} and {truth}"
                );
            }
            assert!(fit.covariance().is_none() && fit.operator(0).unwrap().k_e.standard_error.is_none());
        }
    }
}

#[test]
fn every_operator_is_found_from_default_starts() {
    let draws = RunSeed {
        seed: 5,
        cell: 2,
        replication: 0,
    }
    .white_noise(5 * 200);
    // The result is approximately uniform in (0, 1).
    let share = |z: f64| 1.0 / (1.0 + (-1.7 * z).exp());
    let (mut lost, mut singular) = (Vec::new(), 0);
    for (i, z) in draws.chunks_exact(5).enumerate() {
        let parameters = [
            0.03 + 0.3 * share(z[0]),
            0.01 + 0.1 * share(z[1]),
            4.0 + 26.0 * share(z[2]),
            0.08 + 1.2 * share(z[3]),
            0.08 + 0.4 * share(z[4]),
        ];
        let record = simulate_operator(parameters, 3000, 0.01, i as u64);
        let silent = simulate_operator(parameters, 3000, 0.0, i as u64);
        let fit = match grey_box(0).fit(std::slice::from_ref(&record)) {
            Ok(fit) => fit,
            Err(IdentError::SingularInformation { .. }) => {
                singular += 1;
                continue;
            }
            Err(error) => panic!("{parameters:?}: {error}"),
        };
        let noise = record
            .output()
            .iter()
            .zip(silent.output())
            .map(|(a, b)| (a - b).powi(2));
        let tail: Vec<f64> = noise.skip(3000 - fit.residual_count()).collect();
        // The minimum must be below the loss at the true parameters.
        if fit.loss() > tail.iter().sum::<f64>() / tail.len() as f64 || !fit.termination().converged() {
            lost.push((
                parameters,
                format!("loss {:e}, {:?}, {:?}", fit.loss(), fit.termination(), fit.parameters()),
            ));
        }
    }
    // An overdamped operator whose zero nearly cancels a pole may fit best in the limit of one
    // pole, and is rejected.
    assert!(singular <= 2, "{singular}");
    assert!(lost.is_empty(), "{} of 200: {lost:#?}", lost.len());
}

#[test]
fn delay_between_samples_is_found_in_noise() {
    let fit = grey_box(0).fit(&[simulate_delay(0.2837, 6000, 0.02)]).unwrap();
    let tau = fit.operator(0).unwrap().tau_e_s;
    let error = tau.standard_error.unwrap();
    println!("tau_e {:.5} s, standard error {error:.5} s", tau.value);
    // The standard error is less than half a sample, and the estimate is within 4 standard errors.
    assert!(error < 0.003 && (tau.value - 0.2837).abs() < 4.0 * error);
}

#[test]
fn constraints_hold_and_reduce_the_variance() {
    let record = runs(Condition::C1, 2, 1);
    let free = grey_box(2).fit(&record).unwrap();
    let mut held = grey_box(2);
    held.constraints.insert("T_L".to_owned(), Constraint::Fixed(0.4));
    held.constraints
        .insert("tau_e".to_owned(), Constraint::Between(0.20, 0.25));
    let fit = held.fit(&record).unwrap();
    assert!(fit.termination().converged(), "{:?}", fit.termination());
    let (o, reference) = (fit.operator(0).unwrap(), free.operator(0).unwrap());
    assert_eq!((o.t_l_s, o.tau_e_s), (Estimate::fixed(0.4), Estimate::fixed(0.25)));
    // K_e_dot = K_e T_L changes with K_e.
    let ratio = o.k_e_dot.standard_error.unwrap() / o.k_e.standard_error.unwrap();
    assert!((ratio - 0.4).abs() < 1e-12);
    assert!(o.k_e.standard_error.unwrap() < reference.k_e.standard_error.unwrap());
    assert!(fit.loss() > free.loss());
    assert_eq!((fit.parameter_count(), free.parameter_count()), (5, 6));
    // A lead time that is free within bounds gives the same fit in other coordinates.
    let mut bounded = grey_box(2);
    bounded
        .constraints
        .insert("T_L".to_owned(), Constraint::Between(0.0, 5.0));
    let same = bounded.fit(&record).unwrap();
    assert!((same.loss() / free.loss() - 1.0).abs() < 1e-10);
    let (a, b) = (same.operator(0).unwrap(), reference);
    for ((name, _, a), (_, _, b)) in a.rows().into_iter().zip(b.rows()) {
        let (sa, sb) = (a.standard_error.unwrap(), b.standard_error.unwrap());
        // Both searches end within 1e-4 standard errors of the minimum.
        assert!(
            (a.value - b.value).abs() < 1e-3 * sb && (sa / sb - 1.0).abs() < 1e-3,
            "{name}: {a:?} {b:?}"
        );
    }
}

#[test]
fn records_share_common_parameters() {
    let mut records = runs(Condition::C1, 1, 2);
    records.extend(runs(Condition::C2, 1, 1));
    let one = grey_box(1).fit(&records[..1]).unwrap();
    let two = grey_box(1).fit(&records[..2]).unwrap();
    let gain = |fit: &GreyBoxFit| fit.operator(0).unwrap().omega_nm_rad_s.standard_error.unwrap();
    // Twice the data reduce the standard error by sqrt(2); the estimates of the standard error scatter by a few per
    // cent.
    assert!((1.2..1.65).contains(&(gain(&one) / gain(&two))));
    // The third record has other gains; the neuromuscular system, the delay and the remnant are the
    // same.
    let mut mixed = grey_box(1);
    mixed.individual = vec!["K_e".to_owned(), "K_e_dot".to_owned()];
    let fit = mixed.fit(&records).unwrap();
    assert!(fit.termination().converged());
    assert_eq!((fit.parameters().len(), fit.state_count()), (10, 6));
    assert_eq!(fit.parameters()[2].0, "K_e[3]");
    for (record, (k_e, t_l)) in [(0, (0.09, 0.4)), (1, (0.09, 0.4)), (2, (0.07, 1.2))] {
        let o = fit.operator(record).unwrap();
        for (e, truth) in [
            (o.k_e, k_e),
            (o.t_l_s, t_l),
            (o.omega_nm_rad_s, 11.25),
            (o.tau_e_s, 0.28),
        ] {
            assert!(
                (e.value - truth).abs() < 4.0 * e.standard_error.unwrap(),
                "{record}: {e:?} and {truth}"
            );
        }
    }
}

#[test]
fn polynomial_fit_is_the_same_model() {
    let record = runs(Condition::C1, 3, 1).remove(0);
    let fit = grey_box(3).fit(std::slice::from_ref(&record)).unwrap();
    let same = fit.polynomial_fit(0);
    let h = fit.operator_parameters(0).unwrap().transfer_function().unwrap();
    for point in same.frequency_response(&[0.5, 3.0, 10.0]) {
        // The hold delays by half a sample and reduces the amplitude by (omega Ts)^2/24.
        let half = Complex64::from_polar(1.0, -point.omega_rad_s * 0.005);
        let continuous = h.response(point.omega_rad_s) * half;
        assert!((point.magnitude_db.value - 20.0 * continuous.norm().log10()).abs() < 0.01);
        assert!((point.phase_deg.value - continuous.arg().to_degrees()).abs() < 0.1);
        assert!(point.phase_deg.standard_error.unwrap() > 0.0);
    }
    // The residuals start at the first sample that the delay allows; the loss of the fit omits a few more samples.
    let residuals = same.residuals(&record).unwrap();
    let last = &residuals.values[residuals.values.len() - fit.residual_count()..];
    let loss = last.iter().map(|e| e * e).sum::<f64>() / last.len() as f64;
    assert!((loss / fit.loss() - 1.0).abs() < 1e-3, "{loss} and {}", fit.loss());
}

#[test]
fn invalid_data_and_options_are_errors() {
    let record = runs(Condition::C1, 1, 1);
    let refused = |change: fn(&mut GreyBox), records: &[Record]| {
        let mut grey = grey_box(1);
        change(&mut grey);
        grey.fit(records).unwrap_err()
    };
    assert!(matches!(refused(|_| (), &[]), IdentError::NoRecords));
    assert!(matches!(
        refused(|g| g.order = 1..=5, &record),
        IdentError::BadOption { .. }
    ));
    let backwards = |g: &mut GreyBox| g.order = std::ops::RangeInclusive::new(3, 1);
    assert!(matches!(refused(backwards, &record), IdentError::BadOption { .. }));
    assert!(matches!(
        refused(|g| g.delay_range_s = (0.3, 0.1), &record),
        IdentError::BadOption { .. }
    ));
    assert!(matches!(
        refused(|g| g.individual = vec!["mass".to_owned()], &record),
        IdentError::UnknownParameter { .. }
    ));
    // With the longest delay there are 62 samples before the first residual; there are 6 parameters and 2 states.
    for samples in [1, 5, 61, 65, 69] {
        let short = [record[0].span(0.0, 0.01 * f64::from(samples)).unwrap()];
        let error = refused(|_| (), &short);
        // The error may also be missing excitation, because the first samples of the task are zero.
        let expected = matches!(
            error,
            IdentError::TooFewSamples { .. } | IdentError::NoExcitation { .. } | IdentError::DelayTooLong { .. }
        );
        assert!(expected, "{samples}: {error}");
    }
    for samples in [75, 80, 120] {
        let short = [record[0].span(0.0, 0.01 * f64::from(samples)).unwrap()];
        // The result is a fit or a refusal with a reason, never a panic.
        for order in [0..=4, 2..=2] {
            if let Ok(fit) = GreyBox::new(order).fit(&short) {
                assert!(fit.loss().is_finite());
            }
        }
    }
    let still = Record::new(
        SampleTime::AT_100_HZ,
        Channel::new("e", "", vec![0.0; 500]),
        Channel::new("u", "", (0..500).map(f64::from).collect()),
    )
    .unwrap();
    assert!(matches!(refused(|_| (), &[still]), IdentError::NoExcitation { .. }));
}
