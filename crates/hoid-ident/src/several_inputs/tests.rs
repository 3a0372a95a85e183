use super::*;

struct Random(u64);

impl Random {
    fn next(&mut self) -> f64 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
    }
}

/// Returns a record of `u = (.5 + .2 q^-1) q^-2/(1 - .7 q^-1) e + .3 q^-1/(1 - .9 q^-1) r + (1 + .4 q^-1)/(1 - .8 q^-1)
/// eps`.
fn record(n: usize, noise: f64, seed: u64) -> Record {
    let mut random = Random(seed);
    let mut input = || -> Vec<f64> { (0..n).map(|_| random.next()).collect() };
    let (e, r, eps) = (input(), input(), input());
    let (mut w, mut v, mut x, mut u) = (vec![0.0; n], vec![0.0; n], vec![0.0; n], vec![0.0; n]);
    let at = |s: &[f64], t: usize, lag: usize| t.checked_sub(lag).map_or(0.0, |i| s[i]);
    for t in 0..n {
        w[t] = 0.7 * at(&w, t, 1) + 0.5 * at(&e, t, 2) + 0.2 * at(&e, t, 3);
        v[t] = 0.9 * at(&v, t, 1) + 0.3 * at(&r, t, 1);
        x[t] = 0.8 * at(&x, t, 1) + noise * (eps[t] + 0.4 * at(&eps, t, 1));
        u[t] = w[t] + v[t] + x[t] + 1.5;
    }
    Record::new(
        SampleTime::AT_100_HZ,
        Channel::new("e", "", e),
        Channel::new("u", "", u),
    )
    .unwrap()
    .with_channel(Channel::new("r", "", r))
    .unwrap()
}

fn box_jenkins() -> SeveralInputs {
    let of = |nb, nf, nk| InputOrders { nb, nf, nk };
    SeveralInputs {
        nc: 1,
        nd: 1,
        inputs: vec![("e".to_owned(), of(2, 1, 2)), ("r".to_owned(), of(1, 1, 1))],
        ..SeveralInputs::new(Structure::BoxJenkins)
    }
}

#[test]
fn two_systems_and_their_noise_model_are_found() {
    // For 40 records, the mean square of the errors, in standard errors, is one to within 0.1 plus four times its
    // standard error.
    let truth = [0.5, 0.2, 0.4, -0.8, -0.7, 0.3, -0.9];
    let (mut squares, mut count) = (0.0, 0.0);
    for seed in 1..=40 {
        let fit = box_jenkins().fit(&[record(1500, 0.1, seed)]).unwrap();
        assert!(fit.termination.converged(), "{}", fit.termination);
        for ((name, estimate), truth) in fit.parameters().iter().zip(truth) {
            let z = (estimate.value - truth) / estimate.standard_error.unwrap();
            assert!(z.abs() < 5.0, "{seed} {name} {estimate} {truth}");
            squares += z * z;
            count += 1.0;
        }
    }
    let mean: f64 = squares / count;
    assert!((mean - 1.0).abs() < 4.0 * (2.0_f64 / count).sqrt() + 0.1, "{mean}");
}

#[test]
fn noise_free_coefficients_are_exact() {
    let fit = SeveralInputs {
        nc: 0,
        nd: 0,
        ..box_jenkins()
    };
    let fit = SeveralInputs {
        structure: Structure::OutputError,
        ..fit
    };
    let found = fit.fit(&[record(400, 0.0, 3)]).unwrap();
    for ((name, estimate), truth) in found.parameters().iter().zip([0.5, 0.2, -0.7, 0.3, -0.9]) {
        assert!((estimate.value - truth).abs() < 1e-8, "{name} {estimate}");
    }
    assert!(found.vaf_prediction > 99.999_999);
}

#[test]
fn one_input_matches_the_single_input_estimator() {
    let record = record(600, 0.1, 9);
    for (structure, na, nc, nd, nf) in [
        (Structure::Arx, 2, 0, 0, 0),
        (Structure::Armax, 2, 1, 0, 0),
        (Structure::BoxJenkins, 0, 1, 2, 2),
        (Structure::OutputError, 0, 0, 0, 2),
    ] {
        let orders = Orders {
            na,
            nb: 2,
            nc,
            nd,
            nf,
            nk: 2,
        };
        let one = Estimator {
            level: true,
            ..Estimator::new(structure, orders)
        }
        .fit(std::slice::from_ref(&record))
        .unwrap();
        let several = SeveralInputs {
            na,
            nc,
            nd,
            inputs: vec![("e".to_owned(), InputOrders { nb: 2, nf, nk: 2 })],
            ..SeveralInputs::new(structure)
        };
        let several = several.fit(std::slice::from_ref(&record)).unwrap();
        assert!(
            (several.loss / one.loss() - 1.0).abs() < 1e-7,
            "{structure} {} {}",
            several.loss,
            one.loss()
        );
        for ((name, a), (_, b)) in one.parameters().iter().zip(several.parameters()) {
            let (s, t) = (a.standard_error.unwrap(), b.standard_error.unwrap());
            assert!(
                (a.value - b.value).abs() < 1e-3 * s && (s / t - 1.0).abs() < 1e-3,
                "{structure} {name} {a} {b}"
            );
        }
        let omega = [1.0, 7.0, 40.0];
        for (a, b) in one
            .frequency_response(&omega)
            .iter()
            .zip(several.frequency_response(0, &omega))
        {
            assert!(
                (a.magnitude_db.value - b.magnitude_db.value).abs() < 1e-3,
                "{structure}"
            );
            let (s, t) = (a.phase_deg.standard_error.unwrap(), b.phase_deg.standard_error.unwrap());
            assert!((s / t - 1.0).abs() < 1e-2, "{structure} {s} {t}");
        }
    }
}

#[test]
fn invalid_inputs_and_orders_are_refused() {
    let data = [record(200, 0.1, 1)];
    let refusal = |how: SeveralInputs| how.fit(&data).unwrap_err().to_string();
    let twice = SeveralInputs {
        inputs: vec![box_jenkins().inputs[0].clone(); 2],
        ..box_jenkins()
    };
    assert!(refusal(twice).contains("e twice"));
    let none = SeveralInputs {
        inputs: Vec::new(),
        ..box_jenkins()
    };
    assert!(refusal(none).contains("at least one"));
    let mut unknown = box_jenkins();
    unknown.inputs[1].0 = "q".to_owned();
    assert!(refusal(unknown).contains("no channel q"));
    assert!(
        refusal(SeveralInputs {
            structure: Structure::Ar,
            ..box_jenkins()
        })
        .contains("a structure with inputs")
    );
    let mut late = box_jenkins();
    late.inputs[1].1.nk = 400;
    let needs = refusal(late);
    assert!(needs.contains("needs more than 401"), "{needs}");
    // There are enough samples for the coefficients of one input, but too few for those of two inputs.
    let few = [record(14, 0.1, 1)];
    let too_few = box_jenkins().fit(&few);
    assert!(matches!(too_few, Err(IdentError::TooFewSamples { .. })), "{too_few:?}");
    let same = data[0]
        .clone()
        .with_channel(Channel::new("copy", "", data[0].input().to_vec()))
        .unwrap();
    let mut alike = SeveralInputs {
        na: 1,
        nc: 0,
        nd: 0,
        ..box_jenkins()
    };
    alike.structure = Structure::Arx;
    alike.inputs = vec![
        ("e".to_owned(), InputOrders { nb: 1, nf: 0, nk: 1 }),
        ("copy".to_owned(), InputOrders { nb: 1, nf: 0, nk: 1 }),
    ];
    assert!(matches!(alike.fit(&[same]), Err(IdentError::SingularRegressors { .. })));
}
