//! The table `--table`: facts of each recording, a row each.

use crate::amount::instead;
use crate::facts::{key, known, Facts, KEYS};
use record::units;
use std::path::Path;

/// Rows in order: the file's name, and what is said of it.
#[derive(Clone, Debug, Default)]
pub struct Table {
    name: String,
    rows: Vec<(String, Facts)>,
}

impl Table {
    /// Reads a text in any dialect with a header: a column `file`, and columns `name [unit]` of facts.
    ///
    /// # Errors
    /// Everything wrong with it, with file and line.
    pub fn read(path: &Path) -> Result<Table, Vec<String>> {
        let name = path.display().to_string();
        let (lines, delimiter) = instruments::lines(path, input::TEXT)
            .map_err(|e| vec![format!("{e}, as a CSV file with a column file")])
            .map(parted)?;
        let mut reader = csv::ReaderBuilder::new()
            .trim(csv::Trim::All)
            .delimiter(delimiter)
            .flexible(true)
            .from_reader(lines.as_bytes());
        let head = reader.headers().map_err(|e| vec![format!("{name}:1: {e}; write a header")])?.clone();
        let mut faults = Vec::new();
        let columns: Vec<Option<(&'static str, String)>> = head
            .iter()
            .map(|h| match column(h) {
                Ok(c) => c,
                Err(e) => {
                    faults.push(format!("{name}:1: {e}"));
                    None
                }
            })
            .collect();
        let Some(file) = head.iter().position(is_file) else {
            faults.push(format!("{name}:1: there is no column file; add it, with the name of each file"));
            return Err(faults);
        };
        let mut rows = Vec::new();
        for row in reader.records() {
            let row = match row {
                Ok(r) => r,
                Err(e) => {
                    faults.push(format!("{name}: {e}; complete the row"));
                    break;
                }
            };
            let line = row.position().map_or(0, |p| p.line());
            if row.iter().all(str::is_empty) {
                continue;
            }
            if row.len() > head.len() && !row.iter().skip(head.len()).all(str::is_empty) {
                let cure = "write semicolons between the cells where numbers have decimal commas";
                faults.push(format!("{name}:{line}: the row has more cells than the header; {cure}"));
                continue;
            }
            let Some(of) = row.get(file) else {
                faults.push(format!("{name}:{line}: the row ends before the column file; complete the row"));
                continue;
            };
            let mut facts = Facts::default();
            for (cell, column) in row.iter().zip(&columns) {
                if let (Some((key, unit)), false) = (column, cell.is_empty()) {
                    if let Err(e) = facts.read(key, cell, unit, &format!("{name}, line {line}")) {
                        faults.push(format!("{name}:{line}: {e}"));
                    }
                }
            }
            rows.push((of.to_string(), facts));
        }
        if faults.is_empty() {
            Ok(Table { name, rows })
        } else {
            Err(faults)
        }
    }

    /// What is said of the `i`-th of `count` recordings of the file `path`: one row is for all of them, as many rows as
    /// recordings are for one each.
    ///
    /// # Errors
    /// Where there are rows, but neither one nor as many.
    pub fn of(&self, path: &Path, i: usize, count: usize) -> Result<Facts, String> {
        let file = path.file_name().map_or(String::new(), |f| f.to_string_lossy().into_owned());
        let rows: Vec<&Facts> = self.rows.iter().filter(|r| means(&r.0, path)).map(|r| &r.1).collect();
        match rows.len() {
            0 => Ok(Facts::default()),
            1 => Ok(rows[0].clone()),
            n if n == count => Ok(rows[i].clone()),
            n => Err(format!(
                "{}: {n} rows are of {file}, which holds {count} recordings; give one row, or one for each",
                self.name
            )),
        }
    }
}

impl Table {
    /// Names in it that are of none of the files.
    pub fn strangers(&self, files: &[&Path]) -> Vec<String> {
        let strange = self.rows.iter().filter(|r| !files.iter().any(|f| means(&r.0, f)));
        strange.map(|r| format!("{}: {} is none of the files", self.name, r.0)).collect()
    }
}

/// Whether a name of the table means the file: its name, with its end or without, or its path.
fn means(name: &str, path: &Path) -> bool {
    path.file_name().is_some_and(|f| f == name)
        || path.file_stem().is_some_and(|f| f == name)
        || path == Path::new(name)
}

/// Whether a column holds the files' names.
fn is_file(name: &str) -> bool {
    ["file", "datei", "fichier", "archivo", "fichero", "文件", "ファイル"]
        .contains(&name.trim().to_lowercase().as_str())
}

/// The lines as one text, and what stands between their cells: what the header holds most of.
fn parted(mut lines: Vec<String>) -> (String, u8) {
    let named = lines.first().and_then(|l| l.trim().strip_prefix("sep=")).map(|s| s.bytes().next().unwrap_or(b'\t'));
    if named.is_some() {
        // the lines keep their numbers
        lines[0].clear();
    }
    let head = lines.iter().find(|l| !l.trim().is_empty()).map_or("", String::as_str);
    let count = |d: u8| head.bytes().filter(|b| *b == d).count();
    let most = [b';', b'\t', b'|', b','].into_iter().rev().max_by_key(|d| count(*d)).unwrap_or(b',');
    (lines.join("\n"), named.unwrap_or(most))
}

/// Key and unit of a column; None for the column `file`.
fn column(head: &str) -> Result<Option<(&'static str, String)>, String> {
    let (name, unit) = head.split_once(['[', '(']).unwrap_or((head, ""));
    let unit = unit.trim_end_matches([']', ')', ' ']);
    if is_file(name) {
        return Ok(None);
    }
    let Some(key) = key(name) else {
        let known: Vec<&str> = std::iter::once("file").chain(known()).collect();
        return Err(format!("column {head:?} is not known; {}", instead(name.trim(), &known)));
    };
    let quantity = KEYS.iter().find(|k| k.0 == key).map_or("", |k| k.1);
    if !unit.is_empty() && units::factor(quantity, unit).is_none() {
        return Err(format!("unit {unit:?} does not measure {key}; {}", units::instead(quantity, unit)));
    }
    Ok(Some((key, unit.to_string())))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table(text: &str) -> Result<Table, Vec<String>> {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("levels.csv");
        std::fs::write(&path, text).unwrap();
        Table::read(&path)
    }

    #[test]
    fn a_row_is_for_a_file_or_for_a_recording_in_it() {
        let t = table("file,drop height [mm],order\na.tdms,200,2\nb,300,\nb,400,\n").unwrap();
        let height = |f: &str, i, n| t.of(Path::new(f), i, n).map(|f| f.number("drop_height"));
        assert_eq!(height("x/a.tdms", 1, 2), Ok(Some(0.2)));
        assert_eq!(height("b.csv", 1, 2), Ok(Some(0.4)));
        assert_eq!(height("c.csv", 0, 1), Ok(None));
        assert_eq!(
            t.strangers(&[Path::new("x/a.tdms")]),
            ["b", "b"].map(|f| format!("{}: {f} is none of the files", t.name))
        );
        assert!(height("b.csv", 0, 3).unwrap_err().contains("2 rows are of b.csv, which holds 3 recordings"));
    }

    #[test]
    fn a_table_may_be_of_any_dialect() {
        let height = |text: &str| table(text).unwrap().of(Path::new("a.csv"), 0, 1).unwrap().number("drop_height");
        for text in [
            "Datei;Fallhöhe [mm]\na;12,5\n",
            "file\tdrop height [mm]\na.csv\t12.5\n",
            "sep=;\nfile;drop_height [mm]\n\na;12,5\n",
            "file|Hauteur de chute (mm)\r\na|12.5\r\n",
            "file,drop_height [mm]\na,\"12,5\"\n",
        ] {
            assert_eq!(height(text), Some(0.0125), "{text}");
        }
        assert!(table("file,drop_height [mm]\na,12,5\n").unwrap_err()[0].contains("semicolons"));
    }

    #[test]
    fn everything_wrong_with_a_table_is_told_at_once() {
        let e = table("file,drop_height [kg],hight,impact_speed\na,1,1,fast\n").unwrap_err();
        assert_eq!(e.len(), 3, "{e:?}");
        assert!(e[0].contains("measures mass") && e[1].contains("hight") && e[2].contains("levels.csv:2: \"fast\""));
        assert!(table("x\n1\n").unwrap_err().iter().any(|e| e.contains("no column file")));
    }
}
