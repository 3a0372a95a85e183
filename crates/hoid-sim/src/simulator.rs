//! Simulation of one run of the closed loop.
//!
//! At sample k, with the parameters at that time,
//!
//! `e = f_t - x`, `u = y(k - tau_e/Ts) + r + n`, `n = K_n z`,
//!
//! where y is the response of the operator without delay, r the response to a displayed target ([`TargetResponse`];
//! zero if only the error is displayed), x the output of the controlled element for the input u + d with a disturbance
//! d, and z the output of the remnant cascade for unit variance. The operator, the controlled element and the cascade
//! are then each advanced exactly by one sample, for a held input: the operator is driven by e, the controlled element
//! by u + d, and the cascade by one normal deviate. The hold delays the response by one more sample, so
//! `nk = tau_e/Ts + 1`. The remnant is not delayed. A changing delay has its value at the sample at which the response
//! arrives: if the delay increases, parts of the response are repeated; if it decreases, parts are skipped.
//!
//! The operator and the controlled element are in controllable canonical form (the states are the output of `1/den` and
//! the rate of this output). The gains of the operator are in its output matrix; the gains of the controlled element
//! are placed according to [`Realisation`]. For changing parameters, the matrices at each sample follow from the
//! continuous model with the parameter values at that sample.

use std::ops::Range;

use hoid_lanes::Number;
use hoid_lanes::{InstructionSet, LaneTask, with_one_lane};
use hoid_model::{
    Channel, Record,
    scenario::{Realisation, ResolvedScenario, Scenario, TrueParameters},
    schedule::Schedule,
    second_order::ZohStates,
};

use crate::{
    RunSeed, SimError,
    cascade::{Cascade, HIGHEST_ORDER},
    target_response::TargetResponse,
};

/// Prepared scenario: forcing function, parameters and matrices for every sample.
#[derive(Debug, Clone)]
pub struct Simulator {
    scenario: ResolvedScenario,
    forcing_deg: Vec<f64>,
    /// Response to the target, and disturbance of the controlled element: signals of all runs that do not depend on the
    /// loop; `None` if there is neither.
    external_signals: Option<ExternalSignals>,
    /// Response to the target as an operator; `None` if the person does not see the target.
    target_response: Option<TargetResponse>,
    /// True parameters: one entry if nothing changes, otherwise one entry per sample.
    parameters: Vec<TrueParameters>,
    pub(crate) matrices: Vec<Matrices>,
    pub(crate) cascade: Cascade,
}

/// Signals that do not depend on the loop, in deg, one value per sample.
#[derive(Debug, Clone)]
struct ExternalSignals {
    response: Vec<f64>,
    disturbance: Vec<f64>,
}

#[derive(Debug, Clone, Copy)]
pub(crate) struct Matrices {
    pub operator: TwoStateSystem,
    pub operator_output: [f64; 2],
    element: TwoStateSystem,
    element_input: f64,
    element_output: f64,
    pub k_n: f64,
    pub delay: usize,
}

/// Held system with two states, `[a x_0 + b x_1 + g u, d x_1 - c x_0 - h u]`, bit-identical to [`ZohStates::step`]. If
/// both rows were sums, the compiler would pack the states into one register, and each sample would also wait for the
/// shuffles.
#[derive(Debug, Clone, Copy)]
pub(crate) struct TwoStateSystem {
    position_row: [f64; 3],
    velocity_row: [f64; 3],
}

impl TwoStateSystem {
    fn of(system: &ZohStates) -> Self {
        let ([[a, b], [c, d]], [g, h]) = (system.transition, system.input);
        Self {
            position_row: [a, b, g],
            velocity_row: [d, -c, -h],
        }
    }

    /// Advances the states by one sample.
    #[inline(always)]
    pub fn step<R: Number>(&self, x: [R; 2], u: R) -> [R; 2] {
        let ([a, b, g], [d, c, h]) = (self.position_row, self.velocity_row);
        [
            u.splat(a) * x[0] + u.splat(b) * x[1] + u.splat(g) * u,
            u.splat(d) * x[1] - u.splat(c) * x[0] - u.splat(h) * u,
        ]
    }
}

/// Signals of one run, including the run-in.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Signals {
    /// Tracking error e in deg.
    pub e: Vec<f64>,
    /// Control output u in deg.
    pub u: Vec<f64>,
    /// Output x of the controlled element in deg.
    pub x: Vec<f64>,
    /// Remnant n in deg.
    pub n: Vec<f64>,
}

impl Simulator {
    /// Prepares a scenario. All runs share the result.
    ///
    /// # Errors
    /// [`SimError::Model`] if the scenario is invalid.
    pub fn new(scenario: &Scenario) -> Result<Self, SimError> {
        let resolved = scenario.resolve()?;
        let ts = scenario.sample_time;
        let samples = resolved.run_in_samples() + resolved.measurement_samples();
        let start_s = -(resolved.run_in_samples() as f64) * ts.s();
        let entries = match scenario.schedule {
            Schedule::Constant => 1,
            Schedule::Sigmoid { .. } | Schedule::Alternating { .. } => samples,
        };
        let parameters: Vec<TrueParameters> = (0..entries)
            .map(|k| resolved.parameters_at(start_s + k as f64 * ts.s()))
            .collect();
        let matrices = (parameters.iter().enumerate())
            .map(|(k, p)| Matrices::of(p, resolved.delay_samples_at(start_s + k as f64 * ts.s()), scenario))
            .collect();
        let seen = (scenario.feedforward.as_ref()).map(|seen| {
            let instants = if resolved.feedforward_changes() { samples } else { 1 };
            let at = |k: usize| resolved.feedforward_at(start_s + k as f64 * ts.s());
            TargetResponse::new(seen, instants, at, ts)
        });
        let seen = seen.transpose()?;
        let response = seen.as_ref().map(|seen| {
            let shown = scenario.forcing.samples(start_s + seen.preview_s(), ts, samples);
            seen.respond(&shown)
        });
        let response = response.transpose()?;
        let is_given = response.is_some() || !scenario.disturbance.sinusoids().is_empty();
        let given = is_given.then(|| ExternalSignals {
            response: response.unwrap_or_else(|| vec![0.0; samples]),
            disturbance: scenario.disturbance.samples(start_s, ts, samples),
        });
        Ok(Self {
            external_signals: given,
            target_response: seen,
            forcing_deg: scenario.forcing.samples(start_s, ts, samples),
            cascade: Cascade::new(scenario.remnant.order, ts.s() / scenario.remnant.time_constant_s),
            parameters,
            matrices,
            scenario: resolved,
        })
    }

    /// Returns the scenario.
    pub fn scenario(&self) -> &ResolvedScenario {
        &self.scenario
    }

    /// Returns the number of samples of a run, including the run-in.
    pub fn sample_count(&self) -> usize {
        self.forcing_deg.len()
    }

    /// Returns one run as a record, from the start of the measurement or, with `keep_run_in`, of the run-in: e, u, f_t,
    /// x, n and the true parameters.
    ///
    /// # Errors
    /// [`SimError::Diverged`] if a signal is not finite.
    pub fn run(&self, run_seed: RunSeed, keep_run_in: bool) -> Result<Record, SimError> {
        let signals = self.signals(&run_seed.white_noise(self.sample_count()))?;
        self.record(signals, keep_run_in)
    }

    /// Returns the signals of a run driven by the given white noise of unit variance, one value per sample.
    ///
    /// # Errors
    /// [`SimError::NoiseLength`], [`SimError::NoiseNotFinite`], [`SimError::Diverged`].
    pub fn signals(&self, noise: &[f64]) -> Result<Signals, SimError> {
        let mut signals = Signals::default();
        self.signals_into(noise, &mut signals)?;
        Ok(signals)
    }

    /// Writes [`Simulator::signals`] into existing memory; allocating new memory costs half as much time as the run.
    ///
    /// # Errors
    /// As [`Simulator::signals`]. After an error the signals are invalid.
    pub fn signals_into(&self, noise: &[f64], signals: &mut Signals) -> Result<(), SimError> {
        self.check_length(noise)?;
        signals.resize_to(self.sample_count());
        let one = SingleRun {
            simulator: self,
            noise,
            signals,
        };
        if with_one_lane(one) {
            Ok(())
        } else {
            self.check_finite(noise, signals)
        }
    }

    /// Returns the signals of several runs, each driven by its own white noise and computed in its own lane of vector
    /// registers. With every instruction set, the results are bit-identical to [`Simulator::signals`] for each run.
    ///
    /// # Errors
    /// Like [`Simulator::signals`], for the first run with an error; [`SimError::NoSuchInstructionSet`] if this
    /// processor does not support the instruction set.
    pub fn batched_signals(&self, noises: &[Vec<f64>], instructions: InstructionSet) -> Result<Vec<Signals>, SimError> {
        let mut all = Vec::new();
        self.batched_signals_into(noises, instructions, &mut all)?;
        Ok(all)
    }

    /// Writes [`Simulator::batched_signals`] into existing memory; allocating new memory costs more time than the runs.
    ///
    /// # Errors
    /// Same as [`Simulator::batched_signals`].
    pub fn batched_signals_into(
        &self,
        noises: &[Vec<f64>],
        instructions: InstructionSet,
        into: &mut Vec<Signals>,
    ) -> Result<(), SimError> {
        for noise in noises {
            self.check_length(noise)?;
        }
        into.resize_with(noises.len(), Signals::default);
        for signals in into.iter_mut() {
            signals.resize_to(self.sample_count());
        }
        let many = BatchedRuns {
            simulator: self,
            noises,
            signals: into,
        };
        let finite = instructions.with_lanes(many).ok_or(SimError::NoSuchInstructionSet)?;
        if finite {
            return Ok(());
        }
        (noises.iter().zip(&*into)).try_for_each(|(noise, signals)| self.check_finite(noise, signals))
    }

    pub(crate) fn longest_delay(&self) -> usize {
        let [initial, last] = self.scenario.delay_samples();
        initial.max(last)
    }

    fn check_length(&self, noise: &[f64]) -> Result<(), SimError> {
        if noise.len() == self.sample_count() {
            return Ok(());
        }
        Err(SimError::NoiseLength {
            found: noise.len(),
            expected: self.sample_count(),
        })
    }

    /// Computes the samples of `range` from noise into e, u, x and n. In these arrays the lanes of each sample are
    /// adjacent.
    #[inline(always)]
    fn simulate_range<R: Number>(
        &self,
        state: &mut LoopState<R>,
        range: Range<usize>,
        noise: &[f64],
        out: [&mut [f64]; 4],
    ) {
        match self.cascade.order() {
            1 => self.simulate_range_of_order::<R, 1>(state, range, noise, out),
            2 => self.simulate_range_of_order::<R, 2>(state, range, noise, out),
            3 => self.simulate_range_of_order::<R, 3>(state, range, noise, out),
            _ => self.simulate_range_of_order::<R, HIGHEST_ORDER>(state, range, noise, out),
        }
    }

    #[inline(always)]
    fn simulate_range_of_order<R: Number, const M: usize>(
        &self,
        state: &mut LoopState<R>,
        range: Range<usize>,
        noise: &[f64],
        out: [&mut [f64]; 4],
    ) {
        match (self.matrices.len() == 1, &self.external_signals) {
            (true, None) => self.simulate_range_generic::<R, M, false, false>(state, range, noise, out),
            (false, None) => self.simulate_range_generic::<R, M, true, false>(state, range, noise, out),
            // The matrices are read at every sample; one entry is the same for all samples.
            (_, Some(_)) => self.simulate_range_generic::<R, M, true, true>(state, range, noise, out),
        }
    }

    /// As [`Simulator::simulate_range`], compiled separately for constant and for changing parameters, so constant
    /// matrices stay in registers, and for loops with and without given signals.
    #[inline(always)]
    fn simulate_range_generic<R: Number, const M: usize, const CHANGES: bool, const GIVEN: bool>(
        &self,
        state: &mut LoopState<R>,
        range: Range<usize>,
        noise: &[f64],
        [e_out, u_out, x_out, n_out]: [&mut [f64]; 4],
    ) {
        let zero = state.operator[0].splat(0.0);
        let width = zero.lane_count();
        let always = self.matrices[0];
        let end = self.matrices.len() - 1;
        let none = ExternalSignals {
            response: Vec::new(),
            disturbance: Vec::new(),
        };
        let given = self.external_signals.as_ref().unwrap_or(&none);
        let (mut operator, mut element) = (state.operator, state.element);
        let mut remnant: [R; M] = [zero; M];
        remnant.copy_from_slice(&state.remnant[..M]);
        let count = range.len();
        let (noise, e_out, u_out, x_out, n_out) = (
            &noise[..count * width],
            &mut e_out[..count * width],
            &mut u_out[..count * width],
            &mut x_out[..count * width],
            &mut n_out[..count * width],
        );
        let memory = &mut state.memory[..];
        let last = memory.len() - 1;
        for (i, k) in range.enumerate() {
            let m = match (CHANGES, GIVEN) {
                (false, _) => always,
                (true, false) => self.matrices[k],
                (true, true) => self.matrices[k.min(end)],
            };
            let at = i * width;
            let x = zero.splat(m.element_output) * element[0];
            let e = zero.splat(self.forcing_deg[k]) - x;
            let [of_output, of_rate] = m.operator_output;
            // The memory is a ring whose length is a power of two.
            memory[k & last] = zero.splat(of_output) * operator[0] + zero.splat(of_rate) * operator[1];
            let response = memory[k.wrapping_sub(m.delay) & last];
            let n = zero.splat(m.k_n) * remnant[M - 1];
            let (u, driving) = if GIVEN {
                let u = response + n + zero.splat(given.response[k]);
                (u, u + zero.splat(given.disturbance[k]))
            } else {
                (response + n, response + n)
            };
            operator = m.operator.step(operator, e);
            element = m.element.step(element, zero.splat(m.element_input) * driving);
            remnant = self.cascade.step(remnant, zero.load(&noise[at..]));
            e.store(&mut e_out[at..]);
            u.store(&mut u_out[at..]);
            x.store(&mut x_out[at..]);
            n.store(&mut n_out[at..]);
        }
        (state.operator, state.element) = (operator, element);
        state.remnant[..M].copy_from_slice(&remnant);
    }

    /// Returns the signals of a run as a record with time, units and true values.
    fn record(&self, signals: Signals, keep_run_in: bool) -> Result<Record, SimError> {
        let run_in = self.scenario.run_in_samples();
        let first = if keep_run_in { 0 } else { run_in };
        let ts = self.scenario.scenario().sample_time;
        let cut = |mut values: Vec<f64>| {
            values.drain(..first);
            values
        };
        let truth = |get: &dyn Fn(&TrueParameters) -> f64| match self.parameters.as_slice() {
            [only] => vec![get(only); self.sample_count() - first],
            all => all[first..].iter().map(get).collect(),
        };
        let target = Channel::new("f_t", "deg", self.forcing_deg[first..].to_vec());
        let mut record = Record::new(
            ts,
            Channel::new("e", "deg", cut(signals.e)),
            Channel::new("u", "deg", cut(signals.u)),
        )?
        .labelled(self.scenario.scenario().name.clone())
        .starting_at((first as f64 - run_in as f64) * ts.s())
        .with_channel(match &self.target_response {
            Some(seen) => seen.target(target),
            None => target,
        })?
        .with_channel(Channel::new("x", "deg", cut(signals.x)))?
        .with_channel(Channel::new("n", "deg", cut(signals.n)))?;
        for (name, unit, values) in [
            ("K_e", "deg/deg", truth(&|p| p.operator.k_e)),
            ("T_L", "s", truth(&|p| p.operator.t_l_s)),
            ("K_e_dot", "s", truth(&|p| p.operator.k_e_dot())),
            ("omega_nm", "rad/s", truth(&|p| p.operator.omega_nm_rad_s)),
            ("zeta_nm", "1", truth(&|p| p.operator.zeta_nm)),
            ("tau_e", "s", truth(&|p| p.operator.tau_e_s)),
            ("T_n", "s", truth(&|p| p.t_n_s)),
            ("K_n", "deg", truth(&|p| p.k_n)),
            ("K_c", "deg/deg", truth(&|p| p.controlled_element.k_c)),
            ("omega_b", "rad/s", truth(&|p| p.controlled_element.omega_b_rad_s)),
        ] {
            record = record.with_channel(Channel::new(name, unit, values))?;
        }
        let disturbed = !self.scenario.scenario().disturbance.sinusoids().is_empty();
        if let Some(given) = self.external_signals.as_ref().filter(|_| disturbed) {
            record = record.with_channel(Channel::new("d", "deg", given.disturbance[first..].to_vec()))?;
        }
        for channel in self
            .target_response
            .iter()
            .flat_map(|seen| seen.true_parameters(first, self.sample_count()))
        {
            record = record.with_channel(channel)?;
        }
        Ok(record)
    }

    /// Returns an error for the first number that is not finite, if there is one.
    fn check_finite(&self, noise: &[f64], signals: &Signals) -> Result<(), SimError> {
        if let Some(index) = first_non_finite_index(noise) {
            let value = noise[index];
            return Err(SimError::NoiseNotFinite { index, value });
        }
        for (signal, values) in [("e", &signals.e), ("u", &signals.u)] {
            if let Some(k) = first_non_finite_index(values) {
                let ts = self.scenario.scenario().sample_time.s();
                return Err(SimError::Diverged {
                    signal,
                    time_s: (k as f64 - self.scenario.run_in_samples() as f64) * ts,
                    scenario: self.scenario.scenario().name.clone(),
                });
            }
        }
        Ok(())
    }
}

/// Returns the index of the first value that is not finite.
fn first_non_finite_index(values: &[f64]) -> Option<usize> {
    values.iter().position(|v| !v.is_finite())
}

/// State of the loop between two samples.
struct LoopState<R> {
    operator: [R; 2],
    element: [R; 2],
    remnant: [R; HIGHEST_ORDER],
    /// Ring of the last responses, in which the response of sample k has the index k modulo the length.
    memory: Vec<R>,
}

impl<R: Number> LoopState<R> {
    fn at_rest(zero: R, longest_delay: usize) -> Self {
        Self {
            operator: [zero; 2],
            element: [zero; 2],
            remnant: [zero; HIGHEST_ORDER],
            memory: vec![zero; (longest_delay + 1).next_power_of_two()],
        }
    }

    /// True if all values of a lane were finite. A value that is not finite remains in the states, since its product
    /// with any coefficient, even zero, is not finite either.
    fn is_finite(&self, lane: usize) -> bool {
        let states = self.operator.iter().chain(&self.element).chain(&self.remnant);
        states.chain(&self.memory).all(|state| state.lane(lane).is_finite())
    }
}

impl Signals {
    fn resize_to(&mut self, samples: usize) {
        let Self { e, u, x, n } = self;
        for values in [e, u, x, n] {
            if values.capacity() < samples {
                // New zeroed memory from the operating system costs no time until it is written.
                *values = vec![0.0; samples];
            }
            values.resize(samples, 0.0);
        }
    }
}

/// Number of samples whose signals are interleaved between the lanes at a time.
const BLOCK_SAMPLES: usize = 64;

/// Task that simulates a single run.
struct SingleRun<'a> {
    simulator: &'a Simulator,
    noise: &'a [f64],
    /// Buffers for the signals, as long as the run.
    signals: &'a mut Signals,
}

impl LaneTask for SingleRun<'_> {
    /// True if all values were finite.
    type Output = bool;

    #[inline(always)]
    fn run<R: Number>(self, zero: R) -> bool {
        let mut state = LoopState::at_rest(zero, self.simulator.longest_delay());
        let Signals { e, u, x, n } = self.signals;
        let all = 0..self.simulator.sample_count();
        self.simulator.simulate_range(&mut state, all, self.noise, [e, u, x, n]);
        state.is_finite(0)
    }
}

/// Task that simulates several runs in parallel lanes.
struct BatchedRuns<'a> {
    simulator: &'a Simulator,
    noises: &'a [Vec<f64>],
    /// Buffers for the signals of each run, as long as the run.
    signals: &'a mut [Signals],
}

impl LaneTask for BatchedRuns<'_> {
    /// True if all values were finite.
    type Output = bool;

    #[inline(always)]
    fn run<R: Number>(self, zero: R) -> bool {
        let (width, samples) = (zero.lane_count(), self.simulator.sample_count());
        let mut noise = vec![0.0; width * BLOCK_SAMPLES];
        let mut out: [Vec<f64>; 4] = std::array::from_fn(|_| vec![0.0; width * BLOCK_SAMPLES]);
        let mut finite = true;
        for (noises, into) in self.noises.chunks(width).zip(self.signals.chunks_mut(width)) {
            let mut state = LoopState::at_rest(zero, self.simulator.longest_delay());
            // The noise is set to zero, so unused lanes run without remnant.
            noise.fill(0.0);
            for begin in (0..samples).step_by(BLOCK_SAMPLES) {
                let range = begin..(begin + BLOCK_SAMPLES).min(samples);
                for (lane, values) in noises.iter().enumerate() {
                    for (i, value) in values[range.clone()].iter().enumerate() {
                        noise[i * width + lane] = *value;
                    }
                }
                let [e, u, x, n] = &mut out;
                self.simulator
                    .simulate_range(&mut state, range.clone(), &noise, [e, u, x, n]);
                for (lane, signals) in into.iter_mut().enumerate() {
                    let Signals { e, u, x, n } = signals;
                    for (to, from) in [e, u, x, n].into_iter().zip(&out) {
                        let from = from[lane..].iter().step_by(width);
                        for (value, from) in to[range.clone()].iter_mut().zip(from) {
                            *value = *from;
                        }
                    }
                }
            }
            for lane in 0..into.len() {
                finite &= state.is_finite(lane);
            }
        }
        finite
    }
}

impl Matrices {
    fn of(p: &TrueParameters, delay: usize, scenario: &Scenario) -> Self {
        let (o, c, ts) = (&p.operator, &p.controlled_element, scenario.sample_time);
        let w2 = o.omega_nm_rad_s * o.omega_nm_rad_s;
        let (element_input, element_output) = match scenario.realisation {
            Realisation::Input => (c.k_c, 1.0),
            Realisation::Output => (1.0, c.k_c),
        };
        Self {
            operator: TwoStateSystem::of(&ZohStates::new(2.0 * o.zeta_nm * o.omega_nm_rad_s, w2, ts)),
            operator_output: [w2 * o.k_e, w2 * o.k_e_dot()],
            element: TwoStateSystem::of(&ZohStates::new(c.omega_b_rad_s, 0.0, ts)),
            element_input,
            element_output,
            k_n: p.k_n,
            delay,
        }
    }
}
