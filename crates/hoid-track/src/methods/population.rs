//! The recursion in the basis that people share ([`hoid_core::population`]) behind the face of a
//! recursion: what is usual of people, in seconds.
//!
//! It needs no start fit. The usual person (lag 3 s, neuromuscular system of 11 rad/s and .25, their
//! form `(T_L s + 1)^2/(T_I s + 1)`) is what recorded people have been found to be; the delay begins at
//! that of nk, .2 s where nothing is said, and at half a sample more, for an error that is held. All
//! other numbers were set on simulated people: those whose operator has a lag, whose delay is no whole
//! number of samples, and whose remnant is an autoregression with a level that may change, and those of
//! the conditions C1 to C6, seed 9000; none on recorded people.
//!
//! **What is known of the person** before the first sample is `prior`: what is usual, next to nothing,
//! some parameters, or an earlier fit, whose estimate and covariance it begins with
//! (`beginning`).
//!
//! **What it reports.** Gains of the basis are no parameters of an operator. K_e and K_e_dot are those
//! of the gain and lead that are nearest to it at [`NEAR_RAD_S`], by least squares in
//! `K_e + K_e_dot j omega = Y e^{j tau omega} (1 - omega^2/omega_nm^2 + 2 j zeta omega/omega_nm)`;
//! exactly those of a person who has a gain and a lead. The polynomials are the hold of that, with the
//! delay of nk.

mod beginning;

use beginning::{Beginning, OMEGA_RAD_S, SPREAD, ZETA, known};
use hoid_core::{
    adaptive::prior::OPERATOR,
    population::{
        DRIFTS, GAINS, HELD, LINEAR, PopulationFilter, PopulationPrior, RIVALS, STATES,
        basis::{Basis, Point},
        detector::{BLOCK_S, Detection},
        errors_needed,
        gains::GainPrior,
    },
    state::{State, visit_all},
};
use hoid_ident::{IdentError, settings, settings::Bounds};
use hoid_model::{
    SampleTime, Structure,
    uncertainty::{Estimate, OperatorEstimate},
};

use crate::{
    change::Change,
    guard::GuardOptions,
    memory::Memory,
    method::{About, RecursiveMethod, bad as bad_option, check_delay, check_operator_orders},
    person_prior::PersonPrior,
    recursion::{Recursion, Sample, StepOutcome},
    reported::Reported,
    response::Response,
    setup::{Setup, StartAt},
    start::StartState,
};

/// Standard deviations of the gains' drift in one second, over |Y| at 2 rad/s, and what is supposed
/// of their weights.
const DRIFT: [f64; DRIFTS] = [0.0005, 0.07, 0.3];
const SHARES: [f64; DRIFTS] = [0.9, 0.05, 0.05];
/// Those who have just changed: their drift, the size of the change, their odds, and their life, s.
const NEWBORN: [f64; 2] = [0.1, 0.5];
const ODDS: f64 = 0.01;
const LIFE_S: f64 = 2.0;
/// Degrees of freedom of the innovations, and limit in standard deviations.
const FREEDOM: f64 = 5.0;
const LIMIT: f64 = 3.5;
/// Time constants with which the weights of forms and of drifts are forgotten, s.
const FORM_MEMORY_S: f64 = 60.0;
const DRIFT_MEMORY_S: f64 = 5.0;
/// Order of the noise model when none is named, and the largest; its memory, s.
const USUAL_ND: usize = 16;
const LARGEST_ND: usize = hoid_core::population::LARGEST_ORDER;
const NOISE_MEMORY_S: f64 = 40.0;
/// Time constants of the innovations' variance for the gains and for the detector, s.
const LEVEL_MEMORY_S: [f64; 2] = [5.0, 10.0];
/// Drifts of the level of u in one second, over the root mean square of u: where the gains hardly
/// move, and else.
const OFFSET_DRIFT: [f64; 2] = [0.005, 0.01];
/// Times after which the estimate begins, and neuromuscular system and delay are corrected, s.
const HOLD_S: f64 = 1.0;
const REOPEN_S: f64 = 6.0;
/// Where else somebody may begin: delay, s more than that of nk; natural frequency, rad/s; damping.
/// Corrections find from one of them to what lies between. The first is the usual person.
const ELSEWHERE: [[f64; 3]; RIVALS] = [
    [0.0, OMEGA_RAD_S, ZETA],
    [-0.1, OMEGA_RAD_S, ZETA],
    [-0.05, OMEGA_RAD_S, ZETA],
    [0.05, OMEGA_RAD_S, ZETA],
    [0.1, OMEGA_RAD_S, ZETA],
    [0.15, OMEGA_RAD_S, ZETA],
    [0.0, 7.5, 0.45],
    [0.05, 7.5, 0.45],
    [0.0, 16.0, 0.2],
    [-0.05, 16.0, 0.2],
];
/// Shortest delay of them, s.
const EARLIEST_S: f64 = 0.03;
/// In the first seconds the noise model has not been seen for long, and the errors of what it whitens are
/// too small: they are told `1 + UNLEARNT_S/t` times as large after t seconds. Set on virtual people of
/// another seed than those of the test (`tests/first_seconds.rs`).
const UNLEARNT_S: f64 = 4.0;
/// What a declared change adds to the gains, over |Y| at 2 rad/s.
const JUMP: f64 = 0.3;
/// Frequency in which changes are looked for, rad/s; seconds that are now, and seconds before, at
/// least and at most; blocks that must agree; seconds after a change in which none is declared.
const CHANGE_RAD_S: f64 = 2.5;
const NOW_S: f64 = 5.0;
const BEFORE_S: [f64; 2] = [15.0, 40.0];
const PERSISTENCE: u64 = 2;
const REFRACTORY_S: f64 = 8.0;
/// The threshold in T/c of Y at [`RATE`] false alarms an hour, and by how much it rises with each
/// logarithm of the rate. In 3.9 hours of simulated people without a change (those of the challenge, open
/// seeds, and of C1 and C2 among them, under all their remnants) two blocks one after another passed 7.3,
/// 9.7, 12.4 and 14.4 at 30, 10, 5 and 2 an hour. That of what is held is so much higher, by the same hours
/// (7.3, 9.9, 13.5, 20.7): it is to be the lesser source of alarms.
const THRESHOLD: f64 = 7.5;
const RATE: f64 = 30.0;
const SLOPE: f64 = 2.7;
const OF_HELD: f64 = 1.5;
/// Standard deviation of a change of the delay, s.
const DELAY_CHANGE_S: f64 = 0.05;
/// Frequencies at which gain and lead are nearest, rad/s.
const NEAR_RAD_S: [f64; 3] = [1.0, 2.0, 4.0];

settings! {
    /// Options of the recursion in the basis that people share.
    pub struct PopulationOptions {
        /// False alarms in an hour that are accepted: a lower number finds fewer changes, later
        #[setting(unit("1/h"), bounds(Bounds::PositiveFinite))]
        pub false_alarms: f64 = 1.0,
        /// Standard deviations beyond which an innovation moves the estimate no further
        #[setting(bounds(Bounds::Positive), default("3.5"))]
        pub limit: Option<f64> = None,
        /// What is known of the person before the first sample: population, none, NAME=CENTRE:SPREAD of
        /// omega_nm, zeta_nm, tau_e, T_I (the spread is relative), or an earlier fit of them, a file that
        /// hoid identify --json has printed
        #[setting(default("population"))]
        pub prior: PersonPrior = PersonPrior::Population,
    }
    groups {
        /// The guard.
        pub guard: GuardOptions,
    }
}

impl PopulationOptions {
    fn threshold(&self) -> f64 {
        (THRESHOLD + SLOPE * (RATE / self.false_alarms).ln()).max(1.0)
    }
}

impl RecursiveMethod for PopulationOptions {
    fn about(&self) -> About {
        About {
            name: "population",
            help: "gains in a basis that people share, with a noise model of its own; starts without a fit",
            source: "McRuer and Jex 1967; Magill 1965; Chow 1960; Welch 1947; the book, page Recursive methods",
            structures: &[Structure::BoxJenkins, Structure::OutputError, Structure::General],
            defaults: &[],
        }
    }

    fn usual_nd(&self) -> Option<usize> {
        Some(USUAL_ND)
    }

    /// It follows from the weights of the drifts.
    fn usual_memory(&self, _parameter: &str) -> Memory {
        Memory::Infinite
    }

    fn check(&self, setup: &Setup) -> Result<(), IdentError> {
        check_operator_orders("population", setup)?;
        check_delay(&setup.orders)?;
        let o = &setup.orders;
        if o.nc != 0 || o.nd > LARGEST_ND {
            return Err(bad_option(
                "the noise model of population",
                format!("nc={},nd={}", o.nc, o.nd),
                "nc = 0 and nd of at most 24",
            ));
        }
        let start = match setup.start {
            StartAt::Theta(_) => Some("coefficients"),
            StartAt::Nothing => Some("nothing"),
            StartAt::Span(_) => None,
        };
        if let Some(start) = start {
            return Err(bad_option(
                "the start of population",
                start.to_owned(),
                "a prior in its place: it starts from what is usual of people, from next to nothing (prior = none) or from an \
                 earlier fit of the person; rpem, physical and rls take a start",
            ));
        }
        Ok(())
    }

    fn build(
        &self,
        setup: &Setup,
        from: &StartState,
        sample_time: SampleTime,
    ) -> Result<Box<dyn Recursion>, IdentError> {
        Ok(Box::new(PopulationRecursion::new(self, setup, from, sample_time)?))
    }

    fn is_physical(&self) -> bool {
        true
    }

    fn starts_itself(&self) -> bool {
        true
    }

    fn memory_in_words(&self) -> Option<String> {
        Some(format!(
            "since the last change where nothing changes; a change is declared so that {} false alarms an hour are to be expected",
            self.false_alarms
        ))
    }

    fn is_guarded(&self) -> bool {
        self.guard.is_on(true)
    }

    fn limit(&self) -> f64 {
        self.limit.unwrap_or(LIMIT)
    }

    fn spread_before(&self) -> Option<[f64; HELD]> {
        // What a fit determined is known, whatever the data say.
        let known = self.prior.fit().is_some();
        let Beginning { point, spread } = Beginning::of(&self.prior, 0.0, SampleTime::HUNDREDTH).ok()?;
        (!known).then_some([spread[0] * point.omega, spread[1] * point.zeta, spread[2]])
    }

    fn person_prior(&self) -> Option<&PersonPrior> {
        Some(&self.prior)
    }

    fn set_person_prior(&mut self, prior: PersonPrior) -> bool {
        self.prior = prior;
        true
    }
}

/// What is supposed of people, in samples.
fn prior(options: &PopulationOptions, setup: &Setup, beginning: &Beginning, ts: f64) -> PopulationPrior {
    let Beginning { point: at, spread } = *beginning;
    let blocks = |seconds: f64| (seconds / BLOCK_S).round() as usize;
    PopulationPrior {
        gains: GainPrior {
            drifts: DRIFT,
            shares: SHARES,
            newborn: NEWBORN,
            odds: ODDS,
            life: LIFE_S,
            freedom: FREEDOM,
            limit: options.limit(),
            forgotten: [FORM_MEMORY_S, DRIFT_MEMORY_S].map(|memory| (ts / memory).min(1.0)),
            held: spread,
            sample_time: ts,
        },
        // A structure without a noise model, or with one pole, does not say how it is coloured.
        order: match setup.orders.nd {
            0 | 1 => USUAL_ND,
            nd => nd,
        },
        noise_memory: NOISE_MEMORY_S,
        level_memory: LEVEL_MEMORY_S,
        offset_drift: OFFSET_DRIFT,
        hold: HOLD_S,
        reopen: REOPEN_S,
        jump: JUMP,
        rivals: ELSEWHERE.map(|[later, omega, zeta]| Point {
            tau: (at.tau + later).max(EARLIEST_S),
            omega,
            zeta,
            ..at
        }),
        detection: Detection {
            frequency: CHANGE_RAD_S,
            recent: blocks(NOW_S),
            least: blocks(BEFORE_S[0]),
            most: blocks(BEFORE_S[1]),
            thresholds: [options.threshold(), OF_HELD * options.threshold()],
            held: [OMEGA_RAD_S * SPREAD[0], ZETA * SPREAD[1], DELAY_CHANGE_S],
            persistence: PERSISTENCE,
            refractory: blocks(REFRACTORY_S) as u64,
        },
    }
}

/// What is told of an operator: K_e, K_e_dot, omega, zeta and tau, of gains, level and corrections.
const TOLD: usize = OPERATOR + 1;

/// The filter with its report.
struct PopulationRecursion {
    model: Box<PopulationFilter<Vec<f64>>>,
    /// How far people are from the basis at the beginning.
    spread: [f64; HELD],
    /// True where a fit stands at the beginning.
    known: bool,
    reported: Reported,
}

impl PopulationRecursion {
    fn new(
        options: &PopulationOptions,
        setup: &Setup,
        from: &StartState,
        sample_time: SampleTime,
    ) -> Result<Self, IdentError> {
        let ts = sample_time.s();
        let nk = setup.orders.nk;
        let beginning = Beginning::of(&options.prior, (nk as f64 - 0.5) * ts, sample_time)?;
        let Beginning { point, spread } = beginning;
        let basis = Basis::new(point, ts).ok_or_else(|| unusable(&format!("a delay of {} s", point.tau)))?;
        let fit = options.prior.fit();
        let known = fit.map(|fit| known(fit, &basis, sample_time)).transpose()?;
        let supposed = prior(options, setup, &beginning, ts);
        let model = PopulationFilter::new(basis, supposed, vec![0.0; errors_needed(ts)]);
        let model = match &known {
            Some(known) => model.and_then(|model| model.knowing(known)),
            None => model,
        };
        let model = model.ok_or_else(|| unusable("its delay, sample time, prior or options"))?;
        let mut made = Self {
            model: Box::new(model),
            spread,
            known: known.is_some(),
            reported: Reported::new(from, nk, sample_time),
        };
        if known.is_some() {
            made.report();
        }
        Ok(made)
    }

    /// K_e, K_e_dot, omega_nm, zeta_nm, tau_e.
    fn told(&self) -> [f64; TOLD] {
        let (map, state, held) = (
            self.model.basis().gain_and_lead(&NEAR_RAD_S),
            self.model.gains().state(),
            self.model.held(),
        );
        let gain = |i: usize| (0..GAINS).map(|k| map[i][k] * state[k]).sum();
        // The error of a sample is held: half a sample of the delay is the hold's.
        let hold = 0.5 * self.reported.sample_time_s();
        [gain(0), gain(1), held.omega, held.zeta, (held.tau - hold).max(0.0)]
    }

    /// True for a response of an estimate: that of no gains at all has no size in dB and no phase.
    fn answers(&self, [re, im]: [f64; 2]) -> bool {
        self.model.began() && (re != 0.0 || im != 0.0)
    }

    /// Covariance of gains, level and corrections. Before the corrections are estimated they are as
    /// uncertain as before the first sample.
    fn state_covariance(&self) -> [[f64; STATES]; STATES] {
        let mut c = self.model.gains().covariance();
        if !self.known {
            let seconds = self.model.samples() as f64 * self.reported.sample_time_s();
            let wider = (1.0 + UNLEARNT_S / seconds.max(HOLD_S)).powi(2);
            c.iter_mut().flatten().for_each(|c| *c *= wider);
        }
        if !self.model.corrects() {
            let point = self.model.basis().point();
            for (j, of) in [point.omega, point.zeta, 1.0].into_iter().enumerate() {
                c[LINEAR + j][LINEAR + j] += (of * self.spread[j]).powi(2);
            }
        }
        c
    }

    /// Their covariance.
    fn spread(&self) -> [[f64; TOLD]; TOLD] {
        let (map, c) = (self.model.basis().gain_and_lead(&NEAR_RAD_S), self.state_covariance());
        let mut rows = [[0.0; STATES]; TOLD];
        for (row, gains) in rows.iter_mut().zip(map) {
            row[..GAINS].copy_from_slice(&gains);
        }
        for j in 0..HELD {
            rows[2 + j][LINEAR + j] = 1.0;
        }
        through(&rows, &c)
    }

    fn report(&mut self) {
        let [k_e, k_e_dot, omega, zeta, _] = self.told();
        self.reported.set([k_e, k_e_dot, omega, zeta]);
        self.reported.set_noise(self.model.d());
    }

    /// K_e, K_e_dot, omega, zeta and tau before the last change, and by how much they changed: by nothing
    /// for what did not.
    fn of_change(&self) -> [[Estimate; TOLD]; 2] {
        let detector = self.model.detector();
        let map = self.model.basis().gain_and_lead(&NEAR_RAD_S);
        let (at, hold) = (self.model.origin(), 0.5 * self.reported.sample_time_s());
        let beginning = [at.omega, at.zeta, at.tau - hold];
        // The spans are compared in units of how much this person varies without a change.
        let [of_response, of_held] = detector.usual_levels();
        let gain = |i: usize, state: &[f64], of: &dyn Fn(usize, usize) -> f64| {
            let value = map[i].iter().zip(state).map(|(m, s)| m * s).sum();
            let pairs = (0..GAINS).flat_map(|a| (0..GAINS).map(move |b| (a, b)));
            let variance = pairs.map(|(a, b)| map[i][a] * of(a, b) * map[i][b]).sum();
            Estimate::with_variance(value, variance)
        };
        let (span, whole, by) = (&detector.spans()[0], &detector.whole_spans()[0], detector.difference());
        let before = |i: usize| match i {
            0 | 1 => gain(i, &span.state, &|a, b| of_response * span.covariance[a][b]),
            _ => {
                let k = LINEAR + i - 2;
                Estimate::with_variance(beginning[i - 2] + whole.state[k], of_held * whole.covariance[k][k])
            }
        };
        let difference = |i: usize| match i {
            0 | 1 => gain(i, &by.value, &|a, b| by.covariance[a][b]),
            _ => {
                let k = LINEAR + i - 2;
                Estimate::with_variance(by.value[k], by.covariance[k][k])
            }
        };
        [std::array::from_fn(before), std::array::from_fn(difference)]
    }
}

/// `M C M'`.
fn through<const K: usize>(rows: &[[f64; STATES]; K], c: &[[f64; STATES]; STATES]) -> [[f64; K]; K] {
    let of = |a: &[f64; STATES], b: &[f64; STATES]| -> f64 {
        let each = (0..STATES).map(|i| a[i] * (0..STATES).map(|j| c[i][j] * b[j]).sum::<f64>());
        each.sum()
    };
    std::array::from_fn(|i| std::array::from_fn(|j| of(&rows[i], &rows[j])))
}

/// T that makes `E (K_e_dot - T K_e)^2` least, and its variance.
fn lead_time([k_e, k_e_dot]: [f64; 2], c: &[[f64; 2]; 2]) -> [f64; 2] {
    let square = k_e * k_e + c[0][0];
    let lead = (k_e * k_e_dot + c[0][1]) / square;
    let variance = c[1][1] - 2.0 * lead * c[0][1] + lead * lead * c[0][0];
    [lead, variance.max(0.0) / square]
}

fn unusable(what: &str) -> IdentError {
    IdentError::BadStart {
        reason: format!("the basis of people cannot be made for {what}; check nk and the sample time"),
    }
}

impl State for PopulationRecursion {
    fn visit(&mut self, each: &mut dyn FnMut(&mut f64)) {
        visit_all(&mut [&mut *self.model, &mut self.reported], each);
    }
}

impl Recursion for PopulationRecursion {
    fn step(&mut self, sample: Sample) -> StepOutcome {
        let step = self.model.step(sample.e, sample.u);
        if self.model.began() {
            self.report();
        }
        step.into()
    }

    fn follow(&mut self, sample: Sample) -> StepOutcome {
        self.model.step_without_update(sample.e, sample.u).into()
    }

    fn bridge(&mut self, sample: Sample) {
        self.model.bridge(sample.e);
    }

    fn theta(&self) -> &[f64] {
        self.reported.theta()
    }

    fn covariance(&self, into: &mut [f64]) -> bool {
        if !self.model.began() {
            return false;
        }
        let c = self.spread();
        let whole = std::array::from_fn(|i| std::array::from_fn(|j| c[i][j]));
        self.reported.covariance(&whole, into);
        match self.model.noise().covariance() {
            Some(of_d) => self.reported.set_covariance_of_noise(&of_d, into),
            None => return false,
        }
        true
    }

    fn innovation_variance(&self) -> f64 {
        self.model.variance()
    }

    fn operator(&self) -> Option<OperatorEstimate> {
        let (values, covariance) = (self.told(), self.spread());
        let [k_e, k_e_dot, ..] = values;
        let of_gains = [0, 1].map(|i| [0, 1].map(|j| covariance[i][j]));
        let [lead, lead_variance] = match self.model.began() {
            true => lead_time([k_e, k_e_dot], &of_gains),
            false => [f64::NAN; 2],
        };
        let of = |i: usize| Estimate::with_variance(values[i], covariance[i][i]);
        Some(OperatorEstimate {
            k_e: of(0),
            t_l_s: Estimate::with_variance(lead, lead_variance),
            k_e_dot: of(1),
            omega_nm_rad_s: of(2),
            zeta_nm: of(3),
            tau_e_s: of(4),
        })
    }

    fn change_odds(&self) -> Option<f64> {
        let [of_response, of_held] = self.model.detector().statistics();
        Some(0.5 * of_response.max(of_held / OF_HELD))
    }

    fn change(&self) -> Option<Change> {
        let detector = self.model.detector();
        if !detector.declared() {
            return None;
        }
        let [before, after] = detector.spans();
        let [old, by] = self.of_change();
        let z = |i: usize| match by[i].standard_error {
            Some(error) if error > 0.0 => by[i].value / error,
            _ => 0.0,
        };
        // What did not change is what it was.
        let new = |i: usize| match by[i].value == 0.0 {
            true => old[i],
            false => Estimate {
                value: old[i].value + by[i].value,
                ..by[i]
            },
        };
        let pair = |i: usize| [old[i], new(i)];
        let [of_response, of_held] = detector.usual_levels();
        let log_variance = 2.0 / before.samples + 2.0 / after.samples;
        let level = (after.variance / before.variance).ln() / (log_variance * of_response.max(of_held)).sqrt();
        Some(Change {
            seconds_ago: detector.ago_s(),
            odds: self.change_odds()?,
            k_e: pair(0),
            k_e_dot: pair(1),
            omega_nm_rad_s: pair(2),
            zeta_nm: pair(3),
            tau_e_s: pair(4),
            t_l_s: [old[1].value / old[0].value, new(1).value / new(0).value],
            innovation_variance: [before.variance, after.variance],
            z: [z(0), z(1), z(2), z(3), level, z(4)],
        })
    }

    fn left_behind(&self) -> Option<u64> {
        self.model.left_behind()
    }

    fn response(&self, omega_rad_s: f64) -> Option<Response> {
        let (value, by) = self.model.response_with_derivatives(omega_rad_s);
        self.answers(value).then(|| Response {
            value,
            covariance: through(&by, &self.state_covariance()),
        })
    }

    fn response_value(&self, omega_rad_s: f64) -> Option<[f64; 2]> {
        let value = self.model.response(omega_rad_s);
        self.answers(value).then_some(value)
    }
}

#[cfg(test)]
mod tests;
