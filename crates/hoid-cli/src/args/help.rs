//! Help pages: `hoid -h` lists the commands by purpose; `hoid COMMAND -h` shows the
//! options that most people need, under headings, and two examples; `--help` shows everything.
//!
//! The tables here contain only names of commands and options; the help text of an option is in its
//! definition. A test compares the tables with the definitions and parses every example.

use clap::{Arg, Command, CommandFactory};

use super::Cli;

/// Help for a command other than its options.
struct Help {
    command: &'static str,
    examples: &'static [&'static str],
    /// Options that `-h` shows; all if the list is empty.
    shown: &'static [&'static str],
}

/// The commands by purpose, in the order of the first page.
const COMMAND_GROUPS: [(&str, &[&str]); 4] = [
    (
        "Recordings",
        &[
            "info", "identify", "describe", "track", "stream", "lab", "group", "compare", "fmu",
        ],
    ),
    (
        "Simulation, models",
        &["demo", "design", "simulate", "simulate-group", "convert", "margins"],
    ),
    ("Studies", &["study", "reproduce"]),
    ("This program", &["completions", "man", "help"]),
];

const COMMAND_HELP: [Help; 19] = [
    Help {
        command: "lab",
        examples: &["hoid lab --open", "hoid lab --config lab.toml --out study"],
        shown: &[],
    },
    Help {
        command: "info",
        examples: &[
            "hoid info run.csv --controlled-element '1/(s(s+1))'",
            "hoid info run.mat --json",
        ],
        shown: &[],
    },
    Help {
        command: "identify",
        examples: &[
            "hoid identify run.csv --controlled-element '90/(s(s+6))' --figure bode.svg",
            "hoid identify run1.csv run2.csv --structure bj --nk 0.2s..0.4s --report out",
        ],
        shown: &[
            "input",
            "output",
            "fs",
            "from",
            "to",
            "unit",
            "structure",
            "orders",
            "nk",
            "scale",
            "excitation",
            "controlled_element",
            "answers",
            "figure",
            "table",
            "report",
            "verbose",
            "json",
        ],
    },
    Help {
        command: "describe",
        examples: &[
            "hoid describe run1.csv run2.csv --excitation f_t",
            "hoid describe run.csv --controlled-element '90/(s(s+6))' --figure bode.svg --width 85mm",
        ],
        shown: &[
            "input",
            "output",
            "fs",
            "from",
            "to",
            "faults",
            "excitation",
            "period",
            "controlled_element",
            "figure",
            "width",
            "table",
            "verbose",
            "json",
        ],
    },
    Help {
        command: "track",
        examples: &[
            "hoid track run.csv --out trace.csv",
            "hoid track run.csv --at 1,2.5 --controlled-element '90/(s(s+6))' --out trace.csv --report out",
        ],
        shown: &[
            "input",
            "output",
            "fs",
            "from",
            "to",
            "unit",
            "method",
            "structure",
            "orders",
            "nk",
            "prior",
            "at",
            "controlled_element",
            "start_span",
            "out",
            "figure",
            "report",
            "verbose",
            "json",
        ],
    },
    Help {
        command: "stream",
        examples: &[
            "recorder | hoid stream --fs 100 --every 10",
            "hoid stream --fs 100 --method rls --memory 2s < run.csv",
        ],
        shown: &[
            "fs",
            "input",
            "output",
            "method",
            "structure",
            "orders",
            "nk",
            "prior",
            "at",
            "controlled_element",
            "memory",
            "warm_up",
            "every",
            "udp",
        ],
    },
    Help {
        command: "fmu",
        examples: &[
            "hoid fmu --out tracker.fmu --controlled-element '90/(s(s+6))'",
            "hoid fmu --operator C4 --seed 3 --out person.fmu",
        ],
        shown: &[],
    },
    Help {
        command: "group",
        examples: &["hoid group init runs", "hoid group runs --out results"],
        shown: &[],
    },
    Help {
        command: "compare",
        examples: &[
            "hoid compare results",
            "hoid compare results --factor 'plant:H1=C1r,C1p;H2=C2r,C2p' --of crossover,tau_e --out comparison",
        ],
        shown: &[
            "factor",
            "within",
            "between",
            "of",
            "covariate",
            "adjust",
            "out",
            "figure",
            "table",
            "verbose",
            "json",
        ],
    },
    Help {
        command: "design",
        examples: &[
            "hoid design --controlled-element '4/s' --for tau_e=5%,crossover=3%",
            "hoid design --people results --difference crossover=.5 --against reference --out design",
        ],
        shown: &[
            "people",
            "controlled_element",
            "wanted",
            "difference",
            "disturbance",
            "length",
            "runs",
            "max_rms_e",
            "max_u",
            "against",
            "out",
            "json",
        ],
    },
    Help {
        command: "demo",
        examples: &["hoid demo", "hoid demo --out first --seed 2"],
        shown: &[],
    },
    Help {
        command: "simulate",
        examples: &[
            "hoid simulate --condition C4 --out run.csv",
            "hoid simulate --scenario mine.toml --seed 3 --out run.parquet",
        ],
        shown: &[
            "condition",
            "scenario",
            "remnant_order",
            "noise_level",
            "sample_time",
            "seed",
            "out",
        ],
    },
    Help {
        command: "simulate-group",
        examples: &[
            "hoid simulate-group --people --out runs",
            "hoid simulate-group --subjects 5 --conditions C1,C4 --out runs",
        ],
        shown: &[
            "out",
            "people",
            "plants",
            "trouble",
            "subjects",
            "conditions",
            "runs",
            "seed",
        ],
    },
    Help {
        command: "convert",
        examples: &[
            "hoid convert --f -1.91,0.92 --b 0.044,-0.043 --nk 29",
            "hoid convert --operator K_e=.09,T_L=.4,omega_nm=11.25,zeta_nm=.35,tau_e=.28",
        ],
        shown: &[],
    },
    Help {
        command: "margins",
        examples: &[
            "hoid margins --condition C1",
            "hoid margins --scenario mine.toml --state last",
        ],
        shown: &[],
    },
    Help {
        command: "study",
        examples: &["hoid study check plan.toml", "hoid study run plan.toml --out results"],
        shown: &[],
    },
    Help {
        command: "reproduce",
        examples: &[
            "hoid reproduce --only fig-5,table-2 --replications 10 --out figures",
            "hoid reproduce --only experiment --recordings recordings --out experiment",
        ],
        shown: &[],
    },
    Help {
        command: "completions",
        examples: &["hoid completions bash > hoid.bash", "hoid completions zsh > _hoid"],
        shown: &[],
    },
    Help {
        command: "man",
        examples: &["hoid man man1", "man -l man1/hoid-identify.1"],
        shown: &[],
    },
];

/// Headings of options that several commands share; other options are under the heading Model.
const OPTION_HEADINGS: [(&str, &[&str]); 2] = [
    (
        "Data",
        &[
            "input",
            "output",
            "time",
            "trial",
            "fs",
            "udp",
            "from",
            "to",
            "unit",
            "resample",
            "fill",
            "sparse",
            "columns",
            "drop_repeated",
            "scale",
            "offset",
            "decimate",
            "new_fs",
            "run_in",
            "detrend",
            "mask",
            "shortest",
            "faults",
            "excitation",
            "period",
            "lines",
            "largest",
        ],
    ),
    (
        "Results",
        &[
            "controlled_element",
            "validate",
            "update_covariance",
            "horizon",
            "figure",
            "width",
            "table",
            "trace",
            "out",
            "report",
            "batch",
            "every",
            "moving_average",
            "verbose",
            "json",
        ],
    ),
];

/// The commands whose options are under headings.
const COMMANDS_WITH_HEADINGS: [&str; 4] = ["identify", "describe", "track", "stream"];

/// Returns the definition of the program, with its help.
pub fn command() -> Command {
    let mut program = Cli::command().mut_subcommands(add_help);
    let page = first_page(&mut program);
    program.help_template(page)
}

fn add_help(command: Command) -> Command {
    let name = command.get_name().to_owned();
    let Some(help) = COMMAND_HELP.iter().find(|help| help.command == name) else {
        return command;
    };
    let examples: String = help.examples.iter().map(|line| format!("  {line}\n")).collect();
    let command = command.after_help(format!("Examples:\n{examples}"));
    let command = command.mut_subcommands(|inner| inner.mut_args(ignore_case));
    command.mut_args(|arg| add_argument_help(arg, help))
}

/// Accepts choices in capitals as well.
fn ignore_case(arg: Arg) -> Arg {
    let takes_value = arg.get_action().takes_values();
    arg.ignore_case(takes_value)
}

/// Adds the heading of an option, and hides rarely needed options from `-h`; `--help` shows them.
fn add_argument_help(arg: Arg, help: &Help) -> Arg {
    let id = arg.get_id().as_str().to_owned();
    let hidden = !arg.is_positional() && !help.shown.is_empty() && !help.shown.contains(&id.as_str());
    let arg = ignore_case(arg).hide_short_help(hidden);
    if !COMMANDS_WITH_HEADINGS.contains(&help.command) || arg.is_positional() {
        return arg;
    }
    let heading = OPTION_HEADINGS.iter().find(|(_, ids)| ids.contains(&id.as_str()));
    arg.help_heading(heading.map_or("Model", |(heading, _)| heading))
}

/// Returns the first help page, which lists the commands by purpose.
fn first_page(program: &mut Command) -> String {
    let about = |name: &str| {
        let command = program.get_subcommands().find(|c| c.get_name() == name);
        let text = command.and_then(Command::get_about).map(ToString::to_string);
        text.unwrap_or_else(|| "Show help for a command".to_owned())
    };
    let mut page = "{about-with-newline}\n{usage-heading} {usage}\n".to_owned();
    for (heading, commands) in COMMAND_GROUPS {
        page.push_str(&format!("\n{heading}:\n"));
        for name in commands {
            page.push_str(&format!("  {name:<15} {}\n", about(name)));
        }
    }
    page.push_str("\nOptions:\n{options}\n\nExamples:\n  hoid demo\n  hoid identify run.csv --input e --output u\n");
    page
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;

    /// Returns the arguments that a shell would pass to the program in an example.
    fn shell_words(example: &str) -> Vec<String> {
        let (_, typed) = example.split_once("hoid ").unwrap();
        let typed = typed.split([' ']).take_while(|word| !["<", ">", "|"].contains(word));
        std::iter::once("hoid".to_owned())
            .chain(typed.map(|word| word.replace('\'', "")))
            .collect()
    }

    #[test]
    fn help_tables_match_the_commands_and_options() {
        let program = Cli::command();
        let known: BTreeSet<&str> = program.get_subcommands().map(Command::get_name).collect();
        let grouped: BTreeSet<&str> = COMMAND_GROUPS
            .iter()
            .flat_map(|(_, names)| names.iter().copied())
            .collect();
        assert_eq!(
            grouped
                .into_iter()
                .filter(|name| *name != "help")
                .collect::<BTreeSet<_>>(),
            known
        );
        assert_eq!(
            COMMAND_HELP.iter().map(|help| help.command).collect::<BTreeSet<_>>(),
            known
        );
        for help in &COMMAND_HELP {
            let command = program.find_subcommand(help.command).unwrap();
            let ids: Vec<&str> = command.get_arguments().map(|arg| arg.get_id().as_str()).collect();
            for id in help.shown {
                assert!(ids.contains(id), "{} has no option {id}", help.command);
            }
        }
    }

    #[test]
    fn every_example_parses() {
        for help in &COMMAND_HELP {
            assert_eq!(help.examples.len(), 2, "{}", help.command);
            for example in help.examples.iter().filter(|example| !example.starts_with("man ")) {
                let parsed = command().try_get_matches_from(shell_words(example));
                assert!(parsed.is_ok(), "{example}: {}", parsed.unwrap_err());
            }
        }
    }

    #[test]
    fn short_help_is_short() {
        let mut program = command().term_width(80);
        program.build();
        let lines = program.render_help().to_string().lines().count();
        assert!(lines <= 40, "{lines}");
        for inner in program.get_subcommands_mut() {
            let help = inner.render_help().to_string();
            assert!(
                help.lines().count() <= 75,
                "{} has {} lines",
                inner.get_name(),
                help.lines().count()
            );
        }
    }

    /// `-h` shows every option that the README and the first page of the book use.
    #[test]
    fn short_help_has_the_options_of_the_first_pages() {
        let mut program = command();
        program.build();
        let pages = [
            include_str!("../../../../README.md"),
            include_str!("../../../../docs/src/guides/first-run.md"),
        ];
        let typed = pages.iter().flat_map(|page| page.lines());
        let calls: Vec<Vec<&str>> = typed
            .filter_map(|line| {
                line.strip_prefix("hoid ")
                    .or_else(|| line.strip_prefix("cargo run --release -- "))
            })
            .map(|call| call.split(' ').collect())
            .collect();
        assert!(calls.len() > 5, "{} calls", calls.len());
        for call in calls {
            let Some(inner) = program.find_subcommand_mut(call[0]) else {
                continue;
            };
            let help = inner.render_help().to_string();
            for option in call.iter().filter(|word| word.starts_with("--")) {
                assert!(help.contains(option), "hoid {} -h lacks {option}", call[0]);
            }
        }
    }

    #[test]
    fn choices_ignore_case() {
        let typed = "hoid identify run.csv --structure BJ --criterion Aic --method PEM";
        assert!(command().try_get_matches_from(typed.split(' ')).is_ok());
    }
}
