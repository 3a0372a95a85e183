//! The signals of a span of samples, preceded by the end of the previous span.

use super::rows::Rows;

/// Signals of a span, a row for each sample with a number for each lane. The rows before the first contain the end of
/// the previous span.
#[derive(Debug, Default)]
pub(super) struct SignalBuffers {
    pub s: Rows,
    pub v: Rows,
    pub eps: Rows,
    pub x_b: Rows,
    pub r: Rows,
    pub x_f: Rows,
    /// Impulse responses of 1/F and of D/F.
    pub h: Rows,
    pub g: Rows,
    /// Responses to the initial states, orthogonal, one after the other.
    pub q: Rows,
}

impl SignalBuffers {
    /// Allocates spans of a given number of samples, with zeros before the first.
    pub fn begin(&mut self, history: usize, longest: usize, width: usize) {
        for signal in [
            &mut self.s,
            &mut self.v,
            &mut self.eps,
            &mut self.x_b,
            &mut self.r,
            &mut self.x_f,
        ] {
            signal.make_room((history + longest) * width);
            signal[..history * width].fill(0.0);
        }
    }

    /// Copies the end of a span to the front for the next.
    pub fn carry(&mut self, history: usize, count: usize, width: usize) {
        for signal in [&mut self.s, &mut self.v, &mut self.x_b, &mut self.r, &mut self.x_f] {
            signal.copy_within(count * width..(count + history) * width, 0);
        }
    }
}
