//! Two methods in one, as the reference text proposes it (section VII): recursive least squares for the gains, with the neuromuscular coefficients
//! "adjusted based on recursive Box-Jenkins calculations".
//!
//! The prediction-error method with a forgetting matrix gives F and D; least squares has only B left to find,
//!
//! `F u = B q^-nk e + eps`,
//!
//! with the F of the sample, and forgets by the memory of b. The bias that coloured noise gives to the poles is gone, that of B is not: the
//! equation error `F n` is as coloured as in an ARX model.

use hoid_core::{
    delay::DelayLine,
    rls::Rls,
    shape::AnyShape,
    state::{State, visit_all},
};
use hoid_model::{Orders, SampleTime, Structure};

use crate::{
    gain::{self, Gain},
    kernel,
    options::{Method, TrackOptions},
    recursion::{Recursion, Sample, StepOutcome},
    start::StartState,
};
use hoid_ident::IdentError;

/// Coefficients of B.
const B: usize = 2;

/// RLS beside RPEM.
pub(crate) struct FusedRecursion {
    rpem: Box<dyn Recursion>,
    rls: Rls<AnyShape, B, Gain<B>>,
    delay: DelayLine<Vec<f64>>,
    /// The last two outputs, the newest first.
    past: [f64; 2],
    theta: Vec<f64>,
}

impl State for FusedRecursion {
    fn visit(&mut self, each: &mut dyn FnMut(&mut f64)) {
        let parts: &mut [&mut dyn State] = &mut [
            &mut *self.rpem,
            &mut self.rls,
            &mut self.delay,
            &mut self.past,
            &mut self.theta.as_mut_slice(),
        ];
        visit_all(parts, each);
    }
}

impl FusedRecursion {
    /// From the same start as the prediction-error method.
    ///
    /// # Errors
    /// As that.
    pub(crate) fn new(options: &TrackOptions, from: &StartState, sample_time: SampleTime) -> Result<Self, IdentError> {
        let rpem = TrackOptions {
            method: Method::Rpem,
            memory_of: named(options)?,
            ..options.clone()
        };
        let p = from.values.len();
        let of_b = |matrix: &[f64]| -> Vec<f64> { (0..B * B).map(|k| matrix[k / B * p + k % B]).collect() };
        let start = StartState {
            values: from.values[..B].to_vec(),
            covariance: of_b(&from.covariance),
            spread: of_b(&from.spread),
            fit: None,
            ..from.clone()
        };
        let mut memory_of = rpem.memory_of.clone();
        memory_of.retain(|name, _| name.starts_with('b'));
        let linear = TrackOptions {
            method: Method::Rls,
            structure: Structure::Fir,
            orders: Orders {
                nb: B,
                nk: options.orders.nk,
                ..Orders::default()
            },
            memory_of,
            ..options.clone()
        };
        let shape = AnyShape {
            na: 0,
            nb: B,
            nc: 0,
            nd: 0,
            nf: 0,
        };
        let gain = Gain::new(&linear, &start, sample_time)?;
        let bars = gain::error_bars(&linear, &start, sample_time)?;
        let values = [start.values[0], start.values[1]];
        let rls = Rls::new(shape, values, gain, bars).ok_or_else(|| IdentError::BadStart {
            reason: "it has no coefficients of B".to_owned(),
        })?;
        Ok(Self {
            rpem: kernel::build(&rpem, from, sample_time)?,
            rls,
            delay: DelayLine::new(vec![0.0; options.orders.nk]),
            past: [0.0; 2],
            theta: from.values.clone(),
        })
    }

    /// `F u` with the F of the prediction-error method.
    fn filtered(&self, u: f64) -> f64 {
        let theta = self.rpem.theta();
        let p = theta.len();
        u + theta[p - 2] * self.past[0] + theta[p - 1] * self.past[1]
    }

    fn join(&mut self) {
        self.theta.copy_from_slice(self.rpem.theta());
        self.theta[..B].copy_from_slice(&self.rls.theta()[..B]);
    }

    fn take(&mut self, u: f64) {
        self.past = [u, self.past[0]];
    }
}

/// The memories of all parameters by name: those of the fused method are not those of the prediction-error method.
fn named(options: &TrackOptions) -> Result<std::collections::BTreeMap<String, crate::Memory>, IdentError> {
    let names = options.parameter_names();
    Ok(names.into_iter().zip(options.memories()?).collect())
}

impl Recursion for FusedRecursion {
    fn step(&mut self, sample: Sample) -> StepOutcome {
        let x = self.delay.step(sample.e);
        let of_rpem = self.rpem.step(sample);
        let y = self.filtered(sample.u);
        let of_rls: StepOutcome = self.rls.step(x, y).into();
        self.take(sample.u);
        self.join();
        StepOutcome {
            innovation: of_rls.innovation,
            shortened: of_rpem.shortened,
        }
    }

    fn follow(&mut self, sample: Sample) -> StepOutcome {
        let x = self.delay.step(sample.e);
        self.rpem.follow(sample);
        let y = self.filtered(sample.u);
        let taken = self.rls.step_without_update(x, y).into();
        self.take(sample.u);
        taken
    }

    fn bridge(&mut self, sample: Sample) {
        let x = self.delay.step(sample.e);
        self.rpem.bridge(sample);
        // eps of an output of zero is the prediction with its sign changed.
        let y = self.filtered(0.0);
        let predicted = -self.rls.step_without_update(x, y).innovation;
        self.take(crate::past::bounded(predicted));
    }

    fn theta(&self) -> &[f64] {
        &self.theta
    }

    /// That of each method; between them nothing is known, and zero is put.
    fn covariance(&self, into: &mut [f64]) -> bool {
        let known = self.rpem.covariance(into);
        let p = self.theta.len();
        let (spread, variance) = (self.rls.normalised_covariance(), self.rls.innovation_variance());
        for i in 0..p {
            for j in 0..p {
                if i < B && j < B {
                    into[i * p + j] = variance * spread[i][j];
                } else if i < B || j < B {
                    into[i * p + j] = 0.0;
                }
            }
        }
        known
    }

    fn innovation_variance(&self) -> f64 {
        self.rls.innovation_variance()
    }
}
