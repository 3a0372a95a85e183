//! The seal of saved numbers: a checksum that is appended to the numbers. Numbers that were altered, truncated or
//! reordered are rejected.
//!
//! A slightly wrong state is worse than none: an index outside a ring aborts the process, and an invalid covariance
//! matrix gives error bars that are too small. The checksum is FNV-1a (Fowler, Noll, Vo, 1991; offset basis and prime
//! of 64 bits) over the bits of the numbers in their order; its upper 53 bits are stored as an integer, which every
//! notation of an f64 preserves. All NaN values count as equal, since languages do not preserve their bits. The seal
//! protects against damage, not against an adversary, who can compute it too.

const FNV_OFFSET_BASIS: u64 = 0xcbf2_9ce4_8422_2325;
const FNV_PRIME: u64 = 0x0000_0100_0000_01b3;
/// Number of bits of an integer that an f64 represents exactly.
const EXACT_BITS: u32 = 53;

/// Returns the numbers with their seal.
pub fn sealed(mut numbers: Vec<f64>) -> Vec<f64> {
    numbers.push(seal(&numbers));
    numbers
}

/// Returns the numbers without their seal; `None` if the seal does not match.
pub fn unsealed(sealed: &[f64]) -> Option<&[f64]> {
    let (stated, numbers) = sealed.split_last()?;
    (stated.to_bits() == seal(numbers).to_bits()).then_some(numbers)
}

fn seal(numbers: &[f64]) -> f64 {
    let bits = |number: &f64| {
        if number.is_nan() {
            f64::NAN.to_bits()
        } else {
            number.to_bits()
        }
    };
    let bytes = numbers.iter().flat_map(|number| bits(number).to_le_bytes());
    let sum = bytes.fold(FNV_OFFSET_BASIS, |sum, byte| {
        (sum ^ u64::from(byte)).wrapping_mul(FNV_PRIME)
    });
    (sum >> (u64::BITS - EXACT_BITS)) as f64
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    #[test]
    fn seal_is_fnv_1a() {
        // The published checksum of no bytes is the offset basis; the checksum of eight zero bytes follows by hand.
        assert_eq!(sealed(Vec::new()), [(FNV_OFFSET_BASIS >> 11) as f64]);
        let eight = (0..8).fold(FNV_OFFSET_BASIS, |sum, _| sum.wrapping_mul(FNV_PRIME));
        assert_eq!(sealed(vec![0.0])[1], (eight >> 11) as f64);
    }

    #[test]
    fn changed_sealed_numbers_are_refused() {
        let numbers = vec![1.0, -0.0, f64::NAN, f64::INFINITY, 5e-324];
        let whole = sealed(numbers.clone());
        assert_eq!(unsealed(&whole).unwrap().len(), numbers.len());
        let mut other = whole.clone();
        other[2] = -f64::NAN;
        assert!(unsealed(&other).is_some(), "NaN is NaN");
        other[1] = 0.0;
        assert!(unsealed(&other).is_none());
        other = whole.clone();
        other.swap(0, 3);
        assert!(unsealed(&other).is_none());
        assert!(unsealed(&whole[1..]).is_none() && unsealed(&whole[..5]).is_none() && unsealed(&[]).is_none());
    }
}
