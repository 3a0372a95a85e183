//! `hoid convert`: conversion of discrete coefficients to operator parameters and back, and of any transfer function to
//! discrete time.

use hoid::ident::family::family_from_polynomials;
use hoid::model::{
    ContinuousTransferFunction, DiscreteOperator, GainUnit, OperatorParameters, Orders, PolynomialModel, SampleTime,
    Structure, discretise::discretise, second_order::ZohSecondOrder, uncertainty::OperatorEstimate,
};
use hoid::report::numbers;
use serde_json::{Map, Value, json};

use crate::{args::ConvertArgs, error::CliError, family_operator, json, output, text};

pub fn run(args: &ConvertArgs) -> Result<(), CliError> {
    let sample_time = SampleTime::new(args.sample_time)?;
    if let Some(h) = &args.transfer_function {
        return print_discretised(args, h, sample_time);
    }
    if let (Some(f), Some(b)) = (&args.f, &args.b)
        && (f.len(), b.len()) != (2, 2)
    {
        return print_family_operator(args, f, b, sample_time);
    }
    let (discrete, operator) = match (&args.f, &args.b, &args.operator) {
        (Some(f), Some(b), _) => {
            let discrete = DiscreteOperator {
                zoh: ZohSecondOrder {
                    b0: b[0],
                    b1: b[1],
                    f1: f[0],
                    f2: f[1],
                },
                nk: args.nk,
                sample_time,
            };
            (discrete, discrete.parameters())
        }
        (_, _, Some(pairs)) => {
            let operator =
                OperatorParameters::from_names(pairs).map_err(|e| CliError::Usage(format!("--operator: {e}")))?;
            (operator.discretise(sample_time)?, Ok(operator))
        }
        _ => {
            return Err(CliError::Usage(
                "give --f and --b, --operator, or --transfer-function".to_owned(),
            ));
        }
    };
    let held = discrete.zoh;
    if args.json {
        let operator = match operator {
            Ok(o) => {
                let mut map = Map::new();
                map.insert("convertible".to_owned(), json!(true));
                map.insert("stable".to_owned(), json!(o.is_stable()));
                for (name, _, e) in OperatorEstimate::from(o).rows() {
                    map.insert(name.to_owned(), json!({"value": json::number(e.value)}));
                }
                Value::Object(map)
            }
            Err(reason) => json!({"convertible": false, "reason": reason.to_string()}),
        };
        json::print(&json!({
            "sample_time": json::number(sample_time.s()),
            "discrete": {"f": [held.f1, held.f2], "b": [held.b0, held.b1], "nk": discrete.nk},
            "operator": operator,
        }))?;
        return Ok(());
    }
    let mut text = format!(
        "Discrete, Ts = {} s: ({:.10} {:+.10} q^-1) q^-{} / (1 {:+.10} q^-1 {:+.10} q^-2)\n",
        sample_time.s(),
        held.b0,
        held.b1,
        discrete.nk,
        held.f1,
        held.f2
    );
    match operator {
        Ok(o) => {
            let mut table = text::table(&["operator", "value", "unit"]);
            for (name, unit, e) in OperatorEstimate::from(o).rows() {
                table.add_row([name, &numbers::format_plain(e.value), unit]);
            }
            text.push_str(&format!("{table}\n"));
            if !o.is_stable() {
                text.push_str("zeta_nm is not positive: the operator is not stable.\n");
            }
        }
        Err(reason) => text.push_str(&format!("The model cannot be converted to an operator: {reason}.\n")),
    }
    output::show(&text)?;
    Ok(())
}

/// Converts polynomials with orders other than those of a gain with a lead to an operator of the family, and prints
/// this operator.
fn print_family_operator(args: &ConvertArgs, f: &[f64], b: &[f64], sample_time: SampleTime) -> Result<(), CliError> {
    let orders = Orders {
        nb: b.len(),
        nf: f.len(),
        nk: args.nk,
        ..Orders::default()
    };
    let model = PolynomialModel::new(Structure::OutputError, orders, sample_time, [b, f].concat())?;
    let found = family_from_polynomials(&model, None, None);
    if args.json {
        json::print(&json!({
            "sample_time": json::number(sample_time.s()),
            "discrete": {"f": f, "b": b, "nk": args.nk},
            "operator": json::family_json(&found),
        }))?;
    } else {
        output::show(&family_operator::to_text(&found, &GainUnit::default()))?;
    }
    Ok(())
}

fn print_discretised(
    args: &ConvertArgs,
    h: &ContinuousTransferFunction,
    sample_time: SampleTime,
) -> Result<(), CliError> {
    let discrete = discretise(h, sample_time, args.method.method(args.prewarp))?;
    if args.json {
        json::print(&json!({
            "sample_time": json::number(sample_time.s()),
            "transfer_function": {"num": discrete.num(), "den": discrete.den()},
        }))?;
        return Ok(());
    }
    let row = |c: &[f64]| c.iter().map(|v| format!("{v:.10}")).collect::<Vec<_>>().join(", ");
    output::show(&format!(
        "In ascending powers of q^-1, Ts = {} s:\nnumerator    {}\ndenominator  {}\n",
        sample_time.s(),
        row(discrete.num()),
        row(discrete.den())
    ))?;
    Ok(())
}
