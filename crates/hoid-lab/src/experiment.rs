//! Files of an experiment outside its sessions: its description, the list of participants, and the manifest for
//! `hoid group`.

use std::{collections::BTreeMap, path::Path};

use hoid_study::group::{ConditionSettings, MANIFEST_FILE, Manifest, ReadSettings, RunEntry};
use serde_json::json;

use crate::{
    LabError,
    config::{Condition, Config},
    record::TARGET_CHANNEL,
    session::{RunEnd, Session},
};

const README: &str = " A tracking experiment by `hoid lab`.

sub-P01/ses-01/             one session of one person, \
                      who has a made-up name
  lab.toml                  the experiment, its order, browser and \
                      screen
  lab.copy.toml             a copy, in case lab.toml is damaged
  runs.csv             \
                      each run that ended: verified, or unverified and why
  ..._run.json              the task and \
                      the settings of a run, written before the run starts
  ..._forcing.parquet       target and \
                      disturbance at each tick of 1 ms
  ..._ticks.csv             u (hand) and e (error) at each \
                      tick
  ..._events.csv            input events: the tick that used them, their own time stamp, \
                      when the page
                            received them (ms from tick 0), and what the device \
                      reported
  ..._frames.csv            frames: their time, when they were drawn (ms from tick 0), \
                      the tick and the
                            error that they show
  ..._live.csv              \
                      the estimate during the run
  ..._end.json              how the run ended; SHA-256 of \
                      ticks, events and frames
  ..._beh.parquet           the run at 100 Hz: t, e, u, f_t (target), d \
                      (disturbance), y (output),
                            e_shown (error on the screen)

Verify and \
                      replay a session:    hoid lab --replay sub-P01/ses-01
One run:                        hoid \
                      identify sub-P01/ses-01/..._beh.parquet --from 0
All people:                     hoid group \
                      group.toml --out results

Names follow BIDS where BIDS defines names; it defines none for \
                      tracking experiments, so a BIDS
validator may reject the folder.
";

/// Writes `README` and `dataset_description.json` unless they exist.
///
/// # Errors
/// [`LabError::Io`].
pub fn write_description(out: &Path, config: &Config) -> Result<(), LabError> {
    let description = json!({
        "Name": config.name,
        "BIDSVersion": "1.10.0",
        "DatasetType": "raw",
        "License": "",
        "GeneratedBy": [{"Name": "hoid lab", "Version": env!("CARGO_PKG_VERSION")}],
    });
    write_if_missing(&out.join("README"), README)?;
    write_if_missing(&out.join("dataset_description.json"), &format!("{description:#}\n"))
}

fn write_if_missing(path: &Path, text: &str) -> Result<(), LabError> {
    if path.exists() { Ok(()) } else { write(path, text) }
}

fn write(path: &Path, text: &str) -> Result<(), LabError> {
    hoid_io::write_atomically(path, |file| file.write_all(text.as_bytes()))?;
    Ok(())
}

/// Writes the list of participants.
///
/// # Errors
/// Errors of reading or writing files.
pub fn write_participants(out: &Path) -> Result<(), LabError> {
    let mut people: BTreeMap<String, (usize, String)> = BTreeMap::new();
    for folder in Session::folders(out)? {
        let facts = Session::read(&folder)?.plan;
        let entry = people.entry(facts.subject).or_default();
        entry.0 = entry.0.saturating_add(1);
        entry.1 = facts.licence;
    }
    let mut text = "participant_id\tsessions\tlicense\n".to_owned();
    for (subject, (sessions, licence)) in people {
        let licence = if licence.is_empty() { "n/a" } else { &licence };
        text.push_str(&format!("sub-{subject}\t{sessions}\t{licence}\n"));
    }
    write(&out.join("participants.tsv"), &text)
}

/// Writes the manifest of all finished runs, in which unverified runs and training runs are marked as not analysed.
/// Writes nothing if no run remains to be analysed.
///
/// # Errors
/// Errors of reading or writing files.
pub fn write_manifest(out: &Path) -> Result<(), LabError> {
    let mut runs = Vec::new();
    let mut conditions: BTreeMap<String, Condition> = BTreeMap::new();
    for folder in Session::folders(out)? {
        let session = Session::read(&folder)?;
        let facts = &session.plan;
        for done in session.finished_runs.iter().filter(|done| done.how == RunEnd::Finished) {
            let path = session.stem(&done.condition, done.number).file("beh.parquet");
            if !path.exists() {
                continue;
            }
            runs.push(RunEntry {
                file: path.strip_prefix(out).unwrap_or(&path).to_owned(),
                then: None,
                subject: facts.subject.clone(),
                condition: done.condition.clone(),
                run: format!("{}-{}", facts.session, done.number),
                counts: !done.training && done.verdict == "verified",
            });
            let own = facts
                .config
                .condition
                .iter()
                .find(|condition| condition.name == done.condition);
            if let Some(own) = own {
                conditions.insert(own.name.clone(), own.clone());
            }
        }
    }
    if !runs.iter().any(|run| run.counts) {
        return Ok(());
    }
    let manifest = Manifest {
        name: out
            .file_name()
            .map_or("lab".to_owned(), |name| name.to_string_lossy().into_owned()),
        read: ReadSettings {
            from_s: Some(0.0),
            ..ReadSettings::default()
        },
        prepare: Default::default(),
        analysis: Default::default(),
        conditions: conditions
            .iter()
            .map(|(name, own)| Ok((name.clone(), known_settings(own)?)))
            .collect::<Result<_, LabError>>()?,
        runs,
    };
    write(&out.join(MANIFEST_FILE), &manifest.text())
}

/// Returns the known properties of a condition for the manifest.
fn known_settings(condition: &Condition) -> Result<ConditionSettings, LabError> {
    let course = condition.task_definition()?;
    let [has_target, has_disturbance] = course.has_lines();
    let role = condition.target_role()?;
    // At the lines of a displayed target, u/e is not the response to the error.
    let excitation = match (&role, has_target, has_disturbance) {
        (Some(_), _, true) | (None, false, true) => Some("d"),
        (None, true, _) => Some(TARGET_CHANNEL),
        _ => None,
    };
    Ok(ConditionSettings {
        controlled_element: course.constant_element()?.map(|element| element.to_string()),
        excitation: excitation.map(str::to_owned),
        roles: role
            .map(|role| format!("{TARGET_CHANNEL}={role}"))
            .into_iter()
            .collect(),
        change_s: course.change_s(),
        ..ConditionSettings::default()
    })
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use hoid_model::family_scenario::Display;

    use super::*;
    use crate::config::Signal;

    #[test]
    fn displayed_target_is_a_further_input_of_the_group() {
        let of = |display, disturbance| {
            let condition = Condition {
                target: Some(Signal::default()),
                disturbance,
                display,
                preview_s: 0.5,
                ..Condition::default()
            };
            let facts = known_settings(&condition).unwrap();
            (facts.roles.join(" "), facts.excitation.unwrap_or_default())
        };
        let pair = |roles: &str, excitation: &str| (roles.to_owned(), excitation.to_owned());
        let both = Some(Signal::default());
        assert_eq!(of(Display::Compensatory, both), pair("", "f_t"));
        assert_eq!(of(Display::Pursuit, both), pair("f_t=feedforward", "d"));
        assert_eq!(of(Display::Preview, both), pair("f_t=feedforward:0.5", "d"));
        assert_eq!(of(Display::Preview, None), pair("f_t=feedforward:0.5", ""));
    }
}
