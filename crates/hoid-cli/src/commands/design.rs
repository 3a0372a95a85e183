//! `hoid design`: the most informative forcing function for an operator, and the expected errors.

use std::path::Path;

use hoid::design::experiment::{Designed, Designing, Enters, Expected, Remnant, Task, expected, periods};
use hoid::io::{AnyScenario, read_any_scenario};
use hoid::model::{
    ContinuousTransferFunction, FamilyOperator, FamilyState,
    forcing::{ForcingFunction, Sinusoid},
    operator_family::NamedParameter,
    uncertainty::Estimate,
};
use serde_json::{Map, Value, json};

use super::{output_paths, paper_table};
use crate::{args::DesignArgs, error::CliError, json, output, text};

/// `--against` the ten sines of the text.
const REFERENCE: &str = "reference";

/// A forcing function for comparison with the design, over the same time.
struct Other {
    name: String,
    expected: Expected,
}

pub fn run(args: &DesignArgs) -> Result<(), CliError> {
    paper_table::check(&args.show)?;
    output_paths::check(&[&args.people], &[args.show.table.as_deref()], &[])?;
    if let Some(out) = &args.out {
        hoid::io::check_output_directory(out, &[&args.people])?;
    }
    let task = Task {
        state: person(args)?,
        enters: if args.disturbance {
            Enters::Disturbance
        } else {
            Enters::Target
        },
        remnant: Remnant {
            share: args.remnant_share,
            time_constant_s: args.remnant_time_constant,
            ..Remnant::default()
        },
    };
    let designing = Designing {
        wanted: args.wanted.clone(),
        period_s: args.length,
        lines: args.lines,
        band_rad_s: args.band,
        shelf: args.shelf,
        most_rms: [args.max_rms_e, args.max_u],
    };
    let designed = designing.run(&task)?;
    let runs = args.runs.map_or(designed.periods, |runs| runs as usize);
    let length_s = args.length * runs as f64;
    let all_runs = expected(&task, &designed.forcing, length_s)?;
    let other = args
        .against
        .as_deref()
        .map(|path| against(path, &task, length_s))
        .transpose()?;
    let object = object(args, &task, &designed, (&all_runs, runs), other.as_ref());
    if let Some(out) = &args.out {
        write_all(args, &task, &designed, &object, out)?;
    }
    paper_table::write(&args.show, || Ok(object.clone()))?;
    if args.show.json {
        json::print(&Value::Object(object))
    } else {
        output::show(&page(args, &designed, (&all_runs, runs), other.as_ref()))
    }
}

fn person(args: &DesignArgs) -> Result<FamilyState, CliError> {
    let element = || -> Result<ContinuousTransferFunction, CliError> {
        let missing = || {
            CliError::Usage(
                "a fit does not report the controlled element: add --controlled-element '90/(s(s+6))'".to_owned(),
            )
        };
        args.controlled_element.clone().ok_or_else(missing)
    };
    if hoid::io::is_fit_file(&args.people.to_string_lossy()) {
        let fit = hoid::io::read_fit(&args.people)?.operator()?;
        return Ok(FamilyState {
            operator: fit.operator,
            controlled_element: element()?,
        });
    }
    let mut state = family(&args.people)?.initial;
    if let Some(element) = &args.controlled_element {
        state.controlled_element = element.clone();
    }
    Ok(state)
}

fn family(path: &Path) -> Result<hoid::model::FamilyScenario, CliError> {
    match read_any_scenario(path)? {
        AnyScenario::Family(scenario) => Ok(*scenario),
        AnyScenario::Reference(_) => Err(CliError::Usage(format!(
            "{} is a scenario of the thesis; write one with the key form, as form = \"lead\"",
            path.display()
        ))),
    }
}

fn against(path: &Path, task: &Task, length_s: f64) -> Result<Other, CliError> {
    let name = path.display().to_string();
    let forcing = if name == REFERENCE {
        ForcingFunction::reference()
    } else {
        let scenario = family(path)?;
        match task.enters {
            Enters::Target => scenario.target.function,
            Enters::Disturbance => scenario.disturbance.function,
        }
    };
    Ok(Other {
        expected: expected(task, &forcing, length_s)?,
        name,
    })
}

fn object(
    args: &DesignArgs,
    task: &Task,
    designed: &Designed,
    (all_runs, runs): (&Expected, usize),
    other: Option<&Other>,
) -> Map<String, Value> {
    let mut map = Map::new();
    let mut set = |key: &str, value: Value| map.insert(key.to_owned(), value);
    set("hoid", json!(env!("CARGO_PKG_VERSION")));
    set("kind", json!("design"));
    set("form", json!(task.state.operator.form().name()));
    set("runs", json!(runs));
    set("length_s", json::number(args.length));
    set("runs_needed", json!(designed.periods));
    set("crest_factor", json::number(designed.crest_factor));
    for (key, value) in of_expected(all_runs) {
        set(&key, value);
    }
    let line =
        |l: &Sinusoid| json!({"omega_rad_s": l.omega_rad_s, "amplitude": l.amplitude_deg, "phase_rad": l.phase_rad});
    set("lines", designed.forcing.sinusoids().iter().map(line).collect());
    set(
        "against",
        other.map_or(Value::Null, |o| {
            let mut of = of_expected(&o.expected);
            of.insert("name".to_owned(), json!(o.name));
            Value::Object(of)
        }),
    );
    map
}

fn of_expected(e: &Expected) -> Map<String, Value> {
    let parameter = |(name, unit, estimate): &(&str, &str, Estimate)| {
        let mut one = json::named(name, estimate);
        one["unit"] = json!(unit);
        one
    };
    let mut map = Map::new();
    map.insert("parameters".to_owned(), e.parameters.iter().map(parameter).collect());
    map.insert(
        "open_loop".to_owned(),
        json!({"crossover_rad_s": json::estimate(&e.crossover_rad_s), "phase_margin_deg": json::estimate(&e.phase_margin_deg)}),
    );
    map.insert("rms_e".to_owned(), json::number(e.rms_e));
    map.insert("rms_u".to_owned(), json::number(e.rms_u));
    map
}

fn page(args: &DesignArgs, designed: &Designed, (all_runs, runs): (&Expected, usize), other: Option<&Other>) -> String {
    let counted = text::counted(runs as u64, "run");
    let mut page = format!("Errors to be expected of {counted} of {} s\n", args.length);
    let mut header = vec!["", "value", "error", "relative"];
    let name = other.map(|o| format!("with {}", o.name));
    header.extend(name.as_deref());
    let mut rows = text::table(&header);
    let all = |e: &Expected| {
        let mut all = vec![
            ("crossover (rad/s)".to_owned(), e.crossover_rad_s),
            ("phase margin (deg)".to_owned(), e.phase_margin_deg),
        ];
        all.extend(e.parameters.iter().map(|(name, unit, estimate)| match *unit {
            "" => ((*name).to_owned(), *estimate),
            unit => (format!("{name} ({unit})"), *estimate),
        }));
        all
    };
    let others = other.map(|o| all(&o.expected));
    for (k, (name, estimate)) in all(all_runs).into_iter().enumerate() {
        let error = estimate.standard_error.unwrap_or(f64::NAN);
        let mut cells = vec![
            name,
            text::significant(estimate.value),
            text::significant(error),
            format!("{:.1} %", 100.0 * error / estimate.value.abs()),
        ];
        cells.extend(
            others
                .as_ref()
                .map(|o| text::significant(o[k].1.standard_error.unwrap_or(f64::NAN))),
        );
        rows.add_row(cells);
    }
    page.push_str(&format!(
        "{rows}\nrms of e {}, of u {}",
        text::significant(all_runs.rms_e),
        text::significant(all_runs.rms_u)
    ));
    if let Some(o) = other {
        page.push_str(&format!(
            " (with {}: {}, {})",
            o.name,
            text::significant(o.expected.rms_e),
            text::significant(o.expected.rms_u)
        ));
    }
    page.push_str(".\n");
    if !args.wanted.is_empty() {
        let needed = text::counted(designed.periods as u64, "run");
        page.push_str(&format!("What is wanted takes {needed}.\n"));
        if let Some(o) = other {
            let of_one = o.expected.scaled((runs as f64).sqrt());
            page.push_str(&format!(
                "With {} it takes {}.\n",
                o.name,
                periods(&of_one, &args.wanted)
            ));
        }
    }
    let mut lines = text::table(&["line (rad/s)", "periods a run", "amplitude", "phase (rad)"]);
    for line in designed.forcing.sinusoids() {
        lines.add_row([
            format!("{:.4}", line.omega_rad_s),
            format!("{:.0}", line.omega_rad_s * args.length / std::f64::consts::TAU),
            text::significant(line.amplitude_deg),
            format!("{:.3}", line.phase_rad),
        ]);
    }
    page.push_str(&format!(
        "\nThe forcing function, crest factor {:.2}\n{lines}\n\
         By the information of its lines, of a person who is as supposed in every run: what they vary by from run to run comes on top.\n",
        designed.crest_factor
    ));
    page
}

fn write_all(
    args: &DesignArgs,
    task: &Task,
    designed: &Designed,
    object: &Map<String, Value>,
    out: &Path,
) -> Result<(), CliError> {
    hoid::io::make_directory(out)?;
    let write =
        |name: &str, text: &str| hoid::io::write_atomically(&out.join(name), |file| file.write_all(text.as_bytes()));
    write("design.json", &format!("{:#}\n", Value::Object(object.clone())))?;
    write("scenario.toml", &scenario(args, task, designed))?;
    let line = |l: &Sinusoid| format!("{},{},{}\n", l.omega_rad_s, l.amplitude_deg, l.phase_rad);
    let lines: String = designed.forcing.sinusoids().iter().map(line).collect();
    write("forcing.csv", &format!("omega_rad_s,amplitude,phase_rad\n{lines}"))?;
    output::notice("", format!("the design: {}", out.display()));
    Ok(())
}

/// A scenario with the designed forcing function.
fn scenario(args: &DesignArgs, task: &Task, designed: &Designed) -> String {
    let numbers = |all: &[f64]| all.iter().map(f64::to_string).collect::<Vec<_>>().join(",");
    let element = &task.state.controlled_element;
    let lines: Vec<String> = designed
        .forcing
        .sinusoids()
        .iter()
        .map(|l| {
            format!(
                "  {{ amplitude = {}, omega_rad_s = {}, phase_rad = {} }}",
                l.amplitude_deg, l.omega_rad_s, l.phase_rad
            )
        })
        .collect();
    // A run is a whole number of samples: of 1/100 s if possible.
    let hundredths = 100.0 * args.length;
    let ts = match (hundredths - hundredths.round()).abs() < 1e-6 {
        true => 0.01,
        false => args.length / hundredths.ceil(),
    };
    let shape = match args.remnant_time_constant {
        0.0 => "shape = \"white\"\n".to_owned(),
        t => format!("shape = \"lag\"\nT_n_s = {t}\n"),
    };
    format!(
        "# Made by `hoid design`.\nname = \"design\"\nform = \"{}\"\nneuromuscular = {}\nsample_time_s = {}\nmeasurement_s = {}\nrun_in_s = {}\n\n\
         [initial]\n{}controlled_element = \"{}/{}\"\n\n[{}]\nlines = [\n{},\n]\n\n[[remnant]]\n{shape}share = {}\n",
        task.state.operator.form().name(),
        task.state.operator.has_neuromuscular(),
        ts,
        args.length,
        ts * (10.0 / ts).round(),
        operator_keys(&task.state.operator),
        numbers(element.num()),
        numbers(element.den()),
        if args.disturbance { "disturbance" } else { "target" },
        lines.join(",\n"),
        args.remnant_share,
    )
}

fn operator_keys(operator: &FamilyOperator) -> String {
    let key = |p: &NamedParameter| {
        let name = match p.name {
            "K_e" => "K",
            "T_L" => "T_L_s",
            "T_I" => "T_I_s",
            "c_1" => "c_1_s",
            "c_2" => "c_2_s2",
            "alpha" => "alpha_rad_s",
            "omega_nm" => "omega_nm_rad_s",
            "tau_e" => "tau_e_s",
            other => other,
        };
        let value = if p.value.is_finite() {
            p.value.to_string()
        } else {
            "inf".to_owned()
        };
        format!("{name} = {value}\n")
    };
    operator
        .named()
        .iter()
        .filter(|p| p.coordinate.is_some())
        .map(key)
        .collect()
}
