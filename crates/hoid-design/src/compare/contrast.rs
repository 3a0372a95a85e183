//! Contrasts: for each person, a weighted sum of the estimates in their conditions.
//!
//! - A factor **within** people: the mean over the conditions of one level minus the mean over the conditions of the
//!   other, so that a second factor is averaged out. Each person gives one contrast, which is averaged over people. No
//!   assumption about the covariance of the conditions (sphericity) is needed, and in a balanced experiment a mixed
//!   model gives the same result.
//! - A factor **between** people: for each person the mean over their conditions, and then the difference between two
//!   groups of people.
//! - **Two factors within** people: each of the factors, and their interaction, which is how much the effect of the
//!   first differs between the levels of the second. **One within, one between**: the effect of the first, compared
//!   between the groups.

use std::collections::BTreeMap;

use super::{
    CompareError, GroupEstimates,
    factor::{CONDITION_FACTOR, Factor, Variation},
};

/// A level and its members.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct LevelMembers {
    pub name: String,
    pub members: Vec<String>,
}

/// A factor with known levels, and whether it varies within or between people.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct ResolvedFactor {
    pub name: String,
    pub variation: Variation,
    pub levels: Vec<LevelMembers>,
    /// True if the members are people, false if they are conditions.
    pub is_between_people: bool,
}

/// One comparison: weights of the conditions and, for a comparison between people, the two groups.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Contrast {
    pub factor: String,
    pub variation: Variation,
    pub from: String,
    pub to: String,
    /// For an interaction, the factor whose effect differs, and its two levels.
    pub effect: Option<[String; 3]>,
    /// For each person, the weights of their conditions and their group, 0 or 1.
    pub people: Vec<(String, BTreeMap<String, f64>, usize)>,
}

impl ResolvedFactor {
    pub fn of(factor: &Factor, wanted: Option<Variation>, group: &GroupEstimates) -> Result<Self, CompareError> {
        let bad = |reason: String| CompareError::Factor {
            name: factor.name.clone(),
            reason,
        };
        let (conditions, subjects) = (group.conditions(), group.subjects());
        let levels: Vec<LevelMembers> = if !factor.levels.is_empty() {
            let of = factor.levels.iter().map(|level| LevelMembers {
                name: level.name.clone(),
                members: level.members.clone(),
            });
            of.collect()
        } else if factor.name == CONDITION_FACTOR {
            let own = |name: &String| LevelMembers {
                name: name.clone(),
                members: vec![name.clone()],
            };
            conditions.iter().map(own).collect()
        } else {
            return Err(bad(format!(
                "its levels are not known; the group has the conditions {} and the people {}",
                conditions.join(", "),
                subjects.join(", ")
            )));
        };
        if levels.len() < 2 {
            return Err(bad(format!(
                "there is only one level, {}",
                levels.first().map_or("", |l| &l.name)
            )));
        }
        let all: Vec<&String> = levels.iter().flat_map(|level| &level.members).collect();
        let of_people =
            all.iter().all(|member| subjects.contains(member)) && !all.iter().all(|m| conditions.contains(m));
        let pool = if of_people { &subjects } else { &conditions };
        if let Some(other) = all.iter().find(|member| !pool.contains(member)) {
            return Err(bad(format!(
                "{other} is neither a condition nor a person of this group, which has the conditions {} and the \
                 people {}",
                conditions.join(", "),
                subjects.join(", ")
            )));
        }
        let mut resolved = Self {
            name: factor.name.clone(),
            variation: Variation::Between,
            levels,
            is_between_people: of_people,
        };
        let in_two = subjects
            .iter()
            .find(|subject| resolved.levels_of(subject, group).len() > 1);
        resolved.variation = match (wanted, in_two) {
            (Some(Variation::Between), Some(subject)) => {
                let both = resolved.levels_of(subject, group);
                return Err(bad(format!(
                    "{subject} appears at the levels {}: the factor varies within people",
                    both.join(" and ")
                )));
            }
            (Some(Variation::Within), None) => {
                return Err(bad(
                    "no person appears at two levels: the factor varies between people".to_owned()
                ));
            }
            (_, Some(_)) => Variation::Within,
            (_, None) => Variation::Between,
        };
        Ok(resolved)
    }

    /// Returns the names of the levels to which a person belongs.
    pub fn levels_of(&self, subject: &str, group: &GroupEstimates) -> Vec<&str> {
        let is_in = |level: &&LevelMembers| {
            if self.is_between_people {
                level.members.iter().any(|member| member == subject)
            } else {
                level
                    .members
                    .iter()
                    .any(|condition| group.cell(subject, condition).is_some())
            }
        };
        self.levels
            .iter()
            .filter(is_in)
            .map(|level| level.name.as_str())
            .collect()
    }

    fn pairs(&self) -> impl Iterator<Item = (&LevelMembers, &LevelMembers)> {
        let levels = &self.levels;
        (0..levels.len()).flat_map(move |a| (a + 1..levels.len()).map(move |b| (&levels[a], &levels[b])))
    }
}

/// Returns the conditions that are compared: those that are members of a level of every factor over conditions.
pub(super) fn conditions_of(factors: &[ResolvedFactor], group: &GroupEstimates) -> Vec<String> {
    let counts = |condition: &String| {
        let mut over = factors.iter().filter(|factor| !factor.is_between_people);
        over.all(|factor| factor.levels.iter().any(|level| level.members.contains(condition)))
    };
    group.conditions().into_iter().filter(counts).collect()
}

/// Returns all contrasts of these factors.
pub(super) fn contrasts(factors: &[ResolvedFactor], group: &GroupEstimates) -> Result<Vec<Contrast>, CompareError> {
    let conditions = conditions_of(factors, group);
    let between: Vec<&ResolvedFactor> = factors.iter().filter(|f| f.variation == Variation::Between).collect();
    if let [_, second, ..] = between[..] {
        return Err(CompareError::Factor {
            name: second.name.clone(),
            reason: "only one factor can vary between people: compare one factor at a time".to_owned(),
        });
    }
    let within: Vec<&ResolvedFactor> = factors.iter().filter(|f| f.variation == Variation::Within).collect();
    let mut all = Vec::new();
    let people_with = |weights: &BTreeMap<String, f64>| -> Vec<_> {
        let of = |subject: &String| weights.keys().any(|c| group.cell(subject, c).is_some());
        let subjects = group.subjects().into_iter().filter(of);
        subjects.map(|subject| (subject, weights.clone(), 0)).collect()
    };
    for factor in &within {
        for (a, b) in factor.pairs() {
            let weights = difference_weights(&conditions, a, b);
            all.push(Contrast {
                factor: factor.name.clone(),
                variation: Variation::Within,
                from: a.name.clone(),
                to: b.name.clone(),
                effect: None,
                people: people_with(&weights),
            });
        }
    }
    for (k, first) in within.iter().enumerate() {
        for second in &within[k + 1..] {
            for (a, b) in first.pairs() {
                for (c, d) in second.pairs() {
                    let inside = |level: &LevelMembers| -> Vec<String> {
                        conditions
                            .iter()
                            .filter(|name| level.members.contains(name))
                            .cloned()
                            .collect()
                    };
                    let mut weights = difference_weights(&inside(d), a, b);
                    for (condition, weight) in difference_weights(&inside(c), a, b) {
                        *weights.entry(condition).or_insert(0.0) -= weight;
                    }
                    all.push(Contrast {
                        factor: format!("{} × {}", first.name, second.name),
                        variation: Variation::Within,
                        from: c.name.clone(),
                        to: d.name.clone(),
                        effect: Some([first.name.clone(), a.name.clone(), b.name.clone()]),
                        people: people_with(&weights),
                    });
                }
            }
        }
    }
    for factor in between {
        for (a, b) in factor.pairs() {
            let side =
                |level: &LevelMembers, index: usize, weights: &dyn Fn(&str) -> BTreeMap<String, f64>| -> Vec<_> {
                    let is = |subject: &String| factor.levels_of(subject, group).contains(&level.name.as_str());
                    let subjects = group.subjects().into_iter().filter(is);
                    subjects
                        .map(|subject| (subject.clone(), weights(&subject), index))
                        .collect()
                };
            let mean = |level: &LevelMembers| {
                let of_level: Vec<String> = match factor.is_between_people {
                    true => conditions.clone(),
                    false => conditions
                        .iter()
                        .filter(|c| level.members.contains(c))
                        .cloned()
                        .collect(),
                };
                move |_: &str| {
                    of_level
                        .iter()
                        .map(|c| (c.clone(), 1.0 / of_level.len() as f64))
                        .collect()
                }
            };
            let contrast = |factor: String, effect, people| Contrast {
                factor,
                variation: Variation::Between,
                from: a.name.clone(),
                to: b.name.clone(),
                effect,
                people,
            };
            let people = [side(a, 0, &mean(a)), side(b, 1, &mean(b))].concat();
            all.push(contrast(factor.name.clone(), None, people));
            if !factor.is_between_people {
                continue;
            }
            for other in &within {
                for (c, d) in other.pairs() {
                    let weights = difference_weights(&conditions, c, d);
                    let of = |_: &str| weights.clone();
                    let people = [side(a, 0, &of), side(b, 1, &of)].concat();
                    let name = format!("{} × {}", other.name, factor.name);
                    let effect = Some([other.name.clone(), c.name.clone(), d.name.clone()]);
                    all.push(contrast(name, effect, people));
                }
            }
        }
    }
    Ok(all)
}

/// Returns the weight of each condition in the difference: the mean over the conditions of b minus the mean over the
/// conditions of a.
fn difference_weights(conditions: &[String], a: &LevelMembers, b: &LevelMembers) -> BTreeMap<String, f64> {
    let mut weights = BTreeMap::new();
    for (level, sign) in [(a, -1.0), (b, 1.0)] {
        let of: Vec<&String> = conditions.iter().filter(|c| level.members.contains(c)).collect();
        for condition in &of {
            weights.insert((*condition).clone(), sign / of.len() as f64);
        }
    }
    weights
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::{super::group_estimates::tests::group, *};

    fn of(people: &[(&str, &str)], factors: &[&str]) -> Result<Vec<Contrast>, CompareError> {
        let people: Vec<_> = people.iter().map(|(s, c)| (*s, *c, 1.0, 0.1)).collect();
        let group = group(&people);
        let resolved = factors.iter().map(|f| ResolvedFactor::of(&f.parse()?, None, &group));
        contrasts(&resolved.collect::<Result<Vec<_>, _>>()?, &group)
    }

    fn weights(contrast: &Contrast) -> Vec<(&str, f64)> {
        let (_, weights, _) = &contrast.people[0];
        weights.iter().map(|(c, w)| (c.as_str(), *w)).collect()
    }

    const TWO_BY_TWO: [(&str, &str); 8] = [
        ("P", "1r"),
        ("P", "1p"),
        ("P", "2r"),
        ("P", "2p"),
        ("Q", "1r"),
        ("Q", "1p"),
        ("Q", "2r"),
        ("Q", "2p"),
    ];

    #[test]
    fn contrasts_of_two_within_factors_and_their_interaction() {
        let all = of(&TWO_BY_TWO, &["plant:H1=1r,1p;H2=2r,2p", "axis:roll=1r,2r;pitch=1p,2p"]).unwrap();
        assert_eq!(all.len(), 3);
        assert_eq!(weights(&all[0]), [("1p", -0.5), ("1r", -0.5), ("2p", 0.5), ("2r", 0.5)]);
        assert_eq!((all[1].from.as_str(), all[1].to.as_str()), ("roll", "pitch"));
        assert_eq!(all[2].factor, "plant × axis");
        // (2p - 1p) - (2r - 1r)
        assert_eq!(weights(&all[2]), [("1p", -1.0), ("1r", 1.0), ("2p", 1.0), ("2r", -1.0)]);
    }

    #[test]
    fn contrasts_of_condition_pairs_and_groups() {
        let three = [("P", "a"), ("P", "b"), ("P", "c"), ("Q", "a"), ("Q", "b")];
        let all = of(&three, &["condition"]).unwrap();
        let pairs: Vec<(&str, &str, usize)> = all
            .iter()
            .map(|c| (c.from.as_str(), c.to.as_str(), c.people.len()))
            .collect();
        // Q has no condition c; this is reported later, when the estimates are looked up.
        assert_eq!(pairs, [("a", "b", 2), ("a", "c", 2), ("b", "c", 2)]);
        let all = of(&three[..4], &["who:one=P;two=Q"]).unwrap();
        assert_eq!((all.len(), all[0].variation), (1, Variation::Between));
        assert_eq!(all[0].people.iter().map(|p| p.2).collect::<Vec<_>>(), [0, 1]);
        // Each person is in only one condition.
        let all = of(&[("P", "a"), ("Q", "b"), ("R", "a")], &["condition"]).unwrap();
        assert_eq!((all[0].variation, all[0].people.len()), (Variation::Between, 3));
        assert_eq!(weights(&all[0]), [("a", 1.0)]);
        let all = of(&TWO_BY_TWO, &["plant:H1=1r,1p;H2=2r,2p", "who:one=P;two=Q"]).unwrap();
        assert_eq!(
            all.iter().map(|c| c.factor.as_str()).collect::<Vec<_>>(),
            ["plant", "who", "plant × who"]
        );
    }

    #[test]
    fn invalid_factors_are_refused() {
        let people = [("P", "a"), ("P", "b"), ("Q", "a"), ("Q", "b")];
        for (factors, word) in [
            (&["display"][..], "levels are not known"),
            (&["x:a;z"], "z is neither a condition"),
            (&["who:one=P;two=Q", "else:1=P;2=Q"], "compare one factor at a time"),
        ] {
            let error = of(&people, factors).unwrap_err().to_string();
            assert!(error.contains(word), "{error}");
        }
        assert!(
            of(&[("P", "a"), ("Q", "a")], &["condition"])
                .unwrap_err()
                .to_string()
                .contains("one level")
        );
        let group = group(&[("P", "a", 1.0, 0.1), ("P", "b", 1.0, 0.1)]);
        let factor = Factor::conditions();
        let error = ResolvedFactor::of(&factor, Some(Variation::Between), &group).unwrap_err();
        assert!(error.to_string().contains("P appears at the levels a and b"), "{error}");
    }
}
