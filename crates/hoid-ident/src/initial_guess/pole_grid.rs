//! Poles in the range of human operators: F of an operator's neuromuscular system at a few
//! frequencies and dampings, through the exact zero-order hold.

use hoid_model::{Complex64, SampleTime, polynomial};

/// Neuromuscular frequencies of the pole grid, rad/s.
const GRID_OMEGA: [f64; 4] = [3.0, 6.0, 12.0, 24.0];
/// Damping ratios of the pole grid.
const GRID_ZETA: [f64; 2] = [0.25, 0.7];
/// Further poles of the grid for nf > 2: fast ones, which matter least.
const EXTRA_POLE: f64 = 0.3;

/// F of each place of the grid, with its name.
pub(crate) fn pole_grid(nf: usize, sample_time: SampleTime) -> Vec<(String, Vec<f64>)> {
    GRID_OMEGA
        .into_iter()
        .flat_map(|omega| GRID_ZETA.map(|zeta| (omega, zeta)))
        // One pole has no damping.
        .filter(|(_, zeta)| nf > 1 || *zeta == GRID_ZETA[0])
        .map(|(omega, zeta)| {
            let poles = grid_poles(nf, omega, zeta, sample_time.s());
            let f = polynomial::from_roots(&poles)[1..].to_vec();
            (format!("pole grid {omega} rad/s, damping {zeta}"), f)
        })
        .collect()
}

fn grid_poles(nf: usize, omega: f64, zeta: f64, ts: f64) -> Vec<Complex64> {
    if nf == 1 {
        return vec![Complex64::new((-omega * ts).exp(), 0.0)];
    }
    let s = Complex64::new(-zeta, (1.0 - zeta * zeta).max(0.0).sqrt()) * omega * ts;
    let mut poles = vec![s.exp(), s.exp().conj()];
    poles.resize(nf, Complex64::new(EXTRA_POLE, 0.0));
    poles
}
