//! Results written while they are computed: CSV or Parquet, under a name of their own until they are whole.

use anyhow::{Context, Result};
use output::{Kept, Part};
use parquet::basic::{Repetition, Type as Physical};
use parquet::data_type::DoubleType;
use parquet::file::properties::WriterProperties;
use parquet::file::reader::{FileReader, SerializedFileReader};
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::types::Type;
use std::fs::File;
use std::io::{BufRead, BufReader, BufWriter, Read, Seek, SeekFrom, Write};
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

/// Name of the first column of every table of rows.
pub const TIME: &str = "time [s]";
/// Name of such a table in Parquet.
const TABLE: &str = "results";

/// Whether a file holds rows that a [`Sink`] has written and nothing else: nothing else may be taken away. Of Parquet only a whole
/// file can be known.
pub fn are_rows(file: File) -> bool {
    let mut head = Vec::new();
    let Ok(mut whole) = file.try_clone() else { return false };
    let read = file.take(4).read_to_end(&mut head).and_then(|_| whole.seek(SeekFrom::Start(0)));
    match read {
        Ok(_) if head == b"PAR1" => is_parquet_of_rows(whole).unwrap_or(false),
        Ok(_) => are_lines_of_rows(BufReader::new(whole)).unwrap_or(false),
        Err(_) => false,
    }
}

fn is_parquet_of_rows(file: File) -> parquet::errors::Result<bool> {
    let reader = SerializedFileReader::new(file)?;
    let schema = reader.metadata().file_metadata().schema_descr();
    let of_doubles = schema.columns().iter().all(|c| c.physical_type() == Physical::DOUBLE);
    Ok(of_doubles && schema.name() == TABLE && schema.columns().first().is_some_and(|c| c.name() == TIME))
}

/// A head, and lines of as many numbers as it has columns, each as [`Sink::row`] writes it; the last may be cut anywhere.
fn are_lines_of_rows(mut lines: impl BufRead) -> std::io::Result<bool> {
    let mut line = Vec::new();
    lines.read_until(b'\n', &mut line)?;
    let mut head = csv::ReaderBuilder::new().has_headers(false).from_reader(line.as_slice());
    let columns = match head.records().next() {
        Some(Ok(names)) if names.get(0) == Some(TIME) => names.len(),
        _ => return Ok(false),
    };
    let is_number =
        |text: &str| matches!(text, "NaN" | "inf" | "-inf") || text.contains('e') && text.parse::<f64>().is_ok();
    loop {
        line.clear();
        if lines.read_until(b'\n', &mut line)? == 0 {
            return Ok(true);
        }
        let Ok(text) = std::str::from_utf8(&line) else { return Ok(false) };
        let is_row = match text.strip_suffix('\n') {
            Some(row) => row.split(',').count() == columns && row.split(',').all(is_number),
            None => text.chars().all(|c| c.is_ascii_digit() || "+-.e,NaNinf".contains(c)),
        };
        if !is_row {
            return Ok(false);
        }
    }
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
            let schema = Arc::new(Type::group_type_builder(TABLE).with_fields(fields).build()?);
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

    /// Ends the file, which still ends in `.part`: what of it can be read, None where nothing can; and what the file system has
    /// against it. Rows of CSV that were written stay where others cannot be.
    pub fn finish(self) -> (Option<Part>, Result<()>) {
        match self.form {
            Form::Csv(mut writer) => {
                let flushed = writer.flush();
                // what was not flushed is not tried again
                drop(writer.into_parts());
                (Some(self.part), flushed.map_err(Into::into))
            }
            Form::Parquet { mut writer, mut columns } => {
                let closed = flush(&mut writer, &mut columns).and_then(|()| Ok(writer.close().map(drop)?));
                (Some(self.part).filter(|_| closed.is_ok()), closed)
            }
        }
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

    fn whole(sink: Sink) -> Part {
        let (part, written) = sink.finish();
        written.unwrap();
        part.unwrap()
    }

    #[test]
    fn rows_are_known_by_all_that_a_file_holds() {
        let dir = tempfile::tempdir().unwrap();
        let is = |bytes: &[u8]| {
            std::fs::write(dir.path().join("f"), bytes).unwrap();
            are_rows(File::open(dir.path().join("f")).unwrap())
        };
        // as written, cut anywhere, without rows yet
        assert!(
            is(b"time [s],x\n0e0,1.5e-3\n1e-3,NaN\n") && is(b"time [s],\"a,b\"\n0e0,-inf\n2e-") && is(b"time [s],x\n")
        );
        for mine in [
            "time [s],x\n1,2\n",
            "time [s],x\n0e0,1e0\nmy notes\n",
            "time [s],x\n0e0,1e0,2e0\n",
            "time [s],x\n0e0,no inf\n",
            "t,x\n",
            "PAR1",
        ] {
            assert!(!is(mine.as_bytes()), "{mine}");
        }
        for parquet in [true, false] {
            let path = dir.path().join("rows");
            let mut sink = Sink::new(&path, &["time [s]", "x"].map(String::from), parquet).unwrap();
            sink.row(&[0.0, f64::NAN]).unwrap();
            assert!(whole(sink).leave(are_rows).unwrap().is_none());
            assert!(are_rows(File::open(path).unwrap()), "{parquet}");
        }
    }

    #[test]
    fn names_with_commas_and_quotes_stand_in_one_cell_each() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("r.csv");
        let head = ["time [s]", "bar.F[1,2] [N]", "a \"b\", c", "x"].map(String::from);
        let mut sink = Sink::new(&path, &head, false).unwrap();
        sink.row(&[0.0, 1.0, 2.0, 3.0]).unwrap();
        whole(sink).leave(are_rows).unwrap();
        let text = std::fs::read_to_string(&path).unwrap();
        assert!(text.starts_with("time [s],\"bar.F[1,2] [N]\",\"a \"\"b\"\", c\",x\n0e0,1e0,"), "{text}");
        let mut reader = csv::Reader::from_path(&path).unwrap();
        assert_eq!(reader.headers().unwrap(), &head[..]);
        assert_eq!(reader.records().next().unwrap().unwrap().len(), 4);
    }
}
