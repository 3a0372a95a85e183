//! Shares over cases, as tables.

use std::fmt::Write as _;

use super::{
    bases::OperatorKind,
    kinds::{Change, Kind},
    program::{EvaluationMethod, Outcome},
};

/// Numbers of cases by outcome.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Numbers {
    pub all: usize,
    pub wrong: usize,
    /// Number of results that are wrong and not flagged.
    pub silent: usize,
    /// Number of correct results that are flagged.
    pub useless: usize,
    pub refused: usize,
    /// Number of results with a fault reported at the right place.
    pub placed: usize,
}

impl Numbers {
    pub fn of<'a>(outcomes: impl IntoIterator<Item = &'a Outcome>) -> Self {
        let mut n = Self::default();
        for o in outcomes {
            let j = &o.judged;
            n.all += 1;
            n.wrong += usize::from(j.wrong);
            n.silent += usize::from(j.is_silently_wrong());
            n.useless += usize::from(!j.wrong && j.is_flagged());
            n.refused += usize::from(o.refusal.is_some());
            n.placed += usize::from(j.placed);
        }
        n
    }

    fn cell(self) -> String {
        match self.all {
            0 => "–".to_owned(),
            all => format!("{}, {}, {} of {all}", self.wrong, self.silent, self.useless),
        }
    }
}

fn percent(of: usize, all: usize) -> String {
    match all {
        0 => "–".to_owned(),
        _ => format!("{:.1} %", 100.0 * of as f64 / all as f64),
    }
}

/// Returns the median; `None` for no values.
pub fn median(mut all: Vec<f64>) -> Option<f64> {
    all.sort_by(f64::total_cmp);
    all.get(all.len() / 2).copied()
}

/// Returns the table by method, for the runs of the thesis and for the runs of people: the acceptance test.
pub fn table_by_method(all: &[Outcome]) -> String {
    let mut text = "| runs | method | results | wrong | wrong and not flagged | flagged, of those right | refused | \
                    fault reported at its place |\n|---|---|---|---|---|---|---|---|\n"
        .to_owned();
    let mut put = |runs: &str, name: &str, n: Numbers| {
        let _ = writeln!(
            text,
            "| {runs} | {name} | {} | {} | {} ({}) | {} | {} | {} |",
            n.all,
            percent(n.wrong, n.all),
            n.silent,
            percent(n.silent, n.all),
            percent(n.useless, n.all - n.wrong),
            n.refused,
            percent(n.placed, n.all)
        );
    };
    for (runs, of_people) in [("C1, C2", false), ("people", true)] {
        let such = |o: &&Outcome| (o.who == OperatorKind::Person) == of_people;
        for way in EvaluationMethod::ALL {
            let n = Numbers::of(all.iter().filter(such).filter(|o| o.way == way));
            // Not all methods are used for people.
            if !of_people || n.all > 0 {
                put(runs, way.name(), n);
            }
        }
        put(runs, "all", Numbers::of(all.iter().filter(such)));
    }
    text
}

/// Returns the table by kind and size, with one column per method.
pub fn table_by_fault(all: &[Outcome]) -> String {
    let mut text = format!(
        "| fault | size | {} |\n|---|---|{}\n",
        EvaluationMethod::ALL.map(EvaluationMethod::name).join(" | "),
        "---|".repeat(EvaluationMethod::ALL.len())
    );
    for (kind, size) in kinds_and_sizes(all) {
        let such = |o: &&Outcome| o.fault.kind == kind && o.fault.size == size;
        let first = all.iter().find(such).map(|o| o.fault.size_text()).unwrap_or_default();
        let cells =
            EvaluationMethod::ALL.map(|way| Numbers::of(all.iter().filter(such).filter(|o| o.way == way)).cell());
        let _ = writeln!(text, "| {} | {first} | {} |", kind.name(), cells.join(" | "));
    }
    text
}

/// Returns the table for trackers by kind and size: the median recovery time in s, and the number of runs without
/// recovery.
pub fn recovery_table(all: &[Outcome]) -> String {
    let trackers: Vec<EvaluationMethod> = EvaluationMethod::ALL
        .into_iter()
        .filter(|way| way.is_tracker())
        .collect();
    let names: Vec<&str> = trackers.iter().map(|way| way.name()).collect();
    let mut text = format!(
        "| fault | size | {} |\n|---|---|{}\n",
        names.join(" | "),
        "---|".repeat(names.len())
    );
    for (kind, size) in kinds_and_sizes(all) {
        let such = |o: &&Outcome| o.fault.kind == kind && o.fault.size == size;
        let cells: Vec<String> = trackers
            .iter()
            .map(|way| {
                let times = all
                    .iter()
                    .filter(such)
                    .filter(|o| o.way == *way)
                    .filter_map(|o| o.judged.recovery_s);
                let times: Vec<f64> = times.collect();
                let never = times.iter().filter(|t| t.is_infinite()).count();
                let n = times.len();
                match median(times) {
                    None => "–".to_owned(),
                    Some(t) if t.is_infinite() => format!("never; {never} of {n}"),
                    Some(t) => format!("{t:.1} s; {never} of {n}"),
                }
            })
            .collect();
        if cells.iter().any(|cell| cell != "–") {
            let first = all.iter().find(such).map(|o| o.fault.size_text()).unwrap_or_default();
            let _ = writeln!(text, "| {} | {first} | {} |", kind.name(), cells.join(" | "));
        }
    }
    text
}

/// Returns the table of false flags in clean runs, by kind of run and method.
pub fn clean_run_table(all: &[Outcome]) -> String {
    let mut text = "| runs | method | number | flagged by a fault | a fault reported | not trustworthy | wrong | wrong and not flagged |\n|---|---|---|---|---|---|---|---|\n".to_owned();
    let mut labels: Vec<&str> = all.iter().map(|o| o.label.as_str()).collect();
    labels.sort_unstable();
    labels.dedup();
    for label in labels.into_iter().map(Some).chain([None]) {
        let of = |way: Option<EvaluationMethod>| {
            let such = |o: &&Outcome| label.is_none_or(|l| o.label == l) && way.is_none_or(|w| o.way == w);
            all.iter().filter(such).collect::<Vec<_>>()
        };
        for way in EvaluationMethod::ALL.map(Some).into_iter().chain([None]) {
            let such = of(way);
            if such.is_empty() || (way.is_none() && label.is_some()) {
                continue;
            }
            let share = |yes: fn(&Outcome) -> bool| percent(such.iter().filter(|o| yes(o)).count(), such.len());
            let _ = writeln!(
                text,
                "| {} | {} | {} | {} | {} | {} | {} | {} |",
                label.unwrap_or("all"),
                way.map_or("all", EvaluationMethod::name),
                such.len(),
                share(|o| o.judged.of_faults),
                share(|o| o.judged.told > 0),
                share(|o| o.judged.level != "trustworthy"),
                share(|o| o.judged.wrong),
                share(|o| o.judged.is_silently_wrong()),
            );
        }
    }
    text
}

/// Kinds and sizes, in the order of the cases.
fn kinds_and_sizes(all: &[Outcome]) -> Vec<(Kind, f64)> {
    let mut found = Vec::new();
    for o in all {
        let key = (o.fault.kind, o.fault.size);
        if !found.contains(&key) {
            found.push(key);
        }
    }
    found
}

/// Returns one row per result.
pub fn to_csv(all: &[Outcome]) -> String {
    let mut text = "case,kind,size,place,run,method,wrong,flagged,silent,level,kinds,of_faults,told,placed,worst,errors,recovery_s,lasting,seconds,refusal\n".to_owned();
    for o in all {
        let j = &o.judged;
        let place = if o.fault.kind.what == Change::Nothing {
            String::new()
        } else {
            format!("{:?}", o.fault.place).to_lowercase()
        };
        let (worst, errors) = j.worst.clone().unwrap_or_default();
        let optional = |x: Option<f64>| x.map_or(String::new(), |x| format!("{x:.2}"));
        let refusal = o.refusal.as_deref().unwrap_or("").replace(['\n', ',', '"'], " ");
        let _ = writeln!(
            text,
            "{},{},{},{place},{},{},{},{},{},{},{},{},{},{},{worst},{errors:.2},{},{},{:.2},{}",
            o.case,
            o.fault.kind.name(),
            o.fault.size_text(),
            o.label.replace(", ", " "),
            o.way.name(),
            j.wrong,
            j.is_flagged(),
            j.is_silently_wrong(),
            j.level,
            j.kinds.join(" "),
            j.of_faults,
            j.told,
            j.placed,
            optional(j.recovery_s),
            optional(j.lasting),
            o.seconds,
            refusal.chars().take(200).collect::<String>()
        );
    }
    text
}
