//! Reads samples and writes estimates.
//!
//! An input line is `e,u`; successive lines are [`SAMPLE_TIME_S`] apart. An output line is a row of the trace of
//! `hoid track` with the columns [`HEADER`]: t, then K_e, K_e_dot, omega_nm, zeta_nm and tau_e, each with its standard
//! error.

use core::{ffi::CStr, fmt::Arguments};

use hoid_core::adaptive::{
    AdaptiveFilter, PARAMETER_COUNT,
    defaults::{DefaultOperator, GIVEN_DELAY_DEVIATION_S, PRIOR_DEVIATIONS},
};

/// Name of the file with the samples.
pub const FILE_NAME: &CStr = c"run.csv";
/// Message if the file cannot be read.
pub const UNREADABLE_MESSAGE: &str = "run.csv cannot be read";
/// Columns of the output.
const HEADER: &str = "t,K_e,K_e_se,K_e_dot,K_e_dot_se,omega_nm,omega_nm_se,zeta_nm,zeta_nm_se,tau_e,tau_e_se";
/// Sample time in s.
const SAMPLE_TIME_S: f64 = 0.01;
/// Delay nk, in samples, of the textbook operator, from which the initial delay of the filter follows.
const NK: f64 = 29.0;
/// Number of samples per output line.
const SAMPLES_PER_LINE: u32 = 100;
/// Length of the memory in numbers: more than `min_memory(SAMPLE_TIME_S)`, but too short for replays.
const MEMORY_LEN: usize = 3 * 128;
/// Longest input line in bytes.
const MAX_LINE_BYTES: usize = 80;

/// Recursion with its own memory.
type Filter = AdaptiveFilter<[f64; MEMORY_LEN]>;

/// Size of the recursion in bytes.
pub const STATE_BYTES: usize = size_of::<Filter>();

/// Reads all samples and writes the estimates.
///
/// # Errors
/// A message that describes the failure of input or output.
pub fn run(
    read: impl FnMut(&mut [u8]) -> Result<usize, &'static str>,
    mut write: impl FnMut(Arguments<'_>) -> Result<(), &'static str>,
) -> Result<(), &'static str> {
    let supposed = DefaultOperator {
        spread: [PRIOR_DEVIATIONS[0], PRIOR_DEVIATIONS[1], GIVEN_DELAY_DEVIATION_S],
        ..DefaultOperator::with_delay((NK - 0.5) * SAMPLE_TIME_S)
    };
    let mut filter =
        Filter::new(supposed.prior(SAMPLE_TIME_S), [0.0; MEMORY_LEN]).ok_or("there is no filter for this prior")?;
    let mut lines = LineReader::new(read);
    write(format_args!("{HEADER}"))?;
    let mut samples = 0_u32;
    while let Some((e, u)) = lines.next_sample()? {
        filter.step(e, u);
        samples += 1;
        if samples.is_multiple_of(SAMPLES_PER_LINE) && filter.has_started() {
            let (values, covariance) = (filter.operator(), filter.operator_covariance());
            let [a, b, c, d, t]: [f64; PARAMETER_COUNT] = values;
            let se = |i: usize| libm::sqrt(covariance[i][i]);
            let at = f64::from(samples - 1) * SAMPLE_TIME_S;
            let of = [se(0), se(1), se(2), se(3), se(4)];
            write(format_args!(
                "{at:?},{a:?},{:?},{b:?},{:?},{c:?},{:?},{d:?},{:?},{t:?},{:?}",
                of[0], of[1], of[2], of[3], of[4]
            ))?;
        }
    }
    Ok(())
}

/// Reader of lines with two numbers each.
struct LineReader<R> {
    read: R,
    chunk: [u8; 256],
    position: usize,
    end: usize,
}

impl<R: FnMut(&mut [u8]) -> Result<usize, &'static str>> LineReader<R> {
    fn new(read: R) -> Self {
        Self {
            read,
            chunk: [0; 256],
            position: 0,
            end: 0,
        }
    }

    /// Returns e and u of the next line; `None` at the end of the file.
    fn next_sample(&mut self) -> Result<Option<(f64, f64)>, &'static str> {
        let (mut line, mut length) = ([0_u8; MAX_LINE_BYTES], 0);
        loop {
            let byte = self.next_byte()?;
            match byte {
                None | Some(b'\n') if length > 0 => break,
                None => return Ok(None),
                Some(b'\n' | b'\r') => {}
                Some(byte) => {
                    *line
                        .get_mut(length)
                        .ok_or("a line of run.csv is longer than 80 characters")? = byte;
                    length += 1;
                }
            }
        }
        let number = |text: &str| text.trim().parse::<f64>().ok().filter(|x| x.is_finite());
        let sample = core::str::from_utf8(&line[..length]).ok().and_then(|line| {
            let (e, u) = line.split_once(',')?;
            Some((number(e)?, number(u)?))
        });
        sample.map(Some).ok_or("a line of run.csv is not two numbers, e,u")
    }

    fn next_byte(&mut self) -> Result<Option<u8>, &'static str> {
        if self.position == self.end {
            (self.position, self.end) = (0, (self.read)(&mut self.chunk)?);
        }
        let byte = (self.position < self.end).then(|| self.chunk[self.position]);
        self.position += usize::from(byte.is_some());
        Ok(byte)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(text: &str) -> Result<Vec<String>, &'static str> {
        let (mut rest, mut lines) = (text.as_bytes(), Vec::new());
        let read = |bytes: &mut [u8]| {
            // The text is delivered in small parts, as input may arrive.
            let n = rest.len().min(bytes.len()).min(7);
            bytes[..n].copy_from_slice(&rest[..n]);
            rest = &rest[n..];
            Ok(n)
        };
        run(read, |line| {
            lines.push(line.to_string());
            Ok(())
        })?;
        Ok(lines)
    }

    #[test]
    fn one_line_is_printed_each_second() {
        let samples: String = (0..350)
            .map(|k| format!("{},{}\n", f64::from(k % 40) - 20.0, 0.1))
            .collect();
        let lines = of(&samples).unwrap();
        assert_eq!(lines[0], HEADER);
        assert_eq!(lines.len(), 4, "{lines:?}");
        assert!(lines[3].starts_with("2.99,"));
        assert!(lines.iter().all(|line| line.split(',').count() == 11));
    }

    #[test]
    fn invalid_lines_are_errors() {
        assert!(of("1,2\nx,3\n").unwrap_err().contains("two numbers"));
        assert!(of("1,inf\n").is_err() && of("1\n").is_err());
        assert!(of(&"1".repeat(90)).unwrap_err().contains("80"));
        assert_eq!(of("").unwrap(), [HEADER]);
        assert_eq!(of("\r\n1,2\r\n3,4").unwrap(), [HEADER]);
    }
}
