//! One run of the loop.
//!
//! At sample k, with the parameters in force at its time,
//!
//! `e = f_t - x`, `u = y(k - tau_e/Ts) + n`, `n = K_n z`,
//!
//! where y is the operator's response without delay, x the output of the controlled element and z that of the unit remnant
//! cascade. Each block is then taken over one sample exactly, for an input that is held: the operator driven by e, the
//! controlled element by u, the cascade by one normal deviate. The hold delays the response by one sample more, so that
//! `nk = tau_e/Ts + 1`. The remnant is not delayed.
//!
//! Operator and controlled element are in controllable canonical form (states: output and rate of `1/den`). The operator's
//! gains stand in its output matrix; those of the controlled element where [`Realisation`] says. When parameters change,
//! the matrices of each sample are those of the continuous model with the values at that sample.

use hoid_core::delay::DelayLine;
use hoid_model::{
    Channel, Record,
    scenario::{Realisation, ResolvedScenario, Scenario, TrueParameters},
    schedule::Schedule,
    second_order::HeldStates,
};

use crate::{
    SimError, Stream,
    cascade::{Cascade, MOST},
};

/// A scenario made ready: forcing function, parameters and matrices of every sample.
#[derive(Debug, Clone)]
pub struct Simulator {
    scenario: ResolvedScenario,
    forcing_deg: Vec<f64>,
    /// One entry when nothing changes, else one a sample.
    parameters: Vec<TrueParameters>,
    matrices: Vec<Matrices>,
    cascade: Cascade,
}

#[derive(Debug, Clone, Copy)]
struct Matrices {
    operator: HeldStates,
    operator_output: [f64; 2],
    element: HeldStates,
    element_input: f64,
    element_output: f64,
    k_n: f64,
}

/// The signals of one run, run-in included.
#[derive(Debug, Clone, PartialEq)]
pub struct Signals {
    /// Tracking error e, deg.
    pub e: Vec<f64>,
    /// Control output u, deg.
    pub u: Vec<f64>,
    /// Output of the controlled element x, deg.
    pub x: Vec<f64>,
    /// Remnant n, deg.
    pub n: Vec<f64>,
}

impl Simulator {
    /// Prepares a scenario. Runs share what is computed here.
    ///
    /// # Errors
    /// [`SimError::Model`] when the scenario has no meaning.
    pub fn new(scenario: &Scenario) -> Result<Self, SimError> {
        let resolved = scenario.resolve()?;
        let ts = scenario.sample_time;
        let samples = resolved.run_in_samples() + resolved.measurement_samples();
        let start_s = -(resolved.run_in_samples() as f64) * ts.s();
        let entries = match scenario.schedule {
            Schedule::Constant => 1,
            Schedule::Sigmoid { .. } => samples,
        };
        let parameters: Vec<TrueParameters> = (0..entries)
            .map(|k| resolved.parameters_at(start_s + k as f64 * ts.s()))
            .collect();
        let matrices = parameters.iter().map(|p| Matrices::of(p, scenario)).collect();
        Ok(Self {
            forcing_deg: scenario.forcing.samples(start_s, ts, samples),
            cascade: Cascade::new(scenario.remnant.order, ts.s() / scenario.remnant.time_constant_s),
            parameters,
            matrices,
            scenario: resolved,
        })
    }

    /// The scenario.
    pub fn scenario(&self) -> &ResolvedScenario {
        &self.scenario
    }

    /// Samples of a run: run-in and measurement.
    pub fn samples(&self) -> usize {
        self.forcing_deg.len()
    }

    /// One run as a record of the measurement (or from the start of the run-in): e, u, f_t, x, n and the true parameters.
    ///
    /// # Errors
    /// [`SimError::Diverged`].
    pub fn run(&self, stream: Stream, keep_run_in: bool) -> Result<Record, SimError> {
        let signals = self.signals(&stream.white_noise(self.samples()))?;
        self.record(&signals, keep_run_in)
    }

    /// The signals of a run driven by given white noise of unit variance, one value a sample.
    ///
    /// # Errors
    /// [`SimError::NoiseLength`], [`SimError::NoiseNotFinite`], [`SimError::Diverged`].
    pub fn signals(&self, noise: &[f64]) -> Result<Signals, SimError> {
        let samples = self.samples();
        if noise.len() != samples {
            return Err(SimError::NoiseLength {
                found: noise.len(),
                expected: samples,
            });
        }
        if let Some(index) = noise.iter().position(|v| !v.is_finite()) {
            return Err(SimError::NoiseNotFinite {
                index,
                value: noise[index],
            });
        }
        let mut signals = Signals {
            e: Vec::with_capacity(samples),
            u: Vec::with_capacity(samples),
            x: Vec::with_capacity(samples),
            n: Vec::with_capacity(samples),
        };
        let mut memory = vec![0.0; self.scenario.delay_samples()];
        let mut delay = DelayLine::new(&mut memory);
        let (mut operator, mut element, mut remnant) = ([0.0; 2], [0.0; 2], [0.0; MOST]);
        let constant = self.matrices.len() == 1;
        for (k, (&f, &eps)) in self.forcing_deg.iter().zip(noise).enumerate() {
            let m = &self.matrices[if constant { 0 } else { k }];
            let x = m.element_output * element[0];
            let e = f - x;
            let response = delay.step(m.operator_output[0] * operator[0] + m.operator_output[1] * operator[1]);
            let n = m.k_n * self.cascade.output(&remnant);
            let u = response + n;
            operator = m.operator.step(operator, e);
            element = m.element.step(element, m.element_input * u);
            remnant = self.cascade.step(&remnant, eps);
            signals.e.push(e);
            signals.u.push(u);
            signals.x.push(x);
            signals.n.push(n);
        }
        self.check_finite(&signals)?;
        Ok(signals)
    }

    /// Signals of a whole run with time, units and truth.
    fn record(&self, signals: &Signals, keep_run_in: bool) -> Result<Record, SimError> {
        let run_in = self.scenario.run_in_samples();
        let first = if keep_run_in { 0 } else { run_in };
        let ts = self.scenario.scenario().sample_time;
        let cut = |values: &[f64]| values[first..].to_vec();
        let truth = |get: &dyn Fn(&TrueParameters) -> f64| match self.parameters.as_slice() {
            [only] => vec![get(only); self.samples() - first],
            all => all[first..].iter().map(get).collect(),
        };
        let mut record = Record::new(
            ts,
            Channel::new("e", "deg", cut(&signals.e)),
            Channel::new("u", "deg", cut(&signals.u)),
        )?
        .labelled(self.scenario.scenario().name.clone())
        .starting_at((first as f64 - run_in as f64) * ts.s())
        .with_channel(Channel::new("f_t", "deg", cut(&self.forcing_deg)))?
        .with_channel(Channel::new("x", "deg", cut(&signals.x)))?
        .with_channel(Channel::new("n", "deg", cut(&signals.n)))?;
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
        Ok(record)
    }

    fn check_finite(&self, signals: &Signals) -> Result<(), SimError> {
        for (signal, values) in [("e", &signals.e), ("u", &signals.u)] {
            if let Some(k) = values.iter().position(|v| !v.is_finite()) {
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

impl Matrices {
    fn of(p: &TrueParameters, scenario: &Scenario) -> Self {
        let (o, c, ts) = (&p.operator, &p.controlled_element, scenario.sample_time);
        let w2 = o.omega_nm_rad_s * o.omega_nm_rad_s;
        let (element_input, element_output) = match scenario.realisation {
            Realisation::Input => (c.k_c, 1.0),
            Realisation::Output => (1.0, c.k_c),
        };
        Self {
            operator: HeldStates::new(2.0 * o.zeta_nm * o.omega_nm_rad_s, w2, ts),
            operator_output: [w2 * o.k_e, w2 * o.k_e_dot()],
            element: HeldStates::new(c.omega_b_rad_s, 0.0, ts),
            element_input,
            element_output,
            k_n: p.k_n,
        }
    }
}
