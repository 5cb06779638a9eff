//! Results written while they are computed: CSV or Parquet, under a name of their own until they are whole.

use anyhow::{Context, Result};
use output::{Kept, Part};
use parquet::basic::{Repetition, Type as Physical};
use parquet::data_type::DoubleType;
use parquet::file::properties::WriterProperties;
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::types::Type;
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::Path;
use std::sync::Arc;

/// Rows that Parquet collects before it writes them.
const GROUP: usize = 8192;

enum Form {
    Csv(BufWriter<File>),
    Parquet { writer: Box<SerializedFileWriter<File>>, columns: Vec<Vec<f64>> },
}

/// A file of rows of numbers, which ends in `.part`, of this process alone.
pub struct Sink {
    form: Form,
    part: Part,
    kept: Vec<Kept>,
    line: String,
}

/// Whether a file begins as one of rows does.
pub fn are_rows(head: &[u8]) -> bool {
    head.starts_with(b"time [s]") || head.starts_with(b"\"time [s]") || head.starts_with(b"PAR1")
}

impl Sink {
    /// Opens `path` with `.part` behind it (its folders are made) with the columns of `head`; Parquet where `parquet`, else
    /// CSV.
    ///
    /// # Errors
    /// As the file system gives them; where another process writes its rows there.
    pub fn new(path: &Path, head: &[String], parquet: bool) -> Result<Sink> {
        let named = || format!("{}: cannot be written", path.display());
        let (part, kept) = Part::new(path, are_rows).with_context(named)?;
        let file = part.file().with_context(named)?;
        let form = if parquet {
            let mut fields = Vec::new();
            for name in head {
                let field = Type::primitive_type_builder(name, Physical::DOUBLE).with_repetition(Repetition::REQUIRED);
                fields.push(Arc::new(field.build()?));
            }
            let schema = Arc::new(Type::group_type_builder("results").with_fields(fields).build()?);
            let properties = Arc::new(WriterProperties::builder().set_dictionary_enabled(false).build());
            let writer = Box::new(SerializedFileWriter::new(file, schema, properties)?);
            Form::Parquet { writer, columns: vec![Vec::new(); head.len()] }
        } else {
            let mut writer = BufWriter::new(file);
            // names of FMU variables may hold commas
            let mut line = csv::Writer::from_writer(&mut writer);
            line.write_record(head).with_context(named)?;
            line.flush().with_context(named)?;
            drop(line);
            Form::Csv(writer)
        };
        Ok(Sink { form, part, kept, line: String::new() })
    }

    /// Writes a row, as many values as columns; every number reads back as the same double.
    ///
    /// # Errors
    /// As the file system gives them.
    pub fn row(&mut self, values: &[f64]) -> Result<()> {
        use std::fmt::Write as _;
        match &mut self.form {
            Form::Csv(writer) => {
                self.line.clear();
                for (i, v) in values.iter().enumerate() {
                    if i > 0 {
                        self.line.push(',');
                    }
                    // writing to a String cannot fail
                    let _ = write!(self.line, "{v:e}");
                }
                self.line.push('\n');
                writer.write_all(self.line.as_bytes())?;
            }
            Form::Parquet { writer, columns } => {
                for (c, v) in columns.iter_mut().zip(values) {
                    c.push(*v);
                }
                if columns[0].len() >= GROUP {
                    flush(writer, columns)?;
                }
            }
        }
        Ok(())
    }

    /// What was in the way and is kept under another name.
    pub fn kept(&self) -> &[Kept] {
        &self.kept
    }

    /// Ends the file, which still ends in `.part`.
    ///
    /// # Errors
    /// As the file system gives them.
    pub fn finish(self) -> Result<Part> {
        match self.form {
            Form::Csv(mut writer) => writer.flush()?,
            Form::Parquet { mut writer, mut columns } => {
                flush(&mut writer, &mut columns)?;
                writer.close()?;
            }
        }
        Ok(self.part)
    }
}

fn flush(writer: &mut SerializedFileWriter<File>, columns: &mut [Vec<f64>]) -> Result<()> {
    if columns.first().is_none_or(Vec::is_empty) {
        return Ok(());
    }
    let mut group = writer.next_row_group()?;
    for c in columns.iter_mut() {
        if let Some(mut w) = group.next_column()? {
            w.typed::<DoubleType>().write_batch(c, None, None)?;
            w.close()?;
        }
        c.clear();
    }
    group.close()?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_with_commas_and_quotes_stand_in_one_cell_each() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("r.csv");
        let head = ["time [s]", "bar.F[1,2] [N]", "a \"b\", c", "x"].map(String::from);
        let mut sink = Sink::new(&path, &head, false).unwrap();
        sink.row(&[0.0, 1.0, 2.0, 3.0]).unwrap();
        sink.finish().unwrap().leave(are_rows).unwrap();
        let text = std::fs::read_to_string(&path).unwrap();
        assert!(text.starts_with("time [s],\"bar.F[1,2] [N]\",\"a \"\"b\"\", c\",x\n0e0,1e0,"), "{text}");
        let mut reader = csv::Reader::from_path(&path).unwrap();
        assert_eq!(reader.headers().unwrap(), &head[..]);
        assert_eq!(reader.records().next().unwrap().unwrap().len(), 4);
    }
}
