//! The inverse of an information matrix, and the detection of parameters that it does not determine.
//!
//! `psi' psi` is scaled to a unit diagonal, so units have no effect, and inverted by means of its eigenvalues. An
//! eigenvalue that is zero except for rounding belongs to a combination of parameters that the data do not determine,
//! and its eigenvector identifies these parameters.

use nalgebra::{DMatrix, SymmetricEigen};

use crate::IdentError;

/// A combination of parameters counts as undetermined by the data if its eigenvalue of the information matrix (scaled
/// to a unit diagonal) is below this limit. Rounding leaves about 1e-15 times the number of parameters.
const MIN_EIGENVALUE: f64 = 1e-13;

/// Returns the inverse of the information matrix by rows; `names` are the names of the parameters.
///
/// # Errors
/// [`IdentError::SingularInformation`] with the names of the parameters that are not determined.
pub(crate) fn inverse_information(gram: &[f64], names: &[String]) -> Result<Vec<f64>, IdentError> {
    let p = names.len();
    let zero: Vec<&str> = (0..p)
        .filter(|i| gram[i * p + i].is_nan() || gram[i * p + i] <= 0.0)
        .map(|i| names[i].as_str())
        .collect();
    if !zero.is_empty() {
        return Err(IdentError::SingularInformation {
            parameters: zero.join(", "),
        });
    }
    let scale: Vec<f64> = (0..p).map(|i| gram[i * p + i].sqrt()).collect();
    let scaled = DMatrix::from_fn(p, p, |i, j| gram[i * p + j] / (scale[i] * scale[j]));
    let eigen = SymmetricEigen::new(scaled);
    if let Some(k) = (0..p).find(|&k| eigen.eigenvalues[k] < MIN_EIGENVALUE) {
        let direction = eigen.eigenvectors.column(k);
        let largest = direction.amax();
        let involved: Vec<&str> = (0..p)
            .filter(|&i| direction[i].abs() > 0.1 * largest)
            .map(|i| names[i].as_str())
            .collect();
        return Err(IdentError::SingularInformation {
            parameters: involved.join(", "),
        });
    }
    let mut inverse = vec![0.0; p * p];
    for i in 0..p {
        for j in 0..p {
            let sum: f64 = (0..p)
                .map(|k| eigen.eigenvectors[(i, k)] * eigen.eigenvectors[(j, k)] / eigen.eigenvalues[k])
                .sum();
            inverse[i * p + j] = sum / (scale[i] * scale[j]);
        }
    }
    Ok(inverse)
}

/// Returns the inverse for the free parameters; the rows and columns of all other parameters are zero, since these have
/// no variance.
///
/// # Errors
/// The errors of [`inverse_information`].
pub(crate) fn inverse_information_of_free(
    gram: &[f64],
    free: &[usize],
    names: &[String],
) -> Result<Vec<f64>, IdentError> {
    let p = names.len();
    if free.is_empty() {
        return Ok(vec![0.0; p * p]);
    }
    let part: Vec<f64> = free
        .iter()
        .flat_map(|&i| free.iter().map(move |&j| gram[i * p + j]))
        .collect();
    let free_names: Vec<String> = free.iter().map(|&i| names[i].clone()).collect();
    let inverse = inverse_information(&part, &free_names)?;
    let mut whole = vec![0.0; p * p];
    for (k, &i) in free.iter().enumerate() {
        for (l, &j) in free.iter().enumerate() {
            whole[i * p + j] = inverse[k * free.len() + l];
        }
    }
    Ok(whole)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns `J' J` by rows for a Jacobian given by columns.
    fn gram(columns: &[Vec<f64>]) -> Vec<f64> {
        let product = |a: &Vec<f64>, b: &Vec<f64>| a.iter().zip(b).map(|(x, y)| x * y).sum();
        columns
            .iter()
            .flat_map(|a| columns.iter().map(move |b| product(a, b)))
            .collect()
    }

    fn columns() -> Vec<Vec<f64>> {
        let column = |w: f64, size: f64| (0..50).map(|t| size * (w * f64::from(t)).sin()).collect();
        vec![column(0.1, 1e3), column(0.7, 1.0), column(1.9, 1e-4)]
    }

    fn names() -> Vec<String> {
        ["b0", "d1", "f1"].map(String::from).to_vec()
    }

    #[test]
    fn inverse_information_is_the_inverse_in_any_units() {
        let g = gram(&columns());
        let inverse = inverse_information(&g, &names()).unwrap();
        for i in 0..3 {
            for j in 0..3 {
                let product: f64 = (0..3).map(|k| g[i * 3 + k] * inverse[k * 3 + j]).sum();
                let scale = (g[i * 4] / g[j * 4]).sqrt();
                assert!((product / scale - f64::from(u8::from(i == j))).abs() < 1e-12);
            }
        }
    }

    #[test]
    fn undetermined_combination_is_reported() {
        let mut dependent = columns();
        dependent[2] = dependent[0].iter().map(|v| -1e-6 * v).collect();
        match inverse_information(&gram(&dependent), &names()) {
            Err(IdentError::SingularInformation { parameters }) => assert_eq!(parameters, "b0, f1"),
            other => panic!("expected singular information, found {other:?}"),
        }
        let mut silent = columns();
        silent[1].fill(0.0);
        match inverse_information(&gram(&silent), &names()) {
            Err(IdentError::SingularInformation { parameters }) => assert_eq!(parameters, "d1"),
            other => panic!("expected singular information, found {other:?}"),
        }
    }

    #[test]
    fn fixed_parameters_have_no_variance() {
        let g = gram(&columns());
        let part = inverse_information_of_free(&g, &[0, 2], &names()).unwrap();
        let two = inverse_information(&[g[0], g[2], g[6], g[8]], &["b0", "f1"].map(String::from)).unwrap();
        assert_eq!([part[0], part[2], part[6], part[8]], two.as_slice());
        assert!([1, 3, 4, 5, 7].iter().all(|&i| part[i] == 0.0));
        assert_eq!(inverse_information_of_free(&g, &[], &names()).unwrap(), vec![0.0; 9]);
    }
}
