//! A start for the prediction error method from a chain of instrumental variable estimates (L. Ljung, *System
//! Identification*, 1999, section 10.6): ARX by least squares, instruments simulated with this model, the IV estimate,
//! new instruments and a second IV estimate, a long autoregression of its residual, and C and D by regression on past
//! residuals and past innovations.
//!
//! In an open loop the chain is consistent for any noise. In a closed loop it is biased to the extent that the input
//! follows the noise, which is little if the loop has a delay longer than the correlation time of the noise. The chain
//! takes about ten passes over the data.

use hoid_model::Orders;

use crate::{
    InitialState,
    criterion::{Criterion, Workspace, first_residual},
    iv::equation::{IvProblem, Prefilter, Source},
    noise_model::noise_model,
    optimize::Objective,
};

/// Returns theta for the orders of the criterion. `None` if the model has both A and F (the chain does not distinguish
/// their poles) or no input, or if the data are not sufficient.
pub(crate) fn instrument_chain(criterion: &Criterion<'_>) -> Option<Vec<f64>> {
    let o = criterion.orders;
    if o.nb == 0 || (o.na > 0 && o.nf > 0) {
        return None;
    }
    let problem = IvProblem::new(&o, criterion.data.clone(), Source::measured_inputs(&criterion.data));
    let white_orders = Orders { nc: 0, nd: 0, ..o };
    let white = Criterion {
        orders: white_orders,
        initial: InitialState::Estimate,
        first: first_residual(&white_orders, InitialState::Estimate).max(problem.first),
        weights: None,
        ..criterion.clone()
    };
    let needed = white.first + 2 * o.parameter_count();
    if criterion.data.iter().any(|d| d.u.len() <= needed) {
        return None;
    }
    let mut system = problem.least_squares(Prefilter::default()).ok()?;
    for _ in 0..2 {
        let (stable, _) = problem.stabilise(&system).ok()?;
        let equation = problem.equation(Prefilter::default(), &stable);
        system = problem.solve(&equation).ok()?;
    }
    if o.nf > 0 {
        (system, _) = problem.stabilise(&system).ok()?;
    }
    let (poles, b) = system.split_at(problem.poles);
    let (a, f) = if o.na > 0 { (poles, &[][..]) } else { (&[][..], poles) };
    let mut workspace = Workspace::borrow_from_thread();
    let left: Vec<Vec<f64>> = (0..white.data.len())
        .map(|record| white.residuals_of(&[a, b, f].concat(), record, &mut workspace))
        .collect();
    let (c, d) = noise_model(&left, o.nc, o.nd);
    let theta = [a, b, &c, &d, f].concat();
    criterion.is_feasible(&theta).then_some(theta)
}

#[cfg(test)]
mod tests {
    use hoid_core::filter::{divide_in_place, fir, multiply};

    use super::*;
    use crate::criterion::Data;

    /// Zero-mean numbers of a linear congruential generator (D. E. Knuth, MMIX).
    fn white_noise(n: usize, mut state: u64) -> Vec<f64> {
        (0..n)
            .map(|_| {
                state = state
                    .wrapping_mul(6_364_136_223_846_793_005)
                    .wrapping_add(1_442_695_040_888_963_407);
                (state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
            })
            .collect()
    }

    fn chain(orders: Orders, data: Data<'_>) -> Option<Vec<f64>> {
        instrument_chain(&Criterion {
            orders,
            data: vec![data],
            initial: InitialState::Estimate,
            first: first_residual(&orders, InitialState::Estimate),
            weights: None,
            further: Vec::new(),
        })
    }

    #[test]
    fn chain_approximates_box_jenkins_and_armax_models() {
        let n = 20_000;
        let (e, eps) = (white_noise(n, 1), white_noise(n, 2));
        let (b, f, c, d) = ([1.0, 0.5], [-1.5, 0.7], [0.5], [-0.8]);
        let mut w = vec![0.0; n];
        fir(&b, 2, &e, &mut w);
        let mut v = vec![0.0; n];
        multiply(&c, &eps, &mut v);
        let armax: Vec<f64> = {
            let mut u: Vec<f64> = w.iter().zip(&v).map(|(w, v)| w + v).collect();
            divide_in_place(&f, &mut u);
            u
        };
        divide_in_place(&f, &mut w);
        divide_in_place(&d, &mut v);
        let bj: Vec<f64> = w.iter().zip(&v).map(|(w, v)| w + v).collect();
        let base = Orders {
            nb: 2,
            nc: 1,
            nk: 2,
            ..Orders::default()
        };
        let cases = [
            (Orders { nd: 1, nf: 2, ..base }, bj, [&b[..], &c, &d, &f].concat()),
            (Orders { na: 2, ..base }, armax, [&f[..], &b, &c].concat()),
        ];
        for (orders, u, truth) in cases {
            let theta = chain(orders, Data::new(&e, &u)).unwrap();
            for (found, truth) in theta.iter().zip(truth) {
                // With 20 000 samples and suboptimal instruments, the errors of these coefficients are 2 %.
                assert!((found - truth).abs() < 0.08, "{orders}: {found} {truth}");
            }
        }
    }

    #[test]
    fn unsuitable_orders_and_signals_give_no_start() {
        let (e, u) = (white_noise(50, 1), white_noise(50, 2));
        let base = Orders {
            nb: 1,
            nd: 1,
            nf: 1,
            nk: 1,
            ..Orders::default()
        };
        assert!(chain(base, Data::new(&e, &u)).is_some());
        assert!(chain(Orders { na: 1, ..base }, Data::new(&e, &u)).is_none());
        assert!(chain(Orders { nk: 60, ..base }, Data::new(&e, &u)).is_none());
        let still = vec![0.0; 50];
        assert!(chain(base, Data::new(&still, &u)).is_none());
        let output_alone = Orders {
            na: 2,
            ..Orders::default()
        };
        assert!(chain(output_alone, Data::new(&[], &u)).is_none());
    }
}
