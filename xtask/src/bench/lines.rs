//! The lines of JSON printed by hoid's tasks and by the peers.

use serde_json::Value;

/// Result of one peer for one task.
#[derive(Debug, Clone, PartialEq)]
pub struct Line {
    pub task: String,
    pub peer: String,
    pub outcome: Outcome,
}

#[derive(Debug, Clone, PartialEq)]
pub enum Outcome {
    Measured {
        seconds: f64,
        answer: Vec<f64>,
        /// Reason why the result differs by design.
        differs: Option<String>,
    },
    /// The peer is not installed or failed, for this reason.
    Skipped(String),
}

impl Line {
    fn parse(line: &str) -> Option<Self> {
        let object: Value = serde_json::from_str(line).ok()?;
        let text = |key: &str| object.get(key)?.as_str().map(str::to_owned);
        let outcome = match text("skipped") {
            Some(reason) => Outcome::Skipped(reason),
            None => Outcome::Measured {
                seconds: object.get("seconds")?.as_f64().filter(|s| *s > 0.0)?,
                answer: object
                    .get("answer")?
                    .as_array()?
                    .iter()
                    .filter_map(Value::as_f64)
                    .collect(),
                differs: text("differs"),
            },
        };
        Some(Self {
            task: text("task")?,
            peer: text("peer")?,
            outcome,
        })
    }

    /// True for a line of hoid.
    pub fn is_ours(&self) -> bool {
        self.peer.starts_with("hoid ")
    }
}

/// Extracts the lines from the printed output; libraries print other text as well.
pub fn of(printed: &str) -> Vec<Line> {
    printed.lines().filter_map(Line::parse).collect()
}

/// Returns one line for each task and peer, the fastest of all rounds, in the order of appearance.
pub fn fastest_lines(lines: Vec<Line>) -> Vec<Line> {
    let mut kept: Vec<Line> = Vec::new();
    for line in lines {
        let Some(other) = kept.iter_mut().find(|k| k.task == line.task && k.peer == line.peer) else {
            kept.push(line);
            continue;
        };
        match (&other.outcome, &line.outcome) {
            (Outcome::Skipped(_), _) => *other = line,
            (Outcome::Measured { seconds: old, .. }, Outcome::Measured { seconds: new, .. }) if new < old => {
                *other = line
            }
            _ => {}
        }
    }
    kept
}

/// Returns the largest relative difference between two results; `None` if they cannot be compared.
pub fn difference(a: &[f64], b: &[f64]) -> Option<f64> {
    let comparable = !a.is_empty() && a.len() == b.len();
    let relative = |(x, y): (&f64, &f64)| (x - y).abs() / x.abs().max(y.abs()).max(f64::MIN_POSITIVE);
    comparable.then(|| a.iter().zip(b).map(relative).fold(0.0, f64::max))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn result_lines_are_parsed_and_the_fastest_kept() {
        let printed = "Starting...\n\
            {\"task\": \"arx\", \"peer\": \"numba 1\", \"seconds\": 2e-5, \"answer\": [1.0, -2.0]}\n\
            {\"task\": \"arx\", \"peer\": \"numba 1\", \"seconds\": 1e-5, \"answer\": [1.0, -2.0]}\n\
            {\"task\": \"bj\", \"peer\": \"x 2\", \"skipped\": \"not there\"}\n\
            {\"task\": \"bj\", \"peer\": \"y\", \"seconds\": 0, \"answer\": []}\n[1, 2]\n";
        let lines = fastest_lines(of(printed));
        assert_eq!(lines.len(), 2);
        assert!(
            matches!(&lines[0].outcome, Outcome::Measured { seconds, answer, differs: None } if *seconds == 1e-5 && answer.len() == 2)
        );
        assert_eq!(lines[1].outcome, Outcome::Skipped("not there".to_owned()));
        assert!(!lines[0].is_ours());
    }

    #[test]
    fn answers_are_compared_relative_to_their_magnitude() {
        assert_eq!(difference(&[1.0, 0.0], &[1.0, 0.0]), Some(0.0));
        assert!((difference(&[100.0, 1.0], &[100.0, 1.001]).unwrap() - 0.001 / 1.001).abs() < 1e-15);
        assert_eq!(difference(&[1.0], &[1.0, 2.0]), None);
        assert_eq!(difference(&[], &[]), None);
    }
}
