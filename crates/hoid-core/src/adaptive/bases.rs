//! Bases of all inputs: each input has its own delay, and all share the natural frequency, the damping ratio and the
//! lag.

use super::{
    basis::{Basis, Point, Signals},
    sizes::{GAIN_COUNT, SIGNAL_COUNT, correction_places, first_gain, input_part},
};
use crate::state::State;

/// Bases of I inputs.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Bases<const I: usize> {
    all: [Basis; I],
}

impl<const I: usize> State for Bases<I> {
    fn visit(&mut self, each: &mut dyn FnMut(&mut f64)) {
        self.all.visit(each);
    }
}

impl<const I: usize> Bases<I> {
    /// Builds the bases at rest, with the sample time in s; `None` if a point is not valid.
    pub fn new(points: [Point; I], sample_time: f64) -> Option<Self> {
        let built = points.map(|point| Basis::new(point, sample_time));
        let first = built.first()?.clone()?;
        let sound = built.iter().all(Option::is_some);
        sound.then(|| Self {
            all: built.map(|basis| basis.unwrap_or_else(|| first.clone())),
        })
    }

    /// Returns the basis of the error.
    pub fn first(&self) -> &Basis {
        &self.all[0]
    }

    /// Returns the basis of an input.
    pub fn of(&self, input: usize) -> &Basis {
        &self.all[input]
    }

    /// Returns the points of all inputs.
    pub fn points(&self) -> [Point; I] {
        core::array::from_fn(|input| self.all[input].point())
    }

    /// Advances all filters by one sample and returns their signals; `value(input, age)` is the value of an input `age`
    /// samples ago.
    #[inline(always)]
    pub fn step(&mut self, value: impl Fn(usize, usize) -> f64) -> [Signals; I] {
        let mut signals = [[0.0; SIGNAL_COUNT]; I];
        for (input, basis) in self.all.iter_mut().enumerate() {
            let l = basis.delay();
            signals[input] = basis.step([value(input, l), value(input, l + 1), value(input, l + 2)]);
        }
        signals
    }

    /// Returns the weights of the signals of each input in the response at a state.
    #[inline(always)]
    pub fn weights<const S: usize>(&self, state: &[f64; S]) -> [Signals; I] {
        let mut weights = [[0.0; SIGNAL_COUNT]; I];
        for (input, weights) in weights.iter_mut().enumerate() {
            let (gains, corrections) = input_part(state, input);
            *weights = self.all[input].weights(&gains, &corrections);
        }
        weights
    }

    /// Returns the factors that convert a state to the units of the gains of the bases `to`.
    pub fn unit_conversion<const S: usize>(&self, to: &Self) -> [f64; S] {
        let mut units = [1.0; S];
        for input in 0..I {
            let own = self.all[input].gain_conversion(&to.all[input]);
            units[first_gain(input)..][..GAIN_COUNT].copy_from_slice(&own);
        }
        units
    }

    /// Converts a state to the coordinates of the bases `to`: the gains are converted to the units of `to`, and the
    /// corrections are taken relative to the points of `to`.
    pub fn convert_state<const S: usize>(&self, to: &Self, state: &[f64; S]) -> [f64; S] {
        let (units, moved) = (self.unit_conversion::<S>(to), to.corrections::<S>(&self.points()));
        core::array::from_fn(|i| state[i] * units[i] + moved[i])
    }

    /// Returns the state whose corrections lead from the points of these bases to other points; all gains are zero.
    pub fn corrections<const S: usize>(&self, to: &[Point; I]) -> [f64; S] {
        let mut state = [0.0; S];
        for input in 0..I {
            let (from, to) = (self.all[input].point(), to[input]);
            let moved = [to.omega - from.omega, to.zeta - from.zeta, to.tau - from.tau];
            for (place, moved) in correction_places(input).into_iter().zip(moved) {
                state[place] = moved;
            }
        }
        state
    }
}
