//! A channel for the tests of this folder.

/// `x(t) = 1.6 x(t-1) - 0.8 x(t-2) + eps(t)` with eps of unit variance, nearly normal.
pub fn autoregressive_signal(n: usize, seed: u64) -> Vec<f64> {
    let mut state = seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1;
    let mut draw = || {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
    };
    let (mut one, mut two) = (0.0, 0.0);
    let mut next = || {
        let v = 1.6 * one - 0.8 * two + (0..12).map(|_| draw()).sum::<f64>();
        (one, two) = (v, one);
        v
    };
    // Omits the transient after the start from rest.
    for _ in 0..100 {
        next();
    }
    (0..n).map(|_| next()).collect()
}
