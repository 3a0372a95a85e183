//! Random Box-Jenkins systems with short open-loop records.
//!
//! Systems with the orders of textbooks: nb = 3, nf = 2, nk = 1 .. 3, nc and nd 0 .. 2, 300 samples. Half of the
//! systems have two real poles, most of them slow (0.8 to 0.99), and half have a pair of complex poles; the noise has
//! any colour, with roots up to 0.95. The ratio of the variances of noise-free output and noise lies between 1 and 10,
//! and the input is white, band-limited or a binary sequence of steps.

use hoid_core::filter::{divide_in_place, fir, multiply};
use hoid_model::{Channel, Complex64, Orders, Record, SampleTime, polynomial};
use hoid_sim::RunSeed;

/// Number of samples of a record.
const SAMPLE_COUNT: usize = 300;
/// Number of samples before the record.
const RUN_IN_SAMPLES: usize = 500;

/// A system, its record, and random numbers for further use by the caller.
pub struct System {
    pub orders: Orders,
    pub theta: Vec<f64>,
    pub record: Record,
    pub draw: RandomNumbers,
}

/// Uniform random numbers (S. Vigna's SplitMix64).
pub struct RandomNumbers(u64);

impl RandomNumbers {
    /// Creates the random stream with this seed.
    pub fn new(seed: u64) -> Self {
        Self(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ 0x5851_f42d_4c95_7f2d)
    }

    /// Returns a uniform number between `low` and `high`.
    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        low + (high - low) * ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// Returns one of the integers 0 .. n - 1.
    pub fn integer_below(&mut self, n: usize) -> usize {
        ((self.between(0.0, 1.0) * n as f64) as usize).min(n - 1)
    }

    /// Returns a polynomial with two poles: two real poles, most of them slow, or a pair.
    pub fn two_poles(&mut self) -> Vec<f64> {
        if self.between(0.0, 1.0) < 0.5 {
            let slow = self.between(0.8, 0.99);
            let low = if self.between(0.0, 1.0) < 0.7 { 0.8 } else { 0.0 };
            real_poles(&[slow, self.between(low, 0.99)])
        } else {
            pole_pair(self.between(0.6, 0.98), self.between(0.02, 1.5))
        }
    }

    /// Returns a polynomial of the noise model.
    pub fn noise_polynomial(&mut self, order: usize) -> Vec<f64> {
        match order {
            0 => Vec::new(),
            1 => real_poles(&[self.between(-0.95, 0.95)]),
            _ if self.between(0.0, 1.0) < 0.5 => real_poles(&[self.between(-0.95, 0.95), self.between(-0.95, 0.95)]),
            _ => pole_pair(self.between(0.2, 0.95), self.between(0.1, 3.0)),
        }
    }
}

impl System {
    /// Returns the system with this number.
    pub fn with_number(number: u64) -> Self {
        let mut draw = RandomNumbers::new(number);
        let orders = Orders {
            nb: 3,
            nc: draw.integer_below(3),
            nd: draw.integer_below(3),
            nf: 2,
            nk: 1 + draw.integer_below(3),
            ..Orders::default()
        };
        let f = draw.two_poles();
        let normal = |cell, n| {
            RunSeed {
                seed: 300,
                cell,
                replication: number,
            }
            .white_noise(n)
        };
        let b = normal(0, orders.nb);
        let (c, d) = (draw.noise_polynomial(orders.nc), draw.noise_polynomial(orders.nd));
        let n = RUN_IN_SAMPLES + SAMPLE_COUNT;
        let e = input(&mut draw, normal(1, n));
        let mut w = vec![0.0; n];
        fir(&b, orders.nk, &e, &mut w);
        divide_in_place(&f, &mut w);
        let mut v = vec![0.0; n];
        multiply(&c, &normal(2, n), &mut v);
        divide_in_place(&d, &mut v);
        let ratio = f64::exp(draw.between(0.0, 10.0_f64.ln()));
        let gain = (variance(&w) / variance(&v) / ratio).sqrt();
        let u: Vec<f64> = w
            .iter()
            .zip(&v)
            .map(|(w, v)| w + gain * v)
            .skip(RUN_IN_SAMPLES)
            .collect();
        let sample_time = [0.01, 0.1, 1.0][draw.integer_below(3)];
        let record = Record::new(
            SampleTime::new(sample_time).unwrap(),
            Channel::new("e", "", e[RUN_IN_SAMPLES..].to_vec()),
            Channel::new("u", "", u),
        )
        .unwrap();
        Self {
            orders,
            theta: [b, c, d, f].concat(),
            record,
            draw,
        }
    }

    /// Returns a random start: poles and noise of the same kind as in the system, and B by least squares.
    pub fn random_start(&mut self) -> Vec<f64> {
        let o = self.orders;
        let f = self.draw.two_poles();
        let b = self.least_squares(&f);
        let (c, d) = (self.draw.noise_polynomial(o.nc), self.draw.noise_polynomial(o.nd));
        [b, c, d, f].concat()
    }

    /// Returns B by least squares for given poles.
    fn least_squares(&self, f: &[f64]) -> Vec<f64> {
        let o = self.orders;
        let columns: Vec<Vec<f64>> = (0..o.nb)
            .map(|j| {
                let mut column = vec![0.0; SAMPLE_COUNT];
                fir(&[1.0], o.nk + j, self.record.input(), &mut column);
                divide_in_place(f, &mut column);
                column
            })
            .collect();
        let phi = nalgebra::DMatrix::from_fn(SAMPLE_COUNT, o.nb, |t, j| columns[j][t]);
        let u = nalgebra::DVector::from_column_slice(self.record.output());
        let right = phi.transpose() * u;
        let b = (phi.transpose() * &phi).lu().solve(&right);
        b.map_or(vec![1.0; o.nb], |b| b.as_slice().to_vec())
    }
}

/// Returns white noise, white noise filtered by two equal poles, or steps between +1 and -1 that last 5 to 20 samples.
fn input(draw: &mut RandomNumbers, mut white: Vec<f64>) -> Vec<f64> {
    match draw.integer_below(3) {
        0 => {}
        1 => {
            let pole = draw.between(0.5, 0.9);
            divide_in_place(&real_poles(&[pole, pole]), &mut white);
        }
        _ => {
            let hold = 5 + draw.integer_below(16);
            let steps: Vec<f64> = white.iter().map(|x| x.signum()).collect();
            white.iter_mut().enumerate().for_each(|(t, x)| *x = steps[t / hold]);
        }
    }
    white
}

fn variance(x: &[f64]) -> f64 {
    let x = &x[RUN_IN_SAMPLES..];
    let mean = x.iter().sum::<f64>() / x.len() as f64;
    x.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / x.len() as f64
}

fn real_poles(poles: &[f64]) -> Vec<f64> {
    let roots: Vec<Complex64> = poles.iter().map(|p| Complex64::new(*p, 0.0)).collect();
    polynomial::from_roots(&roots)[1..].to_vec()
}

fn pole_pair(radius: f64, angle: f64) -> Vec<f64> {
    vec![-2.0 * radius * angle.cos(), radius * radius]
}
