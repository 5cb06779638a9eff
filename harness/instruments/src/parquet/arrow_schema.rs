//! What Arrow adds to the schema of a Parquet file, under the key `ARROW:schema`: units of columns and durations. The
//! text is base64 of a message of <https://arrow.apache.org/docs/format/Columnar.html#ipc-message-format>, a table of
//! <https://flatbuffers.dev/internals/>. The reader of Parquet's crate for it needs all of Arrow, some 10 crates.

use parquet::file::metadata::KeyValue;

/// A column as Arrow describes it.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Field {
    pub name: String,
    /// Empty where it gives none.
    pub unit: String,
    /// Ticks in a second, of a duration.
    pub per_second: Option<f64>,
}

/// Columns that are looked at, at most.
const FIELDS: u32 = 1 << 16;
const DURATION: u8 = 18;

/// The columns that Arrow describes; none where the file holds no such schema, or a damaged one.
pub(super) fn fields(metadata: Option<&Vec<KeyValue>>) -> Vec<Field> {
    let text = metadata.into_iter().flatten().find(|kv| kv.key == "ARROW:schema").and_then(|kv| kv.value.as_ref());
    text.and_then(|t| base64(t)).and_then(|bytes| parse(&bytes)).unwrap_or_default()
}

fn parse(bytes: &[u8]) -> Option<Vec<Field>> {
    // a mark of four bytes and the length stand before the message, in older files the length only
    let message = if bytes.starts_with(&[0xff; 4]) { bytes.get(8..)? } else { bytes.get(4..)? };
    let schema = Table::root(message)?.table(2)?;
    Some(schema.tables(1)?.into_iter().filter_map(field).collect())
}

fn field(of: Table) -> Option<Field> {
    let duration = (of.byte(2) == Some(DURATION)).then(|| of.table(3)).flatten();
    let per_second = duration.map(|d| match d.short(0).unwrap_or(1) {
        0 => 1.0,
        1 => 1e3,
        2 => 1e6,
        _ => 1e9,
    });
    let pairs = of.tables(6).unwrap_or_default();
    let is_unit = |kv: &&Table| kv.text(0).is_some_and(|k| ["unit", "units"].contains(&k.to_lowercase().as_str()));
    let unit = pairs.iter().find(is_unit).and_then(|kv| kv.text(1)).unwrap_or_default();
    Some(Field { name: of.text(0)?.to_string(), unit: unit.to_string(), per_second })
}

/// A table of a flat buffer, every place in it checked.
#[derive(Clone, Copy)]
struct Table<'a> {
    all: &'a [u8],
    at: usize,
}

impl<'a> Table<'a> {
    fn root(all: &'a [u8]) -> Option<Table<'a>> {
        Some(Table { all, at: word(all, 0)? as usize })
    }

    /// Where the field of that number stands; None where it is left at its default.
    fn place(&self, field: usize) -> Option<usize> {
        let back = word(self.all, self.at)? as i32;
        let list = usize::try_from(i64::try_from(self.at).ok()? - i64::from(back)).ok()?;
        let entry = 4 + 2 * field;
        if entry + 2 > usize::from(half_word(self.all, list)?) {
            return None;
        }
        match half_word(self.all, list.checked_add(entry)?)? {
            0 => None,
            offset => self.at.checked_add(usize::from(offset)),
        }
    }

    /// Where the field points at.
    fn target(&self, field: usize) -> Option<usize> {
        let place = self.place(field)?;
        place.checked_add(word(self.all, place)? as usize)
    }

    fn byte(&self, field: usize) -> Option<u8> {
        self.all.get(self.place(field)?).copied()
    }

    fn short(&self, field: usize) -> Option<u16> {
        half_word(self.all, self.place(field)?)
    }

    fn table(&self, field: usize) -> Option<Table<'a>> {
        Some(Table { all: self.all, at: self.target(field)? })
    }

    fn text(&self, field: usize) -> Option<&'a str> {
        let at = self.target(field)?;
        let start = at.checked_add(4)?;
        std::str::from_utf8(self.all.get(start..start.checked_add(word(self.all, at)? as usize)?)?).ok()
    }

    fn tables(&self, field: usize) -> Option<Vec<Table<'a>>> {
        let at = self.target(field)?;
        let of = |i: u32| {
            let place = at.checked_add(4 + 4 * i as usize)?;
            Some(Table { all: self.all, at: place.checked_add(word(self.all, place)? as usize)? })
        };
        (0..word(self.all, at)?.min(FIELDS)).map(of).collect()
    }
}

fn word(bytes: &[u8], at: usize) -> Option<u32> {
    let found = bytes.get(at..at.checked_add(4)?)?;
    Some(u32::from_le_bytes([found[0], found[1], found[2], found[3]]))
}

fn half_word(bytes: &[u8], at: usize) -> Option<u16> {
    let found = bytes.get(at..at.checked_add(2)?)?;
    Some(u16::from_le_bytes([found[0], found[1]]))
}

/// The bytes of a text in base64; None where it is none.
fn base64(text: &str) -> Option<Vec<u8>> {
    let mut out = Vec::with_capacity(text.len() / 4 * 3);
    let (mut held, mut bits) = (0u32, 0);
    for c in text.trim_end_matches('=').bytes() {
        let six = match c {
            b'A'..=b'Z' => c - b'A',
            b'a'..=b'z' => c - b'a' + 26,
            b'0'..=b'9' => c - b'0' + 52,
            b'+' => 62,
            b'/' => 63,
            _ => return None,
        };
        held = held << 6 | u32::from(six);
        bits += 6;
        if bits >= 8 {
            bits -= 8;
            out.push((held >> bits) as u8);
            held &= (1 << bits) - 1;
        }
    }
    Some(out)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn base64_is_read_and_other_text_refused() {
        assert_eq!(base64("aGVsbG8=").unwrap(), b"hello");
        assert_eq!(base64("//8=").unwrap(), [0xff, 0xff]);
        assert_eq!(base64("a b"), None);
    }

    #[test]
    fn a_damaged_schema_gives_no_fields() {
        assert_eq!(parse(&[0xff; 64]), None);
        for length in 0..64 {
            assert!(parse(&vec![0; length]).is_none_or(|f| f.is_empty()));
        }
    }
}
