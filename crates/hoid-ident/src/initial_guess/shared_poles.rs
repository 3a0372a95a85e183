//! Starts for models with A and a noise model, or with A and F: assignment of the poles.
//!
//! A belongs to the system and to the noise, F only to the system, and D only to the noise. The loss has minima for
//! many wrong assignments of the poles: ARARX with a1 = -0.65, a2 = 0.11, d1 = -0.93, started from least squares, ends
//! with a loss that is 40 % too high and with the pole of D in A. The poles are therefore taken from fits that do not
//! depend on the assignment, and every assignment is a start:
//!
//! - the poles of the system, A F, come from instrumental variables, which in an open loop are not biased by coloured
//!   noise ([`crate::iv`]): any na of these poles are assigned to A, the others to F, and the noise model follows from
//!   the residual;
//! - all poles, A D F, come from an ARX model with nd additional coefficients in A and in B, which equals ARARX if the
//!   common factor is not cancelled: any nd of the poles are assigned to D, any nf of the others to F, and A and B
//!   follow by least squares.
//!
//! A few steps of the search from each start show which starts decrease the loss.

use hoid_model::{Complex64, Orders, polynomial, polynomial_model::monic};

use crate::{
    criterion::{Criterion, Workspace},
    initial_guess::{arx_poles::arx_poles, instrument_chain::instrument_chain},
    multistart::Start,
    noise_model::noise_model,
    optimize::{SearchOptions, minimise},
};

/// Number of starts with the smallest loss from which search steps are made.
const TRIED_START_COUNT: usize = 8;
/// Number of search steps from each start that is tried.
const STEP_COUNT: usize = 8;
/// Largest number of real poles and pole pairs that are assigned in all ways.
const MAX_GROUPS: usize = 6;

/// True if the model has A together with other polynomials that could contain its poles.
pub(crate) fn may_share_poles(o: &Orders) -> bool {
    o.na > 0 && o.nb > 0 && o.nc + o.nd + o.nf > 0
}

/// Makes a few search steps from the best starts with assigned poles and from the best of `others`, and returns the
/// results with their sums of squares.
pub(crate) fn initial_guesses(criterion: &Criterion<'_>, others: Vec<Start>, workspace: &mut Workspace) -> Vec<Start> {
    let mut starts = others;
    starts.extend(starts_from_instruments(criterion, workspace));
    starts.extend(starts_from_long_arx(criterion, workspace));
    starts.sort_by(|a, b| a.value.total_cmp(&b.value));
    let options = SearchOptions {
        max_iterations: STEP_COUNT,
        ..SearchOptions::default()
    };
    starts
        .into_iter()
        .take(TRIED_START_COUNT)
        .filter_map(|start| {
            let end = minimise(criterion, start.theta, &options, None, workspace)?;
            Some(Start::complete(
                &start.label,
                end.theta,
                end.linearisation.sum_of_squares,
            ))
        })
        .collect()
}

fn starts_from_instruments(criterion: &Criterion<'_>, workspace: &mut Workspace) -> Vec<Start> {
    let o = criterion.orders;
    let pooled = Criterion {
        orders: Orders {
            na: 0,
            nf: o.na + o.nf,
            ..o
        },
        ..criterion.clone()
    };
    let Some(system) = instrument_chain(&pooled) else {
        return Vec::new();
    };
    let (b, f) = (&system[..o.nb], &system[system.len() - pooled.orders.nf..]);
    let Some(poles) = polynomial::roots(&monic(f)) else {
        return Vec::new();
    };
    pole_assignments(&poles, o.na)
        .into_iter()
        .filter_map(|(a, f)| {
            let linear = [&polynomial_coefficients(&a), b].concat();
            build_start(
                "instruments",
                criterion,
                linear,
                &polynomial_coefficients(&f),
                workspace,
            )
        })
        .collect()
}

fn starts_from_long_arx(criterion: &Criterion<'_>, workspace: &mut Workspace) -> Vec<Start> {
    let o = criterion.orders;
    if o.nd == 0 {
        return Vec::new();
    }
    let long = Criterion {
        orders: Orders {
            nf: o.na + o.nd + o.nf,
            nb: o.nb + o.nd,
            ..o
        },
        ..criterion.clone()
    };
    let Some(poles) = arx_poles(&long, &criterion.data, workspace).and_then(|a| polynomial::roots(&monic(&a))) else {
        return Vec::new();
    };
    let coloured = Criterion {
        orders: Orders { nc: 0, ..o },
        ..criterion.clone()
    };
    let mut starts = Vec::new();
    for (d, rest) in pole_assignments(&poles, o.nd) {
        for (f, _) in pole_assignments(&rest, o.nf) {
            let f = polynomial_coefficients(&f);
            let whitening = [&vec![0.0; o.na + o.nb], &polynomial_coefficients(&d)[..], &f].concat();
            let solved = coloured.best_linear_part(&whitening, workspace);
            starts.extend(solved.and_then(|(linear, _)| build_start("long arx", criterion, linear, &f, workspace)));
        }
    }
    starts
}

/// Returns a start for given A, B and F. The noise model is estimated from the residual, and A and B are then estimated
/// again with this noise model.
fn build_start(
    label: &str,
    criterion: &Criterion<'_>,
    linear: Vec<f64>,
    f: &[f64],
    workspace: &mut Workspace,
) -> Option<Start> {
    let o = criterion.orders;
    let white = Criterion {
        orders: Orders { nc: 0, nd: 0, ..o },
        ..criterion.clone()
    };
    let system = [&linear, f].concat();
    let left: Vec<Vec<f64>> = (0..white.data.len())
        .map(|record| white.residuals_of(&system, record, workspace))
        .collect();
    let (c, d) = noise_model(&left, o.nc, o.nd);
    let mut theta = [&linear, &c[..], &d, f].concat();
    let (linear, value) = criterion.best_linear_part(&theta, workspace)?;
    theta[..o.na + o.nb].copy_from_slice(&linear);
    Some(Start::complete(label, theta, value))
}

fn polynomial_coefficients(roots: &[Complex64]) -> Vec<f64> {
    polynomial::from_roots(roots)[1..].to_vec()
}

/// Returns all ways to choose `count` of these poles, as pairs of the chosen and the remaining poles; conjugate poles
/// stay together.
fn pole_assignments(poles: &[Complex64], count: usize) -> Vec<(Vec<Complex64>, Vec<Complex64>)> {
    let mut groups: Vec<&[Complex64]> = Vec::new();
    let mut left = poles;
    while !left.is_empty() {
        let (group, others) = left.split_at(if left[0].im == 0.0 { 1 } else { 2.min(left.len()) });
        groups.push(group);
        left = others;
    }
    (0..1_usize << groups.len().min(MAX_GROUPS))
        .filter_map(|choice| {
            let (mut chosen, mut rest) = (Vec::new(), Vec::new());
            for (i, group) in groups.iter().enumerate() {
                if choice >> i & 1 == 1 { &mut chosen } else { &mut rest }.extend_from_slice(group);
            }
            (chosen.len() == count).then_some((chosen, rest))
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_pole_assignments_keep_conjugate_pairs_together() {
        let pair = [Complex64::new(0.5, 0.3), Complex64::new(0.5, -0.3)];
        let poles = [pair[0], pair[1], Complex64::new(0.9, 0.0), Complex64::new(-0.2, 0.0)];
        let chosen: Vec<Vec<Complex64>> = pole_assignments(&poles, 2)
            .into_iter()
            .map(|(chosen, _)| chosen)
            .collect();
        assert_eq!(chosen, [pair.to_vec(), poles[2..].to_vec()]);
        assert_eq!(pole_assignments(&poles, 1).len(), 2);
        assert_eq!(pole_assignments(&poles, 0), [(vec![], poles.to_vec())]);
        assert!(pole_assignments(&pair, 1).is_empty());
        assert_eq!(polynomial_coefficients(&pair).len(), 2);
        assert!(polynomial_coefficients(&[]).is_empty());
    }
}
