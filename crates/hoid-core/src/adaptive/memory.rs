//! Length of the memory of a filter. For each signal it holds the samples of a replay and, for the history and for its
//! replay, as many samples as the longest delay needs.

use super::{history::ring_count, prior::LONGEST_DELAY_S};

/// Maximum number of samples in a replay.
const MAX_REPLAY_SAMPLES: f64 = 12_000.0;

/// Returns the number of past errors that must be stored for the longest delay. The sample time is in s.
pub fn errors_needed(sample_time: f64) -> usize {
    libm::ceil(LONGEST_DELAY_S / sample_time) as usize + 4
}

/// Returns the minimum length of the memory in numbers. The sample time is in s.
pub fn min_memory(sample_time: f64) -> usize {
    min_memory_of(1, sample_time)
}

pub(super) fn min_memory_of(inputs: usize, sample_time: f64) -> usize {
    ring_count(inputs) * errors_needed(sample_time)
}

/// Returns the length of the memory, in numbers, for replays over `seconds`. The sample time is in s.
pub fn memory_needed(sample_time: f64, seconds: f64) -> usize {
    memory_needed_for(1, sample_time, seconds)
}

/// Like [`memory_needed`], for a model with the given number of inputs.
pub fn memory_needed_for(inputs: usize, sample_time: f64, seconds: f64) -> usize {
    let samples = (seconds / sample_time).clamp(0.0, MAX_REPLAY_SAMPLES);
    ring_count(inputs) * (2 * errors_needed(sample_time) + libm::ceil(samples) as usize)
}
