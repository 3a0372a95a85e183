//! Invalid plans are rejected before anything runs, with file, line and remedy.
#![allow(clippy::unwrap_used)]

use hoid_study::{Plan, plan_schema};

const GOOD_PLAN: &str = "name = \"x\"
replications = 10

[[scenarios]]
condition = \"C1\"
remnant.order = [1, 2]
remnant.noise_level = 0.1

[[estimators]]
name = \"BJ\"
method = \"fit\"
structure = \"bj\"
orders.nk = 29

[[estimators]]
name = \"RLS\"
method = \"rls\"
memory = 256
";

#[test]
fn bad_plans_name_line_and_remedy() {
    assert!(Plan::parse(GOOD_PLAN, "good.toml").is_ok());
    let cases = [
        // (text to replace, replacement, line, words of the message)
        ("name = \"x\"", "nam = \"x\"", 1, vec!["unknown field", "nam"]),
        ("name = \"x\"", "name = \"a/b\"", 1, vec!["a/b", "letters"]),
        (
            "replications = 10",
            "replications = 0",
            2,
            vec!["replications is 0", "expected 1"],
        ),
        ("replications = 10", "replications = \"many\"", 2, vec!["many"]),
        (
            "remnant.order = [1, 2]",
            "remnant.order = []",
            6,
            vec!["empty list", "leave the key out"],
        ),
        (
            "remnant.order = [1, 2]",
            "remnant.order = [1, 5]",
            6,
            vec!["remnant.order is 5", "1, 2, 3 or 4"],
        ),
        (
            "remnant.noise_level = 0.1",
            "remnant.noise_levl = 0.1",
            7,
            vec!["unknown field", "noise_level"],
        ),
        (
            "remnant.noise_level = 0.1",
            "remnant.noise_level = 0.99\nremnant.noise_definition = \"remnant\"",
            7,
            vec!["cannot be reached", "largest reachable"],
        ),
        ("condition = \"C1\"", "condition = \"C9\"", 5, vec!["C9", "C1, C2"]),
        ("memory = 256", "memory = 0", 18, vec!["memory", "more than 1 sample"]),
        (
            "memory = 256",
            "memory = [256, 0]",
            18,
            vec!["memory", "more than 1 sample"],
        ),
        ("memory = 256", "lambda = 1.5", 18, vec!["lambda is 1.5", "up to 1"]),
        ("memory = 256", "memory = 256\nlambda = 0.9", 19, vec!["both given"]),
        ("memory = 256", "window = \"20s\"", 18, vec!["window", "no effect"]),
        (
            "memory = 256",
            "memory_of = { f = \"inf\" }",
            18,
            vec!["no parameter f", "a1"],
        ),
        (
            "memory = 256",
            "scenarios = [\"C2\"]",
            18,
            vec!["no scenario is called C2", "C1"],
        ),
        ("orders.nk = 29", "orders = { nk = 29, na = 2 }", 13, vec!["na"]),
        (
            "orders.nk = 29",
            "orders = { nk = -1 }",
            13,
            vec!["whole number of 0 or more"],
        ),
        (
            "orders.nk = 29",
            "orders.nk = 29\nversus = \"RLS\"",
            14,
            vec!["versus is RLS", "above this one"],
        ),
        (
            "orders.nk = 29",
            "orders.nk = 29\nspan_s = [50.0, 20.0]",
            14,
            vec!["span_s", "start before the end"],
        ),
        (
            "orders.nk = 29",
            "orders.nk = 29\nspan_s = [0.0, 200.0]",
            14,
            vec!["extends beyond the record", "81.92"],
        ),
        ("orders.nk = 29", "start = { f3 = 1.0 }", 13, vec!["start has f3", "f2"]),
        ("structure = \"bj\"\n", "", 10, vec!["structure is missing"]),
        ("name = \"RLS\"", "name = \"BJ\"", 16, vec!["two estimators", "rename"]),
        ("[[scenarios]]", "[[scenarios]\n", 4, vec![]),
    ];
    for (from, to, line, words) in cases {
        let text = GOOD_PLAN.replacen(from, to, 1);
        assert_ne!(text, GOOD_PLAN, "{from}");
        let message = Plan::parse(&text, "bad.toml").expect_err(to).to_string();
        assert!(
            message.starts_with(&format!("plan bad.toml, line {line}:")),
            "{to}: {message}"
        );
        for word in words {
            assert!(message.contains(word), "{to}: {message}");
        }
    }
}

/// The options of estimators that run as in `hoid identify` are those of the registry, and are checked before anything
/// runs.
#[test]
fn options_of_an_operator_are_checked() {
    let of = |text: &str| {
        let text = GOOD_PLAN.replace("method = \"rls\"\nmemory = 256", text);
        Plan::parse(&text, "bad.toml")
    };
    for text in [
        "method = \"operator\"",
        "method = \"family\"\nform = [\"auto\", \"lead\"]\nprior = \"population\"\norders.nd = \"0..4\"",
        "method = \"operator\"\nneuromuscular = \"no\"\nrun_to_run = 0.1\nperiod_s = 81.92\ntolerance = 1e-6",
        "method = \"time-varying\"\nfix = { zeta_nm = 0.3 }\nbound = { T_L1 = \"0..2\" }\ndelay_range_s = [0.1, 0.4]",
        "method = \"iv4\"\ninstruments = \"simulated\"\nmax_iterations = 9",
    ] {
        of(text).unwrap_or_else(|error| panic!("{text}: {error}"));
    }
    let change = |text: &str| of(text).unwrap().estimators.pop().unwrap().task;
    assert_eq!(
        change("method = \"time-varying\""),
        change("method = \"operator\"\nchange = \"sigmoid\"")
    );
    for (text, line, words) in [
        (
            "method = \"operator\"\nform = \"lid\"",
            18,
            "form is lid, expected one of gain, lead",
        ),
        ("method = \"operator\"\nmemory = 256", 18, "memory has no effect here"),
        (
            "method = \"operator\"\nstructure = \"bj\"",
            18,
            "structure has no effect here",
        ),
        ("method = \"operator\"\norders.nf = 2", 18, "expected nc or nd"),
        ("method = \"operator\"\norders.nd = 65", 18, "within 0..64"),
        ("method = \"operator\"\norders.nd = \"4..1\"", 18, "as \"0..8\""),
        ("method = \"operator\"\nprior = \"fit.json\"", 18, "is a file"),
        ("method = \"operator\"\nprior = \"omega:2\"", 18, "NAME=CENTRE:SPREAD"),
        ("method = \"operator\"\ndelay_s = [0.5, 0.1]", 18, "LO..HI"),
        (
            "method = \"time-varying\"\nchange = \"none\"",
            18,
            "leave one of them out",
        ),
        (
            "method = \"time-varying\"\norders.nd = \"1..2\"",
            18,
            "a single number nd",
        ),
        (
            "method = \"time-varying\"\nfix = { zeta = 0.3 }",
            18,
            "names the parameter zeta, expected one of K_e1",
        ),
        (
            "method = \"sriv\"\nform = \"lead\"",
            18,
            "form has no effect here: it applies to operator",
        ),
        (
            "method = \"fit\"\nstructure = \"bj\"\norders.nd = \"1..2\"",
            19,
            "which only operator accepts: give single numbers",
        ),
    ] {
        let message = of(text).expect_err(text).to_string();
        assert!(
            message.starts_with(&format!("plan bad.toml, line {line}:")),
            "{message}"
        );
        assert!(message.contains(words), "{text}: {message}");
    }
}

#[test]
fn missing_scenarios_or_estimators_are_errors() {
    for key in ["scenarios", "estimators"] {
        let text = GOOD_PLAN.replace(&format!("[[{key}]]"), "[[other]]");
        let message = Plan::parse(&text, "bad.toml").unwrap_err().to_string();
        assert!(message.contains(&format!("[[{key}]]")), "{message}");
    }
    let unused = format!("{GOOD_PLAN}\n[[scenarios]]\nname = \"idle\"\ncondition = \"C2\"\n")
        .replace("method = \"fit\"", "method = \"fit\"\nscenarios = [\"C1\"]");
    let unused = unused.replace("method = \"rls\"", "method = \"rls\"\nscenarios = [\"C1\"]");
    let message = Plan::parse(&unused, "bad.toml").unwrap_err().to_string();
    assert!(message.contains("no estimator uses the scenario idle"), "{message}");
}

#[test]
fn cells_follow_file_order() {
    let plan = Plan::parse(
        &GOOD_PLAN.replace("noise_level = 0.1", "noise_level = [0.0, 0.2]"),
        "good.toml",
    )
    .unwrap();
    let axes: Vec<String> = plan
        .cells
        .iter()
        .map(|c| c.axes.iter().map(|a| a.value.clone()).collect::<Vec<_>>().join("/"))
        .collect();
    assert_eq!(axes, ["1/0.0", "1/0.2", "2/0.0", "2/0.2"]);
    // Without remnant all replications are the same, so only one is run.
    let replications: Vec<u64> = plan.cells.iter().map(|c| c.replications).collect();
    assert_eq!(replications, [1, 10, 1, 10]);
    assert_eq!(plan.estimate_count(), 2 * 22);
    assert_ne!(plan.hash(), plan.clone().with_replications(11).unwrap().hash());
}

/// A plan with the earlier name of a method is equivalent to a plan with the current name.
#[test]
fn former_method_name_is_accepted() {
    let by = |method: &str| {
        let text = GOOD_PLAN.replace("method = \"rls\"\nmemory = 256", &format!("method = \"{method}\""));
        Plan::parse(&text, "good.toml").unwrap().estimators
    };
    assert_eq!(by("population"), by("adaptive"));
    assert_ne!(by("population"), by("multiple-model"));
}

/// The published schema equals that of the program.
#[test]
fn documented_schema_is_current() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/src/reference/plan.schema.json");
    let schema = plan_schema();
    if std::env::var_os("HOID_UPDATE_DOCS").is_some() {
        std::fs::write(path, &schema).unwrap();
    }
    let book = std::fs::read_to_string(path).unwrap_or_default();
    assert!(
        book == schema,
        "run HOID_UPDATE_DOCS=1 cargo test -p hoid-study to renew the schema"
    );
    for key in ["noise_level", "scenarios", "estimators", "memory_of", "T_n_s"] {
        assert!(schema.contains(&format!("\"{key}\"")), "{key}");
    }
}
