//! Signals of a span of samples, preceded by the end of the previous span.

use super::rows::Rows;

/// Signals of a span, with one row per sample and one value per lane. The rows before the span contain the end of the
/// previous span.
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
    /// Orthogonalised responses to the initial states, one after the other.
    pub q: Rows,
}

impl SignalBuffers {
    /// Allocates memory for spans of up to `longest` samples, with zeros before the first span.
    pub fn prepare(&mut self, history: usize, longest: usize, width: usize) {
        for signal in [
            &mut self.s,
            &mut self.v,
            &mut self.eps,
            &mut self.x_b,
            &mut self.r,
            &mut self.x_f,
        ] {
            signal.allocate((history + longest) * width);
            signal[..history * width].fill(0.0);
        }
    }

    /// Copies the end of a span to the front, as the past of the next span.
    pub fn carry_over_tail(&mut self, history: usize, count: usize, width: usize) {
        for signal in [&mut self.s, &mut self.v, &mut self.x_b, &mut self.r, &mut self.x_f] {
            signal.copy_within(count * width..(count + history) * width, 0);
        }
    }
}
