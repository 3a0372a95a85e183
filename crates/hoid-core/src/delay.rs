//! Delay line: `y(t) = x(t - n)`, zero before the first sample.

/// Delay of n samples, where n is the length of the memory: a slice, an array or a vector. With an empty memory the
/// output equals the input.
#[derive(Debug, Clone, PartialEq)]
pub struct DelayLine<M> {
    memory: M,
    oldest: usize,
}

impl<M: AsMut<[f64]>> crate::state::State for DelayLine<M> {
    fn visit(&mut self, each: &mut dyn FnMut(&mut f64)) {
        self.memory.as_mut().visit(each);
        self.oldest.visit(each);
        self.oldest = self.oldest.min(self.memory.as_mut().len().saturating_sub(1));
    }
}

impl<M: AsMut<[f64]>> DelayLine<M> {
    /// Builds the delay line at rest and fills its memory with zeros.
    pub fn new(mut memory: M) -> Self {
        memory.as_mut().fill(0.0);
        Self { memory, oldest: 0 }
    }

    /// Takes `x(t)` and returns `x(t - n)`, where `n` is the length of the memory.
    #[inline]
    pub fn step(&mut self, x: f64) -> f64 {
        let memory = self.memory.as_mut();
        if memory.is_empty() {
            return x;
        }
        let y = core::mem::replace(&mut memory[self.oldest], x);
        self.oldest += 1;
        if self.oldest == memory.len() {
            self.oldest = 0;
        }
        y
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::vec::Vec;

    #[test]
    fn delay_equals_the_length_of_the_memory() {
        for n in 0..4 {
            let mut memory = [7.0; 4];
            let mut line = DelayLine::new(&mut memory[..n]);
            let y: Vec<f64> = (1..=6).map(|x| line.step(f64::from(x))).collect();
            let expected: Vec<f64> = (1..=6).map(|x| f64::from(x - n as i32).max(0.0)).collect();
            assert_eq!(y, expected);
        }
    }
}
