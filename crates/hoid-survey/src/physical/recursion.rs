//! The recursion in physical parameters with the interface of all recursions: capacity for the parameters, the delay
//! line, and conversion of the covariance to the covariance of the coefficients.

use hoid_core::{
    adaptation::Adaptation,
    delay::DelayLine,
    shape::{AnyShape, FixedShape, Shape},
    state::State,
};
use hoid_ident::IdentError;
use hoid_model::uncertainty::{Estimate, OperatorEstimate};
use hoid_track::{
    Sample,
    building::{
        Delay, Plan, Recursion, ScaleCovariance, StepOutcome, physical_bounds, too_many_parameters, write_scaled,
    },
};

use crate::kernel::physical::{PhysicalModel, PhysicalRpem};

/// Builds the recursion with the smallest sufficient capacity. If the orders are those of the operator, they are
/// compile-time constants.
///
/// # Errors
/// [`IdentError`] if options contradict each other, or if the start cannot be used.
pub(super) fn build(plan: &Plan<'_>) -> Result<Box<dyn Recursion>, IdentError> {
    let o = plan.setup.polynomial_orders();
    let p = plan.parameter_count();
    let any = AnyShape {
        na: o.na,
        nb: o.nb,
        nc: o.nc,
        nd: o.nd,
        nf: o.nf,
    };
    let of_operator = (o.na, o.nb, o.nc, o.nd, o.nf) == (0, 2, 0, 1, 2);
    match (p, stored_sample_count(plan)) {
        (5, None) if of_operator => with_capacity::<_, 5, 2, 5>(plan, FixedShape::<0, 2, 0, 1, 2>),
        (0..=8, None) => with_capacity::<_, 8, 8, 8>(plan, any),
        (0..=16, None) => with_capacity::<_, 16, 16, 16>(plan, any),
        (0..=8, Some(0..=128)) => with_capacity::<_, 8, 8, 128>(plan, any),
        (0..=16, Some(0..=1024)) => with_capacity::<_, 16, 16, 1024>(plan, any),
        (0..=16, Some(taps)) => Err(IdentError::BadOption {
            option: "the range of the delay".to_owned(),
            found: format!("{taps} samples"),
            expected: "at most 1024 samples; narrow the range, or sample more slowly".to_owned(),
        }),
        _ => Err(too_many_parameters(p)),
    }
}

/// Smallest delay nk in samples; `None` if tau_e is not tracked.
fn min_nk(plan: &Plan<'_>) -> Option<usize> {
    // The tolerance allows for rounding errors: 0.29/0.01 is 28.999999999999996.
    let whole = |low: f64| ((low / plan.sample_time.s() + 1e-9) as usize).saturating_add(1);
    plan.setup.track_delay_s.map(|(low, _)| whole(low))
}

/// Number of input samples to be kept; `None` if tau_e is not tracked.
fn stored_sample_count(plan: &Plan<'_>) -> Option<usize> {
    let (_, longest) = plan.setup.track_delay_s?;
    let all = (longest / plan.sample_time.s()) as usize + 5;
    Some(all.saturating_sub(min_nk(plan).unwrap_or(0)))
}

fn with_capacity<S: Shape + Send + Sync + 'static, const N: usize, const K: usize, const L: usize>(
    plan: &Plan<'_>,
    shape: S,
) -> Result<Box<dyn Recursion>, IdentError> {
    let (setup, ts) = (plan.setup, plan.sample_time.s());
    let smallest_nk = min_nk(plan);
    let model = PhysicalModel {
        shape,
        smallest_nk,
        sample_time: ts,
        bounds: physical_bounds::<N>(setup, plan.sample_time)?,
        stable: setup.stable,
    };
    let recursion = PhysicalRpem::<S, N, K, L, _>::new(
        model,
        plan.start_values(),
        plan.gain::<N>(true)?,
        plan.error_bars::<N, K>()?,
    )
    .ok_or_else(|| IdentError::BadStart {
        reason: "it lies outside the bounds of the physical parameters, or its noise model is not stable".to_owned(),
    })?;
    Ok(Box::new(PhysicalRecursion {
        recursion,
        delay: DelayLine::new(vec![0.0; smallest_nk.unwrap_or(setup.orders.nk)]),
        parameters: plan.parameter_count(),
        tracked: smallest_nk.is_some(),
        fixed_tau_s: (setup.orders.nk as f64 - 1.0) * ts,
    }))
}

hoid_core::state!([S, const N: usize, const K: usize, const L: usize, A: State] PhysicalRecursion<S, N, K, L, A> { recursion, delay });

struct PhysicalRecursion<S, const N: usize, const K: usize, const L: usize, A> {
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
    A: Adaptation<N> + ScaleCovariance + State + Send + Sync,
> Recursion for PhysicalRecursion<S, N, K, L, A>
{
    fn step(&mut self, sample: Sample) -> StepOutcome {
        let x = self.delay.step(sample.e);
        self.recursion.step(x, sample.u).into()
    }

    fn step_without_update(&mut self, sample: Sample) -> StepOutcome {
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

    /// Writes `J C J'`, where J is the Jacobian of the polynomials with the rows `[b.. c.. d.. f..]`.
    fn covariance(&self, into: &mut [f64]) -> bool {
        let p = self.parameters;
        let mut of_eta = vec![0.0; p * p];
        write_scaled(
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
