//! Words that comments, help texts, messages and the book must not use.
//!
//! The readers are control engineers. The words in [`BANNED_WORDS`] occurred in sentences that such readers would
//! rewrite: metaphors of speaking, standing and believing, nouns made from questions, and archaic words. The table
//! contains a replacement for each word, which the check prints with the file and the line. Code spans (in backticks)
//! and format arguments are not prose.
//!
//! `cargo xtask check` applies the list to comments and string literals of Rust and Python sources, `cargo xtask words
//! --book` to the pages of the book, the README and ARCHITECTURE.md.

use std::{fs, path::Path, process::Command};

/// Words and phrases in lower case, with their replacements.
const BANNED_WORDS: [(&str, &str); 48] = [
    ("foretell", "predict"),
    ("foretells", "predicts"),
    ("foretold", "predicted"),
    ("foretelling", "predicting"),
    ("astray", "diverged"),
    ("mend", "repair"),
    ("mends", "repairs"),
    ("mended", "repaired"),
    ("mending", "repair"),
    ("somebody", "a person"),
    ("nobody", "no one, or the thing that is missing"),
    ("anybody", "anyone"),
    ("whoever", "the caller, the reader"),
    ("begin", "start"),
    ("begins", "starts"),
    ("began", "started"),
    ("begun", "started"),
    ("beginning", "start"),
    ("beside", "next to, compared with"),
    ("usual", "default, typical, common"),
    ("reference text", "thesis"),
    ("stands still", "stays constant"),
    ("stand still", "stay constant"),
    ("stood still", "stayed constant"),
    ("stands for", "represents"),
    ("stand for", "represent"),
    ("stood for", "represented"),
    ("stands in", "is in"),
    ("stands at", "is at"),
    ("says", "states, shows, reports"),
    ("say so", "report it"),
    ("is said", "is reported"),
    ("are said", "are reported"),
    ("was said", "was reported"),
    ("tells", "reports, shows"),
    ("is told", "is reported"),
    ("are told", "are reported"),
    ("was told", "was reported"),
    ("off the lines", "at non-excited frequencies"),
    ("sought", "searched"),
    ("anew", "again"),
    ("make no sense", "are not valid"),
    ("but for", "except for"),
    ("of now", "current"),
    ("looked for", "searched for"),
    ("looked at", "examined"),
    ("what is usual", "the default"),
    ("what is supposed", "the prior"),
];

/// Files that may contain words of the list, with the reasons.
const EXCEPTIONS: [(&str, &str); 2] = [
    ("xtask/src/words.rs", "the list itself"),
    ("crates/hoid-thesis/src/claims/", "quotations"),
];

/// Checks comments and string literals of the sources.
///
/// # Errors
/// The words found, with the file and the line.
pub fn check() -> Result<(), String> {
    let of_sources = |path: &str| path.ends_with(".rs") || path.ends_with(".py") || path.ends_with(".pyi");
    report(&find_banned_words(of_sources)?)
}

/// Checks the book, the README and ARCHITECTURE.md.
///
/// # Errors
/// The words found, with the file and the line.
pub fn check_book() -> Result<(), String> {
    let of_book = |path: &str| {
        path == "README.md" || path == "ARCHITECTURE.md" || path.starts_with("docs/src/") && path.ends_with(".md")
    };
    report(&find_banned_words(of_book)?)
}

fn report(found: &[String]) -> Result<(), String> {
    match found.len() {
        0 => Ok(()),
        n => Err(format!(
            "{}\n{n} words that prose does not use (xtask/src/words.rs)",
            found.join("\n")
        )),
    }
}

fn find_banned_words(counts: impl Fn(&str) -> bool) -> Result<Vec<String>, String> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let listed = Command::new("git")
        .args(["ls-files"])
        .current_dir(&root)
        .output()
        .map_err(|e| format!("git ls-files: {e}"))?;
    let paths = String::from_utf8_lossy(&listed.stdout).into_owned();
    let mut found = Vec::new();
    for path in paths.lines().filter(|path| counts(path)) {
        if EXCEPTIONS.iter().any(|(start, _)| path.starts_with(start)) {
            continue;
        }
        let text = fs::read_to_string(root.join(path)).map_err(|e| format!("{path}: {e}"))?;
        let prose = match path.rsplit('.').next() {
            Some("rs") => rust_prose(&text),
            Some("md") => markdown_prose(&text),
            _ => python_prose(&text),
        };
        for (line, words) in prose {
            for (banned, instead) in banned_words(&words) {
                found.push(format!("{path}:{line}: {banned:?}; write {instead}"));
            }
        }
    }
    Ok(found)
}

/// Returns the banned words in a line of prose, with their replacements.
fn banned_words(prose: &str) -> Vec<(&'static str, &'static str)> {
    let words: Vec<String> = strip_code(prose)
        .to_lowercase()
        .split(|c: char| !(c.is_alphanumeric() || c == '_' || c == '\\' || c == '-'))
        .filter(|word| !word.is_empty())
        .map(str::to_owned)
        .collect();
    let is_there = |phrase: &str| {
        let phrase: Vec<&str> = phrase.split(' ').collect();
        words
            .windows(phrase.len())
            .any(|window| window.iter().eq(phrase.iter()))
    };
    BANNED_WORDS
        .into_iter()
        .filter(|(phrase, _)| is_there(phrase))
        .collect()
}

/// Removes text in backticks or braces.
fn strip_code(line: &str) -> String {
    let (mut prose, mut in_code, mut depth) = (String::new(), false, 0_u32);
    for c in line.chars() {
        match c {
            '`' => in_code = !in_code,
            '{' if !in_code => depth += 1,
            '}' if !in_code => depth = depth.saturating_sub(1),
            _ if in_code || depth > 0 => {}
            _ => prose.push(c),
        }
    }
    prose
}

/// Returns the comments and the string literals that contain a space, by line. Code blocks in documentation comments
/// are not prose.
fn rust_prose(text: &str) -> Vec<(usize, String)> {
    let (mut prose, mut in_text, mut in_block) = (Vec::new(), false, false);
    for (number, line) in (1..).zip(text.lines()) {
        let bare = line.trim_start();
        if !in_text && bare.starts_with("//") {
            let comment = bare.trim_start_matches('/').trim_start_matches('!');
            if comment.trim_start().starts_with("```") {
                in_block = !in_block;
            } else if !in_block {
                prose.push((number, comment.to_owned()));
            }
            continue;
        }
        in_block = false;
        let (mut part, mut escaped, mut before) = (String::new(), false, ' ');
        let mut characters = line.chars().peekable();
        while let Some(c) = characters.next() {
            match c {
                _ if escaped => {
                    escaped = false;
                    part.push(if c == '\\' { c } else { ' ' });
                }
                '\\' if in_text => escaped = true,
                '"' if in_text => {
                    in_text = false;
                    if part.trim().contains(' ') {
                        prose.push((number, std::mem::take(&mut part)));
                    }
                    part.clear();
                }
                // This is a quotation mark in a character literal.
                '"' if before == '\'' => {}
                '"' => in_text = true,
                '/' if !in_text && characters.peek() == Some(&'/') => {
                    prose.push((number, characters.by_ref().collect()));
                }
                _ if in_text => part.push(c),
                _ => {}
            }
            before = c;
        }
        if in_text && part.trim().contains(' ') {
            prose.push((number, part));
        }
    }
    prose
}

/// Returns comments and strings in triple quotes, by line.
fn python_prose(text: &str) -> Vec<(usize, String)> {
    let (mut prose, mut in_text) = (Vec::new(), false);
    for (number, line) in (1..).zip(text.lines()) {
        let marks = line.matches("\"\"\"").count();
        if in_text || marks > 0 {
            prose.push((number, line.to_owned()));
        } else if let Some((_, comment)) = line.split_once("# ") {
            prose.push((number, comment.to_owned()));
        }
        in_text ^= marks % 2 == 1;
    }
    prose
}

/// Returns the lines outside code blocks.
fn markdown_prose(text: &str) -> Vec<(usize, String)> {
    let mut in_block = false;
    let mut prose = Vec::new();
    for (number, line) in (1..).zip(text.lines()) {
        if line.trim_start().starts_with("```") {
            in_block = !in_block;
        } else if !in_block {
            prose.push((number, line.to_owned()));
        }
    }
    prose
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn banned_words_are_found_only_in_prose() {
        let source = "/// Begins `begin` here.\nlet begins = \"it says so\"; // sought\n/// ```\n/// begin\n/// ```\nlet c = '\"';\n";
        let found: Vec<(usize, Vec<&str>)> = (rust_prose(source).into_iter())
            .map(|(line, prose)| (line, banned_words(&prose).into_iter().map(|(word, _)| word).collect()))
            .collect();
        assert_eq!(found, [(1, vec!["begins"]), (2, vec!["says"]), (2, vec!["sought"])]);
        assert!(banned_words("\\begin{tabular} of a recording that is noteworthy").is_empty());
        assert!(banned_words("the usual {usual} one").contains(&("usual", "default, typical, common")));
    }

    #[test]
    fn prose_of_markdown_and_python_is_extracted() {
        assert_eq!(markdown_prose("a\n```\nbegin\n```\nb").len(), 2);
        let package = "begin = 1  # it begins\n\"\"\"Doc\nbegin\n\"\"\"\nx = 1\n";
        assert_eq!(python_prose(package).len(), 4);
    }
}
