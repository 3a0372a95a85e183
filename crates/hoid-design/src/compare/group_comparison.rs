//! Comparison of the people and conditions of a group.

use hoid_analysis::Setting;
use hoid_model::{Finding, Verdict, named_choice};

use super::{
    Coefficient, CompareError, Comparison, Difference, GroupEstimates, Learning, Mean, MetaRegression, MissingEstimate,
    Observation, PersonEstimate, Quantity, Variation, Weights,
    adjust::holm,
    bayes_factor,
    contrast::{Contrast, ResolvedFactor, conditions_of, contrasts},
    d_z,
    factor::Factor,
    group_estimates::{EstimatedValue, forms, forms_text},
    hedges_g,
    learning::RunNumbering,
    meta_mean, meta_regression,
    sentence::sentence,
};

/// Adjustment of the p-values of several tests.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Adjustment {
    /// Holm's adjustment, over all differences of the comparison.
    #[default]
    Holm,
    /// No adjustment.
    None,
}

named_choice!(Adjustment, "adjustment", 2, {
    Holm => "holm",
    None => "none",
});

/// A covariate that differs between runs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Covariate {
    /// The number of the run.
    Run,
}

named_choice!(Covariate, "covariate", 1, {
    Run => "run",
});

/// Options of a comparison of people and conditions.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ComparisonOptions {
    /// Factors to compare; if empty, the conditions are the levels of one factor.
    pub factors: Vec<Factor>,
    /// Whether the factor varies within or between people; determined from the group if `None`.
    pub variation: Option<Variation>,
    /// Quantities to compare; if empty, [`Quantity::defaults`].
    pub quantities: Vec<Quantity>,
    /// Covariate whose effect is removed from the estimates.
    pub covariate: Option<Covariate>,
    /// Adjustment of the p-values of several tests.
    pub adjustment: Adjustment,
    /// Weights of the people.
    pub weights: Weights,
}

/// Share of the prior in an estimate above which a finding is reported.
const MAX_PRIOR_SHARE: f64 = 0.5;

impl ComparisonOptions {
    /// Computes the comparison.
    ///
    /// # Errors
    /// [`CompareError::Factor`] if a factor is invalid, and [`CompareError::NotInJson`] if the JSON of a group lacks a
    /// quantity. A quantity that cannot be estimated for a person is reported in the result.
    pub fn run(&self, group: &GroupEstimates) -> Result<Comparison, CompareError> {
        let asked = match self.factors.is_empty() {
            true => vec![Factor::conditions()],
            false => self.factors.clone(),
        };
        let resolve = |factor: &Factor| ResolvedFactor::of(factor, self.variation.filter(|_| asked.len() == 1), group);
        let factors: Vec<ResolvedFactor> = asked.iter().map(resolve).collect::<Result<_, _>>()?;
        let contrasts = contrasts(&factors, group)?;
        let quantities = match self.quantities.is_empty() {
            true => Quantity::defaults(),
            false => self.quantities.clone(),
        };
        if !group.has_runs() {
            let from_runs = |q: &&Quantity| {
                matches!(
                    q,
                    Quantity::Gain(_) | Quantity::Phase(_) | Quantity::RmsE | Quantity::RmsU
                )
            };
            let what = self.covariate.map(|_| "the value of each run".to_owned());
            if let Some(what) = what.or(quantities.iter().find(from_runs).map(Quantity::sentence_name)) {
                return Err(CompareError::NotInJson { quantity: what });
            }
        }
        let mut at_work = ComparisonWork {
            group,
            factors: &factors,
            covariate: self.covariate,
            weights: self.weights,
            findings: Vec::new(),
            not_compared: Vec::new(),
            result: Comparison {
                group: group.name.clone(),
                estimates: Vec::new(),
                means: Vec::new(),
                differences: Vec::new(),
                learning: Vec::new(),
                left_out: Vec::new(),
                settings: self.settings(&factors, &quantities),
                verdict: Verdict::of(Vec::new()),
            },
        };
        for quantity in &quantities {
            at_work.compare(quantity, &contrasts);
        }
        let ComparisonWork {
            mut result,
            mut findings,
            not_compared: apart,
            ..
        } = at_work;
        let not_compared = |(why, names): (String, Vec<String>)| {
            let are = if names.len() == 1 { "is" } else { "are" };
            Finding::warning(
                "forms-differ",
                format!("{} {are} not compared: {why}", names.join(", ")),
            )
        };
        findings.extend(apart.into_iter().map(not_compared));
        let p: Vec<f64> = result.differences.iter().map(|d| d.estimate.p).collect();
        let adjusted = match self.adjustment {
            Adjustment::Holm => holm(&p),
            Adjustment::None => p,
        };
        for (difference, p) in result.differences.iter_mut().zip(adjusted) {
            difference.p_adjusted = p;
            difference.sentence = sentence(difference, self.adjustment == Adjustment::Holm);
        }
        if result.differences.is_empty() {
            findings.push(Finding::undetermined(
                "nothing-compared",
                "no difference can be estimated: too few people have an estimate at every level of the factor",
            ));
        }
        let parameters = quantities.iter().any(|quantity| !quantity.is_form_independent());
        findings.extend(group.common.clone().filter(|_| parameters));
        findings.extend(missing_estimate_findings(&result));
        findings.extend(doubtful_people_finding(group, &result));
        result.verdict = Verdict::of(findings);
        Ok(result)
    }

    fn settings(&self, factors: &[ResolvedFactor], quantities: &[Quantity]) -> Vec<Setting> {
        let joined = |all: Vec<String>| all.join("; ");
        let level = |l: &super::contrast::LevelMembers| match l.members.as_slice() {
            [one] if *one == l.name => l.name.clone(),
            all => format!("{} ({})", l.name, all.join(", ")),
        };
        let factor = |f: &ResolvedFactor| {
            let levels: Vec<String> = f.levels.iter().map(level).collect();
            format!("{}, {} people: {}", f.name, f.variation.name(), levels.join(", "))
        };
        let names: Vec<String> = quantities.iter().map(Quantity::to_string).collect();
        vec![
            Setting::new("factor", joined(factors.iter().map(factor).collect())).with_given(!self.factors.is_empty()),
            Setting::new("of", names.join(", ")).with_given(!self.quantities.is_empty()),
            Setting::new("covariate", self.covariate.map_or("none", Covariate::name))
                .with_given(self.covariate.is_some()),
            Setting::new("adjust", self.adjustment.name()).with_given(self.adjustment != Adjustment::default()),
            Setting::new("weights", self.weights.name()).with_given(self.weights != Weights::default()),
        ]
    }
}

/// Intermediate results of a comparison.
struct ComparisonWork<'a> {
    group: &'a GroupEstimates,
    factors: &'a [ResolvedFactor],
    covariate: Option<Covariate>,
    weights: Weights,
    findings: Vec<Finding>,
    /// Parameters that are not compared because the people have different forms, with the reason.
    not_compared: Vec<(String, Vec<String>)>,
    result: Comparison,
}

/// Subject and condition, with the estimate and its change per run, or the reason why there is no estimate.
type CellEstimate = (String, String, Result<(EstimatedValue, Option<Coefficient>), String>);

impl ComparisonWork<'_> {
    fn compare(&mut self, quantity: &Quantity, contrasts: &[Contrast]) {
        let cells = self.cells(quantity);
        if !self.is_comparable(quantity, &cells) {
            return;
        }
        self.store_estimates(quantity, &cells);
        for contrast in contrasts {
            self.add_difference(quantity, contrast, &cells);
        }
    }

    /// Returns the estimates of all people and conditions that are compared.
    fn cells(&self, quantity: &Quantity) -> Vec<CellEstimate> {
        let conditions = conditions_of(self.factors, self.group);
        let practice = self
            .covariate
            .map(|Covariate::Run| RunNumbering::of(self.group, quantity));
        let is_in = |subject: &str| {
            let mut between = self.factors.iter().filter(|f| f.is_between_people);
            between.all(|factor| !factor.levels_of(subject, self.group).is_empty())
        };
        let cells = self.group.cells.iter();
        let cells = cells.filter(|cell| conditions.contains(&cell.condition) && is_in(&cell.subject));
        cells
            .map(|cell| {
                let found = self.group.estimate(cell, quantity).and_then(|known| match &practice {
                    None => Ok((known, None)),
                    Some(practice) => {
                        let [at_middle, slope] = practice.quantity_of_cell(self.group, cell, quantity)?;
                        let known = EstimatedValue {
                            value: at_middle.value,
                            standard_error: Some(at_middle.standard_error),
                            ..known
                        };
                        Ok((known, Some(slope)))
                    }
                });
                (cell.subject.clone(), cell.condition.clone(), found)
            })
            .collect()
    }

    /// Returns true if the quantity can be compared; a parameter can be compared only within one form.
    fn is_comparable(&mut self, quantity: &Quantity, cells: &[CellEstimate]) -> bool {
        let input = match quantity {
            Quantity::Parameter(_) => None,
            Quantity::OfInput { input, .. } => Some(input.as_str()),
            _ => return true,
        };
        let compared = cells.iter();
        let compared = compared.filter_map(|(subject, condition, _)| self.group.cell(subject, condition));
        let forms = forms(compared, input);
        if forms.len() < 2 {
            return true;
        }
        let all = forms_text(&forms);
        if input.is_none() && quantity.is_form_independent() {
            self.findings.push(Finding::note(
                "forms-differ",
                format!(
                    "{} comes from fits of different forms ({all})",
                    quantity.sentence_name()
                ),
            ));
            return true;
        }
        let most = || forms.iter().max_by_key(|(_, names)| names.len()).map_or("", |f| f.0);
        let remedy = match input {
            None => {
                let form = self.group.common_form().map_or_else(most, |common| common.form.name());
                format!(
                    "compare the manifest of the recordings instead of the results, or write form = \"{form}\" under \
                     [analysis] in group.toml and run the group again"
                )
            }
            Some(input) => format!(
                "add the form to the role of {input} in group.toml, such as feedforward/{}, and run the group again",
                most()
            ),
        };
        let why = format!("a parameter has the same meaning only within one form ({all}); {remedy}");
        match self.not_compared.iter_mut().find(|(known, _)| *known == why) {
            Some((_, names)) => names.push(quantity.to_string()),
            None => self.not_compared.push((why, vec![quantity.to_string()])),
        }
        false
    }

    /// Stores the estimates, their means by condition, and the changes from run to run.
    fn store_estimates(&mut self, quantity: &Quantity, cells: &[CellEstimate]) {
        let group_of = |subject: &str| {
            let between = self.factors.iter().find(|f| f.is_between_people);
            let level =
                between.and_then(|factor| factor.levels_of(subject, self.group).first().map(|l| (*l).to_owned()));
            level.unwrap_or_default()
        };
        let mut prior = Vec::new();
        for (subject, condition, found) in cells {
            match found {
                Ok((known, _)) => {
                    if known.prior_share > MAX_PRIOR_SHARE {
                        prior.push(format!("{subject} in {condition} {:.0} %", 100.0 * known.prior_share));
                    }
                    self.result.estimates.push(PersonEstimate {
                        quantity: quantity.clone(),
                        subject: subject.clone(),
                        condition: condition.clone(),
                        group: group_of(subject),
                        value: known.value,
                        standard_error: known.standard_error,
                        runs: known.runs,
                    });
                }
                Err(reason) => self.result.left_out.push(MissingEstimate {
                    quantity: quantity.clone(),
                    subject: subject.clone(),
                    condition: condition.clone(),
                    reason: reason.clone(),
                }),
            }
        }
        if !prior.is_empty() {
            self.findings.push(Finding::warning(
                "prior-weighs",
                format!(
                    "{quantity} is determined mostly by the prior ({}), which is the same for all people and shrinks the differences between them towards zero; to omit the prior, write prior = \"none\" under [analysis] in group.toml",
                    prior.join(", ")
                ),
            ));
        }
        let own = self.result.estimates.iter().filter(|e| e.quantity == *quantity);
        let mut places: Vec<(String, String, Vec<EstimatedValue>)> = Vec::new();
        for e in own {
            let known = estimated_value_of(e);
            match places.iter_mut().find(|(c, g, _)| (c, g) == (&e.condition, &e.group)) {
                Some((_, _, of)) => of.push(known),
                None => places.push((e.condition.clone(), e.group.clone(), vec![known])),
            }
        }
        for (condition, group, of) in places {
            if let Ok(found) = meta_mean(&observations(&of), self.weights) {
                self.result.means.push(Mean {
                    quantity: quantity.clone(),
                    condition,
                    group,
                    people: of.len(),
                    tau: found.tau_squared.sqrt(),
                    estimate: found.coefficients[0],
                });
            }
        }
        self.add_learning(quantity, cells);
    }

    fn add_learning(&mut self, quantity: &Quantity, cells: &[CellEstimate]) {
        let slopes = |condition: Option<&String>| -> Vec<EstimatedValue> {
            let of = cells
                .iter()
                .filter(|(_, c, _)| condition.is_none_or(|condition| condition == c));
            let slope = |c: &Coefficient| EstimatedValue {
                value: c.value,
                standard_error: Some(c.standard_error),
                determined: true,
                prior_share: 0.0,
                runs: 0,
            };
            of.filter_map(|(_, _, found)| found.as_ref().ok()?.1.as_ref().map(slope))
                .collect()
        };
        for condition in conditions_of(self.factors, self.group) {
            let of = slopes(Some(&condition));
            if let Ok(found) = meta_mean(&observations(&of), self.weights) {
                self.result.learning.push(Learning {
                    quantity: quantity.clone(),
                    condition,
                    people: of.len(),
                    estimate: found.coefficients[0],
                });
            }
        }
    }

    /// Computes one difference, from the people who have estimates in all of its conditions.
    fn add_difference(&mut self, quantity: &Quantity, contrast: &Contrast, cells: &[CellEstimate]) {
        let mut people: Vec<(String, usize)> = Vec::new();
        let mut of: Vec<EstimatedValue> = Vec::new();
        for (subject, weights, group) in &contrast.people {
            let mut sum = estimated_value(0.0, Some(0.0));
            let mut whole = true;
            for (condition, weight) in weights {
                let cell = cells.iter().find(|(s, c, _)| s == subject && c == condition);
                match cell {
                    Some((_, _, Ok((known, _)))) => {
                        sum.value += weight * known.value;
                        let both = sum.standard_error.zip(known.standard_error);
                        sum.standard_error = both.map(|(a, b)| a.hypot(weight * b));
                    }
                    Some(_) => whole = false,
                    None => {
                        whole = false;
                        let out = MissingEstimate {
                            quantity: quantity.clone(),
                            subject: subject.clone(),
                            condition: condition.clone(),
                            reason: "there is no run".to_owned(),
                        };
                        if !self.result.left_out.contains(&out) {
                            self.result.left_out.push(out);
                        }
                    }
                }
            }
            if whole {
                people.push((subject.clone(), *group));
                of.push(sum);
            }
        }
        let name = format!(
            "{} of {}, {} - {}",
            quantity.sentence_name(),
            contrast.factor,
            contrast.to,
            contrast.from
        );
        let weighted = observations(&of);
        let flat: Vec<Observation> = weighted.iter().map(|o| Observation { variance: 0.0, ..*o }).collect();
        let fit = |all: &[Observation]| fit_contrast(contrast, &people, all, self.weights);
        let found = fit(&weighted).and_then(|found| Ok((found, fit(&flat)?)));
        let (found, unweighted) = match found {
            Ok(both) => both,
            Err(error) => {
                self.findings
                    .push(Finding::warning("no-difference", format!("{name}: {error}")));
                return;
            }
        };
        if weighted.iter().all(|o| o.variance == 0.0) {
            self.findings.push(Finding::note(
                "no-errors",
                format!("{name}: some people have no standard error, so all people have the same weight"),
            ));
        }
        if found.degrees_of_freedom < 2 {
            self.findings.push(Finding::warning(
                "few-people",
                format!(
                    "{name}: {} people leave only one degree of freedom, so the interval carries little information; record more people",
                    people.len()
                ),
            ));
        }
        let values = |of_group: Option<usize>| -> Vec<f64> {
            let both = people.iter().zip(&of);
            let is = |group: usize| of_group.is_none_or(|wanted| wanted == group);
            both.filter(|((_, group), _)| is(*group))
                .map(|(_, k)| k.value)
                .collect()
        };
        let (last, plain) = (found.coefficients.len() - 1, unweighted.coefficients.len() - 1);
        self.result.differences.push(Difference {
            quantity: quantity.clone(),
            factor: contrast.factor.clone(),
            variation: contrast.variation,
            from: contrast.from.clone(),
            to: contrast.to.clone(),
            effect: contrast.effect.clone(),
            estimate: found.coefficients[last],
            degrees_of_freedom: found.degrees_of_freedom,
            p_adjusted: found.coefficients[last].p,
            effect_size: match contrast.variation {
                Variation::Within => d_z(&values(None)),
                Variation::Between => hedges_g(&values(Some(0)), &values(Some(1))),
            },
            bayes_factor: bayes_factor(
                unweighted.coefficients[plain].t,
                values(Some(0)).len(),
                values(Some(1)).len(),
            ),
            tau: found.tau_squared.sqrt(),
            i_squared: found.i_squared,
            heterogeneity: found.heterogeneity,
            unweighted: unweighted.coefficients[plain],
            sentence: String::new(),
            people,
        });
    }
}

/// Computes the mean over people, or the difference between two groups of people.
fn fit_contrast(
    contrast: &Contrast,
    people: &[(String, usize)],
    all: &[Observation],
    weights: Weights,
) -> Result<MetaRegression, CompareError> {
    match contrast.variation {
        Variation::Within => meta_mean(all, weights),
        Variation::Between => {
            let x: Vec<Vec<f64>> = people.iter().map(|(_, group)| vec![1.0, *group as f64]).collect();
            meta_regression(all, &x, weights)
        }
    }
}

/// Converts estimates to observations with squared standard errors; if any standard error is missing, all observations
/// have the same weight.
fn observations(all: &[EstimatedValue]) -> Vec<Observation> {
    let known = all
        .iter()
        .all(|k| k.standard_error.is_some_and(|e| e > 0.0 && e.is_finite()));
    let one = |k: &EstimatedValue| Observation {
        value: k.value,
        variance: k.standard_error.filter(|_| known).map_or(0.0, |e| e * e),
    };
    all.iter().map(one).collect()
}

fn estimated_value(value: f64, standard_error: Option<f64>) -> EstimatedValue {
    EstimatedValue {
        value,
        standard_error,
        determined: true,
        prior_share: 0.0,
        runs: 0,
    }
}

fn estimated_value_of(e: &PersonEstimate) -> EstimatedValue {
    estimated_value(e.value, e.standard_error)
}

/// Returns one finding for each person, condition and reason for which estimates are missing, with the quantities
/// concerned.
fn missing_estimate_findings(result: &Comparison) -> Vec<Finding> {
    let mut all: Vec<(String, Vec<String>)> = Vec::new();
    for out in &result.left_out {
        let name = format!("{} in {} is left out: {}", out.subject, out.condition, out.reason);
        match all.iter_mut().find(|(known, _)| *known == name) {
            Some((_, of)) => of.push(out.quantity.to_string()),
            None => all.push((name, vec![out.quantity.to_string()])),
        }
    }
    let one = |(name, of): (String, Vec<String>)| Finding::warning("left-out", format!("{name} ({})", of.join(", ")));
    all.into_iter().map(one).collect()
}

/// Returns a finding about people who are included although the verdict on their own fit is doubtful.
fn doubtful_people_finding(group: &GroupEstimates, result: &Comparison) -> Option<Finding> {
    let counts = |subject: &str, condition: &str| {
        let mut all = result.estimates.iter();
        all.any(|e| e.subject == subject && e.condition == condition)
    };
    let cells = group
        .cells
        .iter()
        .filter(|cell| cell.doubtful && counts(&cell.subject, &cell.condition));
    let names: Vec<String> = cells
        .map(|cell| format!("{} in {}", cell.subject, cell.condition))
        .collect();
    (!names.is_empty()).then(|| {
        Finding::note(
            "person-doubtful",
            format!(
                "the fit of {} is doubtful but is included in the comparison",
                names.join(", ")
            ),
        )
    })
}
