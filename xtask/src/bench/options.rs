//! The options of `cargo xtask bench`.

pub const USAGE: &str = "cargo xtask bench [--only TASK,...] [--peers none|installed|install] [--rounds N] [--reproduce M] [--growth [--quick]] [--instructions [--keep]] [--dry]";

/// Which peers are run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Peers {
    None,
    Installed,
    Install,
}

/// Options that select the measurements.
#[derive(Debug, PartialEq)]
pub struct Options {
    pub only: Vec<String>,
    pub peers: Peers,
    pub rounds: usize,
    pub reproduce: Option<u64>,
    pub growth: bool,
    pub quick: bool,
    pub instructions: bool,
    pub keep: bool,
    pub dry: bool,
}

impl Options {
    pub fn parse_arguments(arguments: &[String]) -> Result<Self, String> {
        let mut options = Self {
            only: Vec::new(),
            peers: Peers::Installed,
            rounds: 2,
            reproduce: None,
            growth: false,
            quick: false,
            instructions: false,
            keep: false,
            dry: false,
        };
        let mut rest = arguments.iter();
        while let Some(argument) = rest.next() {
            let mut value = || rest.next().ok_or(format!("{argument} needs a value\nusage: {USAGE}"));
            let number = |text: &String| {
                text.parse::<u64>()
                    .map_err(|_| format!("{argument}: {text} is not a number"))
            };
            match argument.as_str() {
                "--only" => options.only = value()?.split(',').map(str::to_owned).collect(),
                "--peers" => {
                    options.peers = match value()?.as_str() {
                        "none" => Peers::None,
                        "installed" => Peers::Installed,
                        "install" => Peers::Install,
                        other => return Err(format!("--peers: found {other}; expected none, installed or install")),
                    }
                }
                "--rounds" => options.rounds = number(value()?)?.max(1) as usize,
                "--reproduce" => options.reproduce = Some(number(value()?)?),
                "--growth" => options.growth = true,
                "--quick" => options.quick = true,
                "--instructions" => options.instructions = true,
                "--keep" => options.keep = true,
                "--dry" => options.dry = true,
                _ => return Err(format!("unknown {argument}\nusage: {USAGE}")),
            }
        }
        Ok(options)
    }

    /// True if the task is selected.
    pub fn selects(&self, task: &str) -> bool {
        self.only.is_empty() || self.only.iter().any(|name| name == task)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(text: &str) -> Result<Options, String> {
        Options::parse_arguments(&text.split_whitespace().map(str::to_owned).collect::<Vec<_>>())
    }

    #[test]
    fn options_are_parsed_and_invalid_ones_refused() {
        let options = parse("--only arx,bj --peers none --rounds 3 --dry").unwrap();
        assert_eq!((options.peers, options.rounds, options.dry), (Peers::None, 3, true));
        assert!(options.selects("arx") && !options.selects("rls"));
        assert!(parse("").unwrap().selects("rls"));
        assert!(
            parse("--peers some")
                .unwrap_err()
                .contains("expected none, installed or install")
        );
        assert!(parse("--rounds").unwrap_err().contains("needs a value"));
        assert!(parse("--what").unwrap_err().contains("usage"));
    }
}
