//! Tests of describing functions of simulated runs: the exact operator without remnant; error bars and remnant spectrum
//! with remnant.

use hoid_model::{
    Complex64, DiscreteTransferFunction, PolynomialModel, Record, Structure,
    remnant::{RemnantDiscretisation, RemnantFilter},
    scenario::{Condition, RemnantStrength, Scenario},
    uncertainty::Estimate,
};
use hoid_sim::{RunSeed, Simulator};

use super::*;

const PERIOD_S: f64 = 81.92;

fn scenario(condition: Condition, remnant: bool) -> Scenario {
    let mut scenario = Scenario::condition(condition);
    // The run-in lasts until the slowest mode of the loop has decayed.
    scenario.run_in_s = 100.0;
    if !remnant {
        scenario.remnant.strength = RemnantStrength::Gain {
            initial: 0.0,
            last: 0.0,
        };
    }
    scenario
}

fn runs(scenario: &Scenario, cell: u64, n: u64) -> Vec<Record> {
    let simulator = Simulator::new(scenario).unwrap();
    let run_seed = |replication| RunSeed {
        seed: 20,
        cell,
        replication,
    };
    (0..n).map(|i| simulator.run(run_seed(i), false).unwrap()).collect()
}

fn lines() -> Excitation {
    Excitation::from_forcing_function(&Scenario::condition(Condition::C1).forcing, PERIOD_S).unwrap()
}

/// Returns the discrete model of the operator with its hold.
fn operator(scenario: &Scenario) -> PolynomialModel {
    let d = scenario.initial.operator.discretise(scenario.sample_time).unwrap();
    let theta = vec![d.zoh.b0, d.zoh.b1, 0.0, d.zoh.f1, d.zoh.f2];
    let orders = Structure::BoxJenkins.operator_orders(d.nk);
    PolynomialModel::new(Structure::BoxJenkins, orders, scenario.sample_time, theta).unwrap()
}

/// Returns the discrete model of `K_c/(s (s + omega_b))` with its hold, in closed form from the residues of
/// `K_c/(s^2 (s + omega_b))`.
fn element(scenario: &Scenario) -> DiscreteTransferFunction {
    let (c, ts) = (scenario.initial.controlled_element, scenario.sample_time.s());
    let (b, p) = (c.omega_b_rad_s, (-c.omega_b_rad_s * ts).exp());
    let gain = c.k_c / (b * b);
    let num = [0.0, gain * (b * ts - 1.0 + p), gain * (1.0 - p - b * ts * p)];
    DiscreteTransferFunction::new(&num, &[1.0, -1.0 - p, p], scenario.sample_time).unwrap()
}

#[test]
fn noise_free_lines_match_the_operator_with_hold() {
    for condition in [Condition::C1, Condition::C2] {
        let scenario = scenario(condition, false);
        let (records, truth, plant) = (runs(&scenario, 0, 1), operator(&scenario), element(&scenario));
        let reference = Averaging::Reference {
            channel: "f_t".to_owned(),
        };
        for averaging in [Averaging::Ratios, Averaging::SameExcitation, reference] {
            let options = DescribingOptions {
                averaging,
                element: Some(MeasuredElement {
                    output: "x".to_owned(),
                    disturbance: None,
                }),
                ..DescribingOptions::default()
            };
            let found = describe(&records, &lines(), &options).unwrap();
            assert_eq!(found.lines.len(), 10);
            for line in &found.lines {
                let expected = truth.response(line.omega_rad_s);
                assert!(
                    (line.response / expected - 1.0).norm() < 1e-9,
                    "{condition} {}",
                    line.harmonic
                );
                let expected = plant.response(line.omega_rad_s);
                assert!((line.element.unwrap() / expected - 1.0).norm() < 1e-9);
                // A single run has no spread.
                assert_eq!((line.standard_error, line.coherence, line.spread), (None, None, None));
            }
            assert!(found.noise_ratio.value < 1e-15 && found.off_line_share.value < 1e-15);
        }
    }
}

#[test]
fn interpolated_margins_are_close_to_the_true_margins() {
    // The lines next to the crossover are 1.00 and 1.69 rad/s for C1, and 2.61 and 4.07 rad/s for C2. They are so far
    // apart that a straight line between them does not describe the loop.
    for (condition, crossover, margin) in [(Condition::C1, 1.5635, 76.67), (Condition::C2, 2.7480, 22.90)] {
        let scenario = scenario(condition, false);
        let found = describe(&runs(&scenario, 0, 1), &lines(), &DescribingOptions::default()).unwrap();
        let continuous = scenario.initial.controlled_element.transfer_function().unwrap();
        // The hold of the operator is a delay of half a sample, to within 1e-5 of the magnitude at these frequencies.
        let half_s = 0.5 * scenario.sample_time.s();
        let open_loop = found.open_loop_with(|w| continuous.response(w) * Complex64::from_polar(1.0, half_s * w));
        let delay_s = scenario.initial.operator.tau_e_s;
        for (margins, of_crossover, of_margin) in [
            (open_loop.margins(), 0.01, 1.2),
            (open_loop.margins_with_delay(delay_s), 0.01, 0.5),
        ] {
            let found = margins.estimates;
            let (omega, phase) = (found.crossover_rad_s.unwrap(), found.phase_margin_deg.unwrap());
            println!("{condition}: {} rad/s, {} deg", omega.value, phase.value);
            assert_eq!((omega.standard_error, margins.per_run.len()), (None, 1));
            assert!((omega.value / crossover - 1.0).abs() < of_crossover);
            assert!((phase.value - margin).abs() < of_margin);
        }
    }
}

#[test]
fn confidence_circles_have_nominal_coverage() {
    let scenario = scenario(Condition::C2, true);
    let (truth, lines) = (operator(&scenario), lines());
    let (experiments, runs_each) = (80_u64, 5_u64);
    let continuous = scenario.initial.controlled_element.transfer_function().unwrap();
    let options = DescribingOptions {
        averaging: Averaging::Reference {
            channel: "f_t".to_owned(),
        },
        ..DescribingOptions::default()
    };
    let (mut inside, mut without_bound) = (0, vec![0; lines.harmonics().len()]);
    // Squared error and its estimate at each line, relative to the true value.
    let mut squares = vec![(0.0, 0.0); lines.harmonics().len()];
    let (mut crossovers, mut errors) = (Vec::new(), Vec::new());
    for i in 0..experiments {
        let found = describe(&runs(&scenario, 1 + i, runs_each), &lines, &options).unwrap();
        for (k, (line, (square, variance))) in found.lines.iter().zip(&mut squares).enumerate() {
            let expected = truth.response(line.omega_rad_s);
            *square += ((line.response - expected).norm() / expected.norm()).powi(2);
            *variance += (line.standard_error.unwrap() / expected.norm()).powi(2);
            match line.confidence_circle(0.95) {
                Some((centre, radius)) => inside += usize::from((centre - expected).norm() <= radius),
                None => without_bound[k] += 1,
            }
        }
        let margins = found.open_loop(&continuous).margins();
        let crossover = margins.estimates.crossover_rad_s.unwrap();
        crossovers.push(crossover.value);
        errors.push(crossover.standard_error.unwrap().powi(2));
    }
    let unbounded: usize = without_bound.iter().sum();
    let checks = experiments as usize * squares.len();
    // An unbounded region is the exterior of a circle far from H, so the true value is counted as inside.
    let coverage = (inside + unbounded) as f64 / checks as f64;
    println!("coverage {coverage} of {checks} circles, without bound {without_bound:?}");
    // The checks are nearly independent, with a standard error of 0.0077. The region may be unbounded only where the
    // remnant in e is as large as e.
    assert!((coverage - 0.95).abs() < 0.023 && without_bound[2..].iter().all(|n| *n == 0));
    // At the two lowest lines the remnant in e is not small compared with e, and sigma is only valid to first order. At
    // each of the other lines there are 80 squares with two degrees of freedom and 80 estimates with eight: the mean
    // has a standard error of 0.044.
    let ratios: Vec<f64> = squares[2..]
        .iter()
        .map(|(square, variance)| square / variance)
        .collect();
    let mean_ratio = ratios.iter().sum::<f64>() / ratios.len() as f64;
    println!("mean square over variance {mean_ratio}: {ratios:?}");
    assert!((mean_ratio - 1.0).abs() < 0.13);
    let n = experiments as f64;
    let mean = crossovers.iter().sum::<f64>() / n;
    let variance = crossovers.iter().map(|c| (c - mean).powi(2)).sum::<f64>() / (n - 1.0);
    let ratio = (variance / (errors.iter().sum::<f64>() / n)).sqrt();
    // With 80 experiments the standard deviation has a relative standard error of 0.08, and the mean of the jackknife
    // variances of five runs contributes 0.04.
    println!("crossover {mean}, deviation/standard error {ratio}");
    assert!((ratio - 1.0).abs() < 0.27);
}

#[test]
fn remnant_spectrum_matches_the_simulated_remnant() {
    for (condition, k_n) in [(Condition::C1, 0.07636), (Condition::C2, 0.13971)] {
        let scenario = scenario(condition, true);
        let records = runs(&scenario, 500, 40);
        let found = describe(&records, &lines(), &DescribingOptions::default()).unwrap();
        let ratio = found.noise_ratio;
        println!(
            "{condition}: {ratio:?}, at non-excited frequencies {:?}",
            found.off_line_share
        );
        // The requested noise ratio is 0.1, and the mean of 1000 runs is within 0.003 of it; the mean of ratios has a
        // bias of a fraction of their variance.
        assert!((ratio.value - 0.1).abs() < 3.0 * ratio.standard_error.unwrap() + 0.003);
        assert!(found.off_line_share.value < ratio.value);

        // The density of the held noise n = K_n z is |filter|^2 Ts/pi per rad/s; in the closed loop the filter is
        // divided by 1 + L.
        let filter = RemnantFilter::new(k_n, 0.06, 1).unwrap();
        let filter = filter
            .discretise(scenario.sample_time, RemnantDiscretisation::ZeroOrderHold)
            .unwrap();
        let (h, plant) = (operator(&scenario), element(&scenario));
        let (mut chi_square, mut bands) = (0.0, 0);
        for band in &found.remnant_spectrum {
            let w = band.omega_rad_s;
            // A band is 0.6 rad/s wide: below 12 rad/s the spectrum is curved within a band.
            if w > 12.0 && w < 300.0 {
                let open = h.response(w) * plant.response(w);
                let density = (filter.response(w) / (1.0 + open)).norm_sqr() * 0.01 / std::f64::consts::PI;
                chi_square += ((band.density - density) / (density / (band.values as f64).sqrt())).powi(2);
                bands += 1;
            }
        }
        let normalised = chi_square / f64::from(bands);
        println!("{bands} bands: {normalised}");
        // About 470 values of unit variance give a standard error of sqrt(2/470) = 0.065, to which the leakage of a
        // window without taper is added.
        assert!((normalised - 1.0).abs() < 0.25);
    }
}

#[test]
fn each_period_can_be_treated_as_a_run() {
    let mut scenario = scenario(Condition::C1, true);
    scenario.measurement_s = 4.0 * PERIOD_S;
    let records = runs(&scenario, 900, 2);
    let reference = Averaging::Reference {
        channel: "f_t".to_owned(),
    };
    let describe_by = |realisation, averaging| {
        let options = DescribingOptions {
            averaging,
            realisation,
            ..DescribingOptions::default()
        };
        describe(&records, &lines(), &options).unwrap()
    };
    let whole = describe_by(Realisation::Record, reference.clone());
    let parts = describe_by(Realisation::Period, reference);
    let same = describe_by(Realisation::Period, Averaging::SameExcitation);
    assert_eq!((whole.runs.len(), parts.runs.len(), parts.runs[7].periods), (2, 8, 1));
    for ((a, b), c) in whole.lines.iter().zip(&parts.lines).zip(&same.lines) {
        // The coefficients of four periods are the mean of the coefficients of the single periods.
        assert!((a.response / b.response - 1.0).norm() < 1e-10 && (b.response / c.response - 1.0).norm() < 1e-10);
        assert!((b.coherence.unwrap() - c.coherence.unwrap()).abs() < 1e-10);
        assert_eq!(b.per_run.len(), 8);
    }
    // Records and single periods estimate the same noise ratio, from finer and coarser bins.
    assert!((whole.noise_ratio.value - parts.noise_ratio.value).abs() < 0.01);
    let (fit, options) = (parts, GainLeadDelayOptions::default());
    let fit = fit.fit_gain_lead_delay(&options).unwrap();
    assert!(fit.gain.standard_error.unwrap() > 0.0 && fit.delay_s.standard_error.unwrap() > 0.0);
}

#[test]
fn weights_and_ranges_are_checked() {
    let scenario = scenario(Condition::C1, true);
    let one = describe(&runs(&scenario, 0, 1), &lines(), &DescribingOptions::default()).unwrap();
    let fit = |options: GainLeadDelayOptions| one.fit_gain_lead_delay(&options);
    let default = GainLeadDelayOptions::default();
    let of_one = fit(default).unwrap();
    assert_eq!(of_one.delay_s, Estimate::fixed(of_one.delay_s.value));
    assert!(
        fit(GainLeadDelayOptions {
            weights: LineWeights::Variance,
            ..default
        })
        .is_err()
    );
    for delay_range_s in [
        (0.5, 0.5),
        (1.0, 0.0),
        (0.0, f64::INFINITY),
        (f64::NAN, 1.0),
        (0.0, 1e9),
    ] {
        assert!(
            fit(GainLeadDelayOptions {
                delay_range_s,
                ..default
            })
            .is_err()
        );
    }
    let without = fit(GainLeadDelayOptions { lead: false, ..default }).unwrap();
    assert_eq!(without.lead_s, Estimate::fixed(0.0));
    assert!(without.misfit >= of_one.misfit);
    assert!(one.measured_open_loop().is_err());
    let single = describe(
        &runs(&scenario, 0, 1),
        &Excitation::from_harmonics(&[5], PERIOD_S).unwrap(),
        &DescribingOptions::default(),
    )
    .unwrap();
    assert!(single.fit_gain_lead_delay(&default).is_err());
    assert_eq!(
        single
            .open_loop_with(|_| Complex64::new(1.0, 0.0))
            .margins()
            .estimates
            .crossover_rad_s,
        None
    );
}
