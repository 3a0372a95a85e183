//! Array sizes: gains, states, signals, hypotheses, and lags of the noise model; and the places of the numbers of each
//! input in a state.
//!
//! The types of this module have the sizes of a model as parameters: I inputs, S states, M numbers per sample in the
//! sums of a block, and P different products of two states. The state of the first input is `[gains (3), level, d
//! omega, d zeta, d tau]`; each further input adds `[gains (3), d tau]`. The inputs share omega and zeta.

/// Number of gains of the numerator.
pub const GAIN_COUNT: usize = 3;
/// Number of parameters that change only by small corrections: natural frequency, damping, delay.
pub const DYNAMICS_COUNT: usize = 3;
/// Number of gains plus the level.
pub const LINEAR_COUNT: usize = GAIN_COUNT + 1;
/// Number of states of a model with one input: gains, level and corrections.
pub const STATE_COUNT: usize = LINEAR_COUNT + DYNAMICS_COUNT;
/// Number of states that a further input adds: its gains and the correction of its delay.
pub const FURTHER_STATE_COUNT: usize = GAIN_COUNT + 1;
/// Number of parameters of the reported operator: K_e, K_e_dot and the dynamics.
pub const PARAMETER_COUNT: usize = 2 + DYNAMICS_COUNT;
/// Number of signals of the basis of an input: the states of its filter and the derivative of the last state.
pub const SIGNAL_COUNT: usize = 6;
/// Number of values per sample in the sums of a block of a model with one input: the signals, the level and the output.
pub const SUM_COUNT: usize = SIGNAL_COUNT + 2;
/// Number of different products of two states of a model with one input.
pub const PRODUCT_COUNT: usize = product_count(1);
/// Maximum number of hypotheses in the mixture.
pub const MAX_HYPOTHESES: usize = 28;
/// Number of classes of hypotheses: two forms of the numerator, each with two rates of drift of the gains.
pub const CLASS_COUNT: usize = 4;
/// Maximum number of past changes that a hypothesis stores.
pub const MAX_SEGMENTS: usize = 6;
/// Largest order of the noise model.
pub const MAX_NOISE_ORDER: usize = 24;
/// Number of starting points of the first estimate.
pub const START_COUNT: usize = 8;

/// Number of states of a model with the given number of inputs.
pub const fn state_count(inputs: usize) -> usize {
    STATE_COUNT + (inputs - 1) * FURTHER_STATE_COUNT
}

/// Number of values per sample in the sums of a block.
pub const fn sum_count(inputs: usize) -> usize {
    SUM_COUNT + (inputs - 1) * SIGNAL_COUNT
}

/// Number of different products of two states.
pub const fn product_count(inputs: usize) -> usize {
    let states = state_count(inputs);
    states * (states + 1) / 2
}

/// Number of inputs of a model with S states.
pub(super) const fn input_count(states: usize) -> usize {
    1 + (states - STATE_COUNT) / FURTHER_STATE_COUNT
}

/// Place of the first gain of an input in a state.
#[inline(always)]
pub const fn first_gain(input: usize) -> usize {
    match input {
        0 => 0,
        further => STATE_COUNT + (further - 1) * FURTHER_STATE_COUNT,
    }
}

/// Place of the correction of the delay of an input in a state.
#[inline(always)]
pub const fn delay_place(input: usize) -> usize {
    match input {
        0 => STATE_COUNT - 1,
        further => first_gain(further) + GAIN_COUNT,
    }
}

/// Places of the corrections of omega, zeta and the delay of an input in a state.
#[inline(always)]
pub const fn correction_places(input: usize) -> [usize; DYNAMICS_COUNT] {
    [LINEAR_COUNT, LINEAR_COUNT + 1, delay_place(input)]
}

/// Input to whose response a place in a state belongs; the level, omega and zeta belong to the first.
pub(super) const fn input_of(place: usize) -> usize {
    match place {
        0..STATE_COUNT => 0,
        further => 1 + (further - STATE_COUNT) / FURTHER_STATE_COUNT,
    }
}

/// True for the place of a correction in a state.
#[inline(always)]
pub(super) const fn is_correction(place: usize) -> bool {
    match place {
        0..LINEAR_COUNT => false,
        LINEAR_COUNT..STATE_COUNT => true,
        further => (further - STATE_COUNT) % FURTHER_STATE_COUNT == GAIN_COUNT,
    }
}

/// Gains of an input, and the corrections of omega, zeta and its delay.
#[inline(always)]
pub(super) fn input_part<const S: usize>(state: &[f64; S], input: usize) -> ([f64; GAIN_COUNT], [f64; DYNAMICS_COUNT]) {
    let first = first_gain(input);
    (
        core::array::from_fn(|i| state[first + i]),
        correction_places(input).map(|place| state[place]),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_of_all_inputs_cover_the_state_once() {
        for inputs in 1..4 {
            let mut seen = [0; 20];
            for input in 0..inputs {
                (0..GAIN_COUNT).for_each(|i| seen[first_gain(input) + i] += 1);
                assert_eq!([first_gain(input), delay_place(input)].map(input_of), [input; 2]);
                seen[delay_place(input)] += 1;
                assert!(correction_places(input).into_iter().all(is_correction));
            }
            for place in [GAIN_COUNT, LINEAR_COUNT, LINEAR_COUNT + 1] {
                seen[place] += 1;
            }
            let states = state_count(inputs);
            assert_eq!(input_count(states), inputs);
            assert!(seen[..states].iter().all(|n| *n == 1) && seen[states..].iter().all(|n| *n == 0));
            let corrections = (0..states).filter(|place| is_correction(*place)).count();
            assert_eq!(corrections, 2 + inputs);
        }
    }
}
