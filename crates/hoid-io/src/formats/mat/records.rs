//! Tables of records in HDF5, as written by PyTables, pandas and h5py: datasets with a compound datatype, whose numeric
//! fields are columns `table.field`.

use std::rc::Rc;

use hdf5_pure::{CompoundMember, Datatype, DatatypeByteOrder};

use crate::formats::arrays::{Kind, Numbers};

/// Returns the numbers of a field in all records of `size` bytes; `None` if the field is not numeric.
pub(super) fn field_numbers(records: &Rc<Vec<u8>>, size: usize, member: &CompoundMember) -> Option<Numbers> {
    let (kind, order) = match &member.datatype {
        Datatype::FloatingPoint { size, byte_order, .. } => match size {
            2 => (Kind::F16, byte_order),
            4 => (Kind::F32, byte_order),
            8 => (Kind::F64, byte_order),
            _ => return None,
        },
        Datatype::FixedPoint {
            size,
            byte_order,
            layout,
        } => {
            let kind = match (size, layout.signed) {
                (1, true) => Kind::I8,
                (2, true) => Kind::I16,
                (4, true) => Kind::I32,
                (8, true) => Kind::I64,
                (1, false) => Kind::U8,
                (2, false) => Kind::U16,
                (4, false) => Kind::U32,
                (8, false) => Kind::U64,
                _ => return None,
            };
            (kind, byte_order)
        }
        _ => return None,
    };
    let big_endian = match order {
        DatatypeByteOrder::LittleEndian => false,
        DatatypeByteOrder::BigEndian => true,
        DatatypeByteOrder::Vax => return None,
    };
    let offset = usize::try_from(member.byte_offset).ok()?;
    let fits = offset.checked_add(kind.size()).is_some_and(|end| end <= size);
    fits.then(|| Numbers::field(records, kind, big_endian, offset, size))
}
