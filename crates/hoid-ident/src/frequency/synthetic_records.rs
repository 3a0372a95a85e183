//! Tests with sinusoids whose describing function is known in closed form, and with invalid input.

use hoid_model::{Channel, Complex64, Record, SampleTime};

use super::*;
use crate::IdentError;

fn record(e: Vec<f64>, u: Vec<f64>) -> Result<Record, hoid_model::ModelError> {
    let ts = SampleTime::new(0.1)?;
    Record::new(ts, Channel::new("e", "deg", e), Channel::new("u", "deg", u))
}

#[test]
fn element_is_found_despite_disturbance_and_offset() {
    // y[k + 1] = 0.8 y[k] + 0.5 (u[k] + d[k]), with u and d recorded one sample late, over two periods after a long
    // run-in.
    let at = |k: i32, n: f64, phase: f64| (std::f64::consts::TAU * n * f64::from(k) / 100.0 + phase).sin();
    let u = |k: i32| at(k, 3.0, 0.2) - 0.7 * at(k, 7.0, 1.0);
    let d = |k: i32| 0.4 * at(k, 3.0, 2.0) + at(k, 7.0, 0.4);
    let mut y = vec![0.0];
    for k in -400..199 {
        let last = y[y.len() - 1];
        y.push(0.8 * last + 0.5 * (u(k) + d(k)));
    }
    let y = y.split_off(400);
    let late = |x: &dyn Fn(i32) -> f64| (0..200).map(|k| x(k - 1)).collect::<Vec<f64>>();
    let record = record(y.iter().map(|y| -y).collect(), late(&u)).unwrap();
    let record = record.with_channel(Channel::new("y", "deg", y)).unwrap();
    let record = record.with_channel(Channel::new("d", "deg", late(&d))).unwrap();
    let options = DescribingOptions {
        offset_samples: 1.0,
        element: Some(MeasuredElement {
            output: "y".to_owned(),
            disturbance: Some("d".to_owned()),
        }),
        ..DescribingOptions::default()
    };
    let excitation = Excitation::from_harmonics(&[3, 7], 10.0).unwrap();
    let found = describe(&[record], &excitation, &options).unwrap();
    for line in &found.lines {
        let z = Complex64::from_polar(1.0, 0.1 * line.omega_rad_s);
        assert!((line.element.unwrap() - 0.5 / (z - 0.8)).norm() < 1e-12);
    }
    let open = found.measured_open_loop().unwrap();
    let expected = found.lines[1].response * found.lines[1].element.unwrap();
    assert!((open.response[1] - expected).norm() < 1e-14 && (open.per_run[0][1] - expected).norm() < 1e-14);
}

/// u follows a target and a disturbance with lines of their own, and contains a sinusoid between them: the remnant.
#[test]
fn lines_of_other_excitations_are_no_remnant() {
    let sines = |all: &[(f64, f64)]| -> Vec<f64> {
        let at = |k: u32, n: f64| (std::f64::consts::TAU * n * f64::from(k) / 400.0).sin();
        (0..400).map(|k| all.iter().map(|&(n, a)| a * at(k, n)).sum()).collect()
    };
    let (target, disturbance) = ([(4.0, 1.0), (9.0, 0.5)], [(3.0, 1.0), (7.0, 1.0)]);
    let both: Vec<(f64, f64)> = target.into_iter().chain(disturbance).collect();
    let with_remnant: Vec<(f64, f64)> = both.iter().copied().chain([(30.0, 0.5)]).collect();
    let of = |extra: Option<&[(f64, f64)]>| {
        let record = record(sines(&both), sines(&with_remnant)).unwrap();
        let record = record
            .with_channel(Channel::new("d", "deg", sines(&disturbance)))
            .unwrap();
        let record = match extra {
            Some(lines) => record.with_channel(Channel::new("r", "deg", sines(lines))).unwrap(),
            None => record,
        };
        let excitation = Excitation::from_harmonics(&[3, 7], 40.0).unwrap();
        describe(&[record], &excitation, &DescribingOptions::default())
            .unwrap()
            .off_line_share
            .value
    };
    // Powers of 1/2, 1/8, 1/2, 1/2 and, for the remnant, 1/8.
    assert!((of(Some(&target)) - 0.125 / 1.75).abs() < 1e-9);
    assert!((of(None) - 0.75 / 1.75).abs() < 1e-9);
    // A target with power everywhere excites all bins.
    let noise: Vec<(f64, f64)> = (1..150).map(|n| (f64::from(n), 1.0)).collect();
    assert!((of(Some(&noise)) - 0.75 / 1.75).abs() < 1e-9);
}

#[test]
fn degenerate_input_is_refused() {
    let wave = |n: f64| -> Vec<f64> {
        (0..100)
            .map(|k| (std::f64::consts::TAU * n * f64::from(k) / 100.0).sin())
            .collect()
    };
    let options = DescribingOptions::default();
    let at = |harmonics: &[usize]| Excitation::from_harmonics(harmonics, 10.0).unwrap();
    let error = |record: Record, excitation: &Excitation| describe(&[record], excitation, &options).unwrap_err();
    let good = record(wave(3.0), wave(3.0)).unwrap();
    let found = describe(std::slice::from_ref(&good), &at(&[3]), &options).unwrap();
    assert!((found.lines[0].response - 1.0).norm() < 1e-14);

    assert_eq!(describe(&[], &at(&[3]), &options), Err(IdentError::NoRecords));
    assert!(matches!(
        error(good.clone(), &at(&[3, 4])),
        IdentError::NoLinePower { .. }
    ));
    assert!(matches!(
        error(good.clone(), &at(&[3, 50])),
        IdentError::LineBeyondNyquist { .. }
    ));
    assert!(matches!(
        error(good.clone(), &at(&[usize::MAX])),
        IdentError::LineBeyondNyquist { .. }
    ));
    assert!(matches!(
        error(record(vec![0.0; 100], wave(3.0)).unwrap(), &at(&[3])),
        IdentError::NoExcitation { .. }
    ));
    assert!(matches!(
        error(record(wave(3.0), vec![1.0; 100]).unwrap(), &at(&[3])),
        IdentError::NoExcitation { .. }
    ));
    let half = Excitation::from_harmonics(&[1], 20.0).unwrap();
    assert!(matches!(error(good.clone(), &half), IdentError::NotWholePeriods { .. }));
    // The period is shorter than a sample.
    let short = Excitation::from_harmonics(&[1], 0.01).unwrap();
    assert!(matches!(
        error(good.clone(), &short),
        IdentError::LineBeyondNyquist { .. }
    ));
    // A record with NaN cannot be created.
    assert!(record(vec![f64::NAN; 100], wave(3.0)).is_err());
    let alone = Record::from_output(SampleTime::new(0.1).unwrap(), Channel::new("u", "deg", wave(3.0))).unwrap();
    assert!(matches!(error(alone, &at(&[3])), IdentError::BadOption { .. }));

    // The mean of the span is removed, not the mean of the record.
    let mut shifted = wave(3.0);
    shifted.extend([7.0; 50]);
    let long = record(shifted.iter().map(|v| v + 2.0).collect(), shifted).unwrap();
    let of_mean = DescribingOptions {
        to_s: Some(10.0),
        detrend: hoid_model::Detrend::Mean,
        ..DescribingOptions::default()
    };
    let without_mean = describe(std::slice::from_ref(&long), &at(&[3]), &of_mean).unwrap();
    assert!((without_mean.rms_e.value - 0.5_f64.sqrt()).abs() < 1e-14);
    let with_mean = DescribingOptions {
        detrend: hoid_model::Detrend::None,
        ..of_mean
    };
    let with_mean = describe(&[long], &at(&[3]), &with_mean).unwrap();
    assert!((with_mean.rms_e.value - 4.5_f64.sqrt()).abs() < 1e-14);
    assert!((with_mean.lines[0].response - without_mean.lines[0].response).norm() < 1e-14);

    let refused = |change: &dyn Fn(&mut DescribingOptions)| {
        let mut options = DescribingOptions::default();
        change(&mut options);
        describe(std::slice::from_ref(&good), &at(&[3]), &options).is_err()
    };
    assert!(refused(&|o| o.offset_samples = f64::NAN));
    assert!(refused(&|o| o.smoothing_bins = 0));
    assert!(refused(&|o| o.from_s = Some(0.05)));
    assert!(refused(&|o| o.to_s = Some(f64::NAN)));
    assert!(refused(&|o| {
        o.averaging = Averaging::Reference {
            channel: "d".to_owned(),
        }
    }));
    assert!(refused(&|o| {
        o.element = Some(MeasuredElement {
            output: "x".to_owned(),
            disturbance: None,
        })
    }));
}
