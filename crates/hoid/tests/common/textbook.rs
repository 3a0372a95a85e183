//! Textbook systems in an open loop, one for each structure.

use hoid::prelude::*;

/// Normal deviates from sums of uniform numbers.
pub struct Draw(pub u64);

impl Draw {
    /// Returns the next deviate.
    pub fn normal(&mut self) -> f64 {
        (0..12)
            .map(|_| {
                self.0 = self
                    .0
                    .wrapping_mul(6_364_136_223_846_793_005)
                    .wrapping_add(1_442_695_040_888_963_407);
                (self.0 >> 11) as f64 / (1_u64 << 53) as f64
            })
            .sum::<f64>()
            - 6.0
    }
}

/// Polynomials of a textbook system with the same names as in the model.
#[derive(Clone, Copy, Default)]
pub struct Truth<'a> {
    pub a: &'a [f64],
    pub b: &'a [f64],
    pub c: &'a [f64],
    pub d: &'a [f64],
    pub f: &'a [f64],
}

const DENOMINATOR: &[f64] = &[-1.5, 0.7];
const NUMERATOR: &[f64] = &[1.0, 0.5];

impl Truth<'_> {
    /// Returns the system of a structure.
    pub fn of(structure: Structure) -> Self {
        let keep = |letter: char, p: &'static [f64]| {
            if structure.polynomials().contains(letter) {
                p
            } else {
                &[]
            }
        };
        let general = structure == Structure::General;
        Truth {
            a: if general { &[-0.6] } else { keep('a', DENOMINATOR) },
            b: keep('b', NUMERATOR),
            c: keep('c', &[0.5]),
            d: keep('d', &[-0.8]),
            f: keep('f', DENOMINATOR),
        }
    }

    /// Returns the orders of the system.
    pub fn orders(&self) -> Orders {
        Orders {
            na: self.a.len(),
            nb: self.b.len(),
            nc: self.c.len(),
            nd: self.d.len(),
            nf: self.f.len(),
            nk: usize::from(!self.b.is_empty()),
        }
    }

    /// Returns the coefficients of the system in the order of theta.
    pub fn theta(&self) -> Vec<f64> {
        [self.a, self.b, self.c, self.d, self.f].concat()
    }

    /// Returns a record of n samples that is cut out of a longer record.
    pub fn record(&self, n: usize, noise: f64, seed: u64) -> Record {
        self.record_after_run_in(500, n, noise, seed)
    }

    /// Returns a record of n samples after a run-in, with white input of unit variance and innovations of the given
    /// size.
    pub fn record_after_run_in(&self, run_in: usize, n: usize, noise: f64, seed: u64) -> Record {
        let mut draw = Draw(seed);
        let past = |x: &[f64], p: &[f64], first: usize| -> f64 {
            p.iter()
                .enumerate()
                .filter_map(|(i, pi)| Some(pi * x.get(x.len().checked_sub(i + first)?)?))
                .sum()
        };
        let (mut e, mut w, mut eps, mut v, mut u) = (vec![], vec![], vec![], vec![], vec![]);
        for _ in 0..n + run_in {
            w.push(past(&e, self.b, 1) - past(&w, self.f, 1));
            e.push(draw.normal());
            let innovation = noise * draw.normal();
            v.push(innovation + past(&eps, self.c, 1) - past(&v, self.d, 1));
            eps.push(innovation);
            let t = u.len();
            u.push(w[t] + v[t] - past(&u, self.a, 1));
        }
        let ts = SampleTime::AT_100_HZ;
        let output = Channel::new("u", "deg", u.split_off(run_in));
        if self.b.is_empty() {
            Record::from_output(ts, output).unwrap()
        } else {
            Record::new(ts, Channel::new("e", "deg", e.split_off(run_in)), output).unwrap()
        }
    }
}
