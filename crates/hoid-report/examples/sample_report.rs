//! Simulates two runs of condition C1, fits ARX and Box-Jenkins models, and writes the report:
//! `cargo run -p hoid-report --example sample_report -- report.html`.

use std::error::Error;

use hoid_ident::{Estimator, OrderRanges, choose_orders, order_selection::Criterion};
use hoid_model::{
    Structure,
    margins::{MANUAL_CONTROL_RANGE_RAD_S, margins},
    scenario::{Condition, Scenario},
};
use hoid_report::{ModelSection, Report};
use hoid_sim::{RunSeed, Simulator};

fn main() -> Result<(), Box<dyn Error>> {
    let path = std::env::args()
        .nth(1)
        .ok_or("give the file to write, such as report.html")?;
    let scenario = Scenario::condition(Condition::C1);
    let simulator = Simulator::new(&scenario)?;
    let mut records = Vec::new();
    for replication in 0..2 {
        let run_seed = RunSeed {
            seed: 1,
            replication,
            ..RunSeed::default()
        };
        let record = simulator.run(run_seed, false)?;
        records.push(record.labelled(format!("C1, run {}", replication + 1)));
    }

    let arx = Estimator::new(Structure::Arx, Structure::Arx.operator_orders(29)).fit(&records)?;
    let bj = Structure::BoxJenkins;
    let mut ranges = OrderRanges::from(bj.operator_orders(29));
    ranges.nk = 25..=33;
    ranges.nd = 1..=4;
    let choice = choose_orders(
        &Estimator::new(bj, bj.operator_orders(29)),
        &ranges,
        Criterion::Bic,
        &records,
    )?;

    let state = scenario.initial;
    let element = state.controlled_element.transfer_function()?;
    let loop_margins = match choice.fit.operator() {
        Ok(operator) => {
            let open = operator.parameters().transfer_function()?.series(&element);
            Some(margins(|omega| open.response(omega), MANUAL_CONTROL_RANGE_RAD_S))
        }
        Err(_) => None,
    };
    let section = |name: &str, fit, candidates, margins| ModelSection {
        name: format!("{name}({})", hoid_ident::Fit::orders(fit)),
        fit,
        records: &records,
        candidates,
        truth: Some(state.operator),
        margins,
    };
    let report = Report {
        title: "Two simulated runs of condition C1".to_owned(),
        settings: vec![
            ("hoid".to_owned(), env!("CARGO_PKG_VERSION").to_owned()),
            ("condition".to_owned(), Condition::C1.to_string()),
            ("seed".to_owned(), "1".to_owned()),
        ],
        models: vec![
            section("ARX", &arx, None, None),
            section("BJ", &choice.fit, Some(&choice), loop_margins.map(Into::into)),
        ],
        notes: Vec::new(),
        fit_summary: None,
        pictures: Vec::new(),
    };
    std::fs::write(path, report.to_html()?)?;
    Ok(())
}
