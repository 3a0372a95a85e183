//! Typical values from the record of the start span.
//!
//! The typical value of each mean of a block ([`hoid_core::guard::profile`]) is its median over all blocks. The typical
//! value of each difference is the largest of three estimates of its 99 % quantile: the quantile itself, and the values
//! that follow from the 50 and 95 % quantiles for Gaussian errors. None of these is affected by a few outliers in the
//! span; heavy tails are included. Samples at which a signal stays constant are excluded from the quantiles, as during
//! a run ([`hoid_core::guard::channel`]). Spans in which u rests are learnt too.

use hoid_core::guard::{
    channel::ORDER_COUNT,
    profile::{Block, CHANNEL_COUNT, CONSTANT_FRACTION, Profile},
};
use hoid_model::Record;
use hoid_numerics::statistics::{mean, upper_quantile};

use super::Guard;

/// Quantiles of the magnitude of a Gaussian variable, in standard deviations.
const GAUSSIAN_QUANTILES: [(f64, f64); 3] = [(0.5, 0.6745), (0.95, 1.96), (0.99, 2.5758)];
/// Probability of the inner quantile of the differences, which is estimated directly.
const INNER_QUANTILE_PROBABILITY: f64 = 0.9;
/// Smallest number of blocks of a record from which typical values are learnt.
const MIN_BLOCKS: usize = 5;

impl Guard {
    /// Learns the typical values from a record.
    pub(super) fn prime(&mut self, record: &Record) {
        let output = record.output();
        let silent;
        let input = match record.input() {
            [] => {
                silent = vec![0.0; output.len()];
                &silent
            }
            input => input,
        };
        let signals = [input, output];
        let (mut outer, mut inner) = ([[0.0; ORDER_COUNT]; CHANNEL_COUNT], [[0.0; ORDER_COUNT]; CHANNEL_COUNT]);
        for (c, signal) in signals.iter().enumerate() {
            let mut differences = signal.to_vec();
            let moves = moving_differences(signal);
            for j in 0..ORDER_COUNT {
                differences = differences.windows(2).map(|w| w[1] - w[0]).collect();
                let of_moves: Vec<f64> = differences
                    .iter()
                    .zip(&moves[j..])
                    .filter_map(|(d, moves)| moves.then_some(d.abs()))
                    .collect();
                outer[c][j] = tail_quantile(&of_moves);
                inner[c][j] = quantile(of_moves, INNER_QUANTILE_PROBABILITY);
            }
        }
        output.iter().for_each(|u| self.resting.update(*u));
        let length = self.block_length as usize;
        if output.len() < MIN_BLOCKS * length {
            return;
        }
        let centre = signals.map(|signal| median(signal.to_vec()));
        let blocks: Vec<Block> = (1..output.len() / length)
            .map(|n| {
                let mut block = Block::default();
                for k in n * length..(n + 1) * length {
                    let past = |c: usize, back: usize| signals[c][k - back];
                    let differences = [0, 1].map(|c| {
                        let x: [f64; 5] = std::array::from_fn(|back| past(c, back));
                        [
                            x[0] - x[1],
                            x[0] - 2.0 * x[1] + x[2],
                            x[0] - 3.0 * x[1] + 3.0 * x[2] - x[3],
                            x[0] - 4.0 * x[1] + 6.0 * x[2] - 4.0 * x[3] + x[4],
                        ]
                    });
                    block.add(&differences, [past(0, 0), past(1, 0)], centre);
                }
                block.means()
            })
            .collect();
        let over = |of: &dyn Fn(&Block) -> f64| median(blocks.iter().map(of).collect());
        let typical = Block {
            differences: std::array::from_fn(|c| std::array::from_fn(|j| over(&|b| b.differences[c][j]))),
            magnitude: std::array::from_fn(|c| over(&|b| b.magnitude[c])),
            mean: centre,
            ..Block::default()
        };
        self.profile = Profile::of(&typical);
        for (c, channel) in self.channels.iter_mut().enumerate() {
            channel.set_tails(outer[c], inner[c]);
        }
        self.set_limits();
    }
}

/// Returns the median; zero if there are no values.
fn median(values: Vec<f64>) -> f64 {
    quantile(values, 0.5)
}

/// Returns a quantile of the finite values; zero if there are none.
fn quantile(mut values: Vec<f64>, share: f64) -> f64 {
    values.retain(|v| v.is_finite());
    upper_quantile(&mut values, share).unwrap_or(0.0)
}

/// Returns, for each first difference, whether it is larger than for a constant signal.
fn moving_differences(signal: &[f64]) -> Vec<bool> {
    let sizes: Vec<f64> = signal.windows(2).map(|w| (w[1] - w[0]).abs()).collect();
    let mean = mean(&sizes);
    sizes.iter().map(|size| *size > CONSTANT_FRACTION * mean).collect()
}

/// Returns the 99 % quantile of the magnitudes: the largest of its direct estimate and of two estimates from lower
/// quantiles.
fn tail_quantile(values: &[f64]) -> f64 {
    let magnitudes: Vec<f64> = values.iter().map(|v| v.abs()).collect();
    let scale = GAUSSIAN_QUANTILES.map(|(share, deviations)| quantile(magnitudes.clone(), share) / deviations);
    let [.., (_, deviations)] = GAUSSIAN_QUANTILES;
    deviations * scale.into_iter().fold(0.0, f64::max)
}
