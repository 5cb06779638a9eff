//! A column of numbers, and what its stored values mean.

use super::arrow_schema::Field;
use crate::shared::date::iso;
use crate::shared::half::half;
use crate::shared::stamp;
use parquet::basic::{ConvertedType, LogicalType, TimeUnit, Type};
use parquet::column::reader::{ColumnReader, ColumnReaderImpl};
use parquet::data_type::DataType;
use parquet::errors::{ParquetError, Result};
use parquet::file::reader::FileReader;
use parquet::schema::types::ColumnDescriptor;

/// What a stored value means.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Meaning {
    Signed,
    Unsigned,
    Float,
    /// An integer to be divided by ten to the power of this.
    Decimal(i32),
    /// A float of two bytes.
    Half,
    /// A count of ticks of a clock, read from the first value on; `date`: since the start of 1970.
    Time {
        per_second: f64,
        date: bool,
    },
    /// Days since the start of 1970, read in s from the first value on.
    Days,
}

/// A column of the file that is a channel.
#[derive(Clone, Debug)]
pub(super) struct Column {
    pub index: usize,
    pub name: String,
    pub unit: String,
    meaning: Meaning,
    /// Definition level of a value that is there.
    defined: i16,
    /// The first value of a column of times or integers, once it was read.
    pub first: Option<i64>,
}

/// Samples of a column, and the first value of a column of times or integers.
pub(super) struct Read {
    pub samples: Vec<f64>,
    pub first: Option<i64>,
}

impl Column {
    /// The channel in a column.
    ///
    /// # Errors
    /// Why it holds none.
    pub(super) fn of(index: usize, of: &ColumnDescriptor, field: Option<&Field>) -> Result<Column, String> {
        if of.max_rep_level() > 0 {
            return Err("it holds lists".into());
        }
        let meaning = meaning(of, field).ok_or("it holds no numbers")?;
        let unit = field.map_or(String::new(), |f| f.unit.clone());
        let unit = if matches!(meaning, Meaning::Time { .. } | Meaning::Days) { "s".into() } else { unit };
        Ok(Column { index, name: of.path().parts().join("."), unit, meaning, defined: of.max_def_level(), first: None })
    }

    pub(super) fn is_date(&self) -> bool {
        matches!(self.meaning, Meaning::Time { date: true, .. } | Meaning::Days)
    }

    /// The date of the first row that has one.
    pub(super) fn first_date(&self, file: &dyn FileReader) -> Result<Option<String>> {
        if file.num_row_groups() == 0 {
            return Ok(None);
        }
        let mut reader = file.get_row_group(0)?.get_column_reader(self.index)?;
        let rows = usize::try_from(file.metadata().row_group(0).num_rows()).unwrap_or(0).min(1);
        let first = self.read(&mut reader, rows)?.first;
        Ok(first.map(|ticks| match self.meaning {
            Meaning::Time { per_second, .. } => {
                let day = 86_400 * per_second as i64;
                iso(ticks.div_euclid(day), ticks.rem_euclid(day) as f64 / per_second)
            }
            _ => iso(ticks, 0.0),
        }))
    }

    /// The next `rows` rows; a value that is missing is NaN.
    ///
    /// # Errors
    /// Where the column ends before.
    pub(super) fn read(&self, reader: &mut ColumnReader, rows: usize) -> Result<Read> {
        let mut first = self.first;
        let samples = match reader {
            ColumnReader::BoolColumnReader(r) => self.take(r, rows, |v| f64::from(u8::from(*v))),
            ColumnReader::Int32ColumnReader(r) => self.take(r, rows, |v| match self.meaning {
                Meaning::Unsigned => f64::from(*v as u32),
                _ => self.integer(i64::from(*v), &mut first),
            }),
            ColumnReader::Int64ColumnReader(r) => self.take(r, rows, |v| match self.meaning {
                Meaning::Unsigned => *v as u64 as f64,
                _ => self.integer(*v, &mut first),
            }),
            ColumnReader::Int96ColumnReader(r) => self.take(r, rows, |v| self.integer(v.to_nanos(), &mut first)),
            ColumnReader::FloatColumnReader(r) => self.take(r, rows, |v| f64::from(*v)),
            ColumnReader::DoubleColumnReader(r) => self.take(r, rows, |v| *v),
            ColumnReader::ByteArrayColumnReader(r) => self.take(r, rows, |v| self.bytes(v.data())),
            ColumnReader::FixedLenByteArrayColumnReader(r) => self.take(r, rows, |v| self.bytes(v.data())),
        }?;
        Ok(Read { samples, first })
    }

    fn take<T: DataType>(
        &self,
        reader: &mut ColumnReaderImpl<T>,
        rows: usize,
        mut number: impl FnMut(&T::T) -> f64,
    ) -> Result<Vec<f64>> {
        let (mut values, mut levels) = (Vec::new(), Vec::new());
        let levels_wanted = (self.defined > 0).then_some(&mut levels);
        let (records, _, _) = reader.read_records(rows, levels_wanted, None, &mut values)?;
        if records < rows {
            return Err(ParquetError::EOF(format!("{} rows are missing", rows - records)));
        }
        let mut present = values.iter();
        if self.defined == 0 {
            return Ok(present.map(number).collect());
        }
        let sample = |level: &i16| (*level == self.defined).then(|| present.next().map(&mut number)).flatten();
        Ok(levels.iter().map(sample).map(|n| n.unwrap_or(f64::NAN)).collect())
    }

    fn integer(&self, value: i64, first: &mut Option<i64>) -> f64 {
        if self.meaning == Meaning::Signed {
            let first = *first.get_or_insert(value);
            return if stamp::in_nanoseconds(first.into()) { since(value, first) } else { value as f64 };
        }
        let mut since_first = || since(value, *first.get_or_insert(value));
        match self.meaning {
            Meaning::Decimal(scale) => value as f64 / 10f64.powi(scale),
            Meaning::Time { per_second, .. } => since_first() / per_second,
            Meaning::Days => since_first() * 86_400.0,
            _ => value as f64,
        }
    }

    fn bytes(&self, bytes: &[u8]) -> f64 {
        match (self.meaning, bytes) {
            (Meaning::Half, [low, high]) => half(u16::from_le_bytes([*low, *high])),
            (Meaning::Decimal(scale), _) if !bytes.is_empty() && bytes.len() <= 16 => {
                let sign = if bytes[0] >> 7 == 1 { -1 } else { 0 };
                bytes.iter().fold(sign, |n: i128, b| n << 8 | i128::from(*b)) as f64 / 10f64.powi(scale)
            }
            _ => f64::NAN,
        }
    }
}

/// One integer less another.
fn since(value: i64, first: i64) -> f64 {
    (i128::from(value) - i128::from(first)) as f64
}

fn meaning(of: &ColumnDescriptor, field: Option<&Field>) -> Option<Meaning> {
    let logical = of.logical_type_ref();
    let ticks = |unit: &TimeUnit| match unit {
        TimeUnit::MILLIS => 1e3,
        TimeUnit::MICROS => 1e6,
        TimeUnit::NANOS => 1e9,
    };
    let integer = || match (logical, of.converted_type()) {
        (Some(LogicalType::Timestamp(t)), _) => Some(Meaning::Time { per_second: ticks(&t.unit), date: true }),
        (Some(LogicalType::Time(t)), _) => Some(Meaning::Time { per_second: ticks(&t.unit), date: false }),
        (_, ConvertedType::TIMESTAMP_MILLIS) => Some(Meaning::Time { per_second: 1e3, date: true }),
        (_, ConvertedType::TIMESTAMP_MICROS) => Some(Meaning::Time { per_second: 1e6, date: true }),
        (_, ConvertedType::TIME_MILLIS) => Some(Meaning::Time { per_second: 1e3, date: false }),
        (_, ConvertedType::TIME_MICROS) => Some(Meaning::Time { per_second: 1e6, date: false }),
        (_, ConvertedType::DATE) => Some(Meaning::Days),
        (_, ConvertedType::DECIMAL) => Some(Meaning::Decimal(of.type_scale())),
        (Some(LogicalType::Integer(i)), _) if !i.is_signed => Some(Meaning::Unsigned),
        _ => field.and_then(|f| f.per_second).map(|per_second| Meaning::Time { per_second, date: false }),
    };
    match of.physical_type() {
        Type::BOOLEAN => Some(Meaning::Unsigned),
        Type::INT32 | Type::INT64 => Some(integer().unwrap_or(Meaning::Signed)),
        Type::INT96 => Some(Meaning::Time { per_second: 1e9, date: true }),
        Type::FLOAT | Type::DOUBLE => Some(Meaning::Float),
        Type::FIXED_LEN_BYTE_ARRAY | Type::BYTE_ARRAY => match (logical, of.converted_type()) {
            (Some(LogicalType::Float16), _) => Some(Meaning::Half),
            (_, ConvertedType::DECIMAL) => Some(Meaning::Decimal(of.type_scale())),
            _ => None,
        },
    }
}
