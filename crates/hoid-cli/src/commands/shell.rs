//! `hoid completions` and `hoid man`: shell completions and manual pages, generated from the
//! definitions of the arguments.

use clap::Command;
use clap_complete::generate;
use clap_mangen::Man;
use hoid::io::{make_directory, write_atomically};

use crate::{
    args::{self, CompletionsArgs, ManArgs},
    error::CliError,
    output,
};

/// Writes the completions of a shell to standard output.
pub fn completions(args: &CompletionsArgs) -> Result<(), CliError> {
    let mut text = Vec::new();
    generate(args.shell, &mut args::command(), "hoid", &mut text);
    output::print(&String::from_utf8_lossy(&text))
}

/// Writes one page for the program and one for each command.
pub fn man(args: &ManArgs) -> Result<(), CliError> {
    make_directory(&args.directory)?;
    let mut program = args::command();
    program.build();
    let mut written = 0;
    let mut write = |command: Command, name: &str| -> Result<(), CliError> {
        let mut page = Vec::new();
        let titled = Man::new(command).title(name.to_uppercase());
        titled.render(&mut page).map_err(CliError::Output)?;
        write_atomically(&args.directory.join(format!("{name}.1")), |file| file.write_all(&page))?;
        written += 1;
        Ok(())
    };
    let commands: Vec<Command> = program
        .get_subcommands()
        .filter(|c| c.get_name() != "help")
        .cloned()
        .collect();
    write(program, "hoid")?;
    for command in commands {
        let name = format!("hoid-{}", command.get_name());
        write(command.display_name(name.clone()), &name)?;
    }
    output::print(&format!(
        "{written} pages in {}; read one with: man -l FILE\n",
        args.directory.display()
    ))
}
