//! One form for all people and conditions that are compared, since parameters have the same meaning only within one
//! form.
//!
//! People are independent, so the evidence for a form is the sum of its criteria over people and conditions, each
//! relative to the best form for the same person and condition (K. P. Burnham and D. R. Anderson, *Model Selection and
//! Multimodel Inference*, 2002, section 2.6). The common form is the simplest form within 2 of the smallest sum. A form
//! that the data of most people leave open is not considered, because its parameters would not be determined.

use hoid_ident::family::{MIN_WEIGHT, NEGLIGIBLE_AIC_DIFFERENCE};
use hoid_model::{Finding, Form};
use hoid_study::group::FormEvidence;

/// One form for all people and conditions, with its evidence.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CommonForm {
    /// The form.
    pub form: Form,
    /// Criterion of the form relative to the best form, summed over people and conditions.
    pub criterion: f64,
    /// Number of combinations of person and condition.
    pub cells: usize,
}

/// True if the data leave the form open: its weight is zero, although its criterion is close to the smallest one.
fn is_undetermined(of: &FormEvidence) -> bool {
    of.weight == 0.0 && of.criterion < -2.0 * MIN_WEIGHT.ln()
}

/// Returns the simplest form within 2 of the smallest sum of criteria; `None` if no form has a criterion for all people
/// and conditions.
pub(super) fn common_form(people: &[&[FormEvidence]]) -> Option<CommonForm> {
    let sum = |form: Form| -> Option<CommonForm> {
        let of = |forms: &&[FormEvidence]| forms.iter().find(|of| of.form == form).cloned();
        let all: Vec<FormEvidence> = people.iter().map(of).collect::<Option<_>>()?;
        let open = all.iter().filter(|of| is_undetermined(of)).count();
        (2 * open <= all.len()).then(|| CommonForm {
            form,
            criterion: all.iter().map(|of| of.criterion).sum(),
            cells: all.len(),
        })
    };
    if people.is_empty() {
        return None;
    }
    let sums: Vec<CommonForm> = Form::ALL.iter().filter_map(|form| sum(*form)).collect();
    let least = sums.iter().map(|of| of.criterion).fold(f64::INFINITY, f64::min);
    let near = sums
        .into_iter()
        .filter(|of| of.criterion - least <= NEGLIGIBLE_AIC_DIFFERENCE);
    near.min_by_key(|of| (of.form.coordinate_count(), of.form))
}

impl CommonForm {
    /// Returns the note that a comparison uses this form.
    pub(super) fn finding(&self, best: &str) -> Finding {
        Finding::note(
            "common-form",
            format!(
                "the parameters of all people are compared in the form {}, which has the most evidence over {} fits (its criteria sum to {:.1} more than those of the best form of each fit: {best})",
                self.form.name(),
                self.cells,
                self.criterion,
            ),
        )
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    fn person(all: &[(Form, f64, f64)]) -> Vec<FormEvidence> {
        let of = |&(form, criterion, weight): &(Form, f64, f64)| FormEvidence {
            form,
            criterion,
            weight,
        };
        all.iter().map(of).collect()
    }

    #[test]
    fn common_form_is_the_simplest_near_the_smallest_sum() {
        use Form::{Gain, Lead, LeadLag};
        let one = person(&[(Gain, 0.0, 0.8), (Lead, 2.0, 0.2), (LeadLag, 2.5, 0.1)]);
        let two = person(&[(Gain, 30.0, 0.0), (Lead, 0.0, 0.6), (LeadLag, 1.0, 0.4)]);
        let found = common_form(&[&one, &two]).unwrap();
        assert_eq!((found.form, found.criterion, found.cells), (Lead, 2.0, 2));
        // A simpler form within 2 is preferred.
        let three = person(&[(Lead, 2.4, 0.2), (LeadLag, 0.0, 0.8)]);
        assert_eq!(common_form(&[&two, &three, &one]).unwrap().form, Lead);
        // A form that one person lacks cannot be the common form.
        let without = person(&[(Gain, 0.0, 1.0)]);
        assert_eq!(common_form(&[&two, &without]).unwrap().form, Gain);
        assert_eq!(common_form(&[]), None);
        assert_eq!(common_form(&[&[]]), None);
    }

    #[test]
    fn form_undetermined_for_most_people_is_not_common() {
        use Form::{Lead, LeadLag};
        let open = person(&[(Lead, 5.0, 1.0), (LeadLag, 0.0, 0.0)]);
        let closed = person(&[(Lead, 5.0, 0.1), (LeadLag, 0.0, 0.9)]);
        assert_eq!(common_form(&[&open, &open, &closed]).unwrap().form, Lead);
        assert_eq!(common_form(&[&open, &closed, &closed]).unwrap().form, LeadLag);
    }
}
