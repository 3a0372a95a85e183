//! Hierarchical estimates: an estimate for each person, pooled with all people, and the population from which the
//! people are drawn.
//!
//! In a condition, the data of person i give `y_i = ln theta_i` with the variance `v_i = (s_i/theta_i)^2`. The true
//! values are drawn from a population `N(mu, tau^2)`. mu is the mean of [`crate::compare::meta_mean`], and tau^2
//! maximises `l + log tau` (Y. Chung, S. Rabe-Hesketh and I.-H. Choi, *Stat. Med.* 32 (2013) 4071-4089), which is never
//! zero. The pooled estimate for a person (B. Efron and C. Morris, *J. Am. Stat. Assoc.* 70 (1975) 311-319) is
//!
//! `B_i mu + (1 - B_i) y_i`, `B_i = v_i/(v_i + tau^2)`, with the variance `(1 - B_i) v_i + B_i^2 var(mu)`.
//!
//! **B is the shrinkage**, which is 1 for a person without information. The variance ignores that tau^2 is itself an
//! estimate. A new person has the mean `mu` and the variance `tau^2 + var(mu)`, which form the prior.
//!
//! A prior that is already part of the estimates is removed first, since it would otherwise be counted once for each
//! person. With its share w, its centre m and an estimate y, the data alone give `y - w (m - y)/(1 - w)` with the
//! variance `v/(1 - w)` ([`OperatorPrior::pull`]). If the share of the prior exceeds nine tenths, the person counts as
//! having no information.

use hoid_ident::family::{OperatorPrior, Parameter};
use hoid_io::{ColumnValues, OutputColumn, OutputTable};
use hoid_model::operator_family::PARAMETERS;
use hoid_study::group::Person;
use serde::Serialize;
use serde_json::{Value, json};

use crate::compare::{CompareError, Observation, Weights, meta_mean, variance_between_people};

/// Parameters with the same meaning in every form.
const FORM_INDEPENDENT_NAMES: [&str; 3] = ["omega_nm", "zeta_nm", "tau_e"];
/// Smallest number of people with information for which a parameter is pooled.
const MIN_PEOPLE: usize = 3;
/// Share of the prior above which the data of a person are regarded as uninformative.
const UNINFORMATIVE_PRIOR_SHARE: f64 = 0.9;

/// Estimate for one person, pooled with all people.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PooledPerson {
    /// Name of the person.
    pub subject: String,
    /// Estimate from the person's own data, with its standard error; `None` if these data carry no information.
    pub own: Option<(f64, f64)>,
    /// Estimate pooled with all people.
    pub value: f64,
    /// Standard error of the pooled estimate.
    pub standard_error: f64,
    /// Shrinkage towards the mean of all people, from 0 (none) to 1 (complete).
    pub shrinkage: f64,
}

/// A parameter of the population in a condition.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PooledParameter {
    /// Name of the parameter.
    pub name: String,
    /// Unit of the parameter.
    pub unit: String,
    /// Median of the population, `exp(mu)`.
    pub centre: f64,
    /// Standard deviation between people of the logarithm of the parameter.
    pub spread: f64,
    /// Standard deviation of the logarithm for a new person, which includes the error of the centre.
    pub spread_of_another: f64,
    /// Pooled estimates for the people.
    pub people: Vec<PooledPerson>,
}

/// The population of a condition.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Population {
    /// Name of the condition.
    pub condition: String,
    /// Form of the operators of all people; `None` if they differ.
    pub form: Option<String>,
    /// Parameters that are pooled.
    pub parameters: Vec<PooledParameter>,
    /// Parameters that are not pooled, with the reason.
    pub left_out: Vec<(String, String)>,
}

/// Returns the population of each condition of a group. `prior` is the prior with which the people were fitted.
pub fn pool(people: &[Person], prior: &OperatorPrior) -> Vec<Population> {
    let mut conditions: Vec<&str> = Vec::new();
    for person in people
        .iter()
        .filter(|p| p.covers_all_runs() && !p.parameters.is_empty())
    {
        if !conditions.contains(&person.condition.as_str()) {
            conditions.push(&person.condition);
        }
    }
    let of = |condition: &str| -> Vec<&Person> {
        let is = |p: &&Person| p.condition == condition && p.covers_all_runs() && !p.parameters.is_empty();
        people.iter().filter(is).collect()
    };
    conditions
        .into_iter()
        .map(|condition| population(condition, &of(condition), prior))
        .collect()
}

fn population(condition: &str, people: &[&Person], prior: &OperatorPrior) -> Population {
    let form = people.first().map(|p| p.form.clone());
    let form = form.filter(|form| people.iter().all(|p| p.form == *form));
    let mut found = Population {
        condition: condition.to_owned(),
        form: form.clone(),
        parameters: Vec::new(),
        left_out: Vec::new(),
    };
    for (name, unit) in PARAMETERS {
        if !people.iter().any(|p| p.parameter(name).is_some()) {
            continue;
        }
        if form.is_none() && !FORM_INDEPENDENT_NAMES.contains(&name) {
            let why = "the forms of the people differ; set form under [analysis] in group.toml".to_owned();
            found.left_out.push((name.to_owned(), why));
            continue;
        }
        let own: Vec<(&str, Option<Observation>)> = people
            .iter()
            .map(|p| {
                (
                    p.subject.as_str(),
                    p.parameter(name)
                        .and_then(|parameter| observation_without_prior(parameter, prior)),
                )
            })
            .collect();
        match pool_parameter((name, unit), &own) {
            Ok(parameter) => found.parameters.push(parameter),
            Err(error) => found.left_out.push((name.to_owned(), error.to_string())),
        }
    }
    found
}

/// Returns the logarithm of a parameter as determined by the person's own data, without the prior; `None` without
/// information.
fn observation_without_prior(parameter: &Parameter, prior: &OperatorPrior) -> Option<Observation> {
    let error = parameter.standard_error_person.or(parameter.standard_error)?;
    let counts = parameter.determined && parameter.value > 0.0 && parameter.value.is_finite() && error > 0.0;
    let has_prior = prior.entries().iter().any(|entry| entry.parameter == parameter.name);
    let share = if has_prior { parameter.prior_share } else { 0.0 };
    if !counts || share > UNINFORMATIVE_PRIOR_SHARE {
        return None;
    }
    let relative = error / parameter.value;
    Some(Observation {
        value: parameter.value.ln() - prior.pull(parameter).unwrap_or(0.0),
        variance: relative * relative / (1.0 - share),
    })
}

fn pool_parameter(
    (name, unit): (&str, &str),
    own: &[(&str, Option<Observation>)],
) -> Result<PooledParameter, CompareError> {
    let known: Vec<Observation> = own.iter().filter_map(|(_, o)| *o).collect();
    // With only two people, the variance between them is practically unknown.
    if known.len() < MIN_PEOPLE {
        return Err(CompareError::TooFew {
            found: known.len(),
            expected: MIN_PEOPLE,
        });
    }
    let mean = meta_mean(&known, Weights::default())?.coefficients[0];
    let (mu, of_mu) = (mean.value, mean.standard_error.powi(2));
    let tau = variance_between_people(&known)?;
    let person = |(subject, own): &(&str, Option<Observation>)| {
        let (y, v) = own.map_or((mu, f64::INFINITY), |o| (o.value, o.variance));
        let shrinkage = if v.is_finite() { v / (v + tau) } else { 1.0 };
        let variance = if v.is_finite() {
            (1.0 - shrinkage) * v + shrinkage * shrinkage * of_mu
        } else {
            tau + of_mu
        };
        let value = (shrinkage * mu + (1.0 - shrinkage) * y).exp();
        PooledPerson {
            subject: (*subject).to_owned(),
            own: own.map(|o| (o.value.exp(), o.value.exp() * o.variance.sqrt())),
            value,
            standard_error: value * variance.sqrt(),
            shrinkage,
        }
    };
    Ok(PooledParameter {
        name: name.to_owned(),
        unit: unit.to_owned(),
        centre: mu.exp(),
        spread: tau.sqrt(),
        spread_of_another: (tau + of_mu).sqrt(),
        people: own.iter().map(person).collect(),
    })
}

impl Population {
    /// Returns the JSON object that `--prior` reads; the standard error of each parameter is its standard deviation for
    /// a new person.
    pub fn json(&self) -> Value {
        let parameter = |p: &PooledParameter| {
            json!({
                "name": p.name,
                "value": p.centre,
                "standard_error": p.centre * p.spread_of_another,
                "unit": p.unit,
                "determined": true,
                "spread": p.spread,
                "people": p.people,
            })
        };
        json!({
            "hoid": env!("CARGO_PKG_VERSION"),
            "kind": "population",
            "condition": self.condition,
            "form": self.form,
            "parameters": self.parameters.iter().map(parameter).collect::<Vec<_>>(),
            "left_out": self.left_out,
        })
    }
}

/// Returns a table of the people of all populations, with one row for each person and parameter.
pub fn table(populations: &[Population]) -> OutputTable {
    let all = || {
        let of = |p: &'_ Population| {
            p.parameters
                .iter()
                .map(|q| (p.condition.clone(), q.clone()))
                .collect::<Vec<_>>()
        };
        populations.iter().flat_map(of).flat_map(|(condition, parameter)| {
            let people = parameter.people.clone();
            people
                .into_iter()
                .map(move |person| (condition.clone(), parameter.clone(), person))
        })
    };
    type Row = (String, PooledParameter, PooledPerson);
    let text = |name: &str, of: &dyn Fn(&Row) -> String| OutputColumn {
        name: name.to_owned(),
        values: ColumnValues::Text(all().map(|row| of(&row)).collect()),
    };
    let real = |name: &str, of: &dyn Fn(&Row) -> f64| OutputColumn {
        name: name.to_owned(),
        values: ColumnValues::Real(all().map(|row| of(&row)).collect()),
    };
    OutputTable {
        comments: Vec::new(),
        columns: vec![
            text("condition", &|(condition, _, _)| condition.clone()),
            text("subject", &|(_, _, person)| person.subject.clone()),
            text("parameter", &|(_, parameter, _)| parameter.name.clone()),
            real("own", &|(_, _, person)| person.own.map_or(f64::NAN, |own| own.0)),
            real("own_se", &|(_, _, person)| person.own.map_or(f64::NAN, |own| own.1)),
            real("value", &|(_, _, person)| person.value),
            real("standard_error", &|(_, _, person)| person.standard_error),
            real("shrinkage", &|(_, _, person)| person.shrinkage),
            real("population", &|(_, parameter, _)| parameter.centre),
            real("population_spread", &|(_, parameter, _)| parameter.spread),
        ],
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use rand_chacha::{ChaCha8Rng, rand_core::SeedableRng};
    use rand_distr::{Distribution, StandardNormal};

    use super::*;

    fn of(all: &[(f64, f64)]) -> PooledParameter {
        let own: Vec<(&str, Option<Observation>)> = all
            .iter()
            .map(|(value, variance)| {
                (
                    "P",
                    Some(Observation {
                        value: *value,
                        variance: *variance,
                    }),
                )
            })
            .collect();
        pool_parameter(("tau_e", "s"), &own).unwrap()
    }

    #[test]
    fn imprecise_estimates_are_shrunk_to_the_mean() {
        let found = of(&[(0.0, 0.01), (0.2, 0.01), (0.4, 0.01), (1.5, 1.0)]);
        let shrinkage: Vec<f64> = found.people.iter().map(|p| p.shrinkage).collect();
        assert!(shrinkage[3] > 0.9 && shrinkage[0] < 0.4, "{shrinkage:?}");
        let last = &found.people[3];
        assert!(last.value < 2.0 && last.own.unwrap().0 > 4.4);
        assert!(last.standard_error / last.value < 1.0 && found.spread_of_another > found.spread);
    }

    #[test]
    fn pooling_reduces_errors_and_intervals_have_nominal_coverage() {
        let (mut own, mut all, mut held, mut count) = (0.0, 0.0, 0, 0);
        let mut rng = ChaCha8Rng::seed_from_u64(7);
        let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
        for _ in 0..1000 {
            let truth: Vec<f64> = (0..8).map(|_| 0.2 * normal()).collect();
            let errors = [0.1, 0.1, 0.2, 0.2, 0.3, 0.3, 0.4, 0.4];
            let found: Vec<(f64, f64)> = truth
                .iter()
                .zip(errors)
                .map(|(t, e)| (t + e * normal(), e * e))
                .collect();
            let pooled = of(&found);
            for (i, p) in pooled.people.iter().enumerate() {
                own += (found[i].0 - truth[i]).powi(2);
                all += (p.value.ln() - truth[i]).powi(2);
                held += usize::from((p.value.ln() - truth[i]).abs() < 1.96 * p.standard_error / p.value);
                count += 1;
            }
        }
        let held = f64::from(held as u32) / f64::from(count);
        println!(
            "mean square of the error {:.2} of that of people alone; intervals {held:.3}",
            all / own
        );
        assert!(all < 0.5 * own, "{all} {own}");
        // The coverage is over 8000 intervals; the people of one experiment share the estimates of mu and tau.
        assert!((0.93..0.97).contains(&held), "{held}");
    }

    #[test]
    fn prior_is_removed_before_pooling() {
        let parameter = |value: f64, share: f64| Parameter {
            name: "tau_e".to_owned(),
            unit: "s",
            value,
            standard_error: Some(0.1 * value),
            standard_error_person: None,
            interval: None,
            prior_share: share,
            determined: true,
            averaged_over: Vec::new(),
        };
        let prior: OperatorPrior = "tau_e=0.2:0.3".parse().unwrap();
        // With a prior share of one half, the data are as far from the estimate as the prior, on the other side, and
        // have twice the variance.
        let half = observation_without_prior(&parameter(0.3, 0.5), &prior).unwrap();
        assert!((half.value - (0.3_f64.ln() + (0.3_f64 / 0.2).ln())).abs() < 1e-12);
        assert!((half.variance - 0.02).abs() < 1e-12);
        assert!(observation_without_prior(&parameter(0.3, 0.95), &prior).is_none());
        let without = observation_without_prior(&parameter(0.3, 0.5), &OperatorPrior::none()).unwrap();
        assert!((without.value - 0.3_f64.ln()).abs() < 1e-12 && (without.variance - 0.01).abs() < 1e-12);
    }

    #[test]
    fn population_can_be_used_as_a_prior() {
        let own: Vec<(&str, Option<Observation>)> = [("A", -1.6, 0.01), ("B", -1.4, 0.02), ("C", -1.5, 0.01)]
            .iter()
            .map(|(who, value, variance)| {
                (
                    *who,
                    Some(Observation {
                        value: *value,
                        variance: *variance,
                    }),
                )
            })
            .chain([("D", None)])
            .collect();
        let parameter = pool_parameter(("tau_e", "s"), &own).unwrap();
        let unmeasured = &parameter.people[3];
        assert!(
            unmeasured.shrinkage == 1.0
                && unmeasured.own.is_none()
                && (unmeasured.value - parameter.centre).abs() < 1e-12
        );
        let population = Population {
            condition: "fo".to_owned(),
            form: None,
            parameters: vec![parameter.clone()],
            left_out: Vec::new(),
        };
        let prior = hoid_analysis::parse_prior(&population.json().to_string()).unwrap();
        let entry = &prior.entries()[0];
        assert_eq!(entry.parameter, "tau_e");
        assert!((entry.centre - parameter.centre).abs() < 1e-12);
        assert!((entry.spread - parameter.spread_of_another).abs() < 1e-9);
    }
}
