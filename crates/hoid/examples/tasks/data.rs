//! The data that hoid and the peer programs share, written as plain numbers.
//!
//! | file | holds |
//! |---|---|
//! | `record.csv` | e, u of the measurement of one run of C1, 8192 samples |
//! | `loop.csv` | forcing function and white noise of the whole run, with its run-in |
//! | `truth.json` | the parameters of the loop |
//!
//! Numbers are written with enough digits to reproduce every bit.

use std::{fmt::Write, path::Path};

use hoid::{model::Channel, prelude::*, sim::Signals};

/// Delay of the operator of C1 including its hold, samples.
pub const NK: usize = 29;

/// One run of C1 and the settings of its simulation.
pub struct TaskData {
    pub simulator: Simulator,
    pub noise: Vec<f64>,
    pub record: Record,
}

/// Returns the seed of a replication.
pub fn run_seed(replication: u64) -> RunSeed {
    RunSeed {
        seed: 1,
        cell: 0,
        replication,
    }
}

impl TaskData {
    pub fn new() -> Self {
        let simulator = Simulator::new(&Scenario::condition(Condition::C1)).unwrap();
        let noise = run_seed(0).white_noise(simulator.sample_count());
        let record = simulator.run(run_seed(0), false).unwrap();
        Self {
            simulator,
            noise,
            record,
        }
    }

    pub fn write(&self, directory: &Path) {
        std::fs::create_dir_all(directory).unwrap();
        write_columns(
            &directory.join("record.csv"),
            [self.record.input(), self.record.output()],
        );
        let whole = self.simulator.run(run_seed(0), true).unwrap();
        write_columns(
            &directory.join("loop.csv"),
            [whole.channel("f_t").unwrap(), &self.noise],
        );
        let names = [
            "K_e", "T_L", "omega_nm", "zeta_nm", "tau_e", "T_n", "K_n", "K_c", "omega_b",
        ];
        let truth: serde_json::Map<String, serde_json::Value> = names
            .into_iter()
            .map(|name| (name.to_owned(), self.record.channel(name).unwrap()[0].into()))
            .chain([
                ("Ts".to_owned(), self.record.sample_time().s().into()),
                (
                    "run_in".to_owned(),
                    (self.simulator.sample_count() - self.record.len()).into(),
                ),
            ])
            .collect();
        std::fs::write(directory.join("truth.json"), serde_json::Value::from(truth).to_string()).unwrap();
    }
}

impl TaskData {
    /// Returns the input and the output of the measurement of a run.
    pub fn measured_record(&self, run: &Signals) -> Record {
        let from = run.e.len() - self.record.len();
        let channel = |name, values: &[f64]| Channel::new(name, "deg", values[from..].to_vec());
        Record::new(self.record.sample_time(), channel("e", &run.e), channel("u", &run.u)).unwrap()
    }
}

fn write_columns(file: &Path, of: [&[f64]; 2]) {
    let mut text = String::new();
    for (a, b) in of[0].iter().zip(of[1]) {
        writeln!(text, "{a},{b}").unwrap();
    }
    std::fs::write(file, text).unwrap();
}
