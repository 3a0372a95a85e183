//! Virtual people have the parameters with which they were drawn.

#![allow(clippy::unwrap_used)]

use hoid_model::{Complex64, Form, family_scenario::Display, operator_family::Coordinate};
use hoid_sim::{
    SimError,
    people::{Person, Plant, Population, Range, RemnantKind, Task},
};

fn person(plant: Plant, kind: RemnantKind, number: u64) -> Person {
    Person::draw(&Population::default(), &Task::default(), plant, None, kind, 11, number).unwrap()
}

#[test]
fn drawn_people_lie_within_the_ranges() {
    let population = Population::default();
    let mut endless = 0;
    for (number, plant) in (0..20).flat_map(|n| Plant::ALL.map(|plant| (n, plant))) {
        let found = person(plant, RemnantKind::ALL[number as usize % 5], number);
        let operator = &found.state.operator;
        assert!(plant.forms().contains(&operator.form()));
        for parameter in operator.named_parameters() {
            let (range, value) = match parameter.name {
                "T_L" => (population.lead_s, parameter.value),
                "T_I" if parameter.value.is_infinite() => {
                    endless += 1;
                    continue;
                }
                "T_I" => (population.lag_s, parameter.value),
                "omega_nm" => (population.omega_nm_rad_s, parameter.value),
                "zeta_nm" => (population.zeta_nm, parameter.value),
                "tau_e" => (population.tau_e_s, parameter.value),
                _ => continue,
            };
            let slack = 1e-9 * value;
            assert!(
                range.low - slack <= value && value <= range.high + slack,
                "{} {value}",
                parameter.name
            );
        }
        let margins = found.state.margins().unwrap();
        assert_eq!(margins.crossover_rad_s, Some(found.crossover_rad_s));
        assert_eq!(margins.phase_margin_deg, Some(found.phase_margin_deg));
        assert!(population.phase_margin_deg.contains(found.phase_margin_deg));
    }
    assert!((1..20).contains(&endless), "{endless}");
}

#[test]
fn runs_are_repeatable_and_follow_the_controlled_element() {
    for plant in Plant::ALL {
        let found = person(plant, RemnantKind::SignalDependent, 3);
        let run = found.run(1).unwrap();
        let again = person(plant, RemnantKind::SignalDependent, 3).run(1).unwrap();
        assert_eq!(run.record, again.record);
        assert_ne!(run.record.output(), found.run(2).unwrap().record.output());
        let other = person(plant, RemnantKind::SignalDependent, 4);
        assert_ne!(found.state, other.state);
        // dy/dt = u + d and e = -y, without the offsets of the recorder.
        let (e, y) = (run.record.input(), run.record.channel("y").unwrap());
        let d = run.record.channel("d").unwrap();
        for k in 0..run.record.len() - 1 {
            assert!((e[k] + y[k] - found.stick.offset_e).abs() < 1e-12);
            if plant == Plant::Integrator {
                let u = run.record.output()[k] - found.stick.offset_u;
                assert!((y[k + 1] - y[k] - (u + d[k]) / 60.0).abs() < 1e-12);
            }
        }
        assert!(found.stick.offset_u != 0.0 && found.stick.walk_per_root_s > 0.0);
    }
}

#[test]
fn run_to_run_spread_has_the_requested_size() {
    let task = Task {
        spread_between_runs: 0.05,
        ..Task::default()
    };
    let draw = |task: &Task| {
        let kind = RemnantKind::BroadBand;
        Person::draw(
            &Population::default(),
            task,
            Plant::Integrator,
            Some(Form::LeadLag),
            kind,
            2,
            5,
        )
        .unwrap()
    };
    let (steady, varied) = (draw(&Task::default()), draw(&task));
    assert_eq!(steady.state, varied.state);
    let kinds = Form::LeadLag.coordinates(true);
    let lead = kinds.iter().position(|kind| *kind == Coordinate::Lead).unwrap();
    let of = |run: u64| varied.run(run).unwrap().state.operator.coordinates()[lead].ln();
    let own = steady.state.operator.coordinates()[lead].ln();
    let runs = 40;
    let square = (0..runs).map(|run| (of(run) - own).powi(2)).sum::<f64>() / runs as f64;
    // The standard error of the root of a mean square of 40 values is 11 %.
    assert!((square.sqrt() / 0.05 - 1.0).abs() < 0.44, "{}", square.sqrt());
    assert_eq!(steady.run(3).unwrap().state, steady.state);
}

#[test]
fn other_rates_and_forms_can_be_drawn() {
    let task = Task {
        sample_time: hoid_model::SampleTime::AT_100_HZ,
        ..Task::default()
    };
    let kind = RemnantKind::Pulsed;
    let draw = |plant, form| Person::draw(&Population::default(), &task, plant, Some(form), kind, 3, 1);
    for (plant, form) in [
        (Plant::Integrator, Form::Gain),
        (Plant::Integrator, Form::LeadLag),
        (Plant::LaggedIntegrator, Form::LeadDroop),
        (Plant::LaggedIntegrator, Form::QuadraticIntegral),
        (Plant::DoubleIntegrator, Form::Lead),
        (Plant::DoubleIntegrator, Form::Lead2Lag),
    ] {
        let found = draw(plant, form).unwrap();
        assert_eq!(
            (found.state.operator.form(), found.run(0).unwrap().record.len()),
            (form, 4000)
        );
    }
    // With a lag in series with 1/s, no phase margin is in the accepted range.
    assert!(matches!(
        draw(Plant::Integrator, Form::Lag),
        Err(SimError::NoAcceptablePerson { .. })
    ));
}

#[test]
fn ranges_without_people_are_refused() {
    let kind = RemnantKind::Lag;
    let draw = |population: Population| {
        Person::draw(
            &population,
            &Task::default(),
            Plant::DoubleIntegrator,
            Some(Form::Lead),
            kind,
            1,
            1,
        )
        .unwrap_err()
    };
    let typical = Population::default();
    let nobody = draw(Population {
        tau_e_s: Range::new(2.0, 3.0),
        ..typical
    });
    assert!(nobody.to_string().contains("widen the ranges"), "{nobody}");
    for bad in [
        Population {
            lead_s: Range::new(2.0, 1.0),
            ..typical
        },
        Population {
            zeta_nm: Range::new(0.0, 1.0),
            ..typical
        },
        Population {
            integrates: 1.5,
            ..typical
        },
        Population {
            remnant_share: Range::new(0.1, 0.95),
            ..typical
        },
        Population {
            largest_sensitivity: f64::NAN,
            ..typical
        },
    ] {
        assert!(matches!(draw(bad), SimError::Model(_)), "{bad:?}");
    }
    let spread = Task {
        spread_between_runs: -0.1,
        ..Task::default()
    };
    assert!(Person::draw(&typical, &spread, Plant::Integrator, None, kind, 1, 1).is_err());
}

/// A person with a displayed target is the same person with an additional response to it; in each run both responses
/// share the neuromuscular system of the run.
#[test]
fn people_respond_to_a_displayed_target() {
    for plant in Plant::ALL {
        for display in [Display::Pursuit, Display::Preview] {
            let task = Task {
                display,
                preview_s: 0.5,
                spread_between_runs: 0.05,
                ..Task::default()
            };
            let draw =
                |task: &Task| Person::draw(&Population::default(), task, plant, None, RemnantKind::Lag, 11, 2).unwrap();
            let (seen, plain) = (draw(&task), draw(&Task::default()));
            assert_eq!(seen.state, plain.state);
            assert!(plain.feedforward.is_none());
            let of_person = seen.feedforward.clone().unwrap();
            // Near 3 rad/s the machine follows 0.4 to 1 of the target, apart from the neuromuscular system.
            let (nm, zeta) = seen.state.operator.neuromuscular_parameters().unwrap();
            let z = 3.0 / nm;
            let muscles = Complex64::new(1.0 - z * z, 2.0 * zeta * z).inv();
            let followed =
                of_person.operator.response(3.0) * plant.transfer_function().unwrap().response(3.0) / muscles;
            assert!((0.4..=1.0).contains(&followed.norm()), "{plant} {followed}");
            let run = seen.run(1).unwrap();
            assert_eq!(run.record, draw(&task).run(1).unwrap().record);
            let of_run = run.feedforward.unwrap();
            assert_ne!(of_run, of_person);
            let muscles = [&run.state.operator, &of_run.operator].map(|o| o.neuromuscular_parameters().unwrap());
            assert!((muscles[0].0 / muscles[1].0 - 1.0).abs() < 1e-12);
            assert!((muscles[0].1 / muscles[1].1 - 1.0).abs() < 1e-12);
            let target = run.record.channels().find(|c| c.name == "f_t").unwrap();
            let role = if display == Display::Preview {
                "feedforward:0.5"
            } else {
                "feedforward"
            };
            assert_eq!(target.role, role);
            assert!(plain.run(1).unwrap().record.channel("f_t").is_none());
        }
    }
    let off_grid = Task {
        display: Display::Preview,
        preview_s: 0.501,
        ..Task::default()
    };
    let refused = Person::draw(
        &Population::default(),
        &off_grid,
        Plant::Integrator,
        None,
        RemnantKind::Lag,
        1,
        0,
    );
    assert!(matches!(refused, Err(SimError::Model(_))), "{refused:?}");
}
