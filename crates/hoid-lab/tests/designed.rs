//! The lab accepts the experiment that `hoid design --out` writes.
#![allow(clippy::unwrap_used)]

use std::fs;

use hoid_design::experiment::{DesignRequest, EntryPoint};
use hoid_lab::Config;
use hoid_model::{NamedChoice, family_scenario::Display};
use tempfile::TempDir;

#[test]
fn designed_experiments_are_read() {
    let directory = TempDir::new().unwrap();
    let at = directory.path();
    let points = [EntryPoint::Disturbance, EntryPoint::Target];
    let all = points
        .iter()
        .flat_map(|enters| Display::CHOICES.iter().map(move |display| (*enters, *display)));
    for (enters, display) in all {
        let request = DesignRequest {
            controlled_element: Some("90/(s(s+6))".parse().unwrap()),
            enters,
            display,
            runs: Some(3),
            ..DesignRequest::default()
        };
        let design = request.run().unwrap();
        fs::write(at.join("scenario.toml"), design.scenario()).unwrap();
        fs::write(at.join("lab.toml"), design.lab_config("scenario.toml").unwrap()).unwrap();
        let config = Config::read(&at.join("lab.toml")).unwrap();
        let condition = &config.condition[0];
        assert_eq!((condition.runs, condition.display), (3, display));
        let course = condition.task_definition().unwrap();
        let [target, disturbance] = course.excitations();
        let lines = |of| design.lines.iter().filter(|line| line.enters == of).count();
        assert_eq!(target.function.sinusoids().len(), lines(EntryPoint::Target));
        assert_eq!(disturbance.function.sinusoids().len(), lines(EntryPoint::Disturbance));
        let (seen, of_error) = (enters == EntryPoint::Target, display == Display::Compensatory);
        assert_eq!(lines(EntryPoint::Target) > 0, seen);
        assert_eq!(lines(EntryPoint::Disturbance) > 0, !seen || !of_error);
        assert_eq!(
            course.element_at(0.0).unwrap().to_string(),
            design.task.state.controlled_element.to_string()
        );
        assert!((course.durations_s().1 - design.length_s).abs() < 1e-9);
    }
}
