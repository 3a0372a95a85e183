//! Competing bases: is somebody else right?
//!
//! The corrections of a basis are of first order, and the likelihood of delay and poles has more than
//! one top: who begins far from where the person is may stay there. So others who begin elsewhere are
//! followed beside, each with gains and a noise model of its own, and
//!
//! `L_i = sum over k of log p_i(u_k | before) - log p(u_k | before)`
//!
//! is the evidence of rival i against the one who is believed, from the time on at which the noise
//! models are known, and fading: who has a long way to go is behind at first. Both give densities of
//! the same output, for D begins with 1; no sample is used before it was foretold (A. P. Dawid, J. Royal
//! Statistical Society A 147 (1984) 278-292: the prequential likelihood). One that is ahead is believed
//! from then on; one that is far behind is given up, and at the end all are: what they cost is paid only
//! while the question is open.
//!
//! Who is not far behind may be right as well, so that the scatter of all operators, each with a weight that
//! falls with its evidence, is part of the error of the one that is told. A contest begins with the first sample, and with every change that is
//! declared: people who change may be elsewhere.

use super::{
    follower::{Follower, Learnt, Past},
    prior::PopulationPrior,
    sizes::{PARAMETERS, RIVALS},
};
use crate::state::{State, visit_all};

/// Time after which samples count, s.
const MATURE_S: f64 = 8.0;
/// Time between two looks, and after which a contest ends, s.
const LOOK_S: f64 = 1.0;
const LONGEST_S: f64 = 40.0;
/// Time constant with which evidence fades: at first it speaks of filters that are not there yet, s.
const MEMORY_S: f64 = 10.0;
/// Evidence from which a rival is believed, and below which one is given up.
const AHEAD: f64 = 14.0;
const BEHIND: f64 = -100.0;
/// Evidence by which a rival counts less in the scatter by a factor of e: it has faded, and many begin anywhere.
const TEMPER: f64 = 10.0;

/// Those who are followed beside.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Contest {
    rivals: [Follower; RIVALS],
    open: [bool; RIVALS],
    evidence: [f64; RIVALS],
    samples: u64,
    /// Mean of d d', d the distance of the others' operators from the one that is believed, by their evidence, at
    /// the last look.
    scatter: [[f64; PARAMETERS]; PARAMETERS],
}

impl State for Contest {
    /// Those who are not followed have no numbers: who is, comes first.
    fn visit(&mut self, each: &mut dyn FnMut(&mut f64)) {
        visit_all(
            &mut [&mut self.open, &mut self.evidence, &mut self.samples, &mut self.scatter],
            each,
        );
        for (rival, _) in self.rivals.iter_mut().zip(self.open).filter(|(_, open)| *open) {
            rival.visit(each);
        }
    }
}

impl Contest {
    /// Nobody but the one who is believed.
    pub fn new(believed: &Follower) -> Self {
        Self {
            rivals: core::array::from_fn(|_| believed.clone()),
            open: [false; RIVALS],
            evidence: [0.0; RIVALS],
            samples: 0,
            scatter: [[0.0; PARAMETERS]; PARAMETERS],
        }
    }

    /// How far the operators of others, who foretell u about as well, are from the one that is believed: means of
    /// the products of their distances. One corrected estimate knows its own top of the likelihood alone.
    pub fn scatter(&self) -> [[f64; PARAMETERS]; PARAMETERS] {
        self.scatter
    }

    /// Begins. Their slow modes go on from those of the one who is believed. At a change all take part,
    /// and their gains may walk at once, as those of the one who is believed do; at the first sample the
    /// one who is believed is the first of them.
    pub fn begin(&mut self, prior: &PopulationPrior, believed: &Follower, past: &Past, at_a_change: bool) {
        let first = usize::from(!at_a_change);
        let delayed = believed.delayed(past);
        for (i, point) in prior.rivals.into_iter().enumerate().skip(first) {
            let basis = believed.place.basis().moved(point, delayed);
            if let Some(mut rival) = basis.and_then(|basis| believed.beside(basis, prior)) {
                if at_a_change {
                    rival.gains.walk_at_once();
                }
                self.rivals[i] = rival;
                self.open[i] = true;
            }
        }
        self.evidence = [0.0; RIVALS];
        self.samples = 0;
        if !at_a_change {
            self.scatter = self.scatter_about(believed);
        }
    }

    /// True while it goes on.
    pub fn is_open(&self) -> bool {
        self.open.contains(&true)
    }

    /// Ends it.
    pub fn end(&mut self) {
        self.open = [false; RIVALS];
    }

    /// Their signals of a sample; no sample is taken.
    pub fn respond(&mut self, past: &Past) {
        for (rival, _) in self.rivals.iter_mut().zip(self.open).filter(|(_, open)| *open) {
            rival.respond(past);
        }
    }

    /// Ends a sample that was not taken, or was.
    pub fn remember(&mut self) {
        for (rival, _) in self.rivals.iter_mut().zip(self.open).filter(|(_, open)| *open) {
            rival.remember();
        }
    }

    /// Takes a sample whose signals are there. True where somebody else is believed from now on.
    pub fn step(
        &mut self,
        prior: &PopulationPrior,
        past: &Past,
        u: f64,
        believed: &mut Follower,
        learnt: &Learnt,
    ) -> bool {
        let ts = prior.gains.sample_time;
        self.samples += 1;
        let counts = self.samples as f64 * ts > MATURE_S;
        for i in 0..RIVALS {
            if !self.open[i] {
                continue;
            }
            match self.rivals[i].step(prior, past, u) {
                Some(own) if counts => {
                    self.evidence[i] += own.log_density - learnt.log_density - self.evidence[i] * ts / MEMORY_S
                }
                Some(_) => {}
                None => self.open[i] = false,
            }
        }
        let every = |seconds: f64| libm::round(seconds / ts).max(1.0) as u64;
        if !counts || !self.samples.is_multiple_of(every(LOOK_S)) {
            return false;
        }
        let taken = self.look(believed);
        if self.samples >= every(LONGEST_S) {
            self.end();
        }
        taken
    }

    fn look(&mut self, believed: &mut Follower) -> bool {
        let mut best = None;
        let mut most = AHEAD;
        for i in 0..RIVALS {
            if self.open[i] && self.evidence[i] > most {
                (best, most) = (Some(i), self.evidence[i]);
            }
        }
        if let Some(best) = best {
            core::mem::swap(believed, &mut self.rivals[best]);
            self.evidence.iter_mut().for_each(|e| *e -= most);
            self.evidence[best] = -most;
        }
        for (open, evidence) in self.open.iter_mut().zip(self.evidence) {
            *open &= evidence > BEHIND;
        }
        self.scatter = self.scatter_about(believed);
        best.is_some()
    }

    fn scatter_about(&self, believed: &Follower) -> [[f64; PARAMETERS]; PARAMETERS] {
        let at = believed.operator();
        let (mut products, mut total) = ([[0.0; PARAMETERS]; PARAMETERS], 1.0);
        for i in 0..RIVALS {
            if !self.open[i] {
                continue;
            }
            let weight = libm::exp(self.evidence[i].min(0.0) / TEMPER);
            total += weight;
            let other = self.rivals[i].operator();
            for a in 0..PARAMETERS {
                for b in 0..PARAMETERS {
                    products[a][b] += weight * (other[a] - at[a]) * (other[b] - at[b]);
                }
            }
        }
        products.map(|row| row.map(|product| product / total))
    }
}
