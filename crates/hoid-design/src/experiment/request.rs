//! From the question to the designed experiment.

use hoid_analysis::Setting;
use hoid_model::{
    ContinuousTransferFunction, Finding, Form, Verdict, family_scenario::Display, forcing::ForcingFunction,
};

use super::{
    Against, DesignError, DesignedLine, Designing, DifferenceRequest, Enters, Expected, ExperimentDesign,
    NamedExpected, People, Remnant, Task, Wanted,
    chosen::{Chosen, Given, NamedState, left_out},
    expected,
    information::Loop,
    periods,
};

/// A question about an experiment.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct DesignRequest {
    /// The people.
    pub people: People,
    /// The condition of a group, if there are several.
    pub condition: Option<String>,
    /// The controlled element; that of the people if `None`.
    pub controlled_element: Option<ContinuousTransferFunction>,
    /// Form of the population; the one that people use with the element if `None`.
    pub form: Option<Form>,
    /// Point at which the forcing function enters.
    pub enters: Enters,
    /// Display of the task; of one that shows the target only the response to the error is designed for.
    pub display: Display,
    /// The remnant.
    pub remnant: Remnant,
    /// The forcing function.
    pub designing: Designing,
    /// Number of runs; the number that the requested quantities need if `None`.
    pub runs: Option<usize>,
    /// A forcing function to be judged next to the design.
    pub against: Option<Against>,
    /// A difference between two conditions to be found.
    pub difference: Option<DifferenceRequest>,
}

impl DesignRequest {
    /// Designs the experiment.
    ///
    /// # Errors
    /// [`DesignError`] for people who cannot be read, an unknown element, and as [`Designing::run`].
    pub fn run(&self) -> Result<ExperimentDesign, DesignError> {
        if self.display != Display::Compensatory && self.enters == Enters::Target {
            return Err(DesignError::SeenTarget { display: self.display });
        }
        let given = Given {
            controlled_element: self.controlled_element.as_ref(),
            form: self.form,
            condition: self.condition.as_deref(),
        };
        let Chosen {
            typical,
            others,
            mut findings,
        } = self.people.chosen(&given)?;
        let task = self.task(&typical);
        let designed = self.designing.run(&task)?;
        let runs = self.runs.unwrap_or(designed.periods);
        if runs == 0 {
            return Err(DesignError::OutOfRange {
                quantity: "number of runs",
                found: 0.0,
                expected: "one or more",
            });
        }
        let length_s = self.designing.period_s * runs as f64;
        let all_runs = expected(&task, &designed.forcing, length_s)?;
        let all = Loop::of(&task)?;
        let lines = all.designed_lines(designed.forcing.sinusoids(), self.designing.period_s, runs);
        let response = all.response(designed.forcing.sinusoids(), length_s)?;
        findings.extend(drowned(&lines));
        let people = self.people(&others, &designed.forcing, runs, &mut findings);
        let against = self.against.as_ref();
        let against = against.map(|other| self.compared(other, &task, runs)).transpose()?;
        let difference = self.difference.as_ref();
        let difference = difference
            .map(|sought| sought.plan(&task, &designed.expected, self.runs))
            .transpose()?;
        Ok(ExperimentDesign {
            worst: worst(&people, &self.designing.wanted).cloned(),
            settings: self.settings(&task),
            person: typical.name,
            task,
            length_s: self.designing.period_s,
            runs,
            runs_needed: designed.periods,
            wanted: self.designing.wanted.clone(),
            display: self.display,
            lines,
            response,
            crest_factor: designed.crest_factor,
            expected: all_runs,
            people,
            against,
            difference,
            verdict: Verdict::of(findings),
        })
    }

    fn task(&self, person: &NamedState) -> Task {
        Task {
            state: person.state.clone(),
            enters: self.enters,
            remnant: self.remnant,
        }
    }

    /// The errors of the other people; those without a loop are reported.
    fn people(
        &self,
        others: &[NamedState],
        forcing: &ForcingFunction,
        runs: usize,
        findings: &mut Vec<Finding>,
    ) -> Vec<NamedExpected> {
        let mut all = Vec::new();
        for person in others {
            match expected(&self.task(person), forcing, self.designing.period_s * runs as f64) {
                Ok(found) => all.push(NamedExpected {
                    name: person.name.clone(),
                    runs_needed: self.runs_needed(&found, runs),
                    expected: found,
                }),
                Err(error) => findings.push(left_out(&person.name, &error.to_string())),
            }
        }
        all
    }

    fn compared(&self, other: &Against, task: &Task, runs: usize) -> Result<NamedExpected, DesignError> {
        let forcing = other.forcing(self.enters)?;
        let found = expected(task, &forcing, self.designing.period_s * runs as f64)?;
        Ok(NamedExpected {
            name: other.name(),
            runs_needed: self.runs_needed(&found, runs),
            expected: found,
        })
    }

    fn runs_needed(&self, all_runs: &Expected, runs: usize) -> usize {
        periods(&all_runs.scaled((runs as f64).sqrt()), &self.designing.wanted)
    }

    fn settings(&self, task: &Task) -> Vec<Setting> {
        let by_default = Self::default();
        let number = |name: &str, value: f64, default: f64| {
            Setting::new(name, value.to_string()).given(value.to_bits() != default.to_bits())
        };
        let limit = |name: &str, value: Option<f64>| {
            Setting::new(name, value.map_or("none".to_owned(), |v| v.to_string())).given(value.is_some())
        };
        let wanted: Vec<String> = self
            .designing
            .wanted
            .iter()
            .map(|w| format!("{}={}", w.name, w.error))
            .collect();
        let wanted = if wanted.is_empty() {
            "all parameters".to_owned()
        } else {
            wanted.join(",")
        };
        let (d, of) = (&self.designing, &by_default.designing);
        let mut all = vec![
            Setting::new("people", self.people.to_string()).given(self.people != by_default.people),
            Setting::new("controlled_element", task.state.controlled_element.to_string())
                .given(self.controlled_element.is_some()),
            Setting::new("form", task.state.operator.form().name()).given(self.form.is_some()),
            Setting::new("for", wanted).given(!d.wanted.is_empty()),
            Setting::new("display", self.display.name()).given(self.display != by_default.display),
            Setting::new("enters", self.enters.name()).given(self.enters != by_default.enters),
            number("remnant_share", self.remnant.share, by_default.remnant.share),
            number(
                "remnant_time_constant",
                self.remnant.time_constant_s,
                by_default.remnant.time_constant_s,
            ),
            number("length", d.period_s, of.period_s),
            Setting::new("lines", d.lines.to_string()).given(d.lines != of.lines),
            Setting::new("band", format!("{}..{}", d.band_rad_s.0, d.band_rad_s.1))
                .given(d.band_rad_s != of.band_rad_s),
            number("shelf", d.shelf, of.shelf),
            Setting::new("seed", d.seed.to_string()).given(d.seed != of.seed),
            limit("max_rms_e", d.most_rms[0]),
            limit("max_u", d.most_rms[1]),
        ];
        if let Some(of) = &self.difference {
            let default = DifferenceRequest::new(of.sought.clone());
            let size = format!(
                "{}={}{}",
                of.sought.name,
                of.sought.size,
                if of.sought.relative { " of it" } else { "" }
            );
            all.extend([
                Setting::new("difference", size).given(true),
                number("power", of.power, default.power),
                number("alpha", of.alpha, default.alpha),
                number("between_people", of.between_people, default.between_people),
                number("run_to_run", of.run_to_run, default.run_to_run),
            ]);
        }
        all
    }
}

/// The finding of lines at which the remnant in e is not small.
fn drowned(lines: &[DesignedLine]) -> Option<Finding> {
    let weak = lines.iter().filter(|l| l.to_remnant < LEAST_TO_REMNANT);
    let weak: Vec<String> = weak.map(|l| format!("{:.2}", l.line.omega_rad_s)).collect();
    let message = format!(
        "in one run the lines at {} rad/s are less than {LEAST_TO_REMNANT} times the remnant in e: what is predicted there is too small; fewer lines or longer runs help",
        weak.join(", ")
    );
    (!weak.is_empty()).then(|| Finding::note("lines-drown", message))
}

/// Ratio of powers below which the estimate at a line is drawn to `-1/P`: by a tenth.
const LEAST_TO_REMNANT: f64 = 10.0;

/// The person with the greatest errors, relative to the accepted ones; without these, relative to the parameters.
fn worst<'a>(people: &'a [NamedExpected], wanted: &[Wanted]) -> Option<&'a NamedExpected> {
    let of = |person: &NamedExpected| -> f64 {
        let e = &person.expected;
        if wanted.is_empty() {
            let relative = e.parameters.iter().filter_map(|p| e.relative_error(p.name));
            return relative.filter(|r| r.is_finite()).map(|r| r * r).sum();
        }
        let ratios = wanted.iter().filter_map(|w| Some(e.relative_error(&w.name)? / w.error));
        ratios.fold(0.0, f64::max)
    };
    people.iter().max_by(|a, b| of(a).total_cmp(&of(b)))
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    fn request() -> DesignRequest {
        DesignRequest {
            controlled_element: Some("4/s".parse().unwrap()),
            designing: Designing {
                wanted: vec!["tau_e=3%".parse().unwrap(), "crossover=1%".parse().unwrap()],
                ..Designing::default()
            },
            ..DesignRequest::default()
        }
    }

    #[test]
    fn a_design_comes_back_from_its_json() {
        let design = DesignRequest {
            against: Some(Against::Reference),
            difference: Some(DifferenceRequest::new("crossover=0.4".parse().unwrap())),
            ..request()
        }
        .run()
        .unwrap();
        assert_eq!(ExperimentDesign::from_json(&design.to_json()).unwrap(), design);
        assert!(ExperimentDesign::from_json("{\"kind\": \"comparison\"}").is_err());
        let given = |name: &str| design.settings.iter().find(|s| s.name == name).unwrap().given;
        assert!(given("for") && given("difference") && !given("people") && !given("power"));
    }

    #[test]
    fn the_worst_person_needs_most_runs() {
        let design = request().run().unwrap();
        let worst = design.worst.unwrap();
        assert!(design.people.iter().all(|p| p.runs_needed <= worst.runs_needed));
        assert!(design.runs == design.runs_needed && worst.runs_needed > design.runs);
        // With the accepted errors in so many runs.
        let error = |name: &str| design.expected.relative_error(name).unwrap();
        assert!(error("tau_e") <= 0.03 && error("crossover") <= 0.01);
    }

    #[test]
    fn a_seen_target_is_refused_and_a_disturbance_is_not() {
        let pursuit = DesignRequest {
            display: Display::Pursuit,
            ..request()
        };
        assert!(matches!(pursuit.run(), Err(DesignError::SeenTarget { .. })));
        let design = DesignRequest {
            enters: Enters::Disturbance,
            ..pursuit
        };
        let lab = design.run().unwrap().lab("scenario.toml").unwrap();
        assert!(lab.contains("display = \"pursuit\""));
        let odd = Designing {
            period_s: 80.123,
            ..Designing::default()
        };
        let odd = DesignRequest {
            designing: odd,
            ..request()
        };
        assert_eq!(odd.run().unwrap().lab("scenario.toml"), None);
    }
}
