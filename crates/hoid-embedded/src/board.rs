//! Processor without an operating system: entry point, file access and output by semihosting, and stack usage.
#![allow(unsafe_code)]

use cortex_m_rt::entry;
use semihosting::{fs::File, io::Read, println, process};

use crate::run;

unsafe extern "C" {
    /// Upper and lower ends of the stack, defined by the linker.
    static _stack_start: u32;
    static _stack_end: u32;
}

/// Pattern that marks unused stack (`cortex-m-rt`, `paint-stack`).
const STACK_PAINT: u32 = 0xcccc_cccc;

#[entry]
fn main() -> ! {
    match run_and_report() {
        Ok(()) => {
            println!("# state {} bytes, stack {} bytes", run::STATE_BYTES, used_stack_bytes());
            process::exit(0)
        }
        Err(message) => {
            println!("# {message}");
            process::exit(1)
        }
    }
}

#[inline(never)]
fn run_and_report() -> Result<(), &'static str> {
    let mut file = File::open(run::FILE_NAME).map_err(|_| run::UNREADABLE_MESSAGE)?;
    run::run(
        |bytes| file.read(bytes).map_err(|_| run::UNREADABLE_MESSAGE),
        |line| {
            println!("{line}");
            Ok(())
        },
    )
}

/// Returns the number of bytes of the stack that have been written.
fn used_stack_bytes() -> usize {
    let (top, bottom) = (&raw const _stack_start, &raw const _stack_end);
    let words = (top as usize - bottom as usize) / size_of::<u32>();
    // SAFETY: both pointers are ends of one region of the board's memory, which contains `words` aligned words. The
    // reads are volatile, since the upper part of the stack is in use; this part is not read, because the loop ends at
    // the first word that has been written.
    let painted = (0..words)
        .take_while(|i| unsafe { bottom.add(*i).read_volatile() } == STACK_PAINT)
        .count();
    (words - painted) * size_of::<u32>()
}
