//! Numbers in VTK files: their names in both formats, and how their bytes are read.

/// A kind of number.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Kind {
    Bit,
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    I64,
    U64,
    F32,
    F64,
}

impl Kind {
    /// By the name in a legacy file. A `vtkIdType` has 4 bytes there, and a `long` those of the machine that wrote it: 8.
    pub fn of_legacy(name: &str) -> Option<Self> {
        Some(match name.to_ascii_lowercase().as_str() {
            "bit" => Self::Bit,
            "char" | "signed_char" | "vtktypeint8" => Self::I8,
            "unsigned_char" | "vtktypeuint8" => Self::U8,
            "short" | "vtktypeint16" => Self::I16,
            "unsigned_short" | "vtktypeuint16" => Self::U16,
            "int" | "vtkidtype" | "vtktypeint32" => Self::I32,
            "unsigned_int" | "vtktypeuint32" => Self::U32,
            "long" | "long_long" | "vtktypeint64" => Self::I64,
            "unsigned_long" | "unsigned_long_long" | "vtktypeuint64" => Self::U64,
            "float" | "vtktypefloat32" => Self::F32,
            "double" | "vtktypefloat64" => Self::F64,
            _ => return None,
        })
    }

    /// By the name in an XML file.
    pub fn of_xml(name: &str) -> Option<Self> {
        Some(match name {
            "Bit" => Self::Bit,
            "Int8" => Self::I8,
            "UInt8" => Self::U8,
            "Int16" => Self::I16,
            "UInt16" => Self::U16,
            "Int32" => Self::I32,
            "UInt32" => Self::U32,
            "Int64" => Self::I64,
            "UInt64" => Self::U64,
            "Float32" => Self::F32,
            "Float64" => Self::F64,
            _ => return None,
        })
    }

    /// Bytes of so many numbers.
    pub fn bytes_of(self, count: usize) -> Option<usize> {
        let size = match self {
            Self::Bit => return Some(count.div_ceil(8)),
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::I64 | Self::U64 | Self::F64 => 8,
        };
        count.checked_mul(size)
    }

    /// The numbers in these bytes; a rest that makes no number is left.
    pub fn reals(self, bytes: &[u8], is_big: bool) -> Vec<f64> {
        match self {
            Self::F32 => map(bytes, is_big, |b| f64::from(f32::from_le_bytes(b))),
            Self::F64 => map(bytes, is_big, f64::from_le_bytes),
            Self::U64 => map(bytes, is_big, |b| u64::from_le_bytes(b) as f64),
            whole => {
                let numbers = whole.wholes(bytes, is_big);
                numbers.into_iter().map(|number| number as f64).collect()
            }
        }
    }

    /// The same as whole numbers.
    pub fn wholes(self, bytes: &[u8], is_big: bool) -> Vec<i64> {
        match self {
            Self::Bit => {
                let bits = |byte: &u8| [7, 6, 5, 4, 3, 2, 1, 0].map(|at| i64::from(byte >> at & 1));
                bytes.iter().flat_map(bits).collect()
            }
            Self::I8 => map(bytes, is_big, |b| i64::from(i8::from_le_bytes(b))),
            Self::U8 => map(bytes, is_big, |b| i64::from(u8::from_le_bytes(b))),
            Self::I16 => map(bytes, is_big, |b| i64::from(i16::from_le_bytes(b))),
            Self::U16 => map(bytes, is_big, |b| i64::from(u16::from_le_bytes(b))),
            Self::I32 => map(bytes, is_big, |b| i64::from(i32::from_le_bytes(b))),
            Self::U32 => map(bytes, is_big, |b| i64::from(u32::from_le_bytes(b))),
            Self::I64 => map(bytes, is_big, i64::from_le_bytes),
            Self::U64 => map(bytes, is_big, |b| u64::from_le_bytes(b) as i64),
            Self::F32 => map(bytes, is_big, |b| f32::from_le_bytes(b) as i64),
            Self::F64 => map(bytes, is_big, |b| f64::from_le_bytes(b) as i64),
        }
    }
}

fn map<const N: usize, T>(bytes: &[u8], is_big: bool, number: impl Fn([u8; N]) -> T) -> Vec<T> {
    let (chunks, _) = bytes.as_chunks::<N>();
    let turned = |&chunk: &[u8; N]| {
        let mut chunk = chunk;
        if is_big {
            chunk.reverse();
        }
        number(chunk)
    };
    chunks.iter().map(turned).collect()
}
