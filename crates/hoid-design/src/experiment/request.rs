//! Request for the design of an experiment, and its execution.

use hoid_analysis::Setting;
use hoid_model::{
    ContinuousTransferFunction, Finding, Form, Verdict,
    family_scenario::{Display, Feedforward},
};

use super::{
    DEFAULT_BETWEEN_PEOPLE, DesignError, DesignOptions, DesignedLine, DifferenceRequest, EntryPoint, Expected,
    ExperimentDesign, Forcing, NamedExpected, OtherForcing, People, Remnant, RequestedQuantity, SpreadSource, Task,
    design_people::{ChosenPeople, GivenOptions, NamedState, exclusion_finding},
    expected, feedforward, has_absolute_error,
    information::LoopQuantities,
    period_count,
    spread::run_to_run_spread,
};

/// Request for the design of an experiment.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct DesignRequest {
    /// People for whom the experiment is designed.
    pub people: People,
    /// Name of the condition, for a group with several conditions.
    pub condition: Option<String>,
    /// Controlled element; if `None`, the element named by the source of the people.
    pub controlled_element: Option<ContinuousTransferFunction>,
    /// Form of the operators of the population; if `None`, the form that people typically adopt with the element.
    pub form: Option<Form>,
    /// Point at which the forcing function enters. If the display shows the target, a disturbance is added.
    pub enters: EntryPoint,
    /// Display of the task.
    pub display: Display,
    /// Remnant of the people.
    pub remnant: Remnant,
    /// Options of the forcing function.
    pub designing: DesignOptions,
    /// Standard deviation of one person from run to run, relative to the quantity. If `None`, it comes from the people
    /// of the design if they provide it; otherwise it is that of `designing`.
    pub run_to_run: Option<SpreadSource>,
    /// Number of runs; if `None`, the number needed for the accepted errors of the requested quantities.
    pub runs: Option<usize>,
    /// Forcing function with which the designed one is compared.
    pub against: Option<OtherForcing>,
    /// Difference between two conditions that the experiment should find.
    pub difference: Option<DifferenceRequest>,
}

impl DesignRequest {
    /// Designs the experiment.
    ///
    /// # Errors
    /// [`DesignError`] if the people cannot be read or the controlled element is not known, and as for
    /// [`DesignOptions::run`].
    pub fn run(&self) -> Result<ExperimentDesign, DesignError> {
        let spread = run_to_run_spread(self.run_to_run.as_ref(), &self.people, self.designing.run_to_run)?;
        let mut of_people = self.clone();
        of_people.designing.run_to_run = spread.value;
        of_people.with_run_to_run_from(spread.source)
    }

    /// Designs the experiment with the variation from run to run of `designing`, which comes from `source`.
    fn with_run_to_run_from(&self, source: String) -> Result<ExperimentDesign, DesignError> {
        let given = GivenOptions {
            controlled_element: self.controlled_element.as_ref(),
            form: self.form,
            condition: self.condition.as_deref(),
        };
        let ChosenPeople {
            typical,
            others,
            feedforward,
            mut findings,
        } = self.people.choose(&given)?;
        let feedforward = feedforward.as_ref();
        let task = self.task(&typical, feedforward)?;
        let designed = self.designing.run(&task, self.points())?;
        let runs = self.runs.unwrap_or(designed.periods);
        if runs == 0 {
            return Err(DesignError::OutOfRange {
                quantity: "number of runs",
                found: 0.0,
                expected: "one or more",
            });
        }
        let length_s = self.designing.period_s * runs as f64;
        let all_runs = self.expected(&task, &designed.forcing, runs)?;
        let all = LoopQuantities::of(&task)?;
        let lines = all.designed_lines(&designed.forcing, self.designing.period_s, runs)?;
        let [response, response_to_target] = all.responses(&designed.forcing, length_s)?;
        findings.extend(low_line_finding(&lines, task.feedforward.is_some()));
        findings.push(fixed_form_note(&task));
        let people = self.expected_for_people((&others, feedforward), &designed.forcing, runs, &mut findings);
        let against = self.against.as_ref();
        let against = against
            .map(|other| self.compare_forcing(other, &task, runs))
            .transpose()?;
        let difference = self.difference.as_ref();
        let difference = difference
            .map(|sought| sought.plan(&self.people, (&designed.expected, self.designing.run_to_run), self.runs))
            .transpose()?;
        Ok(ExperimentDesign {
            worst: worst_person(&people, &self.designing.requested_quantities).cloned(),
            settings: self.settings(&task),
            person: typical.name,
            enters: self.enters,
            task,
            length_s: self.designing.period_s,
            runs,
            runs_needed: designed.periods,
            run_to_run: self.designing.run_to_run,
            run_to_run_source: source,
            wanted: self.designing.requested_quantities.clone(),
            display: self.display,
            lines,
            response,
            response_to_target,
            crest_factor: designed.crest_factor,
            expected: all_runs,
            people,
            against,
            difference,
            verdict: Verdict::of(findings),
        })
    }

    /// Returns the points at which forcing functions enter.
    fn points(&self) -> &'static [EntryPoint] {
        match (self.enters, self.display) {
            (EntryPoint::Target, Display::Compensatory) => &[EntryPoint::Target],
            (EntryPoint::Target, _) => &[EntryPoint::Target, EntryPoint::Disturbance],
            (EntryPoint::Disturbance, _) => &[EntryPoint::Disturbance],
        }
    }

    /// Returns the task of a person, including, for a displayed target, the given or the typical response to it.
    fn task(&self, person: &NamedState, given: Option<&Feedforward>) -> Result<Task, DesignError> {
        let feedforward = match (self.points().len(), given) {
            (1, _) => None,
            (_, Some(given)) => Some(given.clone()),
            (_, None) => Some(feedforward::typical_target_response(&person.state, self.display)?),
        };
        Ok(Task {
            state: person.state.clone(),
            feedforward,
            remnant: self.remnant,
        })
    }

    /// Returns the expected errors for the other people. A person whose errors cannot be computed is reported in
    /// `findings`.
    fn expected_for_people(
        &self,
        (others, feedforward): (&[NamedState], Option<&Feedforward>),
        forcing: &Forcing,
        runs: usize,
        findings: &mut Vec<Finding>,
    ) -> Vec<NamedExpected> {
        let mut all = Vec::new();
        for person in others {
            let found = self.task(person, feedforward);
            match found.and_then(|task| self.expected(&task, forcing, runs)) {
                Ok(found) => all.push(NamedExpected {
                    name: person.name.clone(),
                    runs_needed: self.runs_needed(&found, runs),
                    expected: found,
                }),
                Err(error) => findings.push(exclusion_finding(&person.name, &error.to_string())),
            }
        }
        all
    }

    /// Returns the expected errors from a number of runs.
    fn expected(&self, task: &Task, forcing: &Forcing, runs: usize) -> Result<Expected, DesignError> {
        let found = expected(task, forcing, self.designing.period_s * runs as f64)?;
        Ok(found.with_run_to_run(self.designing.run_to_run, runs))
    }

    fn compare_forcing(&self, other: &OtherForcing, task: &Task, runs: usize) -> Result<NamedExpected, DesignError> {
        let forcing = other.forcing(self.points())?;
        let found = self.expected(task, &forcing, runs)?;
        Ok(NamedExpected {
            name: other.name(),
            runs_needed: self.runs_needed(&found, runs),
            expected: found,
        })
    }

    fn runs_needed(&self, all_runs: &Expected, runs: usize) -> usize {
        period_count(
            &all_runs.clone().scaled((runs as f64).sqrt()),
            &self.designing.requested_quantities,
        )
    }

    fn settings(&self, task: &Task) -> Vec<Setting> {
        let by_default = Self::default();
        let number = |name: &str, value: f64, default: f64| {
            Setting::new(name, value.to_string()).with_given(value.to_bits() != default.to_bits())
        };
        let limit = |name: &str, value: Option<f64>| {
            Setting::new(name, value.map_or("none".to_owned(), |v| v.to_string())).with_given(value.is_some())
        };
        let wanted: Vec<String> = self
            .designing
            .requested_quantities
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
            Setting::new("people", self.people.to_string()).with_given(self.people != by_default.people),
            Setting::new("controlled_element", task.state.controlled_element.to_string())
                .with_given(self.controlled_element.is_some()),
            Setting::new("form", task.state.operator.form().name()).with_given(self.form.is_some()),
            Setting::new("for", wanted).with_given(!d.requested_quantities.is_empty()),
            Setting::new("display", self.display.name()).with_given(self.display != by_default.display),
            Setting::new("enters", self.enters.name()).with_given(self.enters != by_default.enters),
            number("remnant_share", self.remnant.share, by_default.remnant.share),
            number(
                "remnant_time_constant",
                self.remnant.time_constant_s,
                by_default.remnant.time_constant_s,
            ),
            number("length", d.period_s, of.period_s),
            Setting::new("lines", d.lines.to_string()).with_given(d.lines != of.lines),
            Setting::new("spacing", d.spacing.to_string()).with_given(d.spacing != of.spacing),
            Setting::new("band", format!("{}..{}", d.band_rad_s.0, d.band_rad_s.1))
                .with_given(d.band_rad_s != of.band_rad_s),
            number("shelf", d.shelf, of.shelf),
            Setting::new("run_to_run", d.run_to_run.to_string()).with_given(self.run_to_run.is_some()),
            Setting::new("seed", d.seed.to_string()).with_given(d.seed != of.seed),
            limit("max_rms_e", d.max_rms[0]),
            limit("max_u", d.max_rms[1]),
        ];
        if let Some(of) = &self.difference {
            let default = DifferenceRequest::new(of.sought.clone());
            let between = of
                .between_people
                .clone()
                .unwrap_or(SpreadSource::Part(DEFAULT_BETWEEN_PEOPLE));
            let size = format!(
                "{}={}{}",
                of.sought.name,
                of.sought.size,
                if of.sought.relative { " (relative)" } else { "" }
            );
            all.extend([
                Setting::new("difference", size).with_given(true),
                number("power", of.power, default.power),
                number("alpha", of.alpha, default.alpha),
                Setting::new("between_people", between.to_string()).with_given(of.between_people.is_some()),
            ]);
        }
        all
    }
}

/// Returns the note on what the predicted errors assume.
fn fixed_form_note(task: &Task) -> Finding {
    Finding::note(
        "fixed-form",
        format!(
            "the errors are predicted for the form {}, as if it were known; identify weighs several forms, so its errors \
             include the differences between likely forms and can be larger; the phase margin is that of the continuous \
             loop, without the hold of a sampled error (half a sample)",
            task.state.operator.form()
        ),
    )
}

/// Returns a finding about lines at which the remnant in e is not small. A displayed target contains no remnant, so its
/// lines are not checked.
fn low_line_finding(lines: &[DesignedLine], is_seen: bool) -> Option<Finding> {
    let of_error = lines.iter().filter(|l| !(is_seen && l.enters == EntryPoint::Target));
    let weak = of_error.filter(|l| l.to_remnant < MIN_LINE_TO_REMNANT_RATIO);
    let weak: Vec<String> = weak.map(|l| format!("{:.2}", l.line.omega_rad_s)).collect();
    let message = format!(
        "in each run the power of the lines at {} rad/s is less than {MIN_LINE_TO_REMNANT_RATIO} times that of the \
         remnant in e: the estimates there are biased, and the predicted errors do not include the bias; use fewer \
         lines or longer runs",
        weak.join(", ")
    );
    (!weak.is_empty()).then(|| Finding::note("lines-drown", message))
}

/// Ratio of the power of a line to that of the remnant below which the estimate is biased towards `-1/P` by more than a
/// tenth.
const MIN_LINE_TO_REMNANT_RATIO: f64 = 10.0;

/// Returns the person with the largest errors relative to the accepted errors or, if no errors are given, relative to
/// the values of the parameters.
fn worst_person<'a>(people: &'a [NamedExpected], wanted: &[RequestedQuantity]) -> Option<&'a NamedExpected> {
    let of = |person: &NamedExpected| -> f64 {
        let e = &person.expected;
        if wanted.is_empty() {
            let parameters = e.parameters().map(|q| q.name);
            let relative = parameters
                .filter(|name| !has_absolute_error(name))
                .filter_map(|name| e.error(name));
            return relative.filter(|r| r.is_finite()).map(|r| r * r).sum();
        }
        let ratios = wanted.iter().filter_map(|w| Some(e.error(&w.name)? / w.error));
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
            designing: DesignOptions {
                requested_quantities: vec!["tau_e=3%".parse().unwrap(), "crossover=1%".parse().unwrap()],
                ..DesignOptions::default()
            },
            ..DesignRequest::default()
        }
    }

    #[test]
    fn design_round_trips_through_json() {
        let design = DesignRequest {
            against: Some(OtherForcing::Reference),
            difference: Some(DifferenceRequest::new("crossover=0.4".parse().unwrap())),
            ..request()
        }
        .run()
        .unwrap();
        assert_eq!(ExperimentDesign::from_json(&design.to_json()).unwrap(), design);
        assert!(ExperimentDesign::from_json("{\"kind\": \"comparison\"}").is_err());
        let given = |name: &str| design.settings.iter().find(|s| s.name == name).unwrap().is_given;
        assert!(given("for") && given("difference") && !given("people") && !given("power"));
    }

    #[test]
    fn worst_person_needs_the_most_runs() {
        let design = request().run().unwrap();
        let worst = design.worst.unwrap();
        assert!(design.people.iter().all(|p| p.runs_needed <= worst.runs_needed));
        assert!(design.runs == design.runs_needed && worst.runs_needed > design.runs);
        // With this number of runs, the errors do not exceed the accepted errors.
        let error = |name: &str| design.expected.error(name).unwrap();
        assert!(error("tau_e") <= 0.03 && error("crossover") <= 0.01);
    }

    /// The delay relative to the present target may be zero.
    #[test]
    fn accepted_error_of_the_target_delay_is_absolute() {
        let design = DesignRequest {
            display: Display::Pursuit,
            designing: DesignOptions {
                requested_quantities: vec!["tau_f=0.02".parse().unwrap()],
                ..DesignOptions::default()
            },
            ..request()
        }
        .run()
        .unwrap();
        let error = design.expected.error("tau_f").unwrap();
        let of_one_fewer = error * (design.runs as f64 / (design.runs as f64 - 1.0)).sqrt();
        assert!(error <= 0.02 && of_one_fewer > 0.02, "{error} in {} runs", design.runs);
    }

    #[test]
    fn displayed_target_is_combined_with_a_disturbance() {
        let pursuit = DesignRequest {
            display: Display::Pursuit,
            ..request()
        };
        let both = pursuit.run().unwrap();
        let of = |enters: EntryPoint| both.lines.iter().filter(move |l| l.enters == enters).count();
        assert_eq!((of(EntryPoint::Target), of(EntryPoint::Disturbance)), (10, 10));
        let multiple = |l: &DesignedLine| (l.line.omega_rad_s * both.length_s / std::f64::consts::TAU).round() as u32;
        let multiples: Vec<u32> = both.lines.iter().map(multiple).collect();
        for (k, m) in multiples.iter().enumerate() {
            let others = &multiples[k + 1..];
            assert!(others.iter().all(|n| n - m >= 3 && n % m != 0), "{multiples:?}");
        }
        for name in ["K_f", "tau_f", "tau_e"] {
            assert!(both.expected.estimate(name).unwrap().standard_error.unwrap() > 0.0);
        }
        assert_eq!(ExperimentDesign::from_json(&both.to_json()).unwrap(), both);
        // The written scenario contains the same person.
        let name = "scenario.toml";
        let hoid_io::AnyScenario::Family(read) = hoid_io::parse_any_scenario(&both.scenario(), name, name).unwrap()
        else {
            panic!("no scenario of the family");
        };
        let (found, seen) = (read.feedforward.unwrap(), both.task.feedforward.as_ref().unwrap());
        assert_eq!(found.operator.form(), seen.operator.form());
        for (a, b) in found.operator.coordinates().iter().zip(seen.operator.coordinates()) {
            assert!((a - b).abs() < 1e-12, "{found:?}");
        }
        assert_eq!(
            (
                read.target.function.sinusoids().len(),
                read.disturbance.function.sinusoids().len()
            ),
            (10, 10)
        );
        let design = DesignRequest {
            enters: EntryPoint::Disturbance,
            ..pursuit
        };
        let alone = design.run().unwrap();
        assert!(alone.lines.iter().all(|l| l.enters == EntryPoint::Disturbance) && alone.response_to_target.is_empty());
        assert!(
            alone
                .lab_config("scenario.toml")
                .unwrap()
                .contains("display = \"pursuit\"")
        );
        let odd = DesignOptions {
            period_s: 80.123,
            ..DesignOptions::default()
        };
        let odd = DesignRequest {
            designing: odd,
            ..request()
        };
        assert_eq!(odd.run().unwrap().lab_config("scenario.toml"), None);
    }
}
