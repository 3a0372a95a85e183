//! The experiment that `hoid design --out` writes is one of the laboratory.
#![allow(clippy::unwrap_used)]

use std::fs;

use hoid_design::experiment::{DesignRequest, Enters};
use hoid_lab::Config;
use hoid_model::{NamedChoice, family_scenario::Display};
use tempfile::TempDir;

#[test]
fn a_designed_experiment_is_read() {
    let directory = TempDir::new().unwrap();
    let at = directory.path();
    for display in Display::CHOICES {
        let request = DesignRequest {
            controlled_element: Some("90/(s(s+6))".parse().unwrap()),
            enters: Enters::Disturbance,
            display: *display,
            runs: Some(3),
            ..DesignRequest::default()
        };
        let design = request.run().unwrap();
        fs::write(at.join("scenario.toml"), design.scenario()).unwrap();
        fs::write(at.join("lab.toml"), design.lab("scenario.toml").unwrap()).unwrap();
        let config = Config::read(&at.join("lab.toml")).unwrap();
        let condition = &config.condition[0];
        assert_eq!((condition.runs, condition.display), (3, *display));
        let course = condition.course().unwrap();
        let [target, disturbance] = course.excitations();
        assert!(target.function.sinusoids().is_empty());
        assert_eq!(disturbance.function.sinusoids().len(), design.lines.len());
        assert_eq!(
            course.element_at(0.0).unwrap().to_string(),
            design.task.state.controlled_element.to_string()
        );
        assert!((course.times_s().1 - design.length_s).abs() < 1e-9);
    }
}
