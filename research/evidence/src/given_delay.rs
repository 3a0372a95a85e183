//! Methods with a given delay, for the examples that compare them.

use hoid_track::{Method, StartSource, TrackOptions};

use crate::task::START_S;

/// Delay nk of the operator of the thesis, samples.
const NK: usize = 29;

/// Options of a method with a given delay and a start fit to the first 30.72 s.
pub fn options(method: Method) -> TrackOptions {
    TrackOptions {
        start: StartSource::Span(Some((0.0, START_S))),
        ..TrackOptions::new(method.clone(), method.default_structure(), method.default_orders(NK))
    }
}

/// Options of RLS or RPEM with the settings of the thesis.
pub fn thesis_settings(method: Method) -> TrackOptions {
    let mut settings = vec![("memory", "256"), ("covariance", "0.1"), ("limit", "inf")];
    settings.extend((method != Method::rls()).then_some(("stable", "noise")));
    options(method.clone()).with(&settings).unwrap()
}
