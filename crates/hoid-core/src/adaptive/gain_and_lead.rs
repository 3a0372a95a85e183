//! Tests whether the gain and lead differ between past and present if everything else is as in the past.
//!
//! People who adapt to another controlled element change mainly their gain and lead (D. T. McRuer and H. R. Jex, *IEEE
//! Trans. Human Factors in Electronics* 8 (1967) 231-249). A test of these two has more power than the test of all
//! parameters (`contrast`), since a few seconds of data hardly determine the others. Let x_0 be the least-squares
//! solution of the past with covariance `C_0 = A_0^-1 W_0 A_0^-1`, and E the directions of gain, lead and level in the
//! state. The score of the present at x_0 gives the change (C. R. Rao, *Proc. Cambridge Philosophical Society* 44
//! (1948) 50-57)
//!
//! `delta = F^-1 E' (b_1 - A_1 x_0)`, `F = E' A_1 E`, `C = F^-1 E' (W_1 + A_1 C_0 A_1) E F^-1`.
//!
//! W_0 and W_1 come from the scores of the past alone: a change would increase those of the present.
//!
//! The gain of people fluctuates without a change in their strategy, while the ratio of lead to gain stays constant. A
//! fluctuation with a standard deviation of 20 % is therefore part of the covariance: with the gain and lead h of the
//! past, and the first two components of delta and C,
//!
//! `T = delta' (C + 0.04 h h')^-1 delta`,
//!
//! which is at most a chi-square with two degrees of freedom if there is no change: W comes from few stretches, and its
//! divisor is that of a test of all parameters, so the mean of T is 1.4 instead of 2. In recordings of three pilots,
//! this T at two false alarms per hour finds 64 % of the sudden changes of the controlled element within 10 s; T
//! without the fluctuation finds 49 %, and the test of all parameters 35 %.

use hoid_numerics::{
    cholesky,
    products::{congruence, dot},
};

use super::{
    contrast::{EMPIRICAL_WEIGHT, Matrix, Scores, SolvedSpans, sandwich, wald},
    sizes::{GAIN_COUNT, first_gain},
};

/// Number of directions: gain, lead and level.
const DIRECTION_COUNT: usize = 3;
/// Standard deviation of the fluctuation of the gain, relative to the gain.
const RELATIVE_FLUCTUATION: f64 = 0.2;
/// Ridge that is added to the diagonal of F, relative to the diagonal.
const RELATIVE_RIDGE: f64 = 1e-6;

type Directions<const S: usize> = [[f64; S]; DIRECTION_COUNT];

/// Returns T of the response to an input for the past and the present; `gain_and_lead` contains the directions of gain
/// and lead in the space of the gains of that input. `None` if the data do not determine gain and lead.
pub(super) fn wald_statistic<const S: usize, const P: usize>(
    spans: &SolvedSpans<'_, S, P>,
    input: usize,
    gain_and_lead: [[f64; GAIN_COUNT]; 2],
) -> Option<f64> {
    let SolvedSpans {
        sides: [past, _],
        sums,
        solutions: [before, _],
        ..
    } = spans;
    let mut scores = Scores::default();
    scores.add(past, &before.state);
    let [w_0, w_1] =
        [0, 1].map(|side: usize| scores.covariance(&sums[side], sums[0].samples, EMPIRICAL_WEIGHT, spans.variance));
    let [a_0, a_1] = [0, 1].map(|side: usize| sums[side].matrix());

    let (first, mut e) = (first_gain(input), [[0.0; S]; DIRECTION_COUNT]);
    for (row, direction) in e.iter_mut().zip(gain_and_lead) {
        row[first..first + GAIN_COUNT].copy_from_slice(&direction);
    }
    e[2][GAIN_COUNT] = 1.0;

    let projection = projection(&e, &a_1)?;
    let score = sums[1].score(&before.state);
    let of_past = sandwich(&a_1, &sandwich(&before.inverse, &w_0));
    let of_score = core::array::from_fn(|i| core::array::from_fn(|j| w_1[i][j] + of_past[i][j]));
    let c = congruence(&projection, &of_score);

    let h = gain_and_lead_of(&before.state, first, &e, &a_0)?;
    let share = RELATIVE_FLUCTUATION * RELATIVE_FLUCTUATION;
    wald(
        [dot(&projection[0], &score), dot(&projection[1], &score)],
        core::array::from_fn(|i| core::array::from_fn(|j| c[i][j] + share * h[i] * h[j])),
        2,
    )
}

/// Returns the gain and lead nearest to the gains of a state whose places start at `first`, by least squares with the
/// information A.
fn gain_and_lead_of<const S: usize>(
    state: &[f64; S],
    first: usize,
    e: &Directions<S>,
    a: &Matrix<S>,
) -> Option<[f64; 2]> {
    let mut gains = [0.0; S];
    gains[first..first + GAIN_COUNT].copy_from_slice(&state[first..first + GAIN_COUNT]);
    let of_gains = a.map(|row| dot(&row, &gains));
    let [gain, lead, _] = projection(e, a)?.map(|row| dot(&row, &of_gains));
    Some([gain, lead])
}

/// Returns `F^-1 E'` with `F = E' A E`, which maps a score to the change in the directions E.
fn projection<const S: usize>(e: &Directions<S>, a: &Matrix<S>) -> Option<Directions<S>> {
    let mut factor = congruence(e, a);
    for (i, row) in factor.iter_mut().enumerate() {
        row[i] *= 1.0 + RELATIVE_RIDGE;
    }
    if !cholesky::factor(&mut factor, DIRECTION_COUNT) {
        return None;
    }
    let inverse = cholesky::scaled_inverse(&factor, DIRECTION_COUNT, 1.0);
    Some(core::array::from_fn(|i| {
        core::array::from_fn(|j| (0..DIRECTION_COUNT).map(|k| inverse[i][k] * e[k][j]).sum())
    }))
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::adaptive::{blocks::Block, contrast::tests::blocks, sizes::STATE_COUNT};

    const DIRECTIONS: [[f64; GAIN_COUNT]; 2] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
    const PAST: usize = 60;
    const PRESENT: usize = 8;

    /// T of a past with one state and a present with another.
    fn statistic(past: [f64; STATE_COUNT], present: [f64; STATE_COUNT], random: &mut u64) -> f64 {
        let before = blocks(PAST, &past, 0.0, random);
        let now = blocks(PRESENT, &present, 0.0, random);
        wald_statistic(&SolvedSpans::new([&before, &now], |sum| sum).unwrap(), 0, DIRECTIONS).unwrap()
    }

    /// With a gain and lead of zero there is no fluctuation, so T is about a chi-square with two degrees of freedom,
    /// with mean 2 and standard deviation 2. The correction for few stretches reduces T.
    #[test]
    fn statistic_without_change_is_at_most_a_chi_square() {
        let (mut random, count) = (5, 400);
        let state = [0.0, 0.0, 0.3, 0.2, 0.1, -0.2, 0.4];
        let mean = (0..count).map(|_| statistic(state, state, &mut random)).sum::<f64>() / f64::from(count);
        // Standard error 0.1. With 30 stretches, W is divided by 0.67; for two parameters, 0.87 would suffice.
        assert!((1.2..2.2).contains(&mean), "{mean}");
    }

    /// A smaller gain with the same ratio of lead to gain is a typical fluctuation; changes of the same size that alter
    /// the ratio are a change in the operator.
    #[test]
    fn change_of_lead_is_distinguished_from_a_fluctuation_of_the_gain() {
        let mut random = 6;
        let with = |gain: f64, lead: f64| [gain, lead, 0.3, 0.2, 0.1, -0.2, 0.4];
        let past = with(3.0, 3.0);
        let fluctuation = statistic(past, with(2.5, 2.5), &mut random);
        let change = statistic(past, with(3.5, 2.5), &mut random);
        assert!(
            fluctuation < 5.0 && change > 8.0 * fluctuation,
            "{fluctuation} {change}"
        );
    }

    /// Parameters other than gain and lead are assumed to be as in the past, and a change in the level does not count.
    #[test]
    fn change_of_the_level_is_no_change() {
        let mut random = 7;
        let state = [1.0, -0.5, 0.3, 0.2, 0.1, -0.2, 0.4];
        let mut other = state;
        other[GAIN_COUNT] += 5.0;
        assert!(statistic(state, other, &mut random) < 12.0);
        other[0] += 3.0;
        assert!(statistic(state, other, &mut random) > 40.0);
    }

    #[test]
    fn empty_blocks_give_no_statistic() {
        let mut random = 8;
        let some = blocks(PAST, &[1.0; STATE_COUNT], 0.0, &mut random);
        for sides in [[&[][..], &some], [&some, &[]], [&some, &[Block::EMPTY; 4]]] {
            assert!(SolvedSpans::new(sides, |sum| sum).is_none());
        }
    }
}
