//! The libraries for C, built and installed so that pkg-config and CMake find them:
//!
//! ```text
//! include/hoid.h
//! lib/libhoid.so  lib/libhoid.a
//! lib/pkgconfig/hoid.pc
//! lib/cmake/hoid/hoid-config.cmake  hoid-config-version.cmake
//! share/hoid/examples/
//! ```
//!
//! The folder may be moved, because no file in it contains its path.

use std::{
    env, fs,
    path::{Path, PathBuf},
    process::{Command, Stdio},
};

use crate::process::{SHIPPED_PROFILE, TEST_BUILD_ARGUMENTS, cargo, output, run};

/// System libraries that a program linked with the static library needs.
const SYSTEM_LIBRARIES: &str = if cfg!(target_os = "linux") {
    "-lpthread -ldl -lm -lgcc_s"
} else {
    ""
};

const EXAMPLES: [&str; 7] = [
    "tracker.c",
    "tracker.cpp",
    "CMakeLists.txt",
    "simulink/sfun_hoid.c",
    "dueca/HoidTracker.cxx",
    "dueca/PersonSample.dco",
    "dueca/PersonEstimate.dco",
];

const USAGE: &str = "usage: cargo xtask ffi [--dev] [--out DIR] | --header | --check";

/// Builds the libraries, generates the header, or checks that pkg-config and CMake find them.
pub fn ffi(arguments: &[String]) -> Result<(), String> {
    let words: Vec<&str> = arguments.iter().map(String::as_str).collect();
    let target = target_directory();
    match words.as_slice() {
        [] => build(SHIPPED_PROFILE, &target.join("ffi")),
        ["--dev"] => build("dev", &target.join("ffi")),
        ["--out", out] => build(SHIPPED_PROFILE, Path::new(out)),
        ["--dev", "--out", out] => build("dev", Path::new(out)),
        ["--header"] => generate_header(),
        ["--check"] => {
            let out = target.join("ffi-check");
            build("dev", &out)?;
            check_pkg_config(&out)?;
            check_cmake(&out)
        }
        _ => Err(USAGE.to_owned()),
    }
}

fn repository_root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

fn crate_folder() -> PathBuf {
    repository_root().join("crates").join("hoid-ffi")
}

fn target_directory() -> PathBuf {
    env::var_os("CARGO_TARGET_DIR").map_or_else(
        || repository_root().join("target"),
        |named| repository_root().join(named),
    )
}

/// Generates the header from the sources.
fn generate_header() -> Result<(), String> {
    run(Command::new("cbindgen")
        .args([
            "--quiet",
            "--config",
            "cbindgen.toml",
            "--output",
            "include/hoid.h",
            ".",
        ])
        .current_dir(crate_folder()))
    .map_err(|e| format!("{e}\ncbindgen makes the header; install it with: cargo install cbindgen --locked"))
}

fn build(profile: &str, out: &Path) -> Result<(), String> {
    if profile == "dev" {
        cargo(&TEST_BUILD_ARGUMENTS, &[])?;
    } else {
        cargo(&["build", "--profile", profile, "-p", "hoid-ffi"], &[])?;
    }
    let built = target_directory().join(if profile == "dev" { "debug/deps" } else { profile });
    let version = env!("CARGO_PKG_VERSION");
    let _ = fs::remove_dir_all(out);
    let write = |place: &str, text: String| {
        let path = out.join(place);
        create_parent_folder(&path)?;
        fs::write(&path, text).map_err(|e| format!("{}: {e}", path.display()))
    };
    copy_file(&crate_folder().join("include/hoid.h"), &out.join("include/hoid.h"))?;
    for (from, to) in library_names() {
        copy_file(&built.join(from), &out.join("lib").join(to))?;
    }
    write("lib/pkgconfig/hoid.pc", pkg_config_file(version))?;
    write("lib/cmake/hoid/hoid-config.cmake", cmake_config())?;
    write("lib/cmake/hoid/hoid-config-version.cmake", cmake_version_file(version))?;
    for example in EXAMPLES {
        let to = out.join("share/hoid/examples").join(example);
        copy_file(&crate_folder().join("examples").join(example), &to)?;
    }
    println!("{}", out.display());
    Ok(())
}

/// Returns the file names of the libraries as built and as installed.
fn library_names() -> Vec<(&'static str, &'static str)> {
    if cfg!(windows) {
        vec![
            ("hoid_ffi.dll", "hoid.dll"),
            ("hoid_ffi.dll.lib", "hoid.dll.lib"),
            ("hoid_ffi.lib", "hoid.lib"),
        ]
    } else if cfg!(target_os = "macos") {
        vec![("libhoid_ffi.dylib", "libhoid.dylib"), ("libhoid_ffi.a", "libhoid.a")]
    } else {
        vec![("libhoid_ffi.so", "libhoid.so"), ("libhoid_ffi.a", "libhoid.a")]
    }
}

fn create_parent_folder(file: &Path) -> Result<(), String> {
    let folder = file.parent().unwrap_or(Path::new("."));
    fs::create_dir_all(folder).map_err(|e| format!("{}: {e}", folder.display()))
}

fn copy_file(from: &Path, to: &Path) -> Result<(), String> {
    create_parent_folder(to)?;
    fs::copy(from, to).map_err(|e| format!("{} to {}: {e}", from.display(), to.display()))?;
    Ok(())
}

fn pkg_config_file(version: &str) -> String {
    format!(
        "prefix=${{pcfiledir}}/../..\n\
         libdir=${{prefix}}/lib\n\
         includedir=${{prefix}}/include\n\
         \n\
         Name: hoid\n\
         Description: Estimates of a person who controls a machine, sample by sample\n\
         Version: {version}\n\
         Cflags: -I${{includedir}}\n\
         Libs: -L${{libdir}} -lhoid\n\
         Libs.private: {SYSTEM_LIBRARIES}\n"
    )
}

/// Returns the CMake configuration with the targets `hoid::hoid` (shared) and `hoid::static`.
fn cmake_config() -> String {
    let [shared, fixed] = if cfg!(windows) {
        ["hoid.dll", "hoid.lib"]
    } else if cfg!(target_os = "macos") {
        ["libhoid.dylib", "libhoid.a"]
    } else {
        ["libhoid.so", "libhoid.a"]
    };
    let system = SYSTEM_LIBRARIES.replace("-l", "").replace(' ', ";");
    let import = if cfg!(windows) {
        "  IMPORTED_IMPLIB \"${_hoid}/lib/hoid.dll.lib\"\n"
    } else {
        ""
    };
    format!(
        "get_filename_component(_hoid \"${{CMAKE_CURRENT_LIST_DIR}}/../../..\" ABSOLUTE)\n\
         add_library(hoid::hoid SHARED IMPORTED)\n\
         set_target_properties(hoid::hoid PROPERTIES\n  \
           IMPORTED_LOCATION \"${{_hoid}}/lib/{shared}\"\n\
         {import}  \
           IMPORTED_NO_SONAME TRUE\n  \
           INTERFACE_INCLUDE_DIRECTORIES \"${{_hoid}}/include\")\n\
         add_library(hoid::static STATIC IMPORTED)\n\
         set_target_properties(hoid::static PROPERTIES\n  \
           IMPORTED_LOCATION \"${{_hoid}}/lib/{fixed}\"\n  \
           INTERFACE_INCLUDE_DIRECTORIES \"${{_hoid}}/include\"\n  \
           INTERFACE_LINK_LIBRARIES \"{system}\")\n"
    )
}

/// Returns the CMake version file. A version satisfies requests for older versions with the same major version (with
/// the same minor version if the major version is 0).
fn cmake_version_file(version: &str) -> String {
    let mut parts = version.split('.');
    let same = match (parts.next(), parts.next()) {
        (Some("0"), Some(minor)) => format!("0.{minor}"),
        (Some(major), _) => major.to_owned(),
        _ => version.to_owned(),
    };
    format!(
        "set(PACKAGE_VERSION \"{version}\")\n\
         string(FIND \"${{PACKAGE_FIND_VERSION}}.\" \"{same}.\" _hoid_at)\n\
         if(_hoid_at EQUAL 0 AND NOT PACKAGE_FIND_VERSION VERSION_GREATER PACKAGE_VERSION)\n  \
           set(PACKAGE_VERSION_COMPATIBLE TRUE)\n\
         endif()\n\
         if(PACKAGE_FIND_VERSION VERSION_EQUAL PACKAGE_VERSION)\n  \
           set(PACKAGE_VERSION_EXACT TRUE)\n\
         endif()\n"
    )
}

fn is_installed(program: &str) -> bool {
    let mut command = Command::new(program);
    command.arg("--version").stdout(Stdio::null()).stderr(Stdio::null());
    let there = command.status().is_ok_and(|status| status.success());
    if !there {
        println!("skipped: there is no {program}");
    }
    there
}

/// Runs a built example on three samples and checks the number of output lines.
fn check_example(program: &Path, libraries: &Path) -> Result<(), String> {
    let shown = program.display();
    let input = program.with_extension("txt");
    fs::write(&input, "0.1,0.2\n0.2,0.1\n0.3,0.2\n").map_err(|e| format!("{}: {e}", input.display()))?;
    let file = fs::File::open(&input).map_err(|e| format!("{}: {e}", input.display()))?;
    let said = output(
        Command::new(program)
            .args(["adaptive", "0.01"])
            .env("LD_LIBRARY_PATH", libraries)
            .env("DYLD_LIBRARY_PATH", libraries)
            .stdin(file),
    )?;
    match said.lines().count() {
        3 => Ok(()),
        lines => Err(format!("{shown} printed {lines} lines for 3 samples")),
    }
}

/// Builds the C example with pkg-config, once with the shared and once with the static library.
fn check_pkg_config(out: &Path) -> Result<(), String> {
    if !(is_installed("pkg-config") && is_installed("cc")) {
        return Ok(());
    }
    let says = |options: &[&str]| {
        let mut command = Command::new("pkg-config");
        let told = output(
            command
                .args(options)
                .arg("hoid")
                .env("PKG_CONFIG_PATH", out.join("lib/pkgconfig")),
        )?;
        Ok::<Vec<String>, String>(told.split_whitespace().map(str::to_owned).collect())
    };
    let example = crate_folder().join("examples/tracker.c");
    let shared = out.join("tracker-shared");
    run(Command::new("cc")
        .arg(&example)
        .args(says(&["--cflags", "--libs"])?)
        .arg("-o")
        .arg(&shared))?;
    check_example(&shared, &out.join("lib"))?;
    let alone = out.join("tracker-static");
    run(Command::new("cc")
        .arg(&example)
        .args(says(&["--cflags"])?)
        .arg(out.join("lib/libhoid.a"))
        .args(SYSTEM_LIBRARIES.split_whitespace())
        .arg("-o")
        .arg(&alone))?;
    check_example(&alone, Path::new(""))
}

/// Builds the examples with CMake.
fn check_cmake(out: &Path) -> Result<(), String> {
    if !is_installed("cmake") {
        return Ok(());
    }
    let build = out.join("examples-build");
    run(Command::new("cmake")
        .arg("-S")
        .arg(out.join("share/hoid/examples"))
        .arg("-B")
        .arg(&build)
        .arg(format!("-DCMAKE_PREFIX_PATH={}", out.display())))?;
    run(Command::new("cmake").arg("--build").arg(&build))?;
    for program in ["tracker", "tracker_cpp"] {
        check_example(&build.join(program), &out.join("lib"))?;
    }
    Ok(())
}
