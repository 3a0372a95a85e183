//! Tests whether u responds to e at all.
//!
//! A search over forms, delays and orders finds a response in any pair of signals, so its result is only weak evidence
//! of a response. This test is therefore done before the search, for all forms at once. Each channel is whitened by an
//! autoregression, so a slow component does not count as many independent samples. At the frequencies `omega_k` of the
//! record up to [`MAX_FREQUENCY_RAD_S`] the whitened output is regressed on a gain, a lead and a lag of e, followed by
//! a typical neuromuscular system and a delay,
//!
//! `U_k = (A_u/A_e) N e^{-j omega tau} (b_1 + b_2 j omega + b_3/(j omega + a)) E_k + R_k`,
//!
//! where b is real. T is the share of the power of U that this regression explains, maximised over the delays
//! [`DELAYS_S`] and the poles [`LAG_RATES`]. With only one slow pole, the regression would leave much of the response
//! of a person with a short lag unexplained. If there is also little remnant, a few strong lines with random phases
//! would then fit equally well. Surrogate records have the same spectra, but random phases of E and therefore no
//! relation between e and u (J. Theiler et al., *Physica D* 58 (1992) 77-94). The values of T for [`SURROGATE_COUNT`]
//! such records give the distribution of T if there is no response. If u does not depend on e, T is one more draw from
//! this distribution: the probability that it exceeds all others is 1/([`SURROGATE_COUNT`] + 1), regardless of the
//! spectra. Only the past of e is used, so a response of e to u does not count as a response of u. Several records have
//! the same b.

use std::f64::consts::{PI, TAU};

use hoid_model::{Complex64, Finding, Record, uncertainty::variance_along};
use hoid_numerics::statistics::mean;
use rand_chacha::{
    ChaCha8Rng,
    rand_core::{Rng, SeedableRng},
};

use super::whitened::{NOISE_ORDER, decimation_factor};
use crate::{family::noise::NoiseProducts, frequency::spectrum, linalg::least_squares::solve_symmetric};

/// Highest frequency that is tested, rad/s.
const MAX_FREQUENCY_RAD_S: f64 = 25.0;
/// Tested delays, s.
const DELAYS_S: [f64; 8] = [0.05, 0.1, 0.16, 0.23, 0.31, 0.4, 0.52, 0.7];
/// Tested poles of the lag, 1/s.
const LAG_RATES: [f64; 3] = [0.3, 1.3, 4.0];
/// Typical neuromuscular system: natural frequency in rad/s, and damping ratio.
const NEUROMUSCULAR_PARAMETERS: (f64, f64) = (11.0, 0.4);
/// Number of surrogate records without a relation between e and u.
const SURROGATE_COUNT: usize = 1999;
/// Minimum number of frequencies for the test.
const MIN_FREQUENCIES: usize = 12;
const SEED: u64 = 0x686f_6964;
/// Gain, lead, and a lag for each of [`LAG_RATES`].
const COLUMN_COUNT: usize = 2 + LAG_RATES.len();
/// Largest number of surrogates that may explain as much as the records: the probability that unrelated records pass is
/// at most (1 + 2)/2000.
const MAX_SURROGATES_ABOVE: usize = 2;

/// Result of the test of whether u responds to e.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Response {
    /// T: share of the power of the whitened output that the response explains.
    pub share: f64,
    /// Number of surrogates whose share is at least as large as the share of the records.
    pub exceeding_surrogates: usize,
    /// Number of surrogates.
    pub surrogates: usize,
}

impl Response {
    /// Returns the probability of a share at least this large if u does not respond to e.
    pub fn p_value(&self) -> f64 {
        (self.exceeding_surrogates + 1) as f64 / (self.surrogates + 1) as f64
    }

    /// Returns the finding that no response can be distinguished from chance; `None` if at most
    /// two surrogates have as large a share as the records.
    pub fn finding(&self) -> Option<Finding> {
        (self.exceeding_surrogates > MAX_SURROGATES_ABOVE).then(|| {
            Finding::undetermined(
                "no-response",
                format!(
                    "the response of u to e cannot be distinguished from chance: {} of {} pairs of unrelated records \
                     with the same spectra respond at least as strongly (p = {:.3}); check that both channels are \
                     from the same run and are not exchanged",
                    self.exceeding_surrogates,
                    self.surrogates,
                    self.p_value()
                ),
            )
        })
    }
}

/// The spectra of one record.
struct Spectra {
    /// `E_k` and `U_k`, whitened.
    e: Vec<Complex64>,
    u: Vec<Complex64>,
    /// Columns of the regression without the delay and without E: `(A_u/A_e) N G_j`.
    columns: Vec<[Complex64; COLUMN_COUNT]>,
    /// `e^{-j omega tau}` for each tested delay.
    delays: Vec<Vec<Complex64>>,
}

/// Tests whether u responds to e in the records of a person. `None` if there are too few data, a value is not a number
/// or a signal is constant.
pub fn response_to_error(records: &[Record]) -> Option<Response> {
    let all: Option<Vec<Spectra>> = records.iter().map(Spectra::of).collect();
    let all = all?;
    if all.iter().map(|s| s.u.len()).sum::<usize>() < MIN_FREQUENCIES {
        return None;
    }
    let power: f64 = all.iter().flat_map(|s| &s.u).map(Complex64::norm_sqr).sum();
    let inverses: Option<Vec<Vec<f64>>> = (0..LAG_RATES.len()).map(|lag| inverse_gram(&all, lag)).collect();
    let inverses = inverses?;
    // Products of columns and output for each frequency and delay; a surrogate changes only the phases of these
    // products.
    let products: Vec<[[Complex64; COLUMN_COUNT]; DELAYS_S.len()]> = all.iter().flat_map(Spectra::products).collect();
    let mut turns = vec![Complex64::ONE; products.len()];
    let share = |turns: &[Complex64]| -> f64 {
        let mut sums = [[0.0; COLUMN_COUNT]; DELAYS_S.len()];
        for (product, turn) in products.iter().zip(turns) {
            for (sum, column) in sums.iter_mut().zip(product) {
                for (s, c) in sum.iter_mut().zip(column) {
                    *s += c.re * turn.re - c.im * turn.im;
                }
            }
        }
        let explained = sums.iter().flat_map(|right| {
            let with =
                |(lag, inverse): (usize, &Vec<f64>)| variance_along(&columns_with(lag).map(|i| right[i]), inverse);
            inverses.iter().enumerate().map(with)
        });
        explained.fold(f64::NEG_INFINITY, f64::max) / power
    };
    let own = share(&turns);
    if !own.is_finite() {
        return None;
    }
    let mut generator = ChaCha8Rng::seed_from_u64(SEED);
    let mut surrogates_above = 0;
    for _ in 0..SURROGATE_COUNT {
        for turn in &mut turns {
            // A resolution of 32 bits is more than sufficient for a phase.
            *turn = Complex64::from_polar(1.0, TAU * f64::from(generator.next_u32()) / 4_294_967_296.0);
        }
        surrogates_above += usize::from(share(&turns) >= own);
    }
    Some(Response {
        share: own,
        exceeding_surrogates: surrogates_above,
        surrogates: SURROGATE_COUNT,
    })
}

/// Number of columns of one regression: gain, lead and one lag.
const REGRESSOR_COUNT: usize = 3;

/// Returns the indices of the columns of the regression with this lag.
fn columns_with(lag: usize) -> [usize; REGRESSOR_COUNT] {
    [0, 1, 2 + lag]
}

/// Returns the inverse of `sum Re(x_i* x_j)` by rows, for the regression with this lag. The matrix depends neither on
/// the delay nor on the phases of E. `None` if the columns are linearly dependent.
fn inverse_gram(all: &[Spectra], lag: usize) -> Option<Vec<f64>> {
    const N: usize = REGRESSOR_COUNT;
    let mut gram = [0.0; N * N];
    for spectra in all {
        for (columns, e) in spectra.columns.iter().zip(&spectra.e) {
            let columns = columns_with(lag).map(|i| columns[i]);
            for i in 0..N {
                for j in 0..N {
                    gram[i * N + j] += (columns[i].conj() * columns[j]).re * e.norm_sqr();
                }
            }
        }
    }
    let column = |i: usize| {
        let unit: [f64; N] = std::array::from_fn(|j| f64::from(i == j));
        solve_symmetric(&gram, &unit)
    };
    let columns: Option<Vec<Vec<f64>>> = (0..N).map(column).collect();
    Some(columns?.concat())
}

impl Spectra {
    fn of(record: &Record) -> Option<Self> {
        let thin = decimation_factor(record.sample_time().s());
        let sample_time_s = thin as f64 * record.sample_time().s();
        let (e, d_e) = whiten(record.input(), thin)?;
        let (u, d_u) = whiten(record.output(), thin)?;
        let n = e.len();
        let highest = MAX_FREQUENCY_RAD_S.min(0.8 * PI / sample_time_s);
        let of_bin = TAU / (n as f64 * sample_time_s);
        let bins = 1..=((highest / of_bin) as usize).min((n - 1) / 2);
        let omegas: Vec<f64> = bins.clone().map(|k| k as f64 * of_bin).collect();
        let (own, damping) = NEUROMUSCULAR_PARAMETERS;
        let columns = |&omega: &f64| {
            let s = Complex64::new(0.0, omega);
            let muscles = own * own / (s * s + 2.0 * damping * own * s + own * own);
            let whitening = filter_response(&d_u, omega * sample_time_s) / filter_response(&d_e, omega * sample_time_s);
            let forms: [Complex64; COLUMN_COUNT] = std::array::from_fn(|i| match i {
                0 => Complex64::ONE,
                1 => s,
                _ => 1.0 / (s + LAG_RATES[i - 2]),
            });
            forms.map(|g| whitening * muscles * g)
        };
        let delays = |tau: f64| {
            let turn = |omega: &f64| Complex64::from_polar(1.0, -omega * tau);
            omegas.iter().map(turn).collect()
        };
        Some(Self {
            e: fourier_coefficients(&e, bins.clone()),
            u: fourier_coefficients(&u, bins),
            columns: omegas.iter().map(columns).collect(),
            delays: DELAYS_S.map(delays).into(),
        })
    }

    fn products(&self) -> impl Iterator<Item = [[Complex64; COLUMN_COUNT]; DELAYS_S.len()]> {
        (0..self.u.len()).map(|k| {
            std::array::from_fn(|delay| {
                self.columns[k].map(|column| (self.delays[delay][k] * column * self.e[k]).conj() * self.u[k])
            })
        })
    }
}

/// Returns the decimated channel, whitened by its own autoregression, and the coefficients of this autoregression.
fn whiten(channel: &[f64], thin: usize) -> Option<(Vec<f64>, Vec<f64>)> {
    // Averaging attenuates the components above the new Nyquist frequency before decimation.
    let mut thinned: Vec<f64> = (channel.chunks_exact(thin)).map(mean).collect();
    let mean = mean(&thinned);
    thinned.iter_mut().for_each(|v| *v -= mean);
    if thinned.len() < 8 * NOISE_ORDER || !thinned.iter().all(|v| v.is_finite()) {
        return None;
    }
    let series = [thinned];
    let d = NoiseProducts::new(&series, NOISE_ORDER).fit(NOISE_ORDER)?.d;
    let [thinned] = series;
    let white = (NOISE_ORDER..thinned.len())
        .map(|t| thinned[t] + (d.iter().enumerate()).map(|(k, d)| d * thinned[t - k - 1]).sum::<f64>())
        .collect();
    Some((white, d))
}

/// Returns the frequency response `1 + d_1 e^{-j w} + ..` at `w = omega_ts`.
fn filter_response(d: &[f64], omega_ts: f64) -> Complex64 {
    let terms = d.iter().enumerate();
    terms.fold(Complex64::ONE, |sum, (k, d)| {
        sum + d * Complex64::from_polar(1.0, -omega_ts * (k + 1) as f64)
    })
}

/// Returns the Fourier coefficients `sum x_t e^{-j omega t}` in these bins.
fn fourier_coefficients(values: &[f64], bins: std::ops::RangeInclusive<usize>) -> Vec<Complex64> {
    // Converts amplitudes of sinusoids to sums, so the weight of a record is proportional to its length.
    let scale = 0.5 * values.len() as f64;
    spectrum::coefficients(values)[bins].iter().map(|x| x * scale).collect()
}

#[cfg(test)]
mod tests {
    use hoid_model::{
        Channel, SampleTime,
        scenario::{Condition, Scenario},
    };
    use hoid_sim::{RunSeed, Simulator};

    use super::*;

    fn record(e: Vec<f64>, u: Vec<f64>) -> Record {
        Record::new(
            SampleTime::AT_100_HZ,
            Channel::new("e", "", e),
            Channel::new("u", "", u),
        )
        .unwrap()
    }

    /// Returns noise with these poles.
    fn noise(seed: u64, poles: [f64; 2], n: usize) -> Vec<f64> {
        let seed = RunSeed {
            seed,
            ..RunSeed::default()
        };
        let (mut a, mut b) = (0.0, 0.0);
        let filtered = seed.white_noise(n).into_iter().map(|w| {
            a = poles[0] * a + w;
            b = poles[1] * b + a;
            b
        });
        filtered.collect()
    }

    /// Level of the test by Monte Carlo: for unrelated noise, slow and fast, 1 in 20 records has p < 0.05 (standard
    /// error 0.011 for 400 records). The test also covers an e that responds to u.
    #[test]
    fn unrelated_channels_have_no_response() {
        let mut small = 0;
        for seed in 0..400 {
            let slow = [0.99, [0.999, 0.9, 0.5, 0.98][seed as usize % 4]];
            let (e, u) = (noise(2 * seed, slow, 4000), noise(2 * seed + 1, [0.95, slow[1]], 4000));
            let found = response_to_error(&[record(e, u)]).unwrap();
            small += usize::from(found.p_value() < 0.05);
        }
        assert!((4..40).contains(&small), "{small} of 400");
        // The machine responds to a person who does not look at e.
        let u = noise(7, [0.95, 0.9], 8000);
        let e: Vec<f64> = u
            .iter()
            .scan(0.0, |y, u| {
                *y = 0.995 * *y + 0.01 * u;
                Some(-*y)
            })
            .collect();
        assert!(response_to_error(&[record(e, u)]).unwrap().finding().is_some());
    }

    #[test]
    fn simulated_operators_respond_to_the_error() {
        for condition in [Condition::C1, Condition::C2, Condition::C3] {
            let simulator = Simulator::new(&Scenario::condition(condition)).unwrap();
            let run = simulator.run(RunSeed::default(), false).unwrap();
            let found = response_to_error(&[run]).unwrap();
            assert_eq!(found.exceeding_surrogates, 0, "{found:?}");
            assert!(found.p_value() < 1e-3 && found.finding().is_none());
        }
    }

    #[test]
    fn too_little_data_gives_no_result() {
        assert_eq!(
            response_to_error(&[record(vec![0.0; 4000], noise(1, [0.9, 0.9], 4000))]),
            None
        );
        assert_eq!(
            response_to_error(&[record(noise(1, [0.9, 0.9], 60), noise(2, [0.9, 0.9], 60))]),
            None
        );
        assert_eq!(response_to_error(&[]), None);
    }
}
