//! The operator of a person in a condition, from the joint fit of the family ([`hoid_ident::family`]) to all their
//! runs, and its row in the table `people`.
//!
//! A row contains the form; for each parameter its value, its standard errors for these runs (`_se`) and for the person
//! (`_se_person`), its 95 % interval (`_low`, `_high`), whether the data determine it (`_determined`), and the share of
//! the prior (`_prior_share`); crossover and phase margin with the controlled element, with errors and intervals; the
//! evidence for each form tried (`criterion_FORM`, relative to the best form, and `weight_FORM`); the responses to
//! further inputs ([`PersonChannel`]); the statistics of the fit and its verdict. There are no columns for parameters
//! that no person has or for forms that were not tried. If some parameters are individual, a person has one row for
//! each run.

use hoid_analysis::IdentifiedModel;
use hoid_ident::family::{FamilyFit, OperatorOfRecord, Parameter};
use hoid_io::{ColumnValues, OutputTable, TableSchema};
use hoid_model::{
    ContinuousTransferFunction, Form, Verdict, VerdictLevel, operator_family::PARAMETERS, uncertainty::Estimate,
};
use serde::Deserialize;
use serde_json::json;

use super::{
    manifest_names::in_manifest,
    parameter_columns,
    person_channel::{self, PersonChannel},
    tables::{join_sentences, numbers, real_columns, schema, split_sentences, text_columns, texts},
};
use crate::columns::Rows;

/// Name of the run for results that apply to all runs.
pub(super) const ALL_RUNS: &str = "all";

/// Outcome of a fit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PersonStatus {
    /// The fit gave an operator.
    Fitted,
    /// The fit failed.
    Failed,
    /// No fit was made, since the task changes within the runs.
    Changes,
}

hoid_model::named_choice!(PersonStatus, "status of a person", 3, {
    Fitted => "ok",
    Failed => "failed",
    Changes => "changes",
});

/// Evidence for one form in a fit.
#[derive(Debug, Clone, PartialEq)]
pub struct FormEvidence {
    /// The form.
    pub form: Form,
    /// Criterion of the form minus the smallest criterion of all forms.
    pub criterion: f64,
    /// Weight of the form in averages over forms.
    pub weight: f64,
}

/// A row of the table `people`.
#[derive(Debug, Clone, PartialEq)]
pub struct Person {
    /// Subject.
    pub subject: String,
    /// Condition.
    pub condition: String,
    /// `all`, or the run to which the individual parameters belong.
    pub run: String,
    /// Number of runs fitted jointly.
    pub runs: usize,
    /// Outcome of the fit.
    pub status: PersonStatus,
    /// Reason why there is no operator; empty if there is one.
    pub reason: String,
    /// The form of the operator.
    pub form: String,
    /// Evidence for each form that has a criterion, in the order of the forms.
    pub forms: Vec<FormEvidence>,
    /// Parameters of the operator.
    pub parameters: Vec<Parameter>,
    /// The responses to further inputs.
    pub channels: Vec<PersonChannel>,
    /// Crossover frequency with the controlled element, rad/s.
    pub crossover_rad_s: Option<Estimate>,
    /// 95 % interval of the crossover frequency from Student's t distribution, since the errors are based on few runs.
    pub crossover_interval: Option<(f64, f64)>,
    /// Phase margin with the controlled element, deg.
    pub phase_margin_deg: Option<Estimate>,
    /// 95 % interval of the phase margin, also from Student's t distribution.
    pub phase_margin_interval: Option<(f64, f64)>,
    /// chi^2 at the lines of the excitation, and the number of degrees of freedom.
    pub chi2: Option<(f64, usize)>,
    /// Ratio of the clustered variances of the parameters to the model-based ones.
    pub kappa: Option<f64>,
    /// Order nd of the noise model.
    pub noise_order: Option<usize>,
    /// Verdict on the fit and on each of its answers.
    pub verdict: Option<Verdict>,
}

impl Person {
    /// Creates a person without an operator, with the reason.
    pub(super) fn without_operator((subject, condition): (&str, &str), status: PersonStatus, reason: &str) -> Self {
        Self {
            subject: subject.to_owned(),
            condition: condition.to_owned(),
            run: ALL_RUNS.to_owned(),
            runs: 0,
            status,
            reason: in_manifest(reason, condition),
            form: String::new(),
            forms: Vec::new(),
            parameters: Vec::new(),
            channels: Vec::new(),
            crossover_rad_s: None,
            crossover_interval: None,
            phase_margin_deg: None,
            phase_margin_interval: None,
            chi2: None,
            kappa: None,
            noise_order: None,
            verdict: None,
        }
    }

    /// Creates a person from one of the operators of a result.
    pub(super) fn from_result(
        key: (&str, &str),
        run: &str,
        runs: usize,
        found: &IdentifiedModel,
        record: usize,
        element: Option<&ContinuousTransferFunction>,
    ) -> Self {
        let fit = &found.fit;
        let OperatorOfRecord { parameters, .. } = fit.operator(record);
        let measures = element.and_then(|element| fit.loop_measures(record, element));
        Self {
            run: run.to_owned(),
            runs,
            form: fit.form.name().to_owned(),
            forms: evidence(fit),
            parameters: parameters.clone(),
            channels: fit.channels.iter().map(PersonChannel::of).collect(),
            crossover_rad_s: measures.map(|m| m.crossover_rad_s),
            crossover_interval: measures.and_then(|m| m.crossover_interval),
            phase_margin_deg: measures.map(|m| m.phase_margin_deg),
            phase_margin_interval: measures.and_then(|m| m.phase_margin_interval),
            chi2: fit.lines.as_ref().map(|l| (l.chi_squared, l.degrees_of_freedom)),
            kappa: Some(fit.inflation),
            noise_order: Some(fit.noise_orders.1),
            verdict: Some(
                found
                    .verdict_of_record(record)
                    .map_messages(|message| in_manifest(message, key.1)),
            ),
            ..Self::without_operator(key, PersonStatus::Fitted, "")
        }
    }

    /// Returns the level of the verdict on the fit, if there is a fit.
    pub fn level(&self) -> Option<VerdictLevel> {
        self.verdict.as_ref().map(|verdict| verdict.level)
    }

    /// True for a row that covers all runs. If some parameters are individual, each run has its own row instead.
    pub fn covers_all_runs(&self) -> bool {
        self.run == ALL_RUNS
    }

    /// Returns a parameter by its name.
    pub fn parameter(&self, name: &str) -> Option<&Parameter> {
        self.parameters.iter().find(|p| p.name == name)
    }

    /// Returns a label with the person and the condition, such as `P03 in fo`.
    pub fn name(&self) -> String {
        let of_run = if self.covers_all_runs() {
            String::new()
        } else {
            format!(", run {}", self.run)
        };
        format!("{}{of_run}", cell_name(&self.subject, &self.condition))
    }

    /// Returns the evidence for a form, if there is any.
    pub fn evidence(&self, form: Form) -> Option<&FormEvidence> {
        self.forms.iter().find(|of| of.form == form)
    }

    fn write(&self, rows: &mut Rows) {
        rows.start_row();
        for (name, value) in [
            ("subject", self.subject.as_str()),
            ("condition", &self.condition),
            ("run", &self.run),
            ("status", self.status.name()),
            ("reason", &self.reason),
            ("form", &self.form),
        ] {
            rows.set_text(name, value);
        }
        if let Some(verdict) = &self.verdict {
            rows.set_text("verdict", verdict.level.name());
            rows.set_text("reasons", &join_sentences(verdict.reasons()));
            rows.set_text("notes", &join_sentences(verdict.notes()));
            rows.set_text("verdict_json", &json!(verdict).to_string());
        }
        rows.set_real("runs", self.runs as f64);
        for p in &self.parameters {
            parameter_columns::write(rows, &p.name, p);
        }
        self.channels.iter().for_each(|channel| channel.write(rows));
        for (name, estimate, interval) in [
            ("crossover_rad_s", self.crossover_rad_s, self.crossover_interval),
            ("phase_margin_deg", self.phase_margin_deg, self.phase_margin_interval),
        ] {
            if let Some(estimate) = estimate {
                rows.set_real(name, estimate.value);
                rows.set_real(&format!("{name}_se"), estimate.standard_error.unwrap_or(f64::NAN));
                let (low, high) = interval.unwrap_or((f64::NAN, f64::NAN));
                rows.set_real(&format!("{name}_low"), low);
                rows.set_real(&format!("{name}_high"), high);
            }
        }
        for of in &self.forms {
            rows.set_real(&format!("criterion_{}", of.form.name()), of.criterion);
            rows.set_real(&format!("weight_{}", of.form.name()), of.weight);
        }
        let (chi2, dof) = self.chi2.map_or((f64::NAN, f64::NAN), |(c, dof)| (c, dof as f64));
        rows.set_real("chi2", chi2);
        rows.set_real("dof", dof);
        rows.set_real("kappa", self.kappa.unwrap_or(f64::NAN));
        rows.set_real("noise_order", self.noise_order.map_or(f64::NAN, |nd| nd as f64));
    }

    fn read(table: &OutputTable, row: usize) -> Option<Self> {
        let cell = |name: &str| texts(table, name).get(row).cloned().unwrap_or_default();
        let any = |name: &str| numbers(table, name).get(row).copied().filter(|v| !v.is_nan());
        let estimate = |name: &str| {
            any(name).map(|value| Estimate {
                value,
                standard_error: any(&format!("{name}_se")),
            })
        };
        let interval = |name: &str| any(&format!("{name}_low")).zip(any(&format!("{name}_high")));
        let evidence = |form: &Form| {
            Some(FormEvidence {
                form: *form,
                criterion: any(&format!("criterion_{}", form.name()))?,
                weight: any(&format!("weight_{}", form.name()))?,
            })
        };
        Some(Self {
            subject: cell("subject"),
            condition: cell("condition"),
            run: cell("run"),
            runs: any("runs").unwrap_or(0.0) as usize,
            status: cell("status").parse().ok()?,
            reason: cell("reason"),
            form: cell("form"),
            forms: Form::ALL.iter().filter_map(evidence).collect(),
            parameters: PARAMETERS
                .into_iter()
                .filter_map(|parameter| parameter_columns::read(table, row, "", parameter))
                .collect(),
            channels: PersonChannel::read(table, row),
            crossover_rad_s: estimate("crossover_rad_s"),
            crossover_interval: interval("crossover_rad_s"),
            phase_margin_deg: estimate("phase_margin_deg"),
            phase_margin_interval: interval("phase_margin_deg"),
            chi2: any("chi2").zip(any("dof").map(|dof| dof as usize)),
            kappa: any("kappa"),
            noise_order: any("noise_order").map(|nd| nd as usize),
            verdict: serde_json::from_str(&cell("verdict_json")).ok().or_else(|| {
                // Tables of an earlier version contain only the sentences.
                let sentences = |name: &str| split_sentences(&cell(name));
                let (reasons, notes) = (sentences("reasons"), sentences("notes"));
                Verdict::deserialize(json!({"level": cell("verdict"), "reasons": reasons, "notes": notes})).ok()
            }),
        })
    }
}

/// Returns the weights of the forms of a fit, and their criteria relative to the smallest one.
fn evidence(fit: &FamilyFit) -> Vec<FormEvidence> {
    let least = (fit.forms.iter().filter_map(|of| of.criterion)).fold(f64::INFINITY, f64::min);
    let evidence = |form: &Form| {
        let of = fit.forms.iter().find(|of| of.form == *form)?;
        Some(FormEvidence {
            form: *form,
            criterion: of.criterion? - least,
            weight: of.weight,
        })
    };
    Form::ALL.iter().filter_map(evidence).collect()
}

/// Returns the name of person and condition.
pub(super) fn cell_name(subject: &str, condition: &str) -> String {
    if condition.is_empty() {
        subject.to_owned()
    } else {
        format!("{subject} in {condition}")
    }
}

/// Returns the table `people`, with columns for the parameters and forms that occur.
pub(super) fn people_table(people: &[Person]) -> OutputTable {
    let used = |name: &&str| people.iter().any(|p| p.parameter(name).is_some());
    let names = PARAMETERS.map(|(name, _)| name);
    let names: Vec<&str> = names.iter().copied().filter(|name| used(name)).collect();
    let tried = |form: &&Form| people.iter().any(|p| p.evidence(**form).is_some());
    let forms: Vec<&str> = Form::ALL.iter().filter(tried).map(|form| form.name()).collect();
    let of_channels = person_channel::columns(people.iter().flat_map(|p| &p.channels));
    let mut rows = Rows::new(&people_schema(&names, &forms, &of_channels));
    people.iter().for_each(|person| person.write(&mut rows));
    rows.into_table(Vec::new())
}

fn people_schema(parameters: &[&str], forms: &[&str], (texts, numbers): &(Vec<String>, Vec<String>)) -> TableSchema {
    let ends = ["crossover_rad_s", "phase_margin_deg"];
    let of_ends: Vec<String> = ends
        .iter()
        .flat_map(|name| ["", "_se", "_low", "_high"].map(|end| format!("{name}{end}")))
        .collect();
    let of_parameters: Vec<String> = parameters
        .iter()
        .flat_map(|name| parameter_columns::numeric_column_names(name))
        .collect();
    let determined: Vec<String> = parameters
        .iter()
        .map(|name| parameter_columns::text_column_name(name))
        .collect();
    let of_forms: Vec<String> = forms
        .iter()
        .flat_map(|form| ["criterion", "weight"].map(|of| format!("{of}_{form}")))
        .collect();
    schema(
        text_columns(&["subject", "condition", "run"])
            .chain(real_columns(&["runs"]))
            .chain(text_columns(&["status", "reason", "form"]))
            .chain(real_columns(&of_parameters))
            .chain(text_columns(&determined))
            .chain(real_columns(&of_ends))
            .chain(real_columns(&of_forms))
            .chain(text_columns(texts))
            .chain(real_columns(numbers))
            .chain(real_columns(&["chi2", "dof", "kappa", "noise_order"]))
            .chain(text_columns(&["verdict", "reasons", "notes", "verdict_json"])),
    )
}

/// Reads the people from a table; rows with an unknown status are skipped.
pub(super) fn read_people(table: &OutputTable) -> Vec<Person> {
    let rows = match table.column("subject") {
        Some(ColumnValues::Text(values)) => values.len(),
        _ => 0,
    };
    (0..rows).filter_map(|row| Person::read(table, row)).collect()
}

#[cfg(test)]
mod tests {
    use hoid_ident::family::ChannelRole;
    use hoid_model::{AnswerVerdict, Finding};

    use super::*;

    #[test]
    fn person_round_trip_through_table() {
        let parameter = |name: &str, unit, interval, determined| Parameter {
            name: name.to_owned(),
            unit,
            value: if determined { 0.2 } else { f64::INFINITY },
            standard_error: determined.then_some(0.01),
            standard_error_person: determined.then_some(0.01),
            interval,
            prior_share: 0.25,
            determined,
            averaged_over: Vec::new(),
        };
        let mut person = Person {
            run: "3".to_owned(),
            runs: 10,
            form: "lead-lag".to_owned(),
            forms: vec![
                FormEvidence {
                    form: Form::Lead,
                    criterion: 12.5,
                    weight: 0.0,
                },
                FormEvidence {
                    form: Form::LeadLag,
                    criterion: 0.0,
                    weight: 1.0,
                },
            ],
            parameters: vec![
                parameter("T_I", "s", Some((4.0, f64::INFINITY)), false),
                parameter("tau_e", "s", Some((0.18, 0.22)), true),
            ],
            channels: vec![
                PersonChannel {
                    name: "r".to_owned(),
                    role: ChannelRole::Feedforward,
                    preview_s: 0.25,
                    p_value: 1e-9,
                    form: Some(Form::Derivative),
                    parameters: vec![
                        parameter("K_d", "s", Some((0.1, 0.3)), true),
                        parameter("tau_f", "s", None, true),
                    ],
                },
                PersonChannel {
                    name: "y".to_owned(),
                    role: ChannelRole::Output,
                    preview_s: 0.0,
                    p_value: 0.4,
                    form: None,
                    parameters: Vec::new(),
                },
            ],
            crossover_rad_s: Some(Estimate {
                value: 3.0,
                standard_error: Some(0.1),
            }),
            crossover_interval: Some((2.7, 3.3)),
            chi2: Some((12.5, 9)),
            kappa: Some(2.0),
            noise_order: Some(7),
            verdict: Some(
                Verdict::of(vec![
                    Finding::warning("stretch", "one").over(2.0, 4.0),
                    Finding::warning("slow", "two; three"),
                    Finding::note("prior", "four"),
                ])
                .with_answers([("tau_e".to_owned(), AnswerVerdict::of([]))]),
            ),
            ..Person::without_operator(("P", "c"), PersonStatus::Fitted, "")
        };
        let failed = Person::without_operator(("Q", ""), PersonStatus::Failed, "no file");
        let mut table = people_table(&[person.clone(), failed.clone()]);
        assert_eq!(read_people(&table), [person.clone(), failed.clone()]);
        // A table of an earlier version has only sentences.
        table.columns.retain(|column| column.name != "verdict_json");
        let earlier = read_people(&table).remove(0).verdict.unwrap();
        assert!(earlier.reasons().eq(["one", "two; three"]) && earlier.notes().eq(["four"]));
        assert_eq!((person.name().as_str(), failed.name().as_str()), ("P in c, run 3", "Q"));
        // No person has a lead, so there are no columns for it.
        assert!(table.column("T_L").is_none() && table.column("T_I_low").is_some());
        assert!(table.column("r_tau_f").is_some() && table.column("y_tau_f").is_none());
        assert!(table.column("weight_gain").is_none() && table.column("weight_lead").is_some());
        person.parameters.clear();
        assert!(people_table(&[person]).column("tau_e").is_none());
    }
}
