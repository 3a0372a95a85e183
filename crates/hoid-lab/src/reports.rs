//! Pages about a session, created by running the program `hoid`: the results of `identify`, `track` and `describe` for
//! each run, and the results of `group` for all people so far. The program runs in a separate process on one core, so
//! it can neither abort nor delay an experiment.

use std::{
    path::{Path, PathBuf},
    process::Command,
};

use hoid_study::group::MANIFEST_FILE;

use crate::{
    LabError,
    config::Config,
    record::TARGET_CHANNEL,
    session::{RunEnd, Session, Stem},
};

/// Folder of the results of `hoid group` within the experiment.
const GROUP_FOLDER: &str = "group";

/// Titles and paths of the existing pages.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Pages(Vec<(String, String)>);

impl Pages {
    /// Returns the titles and paths of the pages.
    pub fn links(&self) -> Vec<(String, String)> {
        self.0.clone()
    }
}

/// Commands that are executed for each run; each command writes to a folder with its name.
const COMMANDS: [&str; 3] = ["identify", "track", "describe"];

/// Creates the missing pages of all finished runs except training runs, then the page of the group; `each` is called
/// after every page of a run.
pub fn make_pages(program: &Path, out: &Path, folder: &Path, each: &dyn Fn(&Pages)) -> Pages {
    let Ok(session) = Session::read(folder) else {
        return Pages::default();
    };
    let runs = session
        .finished_runs
        .iter()
        .filter(|done| done.how == RunEnd::Finished && !done.training);
    for done in runs {
        let stem = session.stem(&done.condition, done.number);
        for name in COMMANDS {
            let page = stem.report_folder().join(name).join("report.html");
            if !page.exists() && stem.file("beh.parquet").exists() {
                make_run_page(program, &session.plan.config, &stem, name);
                each(&existing_pages(folder));
            }
        }
    }
    if out.join(MANIFEST_FILE).exists() {
        let location = out.join(GROUP_FOLDER);
        let mut command = hoid_command(program);
        command
            .arg("group")
            .arg(out.join(MANIFEST_FILE))
            .arg("--out")
            .arg(&location);
        run_command(&mut command, &location, "group");
    }
    existing_pages(folder)
}

fn hoid_command(program: &Path) -> Command {
    let mut command = Command::new(program);
    command.env("RAYON_NUM_THREADS", "1").env("COLUMNS", "100");
    command
}

/// Creates one page for a run.
fn make_run_page(program: &Path, config: &Config, stem: &Stem, name: &str) {
    let location = stem.report_folder().join(name);
    let mut command = hoid_command(program);
    command.arg(name).arg(stem.file("beh.parquet")).args(["--from", "0"]);
    let run_start = crate::session::RunStart::read(stem).ok();
    let condition = run_start.as_ref().map(|run_start| &run_start.condition);
    let course = condition.and_then(|condition| condition.task_definition().ok());
    let role_of_target =
        (condition.zip(course.as_ref())).and_then(|(condition, course)| condition.target_role_in(course));
    // Margins are defined only for a constant controlled element.
    let element = course
        .filter(|course| course.change_s().is_none())
        .and_then(|course| course.element_at(0.0).ok());
    match name {
        "track" => {
            command.args(["--method", &config.method, "--every", "5"]);
            command
                .arg("--out")
                .arg(location.join("trace.parquet"))
                .arg("--report")
                .arg(&location);
        }
        "identify" => {
            if let Some(role) = role_of_target {
                command.args(["--input", "e", "--input", TARGET_CHANNEL]);
                command.arg(format!("--role={TARGET_CHANNEL}={role}"));
            }
            command.arg("--report").arg(&location);
        }
        _ => {
            command.arg("--figure").arg(location.join("figure.svg"));
        }
    }
    if let Some(element) = element.filter(|_| name != "track") {
        command.arg(format!("--controlled-element={element}"));
    }
    run_command(&mut command, &location, name);
}

/// Runs a command; if it creates no page, a page is created from its output.
fn run_command(command: &mut Command, location: &Path, name: &str) {
    let made = hoid_io::make_directory(location)
        .map_err(LabError::from)
        .and_then(|()| {
            command
                .output()
                .map_err(|error| LabError::Report(format!("hoid {name} cannot be run: {error}")))
        });
    let (out, wrong) = match made {
        Ok(output) => (
            String::from_utf8_lossy(&output.stdout).into_owned(),
            String::from_utf8_lossy(&output.stderr).into_owned(),
        ),
        Err(error) => (String::new(), error.to_string()),
    };
    let page = location.join("report.html");
    if page.exists() {
        return;
    }
    let figure = if location.join("figure.svg").exists() {
        "<p><img src=\"figure.svg\" alt=\"Figure\"></p>\n"
    } else {
        ""
    };
    let html = format!(
        "<!doctype html>\n<html lang=\"en\"><meta charset=\"utf-8\"><title>hoid {name}</title>\n\
         <style>body{{font:15px/1.5 system-ui,sans-serif;margin:2rem auto;max-width:60rem;padding:0 1rem;\
         color-scheme:light dark}}pre{{overflow-x:auto}}img{{max-width:100%;background:#fff}}</style>\n\
         <h1>hoid {name}</h1>\n{figure}<pre>{}</pre>\n<pre>{}</pre>\n</html>\n",
        escape_html(&out),
        escape_html(&wrong)
    );
    // If the page cannot be written, its link is missing, which indicates the failure.
    let _ = hoid_io::write_atomically(&page, |file| file.write_all(html.as_bytes()));
}

fn escape_html(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}

/// Returns the existing pages.
pub fn existing_pages(folder: &Path) -> Pages {
    let mut pages = Vec::new();
    for (number, stem) in Stem::find_all(folder).unwrap_or_default() {
        for name in COMMANDS {
            if stem.report_folder().join(name).join("report.html").exists() {
                pages.push((
                    format!("run {number}: {name}"),
                    format!("reports/{}/{name}/report.html", stem.text()),
                ));
            }
        }
    }
    let out = folder.parent().and_then(Path::parent);
    if out.is_some_and(|out| out.join(GROUP_FOLDER).join("report.html").exists()) {
        pages.push((
            "all people so far: group".to_owned(),
            format!("reports/{GROUP_FOLDER}/report.html"),
        ));
    }
    Pages(pages)
}

/// Returns a file of the pages with its media type; `None` if a name is not valid or the file does not exist. Names may
/// contain letters, digits, `-`, `_` and dots, but no leading dot, so that no name refers to a file outside its folder.
///
/// # Errors
/// Errors of reading the files.
pub fn read_page(folder: &Path, out: &Path, names: &[&str]) -> Result<Option<(Vec<u8>, &'static str)>, LabError> {
    let sound = |name: &&str| {
        let known = |b: u8| b.is_ascii_alphanumeric() || b"-_.".contains(&b);
        !name.is_empty() && !name.starts_with('.') && name.bytes().all(known)
    };
    if !names.iter().all(sound) || names.len() > 4 {
        return Ok(None);
    }
    let path: PathBuf = match names {
        [GROUP_FOLDER, rest @ ..] => rest.iter().fold(out.join(GROUP_FOLDER), |path, name| path.join(name)),
        _ => names.iter().fold(folder.join("reports"), |path, name| path.join(name)),
    };
    let kind = match path.extension().and_then(|end| end.to_str()) {
        Some("html") => "text/html; charset=utf-8",
        Some("svg") => "image/svg+xml",
        Some("csv" | "txt") => "text/plain; charset=utf-8",
        Some("json") => "application/json",
        _ => "application/octet-stream",
    };
    if !path.is_file() {
        return Ok(None);
    }
    Ok(Some((hoid_io::read_bytes(&path)?, kind)))
}
