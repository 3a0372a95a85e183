use std::path::Path;

use hoid_model::{
    remnant_gain::NoiseDefinition,
    scenario::{Condition, Realisation, RemnantStrength, Scenario},
    schedule::Schedule,
};

use super::*;

fn parse(text: &str) -> Result<Scenario, ScenarioFileError> {
    parse_scenario(text, "x.toml", "x")
}

fn refusal(text: &str) -> String {
    parse(text).unwrap_err().to_string()
}

fn renamed_condition(condition: Condition) -> Scenario {
    Scenario {
        name: "x".to_owned(),
        ..Scenario::condition(condition)
    }
}

#[test]
fn documentation_example_is_read() {
    let example: String = include_str!("mod.rs")
        .lines()
        .skip_while(|l| *l != "//! ```toml")
        .skip(1)
        .take_while(|l| *l != "//! ```")
        .map(|l| format!("{}\n", l.trim_start_matches("//!").trim_start()))
        .collect();
    let mut expected = renamed_condition(Condition::C4);
    expected.realisation = Realisation::Output;
    for state in [&mut expected.initial, &mut expected.last] {
        state.operator.tau_e_s = 0.3;
    }
    expected.last.operator.k_e = 0.08;
    expected.last.operator.t_l_s = 1.0;
    expected.schedule = Schedule::Sigmoid {
        rate_per_s: 0.5,
        midpoint_s: 40.96,
    };
    expected.remnant.order = 2;
    expected.remnant.strength = RemnantStrength::Level {
        level: 0.2,
        definition: NoiseDefinition::Response,
    };
    assert_eq!(parse(&example), Ok(expected));
}

#[test]
fn each_state_may_have_its_own_delay() {
    let delays = |text: &str| {
        let scenario = parse(text).unwrap();
        [scenario.initial, scenario.last].map(|state| state.operator.tau_e_s)
    };
    assert_eq!(delays("condition = \"C4\"\n[last]\ntau_e_s = 0.34"), [0.28, 0.34]);
    assert_eq!(
        delays("condition = \"C4\"\ntau_e_s = 0.3\n[last]\ntau_e_s = 0.34"),
        [0.3, 0.34]
    );
    assert_eq!(delays("condition = \"C1\"\n[initial]\ntau_e_s = 0.2"), [0.2, 0.2]);
}

#[test]
fn interval_gives_an_alternating_schedule() {
    let mut expected = renamed_condition(Condition::C4);
    expected.schedule = Schedule::Alternating {
        rate_per_s: 100.0,
        midpoint_s: 40.96,
        interval_s: 10.0,
    };
    assert_eq!(parse("condition = \"C4\"\n[schedule]\ninterval_s = 10"), Ok(expected));
    assert!(parse("condition = \"C4\"\n[schedule]\ninterval_s = -1").is_err());
}

#[test]
fn condition_key_alone_gives_the_named_condition() {
    for condition in Condition::ALL {
        assert_eq!(
            parse(&format!("condition = \"{condition}\"")),
            Ok(renamed_condition(condition))
        );
    }
}

#[test]
fn file_with_every_key_matches_c4() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fixtures/scenario/full.toml");
    let expected = Scenario {
        name: "s1 to s2, fast".to_owned(),
        realisation: Realisation::Output,
        ..Scenario::condition(Condition::C4)
    };
    // The last state takes omega_nm and zeta_nm from the initial state, and the forcing function is bit-identical to
    // Table 1.
    assert_eq!(read_scenario(&path), Ok(expected));
}

#[test]
fn constant_conditions_stay_constant() {
    let own = parse("condition = \"C1\"\n[initial]\nK_e = 0.08").unwrap();
    assert_eq!(own.initial.operator.k_e, 0.08);
    assert_eq!(own.last, own.initial);
    let text = "condition = \"C1\"\n[remnant]\nK_n_initial_deg = 0.1";
    let RemnantStrength::Gain { initial, last } = parse(text).unwrap().remnant.strength else {
        panic!("no gain");
    };
    assert_eq!([initial, last], [0.1, 0.1]);
    let at_rest = parse("condition = \"C1\"\nforcing = []\n[remnant]\nnoise_level = 0").unwrap();
    assert_eq!(at_rest.forcing.value(1.0), 0.0);
}

#[test]
fn invalid_value_errors_name_line_key_and_remedy() {
    for (text, parts) in [
        ("\n\ncondition = \"C7\"", ["line 3", "condition is C7", "C1, C2"]),
        (
            "condition = \"C1\"\n[initial]\nK_e = nan",
            ["line 3", "initial.K_e is NaN", "finite"],
        ),
        (
            "condition = \"C4\"\n[last]\nzeta_nm = -0.1",
            ["line 3", "last.zeta_nm is -0.1", "positive"],
        ),
        (
            "condition = \"C1\"\ntau_e_s = 0.285",
            ["line 2", "tau_e_s is 0.285", "change sample_time_s"],
        ),
        (
            "condition = \"C4\"\n[last]\ntau_e_s = 0.285",
            ["line 3", "last.tau_e_s is 0.285", "change sample_time_s"],
        ),
        (
            "condition = \"C1\"\nsample_time_s = 0.03",
            ["tau_e_s is 0.28", "by default", "0.03 s"],
        ),
        (
            "condition = \"C1\"\nmeasurement_s = 1e12",
            ["line 2", "measurement_s", "1 to 1e7"],
        ),
        (
            "condition = \"C1\"\nsample_time_s = 0",
            ["line 2", "sample_time_s is 0", "positive"],
        ),
        (
            "condition = \"C1\"\n[remnant]\norder = 5",
            ["line 3", "remnant.order is 5", "1, 2, 3 or 4"],
        ),
        (
            "condition = \"C1\"\n[remnant]\nnoise_level = -1",
            ["line 3", "noise_level is -1", "zero or more"],
        ),
        (
            "condition = \"C1\"\n[[forcing]]\namplitude_deg = inf\nphase_rad = 0\ncycles = 2",
            ["line 3", "amplitude_deg is inf", "finite"],
        ),
    ] {
        let message = refusal(text);
        for part in ["x.toml", parts[0], parts[1], parts[2]] {
            assert!(message.contains(part), "{text}: {message} lacks {part}");
        }
    }
}

#[test]
fn missing_and_unknown_keys_are_refused() {
    let c1 = "condition = \"C1\"\n";
    for (text, part) in [
        (String::new(), "initial.omega_b_rad_s"),
        (format!("{c1}K_e = 1"), "unknown field `K_e`"),
        (format!("{c1}[initial]\nk_e = 1"), "unknown field `k_e`"),
        (format!("{c1}run_in_s = \"long\""), "line 2"),
        (format!("{c1}realisation = \"both\""), "unknown variant `both`"),
        (format!("{c1}[initial"), "line 2"),
        (format!("{c1}[last]\nK_e = 1"), "add [schedule]"),
        (
            format!("{c1}[schedule]\nrate_per_s = 1\nmidpoint_s = 9"),
            "both states are the same",
        ),
        (
            format!("{c1}[last]\nK_e = 1\n[schedule]\nrate_per_s = 1"),
            "lacks midpoint_s",
        ),
        (
            format!("{c1}[remnant]\nnoise_level = 0.1\nK_n_initial_deg = 1"),
            "give only one of the two",
        ),
        (format!("{c1}[remnant]\nK_n_last_deg = 1"), "give both"),
        (
            "condition = \"C4\"\n[remnant]\nK_n_initial_deg = 1".to_owned(),
            "no K_n_last_deg",
        ),
        (
            format!("{c1}[[forcing]]\namplitude_deg = 1\nphase_rad = 0"),
            "either omega_rad_s or cycles",
        ),
    ] {
        let message = refusal(&text);
        assert!(message.contains(part), "{text}: {message} lacks {part}");
    }
}

#[test]
fn model_errors_name_the_file() {
    let unreachable = "condition = \"C1\"\n[remnant]\nnoise_level = 3\nnoise_definition = \"remnant\"";
    assert!(refusal(unreachable).contains("largest reachable"));
    assert!(refusal("condition = \"C1\"\n[initial]\nK_e = 5").contains("x.toml"));
    let nowhere = read_scenario(Path::new("/nowhere/a.toml")).unwrap_err();
    assert!(matches!(nowhere, ScenarioFileError::Unreadable { .. }));
}

const DISPLAYED_TARGET: &str = "condition = \"C4\"\ndisturbance_rms_deg = 0.1\n[feedforward]\nform = \"derivative\"\nK_d_s = 0.15\n\
                    tau_f_s = 0.1\npreview_s = 0.25\n";

#[test]
fn displayed_target_and_disturbance_are_read() {
    let scenario = parse(DISPLAYED_TARGET).unwrap();
    let text = "derivative:0.15,tau_f=0.1,preview=0.25";
    let expected = hoid_model::Feedforward::from_text(text, Some((11.25, 0.35))).unwrap();
    assert_eq!(scenario.feedforward, Some(expected));
    assert_eq!(scenario.disturbance.sinusoids().len(), 10);
    assert!((scenario.disturbance.rms_deg() - 0.1).abs() < 1e-15);
    // The response to the target after the change, and a disturbance given by its lines and their rms.
    let lines = "[[disturbance]]\namplitude_deg = 1\nphase_rad = 0\ncycles = 4\n\
                 [[disturbance]]\namplitude_deg = 1\nphase_rad = 1\nomega_rad_s = 2\n";
    let changing = parse(&format!(
        "{DISPLAYED_TARGET}[feedforward.last]\nK_d_s = 0.3\ntau_f_s = 0.2\n{lines}"
    ))
    .unwrap();
    let last = changing.feedforward.unwrap().last.unwrap();
    assert_eq!(last.coordinates()[0], 0.3);
    assert!((last.tau_e_s() - 0.45).abs() < 1e-15);
    let amplitudes: Vec<f64> = changing
        .disturbance
        .sinusoids()
        .iter()
        .map(|s| s.amplitude_deg)
        .collect();
    assert!(amplitudes.iter().all(|a| (a - 0.1).abs() < 1e-15), "{amplitudes:?}");
    // The change may be limited to the response to the target.
    let only = "condition = \"C1\"\n[schedule]\nrate_per_s = 1\nmidpoint_s = 40\n[feedforward]\nform = \"gain\"\nK = 0.1\n\
                [feedforward.last]\nK = 0.2\n";
    assert!(parse(only).unwrap().feedforward.unwrap().last.is_some());
}

#[test]
fn invalid_displays_are_refused() {
    for (from, to, words) in [
        ("form = \"derivative\"", "form = \"wheel\"", "feedforward.form is wheel"),
        ("K_d_s = 0.15", "K = 0.15", "lacks K_d_s"),
        ("K_d_s = 0.15", "K_d_s = 1e9", "feedforward.K_d_s"),
        ("tau_f_s = 0.1", "tau_f_s = -0.3", "before it is displayed"),
        ("preview_s = 0.25", "preview_s = 0.251", "feedforward.preview_s"),
        ("preview_s = 0.25", "preview = 0.25", "unknown field"),
        (
            "condition = \"C4\"",
            "condition = \"C4\"\nforcing = []",
            "target is at rest",
        ),
        (
            "disturbance_rms_deg = 0.1",
            "disturbance_rms_deg = -1",
            "disturbance_rms_deg",
        ),
    ] {
        let error = refusal(&DISPLAYED_TARGET.replace(from, to));
        assert!(error.contains(words), "{to}: {error}");
    }
    let constant = DISPLAYED_TARGET.replace("C4", "C1") + "[feedforward.last]\nK_d_s = 0.3\n";
    assert!(refusal(&constant).contains("add [schedule]"));
}
