//! `hoid lab`: a tracking experiment in the browser, compiled only with the feature `lab`.

use crate::{args::LabArgs, error::CliError};

#[cfg(not(feature = "lab"))]
pub fn run(_: &LabArgs) -> Result<(), CliError> {
    Err(CliError::Usage(
        "this program was built without the lab; build it with the lab: cargo install --path crates/hoid-cli --features lab"
            .to_owned(),
    ))
}

#[cfg(feature = "lab")]
pub fn run(args: &LabArgs) -> Result<(), CliError> {
    use hoid_lab::{Config, Lab, Mode, Server};

    use crate::output;

    let (mode, out) = match (&args.replay, args.calibrate) {
        (Some(folder), _) => {
            let out = folder.parent().and_then(std::path::Path::parent);
            (Mode::Replay(folder.clone()), out.unwrap_or(&args.out).to_owned())
        }
        (None, true) => (Mode::Calibrate, args.out.clone()),
        (None, false) => (Mode::Sessions, args.out.clone()),
    };
    let config = args
        .config
        .as_deref()
        .map_or_else(|| Ok(Config::default()), Config::read)?;
    let lab = Lab::open(&out, config, mode, std::env::current_exe().ok())?;
    let server = Server::new(lab, args.port)?;
    let address = server.address();
    output::print(&format!("{address}\n"))?;
    if args.open
        && let Err(error) = open(&server.single_use_address()?)
    {
        output::add_notice(
            "",
            format!("no browser could be opened ({error}): open the address yourself"),
        );
    }
    server.serve();
    Ok(())
}

/// Opens an address with the default program of the system.
#[cfg(feature = "lab")]
fn open(address: &str) -> std::io::Result<()> {
    use std::process::{Command, Stdio};

    let (program, first): (&str, &[&str]) = match std::env::consts::OS {
        "macos" => ("open", &[]),
        "windows" => ("cmd", &["/C", "start", ""]),
        _ => ("xdg-open", &[]),
    };
    let mut command = Command::new(program);
    command
        .args(first)
        .arg(address)
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()?;
    Ok(())
}
