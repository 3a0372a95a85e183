use super::*;

fn white_noise(n: usize) -> Vec<f64> {
    // A linear congruential generator (D. E. Knuth, MMIX), shifted to zero mean.
    let mut state = 7_u64;
    (0..n)
        .map(|_| {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
        })
        .collect()
}

const ORDERS: Orders = Orders {
    na: 0,
    nb: 2,
    nc: 0,
    nd: 0,
    nf: 2,
    nk: 3,
};
const SYSTEM: [f64; 4] = [-1.5, 0.7, 1.0, 0.5];

/// Returns the input and output of the system, which is not at rest when the record starts.
fn record() -> (Vec<f64>, Vec<f64>) {
    let x = white_noise(600);
    let mut u = vec![0.0; 600];
    fir(&SYSTEM[2..], 3, &x, &mut u);
    divide_in_place(&SYSTEM[..2], &mut u);
    (x[250..].to_vec(), u[250..].to_vec())
}

#[test]
fn noise_free_system_is_found_with_any_filter_and_instruments() {
    let (e, u) = record();
    let data = vec![Data::new(&e, &u), Data::new(&e[40..], &u[40..])];
    let problem = IvProblem::new(&ORDERS, data.clone(), Source::measured_inputs(&data));
    let (c, d, f) = ([0.4], [-0.8, 0.1], [-1.2, 0.5]);
    let filters = [
        Prefilter::default(),
        Prefilter {
            f: &f,
            ..Prefilter::default()
        },
        Prefilter { c: &c, d: &d, f: &f },
    ];
    for filter in filters {
        let equation = problem.equation(filter, &[-1.0, 0.3, 1.0, 1.0]);
        assert_eq!(
            equation.y.len(),
            problem.row_counts(filter.d.len()).iter().sum::<usize>()
        );
        for (found, truth) in problem.solve(&equation).unwrap().iter().zip(SYSTEM) {
            // The condition number of these regressors is about 1e2.
            assert!((found - truth).abs() < 1e-11, "{found} {truth}");
        }
        assert!(equation.residual(&SYSTEM).iter().all(|r| r.abs() < 1e-12));
    }
}

#[test]
fn each_source_affects_only_its_own_rows() {
    let (e, u) = record();
    let data = vec![Data::new(&e, &u), Data::new(&e[40..], &u[40..])];
    let doubled = |x: &[f64]| Cow::Owned(x.iter().map(|v| 2.0 * v).collect::<Vec<f64>>());
    let sources = vec![
        Source {
            inputs: vec![Cow::Borrowed(e.as_slice()), Cow::Borrowed(&e[40..])],
            samples: 0..400,
        },
        Source {
            inputs: vec![doubled(&e), doubled(&e[40..])],
            samples: 400..660,
        },
    ];
    let split = IvProblem::new(&ORDERS, data.clone(), sources);
    let plain = IvProblem::new(&ORDERS, data.clone(), Source::measured_inputs(&data));
    let d = [-0.5];
    let filter = Prefilter {
        d: &d,
        ..Prefilter::default()
    };
    let (a, b) = (split.equation(filter, &SYSTEM), plain.equation(filter, &SYSTEM));
    // The first record has 350 samples; sample 400 is number 50 of the second. The first row comes after 4 samples,
    // plus one for D.
    let change = (350 - 5) + (50 - 5);
    for (x, y) in a.z.iter().zip(&b.z) {
        assert_eq!(x[..change], y[..change]);
        for (x, y) in x[change..].iter().zip(&y[change..]) {
            assert!((x - 2.0 * y).abs() < 1e-12, "{x} {y}");
        }
    }
    assert_eq!(a.phi, b.phi);
}
