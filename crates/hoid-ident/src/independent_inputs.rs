//! Tests inputs for linear dependence.

use crate::{IdentError, linalg::vectors::dot};

/// Fraction of the power of an input that the previous inputs must leave unexplained.
const MIN_UNEXPLAINED_SHARE: f64 = 1e-9;

/// Returns an error for an input that is constant or a linear combination of the previous inputs, such as r = e + y if
/// all three signals of a loop are inputs. `inputs` are the names and the values, from which the mean is subtracted;
/// the first input is the error, which may be constant.
///
/// # Errors
/// [`IdentError::BadOption`] with the name of the input.
pub fn check_independent_inputs<'a>(inputs: impl IntoIterator<Item = (&'a str, Vec<f64>)>) -> Result<(), IdentError> {
    let refuse = |found: String, expected: String| {
        Err(IdentError::BadOption {
            option: "the inputs".to_owned(),
            found,
            expected,
        })
    };
    let mut names: Vec<&str> = Vec::new();
    let mut basis: Vec<Vec<f64>> = Vec::new();
    for (name, own) in inputs {
        if names.is_empty() {
            names.push(name);
            basis.push(own);
            continue;
        }
        let power = dot(&own, &own);
        if power <= 0.0 {
            return refuse(
                format!("{name} is constant"),
                format!("inputs that vary; drop {name}: a response to a constant input cannot be identified"),
            );
        }
        // The projection is repeated, because the second pass removes the rounding error of the first.
        let mut left = own;
        for _ in 0..2 {
            for known in &basis {
                let size = dot(known, known);
                if size > 0.0 {
                    let share = dot(known, &left) / size;
                    left.iter_mut().zip(known).for_each(|(x, k)| *x -= share * k);
                }
            }
        }
        if dot(&left, &left) <= MIN_UNEXPLAINED_SHARE * power {
            return refuse(
                format!("{name} is a linear combination of {}", names.join(" and ")),
                format!(
                    "linearly independent inputs (r = e + y is not independent of e and y); drop one of {}, {name}",
                    names.join(", "),
                ),
            );
        }
        names.push(name);
        basis.push(left);
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    #[test]
    fn dependent_and_constant_inputs_are_named() {
        let wave = |omega: f64| -> Vec<f64> { (0..400).map(|k| (omega * f64::from(k)).sin()).collect() };
        let (e, y) = (wave(0.1), wave(0.23));
        let sum: Vec<f64> = e.iter().zip(&y).map(|(e, y)| e + y).collect();
        check_independent_inputs([("e", e.clone()), ("y", y.clone())]).unwrap();
        let found = |r: Vec<f64>| {
            let inputs = [("e", e.clone()), ("y", y.clone()), ("r", r)];
            check_independent_inputs(inputs).unwrap_err().to_string()
        };
        assert!(found(sum).contains("r is a linear combination of e and y"));
        assert!(found(vec![0.0; 400]).contains("r is constant"));
    }
}
