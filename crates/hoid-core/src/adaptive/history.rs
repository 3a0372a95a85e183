//! Ring buffer of the most recent samples of the record, in the memory of the caller.
//!
//! The memory is divided into rings of equal length: the values of each input, the outputs, and the use of each sample.

use crate::state::State;

/// Use of a sample by the recursion.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum SampleUse {
    /// The sample updates the estimate.
    Update,
    /// The sample only advances the filters.
    FilterOnly,
    /// The output is missing; its prediction enters the filters.
    Missing,
    /// The stick is at its upper limit, so the intended output is at least as large as the measured output.
    AtUpperLimit,
    /// The stick is at its lower limit, so the intended output is at most as large as the measured output.
    AtLowerLimit,
}

impl SampleUse {
    const ALL: [Self; 5] = [
        Self::FilterOnly,
        Self::Update,
        Self::Missing,
        Self::AtUpperLimit,
        Self::AtLowerLimit,
    ];

    fn of(number: f64) -> Self {
        Self::ALL.get(number as usize).copied().unwrap_or(Self::FilterOnly)
    }

    fn to_number(self) -> f64 {
        Self::ALL.iter().position(|of| *of == self).unwrap_or(0) as f64
    }
}

/// Number of rings, and of numbers per sample, for a model with the given number of inputs.
pub(super) const fn ring_count(inputs: usize) -> usize {
    inputs + 2
}

/// Rings of the inputs, the outputs and the uses.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct History<E, const I: usize> {
    memory: E,
    samples: u64,
}

impl<E: AsMut<[f64]>, const I: usize> State for History<E, I> {
    fn visit(&mut self, each: &mut dyn FnMut(&mut f64)) {
        self.memory.as_mut().visit(each);
        self.samples.visit(each);
    }
}

impl<E: AsRef<[f64]> + AsMut<[f64]>, const I: usize> History<E, I> {
    /// Indices of the rings after the rings of the inputs.
    const OUTPUT_RING: usize = I;
    const USE_RING: usize = I + 1;

    pub fn new(mut memory: E) -> Self {
        memory.as_mut().fill(0.0);
        Self { memory, samples: 0 }
    }

    /// Capacity in samples.
    pub fn capacity(&self) -> usize {
        self.memory.as_ref().len() / ring_count(I)
    }

    /// Number of samples stored so far, including those already overwritten.
    pub fn sample_count(&self) -> u64 {
        self.samples
    }

    /// Index, in the memory, of a sample in a ring; `None` if there is no memory.
    #[inline(always)]
    fn index(&self, ring: usize, sample: u64) -> Option<usize> {
        let capacity = self.capacity();
        (capacity > 0).then(|| ring * capacity + (sample % capacity as u64) as usize)
    }

    #[inline(always)]
    fn set(&mut self, ring: usize, sample: u64, value: f64) {
        if let Some(place) = self.index(ring, sample) {
            self.memory.as_mut()[place] = value;
        }
    }

    #[inline(always)]
    fn get(&self, ring: usize, sample: u64) -> f64 {
        self.index(ring, sample)
            .map_or(0.0, |place| self.memory.as_ref()[place])
    }

    /// Stores the inputs of a new sample; [`History::complete`] adds the output and the use of the sample.
    #[inline(always)]
    pub fn push(&mut self, inputs: &[f64; I]) {
        for (input, value) in inputs.iter().enumerate() {
            self.set(input, self.samples, *value);
        }
        self.samples += 1;
    }

    /// Stores the output and the use of the newest sample.
    #[inline(always)]
    pub fn complete(&mut self, output: f64, sample_use: SampleUse) {
        let newest = self.samples.saturating_sub(1);
        self.set(Self::OUTPUT_RING, newest, output);
        self.set(Self::USE_RING, newest, sample_use.to_number());
    }

    /// Changes the use of the sample before the newest one if its output was `u` and it updated the estimate.
    pub fn revise_previous(&mut self, u: f64, sample_use: SampleUse) {
        if let Some(previous) = self.samples.checked_sub(2)
            && self.output(previous) == (u, SampleUse::Update)
        {
            self.set(Self::USE_RING, previous, sample_use.to_number());
        }
    }

    /// Value of an input `age` samples before the given sample; zero before the start of the record.
    #[inline(always)]
    pub fn input(&self, input: usize, sample: u64, age: usize) -> f64 {
        sample.checked_sub(age as u64).map_or(0.0, |at| self.get(input, at))
    }

    /// Returns the output of a sample, and how the filter used it ([`SampleUse`]).
    #[inline(always)]
    pub fn output(&self, sample: u64) -> (f64, SampleUse) {
        (
            self.get(Self::OUTPUT_RING, sample),
            SampleUse::of(self.get(Self::USE_RING, sample)),
        )
    }

    /// Removes all samples.
    pub fn clear(&mut self) {
        self.memory.as_mut().fill(0.0);
        self.samples = 0;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_equal_outputs_are_revised() {
        let mut history = History::new([0.0; 30]);
        for u in [1.0, 2.0, 2.0, 1.0] {
            history.push(&[0.5]);
            history.complete(u, SampleUse::Update);
            history.revise_previous(u, SampleUse::AtUpperLimit);
        }
        let uses: [SampleUse; 4] = core::array::from_fn(|k| history.output(k as u64).1);
        assert_eq!(
            uses,
            [
                SampleUse::Update,
                SampleUse::AtUpperLimit,
                SampleUse::Update,
                SampleUse::Update
            ]
        );
    }

    #[test]
    fn last_samples_are_kept_and_earlier_ones_are_zero() {
        let mut history = History::new([9.0; 30]);
        for k in 0..25_u32 {
            history.push(&[f64::from(k)]);
            history.complete(-f64::from(k), SampleUse::ALL[k as usize % 5]);
        }
        assert_eq!((history.capacity(), history.sample_count()), (10, 25));
        for k in 15..25_u64 {
            assert_eq!(history.input(0, 24, (24 - k) as usize), k as f64);
            assert_eq!(history.output(k), (-(k as f64), SampleUse::ALL[k as usize % 5]));
        }
        assert_eq!(history.input(0, 3, 4), 0.0);
        history.clear();
        assert_eq!((history.sample_count(), history.input(0, 0, 0)), (0, 0.0));
        // A memory without room for a sample causes no panic.
        let mut none = History::new([0.0; 2]);
        none.push(&[1.0]);
        none.complete(1.0, SampleUse::Update);
        assert_eq!(none.output(0), (0.0, SampleUse::FilterOnly));
    }
}
