//! The recursions of the real-time kernel with the interface of all recursions, which adds capacity for the parameters,
//! the delay lines, and the covariance in units of the parameters.
//!
//! Least squares with a further input is the prediction-error method of a model without C, D and F: without them the
//! two are the same recursion. At a sample at which the further input is not known, its last value enters the filters
//! and the estimate stays constant.

use hoid_core::{
    adaptation::Adaptation,
    delay::DelayLine,
    error_bars::ErrorBars,
    further_input::{FurtherInput, FurtherInputs, NoFurtherInputs},
    predictor::Regressor,
    rls::Rls,
    rpem::Rpem,
    shape::{AnyShape, FixedShape, Shape},
    state::{State, visit_all},
};
use hoid_ident::IdentError;
use hoid_model::SampleTime;

use crate::{
    further_input::TrackedInput,
    gain::{self, Gain, ScaleCovariance},
    method::invalid_option,
    recursion::{Recursion, Sample, StepOutcome},
    setup::Setup,
    start::StartState,
};

/// The recursions of the kernel.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kernel {
    /// Least squares.
    LeastSquares,
    /// Prediction-error method.
    PredictionError(Regressor),
}

/// Returns the error for more parameters than the kernel has capacity for.
pub fn too_many_parameters(parameters: usize) -> IdentError {
    IdentError::BadOption {
        option: "the orders of a recursion".to_owned(),
        found: format!("{parameters} parameters"),
        expected: "at most 64 parameters (16 for the method physical); lower the orders".to_owned(),
    }
}

/// Components of a recursion.
pub struct Plan<'a> {
    /// Structure, orders and options.
    pub setup: &'a Setup,
    /// Start of the recursion.
    pub from: &'a StartState,
    /// Time between samples.
    pub sample_time: SampleTime,
}

impl<'a> Plan<'a> {
    /// Builds a plan from setup and start.
    pub fn new(setup: &'a Setup, from: &'a StartState, sample_time: SampleTime) -> Self {
        Self {
            setup,
            from,
            sample_time,
        }
    }

    /// Builds a recursion of the kernel with the smallest capacity that is sufficient for its parameters. For the
    /// orders of the operator there is a recursion compiled for these orders.
    ///
    /// # Errors
    /// [`IdentError`] for options that contradict each other, or a start that the recursion cannot use.
    pub fn build(&self, kernel: Kernel) -> Result<Box<dyn Recursion>, IdentError> {
        let o = self.setup.polynomial_orders();
        let p = self.from.values.len();
        let any = AnyShape {
            na: o.na,
            nb: o.nb,
            nc: o.nc,
            nd: o.nd,
            nf: o.nf,
        };
        if let Some(further) = &self.setup.further {
            return match p {
                0..=8 => self.build_two_inputs::<8>(any, further, kernel),
                9..=16 => self.build_two_inputs::<16>(any, further, kernel),
                17..=64 => self.build_two_inputs::<64>(any, further, kernel),
                _ => Err(too_many_parameters(p)),
            };
        }
        let of_operator = (o.na, o.nb, o.nc, o.nd, o.nf) == (0, 2, 0, 1, 2);
        match kernel {
            Kernel::LeastSquares => match p {
                4 if o.na == 2 => self.build_linear::<_, 4>(FixedShape::<2, 2, 0, 0, 0>),
                0..=8 => self.build_linear::<_, 8>(any),
                9..=16 => self.build_linear::<_, 16>(any),
                17..=64 => self.build_linear::<_, 64>(any),
                _ => Err(too_many_parameters(p)),
            },
            Kernel::PredictionError(regressor) => match p {
                5 if of_operator => self.build_polynomials::<_, 5, 2>(FixedShape::<0, 2, 0, 1, 2>, regressor),
                0..=8 => self.build_polynomials::<_, 8, 8>(any, regressor),
                9..=16 => self.build_polynomials::<_, 16, 16>(any, regressor),
                17..=64 => self.build_polynomials::<_, 64, 64>(any, regressor),
                _ => Err(too_many_parameters(p)),
            },
        }
    }

    /// Returns the start values, with capacity for N parameters.
    pub fn start_values<const N: usize>(&self) -> [f64; N] {
        std::array::from_fn(|i| self.from.values.get(i).copied().unwrap_or(0.0))
    }

    /// Returns the gain of the recursion ([`Gain::new`]).
    ///
    /// # Errors
    /// Same as [`Gain::new`].
    pub fn gain<const N: usize>(&self, growing: bool) -> Result<Gain<N>, IdentError> {
        Gain::new(self.setup, self.from, self.sample_time, growing)
    }

    /// Returns the error bars at the start ([`gain::error_bars`]).
    ///
    /// # Errors
    /// Same as [`gain::error_bars`].
    pub fn error_bars<const N: usize, const K: usize>(&self) -> Result<ErrorBars<N, K>, IdentError> {
        gain::error_bars(self.setup, self.from, self.sample_time)
    }

    /// Returns the number of parameters.
    pub fn parameter_count(&self) -> usize {
        self.from.values.len()
    }

    fn build_linear<S: Shape + Send + Sync + 'static, const N: usize>(
        &self,
        shape: S,
    ) -> Result<Box<dyn Recursion>, IdentError> {
        let rls = Rls::new(
            shape,
            self.start_values(),
            self.gain::<N>(false)?,
            self.error_bars::<N, 0>()?,
        )
        .ok_or_else(|| IdentError::BadOption {
            option: "the orders".to_owned(),
            found: self.setup.orders.to_string(),
            expected: "at least one parameter in A or B".to_owned(),
        })?;
        Ok(Box::new(LinearRecursion {
            rls,
            delay: delay_line(self.setup.orders.nk),
            parameters: self.parameter_count(),
        }))
    }

    fn build_polynomials<S: Shape + Send + Sync + 'static, const N: usize, const K: usize>(
        &self,
        shape: S,
        regressor: Regressor,
    ) -> Result<Box<dyn Recursion>, IdentError> {
        let rpem = Rpem::new(
            shape,
            regressor,
            self.setup.stable,
            self.start_values(),
            self.gain::<N>(true)?,
            self.error_bars::<N, K>()?,
        )
        .ok_or_else(unstable_start_error)?;
        Ok(Box::new(PolynomialRecursion {
            rpem,
            delay: delay_line(self.setup.orders.nk),
            further: Vec::new(),
            parameters: self.parameter_count(),
        }))
    }

    fn build_two_inputs<const N: usize>(
        &self,
        shape: AnyShape,
        further: &TrackedInput,
        kernel: Kernel,
    ) -> Result<Box<dyn Recursion>, IdentError> {
        let (regressor, growing) = match kernel {
            Kernel::LeastSquares => (Regressor::Gradient, false),
            Kernel::PredictionError(regressor) => (regressor, true),
        };
        if regressor == Regressor::Cascade {
            return Err(invalid_option(
                "regressor",
                "cascade with a further input".to_owned(),
                "gradient or pseudo-linear",
            ));
        }
        let orders = further.orders;
        let rpem = Rpem::with_further_inputs(
            shape,
            [FurtherInput::new(orders.nb, orders.nf)],
            regressor,
            self.setup.stable,
            self.start_values(),
            self.gain::<N>(growing)?,
            self.error_bars::<N, 0>()?,
        )
        .ok_or_else(unstable_start_error)?;
        Ok(Box::new(PolynomialRecursion {
            rpem,
            delay: delay_line(self.setup.orders.nk),
            further: vec![FurtherInputLine {
                delay: delay_line(orders.nk),
                last: 0.0,
            }],
            parameters: self.parameter_count(),
        }))
    }
}

fn unstable_start_error() -> IdentError {
    IdentError::BadStart {
        reason: "it is not stable; give another start, or a structure with fewer poles".to_owned(),
    }
}

fn delay_line(nk: usize) -> DelayLine<Vec<f64>> {
    DelayLine::new(vec![0.0; nk])
}

/// Writes the covariance in the units of the parameters, `variance` times `spread`, by rows.
pub fn write_scaled<const N: usize>(spread: &[[f64; N]; N], variance: f64, parameters: usize, into: &mut [f64]) {
    for i in 0..parameters {
        for j in 0..parameters {
            into[i * parameters + j] = variance * spread[i][j];
        }
    }
}

hoid_core::state!([S, const N: usize, A: State] LinearRecursion<S, N, A> { rls, delay });
impl<S, const N: usize, const K: usize, A: State, I: State> State for PolynomialRecursion<S, N, K, A, I> {
    fn visit(&mut self, each: &mut dyn FnMut(&mut f64)) {
        let further = self.further.as_mut_slice();
        visit_all(&mut [&mut self.rpem, &mut self.delay], each);
        further.visit(each);
    }
}

hoid_core::state!([] FurtherInputLine { delay, last });

struct LinearRecursion<S, const N: usize, A> {
    rls: Rls<S, N, A>,
    delay: DelayLine<Vec<f64>>,
    parameters: usize,
}

impl<S: Shape + Send + Sync, const N: usize, A: Adaptation<N> + ScaleCovariance + State + Send + Sync> Recursion
    for LinearRecursion<S, N, A>
{
    fn step(&mut self, sample: Sample) -> StepOutcome {
        let x = self.delay.step(sample.e);
        self.rls.step(x, sample.u).into()
    }

    fn step_without_update(&mut self, sample: Sample) -> StepOutcome {
        let x = self.delay.step(sample.e);
        self.rls.step_without_update(x, sample.u).into()
    }

    fn bridge(&mut self, sample: Sample) {
        let x = self.delay.step(sample.e);
        self.rls.bridge(x);
    }

    fn scale_covariance(&mut self, factor: f64) -> bool {
        self.rls.adaptation_mut().scale(factor)
    }

    fn theta(&self) -> &[f64] {
        &self.rls.theta()[..self.parameters]
    }

    fn covariance(&self, into: &mut [f64]) -> bool {
        write_scaled(
            &self.rls.normalised_covariance(),
            self.rls.innovation_variance(),
            self.parameters,
            into,
        );
        true
    }

    fn innovation_variance(&self) -> f64 {
        self.rls.innovation_variance()
    }
}

/// Delay line of a further input, and its last known value.
struct FurtherInputLine {
    delay: DelayLine<Vec<f64>>,
    last: f64,
}

struct PolynomialRecursion<S, const N: usize, const K: usize, A, I = NoFurtherInputs> {
    rpem: Rpem<S, N, K, A, ErrorBars<N, K>, I>,
    delay: DelayLine<Vec<f64>>,
    further: Vec<FurtherInputLine>,
    parameters: usize,
}

impl<S: Shape, const N: usize, const K: usize, A: Adaptation<N>, I: FurtherInputs<N>>
    PolynomialRecursion<S, N, K, A, I>
{
    /// Passes the inputs of a sample through the delay lines. Returns the input of the first response, and whether the
    /// further input is known.
    fn delay_inputs(&mut self, sample: &Sample) -> (f64, bool) {
        let mut known = true;
        if let [line] = self.further.as_mut_slice() {
            known = sample.reference.is_some();
            line.last = sample.reference.unwrap_or(line.last);
            self.rpem.further_inputs_mut().set(&[line.delay.step(line.last)]);
        }
        (self.delay.step(sample.e), known)
    }
}

impl<
    S: Shape + Send + Sync,
    const N: usize,
    const K: usize,
    A: Adaptation<N> + ScaleCovariance + State + Send + Sync,
    I: FurtherInputs<N> + Send + Sync,
> Recursion for PolynomialRecursion<S, N, K, A, I>
{
    fn step(&mut self, sample: Sample) -> StepOutcome {
        match self.delay_inputs(&sample) {
            (x, true) => self.rpem.step(x, sample.u).into(),
            (x, false) => self.rpem.step_without_update(x, sample.u).into(),
        }
    }

    fn step_without_update(&mut self, sample: Sample) -> StepOutcome {
        let (x, _) = self.delay_inputs(&sample);
        self.rpem.step_without_update(x, sample.u).into()
    }

    fn bridge(&mut self, sample: Sample) {
        let (x, _) = self.delay_inputs(&sample);
        self.rpem.bridge(x);
    }

    fn scale_covariance(&mut self, factor: f64) -> bool {
        self.rpem.adaptation_mut().scale(factor)
    }

    fn theta(&self) -> &[f64] {
        &self.rpem.theta()[..self.parameters]
    }

    fn covariance(&self, into: &mut [f64]) -> bool {
        write_scaled(
            &self.rpem.normalised_covariance(),
            self.rpem.innovation_variance(),
            self.parameters,
            into,
        );
        true
    }

    fn innovation_variance(&self) -> f64 {
        self.rpem.innovation_variance()
    }
}
