//! The recursions of the real-time kernel behind one face: room for the parameters, the delay line,
//! the covariance in units of the parameters.

use hoid_core::{
    adaptation::Adaptation,
    delay::DelayLine,
    error_bars::ErrorBars,
    physical::{PhysicalModel, PhysicalRpem},
    predictor::Regressor,
    rls::Rls,
    rpem::Rpem,
    shape::{AnyShape, FixedShape, Shape},
    state::State,
};
use hoid_model::{
    SampleTime,
    uncertainty::{Estimate, OperatorEstimate},
};

use hoid_ident::IdentError;

use crate::{
    gain::{self, Gain, Scaled},
    recursion::{Delay, Recursion, Sample, StepOutcome},
    setup::Setup,
    start::{self, StartState},
};

/// The recursions of the kernel.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Kernel {
    /// Least squares.
    LeastSquares,
    /// Prediction-error method.
    PredictionError(Regressor),
    /// Prediction-error method in the operator's parameters.
    Physical,
}

fn too_many(parameters: usize) -> IdentError {
    IdentError::BadOption {
        option: "the orders of a recursion".to_owned(),
        found: format!("{parameters} parameters"),
        expected: "at most 64, and 16 for the method physical; lower them".to_owned(),
    }
}

/// What a recursion is made of.
pub(crate) struct Plan<'a> {
    setup: &'a Setup,
    from: &'a StartState,
    sample_time: SampleTime,
}

impl<'a> Plan<'a> {
    /// From setup and start.
    pub fn new(setup: &'a Setup, from: &'a StartState, sample_time: SampleTime) -> Self {
        Self {
            setup,
            from,
            sample_time,
        }
    }

    /// Builds a recursion of the kernel: the smallest room that holds its parameters, and the
    /// orders in its type where they are those of the operator.
    ///
    /// # Errors
    /// [`IdentError`] for options that contradict each other or a start that the recursion cannot
    /// take.
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
        let of_operator = (o.na, o.nb, o.nc, o.nd, o.nf) == (0, 2, 0, 1, 2);
        match kernel {
            Kernel::LeastSquares => match p {
                4 if o.na == 2 => self.linear::<_, 4>(FixedShape::<2, 2, 0, 0, 0>),
                0..=8 => self.linear::<_, 8>(any),
                9..=16 => self.linear::<_, 16>(any),
                17..=64 => self.linear::<_, 64>(any),
                _ => Err(too_many(p)),
            },
            Kernel::Physical => match (p, self.taps()) {
                (5, None) if of_operator => self.physical::<_, 5, 2, 5>(FixedShape::<0, 2, 0, 1, 2>),
                (0..=8, None) => self.physical::<_, 8, 8, 8>(any),
                (0..=16, None) => self.physical::<_, 16, 16, 16>(any),
                (0..=8, Some(0..=128)) => self.physical::<_, 8, 8, 128>(any),
                (0..=16, Some(0..=1024)) => self.physical::<_, 16, 16, 1024>(any),
                (0..=16, Some(taps)) => Err(IdentError::BadOption {
                    option: "the range of the delay".to_owned(),
                    found: format!("{taps} samples"),
                    expected: "at most 1024 samples; narrow it, or sample more slowly".to_owned(),
                }),
                _ => Err(too_many(p)),
            },
            Kernel::PredictionError(regressor) => match p {
                5 if of_operator => self.polynomials::<_, 5, 2>(FixedShape::<0, 2, 0, 1, 2>, regressor),
                0..=8 => self.polynomials::<_, 8, 8>(any, regressor),
                9..=16 => self.polynomials::<_, 16, 16>(any, regressor),
                17..=64 => self.polynomials::<_, 64, 64>(any, regressor),
                _ => Err(too_many(p)),
            },
        }
    }

    fn values<const N: usize>(&self) -> [f64; N] {
        std::array::from_fn(|i| self.from.values.get(i).copied().unwrap_or(0.0))
    }

    fn gain<const N: usize>(&self, growing: bool) -> Result<Gain<N>, IdentError> {
        Gain::new(self.setup, self.from, self.sample_time, growing)
    }

    fn bars<const N: usize, const K: usize>(&self) -> Result<ErrorBars<N, K>, IdentError> {
        gain::error_bars(self.setup, self.from, self.sample_time)
    }

    fn parameters(&self) -> usize {
        self.from.values.len()
    }

    /// Smallest delay in samples, where tau_e is tracked.
    fn smallest_nk(&self) -> Option<usize> {
        // Up to rounding: 0.29/0.01 is 28.999999999999996.
        let whole = |low: f64| ((low / self.sample_time.s() + 1e-9) as usize).saturating_add(1);
        self.setup.track_delay_s.map(|(low, _)| whole(low))
    }

    /// Samples of the input to be kept, where tau_e is tracked.
    fn taps(&self) -> Option<usize> {
        let (_, longest) = self.setup.track_delay_s?;
        let all = (longest / self.sample_time.s()) as usize + 5;
        Some(all.saturating_sub(self.smallest_nk().unwrap_or(0)))
    }

    fn linear<S: Shape + Send + Sync + 'static, const N: usize>(
        &self,
        shape: S,
    ) -> Result<Box<dyn Recursion>, IdentError> {
        let rls = Rls::new(shape, self.values(), self.gain::<N>(false)?, self.bars::<N, 0>()?).ok_or_else(|| {
            IdentError::BadOption {
                option: "the orders".to_owned(),
                found: self.setup.orders.to_string(),
                expected: "at least one parameter in A or B".to_owned(),
            }
        })?;
        Ok(Box::new(Linear {
            rls,
            delay: delay(self.setup.orders.nk),
            parameters: self.parameters(),
        }))
    }

    fn polynomials<S: Shape + Send + Sync + 'static, const N: usize, const K: usize>(
        &self,
        shape: S,
        regressor: Regressor,
    ) -> Result<Box<dyn Recursion>, IdentError> {
        let rpem = Rpem::new(
            shape,
            regressor,
            self.setup.stable,
            self.values(),
            self.gain::<N>(true)?,
            self.bars::<N, K>()?,
        )
        .ok_or_else(|| IdentError::BadStart {
            reason: "it is not stable; give another start, or the structure fewer poles".to_owned(),
        })?;
        Ok(Box::new(Polynomials {
            rpem,
            delay: delay(self.setup.orders.nk),
            parameters: self.parameters(),
        }))
    }

    fn physical<S: Shape + Send + Sync + 'static, const N: usize, const K: usize, const L: usize>(
        &self,
        shape: S,
    ) -> Result<Box<dyn Recursion>, IdentError> {
        let (setup, ts) = (self.setup, self.sample_time.s());
        let smallest_nk = self.smallest_nk();
        let model = PhysicalModel {
            shape,
            smallest_nk,
            sample_time: ts,
            bounds: start::physical_bounds::<N>(setup, self.sample_time)?,
            stable: setup.stable,
        };
        let recursion =
            PhysicalRpem::<S, N, K, L, _>::new(model, self.values(), self.gain::<N>(true)?, self.bars::<N, K>()?)
                .ok_or_else(|| IdentError::BadStart {
                    reason: "it lies outside the bounds of the physical parameters, or its noise model is not stable"
                        .to_owned(),
                })?;
        Ok(Box::new(InPhysical {
            recursion,
            delay: delay(smallest_nk.unwrap_or(setup.orders.nk)),
            parameters: self.parameters(),
            tracked: smallest_nk.is_some(),
            fixed_tau_s: (setup.orders.nk as f64 - 1.0) * ts,
        }))
    }
}

fn delay(nk: usize) -> DelayLine<Vec<f64>> {
    DelayLine::new(vec![0.0; nk])
}

/// Covariance in the units of the parameters.
fn scaled<const N: usize>(spread: &[[f64; N]; N], variance: f64, parameters: usize, into: &mut [f64]) {
    for i in 0..parameters {
        for j in 0..parameters {
            into[i * parameters + j] = variance * spread[i][j];
        }
    }
}

hoid_core::state!([S, const N: usize, A: State] Linear<S, N, A> { rls, delay });
hoid_core::state!([S, const N: usize, const K: usize, A: State] Polynomials<S, N, K, A> { rpem, delay });
hoid_core::state!([S, const N: usize, const K: usize, const L: usize, A: State] InPhysical<S, N, K, L, A> { recursion, delay });

struct Linear<S, const N: usize, A> {
    rls: Rls<S, N, A>,
    delay: DelayLine<Vec<f64>>,
    parameters: usize,
}

impl<S: Shape + Send + Sync, const N: usize, A: Adaptation<N> + Scaled + State + Send + Sync> Recursion
    for Linear<S, N, A>
{
    fn step(&mut self, sample: Sample) -> StepOutcome {
        let x = self.delay.step(sample.e);
        self.rls.step(x, sample.u).into()
    }

    fn follow(&mut self, sample: Sample) -> StepOutcome {
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
        scaled(
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

struct Polynomials<S, const N: usize, const K: usize, A> {
    rpem: Rpem<S, N, K, A>,
    delay: DelayLine<Vec<f64>>,
    parameters: usize,
}

impl<S: Shape + Send + Sync, const N: usize, const K: usize, A: Adaptation<N> + Scaled + State + Send + Sync> Recursion
    for Polynomials<S, N, K, A>
{
    fn step(&mut self, sample: Sample) -> StepOutcome {
        let x = self.delay.step(sample.e);
        self.rpem.step(x, sample.u).into()
    }

    fn follow(&mut self, sample: Sample) -> StepOutcome {
        let x = self.delay.step(sample.e);
        self.rpem.step_without_update(x, sample.u).into()
    }

    fn bridge(&mut self, sample: Sample) {
        let x = self.delay.step(sample.e);
        self.rpem.bridge(x);
    }

    fn scale_covariance(&mut self, factor: f64) -> bool {
        self.rpem.adaptation_mut().scale(factor)
    }

    fn theta(&self) -> &[f64] {
        &self.rpem.theta()[..self.parameters]
    }

    fn covariance(&self, into: &mut [f64]) -> bool {
        scaled(
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

struct InPhysical<S, const N: usize, const K: usize, const L: usize, A> {
    recursion: PhysicalRpem<S, N, K, L, A>,
    delay: DelayLine<Vec<f64>>,
    parameters: usize,
    tracked: bool,
    fixed_tau_s: f64,
}

impl<
    S: Shape + Send + Sync,
    const N: usize,
    const K: usize,
    const L: usize,
    A: Adaptation<N> + Scaled + State + Send + Sync,
> Recursion for InPhysical<S, N, K, L, A>
{
    fn step(&mut self, sample: Sample) -> StepOutcome {
        let x = self.delay.step(sample.e);
        self.recursion.step(x, sample.u).into()
    }

    fn follow(&mut self, sample: Sample) -> StepOutcome {
        let x = self.delay.step(sample.e);
        self.recursion.step_without_update(x, sample.u).into()
    }

    fn bridge(&mut self, sample: Sample) {
        let x = self.delay.step(sample.e);
        self.recursion.bridge(x);
    }

    fn scale_covariance(&mut self, factor: f64) -> bool {
        self.recursion.adaptation_mut().scale(factor)
    }

    fn delay(&self) -> Option<Delay> {
        let tau_e_s = self.operator()?.tau_e_s;
        self.tracked.then(|| Delay {
            nk: self.recursion.nk(),
            tau_e_s,
        })
    }

    fn theta(&self) -> &[f64] {
        &self.recursion.theta()[..self.parameters]
    }

    /// `J C J'`, with J the Jacobian of the polynomials, rows `[b.. c.. d.. f..]`.
    fn covariance(&self, into: &mut [f64]) -> bool {
        let p = self.parameters;
        let mut of_eta = vec![0.0; p * p];
        scaled(
            &self.recursion.normalised_covariance(),
            self.recursion.innovation_variance(),
            p,
            &mut of_eta,
        );
        let operator = if self.tracked { 5 } else { 4 };
        let (nb, noise) = (operator - 2, p - operator);
        let row = |i: usize| -> Vec<(usize, f64)> {
            let by = self.recursion.jacobian();
            let of = |k: usize| (0..operator).map(|j| (j, by[k][j])).collect();
            match i {
                i if i < nb => of(i),
                i if i < nb + noise => vec![(operator + i - nb, 1.0)],
                i => of(i - noise),
            }
        };
        let rows: Vec<_> = (0..p).map(row).collect();
        for i in 0..p {
            for j in 0..p {
                let pairs = rows[i].iter().flat_map(|a| rows[j].iter().map(move |b| (a, b)));
                into[i * p + j] = pairs.map(|((k, x), (l, y))| x * of_eta[k * p + l] * y).sum();
            }
        }
        true
    }

    fn innovation_variance(&self) -> f64 {
        self.recursion.innovation_variance()
    }

    fn operator(&self) -> Option<OperatorEstimate> {
        let eta = self.recursion.eta();
        let spread = self.recursion.normalised_covariance();
        let variance = self.recursion.innovation_variance();
        let estimate = |i: usize| Estimate::with_variance(eta[i], variance * spread[i][i]);
        let (k_e, k_e_dot) = (eta[0], eta[1]);
        let t_l = k_e_dot / k_e;
        // d T_L = (d K_e_dot - T_L d K_e)/K_e.
        let of_ratio = spread[1][1] - 2.0 * t_l * spread[0][1] + t_l * t_l * spread[0][0];
        Some(OperatorEstimate {
            k_e: estimate(0),
            t_l_s: Estimate::with_variance(t_l, variance * of_ratio.max(0.0) / (k_e * k_e)),
            k_e_dot: estimate(1),
            omega_nm_rad_s: estimate(2),
            zeta_nm: estimate(3),
            tau_e_s: if self.tracked {
                estimate(4)
            } else {
                Estimate::fixed(self.fixed_tau_s)
            },
        })
    }
}
