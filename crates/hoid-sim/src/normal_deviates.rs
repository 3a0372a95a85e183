//! Standard normal deviates from a generator of random bits.
//!
//! The deviates are the same as in `rand_distr`, by the ziggurat method. The area below the density is divided into 256
//! layers of equal area. A random layer i and a random position in it give a deviate directly if the position is within
//! the next, narrower layer, which happens 99 times out of 100 (G. Marsaglia and W. W. Tsang, *J. Statistical Software*
//! 5 (2000) 8; J. A. Doornik, *An Improved Ziggurat Method to Generate Normal Random Samples*, 2005). Such deviates are
//! computed here, many at a time; the other deviates are computed by `rand_distr` from the same random numbers. The
//! results are therefore the same as with `rand_distr`, but take less time.

use std::{convert::Infallible, sync::OnceLock};

use rand_chacha::{
    ChaCha8Rng,
    rand_core::{Rng, TryRng},
};
use rand_distr::{Distribution, StandardNormal};

/// Writes standard normal deviates, each computed from the random numbers that [`StandardNormal`] would use for it.
pub(crate) fn normal_deviates(generator: ChaCha8Rng, deviates: &mut [f64]) {
    let generator = &mut BufferedGenerator::new(generator);
    let edges = EDGES.get_or_init(edges);
    let mut done = 0;
    while done < deviates.len() {
        let mut count = 0;
        for (value, bytes) in deviates[done..].iter_mut().zip(generator.unused_numbers()) {
            let Some(deviate) = accepted_deviate(edges, u64::from_le_bytes(*bytes)) else {
                break;
            };
            *value = deviate;
            count += 1;
        }
        generator.advance(count);
        done += count;
        if let Some(value) = deviates.get_mut(done) {
            *value = StandardNormal.sample(generator);
            done += 1;
        }
    }
}

/// Edges of the layers of the ziggurat, from the widest layer to zero.
static EDGES: OnceLock<[f64; LAYER_COUNT + 1]> = OnceLock::new();
const LAYER_COUNT: usize = 256;

/// Returns the deviate for random bits if it is accepted directly; the lowest bits give the layer, the highest bits the
/// position in the layer.
#[inline(always)]
fn accepted_deviate(edges: &[f64; LAYER_COUNT + 1], bits: u64) -> Option<f64> {
    let layer = bits as usize % LAYER_COUNT;
    // The highest 52 bits give a number in the range [2, 4), from which 3 is subtracted.
    let place = f64::from_bits(1024 << 52 | bits >> 12) - 3.0;
    let deviate = place * edges[layer];
    (deviate.abs() < edges[layer + 1]).then_some(deviate)
}

/// Returns the edges used by `rand_distr`: each edge is computed as twice the deviate in the middle of its layer, which
/// is always accepted.
fn edges() -> [f64; LAYER_COUNT + 1] {
    let mut edges = [0.0; LAYER_COUNT + 1];
    for (layer, edge) in (0..).zip(&mut edges[..LAYER_COUNT]) {
        let middle: f64 = StandardNormal.sample(&mut MidLayerGenerator(layer));
        *edge = 2.0 * middle;
    }
    edges
}

/// Generator whose first number belongs to the middle of a layer; all further numbers are the largest possible number.
struct MidLayerGenerator(u64);

impl TryRng for MidLayerGenerator {
    type Error = Infallible;

    fn try_next_u32(&mut self) -> Result<u32, Infallible> {
        Ok(self.next_u64() as u32)
    }

    fn try_next_u64(&mut self) -> Result<u64, Infallible> {
        Ok(std::mem::replace(&mut self.0, u64::MAX) | 3 << 62)
    }

    fn try_fill_bytes(&mut self, bytes: &mut [u8]) -> Result<(), Infallible> {
        bytes.fill(u8::MAX);
        Ok(())
    }
}

/// Number of bytes that are drawn at a time.
const BUFFER_BYTES: usize = 2048;

/// Random numbers of a generator, drawn many at a time: the numbers are the same, but take half the time.
struct BufferedGenerator {
    generator: ChaCha8Rng,
    bytes: [u8; BUFFER_BYTES],
    position: usize,
}

impl BufferedGenerator {
    fn new(generator: ChaCha8Rng) -> Self {
        Self {
            generator,
            bytes: [0; BUFFER_BYTES],
            position: BUFFER_BYTES,
        }
    }

    /// Returns the drawn numbers that have not been used.
    #[inline(always)]
    fn unused_numbers(&self) -> &[[u8; 8]] {
        self.bytes[self.position..].as_chunks().0
    }

    /// Marks this number of drawn numbers as used.
    #[inline(always)]
    fn advance(&mut self, numbers: usize) {
        self.position += 8 * numbers;
    }

    #[inline(always)]
    fn next<const N: usize>(&mut self) -> [u8; N] {
        let mut next = [0; N];
        match self.bytes.get(self.position..self.position + N) {
            Some(bytes) => {
                next.copy_from_slice(bytes);
                self.position += N;
            }
            None => self.fill_across_end(&mut next),
        }
        next
    }

    #[cold]
    #[inline(never)]
    fn fill_across_end(&mut self, next: &mut [u8]) {
        for byte in next {
            if self.position == BUFFER_BYTES {
                self.generator.fill_bytes(&mut self.bytes);
                self.position = 0;
            }
            *byte = self.bytes[self.position];
            self.position += 1;
        }
    }
}

impl TryRng for BufferedGenerator {
    type Error = Infallible;

    #[inline(always)]
    fn try_next_u32(&mut self) -> Result<u32, Infallible> {
        Ok(u32::from_le_bytes(self.next()))
    }

    #[inline(always)]
    fn try_next_u64(&mut self) -> Result<u64, Infallible> {
        Ok(u64::from_le_bytes(self.next()))
    }

    fn try_fill_bytes(&mut self, bytes: &mut [u8]) -> Result<(), Infallible> {
        self.fill_across_end(bytes);
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use rand_chacha::rand_core::SeedableRng;

    use super::*;

    #[test]
    fn buffered_generator_gives_the_same_numbers() {
        let mut alone = ChaCha8Rng::from_seed([7; 32]);
        let mut buffered = BufferedGenerator::new(ChaCha8Rng::from_seed([7; 32]));
        for round in 0..4000 {
            assert_eq!(alone.next_u64(), buffered.next_u64());
            if round % 5 == 0 {
                assert_eq!(alone.next_u32(), buffered.next_u32());
            }
        }
        let (mut a, mut b) = ([0; 100], [0; 100]);
        alone.fill_bytes(&mut a);
        buffered.fill_bytes(&mut b);
        assert_eq!(a, b);
    }

    #[test]
    fn deviates_match_the_library() {
        let edges = edges();
        assert!(edges.windows(2).all(|pair| pair[0] > pair[1]), "{edges:?}");
        // Many thousands of the deviates are not accepted directly, and several hundred are in the tail.
        let mut found = vec![0.0; 1_000_003];
        normal_deviates(ChaCha8Rng::from_seed([3; 32]), &mut found);
        let mut alone = ChaCha8Rng::from_seed([3; 32]);
        for value in found {
            let expected: f64 = StandardNormal.sample(&mut alone);
            assert_eq!(value.to_bits(), expected.to_bits());
        }
    }
}
