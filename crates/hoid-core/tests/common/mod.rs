//! Data and the plain form of the covariance, shared by the tests.
#![allow(dead_code)]

use hoid_core::{
    adaptation::Forgetting, covariance::Covariance, error_bars::ErrorBars, innovation_variance::InnovationVariance,
    shape::AnyShape, ud_covariance::UdCovariance,
};

/// Pseudo-random numbers, uniform with unit variance.
pub struct Noise(pub u64);

impl Noise {
    pub fn next(&mut self) -> f64 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        ((self.0 >> 11) as f64 / (1u64 << 53) as f64 - 0.5) * 12f64.sqrt()
    }
}

/// Returns the input and output of `u = (B/F) x + (C/D) eps` with two poles of an operator at 100 Hz; x is in the units
/// of a tracking error.
pub fn box_jenkins(samples: usize, seed: u64, level: f64) -> Vec<(f64, f64)> {
    let mut noise = Noise(seed);
    let (mut w, mut x1, mut n, mut eps1, mut slow) = ([0.0; 2], 0.0, 0.0, 0.0, 0.0);
    (0..samples)
        .map(|_| {
            slow = 0.97 * slow + 0.3 * noise.next();
            let x = slow;
            let response = 0.0443 * x - 0.0432 * x1 + 1.9121 * w[0] - 0.9243 * w[1];
            x1 = x;
            w = [response, w[0]];
            let eps = level * noise.next();
            n = 0.85 * n + eps + 0.3 * eps1;
            eps1 = eps;
            (x, response + n)
        })
        .collect()
}

/// P by rows, updated as printed in the thesis and made symmetric at each sample: the reference for the factored form.
pub struct PlainCovariance<const N: usize> {
    pub p: [[f64; N]; N],
    pub power: f64,
    pub largest: f64,
}

impl<const N: usize> PlainCovariance<N> {
    pub fn times(&self, psi: &[f64; N]) -> [f64; N] {
        std::array::from_fn(|i| (0..N).map(|j| self.p[i][j] * psi[j]).sum())
    }

    pub fn measure(&mut self, psi: &[f64; N], variance: f64) -> [f64; N] {
        let product = self.times(psi);
        let denominator = variance + (0..N).map(|i| psi[i] * product[i]).sum::<f64>();
        for i in 0..N {
            for j in 0..N {
                self.p[i][j] -= product[i] * product[j] / denominator;
            }
        }
        product.map(|v| v / denominator)
    }

    pub fn scale(&mut self, s: &[f64; N]) {
        for i in 0..N {
            for j in 0..N {
                self.p[i][j] *= s[i] * s[j];
            }
        }
    }

    /// Processes one sample, without the guard against windup; `variance` is the innovation variance for variable
    /// forgetting.
    pub fn update(&mut self, forgetting: &Forgetting<N>, psi: &[f64; N], eps: f64, variance: f64) -> [f64; N] {
        match forgetting {
            Forgetting::Exponential { lambda } => {
                self.scale(&lambda.map(|l| l.powf(-0.5)));
                self.measure(psi, 1.0)
            }
            Forgetting::RandomWalk { drift } => {
                for i in 0..N {
                    self.p[i][i] += drift[i];
                }
                self.measure(psi, 1.0)
            }
            Forgetting::Variable { memory, smallest } => {
                let along: f64 = self.times(psi).iter().zip(psi).map(|(a, b)| a * b).sum();
                let gain = self.measure(psi, 1.0);
                let expected = (1.0 + along) * memory * variance;
                let lambda = if expected > 0.0 {
                    (1.0 - eps * eps / expected).clamp(*smallest, 1.0)
                } else {
                    1.0
                };
                self.scale(&[lambda.powf(-0.5); N]);
                gain
            }
            Forgetting::Directional { lambda } => {
                let product = self.times(psi);
                let along: f64 = product.iter().zip(psi).map(|(a, b)| a * b).sum();
                if along > 0.0 {
                    let beta = lambda - (1.0 - lambda) / along;
                    for i in 0..N {
                        for j in 0..N {
                            self.p[i][j] -= product[i] * product[j] / (1.0 / beta + along);
                        }
                    }
                }
                product.map(|v| v / (1.0 + along))
            }
            Forgetting::Gradient { rate } => {
                let power: f64 = psi.iter().map(|p| p * p).sum();
                self.power += (power - self.power) * 0.01;
                self.largest = self.largest.max(self.power);
                psi.map(|p| rate * p / (0.01 * self.largest + power))
            }
        }
    }
}

/// Returns the largest difference between two matrices, in units of the square roots of the diagonal.
pub fn relative_difference<const N: usize>(a: &[[f64; N]; N], b: &[[f64; N]; N]) -> f64 {
    let mut largest = 0.0_f64;
    for i in 0..N {
        for j in 0..N {
            let scale = (a[i][i] * a[j][j]).sqrt();
            if scale > 0.0 {
                largest = largest.max((a[i][j] - b[i][j]).abs() / scale);
            }
        }
    }
    largest
}

/// Returns `value` times the identity matrix.
pub fn diagonal<const N: usize>(value: f64) -> [[f64; N]; N] {
    std::array::from_fn(|i| std::array::from_fn(|j| if i == j { value } else { 0.0 }))
}

/// Returns the adaptation with this forgetting rule, P = p0 I and no bound.
pub fn covariance<const N: usize>(p0: f64, forgetting: Forgetting<N>) -> Covariance<N> {
    Covariance::new(UdCovariance::diagonal([p0; N]), forgetting, [f64::INFINITY; N])
}

/// Returns error bars that start from p0 I, with the innovation limited to five standard deviations.
pub fn error_bars<const N: usize, const K: usize>(p0: f64) -> ErrorBars<N, K> {
    ErrorBars::new(&diagonal::<N>(p0), InnovationVariance::new(0.0, 0.0, 1.0), 5.0)
}

/// Returns stable coefficients for these orders.
pub fn start_coefficients<const N: usize>(shape: &AnyShape) -> [f64; N] {
    let mut theta = [0.0; N];
    let mut at = 0;
    for (n, values) in [
        (shape.na, [-1.2, 0.4]),
        (shape.nb, [0.05, -0.03]),
        (shape.nc, [0.2, -0.1]),
        (shape.nd, [-0.7, 0.1]),
        (shape.nf, [-1.8, 0.82]),
    ] {
        theta[at..at + n].copy_from_slice(&values[..n]);
        at += n;
    }
    theta
}

/// Returns the shapes of ARX, ARMAX, OE, ARARX, Box-Jenkins and the general model.
pub fn shapes() -> [AnyShape; 6] {
    let s = |na, nb, nc, nd, nf| AnyShape { na, nb, nc, nd, nf };
    [
        s(2, 2, 0, 0, 0),
        s(2, 2, 1, 0, 0),
        s(0, 2, 0, 0, 2),
        s(1, 2, 0, 2, 0),
        s(0, 2, 0, 1, 2),
        s(1, 2, 2, 1, 2),
    ]
}
