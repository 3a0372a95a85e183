//! Input files of the calls. A modification of a table is a word followed by numbers; `test_golden.py` has the same
//! modifications.

use std::{fs, path::Path};

use super::{answer::run, manifest::Input};

pub fn write(at: &Path, inputs: &[Input]) {
    for input in inputs {
        let path = at.join(&input.file);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        if let Some(options) = &input.simulate {
            run_successfully(at, &format!("simulate {options} --out {}", input.file));
        } else if let Some(command) = &input.command {
            let printed = run_successfully(at, command);
            if !path.exists() {
                fs::write(&path, printed).unwrap();
            }
        } else if let Some(text) = &input.text {
            fs::write(&path, text).unwrap();
        } else {
            let of = input.of.as_ref().unwrap_or_else(|| panic!("{}: of what?", input.file));
            let text = fs::read_to_string(at.join(of)).unwrap();
            fs::write(&path, modify_table(&text, input)).unwrap();
        }
    }
}

fn run_successfully(at: &Path, command: &str) -> Vec<u8> {
    let done = run(at, command, None);
    let printed = String::from_utf8_lossy(&done.stderr);
    assert!(matches!(done.status.code(), Some(0 | 1)), "{command}: {printed}");
    done.stdout
}

/// Applies the modifications to the columns and rows of a table, in order.
fn modify_table(text: &str, input: &Input) -> String {
    let mut lines = text.lines().filter(|line| !line.starts_with('#'));
    let names: Vec<&str> = lines.next().unwrap().split(',').collect();
    let indices: Vec<usize> = input
        .columns
        .iter()
        .map(|name| names.iter().position(|n| n == name).unwrap())
        .collect();
    let mut rows: Vec<Vec<Option<f64>>> = lines
        .map(|line| {
            let cells: Vec<&str> = line.split(',').collect();
            indices.iter().map(|c| cells[*c].parse().ok()).collect()
        })
        .collect();
    if let Some([from, to]) = input.rows {
        rows = rows[from..to.min(rows.len())].to_vec();
    }
    let mut header = input.columns.clone();
    for change in &input.change {
        apply(change, &mut header, &mut rows);
    }
    let cell = |value: &Option<f64>| value.map_or(String::new(), |v| v.to_string());
    let line = |row: &Vec<Option<f64>>| row.iter().map(cell).collect::<Vec<_>>().join(",") + "\n";
    header.join(",") + "\n" + &rows.iter().map(line).collect::<String>()
}

fn apply(change: &str, header: &mut [String], rows: &mut Vec<Vec<Option<f64>>>) {
    let words: Vec<&str> = change.split(' ').collect();
    let column = || header.iter().position(|name| name == words[1]).unwrap();
    let number = |at: usize| words[at].parse::<f64>().unwrap();
    let index = |at: usize| words[at].parse::<usize>().unwrap();
    let mut each = |of: &dyn Fn(f64) -> f64| {
        let c = column();
        rows.iter_mut().for_each(|row| row[c] = row[c].map(of));
    };
    match words[0] {
        "clip" => each(&|v| v.clamp(-number(2), number(2))),
        "scale" => each(&|v| v * number(2)),
        "add" => each(&|v| v + number(2)),
        "round" => each(&|v| (v / number(2)).round_ties_even() * number(2)),
        "hold" => {
            let (c, from) = (column(), index(2));
            for k in from..index(3) {
                rows[k][c] = rows[from][c];
            }
        }
        "set" => {
            let c = column();
            rows[index(2)][c] = Some(number(3));
        }
        "blank" => {
            let c = column();
            rows[index(2)..index(3)].iter_mut().for_each(|row| row[c] = None);
        }
        "late" => {
            let c = column();
            for k in (index(2)..rows.len()).rev() {
                rows[k][c] = rows[k - index(2)][c];
            }
        }
        "gap" => {
            rows.drain(index(1)..index(2));
        }
        "repeat" => {
            let row = rows[index(1)].clone();
            rows.insert(index(1), row);
        }
        "rename" => {
            let c = column();
            header[c] = words[2].to_owned();
        }
        other => panic!("no such change: {other}"),
    }
}
