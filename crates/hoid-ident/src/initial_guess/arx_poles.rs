//! Poles by linear least squares: from an ARX model, from a high-order ARX model, and from the Steiglitz-McBride
//! iteration.

use hoid_core::{
    filter::{divide_in_place, fir},
    stability::MAX_ORDER,
};
use hoid_model::{Orders, polynomial::reflect_roots_inside};

use crate::criterion::{Criterion, Data, InitialState, Workspace, first_residual};

/// Number of Steiglitz-McBride steps.
const STEIGLITZ_MCBRIDE_STEPS: usize = 4;

/// Returns A of an ARX fit that has as many poles as F; unstable poles are reflected into the unit circle.
pub(crate) fn arx_poles(criterion: &Criterion<'_>, data: &[Data<'_>], workspace: &mut Workspace) -> Option<Vec<f64>> {
    let orders = Orders {
        na: criterion.orders.nf,
        nb: criterion.orders.nb,
        nk: criterion.orders.nk,
        ..Orders::default()
    };
    let equation_error = Criterion {
        orders,
        data: data.to_vec(),
        initial: InitialState::Estimate,
        first: criterion.first.max(first_residual(&orders, InitialState::Estimate)),
        weights: None,
        further: Vec::new(),
    };
    if data.iter().any(|d| d.u.len() <= equation_error.first) {
        return None;
    }
    let (theta, _) = equation_error.best_linear_part(&vec![0.0; orders.parameter_count()], workspace)?;
    reflect_roots_inside(&theta[..orders.na])
}

/// Returns F fitted to the noise-free response of a high-order ARX model.
pub(crate) fn reduced_arx(criterion: &Criterion<'_>, workspace: &mut Workspace) -> Option<Vec<f64>> {
    let o = criterion.orders;
    let orders = Orders {
        na: (o.nf + EXTRA_ARX_ORDER).min(MAX_ORDER),
        nb: (o.nb + EXTRA_ARX_ORDER).min(MAX_ORDER),
        nk: o.nk,
        ..Orders::default()
    };
    let high = Criterion {
        orders,
        initial: InitialState::Estimate,
        first: criterion.first.max(first_residual(&orders, InitialState::Estimate)),
        ..criterion.clone()
    };
    if high
        .data
        .iter()
        .any(|d| d.u.len() <= high.first + orders.parameter_count())
    {
        return None;
    }
    let (theta, _) = high.best_linear_part(&vec![0.0; orders.parameter_count()], workspace)?;
    let a = reflect_roots_inside(&theta[..orders.na])?;
    let responses: Vec<Vec<f64>> = high
        .data
        .iter()
        .map(|d| {
            let mut w = vec![0.0; d.u.len()];
            fir(&theta[orders.na..], o.nk, d.e, &mut w);
            divide_in_place(&a, &mut w);
            w
        })
        .collect();
    let clean = Criterion {
        data: high
            .data
            .iter()
            .zip(&responses)
            .map(|(d, w)| Data::new(d.e, w))
            .collect(),
        ..criterion.clone()
    };
    let f = arx_poles(&clean, &clean.data, workspace)?;
    steiglitz_mcbride(&clean, f, workspace)
}

/// Number of additional coefficients of the high-order ARX model in A and in B.
const EXTRA_ARX_ORDER: usize = 8;

pub(crate) fn steiglitz_mcbride(
    criterion: &Criterion<'_>,
    mut f: Vec<f64>,
    workspace: &mut Workspace,
) -> Option<Vec<f64>> {
    let mut filtered: Vec<(Vec<f64>, Vec<f64>)> = criterion.data.iter().map(|d| (d.e.to_vec(), d.u.to_vec())).collect();
    for _ in 0..STEIGLITZ_MCBRIDE_STEPS {
        for ((e, u), d) in filtered.iter_mut().zip(&criterion.data) {
            e.copy_from_slice(d.e);
            u.copy_from_slice(d.u);
            divide_in_place(&f, e);
            divide_in_place(&f, u);
        }
        let data: Vec<Data<'_>> = filtered.iter().map(|(e, u)| Data::new(e, u)).collect();
        f = arx_poles(criterion, &data, workspace)?;
    }
    Some(f)
}
