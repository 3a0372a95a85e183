//! The whole page, made from simulated runs.
#![allow(clippy::unwrap_used)]

use hoid_ident::{
    Choice, Estimator, Fit, MarginEstimates, OrderRanges, choose_orders,
    frequency::{Averaging, DescribingOptions, Excitation, describe},
    order_selection::Criterion,
};
use hoid_model::{
    Channel, OperatorParameters, Orders, Record, SampleTime, Structure,
    forcing::{ForcingFunction, REFERENCE_PERIOD_S},
    remnant::RemnantDiscretisation,
    scenario::{Condition, Scenario},
    uncertainty::Estimate,
};
use hoid_report::{ModelSection, Report, ReportError, figures};
use hoid_sim::{RunSeed, Simulator};

fn runs(n: u64) -> Vec<Record> {
    let simulator = Simulator::new(&Scenario::condition(Condition::C1)).unwrap();
    let run = |replication| {
        let run_seed = RunSeed {
            seed: 5,
            replication,
            ..RunSeed::default()
        };
        simulator
            .run(run_seed, false)
            .unwrap()
            .labelled(format!("run {replication}"))
    };
    (0..n).map(run).collect()
}

fn fit_records(structure: Structure, records: &[Record]) -> Fit {
    Estimator::new(structure, structure.operator_orders(29))
        .fit(records)
        .unwrap()
}

fn truth() -> OperatorParameters {
    Scenario::condition(Condition::C1).initial.operator
}

fn section<'a>(name: &str, fit: &'a Fit, records: &'a [Record]) -> ModelSection<'a> {
    ModelSection {
        name: name.to_owned(),
        fit,
        records,
        candidates: None,
        truth: None,
        margins: None,
    }
}

fn page<'a>(models: Vec<ModelSection<'a>>) -> String {
    let report = Report {
        title: "Title".to_owned(),
        settings: vec![("seed".to_owned(), "5".to_owned())],
        models,
        notes: Vec::new(),
        fit_summary: None,
        pictures: Vec::new(),
    };
    report.to_html().unwrap()
}

/// Returns the text after the first `<h2 id=...>` with this name, up to the next section.
fn section_of<'a>(html: &'a str, name: &str) -> &'a str {
    let start = html.find(&format!("\">{name}</h2>")).unwrap();
    let end = html[start..].find("</section>").unwrap();
    &html[start..start + end]
}

/// Checks the properties of every page: no external resources, no NaN, unique ids, valid references.
fn check_page(html: &str) {
    let without_namespace = html.replace("xmlns=\"http://www.w3.org/2000/svg\"", "");
    for outside in ["http", "src=", "<link", "<script", "@import", "url(\"", "//cdn"] {
        assert!(!without_namespace.contains(outside), "{outside}");
    }
    for bad in ["NaN", "nan,", ">inf", ">-inf", "undefined", "none</td>"] {
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

#[test]
fn report_with_two_models_and_truth_is_complete() {
    let records = runs(1);
    let (arx, bj) = (
        fit_records(Structure::Arx, &records),
        fit_records(Structure::BoxJenkins, &records),
    );
    let mut models = vec![section("ARX", &arx, &records), section("BJ", &bj, &records)];
    for model in &mut models {
        model.truth = Some(truth());
    }
    let html = page(models);
    check_page(&html);
    // There are two time responses, two tests for each record, and one Bode diagram.
    assert_eq!(html.matches("<svg ").count(), 7);
    let reason = arx.operator().unwrap_err().to_string();
    assert!(html.contains(&format!("ARX: not convertible: {reason}")));
    assert!(section_of(&html, "ARX").contains(&format!("not convertible: {reason}")));

    let bj_text = section_of(&html, "BJ");
    let estimate = bj.operator().unwrap();
    for (_, _, e) in estimate.rows() {
        let (value, error) = hoid_report::numbers::with_uncertainty(e.value, e.standard_error);
        assert!(bj_text.contains(&format!("<td class=\"n\">{value}</td><td class=\"n\">{error}</td>")));
    }
    for (name, e) in bj.parameters() {
        let (value, _) = hoid_report::numbers::with_uncertainty(e.value, e.standard_error);
        let symbol = format!("<i>{}</i><sub>{}</sub>", &name[..1], &name[1..]);
        assert!(
            bj_text.contains(&format!("<th>{symbol}</th><td class=\"n\">{value}</td>")),
            "{name}"
        );
    }
    let t_n = bj.remnant(RemnantDiscretisation::ZeroOrderHold).unwrap().t_n_s;
    let (value, error) = hoid_report::numbers::with_uncertainty(t_n.value, t_n.standard_error);
    assert!(bj_text.contains(&format!("{value} \u{b1} {error}")));
    for text in [bj.termination().reason.to_string(), bj.start().replace('/', "&#x2f;")] {
        assert!(bj_text.contains(&text), "{text}");
    }
    let divisor = bj.residual_count() - 5 - bj.state_count();
    assert!(bj_text.contains(&format!(" = {divisor} (residuals, parameters, initial states)")));
    assert!(html.contains("<td class=\"n\">11.25</td>"), "the true omega_nm");
    assert!(html.contains("no mean is removed") && html.contains("the mean is removed"));
}

#[test]
fn report_is_reproducible() {
    let records = runs(1);
    let fit = fit_records(Structure::BoxJenkins, &records);
    let make = || page(vec![section("BJ", &fit, &records)]);
    assert!(make() == make());
}

#[test]
fn user_text_is_escaped() {
    let hostile = "a<script>alert(1)</script> & \"b\" $x^2$";
    let records: Vec<Record> = runs(2).into_iter().map(|r| r.labelled(hostile)).collect();
    let ts = SampleTime::AT_100_HZ;
    let renamed = Record::new(
        ts,
        Channel::new("e<0>", "<deg>", records[0].input().to_vec()),
        Channel::new("u&$v$", "<b>", records[0].output().to_vec()),
    )
    .unwrap()
    .labelled(hostile);
    let records = [renamed, records[1].clone()];
    let fit = fit_records(Structure::BoxJenkins, &records);
    let report = Report {
        title: hostile.to_owned(),
        settings: vec![(hostile.to_owned(), hostile.to_owned())],
        models: vec![section(hostile, &fit, &records)],
        notes: vec![hostile.to_owned()],
        fit_summary: None,
        pictures: Vec::new(),
    };
    let html = report.to_html().unwrap();
    check_page(&html);
    assert!(!html.contains("<b>") && !html.contains("<deg>"));
    // The name occurs twice in the title, and in the setting, note, heading, column, legend, record table and captions.
    assert!(html.matches("a&lt;script&gt;alert(1)&lt;").count() >= 10);
    assert!(html.contains("$x^2$") && html.contains("u&amp;$v$ (&lt;b&gt;)"));
}

#[test]
fn all_records_are_listed_and_at_most_four_drawn() {
    let records = runs(6);
    let fit = fit_records(Structure::BoxJenkins, &records);
    let html = page(vec![section("BJ", &fit, &records)]);
    check_page(&html);
    for k in 0..6 {
        assert!(html.contains(&format!("<th>run {k}</th><td class=\"n\">8192</td>")));
    }
    assert!(html.contains("2 more records are not drawn"));
    assert!(html.contains("all records of a model together"));
    // There are four time responses, two tests, and one Bode diagram.
    assert_eq!(html.matches("<svg ").count(), 7);
    let together = fit.quality(&records).unwrap().vaf_simulation;
    assert!(html.contains(&format!("<td class=\"n\">{together:.2}</td>")));
}

#[test]
fn series_shorter_than_the_lags_has_figures() {
    let long = runs(1).remove(0);
    let cut = |n: usize| {
        let part = |v: &[f64]| v[..n].to_vec();
        Record::new(
            long.sample_time(),
            Channel::new("e", "deg", part(long.input())),
            Channel::new("u", "deg", part(long.output())),
        )
        .unwrap()
    };
    let orders = Orders {
        na: 1,
        nb: 1,
        nk: 1,
        ..Orders::default()
    };
    let records = [cut(12)];
    let fit = Estimator::new(Structure::Arx, orders).fit(&records).unwrap();
    let lags = fit.validate(&records[0]).unwrap().autocorrelation.lags.len();
    assert!(lags < 15);
    let html = page(vec![section("ARX", &fit, &records)]);
    check_page(&html);
    assert!(html.contains(&format!(" of {lags} lags outside")));

    // If a record cannot be compared with the model, the page shows the reason; a record without a name is shown by its
    // number.
    let other = [cut(12), cut(1)];
    let html = page(vec![section("ARX", &fit, &other)]);
    check_page(&html);
    let reason = fit.validate(&other[1]).unwrap_err().to_string();
    assert!(html.contains(&reason), "{reason}");
    assert!(html.contains("<th>record 2</th>"));
    let html = page(vec![section("ARX", &fit, &other[1..])]);
    check_page(&html);
    assert!(html.contains("no figures: "));
    let html = page(vec![section("ARX", &fit, &[])]);
    check_page(&html);
    assert!(html.contains("no record was given"));
}

#[test]
fn exact_fit_explains_missing_standard_errors() {
    let e: Vec<f64> = (0..300)
        .map(|k| (0.7 * f64::from(k)).sin() + (0.31 * f64::from(k * k)).cos())
        .collect();
    let mut u = vec![0.0; 300];
    for t in 2..300 {
        u[t] = 0.5 * u[t - 1] + 0.3 * e[t - 1] + 0.1 * e[t - 2];
    }
    let record = Record::new(
        SampleTime::AT_100_HZ,
        Channel::new("e", "", e),
        Channel::new("u", "", u),
    )
    .unwrap();
    let orders = Orders {
        nb: 2,
        nf: 1,
        nd: 0,
        nk: 1,
        ..Orders::default()
    };
    let records = [record];
    let fit = Estimator::new(Structure::BoxJenkins, orders).fit(&records).unwrap();
    assert!(fit.covariance().is_none());
    let html = page(vec![section("exact", &fit, &records)]);
    check_page(&html);
    assert!(html.contains("residuals are zero up to rounding and carry no information about the noise"));
}

#[test]
fn candidates_are_sorted_and_truncated() {
    let records = runs(1);
    let bj = Structure::BoxJenkins;
    let mut ranges = OrderRanges::from(bj.operator_orders(29));
    ranges.nk = 12..=44;
    let template = Estimator::new(bj, bj.operator_orders(29));
    let choice: Choice = choose_orders(&template, &ranges, Criterion::Bic, &records).unwrap();
    let mut model = section("BJ", &choice.fit, &records);
    model.candidates = Some(&choice);
    model.margins = Some(MarginEstimates {
        crossover_rad_s: Some(Estimate::with_variance(1.5637, 1e-4)),
        phase_margin_deg: Some(Estimate::fixed(76.67)),
        phase_crossover_rad_s: None,
        gain_margin_db: None,
    });
    let html = page(vec![model]);
    check_page(&html);
    let table = &html[html.find("Candidates</summary>").unwrap()..];
    assert_eq!(table.matches("<tr><th>nb=2").count(), 30);
    assert!(table.contains("33 candidates") && table.contains("3 more candidates are not shown"));
    let first = &table[table.find("<tr><th>nb=2").unwrap()..];
    assert!(first.starts_with(&format!("<tr><th>{}</th>", choice.fit.orders())));
    assert!(html.contains("<td class=\"n\">76.67</td>"));
    assert!(html.contains("1.564 (standard error 0.010)"));
    assert!(html.contains("the phase does not cross -180 deg in the range scanned"));
}

#[test]
fn a_report_without_models_is_an_error() {
    let report = Report {
        title: String::new(),
        settings: Vec::new(),
        models: Vec::new(),
        notes: Vec::new(),
        fit_summary: None,
        pictures: Vec::new(),
    };
    assert!(matches!(report.to_html(), Err(ReportError::NoModels)));
}

#[test]
fn figures_are_reproducible_and_bounded_if_unstable() {
    let records = runs(1);
    let fit = fit_records(Structure::BoxJenkins, &records);
    let mut validation = fit.validate(&records[0]).unwrap();
    let stable = figures::time_response("a", &records[0], &validation);
    assert!(stable == figures::time_response("a", &records[0], &validation));
    assert!(stable.contains("u (deg)") && stable.contains("time (s)"));
    // Peaks are preserved, but the figure is small: two panels, each with 3 lines of at most 682 points.
    assert!(stable.len() < 90_000, "{}", stable.len());
    for (k, v) in validation.simulated.iter_mut().enumerate() {
        *v = 1.2_f64.powi(k as i32);
    }
    let unstable = figures::time_response("a", &records[0], &validation);
    let largest = unstable
        .split(|c: char| !(c.is_ascii_digit() || c == '.'))
        .filter_map(|n| n.parse::<f64>().ok())
        .fold(0.0, f64::max);
    // 999999 occurs as a colour.
    assert!(largest < 1e6 && !unstable.contains("inf"), "{largest}");
}

#[test]
fn bode_has_bands_and_a_dashed_truth() {
    let records = runs(1);
    let (arx, bj) = (
        fit_records(Structure::Arx, &records),
        fit_records(Structure::BoxJenkins, &records),
    );
    let model = |name, fit| figures::BodeModel {
        name,
        fit,
        records: &records,
    };
    let truth = figures::TrueResponse {
        operator: truth(),
        sample_time: SampleTime::AT_100_HZ,
    };
    let svg = figures::bode("b", &[model("first", &arx), model("second", &bj)], &[truth]);
    // Each of the two panels has one band per model.
    assert_eq!(svg.matches("fill-opacity=\"0.22\"").count(), 4, "bands");
    assert_eq!(
        svg.matches("stroke-dasharray").count(),
        3,
        "two curves and one legend entry"
    );
    for text in [
        ">first<",
        ">second<",
        ">true operator<",
        "magnitude (dB)",
        "phase (deg)",
        "(rad/s)",
    ] {
        assert!(svg.contains(text), "{text}");
    }
    let without = figures::bode("b", &[model("first", &arx)], &[]);
    assert!(!without.contains("stroke-dasharray") && !without.contains("true operator"));
}

#[test]
fn describing_function_is_drawn_over_the_models() {
    let records = runs(5);
    let fit = fit_records(Structure::BoxJenkins, &records);
    let model = figures::BodeModel {
        name: "BJ",
        fit: &fit,
        records: &records,
    };
    let truth = figures::TrueResponse {
        operator: truth(),
        sample_time: SampleTime::AT_100_HZ,
    };
    let forcing = ForcingFunction::reference();
    let excitation = Excitation::from_forcing_function(&forcing, REFERENCE_PERIOD_S).unwrap();
    let options = DescribingOptions {
        averaging: Averaging::SameExcitation,
        ..DescribingOptions::default()
    };
    let h = describe(&records, &excitation, &options).unwrap();
    let points = figures::BodePoints::of_describing_function("describing function", &h);
    let svg = figures::bode_with_points("b", &[model], &[truth], std::slice::from_ref(&points));
    // There are ten points in each of two panels, and one in the legend.
    assert_eq!(svg.matches("<circle").count(), 21);
    assert!(svg.contains(">describing function<") && !svg.contains("NaN"));
    let without = figures::bode_with_points("b", &[model], &[truth], &[]);
    assert_eq!(without, figures::bode("b", &[model], &[truth]));

    let mut hostile = points.clone();
    hostile.magnitude_db[0].value = f64::NEG_INFINITY;
    hostile.omega_rad_s[1] = f64::NAN;
    hostile.phase_deg[2].standard_error = Some(f64::INFINITY);
    for models in [&[model][..], &[]] {
        let svg = figures::bode_with_points("b", models, &[], std::slice::from_ref(&hostile));
        assert!(svg.ends_with("</svg>") && !svg.contains("NaN") && !svg.contains("inf"));
        assert_eq!(svg.matches("<circle").count(), 2 * 8 + 1);
    }
    if let Some(directory) = std::env::var_os("HOID_FIGURES") {
        std::fs::write(std::path::Path::new(&directory).join("bode_points.svg"), svg).unwrap();
    }
}
