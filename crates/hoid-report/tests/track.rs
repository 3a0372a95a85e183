//! The page about recursive estimates, made from simulated runs.
#![allow(clippy::unwrap_used)]

use hoid_ident::{Estimator, Fit};
use hoid_model::{
    Channel, Orders, Record, Structure,
    scenario::{Condition, Scenario},
};
use hoid_report::{BatchLine, ReportError, TraceSection, TrackReport, batch_fit};
use hoid_sim::{RunSeed, Simulator};
use hoid_track::{Method, StartSource, Trace, TrackOptions, track};

const SPANS: [(f64, f64); 2] = [(0.0, 30.72), (51.20, 81.92)];

fn run() -> Record {
    let simulator = Simulator::new(&Scenario::condition(Condition::C4)).unwrap();
    let run_seed = RunSeed {
        seed: 5,
        ..RunSeed::default()
    };
    simulator.run(run_seed, false).unwrap()
}

fn options(method: Method) -> TrackOptions {
    let structure = method.default_structure();
    let mut options = TrackOptions::new(method.clone(), structure, structure.operator_orders(29));
    options.start = StartSource::Span(Some(SPANS[0]));
    options
}

fn track_record(method: Method, record: &Record) -> Trace {
    track(record, &options(method), 4).unwrap()
}

fn fits(structure: Structure, record: &Record) -> Vec<Fit> {
    let estimator = Estimator::new(structure, structure.operator_orders(29));
    let fit = |(from, to)| estimator.fit(&[record.span(from, to).unwrap()]).unwrap();
    SPANS.into_iter().map(fit).collect()
}

fn section<'a>(name: &str, trace: &'a Trace, fits: &'a [Fit]) -> TraceSection<'a> {
    let line = |((from_s, to_s), fit)| BatchLine { from_s, to_s, fit };
    TraceSection {
        name: name.to_owned(),
        trace,
        batch: SPANS.into_iter().zip(fits).map(line).collect(),
    }
}

fn report<'a>(record: &'a Record, traces: Vec<TraceSection<'a>>) -> TrackReport<'a> {
    TrackReport {
        title: "Title".to_owned(),
        settings: vec![("seed".to_owned(), "5".to_owned())],
        record,
        traces,
        verdict: None,
        notes: vec!["a note".to_owned()],
    }
}

/// Checks the properties of every page: no external resources, no NaN, unique ids, valid references.
fn check_page(html: &str) {
    let without_namespace = html.replace("xmlns=\"http://www.w3.org/2000/svg\"", "");
    for outside in ["http", "src=", "<link", "<script", "@import", "url(\"", "//cdn"] {
        assert!(!without_namespace.contains(outside), "{outside}");
    }
    for bad in [
        "NaN",
        "nan,",
        ">inf",
        ">-inf",
        "undefined",
        "none</td>",
        "\u{e000}",
        "\u{e001}",
        "\u{e002}",
    ] {
        assert!(!html.contains(bad), "{bad} in the page");
    }
    let mut ids: Vec<&str> = html
        .split(" id=\"")
        .skip(1)
        .filter_map(|s| s.split('"').next())
        .collect();
    let count = ids.len();
    for reference in html.split("url(#").skip(1).filter_map(|s| s.split(')').next()) {
        assert!(ids.contains(&reference), "{reference} does not exist");
    }
    ids.sort_unstable();
    ids.dedup();
    assert_eq!(ids.len(), count, "two equal ids");
}

/// Returns a figure of the page by the id of its title.
fn figure<'a>(html: &'a str, id: &str) -> &'a str {
    let at = html.find(&format!("aria-labelledby=\"{id}-title\"")).unwrap();
    let start = html[..at].rfind("<svg ").unwrap();
    &html[start..start + html[start..].find("</svg>").unwrap()]
}

#[test]
fn report_with_three_methods_is_complete() {
    let record = run();
    let (arx, bj) = (fits(Structure::Arx, &record), fits(Structure::BoxJenkins, &record));
    let traces = [Method::rls(), Method::rpem(), hoid_survey::physical()].map(|m| track_record(m, &record));
    let sections = vec![
        section("RLS", &traces[0], &arx),
        section("RPEM", &traces[1], &bj),
        section("physical", &traces[2], &[]),
    ];
    let page = report(&record, sections);
    let html = page.to_html().unwrap();
    check_page(&html);
    assert_eq!(html, page.to_html().unwrap());
    assert!(html.len() < 1_200_000, "{}", html.len());

    // The figures are operator, coefficients, innovations, standard errors and, if there are any, shortened steps.
    let shortened = traces.iter().any(|t| t.counts().shortened > 0);
    assert_eq!(html.matches("<svg ").count(), 4 + usize::from(shortened));
    assert_eq!(html.contains("No step had to be shortened"), !shortened);
    for (id, axes) in [("operator", 5), ("coefficients", 5), ("errors", 5), ("innovation", 3)] {
        let svg = figure(&html, id);
        assert_eq!(svg.matches("rotate(-90").count(), axes, "{id}");
        assert!(svg.contains("time (s)") && svg.contains(">physical<"), "{id}");
    }
    let operator = figure(&html, "operator");
    assert!(operator.contains(">truth<") && operator.contains(">batch fit<"));
    assert!(html.contains("Dashed: the truth") && html.contains("Coloured dots: batch fits"));
    assert!(html.contains("Shaded") && html.contains("Vertical dots"));
    assert!(
        figure(&html, "coefficients").contains(", f</tspan><tspan"),
        "a and f share a panel"
    );

    // Rows that cannot be converted are counted, with the reason.
    let unconvertible = (0..traces[0].len())
        .filter(|row| traces[0].operator(*row).is_err())
        .count();
    assert!(unconvertible > 100, "{unconvertible}");
    assert!(html.contains(&format!(
        "<td class=\"n\">{}</td><td class=\"n\">{unconvertible}</td><td>",
        traces[0].len()
    )));
    assert!(html.contains("lies on the closed negative real axis"));
    for trace in &traces {
        assert!(html.contains(&format!("<td class=\"n\">{}</td>", trace.counts().samples)));
    }
    // Relative error according to its definition.
    let k_e = record.channel("K_e").unwrap();
    let squares: Vec<f64> = (0..traces[2].len())
        .filter(|row| traces[2].times_s()[*row] >= 10.0)
        .map(|row| {
            let sample = (traces[2].times_s()[row] * 100.0).round() as usize;
            (traces[2].operator(row).unwrap().k_e.value / k_e[sample] - 1.0).powi(2)
        })
        .collect();
    let rms = 100.0 * (squares.iter().sum::<f64>() / squares.len() as f64).sqrt();
    let errors = &html[html.find("Relative error against the truth").unwrap()..];
    let row = &errors[errors.find("<sub>e</sub></th>").unwrap()..];
    assert!(row[..row.find("</tr>").unwrap()].ends_with(&format!("<td class=\"n\">{rms:.1}</td>")));

    // Each method has a section with the start fit and the ends of the batch spans.
    for name in ["RLS", "RPEM", "physical"] {
        assert!(html.contains(&format!("\">{name}</h2>")));
    }
    assert_eq!(html.matches("<h3>Start: ").count(), 3);
    assert_eq!(html.matches("recursive at 30.71 s").count(), 2);
    assert_eq!(html.matches("recursive at 81.91 s").count(), 2);
    let b0 = bj[1].parameters()[0].1;
    let (value, error) = hoid_report::numbers::with_uncertainty(b0.value, b0.standard_error);
    assert!(html.contains(&format!("<td class=\"n\">{value} \u{b1} {error}</td>")));
    assert!(
        html.contains("exponential forgetting, memory b0 b1 2.56 s (256 samples), d1 f1 f2 20.48 s (2048 samples)")
    );
}

#[test]
fn report_of_a_recording_shows_no_truth() {
    let simulated = run();
    let record = Record::new(
        simulated.sample_time(),
        Channel::new("e<0>", "<deg>", simulated.input().to_vec()),
        Channel::new("u", "<b>", simulated.output().to_vec()),
    )
    .unwrap();
    let trace = track_record(hoid_survey::physical(), &record);
    let hostile = "a<script>alert(1)</script> & \"b\" $x^2$";
    let html = report(&record, vec![section(hostile, &trace, &[])]).to_html().unwrap();
    check_page(&html);
    assert!(!html.contains("<b>") && !html.contains("<deg>"));
    assert!(!html.contains(">truth<") && !html.contains("Relative error"));
    assert!(!html.contains("Dashed") && !html.contains("dashes") && !html.contains("Coloured dots"));
    // Only the parameters of the operator are estimated, so their errors are shown.
    assert!(html.contains("Standard errors of the parameters of the operator"));
}

#[test]
fn start_without_estimate_and_shortened_steps_are_reported() {
    let record = run();
    let mut options = options(Method::rpem());
    options.start = StartSource::Nothing;
    options.method.set("covariance", "1e4").unwrap();
    let trace = track(&record, &options, 1).unwrap();
    assert!(trace.counts().shortened > 0);
    let html = report(&record, vec![section("RPEM", &trace, &[])]).to_html().unwrap();
    check_page(&html);
    assert!(html.contains("There was no start fit") && html.contains("from nothing"));
    assert!(!html.contains("Shaded") && !html.contains("Vertical"));
    assert!(figure(&html, "shortened").contains(">steps"));
    assert!(html.contains(&format!("<td class=\"n\">{}</td>", trace.counts().shortened)));
}

#[test]
fn non_operator_orders_show_only_coefficients() {
    let record = run();
    let orders = Orders {
        na: 1,
        nb: 1,
        nk: 29,
        ..Orders::default()
    };
    let mut options = TrackOptions::new(Method::rls(), Structure::Arx, orders);
    options.start = StartSource::Span(Some(SPANS[0]));
    let trace = track(&record, &options, 1).unwrap();
    let html = report(&record, vec![section("small", &trace, &[])]).to_html().unwrap();
    check_page(&html);
    assert!(html.contains("8192 from 0.00 s on: the operator model needs two coefficients in B and two poles"));
    assert!(html.contains("(small: 7192 of 7192)"));
    assert!(figure(&html, "coefficients").contains("b<tspan"));
}

#[test]
fn short_records_and_averages_are_reported() {
    let long = run();
    let record = long.span(0.0, 8.0).unwrap();
    let mut options = options(Method::rls());
    options.start = StartSource::Span(None);
    let trace = track(&record, &options, 1).unwrap().moving_average(101);
    let fit = Estimator::new(Structure::Arx, Structure::Arx.operator_orders(29))
        .fit(&[record.span(4.0, 8.0).unwrap()])
        .unwrap();
    let mut late = section("RLS", &trace, &[]);
    late.batch = [(4.0, 8.0), (-3.0, -1.0)]
        .map(|(from_s, to_s)| BatchLine {
            from_s,
            to_s,
            fit: &fit,
        })
        .to_vec();
    let html = report(&record, vec![late]).to_html().unwrap();
    check_page(&html);
    // In a record shorter than 10 s, errors are computed over the whole record.
    assert!(html.contains("with <i>t</i> &ge; 0 s"));
    assert!(html.contains("101 rows, delayed by 0.5 s"));
    assert!(html.contains("nothing at the end of [-3, -1] s: the trace starts later"));
    // A trace with a single row.
    let one = track(&record, &options, 800).unwrap();
    assert_eq!(one.len(), 1);
    check_page(&report(&record, vec![section("one", &one, &[])]).to_html().unwrap());
}

#[test]
fn tracked_delay_is_shown() {
    let record = run();
    let mut with_delay = options(hoid_survey::physical());
    with_delay.method.set("track_delay", "0.2..0.4").unwrap();
    let trace = track(&record, &with_delay, 8).unwrap();
    let html = report(&record, vec![section("physical", &trace, &[])])
        .to_html()
        .unwrap();
    check_page(&html);
    assert_eq!(figure(&html, "operator").matches("rotate(-90").count(), 6);
    assert!(html.contains("tau_e tracked from 0.2 to 0.4 s"));
}

#[test]
fn batch_fit_has_the_delay_of_its_span() {
    let mut scenario = Scenario::condition(Condition::C4);
    scenario.last.operator.tau_e_s = 0.34;
    let record = Simulator::new(&scenario)
        .unwrap()
        .run(RunSeed::default(), false)
        .unwrap();
    let mut with_delay = options(hoid_survey::multiple_model());
    with_delay.orders = hoid_survey::multiple_model().default_orders(29);
    with_delay.method.set("track_delay", "0.2..0.4").unwrap();
    let trace = track(&record, &with_delay, 8).unwrap();
    let (_, fit) = batch_fit(&trace, &record, SPANS[1]).unwrap();
    assert!((34..=36).contains(&fit.orders().nk), "{}", fit.orders());
    // The trace has no row in this span, so the delay of the start applies.
    assert_eq!(batch_fit(&trace, &record, SPANS[0]).unwrap().1.orders().nk, 29);
}

#[test]
fn window_and_instrument_methods_are_reported() {
    let record = run();
    let mut window = options(hoid_survey::window());
    window.method.set("refit", "500").unwrap();
    let traces = [
        track(&record, &window, 8).unwrap(),
        track_record(hoid_survey::rriv(), &record),
    ];
    let sections = vec![section("window", &traces[0], &[]), section("RRIV", &traces[1], &[])];
    let html = report(&record, sections).to_html().unwrap();
    check_page(&html);
    assert!(html.contains("window of 20s, a fit every 500 samples"));
    assert_eq!(figure(&html, "innovation").matches("rotate(-90").count(), 2);
}

#[test]
fn no_trace_or_too_many_traces_are_errors() {
    let record = run();
    assert!(matches!(
        report(&record, Vec::new()).to_html(),
        Err(ReportError::NoTraces { maximum: 4 })
    ));
    let mut options = options(Method::rls());
    options.start = StartSource::Nothing;
    let trace = track(&record, &options, 100).unwrap();
    let five = (0..5).map(|_| section("RLS", &trace, &[])).collect();
    let error = report(&record, five).to_html().unwrap_err();
    assert!(matches!(error, ReportError::TooManyTraces { found: 5, maximum: 4 }));
    assert_eq!(
        error.to_string(),
        "the report has 5 traces, expected at most 4: write a second report for the others"
    );
}
