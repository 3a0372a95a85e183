//! Operators for the tests of the family.

use super::{Coordinate, FamilyOperator, Form};

/// Returns a typical operator of each form.
pub(super) fn operator(form: Form, neuromuscular: bool, tau_e_s: f64) -> FamilyOperator {
    let value = |coordinate: &Coordinate| match coordinate {
        Coordinate::Gain => 4.0,
        Coordinate::Lead => 0.6,
        Coordinate::LagRate => 0.2,
        Coordinate::Linear => 0.9,
        Coordinate::Quadratic => 0.3,
        Coordinate::Droop => 0.4,
        Coordinate::LogOmega => 11.0_f64.ln(),
        Coordinate::LogZeta => 0.25_f64.ln(),
        Coordinate::Delay => tau_e_s,
    };
    let values: Vec<f64> = form.coordinates(neuromuscular).iter().map(value).collect();
    FamilyOperator::new(form, neuromuscular, &values).unwrap()
}

/// Returns operators of all proper forms, with and without the neuromuscular part, each with every given delay.
pub(super) fn operators(delays_s: &[f64]) -> Vec<FamilyOperator> {
    let mut all = Vec::new();
    for form in Form::ALL {
        for neuromuscular in [true, false].into_iter().filter(|nm| form.is_proper(*nm)) {
            all.extend(delays_s.iter().map(|tau| operator(form, neuromuscular, *tau)));
        }
    }
    all
}
