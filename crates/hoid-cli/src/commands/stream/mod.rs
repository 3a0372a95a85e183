//! `hoid stream`: an online recursive estimate. By default each line of standard input gives one line of JSON on
//! standard output, flushed at once, even if the line is not a sample; comments, blank lines and headers give none.
//! With `--udp`, samples and estimates are datagrams.
//!
//! | file | contents |
//! |---|---|
//! | `session` | samples in order of time, and the state of the recursion |
//! | `lines`, `clock` | parsing of a line, and check of its time |
//! | `line` | one line of the output |
//! | `datagram`, `udp` | binary samples and estimates; socket |

mod clock;
mod datagram;
mod line;
mod lines;
mod session;
mod udp;

use std::{
    io::{self, ErrorKind, Write},
    process,
    sync::{Arc, Mutex, MutexGuard, PoisonError},
    thread,
    time::{Duration, Instant},
};

use hoid::analysis::recursion_options_error;
use hoid::model::SampleTime;
use hoid::track::{DEFAULT_WARM_UP_S, Live};

use crate::{args::StreamArgs, error::CliError, interrupt, output, recursion};
use lines::Lines;
use session::Session;
use udp::Udp;

/// Maximum time for which an interrupt waits until a line has been written.
const INTERRUPT_WAIT: Duration = Duration::from_secs(1);

pub fn run(args: &StreamArgs) -> Result<(), CliError> {
    if args.lsl_in.is_some() || args.lsl_out.is_some() {
        return Err(CliError::Usage(
            "--lsl-in, --lsl-out: this program does not include liblsl; track LabStreamingLayer streams in Python, \
             with pyhoid.lsl.stream(IN, OUT, pyhoid.Tracker(sample_time=0.01)) (pip install \"pyhoid[lsl]\")"
                .to_owned(),
        ));
    }
    let sample_time = SampleTime::new(1.0 / args.fs)?;
    let asked = recursion::request(&args.recursion)?;
    let decimation = args.rate.decimation(asked.counts_samples());
    if asked.method.requests_two_sided() {
        return Err(CliError::Usage(
            "--smooth applies only to hoid track, because a stream has no future samples".to_owned(),
        ));
    }
    if args.warm_up.is_some() && asked.method.is_self_starting() {
        return Err(CliError::Usage(format!(
            "--warm-up applies only to methods with a start fit, but {} estimates from the first sample; drop \
             --warm-up, or choose --method physical",
            asked.method
        )));
    }
    let warm_up_s = args.warm_up.unwrap_or(DEFAULT_WARM_UP_S);
    let live = Live::new(&asked, sample_time, decimation, warm_up_s).map_err(recursion_options_error)?;
    let plan = live.plan();
    if args.recursion.start.is_some() && !plan.has_fixed_orders() {
        return Err(CliError::Usage(
            "--start leaves no warm-up in which to search for nk and orders; give --nk and --orders as single numbers, \
             such as --nk 29 --orders nd=1"
                .to_owned(),
        ));
    }
    let udp = args.udp.as_ref().map(Udp::bind).transpose()?;
    let session = Arc::new(Mutex::new(Session::new(args, asked, live)?));
    end_on_interrupt(&session);
    match udp {
        Some(udp) => run_over_udp(&udp, &session),
        None => run_over_pipes(&session),
    }
}

/// Reads lines from standard input and writes lines to standard output until the input ends.
fn run_over_pipes(session: &Mutex<Session>) -> Result<(), CliError> {
    let mut input = Lines::new(io::stdin().lock());
    let mut buffer = Vec::new();
    let broken = |e: io::Error| CliError::Stream(format!("standard input cannot be read: {e}"));
    while let Some(text) = input.next().map_err(broken)? {
        let mut session = lock(session);
        if !session.process_line(text)? {
            continue;
        }
        session.write(&mut buffer)?;
        let mut out = io::stdout().lock();
        match out.write_all(&buffer).and_then(|()| out.flush()) {
            Ok(()) => {}
            // The reader has closed the pipe.
            Err(e) if e.kind() == ErrorKind::BrokenPipe => process::exit(0),
            Err(e) => return Err(CliError::Stream(format!("standard output cannot be written: {e}"))),
        }
    }
    let session = lock(session);
    output::print_message(&session.summary());
    session.check_estimate()
}

/// Receives datagrams and sends datagrams until an interrupt.
fn run_over_udp(udp: &Udp, session: &Mutex<Session>) -> Result<(), CliError> {
    output::print_message(&format!("{udp}; an interrupt ends the stream."));
    let mut bytes = udp::datagram_buffer();
    let mut buffer = Vec::new();
    loop {
        let received = udp.receive(&mut bytes)?;
        let mut session = lock(session);
        session.process_datagram(received, |session, sequence| {
            match sequence {
                Some(sequence) => udp.send(session.estimate(sequence).bytes()),
                None => {
                    session.write(&mut buffer)?;
                    udp.send(&buffer);
                }
            }
            Ok(())
        })?;
    }
}

fn lock(session: &Mutex<Session>) -> MutexGuard<'_, Session> {
    session.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Ends the stream at an interrupt, with a summary, and with exit code 0 if there is an estimate. A line that is being
/// written is completed first. If the stream is busy for longer than [`INTERRUPT_WAIT`], it ends without a summary.
fn end_on_interrupt(session: &Arc<Mutex<Session>>) {
    let session = Arc::clone(session);
    interrupt::on_interrupt(move |_| {
        let asked = Instant::now();
        loop {
            if let Ok(session) = session.try_lock() {
                output::print_message(&session.summary());
                process::exit(match session.check_estimate() {
                    Ok(()) => 0,
                    Err(error) => {
                        output::print_message(&format!("error: {error}"));
                        i32::from(error.exit_code())
                    }
                });
            }
            // A start fit may be in progress, or the reader may be blocked. Lines are written in one piece, so no line
            // is truncated.
            if asked.elapsed() > INTERRUPT_WAIT {
                process::exit(0);
            }
            thread::sleep(Duration::from_millis(1));
        }
    });
}
