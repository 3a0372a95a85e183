use hoid_model::{
    FamilyScenario, Form, SampleTime,
    family_scenario::{DependenceSignal, PartStrength, RemnantShape},
    scenario::Realisation,
    schedule::Schedule,
};

use super::*;

const EXAMPLE: &str = include_str!("../../../../fixtures/scenario/person.toml");

fn parse(text: &str) -> Result<FamilyScenario, ScenarioFileError> {
    parse_any_scenario(text, "x.toml", "x").map(|scenario| match scenario {
        AnyScenario::Family(scenario) => *scenario,
        AnyScenario::Reference(_) => panic!("not of the family"),
    })
}

#[test]
fn a_file_with_every_table_is_read() {
    let scenario = parse(EXAMPLE).unwrap();
    assert_eq!(scenario.name, "a person");
    assert_eq!(scenario.sample_time, SampleTime::AT_60_HZ);
    assert_eq!((scenario.measurement_s, scenario.run_in_s), (60.0, 5.0));
    assert_eq!(scenario.realisation, Realisation::Output);
    let (initial, last) = (&scenario.initial, &scenario.last);
    assert_eq!(initial.operator.form(), Form::LeadLag);
    let expected = [4.0, 0.6, 0.2, 11.0_f64.ln(), 0.25_f64.ln(), 0.1437];
    assert_eq!(initial.operator.coordinates(), expected);
    // K = 20 is taken from [initial], T_I from [last].
    let expected = [20.0 / 4.0, 0.5, 0.25, 11.0_f64.ln(), 0.25_f64.ln(), 0.1437];
    assert_eq!(last.operator.coordinates(), expected);
    assert_eq!(initial.controlled_element.den(), [1.0, 0.0]);
    assert_eq!(last.controlled_element.num(), [1.5]);
    let Schedule::Sigmoid { rate_per_s, midpoint_s } = scenario.schedule else {
        panic!("no sigmoid");
    };
    assert_eq!((rate_per_s, midpoint_s), (100.0, 30.0));
    assert!(scenario.disturbance.random_phases && !scenario.target.random_phases);
    assert_eq!(scenario.disturbance.function.sinusoids().len(), 7);
    assert_eq!(scenario.target.function.sinusoids()[0].phase_rad, 0.5);
    let [band, peak, ar] = &scenario.remnant[..] else {
        panic!("three parts");
    };
    assert_eq!(band.strength, PartStrength::Share(0.15));
    assert_eq!(band.signal_dependence.unwrap().signal, DependenceSignal::Rate);
    assert_eq!(band.pulses.unwrap().rate_per_s, 2.0);
    assert_eq!(peak.intermittence.unwrap().off_s, 2.0);
    assert!(matches!(peak.shape, RemnantShape::Resonance { zeta, .. } if zeta == 0.2));
    assert!(matches!(&ar.shape, RemnantShape::Ar { coefficients } if coefficients[..] == [-0.9]));
    assert_eq!(
        ar.strength,
        PartStrength::Gain {
            initial: 0.02,
            last: 0.03
        }
    );
    assert_eq!(scenario.stick.offset_u, -0.1);
}

const SHORT_EXAMPLE: &str = "form = \"lead-lag\"\n[initial]\nK_over_T_I = 4\nT_L_s = 0.6\nT_I_s = inf\nomega_nm_rad_s = 11\nzeta_nm = 0.3\ntau_e_s = 0.15\ncontrolled_element = \"1/1,0\"\n";

#[test]
fn pure_integration_has_an_infinite_lag() {
    let scenario = parse(SHORT_EXAMPLE).unwrap();
    assert_eq!(scenario.initial.operator.coordinates()[2], 0.0);
    assert_eq!(
        (scenario.measurement_s, scenario.sample_time),
        (40.0, SampleTime::AT_60_HZ)
    );
    assert_eq!(scenario.initial, scenario.last);
}

#[test]
fn controlled_element_is_read_as_a_transfer_function() {
    let element = |text: &str| {
        parse(&SHORT_EXAMPLE.replace("1/1,0", text))
            .unwrap()
            .initial
            .controlled_element
    };
    let expected = element("90/1,6,0");
    assert_eq!((expected.num(), expected.den()), (&[90.0][..], &[1.0, 6.0, 0.0][..]));
    for text in ["90/(s(s+6))", " 90 / 1, 6, 0 ", "180/(2s^2 + 12s)"] {
        assert_eq!(element(text), expected, "{text}");
    }
    assert_eq!(element("1/s"), element("1/1,0"));
}

#[test]
fn invalid_files_are_refused_with_a_remedy() {
    let with = |from: &str, to: &str| SHORT_EXAMPLE.replace(from, to);
    let more = |tail: &str| format!("{SHORT_EXAMPLE}{tail}\n");
    for (text, part) in [
        (with("lead-lag", "lead-leg"), "line 1: form is lead-leg"),
        (with("T_L_s = 0.6\n", ""), "lacks T_L_s"),
        (with("K_over_T_I", "K"), "give K_over_T_I"),
        (with("zeta_nm = 0.3", "zeta_nm = -1"), "expected a positive number"),
        (with("T_L_s = 0.6\n", "T_L_s = 0.6\nc_1_s = 1\n"), "[initial] has c_1_s"),
        (with("1/1,0", "1,0,0/1,0"), "higher degree"),
        (with("1/1,0", "one"), "line 9: initial.controlled_element is one"),
        (with("1/1,0", "90/s(s+6)"), "at character 5 there is '('"),
        (with("1/1,0", "1e13/s"), "controlled_element is 10000000000000"),
        (with("1/1,0", "exp(-0.1s)/s"), "add this delay to that of the operator"),
        (with("controlled_element = \"1/1,0\"\n", ""), "lacks controlled_element"),
        (with("form", "sample_time_s = 0\nform"), "line 1: sample_time_s is 0"),
        (
            with("form", "sample_time_s = 0.01\nsampling_rate_hz = 100\nform"),
            "specify the same quantity",
        ),
        (more("K_e = 1"), "unknown field `K_e`"),
        (more("[last]\nT_L_s = 0.5"), "add [schedule]"),
        (more("[schedule]\nrate_per_s = 1\nmidpoint_s = 20"), "no [last]"),
        (
            more("[[remnant]]\nshape = \"lag\"\nshare = 0.1"),
            "takes T_n_s and order",
        ),
        (
            more("[[remnant]]\nshape = \"white\"\nshare = 0.1\nzeta = 0.2"),
            "remove zeta",
        ),
        (more("[[remnant]]\nshape = \"white\""), "give share"),
        (
            more("[[remnant]]\nshape = \"white\"\nshare = 0.1\non_s = 1"),
            "lacks off_s",
        ),
        (more("[[remnant]]\nshape = \"white\"\nshare = 1.1"), "below one"),
        (more("[disturbance]\nrms = 1\nlines = []"), "give only one of the two"),
    ] {
        let message = parse(&text).unwrap_err().to_string();
        assert!(
            message.contains(part) && message.contains("x.toml"),
            "{message} lacks {part}"
        );
    }
    // Studies accept only the operator of the thesis.
    let message = parse_scenario(SHORT_EXAMPLE, "x.toml", "x").unwrap_err().to_string();
    assert!(message.contains("`form` key"), "{message}");
    assert!(matches!(
        parse_any_scenario("condition = \"C1\"", "x.toml", "x"),
        Ok(AnyScenario::Reference(_))
    ));
    assert!(family_scenario_schema().contains("K_over_T_I"));
}

const PURSUIT_EXAMPLE: &str = include_str!("../../../../fixtures/scenario/pursuit.toml");

#[test]
fn displayed_target_is_read() {
    let scenario = parse(PURSUIT_EXAMPLE).unwrap();
    let seen = scenario.feedforward.as_ref().unwrap();
    let muscles = [11.0_f64.ln(), 0.3_f64.ln()];
    assert_eq!((seen.operator.form(), seen.preview_s), (Form::Derivative, 0.25));
    let expected = [0.7, muscles[0], muscles[1], 0.2];
    for (found, expected) in seen.operator.coordinates().iter().zip(expected) {
        assert!((found - expected).abs() < 1e-15, "{seen:?}");
    }
    let lines = |excitation: &hoid_model::family_scenario::Excitation| excitation.function.sinusoids().len();
    assert_eq!((lines(&scenario.target), lines(&scenario.disturbance)), (5, 6));
    for (from, to, expected) in [
        ("tau_f_s = -0.05", "tau_f_s = -0.3", "before it is displayed"),
        ("form = \"derivative\"", "form = \"bent\"", "form of the operator"),
        ("K_d_s = 0.7", "K = 0.7", "K_d_s"),
        ("interleaved = \"even\"", "interleaved = \"some\"", "even"),
        ("[target]\ninterleaved = \"even\"", "", "no displayed target"),
    ] {
        let error = parse(&PURSUIT_EXAMPLE.replace(from, to)).unwrap_err().to_string();
        assert!(error.contains(expected), "{to}: {error}");
    }
}

#[test]
fn motion_feedback_is_read() {
    let motion = include_str!("../../../../fixtures/scenario/motion.toml");
    let felt = parse(motion).unwrap().motion.unwrap();
    assert_eq!(felt.form(), Form::Canals);
    let expected = [-2.5, 11.0_f64.ln(), 0.3_f64.ln(), 0.18];
    assert!(
        felt.coordinates()
            .iter()
            .zip(expected)
            .all(|(a, b)| (a - b).abs() < 1e-14)
    );
    let rate = motion
        .replace("form = \"canals\"", "form = \"canals-rate\"")
        .replace("K_m_s2", "K_m_rate_s");
    assert_eq!(parse(&rate).unwrap().motion.unwrap().form(), Form::CanalsRate);
    for (from, to, words) in [
        ("K_m_s2 = -2.5", "K_m_rate_s = 1", "lacks K_m_s2"),
        ("K_m_s2 = -2.5", "K_m_s2 = 1e9", "motion.K_m_s2"),
        ("tau_f_s = 0.18", "tau_f_s = -0.1", "before it happens"),
        ("tau_f_s = 0.18", "preview_s = 0.5", "[motion] has a preview"),
        ("form = \"canals\"", "form = \"ears\"", "motion.form is ears"),
    ] {
        let error = parse(&motion.replace(from, to)).unwrap_err().to_string();
        assert!(error.contains(words), "{to}: {error}");
    }
}
