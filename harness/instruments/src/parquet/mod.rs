//! Parquet: <https://parquet.apache.org/docs/file-format/>. Columns of numbers, decimals, dates and times are channels;
//! dates and times count in s from the first. Read in blocks, row group by row group. The index stands at the end: a
//! file that was cut is refused.

mod arrow_schema;
mod column;

use crate::shared::block::{hand, most};
use crate::shared::guard::guarded;
use crate::{Channel, Fault, Format, Group, Sink, Source};
use column::Column;
use parquet::column::reader::ColumnReader;
use parquet::errors::ParquetError;
use parquet::file::reader::{FileReader, SerializedFileReader};
use std::fs::File;
use std::path::{Path, PathBuf};

pub(crate) const FORMAT: Format =
    Format { name: "Parquet", is: |head, _| head.starts_with(b"PAR1") || head.starts_with(b"PARE"), open };

/// Rows that a byte of the file can stand for at most; runs of one value take little place.
const PACKED: u64 = 1 << 20;

struct Table {
    path: PathBuf,
    file: SerializedFileReader<File>,
    groups: Vec<Group>,
    columns: Vec<Column>,
    notes: Vec<String>,
}

fn open(path: &Path) -> Result<Box<dyn Source>, Fault> {
    guarded(path, || {
        let unreadable = |e| Fault::unreadable(path, e);
        let file = input::open(path).map_err(unreadable)?;
        let length = file.metadata().map_err(unreadable)?.len();
        let file = SerializedFileReader::new(file).map_err(|e| damaged(path, &e))?;
        let mut table = Table { path: path.into(), file, groups: Vec::new(), columns: Vec::new(), notes: Vec::new() };
        let samples = table.rows(length)?;
        table.take_columns();
        let channels: Vec<Channel> =
            table.columns.iter().map(|c| Channel { name: c.name.clone(), unit: c.unit.clone() }).collect();
        let properties = [table.properties(), table.first_dates()?].concat();
        if channels.is_empty() {
            let what = format!(
                "the file holds no channels{}",
                table.notes.iter().map(|n| format!("; {n}")).collect::<String>()
            );
            return Err(Fault::new(path, what, "give a file with columns of numbers"));
        }
        table.groups = vec![Group { name: String::new(), channels, samples, clock: None, properties }];
        Ok(Box::new(table) as Box<dyn Source>)
    })
}

fn damaged(path: &Path, error: &ParquetError) -> Fault {
    Fault::new(path, error, "write the file anew, or copy it whole: its index stands at its end")
}

impl Table {
    /// Rows of all row groups.
    fn rows(&self, length: u64) -> Result<u64, Fault> {
        let of = |rows: i64| u64::try_from(rows).ok();
        let groups = self.file.metadata().row_groups().iter();
        let rows = groups.map(|g| of(g.num_rows())).try_fold(0u64, |all, n| all.checked_add(n?));
        rows.filter(|&n| n <= length.saturating_mul(PACKED)).ok_or_else(|| {
            Fault::new(&self.path, "the file claims more rows than it can hold", "take an undamaged copy of the file")
        })
    }

    fn take_columns(&mut self) {
        let metadata = self.file.metadata().file_metadata();
        let fields = arrow_schema::fields(metadata.key_value_metadata());
        for (index, of) in metadata.schema_descr().columns().iter().enumerate() {
            let field = fields.iter().find(|f| f.name == of.name() && of.path().parts().len() == 1);
            match Column::of(index, of, field) {
                Ok(column) => self.columns.push(column),
                Err(why) => self.notes.push(format!("column \"{}\" left out: {why}", of.path().string())),
            }
        }
    }

    /// The date at which each channel begins that counts from a date.
    fn first_dates(&self) -> Result<Vec<(String, String)>, Fault> {
        let mut dates = Vec::new();
        for column in self.columns.iter().filter(|c| c.is_date()) {
            if let Some(date) = column.first_date(&self.file).map_err(|e| self.place(column, 0, &e))? {
                dates.push((format!("{}.first", column.name), date));
            }
        }
        Ok(dates)
    }

    /// The texts that the writer added, without the schemas that libraries add for themselves.
    fn properties(&self) -> Vec<(String, String)> {
        let metadata = self.file.metadata().file_metadata();
        let own = |key: &str| !key.starts_with("ARROW:") && key != "pandas" && !key.starts_with("org.apache.");
        let pairs = metadata.key_value_metadata().into_iter().flatten().filter(|kv| own(&kv.key));
        let pairs = pairs.filter_map(|kv| Some((kv.key.clone(), kv.value.clone()?)));
        pairs.chain(metadata.created_by().map(|by| ("created by".to_string(), by.to_string()))).collect()
    }

    fn place(&self, column: &Column, row: u64, error: &ParquetError) -> Fault {
        damaged(&self.path, error).at(format!("column \"{}\" from row {row}", column.name))
    }

    /// Readers of all columns of a row group, and its rows.
    fn open_row_group(&self, index: usize, row: u64) -> Result<(Vec<ColumnReader>, u64), Fault> {
        let of = self.file.get_row_group(index).map_err(|e| damaged(&self.path, &e))?;
        let open = |c: &Column| of.get_column_reader(c.index).map_err(|e| self.place(c, row, &e));
        let readers = self.columns.iter().map(open).collect::<Result<_, _>>()?;
        Ok((readers, u64::try_from(of.metadata().num_rows()).unwrap_or(0)))
    }

    /// Hands the blocks of a row group on, which begins at row `row`; false where `sink` has enough.
    fn read_row_group(&mut self, index: usize, row: &mut u64, sink: &mut Sink) -> Result<bool, Fault> {
        let (mut readers, mut left) = guarded(&self.path, || self.open_row_group(index, *row))?;
        let rows = most(self.columns.len());
        while left > 0 {
            let wanted = rows.min(usize::try_from(left).unwrap_or(rows));
            let mut block = Vec::with_capacity(readers.len());
            for (at, reader) in readers.iter_mut().enumerate() {
                let read = guarded(&self.path, || {
                    self.columns[at].read(reader, wanted).map_err(|e| self.place(&self.columns[at], *row, &e))
                })?;
                block.push(read.samples);
                self.columns[at].first = read.first;
            }
            if hand(&block, sink).is_break() {
                return Ok(false);
            }
            *row += wanted as u64;
            left -= wanted as u64;
        }
        Ok(true)
    }
}

impl Source for Table {
    fn groups(&self) -> &[Group] {
        &self.groups
    }

    fn notes(&self) -> &[String] {
        &self.notes
    }

    fn read(&mut self, _group: usize, sink: &mut Sink) -> Result<(), Fault> {
        self.columns.iter_mut().for_each(|c| c.first = None);
        let mut row = 0;
        for index in 0..self.file.num_row_groups() {
            if !self.read_row_group(index, &mut row, sink)? {
                break;
            }
        }
        Ok(())
    }
}
