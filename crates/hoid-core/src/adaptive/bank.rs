//! The hypotheses with their probabilities, for output and signals behind the whitening filter.

use super::{
    Suppositions,
    change::{Change, Watch, delay_of},
    delays::ByDelay,
    hypothesis::{Hypothesis, OPERATOR},
};

/// The hypotheses. M is the room for them.
#[derive(Debug, Clone, PartialEq)]
pub struct Bank<const M: usize> {
    suppositions: Suppositions,
    hypotheses: [Option<Hypothesis>; M],
    samples: u64,
    wait: u32,
    births: u32,
    /// Sample from which hypotheses of a change of omega_nm and zeta_nm are born.
    whole_from: u64,
    watch: Watch,
}

crate::state!([const M: usize] Bank<M> { hypotheses, samples, wait, births, whole_from, watch });

/// Mean of the mixture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mixture {
    /// `[K_e, K_e_dot, omega_nm, zeta_nm]`.
    pub eta: [f64; OPERATOR],
    /// Innovation variance.
    pub variance: f64,
}

/// Delays on either side of the likeliest that are proposed as what held all the time.
const NEIGHBOURS: usize = 3;
/// Least probability of a hypothesis.
const LEAST: f64 = 1e-12;

impl<const M: usize> Bank<M> {
    /// Starts from one hypothesis. `None` without room for two, for a start that is not within the bounds or not finite, or for bounds that let omega_nm or
    /// zeta_nm become zero.
    pub fn new(first: Hypothesis, suppositions: Suppositions) -> Option<Self> {
        let s = &suppositions;
        let eta = first.eta;
        let inside = eta.iter().zip(&s.bounds).all(|(e, [low, high])| low <= e && e <= high);
        let sound = M >= 2
            && inside
            && s.bounds[2][0] > 0.0
            && s.bounds[3][0] > 0.0
            && s.sample_time > 0.0
            && s.spacing > 0
            && (0.0..1.0).contains(&(s.hazard * f64::from(s.spacing)))
            && (s.delays.every > 0 && s.delays.births > 0 && first.later < s.delays.count)
            && (0.0..0.5).contains(&s.delays.neighbour)
            && s.delays.jump > 0.0
            && first.is_sound();
        if !sound {
            return None;
        }
        let mut hypotheses = core::array::from_fn(|_| None);
        hypotheses[0] = Some(first);
        let mut bank = Self {
            hypotheses,
            samples: 0,
            wait: s.spacing,
            births: 0,
            whole_from: 0,
            watch: Watch::default(),
            suppositions,
        };
        bank.bear_beside();
        Some(bank)
    }

    /// Takes output and signals of a sample behind the whitening filter, `None` where they are not known; returns the innovation.
    pub fn take(&mut self, seen: Option<(f64, ByDelay<'_>)>, about: [f64; 2]) -> f64 {
        let innovation = self.learn(seen, about);
        if self.watch.look(&self.hypotheses, self.samples, &self.suppositions) {
            self.wait_for_whole();
        }
        innovation
    }

    /// Gains that jump pass through the neuromuscular system, and for a while the person is neither what he was nor what he will be: nothing is learnt
    /// of omega_nm and zeta_nm then. Hypotheses of their change begin anew when that is over.
    fn wait_for_whole(&mut self) {
        self.whole_from = self.samples + self.suppositions.settled;
        let mut rest = 0.0;
        for h in self.hypotheses.iter().flatten() {
            rest += if self.is_young_whole(h) { 0.0 } else { h.weight };
        }
        if rest > 0.0 {
            for i in 0..M {
                self.hypotheses[i] = self.hypotheses[i].filter(|h| !self.is_young_whole(h));
                if let Some(h) = &mut self.hypotheses[i] {
                    h.weight /= rest;
                }
            }
        }
    }

    /// A hypothesis that omega_nm and zeta_nm changed within the last seconds.
    fn is_young_whole(&self, h: &Hypothesis) -> bool {
        h.whole && self.samples - h.born < self.suppositions.recent
    }

    /// As [`Bank::take`], and does not look for changes.
    pub fn learn(&mut self, seen: Option<(f64, ByDelay<'_>)>, about: [f64; 2]) -> f64 {
        self.samples += 1;
        let mut innovation = 0.0;
        if let Some((y, signals)) = seen {
            for h in self.hypotheses.iter_mut().flatten() {
                let (eps, density) = h.step(y, signals.at(h.later), about, &self.suppositions);
                innovation += h.weight * eps;
                h.weight *= density;
            }
            self.weigh();
        }
        self.wait -= 1;
        if self.wait == 0 {
            self.wait = self.suppositions.spacing;
            self.drift();
            self.births = self.births.wrapping_add(1);
            let share = self.suppositions.hazard * f64::from(self.suppositions.spacing);
            self.bear_changed(share, false);
            let every = self.suppositions.whole_every;
            if every > 0 && self.births.is_multiple_of(every) && self.samples >= self.whole_from {
                self.bear_changed(share * f64::from(every) * self.suppositions.whole_odds, true);
            }
            let delays = self.suppositions.delays;
            if delays.count > 1 && self.births.is_multiple_of(delays.every) {
                self.bear_beside();
                self.bear_elsewhere(share * f64::from(delays.every) * delays.odds);
            }
        }
        innovation
    }

    /// Counts a sample; the estimate stays.
    pub fn pass(&mut self) {
        self.samples += 1;
    }

    /// Brings the sum of the probabilities to one. What has become impossible, or not finite, is nearly so.
    fn weigh(&mut self) {
        let mut most = 0.0;
        for h in self.hypotheses.iter().flatten() {
            if h.weight > most {
                most = h.weight;
            }
        }
        let (scale, mut sum) = (1.0 / most, 0.0);
        for h in self.hypotheses.iter_mut().flatten() {
            let weight = h.weight * scale;
            h.weight = if weight > LEAST { weight } else { LEAST };
            sum += h.weight;
        }
        let scale = 1.0 / sum;
        for h in self.hypotheses.iter_mut().flatten() {
            h.weight *= scale;
        }
    }

    fn drift(&mut self) {
        for h in self.hypotheses.iter_mut().flatten() {
            h.drift(self.samples, &self.suppositions);
        }
    }

    /// The hypothesis that the gains change now, omega_nm and zeta_nm too or not, with its probability.
    fn bear_changed(&mut self, share: f64, whole: bool) {
        if let Some((place, parent)) = self.parent() {
            self.bear(self.opened(&parent, whole), share, place);
        }
    }

    /// Hypotheses of the delays next to the likeliest, where there are none.
    fn bear_beside(&mut self) {
        let Some((place, parent)) = self.parent() else { return };
        let delays = self.suppositions.delays;
        let mut share = 1.0;
        for away in 1..=NEIGHBOURS {
            share *= delays.neighbour;
            for later in [parent.later.checked_sub(away), Some(parent.later + away)]
                .into_iter()
                .flatten()
            {
                let is_there = |h: &Hypothesis| h.later == later && h.born == parent.born;
                if later < delays.count && !self.hypotheses().any(is_there) {
                    self.bear(parent.beside(later, &self.suppositions), share, place);
                }
            }
        }
    }

    /// Hypotheses that the delay changes too, with the probability of them all.
    fn bear_elsewhere(&mut self, share: f64) {
        let Some((place, parent)) = self.parent() else { return };
        let delays = self.suppositions.delays;
        let apart = delays.count.div_ceil(delays.births);
        let first = (self.births / delays.every) as usize % apart;
        let density = |later: usize| {
            let step = later.abs_diff(parent.later) as f64 / delays.jump;
            libm::exp(-0.5 * step * step)
        };
        let all: f64 = (first..delays.count).step_by(apart).map(density).sum();
        if all <= 0.0 {
            return;
        }
        for later in (first..delays.count)
            .step_by(apart)
            .filter(|later| *later != parent.later)
        {
            self.bear(
                self.opened(&parent, false).delayed(later),
                share * density(later) / all,
                place,
            );
        }
    }

    /// The likeliest hypothesis, and its place. What a jump of the gains does to omega_nm and zeta_nm in passing is not handed on.
    fn parent(&self) -> Option<(usize, Hypothesis)> {
        let (mut likeliest, mut highest) = (None, 0.0);
        for (place, h) in self.hypotheses.iter().enumerate() {
            if let Some(h) = h
                && h.weight > highest
                && !self.is_young_whole(h)
            {
                (likeliest, highest) = (Some((place, *h)), h.weight);
            }
        }
        likeliest
    }

    /// A child that says that the person changes now.
    fn opened(&self, parent: &Hypothesis, whole: bool) -> Hypothesis {
        let mut child = parent.opened(self.samples, whole, &self.suppositions);
        child.before.delay = self.delay();
        child
    }

    /// Takes a child in the place of the least likely that is old enough, its parent excepted.
    fn bear(&mut self, mut child: Hypothesis, share: f64, parent: usize) {
        let (mut place, mut lowest) = (None, f64::INFINITY);
        for (i, h) in self.hypotheses.iter().enumerate() {
            match h {
                None => (place, lowest) = (Some(i), f64::NEG_INFINITY),
                Some(h) if self.samples - h.born >= self.suppositions.protected && h.weight < lowest => {
                    (place, lowest) = (Some(i), h.weight);
                }
                Some(_) => {}
            }
        }
        let Some(place) = place.filter(|place| *place != parent) else {
            return;
        };
        self.hypotheses[place] = None;
        let rest: f64 = self.hypotheses.iter().flatten().map(|h| h.weight).sum();
        for h in self.hypotheses.iter_mut().flatten() {
            h.weight *= (1.0 - share) / rest;
        }
        child.weight = share;
        self.hypotheses[place] = Some(child);
    }

    /// Mean of the mixture.
    pub fn mixture(&self) -> Mixture {
        let mut mixture = Mixture {
            eta: [0.0; OPERATOR],
            variance: 0.0,
        };
        for h in self.hypotheses.iter().flatten() {
            for i in 0..OPERATOR {
                mixture.eta[i] += h.weight * h.eta[i];
            }
            mixture.variance += h.weight * h.level.variance();
        }
        mixture
    }

    /// Covariance of eta.
    pub fn covariance(&self) -> [[f64; OPERATOR]; OPERATOR] {
        let mean = self.mixture().eta;
        let mut covariance = [[0.0; OPERATOR]; OPERATOR];
        for h in self.hypotheses.iter().flatten() {
            let p = h.covariance.matrix();
            for i in 0..OPERATOR {
                let a = h.eta[i] - mean[i];
                for j in 0..OPERATOR {
                    let b = h.eta[j] - mean[j];
                    covariance[i][j] += h.weight * (p[i][j] + a * b);
                }
            }
        }
        covariance
    }

    /// T_L in s and its variance, from `E[K_e K_e_dot]/E[K_e^2]`.
    pub fn lead(&self, covariance: &[[f64; OPERATOR]; OPERATOR]) -> [f64; 2] {
        let [k_e, k_e_dot, ..] = self.mixture().eta;
        let square = k_e * k_e + covariance[0][0];
        let lead = (k_e * k_e_dot + covariance[0][1]) / square;
        // d T_L = (d K_e_dot - T_L d K_e)/K_e.
        let of_ratio = covariance[1][1] - 2.0 * lead * covariance[0][1] + lead * lead * covariance[0][0];
        [lead, of_ratio.max(0.0) / square]
    }

    /// Number of delays in question.
    pub fn delays(&self) -> usize {
        self.suppositions.delays.count
    }

    /// Mean and variance of the delay, in samples beyond the shortest.
    pub fn delay(&self) -> [f64; 2] {
        delay_of(self.hypotheses())
    }

    /// The delay of the likeliest hypothesis.
    pub fn likeliest_delay(&self) -> usize {
        let likeliest = self.hypotheses().max_by(|a, b| a.weight.total_cmp(&b.weight));
        likeliest.map_or(0, |h| h.later)
    }

    /// The hypotheses that there are.
    pub fn hypotheses(&self) -> impl Iterator<Item = &Hypothesis> {
        self.hypotheses.iter().flatten()
    }

    /// Logarithm of the odds that the person changed within the last `recent` samples.
    pub fn odds(&self) -> f64 {
        self.watch.odds()
    }

    /// The change that was declared at the last sample, if it was then.
    pub fn change(&self) -> Option<Change> {
        self.watch.change()
    }

    /// Samples so far.
    pub fn samples(&self) -> u64 {
        self.samples
    }
}
