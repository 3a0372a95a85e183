//! Coverage of the intervals of both responses, for people who see a target in addition to the error.
//!
//! ```sh
//! cargo xtask slow inputs-coverage [PEOPLE] [SEED] [RUNS]
//! ```
//!
//! Virtual people ([`hoid_sim::people`]) control an integrator, an integrator with a lag, or two integrators, each with
//! the form that people use with this element; the form is not given to the fit. They see a target at every second
//! prime, with a preview of a quarter of a second, and correct a disturbance at the other primes. Their response to the
//! target is `g s/K` or `g s (T s + 1)/K` for an element `K/s` or `K/(s (T s + 1))`, with g from .4 to 1 and a delay of
//! -.1 to .2 s, in series with their neuromuscular system. Every second person sees only the error. A share of 95 % of
//! n intervals has a standard error of `sqrt(.95 .05/n)`.

#![allow(clippy::print_stdout)]

use std::{collections::BTreeMap, env, error::Error};

use hoid::analysis::{Identification, Recordings};
use hoid_ident::family::{ChannelRole, FamilyEstimator, Parameter, SeenChannel};
use hoid_model::{
    FamilyOperator, Form, VerdictLevel,
    family_scenario::{Feedforward, Interleaved, MultiSine},
};
use hoid_sim::{
    FamilySimulator,
    people::{Person, Plant, Population, RemnantKind, Task},
};

const PREVIEW_S: f64 = 0.25;

/// Number of intervals that cover the truth, number of determined intervals, and number of all intervals.
#[derive(Default)]
struct CoverageCounts {
    held: usize,
    determined: usize,
    all: usize,
}

fn count_interval(all: &mut BTreeMap<String, CoverageCounts>, name: &str, parameter: Option<&Parameter>, truth: f64) {
    let held = all.entry(name.to_owned()).or_default();
    held.all += 1;
    if let Some((low, high)) = parameter.filter(|p| p.determined).and_then(|p| p.interval) {
        held.determined += 1;
        held.held += usize::from(low <= truth && truth <= high);
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let number = |i: usize, otherwise: u64| env::args().nth(i).map_or(Ok(otherwise), |text| text.parse());
    let (people, seed, runs) = (number(1, 120)?, number(2, 1)?, number(3, 1)?);
    let population = Population::default();
    let task = Task {
        measurement_s: 80.0,
        ..Task::default()
    };
    let plants = [Plant::Integrator, Plant::LaggedIntegrator, Plant::DoubleIntegrator];
    let mut held = BTreeMap::new();
    let (mut found, mut seeing, mut invented, mut blind) = (0, 0, 0, 0);
    let (mut trustworthy, mut trustworthy_with_one_input, mut right_form) = (0, 0, 0);
    for k in 0..people {
        let plant = plants[(k / 2) as usize % plants.len()];
        let Ok(person) = Person::draw(&population, &task, plant, None, RemnantKind::BroadBand, seed, k) else {
            continue;
        };
        let mut scenario = person.scenario().clone();
        let lines = |interleaved| MultiSine {
            interleaved,
            ..plant.disturbance()
        };
        scenario.disturbance = lines(Interleaved::Odd).excitation()?;
        scenario.target = lines(Interleaved::Even).excitation()?;
        let sees = k % 2 == 0;
        let draw = |i: u64| ((k * 7 + i * 13 + seed) as f64 * 0.618_033_988_749).fract();
        let (g, tau_f) = (0.4 + 0.6 * draw(1), -0.1 + 0.3 * draw(2));
        let element = &person.state.controlled_element;
        let gain = element.num()[0];
        let form = match plant {
            Plant::Integrator => Form::Derivative,
            _ => Form::DerivativeLead,
        };
        // The inverse of K/(s + a) has the gain a/K and the lead 1/a; for two integrators it is an acceleration with a
        // small rate.
        let rate = element.den().get(1).copied().unwrap_or(0.0).max(0.3);
        let (omega, zeta) = person.state.operator.neuromuscular_parameters().unwrap_or((11.0, 0.3));
        let muscles = [omega.ln(), zeta.ln()];
        let k_d = match form {
            Form::Derivative => g / gain,
            _ => g * rate / gain,
        };
        let mut x = vec![k_d];
        if form == Form::DerivativeLead {
            x.push(1.0 / rate);
        }
        x.extend(muscles);
        x.push(tau_f + PREVIEW_S);
        let target = FamilyOperator::new(form, true, &x)?;
        scenario.feedforward = sees.then(|| Feedforward::new(target.clone(), PREVIEW_S));
        let simulator = FamilySimulator::new(&scenario)?;
        let records = (0..runs).map(|run| simulator.run(person.run_seed(run), false));
        let records: Vec<_> = records.collect::<Result<_, _>>()?;
        let identification = |channels: Vec<SeenChannel>| Identification {
            estimator: FamilyEstimator {
                channels,
                ..FamilyEstimator::default()
            },
            controlled_element: Some(element.clone()),
            ..Identification::default()
        };
        let seen = SeenChannel {
            preview_s: PREVIEW_S,
            ..SeenChannel::new("f_t", ChannelRole::Feedforward)
        };
        let with = |channels| identification(channels).run(Recordings::from_records(records.iter().cloned()));
        let Ok(two) = with(vec![seen]) else {
            println!("{k}: no result");
            continue;
        };
        let response = two.fit.channels[0].response.as_ref();
        if sees {
            seeing += 1;
            found += usize::from(response.is_some());
            right_form += usize::from(response.is_some_and(|r| r.operator.form() == form));
            if let Some(one) = with(Vec::new())
                .ok()
                .filter(|one| one.verdict.level == VerdictLevel::Trustworthy)
            {
                trustworthy_with_one_input += 1;
                println!("{k}: one input is {}", one.verdict.level);
            }
        } else {
            blind += 1;
            invented += usize::from(response.is_some());
        }
        trustworthy += usize::from(two.verdict.level == VerdictLevel::Trustworthy);
        let of = |all: &[Parameter], name: &str| all.iter().find(|p| p.name == name).cloned();
        let own = &two.fit.operators[0].parameters;
        for truth in person.state.operator.named_parameters() {
            count_interval(&mut held, truth.name, of(own, truth.name).as_ref(), truth.value);
        }
        if let (true, Some(response)) = (sees, response) {
            if response.operator.form() == form {
                for truth in target
                    .named_parameters()
                    .iter()
                    .filter(|p| matches!(p.name, "K_d" | "T_L"))
                {
                    let name = format!("{} of F", truth.name);
                    count_interval(
                        &mut held,
                        &name,
                        of(&response.parameters, truth.name).as_ref(),
                        truth.value,
                    );
                }
            }
            let all = of(&response.parameters, "tau_f");
            count_interval(&mut held, "tau_f", all.as_ref(), tau_f);
        }
        if let Some(measures) = two.fit.loop_measures(0, element) {
            for (name, interval, truth) in [
                ("crossover", measures.crossover_interval, person.crossover_rad_s),
                ("phase margin", measures.phase_margin_interval, person.phase_margin_deg),
            ] {
                let held = held.entry(name.to_owned()).or_default();
                held.all += 1;
                if let Some((low, high)) = interval {
                    held.determined += 1;
                    held.held += usize::from(low <= truth && truth <= high);
                }
            }
        }
    }
    println!("{runs} run(s) of 80 s each: {seeing} people who see the target, {blind} who see the error alone");
    println!(
        "response to the target found: {found} of {seeing} (its form: {right_form}); invented: {invented} of {blind}"
    );
    println!(
        "trustworthy with two inputs: {trustworthy} of {}; with one input: {trustworthy_with_one_input} of {seeing}",
        seeing + blind
    );
    println!("quantity, determined of all, held of those (%)");
    for (name, of) in held {
        let share = 100.0 * of.held as f64 / of.determined.max(1) as f64;
        println!("{name}, {} of {}, {share:.1}", of.determined, of.all);
    }
    Ok(())
}
