//! Number of tests over all crates and the Python package.

/// Numbers of passed, failed and skipped tests.
#[derive(Debug, Default, PartialEq)]
pub struct Counts {
    pub passed: usize,
    pub failed: usize,
    pub ignored: usize,
}

impl Counts {
    pub fn merge(&mut self, other: &Self) {
        self.passed += other.passed;
        self.failed += other.failed;
        self.ignored += other.ignored;
    }

    pub fn to_result(&self) -> Result<(), String> {
        match self.failed {
            0 => Ok(()),
            failed => Err(format!("{failed} tests failed")),
        }
    }

    /// Adds a line such as `test result: ok. 7 passed; 0 failed; 0 ignored; ...`; other lines are
    /// ignored.
    pub fn add(&mut self, line: &str) {
        let Some(numbers) = line.strip_prefix("test result: ") else {
            return;
        };
        for part in numbers.split([';', '.']) {
            let mut words = part.split_whitespace();
            let (Some(Ok(n)), Some(what)) = (words.next().map(str::parse::<usize>), words.next()) else {
                continue;
            };
            match what {
                "passed" => self.passed += n,
                "failed" => self.failed += n,
                "ignored" => self.ignored += n,
                _ => {}
            }
        }
    }

    /// Adds the last line of pytest, such as
    /// `=== 2 failed, 85 passed, 1 skipped in 61.20s (0:01:01) ===`.
    pub fn add_pytest(&mut self, line: &str) {
        let Some((numbers, time)) = line.trim_matches(['=', ' ']).rsplit_once(" in ") else {
            return;
        };
        if !time.starts_with(|c: char| c.is_ascii_digit()) {
            return;
        }
        for part in numbers.split(", ") {
            let mut words = part.split_whitespace();
            let (Some(Ok(n)), Some(what)) = (words.next().map(str::parse::<usize>), words.next()) else {
                return;
            };
            match what {
                "passed" => self.passed += n,
                "failed" | "error" | "errors" => self.failed += n,
                "skipped" | "deselected" | "xfailed" => self.ignored += n,
                _ => {}
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn test_counts_add_up_over_crates() {
        let mut counts = Counts::default();
        for line in [
            "running 3 tests",
            "test result: ok. 7 passed; 0 failed; 1 ignored; 0 measured; 2 filtered out; finished in 0.00s",
            "test result: FAILED. 5 passed; 2 failed; 0 ignored; 0 measured; 0 filtered out; finished in 1.00s",
        ] {
            counts.add(line);
        }
        assert_eq!(
            counts,
            Counts {
                passed: 12,
                failed: 2,
                ignored: 1
            }
        );
    }

    #[test]
    fn pytest_counts_come_from_the_summary_line() {
        let mut counts = Counts::default();
        for line in [
            "tests/test_core.py .......",
            "3.19s call     tests/test_command_line.py::test_identify in 5 steps",
            "============ 2 failed, 85 passed, 1 skipped, 1 error in 61.20s (0:01:01) ============",
        ] {
            counts.add_pytest(line);
        }
        assert_eq!((counts.passed, counts.failed, counts.ignored), (85, 3, 1));
    }
}
