//! Version 7.3: HDF5 with MATLAB's conventions, and HDF5 files from other programs. Structures are groups. Arrays of
//! structures and cell arrays are references to objects under `/#refs#`. Dimensions are in the order of C and therefore
//! reversed. `MATLAB_class` gives the class of a dataset, and `MATLAB_object_decode` marks an object. Datasets without
//! these attributes, as in files from other programs, are numbers; in such files dimensions remain in the order of C.

use std::rc::Rc;

use hdf5_pure::{AttrValue, DType, Dataset, Datatype, Error, File, Group, H5Element, Object};

use super::{objects::describe_object, records};
use crate::IoError;
use crate::formats::arrays::{Array, Entry, Indexing, Kind, Numbers, Value};
use crate::formats::budget::{Budget, MAX_NESTING};
use crate::formats::panic_isolation::guard_read;
use crate::wording::short_error;

/// Memory in bytes charged for each visit to a group or dataset, because links may be circular.
const VISIT_BYTES: u64 = 1 << 13;
/// Maximum number of elements of an array of structures, or of a cell array, that is converted to columns.
const MAX_REFERENCES: u64 = 1 << 16;

/// Reads the variables of a file; `indexing` determines whether dimensions are in the order of MATLAB or numpy.
pub(super) fn read(bytes: Vec<u8>, file: &str, indexing: Indexing) -> Result<Vec<Entry>, IoError> {
    guard_read(file, || {
        let mut reader = Reader {
            entries: Vec::new(),
            budget: Budget::of(bytes.len()),
            indexing,
            file,
        };
        let opened = File::from_bytes(bytes).map_err(|error| reader.read_error("its head", &error))?;
        reader.read_group(&opened.root(), "", 0)?;
        Ok(reader.entries)
    })
}

struct Reader<'a> {
    entries: Vec<Entry>,
    budget: Budget,
    indexing: Indexing,
    file: &'a str,
}

impl Reader<'_> {
    /// Converts an error of the HDF5 crate to damage or an unsupported feature.
    fn read_error(&self, place: &str, error: &Error) -> IoError {
        let what = error.to_string();
        let cut = if what.contains("unexpected EOF") {
            "the file is truncated, or a length is wrong: "
        } else {
            ""
        };
        let (file, found) = (
            self.file.to_owned(),
            format!("{}: {cut}{}", short_error(place), short_error(&what)),
        );
        match ["version", "filter", "unsupported"]
            .iter()
            .any(|word| what.to_lowercase().contains(word))
        {
            true => IoError::Unsupported {
                file,
                found,
                remedy: "save it with -v7, or with h5py, libver=\"v114\" and gzip",
            },
            false => IoError::Damaged { file, found },
        }
    }

    /// Reads a group, which is a structure or the root of the file.
    fn read_group(&mut self, group: &Group, path: &str, depth: usize) -> Result<(), IoError> {
        self.budget.take(VISIT_BYTES, self.file)?;
        if depth > MAX_NESTING {
            return Err(IoError::Damaged {
                file: self.file.to_owned(),
                found: format!("structures nested more than {MAX_NESTING} deep"),
            });
        }
        let inside = |name: &str| {
            if path.is_empty() {
                name.to_owned()
            } else {
                format!("{path}.{name}")
            }
        };
        let datasets = group.iter_datasets().map_err(|error| self.read_error(path, &error))?;
        for (name, dataset) in datasets {
            self.read_dataset(&dataset, path, &inside(&name), depth)?;
        }
        let groups = group.iter_groups().map_err(|error| self.read_error(path, &error))?;
        for (name, group) in groups {
            // MATLAB stores internal data in groups whose name starts with #.
            if !(depth == 0 && name.starts_with('#')) {
                self.read_group(&group, &inside(&name), depth.saturating_add(1))?;
            }
        }
        Ok(())
    }

    /// Reads a dataset. For a dataset in an array of structures, `parent` is the element of the array, and `path`
    /// starts with it.
    fn read_dataset(&mut self, dataset: &Dataset, parent: &str, path: &str, depth: usize) -> Result<(), IoError> {
        self.budget.take(VISIT_BYTES, self.file)?;
        let error = |reader: &Self, error: Error| reader.read_error(path, &error);
        let attributes = dataset.attrs().map_err(|e| error(self, e))?;
        let class = match attributes.get("MATLAB_class") {
            Some(AttrValue::String(class) | AttrValue::AsciiString(class)) => class.as_str(),
            _ => "",
        };
        let class = class.trim_end_matches('\0');
        if attributes.contains_key("MATLAB_object_decode") {
            return self.push(parent, path, Value::Unread(describe_object(class)));
        }
        if attributes.contains_key("MATLAB_empty") {
            return match class {
                "char" => self.push(parent, path, Value::Texts(vec![String::new()])),
                "struct" | "cell" => Ok(()),
                _ => self.push(parent, path, Value::Array(Array::vector(Numbers::from_f64(&[])))),
            };
        }
        let kind = dataset.dtype().map_err(|e| error(self, e))?;
        let mut dims: Vec<usize> = Vec::new();
        let mut count = Some(1_u64);
        for side in dataset.shape().map_err(|e| error(self, e))? {
            count = count.and_then(|count| count.checked_mul(side));
            dims.push(usize::try_from(side).unwrap_or(usize::MAX));
        }
        if self.indexing == Indexing::Matlab {
            dims.reverse();
        }
        let size = dataset.element_size().map_err(|e| error(self, e))?;
        let Some((count, bytes)) = count.and_then(|count| Some((count, count.checked_mul(size.max(8))?))) else {
            return self.push(parent, path, Value::Unread(String::from("an array that is too large")));
        };
        if matches!(kind, DType::ObjectReference) {
            if count > MAX_REFERENCES {
                return self.push(parent, path, Value::Unread(format!("{count} references")));
            }
            return self.read_references(dataset, class == "cell", (parent, path), depth);
        }
        self.budget.take(bytes, self.file)?;
        let rows = dims.first().map_or(1, |rows| (*rows).min(count as usize));
        match kind {
            DType::U16 if class == "char" => self.budget.take_texts(rows, 0, self.file)?,
            DType::String => self.budget.take_texts(count as usize, 0, self.file)?,
            _ => {}
        }
        let value = match kind {
            DType::U16 if class == "char" => Value::Texts(texts(&self.read_all::<u16>(dataset, path)?, &dims)),
            DType::F64 => self.read_array::<f64>(dataset, path, Kind::F64, dims)?,
            DType::F32 => self.read_array::<f32>(dataset, path, Kind::F32, dims)?,
            DType::I8 | DType::Enum(_) if size == 1 => self.read_array::<i8>(dataset, path, Kind::I8, dims)?,
            DType::I16 => self.read_array::<i16>(dataset, path, Kind::I16, dims)?,
            DType::I32 => self.read_array::<i32>(dataset, path, Kind::I32, dims)?,
            DType::I64 => self.read_array::<i64>(dataset, path, Kind::I64, dims)?,
            DType::U8 => self.read_array::<u8>(dataset, path, Kind::U8, dims)?,
            DType::U16 => self.read_array::<u16>(dataset, path, Kind::U16, dims)?,
            DType::U32 => self.read_array::<u32>(dataset, path, Kind::U32, dims)?,
            DType::U64 => self.read_array::<u64>(dataset, path, Kind::U64, dims)?,
            DType::String => Value::Texts(dataset.read_string().map_err(|e| error(self, e))?),
            DType::VariableLengthString => Value::Unread(String::from("text of variable length")),
            DType::Compound(fields) if matches!(fields.as_slice(), [(name, _), _] if name == "real") => {
                Value::Unread(String::from("complex numbers"))
            }
            DType::Compound(_) => return self.read_table(dataset, (parent, path)),
            _ => Value::Unread(String::from("something other than numbers")),
        };
        self.push(parent, path, value)
    }

    /// Reads a table of records; each field gets the path `path.field`.
    fn read_table(&mut self, dataset: &Dataset, (parent, path): (&str, &str)) -> Result<(), IoError> {
        let kind = dataset.datatype().map_err(|error| self.read_error(path, &error))?;
        let Datatype::Compound { size, members } = kind else {
            return self.push(parent, path, Value::Unread(String::from("records of an unknown type")));
        };
        let bytes = dataset.read_raw().map_err(|error| self.read_error(path, &error))?;
        let (bytes, size) = (Rc::new(bytes), size as usize);
        for member in &members {
            let value = match records::field_numbers(&bytes, size, member) {
                Some(numbers) => Value::Array(Array::vector(numbers)),
                None => Value::Unread(String::from("something other than numbers")),
            };
            self.push(path, &format!("{path}.{}", member.name), value)?;
        }
        Ok(())
    }

    /// Reads a cell array, whose cells get the paths `path{k}`, or one field of an array of structures, with the paths
    /// `parent(k).field`.
    fn read_references(
        &mut self,
        dataset: &Dataset,
        cells: bool,
        (parent, path): (&str, &str),
        depth: usize,
    ) -> Result<(), IoError> {
        if depth == MAX_NESTING {
            return Err(IoError::Damaged {
                file: self.file.to_owned(),
                found: format!("structures nested more than {MAX_NESTING} deep"),
            });
        }
        let objects = match dataset.dereference() {
            Ok(objects) => objects,
            // A null reference is valid and does not count as damage.
            Err(error) => {
                let what = format!("references without a target ({})", short_error(&error.to_string()));
                return self.push(parent, path, Value::Unread(what));
            }
        };
        let before = self.entries.len();
        let several = objects.len() > 1;
        let count = objects.len();
        for (at, object) in objects.into_iter().enumerate() {
            let (parent, path) = match path.strip_prefix(parent).and_then(|name| name.strip_prefix('.')) {
                Some(field) if !cells && several && !parent.is_empty() => {
                    let element = format!("{parent}({})", at.saturating_add(1));
                    let path = format!("{element}.{field}");
                    (element, path)
                }
                _ => (parent.to_owned(), format!("{path}{{{}}}", at.saturating_add(1))),
            };
            match object {
                Object::Dataset(dataset) => self.read_dataset(&dataset, &parent, &path, depth.saturating_add(1))?,
                Object::Group(group) => self.read_group(&group, &path, depth.saturating_add(1))?,
                _ => {}
            }
        }
        // If all cells hold text, they form one column.
        let text = |entry: &Entry| matches!(&entry.value, Value::Texts(texts) if texts.len() == 1);
        let new = self.entries.get(before..).unwrap_or_default();
        if cells && new.len() == count && new.iter().all(text) {
            let texts = self.entries.drain(before..).filter_map(|entry| match entry.value {
                Value::Texts(texts) => texts.into_iter().next(),
                _ => None,
            });
            let texts = texts.collect();
            return self.push(parent, path, Value::Texts(texts));
        }
        Ok(())
    }

    fn push(&mut self, parent: &str, path: &str, value: Value) -> Result<(), IoError> {
        self.budget
            .take(path.len().saturating_add(parent.len()) as u64, self.file)?;
        let mut entry = Entry::new(path, value);
        parent.clone_into(&mut entry.parent);
        self.entries.push(entry);
        Ok(())
    }

    fn read_all<T: H5Element>(&self, dataset: &Dataset, path: &str) -> Result<Vec<T>, IoError> {
        dataset.read::<T>().map_err(|error| self.read_error(path, &error))
    }

    fn read_array<T: H5Element + LittleEndianBytes>(
        &self,
        dataset: &Dataset,
        path: &str,
        kind: Kind,
        dims: Vec<usize>,
    ) -> Result<Value, IoError> {
        let values = self.read_all::<T>(dataset, path)?;
        let mut bytes = Vec::with_capacity(values.len().saturating_mul(kind.size()));
        values.iter().for_each(|value| value.append(&mut bytes));
        let numbers = Numbers::new(bytes, kind, false);
        let expected = dims.iter().try_fold(1_usize, |count, side| count.checked_mul(*side));
        if expected != Some(numbers.len()) {
            return Err(IoError::Damaged {
                file: self.file.to_owned(),
                found: format!(
                    "{}: {} numbers in an array of {dims:?}",
                    short_error(path),
                    numbers.len()
                ),
            });
        }
        Ok(Value::Array(Array {
            numbers,
            dims,
            is_row_major: self.indexing == Indexing::Python,
        }))
    }
}

/// Returns the rows of a character array.
fn texts(units: &[u16], dims: &[usize]) -> Vec<String> {
    let rows = dims.first().copied().unwrap_or(1).clamp(1, units.len().max(1));
    let row = |at: usize| units.iter().skip(at).step_by(rows).copied().collect::<Vec<u16>>();
    let text = |at: usize| String::from_utf16_lossy(&row(at));
    match rows {
        1 => vec![text(0)],
        rows => (0..rows).map(|at| text(at).trim_end().to_owned()).collect(),
    }
}

/// Numbers that can be converted to little-endian bytes.
trait LittleEndianBytes {
    fn append(&self, bytes: &mut Vec<u8>);
}

macro_rules! bytes {
    ($($number:ty),*) => {$(
        impl LittleEndianBytes for $number {
            fn append(&self, bytes: &mut Vec<u8>) {
                bytes.extend_from_slice(&self.to_le_bytes());
            }
        }
    )*};
}

bytes!(f32, f64, i8, i16, i32, i64, u8, u16, u32, u64);
