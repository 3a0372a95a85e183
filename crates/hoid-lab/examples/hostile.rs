//! A million modified messages to the lab, session files, settings, results and saved trackers: none causes a panic,
//! caught or not. The results are the numbers of `research/notes/mutations.md`.
//!
//! `cargo xtask slow hostile [CASES] [FIRST] [SEED]`; it is built with overflow checks, as the tests are.
#![allow(clippy::unwrap_used, clippy::print_stdout)]

#[allow(dead_code)]
#[path = "../../hoid-cli/tests/common/draw.rs"]
mod draw;
#[path = "../tests/common/hostile.rs"]
mod hostile;
#[path = "../tests/common/person.rs"]
mod person;
#[path = "../../hoid-io/tests/common/mutations/spent.rs"]
mod spent;
#[path = "../tests/common/texts.rs"]
mod texts;

use std::{
    panic::{self, AssertUnwindSafe},
    process::ExitCode,
    sync::atomic::{AtomicUsize, Ordering},
    thread,
    time::{Duration, Instant},
};

use hostile::HostileTest;
use spent::ProcessorTime;

/// Limit of the processor time of one case.
const CPU_TIME_LIMIT: Duration = Duration::from_secs(2);
/// Number of panics, including those that are caught.
static PANICS: AtomicUsize = AtomicUsize::new(0);

fn main() -> ExitCode {
    let number = |k: usize, default: u64| std::env::args().nth(k).map_or(default, |text| text.parse().unwrap());
    let (cases, first, seed) = (number(1, 1_000_000), number(2, 0), number(3, 2026));
    panic::set_hook(Box::new(|info| {
        if PANICS.fetch_add(1, Ordering::Relaxed) < 100 {
            println!("{info}");
        }
    }));
    let jobs = thread::available_parallelism().map_or(1, |n| n.get() as u64);
    let start_time = Instant::now();
    let part = |job: u64| {
        let mut hostile = HostileTest::new();
        let mut slowest = (Duration::ZERO, 0);
        for number in (first..first + cases).filter(|number| number / 4 % jobs == job) {
            let start = ProcessorTime::now();
            if panic::catch_unwind(AssertUnwindSafe(|| hostile.run_case(seed, number))).is_err() {
                println!("case {number}: a panic");
                hostile = HostileTest::new();
            }
            slowest = slowest.max((start.elapsed(), number));
        }
        slowest
    };
    let slowest = thread::scope(|scope| {
        let parts: Vec<_> = (0..jobs).map(|job| scope.spawn(move || part(job))).collect();
        parts.into_iter().map(|part| part.join().unwrap()).max().unwrap()
    });
    let panics = PANICS.load(Ordering::Relaxed);
    println!(
        "{cases} cases of seed {seed} in {:.0} s: {panics} panics; slowest {:.2} s (case {})",
        start_time.elapsed().as_secs_f64(),
        slowest.0.as_secs_f64(),
        slowest.1
    );
    if panics == 0 && slowest.0 < CPU_TIME_LIMIT {
        ExitCode::SUCCESS
    } else {
        ExitCode::FAILURE
    }
}
