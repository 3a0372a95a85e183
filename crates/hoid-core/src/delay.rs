//! A delay line: `y(t) = x(t - n)`, zero before the first sample.

/// A delay of as many samples as the buffer is long. An empty buffer passes its input through.
#[derive(Debug)]
pub struct DelayLine<'a> {
    buffer: &'a mut [f64],
    oldest: usize,
}

impl<'a> DelayLine<'a> {
    /// Takes the memory of the line and fills it with zeros (the state of rest).
    pub fn new(buffer: &'a mut [f64]) -> Self {
        buffer.fill(0.0);
        Self { buffer, oldest: 0 }
    }

    /// Takes `x(t)` and returns `x(t - n)`, with `n` the length of the buffer.
    #[inline]
    pub fn step(&mut self, x: f64) -> f64 {
        if self.buffer.is_empty() {
            return x;
        }
        let y = core::mem::replace(&mut self.buffer[self.oldest], x);
        self.oldest += 1;
        if self.oldest == self.buffer.len() {
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
    fn delays_by_the_length_of_its_buffer() {
        for n in 0..4 {
            let mut memory = [7.0; 4];
            let mut line = DelayLine::new(&mut memory[..n]);
            let y: Vec<f64> = (1..=6).map(|x| line.step(f64::from(x))).collect();
            let expected: Vec<f64> = (1..=6).map(|x| f64::from(x - n as i32).max(0.0)).collect();
            assert_eq!(y, expected);
        }
    }
}
