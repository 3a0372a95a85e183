//! Combination of two methods, as the thesis proposes (section VII): recursive least squares for the gains, with the
//! neuromuscular coefficients "adjusted based on recursive Box-Jenkins calculations".
//!
//! The prediction-error method with a forgetting matrix gives F and D. Least squares estimates only B in
//!
//! `F u = B q^-nk e + eps`,
//!
//! with the current F, and forgets with the memory length of b. This combination removes the bias that coloured noise
//! causes in the poles, but not the bias in B: the equation error `F n` is as coloured as in an ARX model.

use hoid_core::{
    delay::DelayLine,
    predictor::Regressor,
    recursion::StablePolynomials,
    rls::Rls,
    shape::AnyShape,
    state::{State, visit_all},
};
use hoid_model::{Orders, SampleTime, Structure};

use hoid_ident::{IdentError, settings, settings::Bounds};

use hoid_track::{
    Memory, MemoryOptions, Sample, StabilityOptions,
    building::{
        DEFAULT_LIMIT, Gain, Kernel, MethodDescription, Plan, Recursion, RecursiveMethod, ScaleCovariance, Setup,
        StartState, StepOutcome, check_operator_orders, error_bars, limit_magnitude,
    },
};

/// Number of coefficients of B.
const B: usize = 2;

settings! {
    /// Options of least squares with the poles of the prediction-error method.
    pub struct FusedOptions {
        /// Initial covariance P: X times the unit matrix, in units of the innovation variance (thesis: 0.1)
        #[setting(bounds(Bounds::PositiveFinite), default("from the start fit, else 1e6"))]
        pub covariance: Option<f64> = None,
        /// Limit on innovations, in standard deviations
        #[setting(bounds(Bounds::Positive), default("5"))]
        pub limit: Option<f64> = None,
    }
    groups {
        /// Memory lengths of the parameters.
        pub memories: MemoryOptions,
        /// Polynomials that are kept stable.
        pub stability: StabilityOptions,
    }
}

impl RecursiveMethod for FusedOptions {
    fn description(&self) -> MethodDescription {
        MethodDescription {
            name: "fused",
            help: "least squares for B with the poles of rpem, for comparison",
            source: "the thesis, section VII",
            structures: &[Structure::BoxJenkins, Structure::OutputError, Structure::General],
            defaults: &[("memory", "2.56s for b, inf for the others")],
        }
    }

    fn default_memory(&self, parameter: &str) -> Memory {
        if parameter.starts_with('b') {
            Memory::Seconds(2.56)
        } else {
            Memory::Infinite
        }
    }

    fn check(&self, setup: &Setup) -> Result<(), IdentError> {
        check_operator_orders("fused", setup)
    }

    fn build(
        &self,
        setup: &Setup,
        from: &StartState,
        sample_time: SampleTime,
    ) -> Result<Box<dyn Recursion>, IdentError> {
        Ok(Box::new(FusedRecursion::new(
            setup,
            self.limit.unwrap_or(f64::INFINITY),
            from,
            sample_time,
        )?))
    }

    fn memories(&self) -> Option<&MemoryOptions> {
        Some(&self.memories)
    }

    fn initial_covariance(&self) -> Option<f64> {
        self.covariance
    }

    fn innovation_limit(&self) -> f64 {
        self.limit.unwrap_or(DEFAULT_LIMIT)
    }

    fn stable(&self) -> StablePolynomials {
        self.stability.stable
    }

    fn retain(&mut self, known: &dyn Fn(&str) -> bool) {
        self.memories.memory_of.retain(|key, _| known(key));
    }
}

/// Recursive least squares in parallel with the recursive prediction-error method.
pub(crate) struct FusedRecursion {
    rpem: Box<dyn Recursion>,
    rls: Rls<AnyShape, B, Gain<B>>,
    delay: DelayLine<Vec<f64>>,
    /// The last two values of u, with the newest first.
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
    /// Starts both methods from the same estimate. `limit_of_b` limits the innovations of least squares.
    ///
    /// # Errors
    /// [`IdentError`] if least squares or the prediction-error method cannot be built from this start.
    pub(crate) fn new(
        setup: &Setup,
        limit_of_b: f64,
        from: &StartState,
        sample_time: SampleTime,
    ) -> Result<Self, IdentError> {
        let p = from.values.len();
        let of_b = |matrix: &[f64]| -> Vec<f64> { (0..B * B).map(|k| matrix[k / B * p + k % B]).collect() };
        let start = StartState {
            values: from.values[..B].to_vec(),
            covariance: of_b(&from.covariance),
            spread: of_b(&from.spread),
            fit: None,
            ..from.clone()
        };
        let linear = Setup {
            structure: Structure::Fir,
            orders: Orders {
                nb: B,
                nk: setup.orders.nk,
                ..Orders::default()
            },
            memories: setup.memories.iter().take(B).cloned().collect(),
            limit: limit_of_b,
            ..setup.clone()
        };
        let shape = AnyShape {
            na: 0,
            nb: B,
            nc: 0,
            nd: 0,
            nf: 0,
        };
        let gain = Gain::new(&linear, &start, sample_time, false)?;
        let bars = error_bars(&linear, &start, sample_time)?;
        let values = [start.values[0], start.values[1]];
        let rls = Rls::new(shape, values, gain, bars).ok_or_else(|| IdentError::BadStart {
            reason: "it has no coefficients of B".to_owned(),
        })?;
        Ok(Self {
            rpem: Plan::new(setup, from, sample_time).build(Kernel::PredictionError(Regressor::Gradient))?,
            rls,
            delay: DelayLine::new(vec![0.0; setup.orders.nk]),
            past: [0.0; 2],
            theta: from.values.clone(),
        })
    }

    /// Returns `F u` with the F of the prediction-error method.
    fn filter_output(&self, u: f64) -> f64 {
        let theta = self.rpem.theta();
        let p = theta.len();
        u + theta[p - 2] * self.past[0] + theta[p - 1] * self.past[1]
    }

    fn join_estimates(&mut self) {
        self.theta.copy_from_slice(self.rpem.theta());
        self.theta[..B].copy_from_slice(&self.rls.theta()[..B]);
    }

    fn store(&mut self, u: f64) {
        self.past = [u, self.past[0]];
    }
}

impl Recursion for FusedRecursion {
    fn step(&mut self, sample: Sample) -> StepOutcome {
        let x = self.delay.step(sample.e);
        let of_rpem = self.rpem.step(sample);
        let y = self.filter_output(sample.u);
        let of_rls: StepOutcome = self.rls.step(x, y).into();
        self.store(sample.u);
        self.join_estimates();
        StepOutcome {
            innovation: of_rls.innovation,
            shortened: of_rpem.shortened,
        }
    }

    fn step_without_update(&mut self, sample: Sample) -> StepOutcome {
        let x = self.delay.step(sample.e);
        self.rpem.step_without_update(sample);
        let y = self.filter_output(sample.u);
        let taken = self.rls.step_without_update(x, y).into();
        self.store(sample.u);
        taken
    }

    fn bridge(&mut self, sample: Sample) {
        let x = self.delay.step(sample.e);
        self.rpem.bridge(sample);
        // With an output of zero, eps is the prediction with the opposite sign.
        let y = self.filter_output(0.0);
        let predicted = -self.rls.step_without_update(x, y).innovation;
        self.store(limit_magnitude(predicted));
    }

    fn scale_covariance(&mut self, factor: f64) -> bool {
        self.rls.adaptation_mut().scale(factor) && self.rpem.scale_covariance(factor)
    }

    fn theta(&self) -> &[f64] {
        &self.theta
    }

    /// Writes the covariance of each method; the covariances between the methods are unknown and set to zero.
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
