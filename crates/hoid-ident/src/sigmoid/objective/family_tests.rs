//! The criterion of all forms of the family.

use hoid_model::Form;

use super::{tests::record, *};

/// Returns a change of a plausible size for each form, with no parameter at a special value.
fn theta(layout: &Layout) -> Vec<f64> {
    let mut theta = vec![0.0; layout.len()];
    for (i, [first, last]) in [[0.09, 0.07], [0.4, 0.9], [0.15, 0.3]]
        .into_iter()
        .enumerate()
        .take(layout.varying)
    {
        let [a, b] = Layout::end_indices(i);
        (theta[a], theta[b]) = (first, last);
    }
    (theta[layout.midpoint], theta[layout.log_rate]) = (3.1, f64::ln(2.0));
    if let Some(position) = layout.lag {
        theta[position] = 0.4;
    }
    if let Some([omega, zeta]) = layout.neuromuscular_indices {
        (theta[omega], theta[zeta]) = (11.25, 0.35);
    }
    theta[layout.delay] = 0.1234;
    if layout.nd > 0 {
        theta[layout.noise] = -0.8;
    }
    theta
}

fn criterion<'a>(layout: Layout, e: &'a [f64], u: &'a [f64]) -> ChangeCriterion<'a> {
    ChangeCriterion {
        layout,
        data: vec![Data { e, u, start_s: -0.3 }],
        sample_time: SampleTime::AT_100_HZ,
        first: 20 + layout.nd,
        limits: vec![(f64::NEG_INFINITY, f64::INFINITY); layout.len()],
        piece: None,
        changes: true,
        weights: None,
        penalty: Vec::new(),
        level: false,
    }
}

fn all_layouts() -> impl Iterator<Item = Layout> {
    let pairs = Form::ALL.into_iter().flat_map(|form| [(form, true), (form, false)]);
    pairs
        .filter(|(form, neuromuscular)| form.is_proper(*neuromuscular))
        .map(|(form, neuromuscular)| Layout::new(form, neuromuscular, 1))
}

#[test]
fn gradient_agrees_with_finite_differences() {
    let (e, u) = record(700);
    for layout in all_layouts() {
        let mut c = criterion(layout, &e, &u);
        let theta = theta(&layout);
        // The criterion includes a prior.
        c.penalty = vec![Penalty {
            index: layout.delay,
            logarithmic: true,
            mean: -1.5,
            precision: 30.0,
            variance: 0.01,
        }];
        let mut ws = Workspace::default();
        let exact = c.linearise(&theta, &mut ws);
        for i in 0..theta.len() {
            // The lag of the canals, 5.9 s, increases the rounding error further by the factor 1/|F(1)|; a larger step
            // reduces its effect.
            let step = if matches!(layout.form, Form::Canals | Form::CanalsRate) {
                3e-3
            } else {
                1e-3
            };
            let h = step * theta[i].abs();
            let mut at = |factor: f64| {
                let mut moved = theta.clone();
                moved[i] += factor * h;
                c.linearise(&moved, &mut ws).sum_of_squares
            };
            let slope = (8.0 * (at(1.0) - at(-1.0)) - (at(2.0) - at(-2.0))) / (12.0 * h);
            let scale = (exact.gram[i * theta.len() + i] * exact.sum_of_squares).sqrt();
            // The difference has the rounding error of the loss divided by h, and a truncation error of order h^4. The
            // recursion with three poles near one amplifies rounding errors by 1/|F(1)|, here 1e5, to 1e-11 of the
            // loss.
            assert!(
                (slope + 2.0 * exact.descent[i]).abs() < 1e-7 * scale,
                "{layout:?} parameter {i}: {slope} and {}",
                -2.0 * exact.descent[i]
            );
        }
    }
}

#[test]
fn initial_state_of_noise_free_data_is_fitted_exactly() {
    let (e, _) = record(1500);
    for layout in all_layouts() {
        let layout = Layout { nd: 0, ..layout };
        let theta = &theta(&layout)[..layout.len()];
        let unit = UnitOperator::of(&layout, theta, None, SampleTime::AT_100_HZ).unwrap();
        let y: Vec<Vec<f64>> = (0..unit.b.len()).map(|i| unit.response(i, &e)).collect();
        let at = |t: usize| {
            if t < unit.nk {
                return 0.0;
            }
            let g = SigmoidPoint::at(&layout, theta, -0.3 + 0.01 * t as f64 - theta[layout.delay]);
            (0..y.len()).map(|i| g.numerator(i) * y[i][t - unit.nk]).sum()
        };
        let u: Vec<f64> = (0..1500).map(at).collect();
        let size = u.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
        let mut cut = criterion(layout, &e[300..], &u[300..]);
        cut.data[0].start_s = -0.3 + 3.0;
        let eps = cut.pass(theta, 0).unwrap().eps;
        let largest = eps.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
        // Three states are determined by three errors one sample apart: the condition number is 1e5.
        assert!(largest < 1e-10 * size, "{layout:?}: {largest:e} of {size}");
    }
}

#[test]
fn only_the_first_state_is_used_without_a_change() {
    let (e, u) = record(600);
    for layout in all_layouts() {
        let mut c = ChangeCriterion {
            changes: false,
            ..criterion(layout, &e, &u)
        };
        let prior = |position: usize| Penalty {
            index: position,
            logarithmic: true,
            mean: 0.0,
            precision: 1.0,
            variance: 1.0,
        };
        c.penalty = vec![prior(0), prior(1)];
        let at = c.linearise(&theta(&layout), &mut Workspace::default());
        let mut other = theta(&layout);
        for position in layout.change_indices() {
            other[position] *= 1.3;
        }
        let there = c.linearise(&other, &mut Workspace::default());
        assert_eq!(at.sum_of_squares, there.sum_of_squares, "{layout:?}");
        assert!(layout.change_indices().iter().all(|&i| at.descent[i] == 0.0));
    }
}
