//! Fits of models for simulation.
//!
//! The system `B/(A F)` is first fitted by the output-error criterion, i.e. by its simulation error. Then C and D are
//! fitted by the prediction error, with this system fixed.
//!
//! **Covariance.** The simulation error `v = H eps` with `H = C/(A D)` is not white. Let psi be the gradient of the
//! simulation error (initial states projected out). To first order, the covariance of the system estimate is
//! `(psi' psi)^-1 psi' (sigma^2 H H') psi (psi' psi)^-1` (L. Ljung, *System Identification*, 1999, section 9.4), where
//! `H' psi` is computed with the filter H run backwards in time. This is valid in an open loop; in a closed loop the
//! input is correlated with the noise, and the system is also biased. C and D have the covariance of their own search;
//! their correlation with the system is not taken into account.

use std::collections::BTreeMap;

use hoid_core::filter::divide_in_place;
use hoid_model::{Orders, PolynomialModel, Record, Structure, polynomial::product, polynomial_model::monic};

use crate::{
    Constraint, Fit, IdentError,
    criterion::{Criterion, Data, Workspace, first_residual},
    linalg::information::inverse_information,
    linalg::vectors::dot,
    pem::fit_settings::FitSettings,
    pem::prediction_focus,
};

/// Fits a structure by the simulation error of its system; `settings` are the settings of this structure.
///
/// # Errors
/// [`IdentError`] if one of the two fits fails.
pub(crate) fn fit(settings: &FitSettings, records: &[Record], first: usize) -> Result<Fit, IdentError> {
    let o = settings.orders;
    let of_system = FitSettings {
        structure: Structure::OutputError,
        orders: Orders {
            nb: o.nb,
            nf: o.na + o.nf,
            nk: o.nk,
            ..Orders::default()
        },
        start: None,
        constraints: rename_a_to_f(&settings.constraints),
        priors: rename_a_to_f(&settings.priors),
        stable: false,
        ..settings.clone()
    };
    let simulated = prediction_focus::fit(&of_system, records, first)?;
    let held = fixed_coefficients(simulated.model(), &o);
    let of_noise = FitSettings {
        start: None,
        constraints: noise_model_entries(&settings.constraints).chain(held).collect(),
        priors: noise_model_entries(&settings.priors).collect(),
        ..settings.clone()
    };
    let fit = prediction_focus::fit(&of_noise, records, first)?;
    let covariance = covariance(&simulated, &fit, records, first)?;
    let start = simulated.start().to_owned();
    let mut iterations = fit.termination();
    iterations.iterations += simulated.termination().iterations;
    if !simulated.termination().converged() {
        iterations.reason = simulated.termination().reason;
    }
    let of_noise = |i: usize| i >= o.na + o.nb && i < o.na + o.nb + o.nc + o.nd;
    let fixed = fit
        .is_fixed_or_bounded
        .iter()
        .enumerate()
        .map(|(i, held)| of_noise(i) && *held)
        .collect();
    Ok(Fit {
        covariance,
        is_fixed_or_bounded: fixed,
        start,
        termination: iterations,
        states: simulated.state_count().max(fit.state_count()),
        ..fit
    })
}

/// Renames the coefficients of A to coefficients of F, which contains these poles in the simulation, and omits C and D.
fn rename_a_to_f<T: Copy>(named: &BTreeMap<String, T>) -> BTreeMap<String, T> {
    named
        .iter()
        .filter(|(name, _)| !name.starts_with(['c', 'd']))
        .map(|(name, value)| (name.replace('a', "f"), *value))
        .collect()
}

/// Returns the entries for coefficients of C and D.
fn noise_model_entries<T: Copy>(named: &BTreeMap<String, T>) -> impl Iterator<Item = (String, T)> {
    let of_noise = named.iter().filter(|(name, _)| name.starts_with(['c', 'd']));
    of_noise.map(|(name, value)| (name.clone(), *value))
}

/// Returns constraints that fix the coefficients of the system at their values.
fn fixed_coefficients(system: &PolynomialModel, orders: &Orders) -> Vec<(String, Constraint)> {
    let pole = if orders.na > 0 { 'a' } else { 'f' };
    let poles = (1..).zip(system.f()).map(|(i, f)| (format!("{pole}{i}"), *f));
    let gains = (0..).zip(system.b()).map(|(i, b)| (format!("b{i}"), *b));
    poles
        .chain(gains)
        .map(|(name, value)| (name, Constraint::Fixed(value)))
        .collect()
}

/// Returns the covariance of theta; `None` if the noise model is not stable or there is no noise.
fn covariance(simulated: &Fit, fit: &Fit, records: &[Record], first: usize) -> Result<Option<Vec<f64>>, IdentError> {
    let (Some(_), Some(of_noise)) = (&simulated.covariance, &fit.covariance) else {
        return Ok(None);
    };
    let model = fit.model();
    let poles = product(&monic(model.a()), &monic(model.d()));
    if !hoid_core::stability::roots_inside(&poles[1..], 1.0) {
        return Ok(None);
    }
    let orders = simulated.orders();
    let criterion = Criterion {
        orders,
        data: Data::of(records),
        initial: simulated.initial_state(),
        first: first.max(first_residual(&orders, simulated.initial_state())),
        weights: None,
        further: Vec::new(),
    };
    let theta = simulated.model().theta();
    let q = theta.len();
    let (mut gram, mut coloured) = (vec![0.0; q * q], vec![0.0; q * q]);
    let mut workspace = Workspace::borrow_from_thread();
    for record in 0..records.len() {
        let psi = criterion.jacobian(theta, record, &mut workspace);
        let filtered: Vec<Vec<f64>> = psi
            .iter()
            .map(|x| filter_backwards(model.c(), &poles[1..], x))
            .collect();
        for i in 0..q {
            for j in 0..q {
                gram[i * q + j] += dot(&psi[i], &psi[j]);
                coloured[i * q + j] += dot(&filtered[i], &filtered[j]);
            }
        }
    }
    let inverse = inverse_information(&gram, &orders.parameter_names())?;
    let times = |a: &[f64], b: &[f64]| -> Vec<f64> {
        (0..q * q)
            .map(|k| (0..q).map(|l| a[(k / q) * q + l] * b[l * q + k % q]).sum())
            .collect()
    };
    let sandwich = times(&times(&inverse, &coloured), &inverse);
    // theta of the simulation is [b, f]; theta of the structure is [a, b, c, d, f].
    let o = fit.orders();
    let p = o.parameter_count();
    let pole_at = if o.na > 0 { 0 } else { p - o.nf };
    let place = |i: usize| if i < o.nb { o.na + i } else { pole_at + i - o.nb };
    let mut covariance = of_noise.clone();
    for i in 0..q {
        for j in 0..q {
            covariance[place(i) * p + place(j)] = fit.innovation_variance() * sandwich[i * q + j];
        }
    }
    Ok(Some(covariance))
}

/// Applies `(C/D)` to x backwards in time.
fn filter_backwards(c: &[f64], d: &[f64], x: &[f64]) -> Vec<f64> {
    let mut reversed: Vec<f64> = x.iter().rev().copied().collect();
    divide_in_place(d, &mut reversed);
    let mut y = reversed.clone();
    for (i, ci) in c.iter().enumerate() {
        for t in i + 1..y.len() {
            y[t] += ci * reversed[t - i - 1];
        }
    }
    y.reverse();
    y
}
