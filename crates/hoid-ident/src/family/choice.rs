//! Which form: the simplest that the data do not refute.
//!
//! Two kinds of evidence must speak against a form f, beside the form that predicts best:
//!
//! - **held-out runs**: each run is predicted by the fit to the others, and `D_f` sums over runs
//!   what f misses; the paired difference to the best, run by run, exceeds two of its standard
//!   errors (the rule of L. Breiman, J. Friedman, R. Olshen and C. Stone, *Classification and
//!   Regression Trees*, 1984, section 3.4.3, with two errors for one);
//! - **Schwarz's criterion** is larger by more than 6, which is strong evidence (R. E. Kass and
//!   A. E. Raftery, *J. American Statistical Association* 90 (1995) 773-795): `chi^2 + p ln n` at
//!   the lines, n the real equations of all runs, or `n ln V/kappa + p ln n` of the prediction
//!   error, kappa the inflation of variances.
//!
//! With fewer than three runs nothing can be held out. A form that is too simple then does more harm
//! than one that is too rich, since it bends the response: Akaike's criterion decides,
//! `chi^2 + 2 p` or `n ln V/kappa + 2 p`, the simplest form within 2 of the least.

use hoid_model::Form;

/// What a form is judged by.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct FormFigures {
    /// The form.
    pub form: Form,
    /// Loss of the prediction error fit.
    pub loss: Option<f64>,
    /// `n ln V/kappa + p ln n`.
    pub criterion: Option<f64>,
    /// What the held-out runs miss, summed over runs: chi^2 at the lines, or the squared prediction
    /// error in units of the innovation variance.
    pub held_out: Option<f64>,
    /// chi^2 at the lines.
    pub chi_squared: Option<f64>,
    /// Its degrees of freedom.
    pub degrees_of_freedom: Option<usize>,
    /// True when the prediction error search converged off the border of what is sought.
    pub converged: bool,
}

/// Difference of Schwarz's criterion that is strong evidence.
const STRONG_EVIDENCE: f64 = 6.0;
/// Difference of Akaike's criterion that is none (K. P. Burnham and D. R. Anderson, *Model Selection
/// and Multimodel Inference*, 2002, section 2.6).
const NO_EVIDENCE: f64 = 2.0;
/// Standard errors of a paired difference that held-out runs must exceed.
const PAIRED_ERRORS: f64 = 2.0;

/// A form, with what each held-out run missed and its criterion.
pub(super) struct Candidate {
    pub form: Form,
    pub held_out: Option<Vec<f64>>,
    pub criterion: f64,
}

/// The index of the choice among candidates ordered from the simplest; `None` for none.
pub(super) fn choose(candidates: &[Candidate]) -> Option<usize> {
    let held: Option<Vec<&Vec<f64>>> = candidates.iter().map(|c| c.held_out.as_ref()).collect();
    let merit = |i: usize| match &held {
        Some(held) => held[i].iter().sum(),
        None => candidates[i].criterion,
    };
    let best = (0..candidates.len()).min_by(|a, b| merit(*a).total_cmp(&merit(*b)))?;
    let Some(held) = &held else {
        let near = |i: &usize| candidates[*i].criterion - candidates[best].criterion <= NO_EVIDENCE;
        return (0..candidates.len()).find(near);
    };
    let refuted = |i: &usize| {
        is_worse(held[*i], held[best]) && candidates[*i].criterion - candidates[best].criterion > STRONG_EVIDENCE
    };
    (0..candidates.len()).find(|i| *i == best || !refuted(i))
}

/// Whether the sum of paired differences exceeds two of its standard errors.
fn is_worse(runs: &[f64], of_best: &[f64]) -> bool {
    let differences: Vec<f64> = runs.iter().zip(of_best).map(|(a, b)| a - b).collect();
    let n = differences.len() as f64;
    let mean = differences.iter().sum::<f64>() / n;
    let variance = differences.iter().map(|d| (d - mean).powi(2)).sum::<f64>() / (n - 1.0);
    n * mean > PAIRED_ERRORS * (n * variance).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn candidate(form: Form, criterion: f64, held_out: &[f64]) -> Candidate {
        Candidate {
            form,
            held_out: Some(held_out.to_vec()),
            criterion,
        }
    }

    #[test]
    fn the_simplest_that_is_not_refuted() {
        let gain = || candidate(Form::Gain, 90.0, &[30.0, 31.0, 29.0, 33.0]);
        let lead = |criterion| candidate(Form::Lead, criterion, &[11.0, 11.0, 11.5, 11.0]);
        let rich = || candidate(Form::LeadLag, 10.0, &[10.0, 10.0, 10.0, 10.0]);
        let chosen = |all: &[Candidate]| choose(all).map(|i| all[i].form);
        // Worse on every run, yet by too little.
        assert_eq!(chosen(&[gain(), lead(15.0), rich()]), Some(Form::Lead));
        assert_eq!(chosen(&[gain(), lead(17.0), rich()]), Some(Form::LeadLag));
        // By much, but not on every run.
        let uneven = candidate(Form::Lead, 50.0, &[8.0, 22.0, 9.0, 30.0]);
        assert_eq!(chosen(&[gain(), uneven, rich()]), Some(Form::Lead));
        assert_eq!(choose(&[]), None);
        let by_criterion =
            [(Form::Gain, 13.0), (Form::Lead, 6.5), (Form::Lead2, 1.0)].map(|(form, criterion)| Candidate {
                form,
                held_out: None,
                criterion,
            });
        assert_eq!(choose(&by_criterion), Some(2));
    }
}
