use super::*;

fn read(text: &str) -> ContinuousTransferFunction {
    text.parse().unwrap()
}

fn reason(text: &str) -> String {
    text.parse::<ContinuousTransferFunction>().unwrap_err().to_string()
}

#[test]
fn all_notations_give_the_same_element() {
    let element = ContinuousTransferFunction::new(&[90.0], &[1.0, 6.0, 0.0]).unwrap();
    for text in [
        "90/1,6,0",
        " 90 / 1, 6, 0 ",
        "180/2,12,0",
        "90/(s(s+6))",
        "90/(s*(s+6))",
        "90/(s^2+6s)",
        "90/s/(s+6)",
        "9e1 / ( s * ( s + 6.0 ) )",
        "15/(s(s/6+1))",
        "--90/((s)((s+6)))",
        "90s^-1*(s+6)^-1",
        "90(s+6)^0/(S\u{b7}(S+6))",
        "100/(s^2+6s) \u{2212} 10/(s^2+6s)",
        "0.9e+2/(6s+s^2)",
    ] {
        let found = read(text);
        assert_eq!(found.num().len(), 1, "{text}");
        for (a, b) in found.den().iter().zip(element.den()) {
            // 1/6 has no exact binary representation.
            assert!((a - b).abs() < 1e-14, "{text}: {found:?}");
        }
        assert!(
            (found.num()[0] - 90.0).abs() < 1e-13 && found.delay_s() == 0.0,
            "{text}"
        );
    }
}

#[test]
fn expressions_match_direct_evaluation() {
    let s = num_complex::Complex64::new(0.0, 1.7);
    let delay = (-0.1 * s).exp();
    for (text, expected) in [
        ("(2s+1)/(s^2+0.4s+1)", (2.0 * s + 1.0) / (s * s + 0.4 * s + 1.0)),
        ("1/s", 1.0 / s),
        ("5/(s^2)", 5.0 / (s * s)),
        ("0.5(s+1)/s/(s+2)", 0.5 * (s + 1.0) / s / (s + 2.0)),
        ("-.5s/(s+2.)^3", -0.5 * s / (s + 2.0).powi(3)),
        ("1/s - 1/(s+1)", 1.0 / s - 1.0 / (s + 1.0)),
        ("2+1/s", 2.0 + 1.0 / s),
        ("1/s*(s+6)", (s + 6.0) / s),
        ("2exp(-0.1s)/s", 2.0 * delay / s),
        ("2e^(-s/10)/s", 2.0 * delay / s),
        ("exp(-0.05s)^2*2/s", 2.0 * delay / s),
        ("2e-1exp(-0.1s)/s", 0.2 * delay / s),
        ("(exp(-0.1s) + exp(-0.1s)s)/s^2", delay * (1.0 + s) / (s * s)),
        ("7", s * 0.0 + 7.0),
        ("0/(s+1)", s * 0.0),
    ] {
        assert!((read(text).response(1.7) - expected).norm() < 1e-14, "{text}");
    }
}

#[test]
fn display_text_round_trip() {
    for text in [
        "90/1,6,0",
        "1/s",
        "5/s^2",
        "-3.25/1,0.1,0,0",
        "1,-0.30000000000000004/1,1e-9,1e30",
        "0/1,2",
        "(2s+1)exp(-0.123s)/(s^2+0.4s+1)",
        "-exp(-0.1s)",
        "(s+1)/(s+2)",
        "1e-300/(s+1e-5)",
        "2.5",
        "(s^3 - s)/(s^4 + 1)",
    ] {
        let one = read(text);
        let shown = one.to_string();
        assert_eq!(read(&shown), one, "{text} shown as {shown}");
    }
    assert_eq!(
        read("(2s+1)exp(-0.1s)/(s(s+6))").to_string(),
        "(2s + 1)exp(-0.1s)/(s^2 + 6s)"
    );
    assert_eq!(read("-1/s^2").to_string(), "-1/s^2");
}

#[test]
fn errors_name_their_position() {
    for (text, expected) in [
        ("", "it is empty"),
        ("  ", "it is empty"),
        ("s", "higher degree"),
        ("(s^2+1)/(s+1)", "higher degree"),
        ("1,0,0/1", "higher degree"),
        (
            "s2/(s+1)^3",
            "at character 2 there is '2', expected '^' or '*' before a number",
        ),
        ("1/0", "divides by zero at character 3"),
        ("1/(s-s)", "divides by zero at character 3"),
        ("1/0,0", "the denominator must not be zero"),
        ("0^-1", "divides by zero"),
        (
            "90/(s(s+6)",
            "at character 11 there is the end, expected ')' for the '(' at character 4",
        ),
        ("90/(s(s+6)))", "at character 12 there is ')'"),
        ("90/s(s+6)", "at character 5 there is '('"),
        ("1/2s", "at character 4 there is 's'"),
        ("90/(z+1)", "at character 5 there is 'z'"),
        ("90/s^0.5", "at character 6 there is '0', expected a whole number"),
        ("90/s^", "at character 6 there is the end"),
        ("90/s^99", "a whole number up to 50"),
        ("90*/s", "at character 4 there is '/'"),
        ("90/", "at character 4 there is the end"),
        ("1.2.3/s", "at character 4 there is '.'"),
        ("1e999/s", "a finite number"),
        ("1e200*1e200/s", "range of floating point"),
        ("NaN", "at character 1 there is 'N'"),
        ("NaN/1,0", "at character 1 there is NaN"),
        ("1/1,x,0", "at character 5 there is x"),
        ("1/1,,0", "at character 5 there is nothing"),
        ("1,2", "no '/'"),
        ("1/2/3,4", "at character 3 there is 2/3"),
        ("exp(-0.1)/s", "exp(-0.1s)"),
        ("exp(0.1s)/s", "delay is -0.1 s"),
        ("1/exp(-0.1s)", "delay is -0.1 s"),
        ("1/s+exp(-s)/s", "one delay"),
        ("e/s", "exp(-0.1s)"),
        ("(s^50)^50", "a degree of at most 50"),
        ("90 % s", "at character 4 there is '%'"),
    ] {
        let message = reason(text);
        assert!(message.contains(expected), "{text}: {message}");
    }
    assert!(reason("90/(s").contains("90/(s(s+6))"));
    assert!(reason(&"(".repeat(100_000)).contains("more than 50 parentheses"));
    assert!(reason(&"-".repeat(100_000)).contains("there is the end"));
}
