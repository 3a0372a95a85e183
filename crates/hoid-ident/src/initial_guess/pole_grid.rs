//! Pole candidates that do not depend on the data. The first grid covers the range of human operators: F of a
//! neuromuscular system at a few frequencies and damping ratios, converted with the exact zero-order hold. The second
//! grid covers the whole unit disc, regardless of the sample time.

use hoid_model::{Complex64, SampleTime, polynomial};

/// Neuromuscular frequencies of the pole grid, rad/s.
const GRID_OMEGA: [f64; 4] = [3.0, 6.0, 12.0, 24.0];
/// Damping ratios of the pole grid.
const GRID_ZETA: [f64; 2] = [0.25, 0.7];
/// Further poles of the pole grid for nf > 2; fast poles have the least effect.
const EXTRA_POLE: f64 = 0.3;

/// Returns F and a name for each point of the grid of neuromuscular systems.
pub(crate) fn pole_grid(nf: usize, sample_time: SampleTime) -> Vec<(String, Vec<f64>)> {
    GRID_OMEGA
        .into_iter()
        .flat_map(|omega| GRID_ZETA.map(|zeta| (omega, zeta)))
        // A single pole has no damping ratio.
        .filter(|(_, zeta)| nf > 1 || *zeta == GRID_ZETA[0])
        .map(|(omega, zeta)| {
            let poles = grid_poles(nf, omega, zeta, sample_time.s());
            let f = polynomial::from_roots(&poles)[1..].to_vec();
            (format!("pole grid {omega} rad/s, damping {zeta}"), f)
        })
        .collect()
}

/// Real poles of the grid over the unit disc, denser for slow poles.
const REAL_POLES: [f64; 7] = [0.985, 0.95, 0.88, 0.7, 0.3, -0.5, -0.95];
/// Angles in rad of the pole pairs of the grid over the unit disc; each angle is combined with every radius.
const POLE_ANGLES: [f64; 8] = [0.05, 0.1, 0.2, 0.4, 0.8, 1.3, 2.0, 2.6];
const POLE_RADII: [f64; 2] = [0.98, 0.85];
/// Third pole in the grid over the unit disc for nf > 2: slow, like the lag of an operator, or fast.
const THIRD_POLES: [f64; 2] = [0.95, EXTRA_POLE];

/// Real roots of the grid for C.
const REAL_ZEROS: [f64; 6] = [0.98, 0.8, 0.3, -0.3, -0.8, -0.98];
/// Angles in rad of the root pairs of the grid for C; all pairs have the same radius.
const ZERO_ANGLES: [f64; 7] = [0.1, 0.3, 0.7, 1.2, 1.7, 2.2, 2.7];
const ZERO_RADIUS: f64 = 0.9;

/// Returns candidates for F with poles over the whole unit disc: slow and fast, real and in pairs.
pub(crate) fn unit_disc_grid(nf: usize) -> Vec<Vec<f64>> {
    let two = real_and_paired_roots(nf, &REAL_POLES, &POLE_ANGLES, &POLE_RADII);
    let third = if nf > 2 { &THIRD_POLES[..] } else { &THIRD_POLES[..1] };
    let complete = |poles: &Vec<Complex64>, third: f64| {
        let mut poles = poles.clone();
        if poles.len() < nf {
            poles.push(Complex64::new(third, 0.0));
        }
        poles.resize(nf, Complex64::new(EXTRA_POLE, 0.0));
        polynomial::from_roots(&poles)[1..].to_vec()
    };
    two.iter()
        .flat_map(|poles| third.iter().map(move |third| complete(poles, *third)))
        .collect()
}

/// Returns candidates for C with roots over the whole unit disc, also close to the unit circle; roots beyond the second
/// are zero.
pub(crate) fn noise_zero_grid(nc: usize) -> Vec<Vec<f64>> {
    real_and_paired_roots(nc, &REAL_ZEROS, &ZERO_ANGLES, &[ZERO_RADIUS])
        .into_iter()
        .map(|mut roots| {
            roots.resize(nc, Complex64::new(0.0, 0.0));
            polynomial::from_roots(&roots)[1..].to_vec()
        })
        .collect()
}

/// Returns every combination of two real roots, including double roots, and every complex pair. For a count of one,
/// returns the single roots; for a count of zero, one empty set.
fn real_and_paired_roots(count: usize, real: &[f64], angles: &[f64], radii: &[f64]) -> Vec<Vec<Complex64>> {
    let at = |x: f64| Complex64::new(x, 0.0);
    match count {
        0 => vec![Vec::new()],
        1 => real.iter().map(|x| vec![at(*x)]).collect(),
        _ => {
            let real = (real.iter().enumerate()).flat_map(|(i, x)| real[i..].iter().map(move |y| vec![at(*x), at(*y)]));
            let pairs = angles.iter().flat_map(|angle| {
                radii.iter().map(move |radius| {
                    let root = Complex64::from_polar(*radius, *angle);
                    vec![root, root.conj()]
                })
            });
            real.chain(pairs).collect()
        }
    }
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

#[cfg(test)]
mod tests {
    use hoid_core::stability::roots_inside;

    use super::*;

    #[test]
    fn pole_grids_are_stable_and_have_the_requested_order() {
        for (order, places) in [(0, 1), (1, 7), (2, 44), (3, 88), (4, 88)] {
            let grid = unit_disc_grid(order);
            assert_eq!(grid.len(), places);
            assert!(grid.iter().all(|f| f.len() == order && roots_inside(f, 1.0)));
        }
        for (order, places) in [(0, 1), (1, 6), (2, 28), (5, 28)] {
            let grid = noise_zero_grid(order);
            assert_eq!(grid.len(), places);
            assert!(grid.iter().all(|c| c.len() == order && roots_inside(c, 1.0)));
        }
    }
}
