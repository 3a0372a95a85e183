//! The FMU archive: its description, a library for each platform, and its resources.

use std::{
    io::{Cursor, Write as _},
    path::Path,
};

use zip::{CompressionMethod, DateTime, ZipWriter, result::ZipError, write::SimpleFileOptions};

use super::{
    description::{FmiVersion, MODEL_IDENTIFIER, description},
    settings::{FMU_SETTINGS_FILE, FmuSettings},
};
use crate::{IoError, read_bytes, write_atomically};

/// A shared library for one platform.
pub struct Library {
    bytes: Vec<u8>,
    platform: Platform,
}

/// Platform of a shared library: folder names and file extension.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Platform {
    fmi2_folder: &'static str,
    fmi3_folder: &'static str,
    ending: &'static str,
}

/// First bytes of a little-endian 64-bit ELF file; each entry of LINUX_PLATFORMS starts with a value of its machine
/// field.
const ELF_MAGIC: &[u8] = b"\x7fELF\x02\x01";
const LINUX_PLATFORMS: [(u16, Platform); 2] = [
    (
        62,
        Platform {
            fmi2_folder: "linux64",
            fmi3_folder: "x86_64-linux",
            ending: "so",
        },
    ),
    (
        183,
        Platform {
            fmi2_folder: "aarch64-linux",
            fmi3_folder: "aarch64-linux",
            ending: "so",
        },
    ),
];
const WINDOWS_PLATFORM: Platform = Platform {
    fmi2_folder: "win64",
    fmi3_folder: "x86_64-windows",
    ending: "dll",
};
const WINDOWS_MACHINE: u16 = 0x8664;
/// Magic number of 64-bit Mach-O; each entry of MAC_PLATFORMS starts with a CPU type.
const MACH_O_MAGIC: &[u8] = b"\xcf\xfa\xed\xfe";
const MAC_PLATFORMS: [(u32, Platform); 2] = [
    (
        0x0100_0007,
        Platform {
            fmi2_folder: "darwin64",
            fmi3_folder: "x86_64-darwin",
            ending: "dylib",
        },
    ),
    (
        0x0100_000c,
        Platform {
            fmi2_folder: "aarch64-darwin",
            fmi3_folder: "aarch64-darwin",
            ending: "dylib",
        },
    ),
];

/// Functions that the library of an FMU exports: one each of the C interface of hoid, of FMI 2 and of FMI 3. On every
/// platform the symbol table contains their names, each terminated by a null byte.
const EXPORTED_FUNCTIONS: [&str; 3] = ["hoid_abi_version", "fmi2Instantiate", "fmi3InstantiateCoSimulation"];

fn exports_function(bytes: &[u8], function: &str) -> bool {
    let name = [function.as_bytes(), &[0]].concat();
    bytes.windows(name.len()).any(|part| part == name)
}

fn u16_at(bytes: &[u8], at: usize) -> Option<u16> {
    let found = bytes.get(at..at.checked_add(2)?)?;
    Some(u16::from_le_bytes(found.try_into().ok()?))
}

fn u32_at(bytes: &[u8], at: usize) -> Option<u32> {
    let found = bytes.get(at..at.checked_add(4)?)?;
    Some(u32::from_le_bytes(found.try_into().ok()?))
}

impl Platform {
    /// Determines the platform from the header of a shared library (ELF, PE or Mach-O).
    fn of(bytes: &[u8]) -> Option<Self> {
        if bytes.starts_with(ELF_MAGIC) {
            let machine = u16_at(bytes, 18)?;
            return LINUX_PLATFORMS
                .into_iter()
                .find(|(known, _)| *known == machine)
                .map(|(_, p)| p);
        }
        if bytes.starts_with(MACH_O_MAGIC) {
            let machine = u32_at(bytes, 4)?;
            return MAC_PLATFORMS
                .into_iter()
                .find(|(known, _)| *known == machine)
                .map(|(_, p)| p);
        }
        let head = u32_at(bytes, 0x3c).filter(|_| bytes.starts_with(b"MZ"))? as usize;
        let end = head.checked_add(4)?;
        let is_one = bytes.get(head..end)? == b"PE\0\0";
        (is_one && u16_at(bytes, end)? == WINDOWS_MACHINE).then_some(WINDOWS_PLATFORM)
    }
}

impl Library {
    /// Reads a library and determines its platform from its header.
    ///
    /// # Errors
    /// [`IoError::Unreadable`] if the file cannot be read; [`IoError::NoLibrary`] if it is not a shared library for a
    /// known platform; [`IoError::OtherLibrary`] if it is not the library of hoid.
    pub fn read(path: &Path) -> Result<Self, IoError> {
        let bytes = read_bytes(path)?;
        let platform = Platform::of(&bytes).ok_or_else(|| IoError::NoLibrary {
            file: path.display().to_string(),
        })?;
        if let Some(missing) = EXPORTED_FUNCTIONS
            .into_iter()
            .find(|function| !exports_function(&bytes, function))
        {
            return Err(IoError::OtherLibrary {
                file: path.display().to_string(),
                missing,
            });
        }
        Ok(Self { bytes, platform })
    }
}

/// Writes an FMU with sample time `step_s`. The same contents give the same bytes.
///
/// # Errors
/// File errors; [`IoError::NoLibrary`] for contradictory settings or for two libraries for the same platform.
pub fn write_fmu(
    path: &Path,
    version: FmiVersion,
    settings: &FmuSettings,
    libraries: &[Library],
    step_s: f64,
) -> Result<(), IoError> {
    let unwritable = |source: std::io::Error| IoError::Unwritable {
        file: path.display().to_string(),
        source,
    };
    let wrong = |reason: String| unwritable(std::io::Error::other(reason));
    let kind = settings.kind().map_err(wrong)?;
    let variables = settings.variables().map_err(wrong)?;
    let xml = description(version, kind, &variables, step_s);
    let text = settings.text();
    let mut parts: Vec<(String, &[u8])> = vec![
        ("modelDescription.xml".to_owned(), xml.as_bytes()),
        (format!("resources/{FMU_SETTINGS_FILE}"), text.as_bytes()),
    ];
    for library in libraries {
        let platform = library.platform;
        let folder = match version {
            FmiVersion::Two => platform.fmi2_folder,
            FmiVersion::Three => platform.fmi3_folder,
        };
        let name = format!("binaries/{folder}/{MODEL_IDENTIFIER}.{}", platform.ending);
        if parts.iter().any(|(other, _)| *other == name) {
            return Err(wrong(format!(
                "two libraries are for {folder}; give only one for each platform"
            )));
        }
        parts.push((name, &library.bytes));
    }
    let packed = zip_archive(&parts).map_err(|error| wrong(error.to_string()))?;
    write_atomically(path, |file| file.write_all(&packed))
}

fn zip_archive(parts: &[(String, &[u8])]) -> Result<Vec<u8>, ZipError> {
    let options = SimpleFileOptions::default()
        .compression_method(CompressionMethod::Deflated)
        .last_modified_time(DateTime::default())
        .unix_permissions(0o755);
    let mut archive = ZipWriter::new(Cursor::new(Vec::new()));
    for (name, bytes) in parts {
        archive.start_file(name.as_str(), options)?;
        archive.write_all(bytes)?;
    }
    Ok(archive.finish()?.into_inner())
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use std::{fs, io::Read as _};

    use zip::ZipArchive;

    use super::*;
    use crate::fmu::FmuKind;

    /// Returns headers of libraries as the operating systems define them, followed by the names of the functions.
    fn library_headers() -> [(Vec<u8>, &'static str, &'static str); 5] {
        let elf = |machine: u16| {
            let mut bytes = vec![0; 64];
            bytes[..6].copy_from_slice(ELF_MAGIC);
            bytes[18..20].copy_from_slice(&machine.to_le_bytes());
            bytes
        };
        let mac = |machine: u32| [MACH_O_MAGIC, &machine.to_le_bytes()].concat();
        let mut windows = vec![0; 0x100];
        windows[..2].copy_from_slice(b"MZ");
        windows[0x3c] = 0x80;
        windows[0x80..0x86].copy_from_slice(b"PE\0\0\x64\x86");
        let names = EXPORTED_FUNCTIONS.map(|name| format!("\0{name}")).concat() + "\0";
        [
            (elf(62), "linux64/hoid.so", "x86_64-linux/hoid.so"),
            (elf(183), "aarch64-linux/hoid.so", "aarch64-linux/hoid.so"),
            (windows, "win64/hoid.dll", "x86_64-windows/hoid.dll"),
            (mac(0x0100_0007), "darwin64/hoid.dylib", "x86_64-darwin/hoid.dylib"),
            (
                mac(0x0100_000c),
                "aarch64-darwin/hoid.dylib",
                "aarch64-darwin/hoid.dylib",
            ),
        ]
        .map(|(head, fmi2_folder, fmi3_folder)| ([head, names.clone().into_bytes()].concat(), fmi2_folder, fmi3_folder))
    }

    #[test]
    fn libraries_are_stored_in_their_platform_folder() {
        let folder = tempfile::tempdir().unwrap();
        let files: Vec<_> = (library_headers().into_iter().enumerate())
            .map(|(i, (bytes, ..))| {
                let path = folder.path().join(format!("{i}"));
                fs::write(&path, bytes).unwrap();
                path
            })
            .collect();
        let read = || {
            files
                .iter()
                .map(|path| Library::read(path).unwrap())
                .collect::<Vec<_>>()
        };
        for version in FmiVersion::ALL {
            let path = folder.path().join("a.fmu");
            let settings = FmuSettings::new(FmuKind::Tracker);
            write_fmu(&path, version, &settings, &read(), 0.01).unwrap();
            let written = fs::read(&path).unwrap();
            let mut archive = ZipArchive::new(Cursor::new(&written)).unwrap();
            for (bytes, fmi2_folder, fmi3_folder) in library_headers() {
                let place = if version == FmiVersion::Two {
                    fmi2_folder
                } else {
                    fmi3_folder
                };
                let mut found = Vec::new();
                let mut file = archive.by_name(&format!("binaries/{place}")).unwrap();
                file.read_to_end(&mut found).unwrap();
                assert_eq!(found, bytes, "{place}");
            }
            for name in ["modelDescription.xml", "resources/hoid.json"] {
                assert!(archive.by_name(name).is_ok(), "{name}");
            }
            write_fmu(&path, version, &settings, &read(), 0.01).unwrap();
            assert_eq!(fs::read(&path).unwrap(), written, "the same parts, the same bytes");
            let mut twice = read();
            twice.push(Library::read(&files[0]).unwrap());
            let refused = write_fmu(&path, version, &settings, &twice, 0.01)
                .unwrap_err()
                .to_string();
            assert!(refused.contains("two libraries"), "{refused}");
        }
    }

    #[test]
    fn other_files_are_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a");
        for (bytes, ..) in library_headers() {
            for length in 0..bytes.len().min(0x86) {
                assert!(Platform::of(&bytes[..length]).is_none() || length >= 8, "{length}");
            }
        }
        let mut far = vec![0xff_u8; 0x40];
        far[..2].copy_from_slice(b"MZ");
        for wrong in [b"text".as_slice(), b"", &far] {
            fs::write(&path, wrong).unwrap();
            let refused = Library::read(&path).err().unwrap().to_string();
            assert!(refused.contains("cargo xtask ffi"), "{refused}");
        }
        assert!(Library::read(&folder.path().join("nowhere")).is_err());
        // A library that contains only part of a function name is rejected.
        for (bytes, ..) in library_headers() {
            let text = String::from_utf8_lossy(EXPORTED_FUNCTIONS[1].as_bytes()).into_owned();
            let place = bytes.windows(text.len()).position(|w| w == text.as_bytes()).unwrap();
            let mut other = bytes.clone();
            other[place] = b'F';
            fs::write(&path, other).unwrap();
            let refused = Library::read(&path).err().unwrap().to_string();
            assert!(
                refused.contains("not the shared library of hoid: the function fmi2Instantiate is missing"),
                "{refused}"
            );
        }
    }
}
