//! Has the person changed? Now against before, over blocks of half a second (`blocks`).
//!
//! Least squares over the last blocks and over those before give `s_1, s_0` with the covariances
//! `C_1, C_0`, each with a variance of its own. Two differences are looked at, each with
//!
//! `T = d' C^-1 d`:
//!
//! - of Y at one frequency, what is held known: with the responses `h = [Re, Im]` of the basis at
//!   [`Detection::frequency`], `d = h (s_1 - s_0)`, chi-square with `nu = 2` degrees of freedom where
//!   nothing changes and the basis is right;
//! - of gains, natural frequency, damping and delay together, the level not: `nu = 6`.
//!
//! The first finds people, whose response changes where they control; the second what turns elsewhere, or
//! what one of them does that another undoes at that frequency. It is looked at over a short and over a
//! long present: small changes need more data than large ones.
//!
//! People vary, and no basis is right: T is held against the level c at which it has been so far, from
//! the mean of log T, whose expectation for a chi-square is `ln 2 + psi(nu/2)`: .116 and 1.616. Whose T
//! varies more, varies more unevenly too (a remnant that grows with the error, a stick that ends), so it is
//! divided by `c^1.5`. Each is then told as what it has against chance, in nats: for even nu and
//! `x = T/2c^1.5`
//!
//! `-ln P(chi^2 > 2x) = x - ln (1 + x + .. + x^(nu/2-1)/(nu/2-1)!)`.
//!
//! A change is declared where one of them is above the threshold in some blocks one after another. When it
//! was, and what changed, is told by the block that leaves least where gains and what is held are free
//! before it and behind it (R. E. Quandt, *J. American Statistical Association* 53 (1958) 873-880).
//!
//! The blocks are those of the candidate of now (`last_blocks`), all behind its noise model and in its
//! basis: when another takes over, so do its blocks. From three seconds behind a gap on, what is behind it is held
//! against what was before.
//!
//! Sources: G. C. Chow, *Econometrica* 28 (1960) 591-605; B. L. Welch, *Biometrika* 34 (1947) 28-35;
//! the mean of the logarithm and the tail: M. Abramowitz and I. A. Stegun, 1964, eq. 6.3.3, 6.3.4, 26.4.5.

use super::{
    basis::Complex,
    blocks::{Block, Span, WholeSpan},
    cholesky,
    difference::Difference,
    last_blocks::{BLOCK_S, BLOCKS, LastBlocks},
    sizes::{GAINS, HELD, LINEAR},
};

/// Which differences, and over which present.
const STATISTICS: [(Of, usize); 3] = [(Of::Response, SHORT), (Of::All, SHORT), (Of::All, LONG)];
const SHORT: usize = 0;
const LONG: usize = 1;
/// Power of the level that T is divided by.
const UNEVEN: f64 = 1.5;
/// Expectation of the logarithm of a chi-square with one pair, `ln 2 - gamma`.
const MEAN_LOG: f64 = 0.115_931_515_658_412_45;
/// What both look at together: gains and what is held.
const OPERATOR: usize = GAINS + HELD;
/// Blocks behind a gap from which they are held against those before it.
const FEWEST: usize = 4;
/// Blocks that the supposed level of T counts for, and the logarithm of that level.
const SUPPOSED: f64 = 2.0;
const USUAL: f64 = 0.5;
/// Blocks that the level is a mean of at most.
const LONGEST: f64 = 240.0;
/// By so much a logarithm raises the level at most: a change is no usual variation.
const MOST: f64 = 3.0;

/// What the detector looks at.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Detection {
    /// Frequency, rad/s.
    pub frequency: f64,
    /// Blocks of the present: of a short and of a long one.
    pub recent: [usize; 2],
    /// Least number of blocks before.
    pub least: usize,
    /// Largest number of blocks before.
    pub most: usize,
    /// What one of them must have against chance, nats.
    pub threshold: f64,
    /// Standard deviations that are supposed of what is held, in its units.
    pub held: [f64; HELD],
    /// Blocks in which it must be above.
    pub persistence: u64,
    /// Blocks after a change in which none is declared.
    pub refractory: u64,
}

/// A difference of now from before.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Of {
    Response,
    All,
}

impl Of {
    /// Degrees of freedom, in pairs.
    fn pairs(self) -> u32 {
        match self {
            Self::Response => 1,
            Self::All => 3,
        }
    }
}

/// A statistic in units of what it has been.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Statistic {
    pairs: u32,
    level: f64,
    levels: f64,
    against_chance: f64,
    above: u64,
}

crate::state!([] Statistic { level, levels, against_chance, above });

impl Statistic {
    fn new(pairs: u32) -> Self {
        Self {
            pairs,
            level: mean_log(pairs) + USUAL,
            levels: SUPPOSED,
            against_chance: 0.0,
            above: 0,
        }
    }

    /// How many times larger than a chi-square it has been.
    fn usual(&self) -> f64 {
        libm::exp(self.level - mean_log(self.pairs)).max(1.0)
    }

    /// Takes T; true where it has been above the threshold for long enough.
    fn take(&mut self, t: f64, threshold: f64, persistence: u64) -> bool {
        self.against_chance = against_chance(t / libm::pow(self.usual(), UNEVEN), self.pairs);
        self.levels = (self.levels + 1.0).min(SUPPOSED + LONGEST);
        let log = libm::log(t.max(0.05)).min(self.level + MOST);
        self.level += (log - self.level) / self.levels;
        self.above = if self.against_chance > threshold {
            self.above + 1
        } else {
            0
        };
        self.above >= persistence
    }
}

/// Expectation of the logarithm of a chi-square with so many pairs of degrees of freedom.
fn mean_log(pairs: u32) -> f64 {
    MEAN_LOG + (1..pairs).map(|k| 1.0 / f64::from(k)).sum::<f64>()
}

/// `-ln P(chi^2 > x)` for a chi-square with so many pairs of degrees of freedom.
fn against_chance(x: f64, pairs: u32) -> f64 {
    let half = 0.5 * x;
    let (mut term, mut sum) = (1.0, 1.0);
    for k in 1..pairs {
        term *= half / f64::from(k);
        sum += term;
    }
    half - libm::log(sum)
}

/// What the blocks say.
#[derive(Debug, Clone, PartialEq)]
pub struct Detector {
    what: Detection,
    response: [Complex; GAINS],
    statistics: [Statistic; STATISTICS.len()],
    /// Blocks since the last change was declared.
    since: u64,
    spans: [Span; 2],
    whole: [WholeSpan; 2],
    declared: bool,
    difference: Difference,
    ago: usize,
}

crate::state!([] Detector { response, statistics, since, spans, whole, declared, difference, ago });

impl Detector {
    /// Before the first block. `None` where there is no room for the blocks.
    pub fn new(what: Detection) -> Option<Self> {
        let [short, long] = what.recent;
        let present = short > 0 && short <= long;
        let room = present && what.least > 0 && what.least <= what.most && long + what.most <= BLOCKS;
        let sound = what.held.iter().all(|d| *d > 0.0 && d.is_finite());
        (room && sound).then_some(Self {
            what,
            response: [[0.0; 2]; GAINS],
            statistics: STATISTICS.map(|(of, _)| Statistic::new(of.pairs())),
            since: u64::MAX >> 12,
            spans: [Span::default(); 2],
            whole: [WholeSpan::default(); 2],
            declared: false,
            difference: Difference::default(),
            ago: 0,
        })
    }

    /// Looks at blocks of which the last is new. `response` is that of the gains at the frequency, `held` where
    /// what is held is now, about the basis of the blocks.
    pub(super) fn look(&mut self, last: &LastBlocks, response: [Complex; GAINS], held: [f64; HELD]) {
        (self.response, self.declared) = (response, false);
        self.since += 1;
        // What was before the last change is no measure of what comes.
        let known = last
            .all()
            .len()
            .min(usize::try_from(self.since).unwrap_or(BLOCKS) + self.ago);
        let blocks = &last.all()[last.all().len() - known..];
        self.statistics.iter_mut().for_each(|s| s.against_chance = 0.0);
        let mut passed = false;
        // The short present last: its spans are those that are told.
        for present in [LONG, SHORT] {
            passed |= self.compare(blocks, last.fresh(), held, present);
        }
        if passed && self.since > self.what.refractory {
            self.declared = true;
            self.since = 0;
            self.statistics.iter_mut().for_each(|s| s.above = 0);
            self.split(blocks, held, self.what.recent[LONG].min(last.fresh()));
        }
    }

    /// Holds a present against what was before it; true where a statistic has been above for long enough.
    fn compare(&mut self, blocks: &[Block], fresh: usize, held: [f64; HELD], present: usize) -> bool {
        let Detection {
            least,
            most,
            threshold,
            persistence,
            ..
        } = self.what;
        let recent = self.what.recent[present].min(fresh);
        let middle = blocks.len().saturating_sub(recent);
        let of_this = STATISTICS.map(|(of, over)| (over == present).then_some(of));
        if middle < least || recent < FEWEST.min(self.what.recent[SHORT]) {
            let these = self.statistics.iter_mut().zip(of_this).filter(|(_, of)| of.is_some());
            these.for_each(|(s, _)| s.above = 0);
            return false;
        }
        let sums = [
            Block::of(&blocks[middle.saturating_sub(most)..middle]),
            Block::of(&blocks[middle..]),
        ];
        let [Some(past), Some(now)] = sums.each_ref().map(Block::fit) else {
            return false;
        };
        self.spans = [past, now];
        let whole = sums.each_ref().map(|sum| sum.fit_whole(held, self.what.held));
        if let [Some(past), Some(now)] = whole {
            self.whole = [past, now];
        }
        let mut passed = false;
        for (i, of) in of_this.into_iter().enumerate() {
            let t = match of {
                Some(Of::Response) => self.of_response(),
                Some(Of::All) => self.of_all(),
                None => None,
            };
            passed |= t.is_some_and(|t| self.statistics[i].take(t, threshold, persistence));
        }
        passed
    }

    /// The spans before and after the block that leave least when the change is supposed to be there.
    fn split(&mut self, blocks: &[Block], held: [f64; HELD], recent: usize) {
        let mut least = f64::MAX;
        self.ago = recent;
        for after in 1..=recent.min(blocks.len().saturating_sub(1)) {
            let (past, present) = blocks.split_at(blocks.len() - after);
            let sums = [Block::of(past), Block::of(present)];
            let [Some(past), Some(present)] = sums.each_ref().map(|sum| sum.fit_whole(held, self.what.held)) else {
                continue;
            };
            let [Some(before), Some(now)] = sums.each_ref().map(Block::fit) else {
                continue;
            };
            if past.left + present.left < least {
                least = past.left + present.left;
                (self.whole, self.spans) = ([past, present], [before, now]);
                self.ago = after;
            }
        }
        let [before, after] = &self.whole;
        let level = self.statistics[1].usual();
        self.difference = Difference::of(before, after, level).unwrap_or_default();
    }

    /// How long ago the change that was declared last had been, when it was declared, s.
    pub fn ago_s(&self) -> f64 {
        self.ago as f64 * BLOCK_S
    }

    /// T of Y; `None` where the spans say nothing of the frequency.
    fn of_response(&self) -> Option<f64> {
        let [past, present] = &self.spans;
        let (mut d, mut c) = ([0.0; 2], [[0.0; 2]; 2]);
        for i in 0..GAINS {
            for (part, d) in d.iter_mut().enumerate() {
                *d += self.response[i][part] * (present.state[i] - past.state[i]);
            }
            for j in 0..GAINS {
                let both = past.covariance[i][j] + present.covariance[i][j];
                for a in 0..2 {
                    for b in 0..2 {
                        c[a][b] += self.response[i][a] * both * self.response[j][b];
                    }
                }
            }
        }
        distance(c, d)
    }

    /// T of gains and what is held.
    fn of_all(&self) -> Option<f64> {
        let [past, present] = &self.whole;
        let place = |i: usize| if i < GAINS { i } else { i + LINEAR - GAINS };
        let d = core::array::from_fn(|i| present.state[place(i)] - past.state[place(i)]);
        let of = |span: &WholeSpan, i: usize, j: usize| span.covariance[place(i)][place(j)];
        let c = core::array::from_fn(|i| core::array::from_fn(|j| of(past, i, j) + of(present, i, j)));
        distance::<OPERATOR>(c, d)
    }

    /// What the last block has against chance, nats: the most that one of them has; zero while there is too
    /// little to compare.
    pub fn against_chance(&self) -> f64 {
        self.statistics.iter().fold(0.0, |most, s| s.against_chance.max(most))
    }

    /// How many times larger than a chi-square T of Y and T of all have been without a change, over the
    /// short present.
    pub fn usual_levels(&self) -> [f64; 2] {
        [0, 1].map(|i| self.statistics[i].usual())
    }

    /// Before and now, at the last block; before and after the change where one was declared at it.
    pub fn spans(&self) -> &[Span; 2] {
        &self.spans
    }

    /// The same where what is held is not known.
    pub fn whole_spans(&self) -> &[WholeSpan; 2] {
        &self.whole
    }

    /// True where a change was declared at the last sample.
    pub fn declared(&self) -> bool {
        self.declared
    }

    /// What changed at the change that was declared last.
    pub fn difference(&self) -> &Difference {
        &self.difference
    }

    /// No block ended at this sample: no change is declared at it.
    pub(super) fn pass_over(&mut self) {
        self.declared = false;
    }
}

/// `d' C^-1 d`; `None` where C is not positive.
fn distance<const N: usize>(mut c: [[f64; N]; N], d: [f64; N]) -> Option<f64> {
    let mut solved = d;
    if !cholesky::factor(&mut c, N) {
        return None;
    }
    cholesky::solve(&c, N, &mut solved);
    let t: f64 = solved.iter().zip(d).map(|(s, d)| s * d).sum();
    t.is_finite().then_some(t)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn chance_is_that_of_the_tables() {
        // Abramowitz and Stegun, table 26.8: percentage points of the chi-square for Q = .05 and .001.
        for (pairs, [five, one]) in [
            (1, [5.99147, 13.8155]),
            (2, [9.48773, 18.4668]),
            (3, [12.5916, 22.4577]),
        ] {
            for (x, q) in [(five, 0.05_f64), (one, 0.001)] {
                assert!((against_chance(x, pairs) + libm::log(q)).abs() < 1e-4, "{pairs} {q}");
            }
        }
        assert_eq!(against_chance(0.0, 3), 0.0);
    }
}
