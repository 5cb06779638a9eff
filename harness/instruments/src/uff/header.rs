//! The eleven lines above the values of a dataset 58, and the units of dataset 164.

use crate::shared::cell::{Cell, Decimal, Delimiter, Dialect};
use crate::shared::lines::decode;
use crate::shared::unit::ticks_of_a_second;

/// Lines of a header.
pub(crate) const LINES: usize = 11;

/// A number in a universal file: with a decimal point and an exponent of `E` or `D`, or without the letter where it has
/// three digits (`1.5-100`).
pub(crate) fn number(field: &[u8]) -> Option<f64> {
    let mut dialect = Dialect { delimiter: Delimiter::Spaces, decimal: Decimal::Point, thousands: false };
    match dialect.cell(field) {
        Cell::Number(number) => Some(number),
        Cell::Missing => Some(f64::NAN),
        _ => {
            let sign = field.iter().rposition(|b| matches!(b, b'+' | b'-')).filter(|at| *at + 4 == field.len())?;
            let (mantissa, exponent) = field.split_at(sign);
            let digit = mantissa.last().is_some_and(u8::is_ascii_digit);
            let spelled = [mantissa, b"E".as_slice(), exponent].concat();
            match dialect.cell(&spelled) {
                Cell::Number(number) if digit => Some(number),
                _ => None,
            }
        }
    }
}

/// The units of length and force that a file's numbers have.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Units {
    length: &'static str,
    force: &'static str,
}

impl Units {
    pub const SI: Units = Units { length: "m", force: "N" };

    /// By the code of dataset 164; no units for systems that a user defines.
    pub fn of_code(code: i64) -> Option<Units> {
        let (length, force) = match code {
            1 => ("m", "N"),
            2 => ("ft", "lbf"),
            3 => ("m", "kgf"),
            4 => ("ft", "pdl"),
            5 => ("mm", "mN"),
            6 => ("cm", "cN"),
            7 => ("in", "lbf"),
            8 => ("mm", "kgf"),
            _ => return None,
        };
        Some(Units { length, force })
    }

    /// The unit of a specific data type.
    fn of_type(self, data_type: i64) -> String {
        let Units { length, force } = self;
        match data_type {
            2 | 15 if (length, force) == ("m", "N") => "Pa".to_string(),
            2 | 15 => format!("{force}/{length}\u{b2}"),
            8 => length.to_string(),
            9 | 13 => force.to_string(),
            11 => format!("{length}/s"),
            12 => format!("{length}/s\u{b2}"),
            16 if (length, force) == ("m", "N") => "kg".to_string(),
            17 => "s".to_string(),
            18 => "Hz".to_string(),
            19 => "rpm".to_string(),
            _ => String::new(),
        }
    }
}

/// An axis.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Axis {
    /// The specific data type: 17 is time.
    pub data_type: i64,
    pub label: String,
    pub unit: String,
}

/// A dataset's header.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Header {
    ids: Vec<String>,
    pub function: i64,
    node: i64,
    direction: i64,
    entity: String,
    /// 2 and 4: real, single and double precision; 5 and 6: complex.
    pub data_type: i64,
    pub count: u64,
    pub even: bool,
    /// Abscissa of the first value and step, where it is even.
    pub start: f64,
    pub step: f64,
    pub abscissa: Axis,
    pub ordinate: Axis,
}

/// Cuts fields of given widths from a line.
struct Fields<'a>(&'a [u8]);

impl<'a> Fields<'a> {
    fn bytes(&mut self, width: usize) -> &'a [u8] {
        let (field, rest) = self.0.split_at(width.min(self.0.len()));
        self.0 = rest;
        field.trim_ascii()
    }

    /// A whole number; 0 where the field is blank.
    fn whole(&mut self, width: usize) -> Option<i64> {
        let field = self.bytes(width);
        if field.is_empty() {
            Some(0)
        } else {
            std::str::from_utf8(field).ok()?.parse().ok()
        }
    }

    fn real(&mut self, width: usize) -> Option<f64> {
        let field = self.bytes(width);
        if field.is_empty() {
            Some(0.0)
        } else {
            number(field).filter(|n| n.is_finite())
        }
    }

    /// A text; empty where it is NONE.
    fn text(&mut self, width: usize) -> String {
        let text = decode(self.bytes(width)).trim().to_string();
        if text.eq_ignore_ascii_case("none") {
            String::new()
        } else {
            text
        }
    }
}

impl Header {
    /// Reads a header; `Err` is the number of the record that is not one.
    pub fn read(lines: &[Vec<u8>], units: Option<Units>) -> Result<Header, usize> {
        let mut header = Header { ids: lines[..5].iter().map(|l| Fields(l).text(80)).collect(), ..Header::default() };
        header.freedoms(&lines[5]).ok_or(6_usize)?;
        header.form(&lines[6]).or_else(|| header.form_of_words(&lines[6])).ok_or(7_usize)?;
        header.abscissa = axis(&lines[7], units).ok_or(8_usize)?;
        header.ordinate = axis(&lines[8], units).ok_or(9_usize)?;
        Ok(header)
    }

    fn freedoms(&mut self, line: &[u8]) -> Option<()> {
        let mut fields = Fields(line);
        self.function = fields.whole(5)?;
        fields.bytes(25);
        self.entity = fields.text(11);
        self.node = fields.whole(10)?;
        self.direction = fields.whole(4)?;
        Some(())
    }

    fn form(&mut self, line: &[u8]) -> Option<()> {
        let mut fields = Fields(line);
        self.data_type = fields.whole(10)?;
        self.count = fields.whole(10)?.try_into().ok()?;
        self.even = fields.whole(10)? != 0;
        self.start = fields.real(13)?;
        self.step = fields.real(13)?;
        Some(())
    }

    /// The same of a writer that keeps to no columns.
    fn form_of_words(&mut self, line: &[u8]) -> Option<()> {
        let text = std::str::from_utf8(line).ok()?;
        let words: Vec<&str> = text.split_whitespace().collect();
        let [data_type, count, even, start, step, ..] = words.as_slice() else { return None };
        self.data_type = data_type.parse().ok()?;
        self.count = count.parse().ok()?;
        self.even = *even != "0";
        self.start = number(start.as_bytes()).filter(|n| n.is_finite())?;
        self.step = number(step.as_bytes()).filter(|n| n.is_finite())?;
        Some(())
    }

    /// Whether it is a function of time.
    pub fn is_time_response(&self) -> bool {
        match self.function {
            1 => matches!(self.abscissa.data_type, 0 | 1 | 17),
            0 => self.abscissa.data_type == 17,
            _ => false,
        }
    }

    /// How often the unit of the abscissa fits into a second; None where it is no unit of time. An abscissa without a unit
    /// is in s.
    pub fn ticks(&self) -> Option<f64> {
        match self.abscissa.unit.as_str() {
            "" => Some(1.0),
            unit => ticks_of_a_second(unit),
        }
    }

    /// What the function is: ID line 1, or the ordinate's label.
    pub fn description(&self) -> &str {
        if self.ids[0].is_empty() {
            &self.ordinate.label
        } else {
            &self.ids[0]
        }
    }

    /// Node and direction of the response, such as `12+Z`; empty where there is none.
    pub fn freedom(&self) -> String {
        let direction = match self.direction.abs() {
            1 => "X",
            2 => "Y",
            3 => "Z",
            4 => "RX",
            5 => "RY",
            6 => "RZ",
            _ => "",
        };
        let sign = match (direction, self.direction) {
            ("", _) => "",
            (_, d) if d < 0 => "-",
            _ => "+",
        };
        match (self.node, self.entity.as_str()) {
            (0, "") if direction.is_empty() => String::new(),
            (node, "") => format!("{node}{sign}{direction}"),
            (node, entity) => format!("{entity}:{node}{sign}{direction}"),
        }
    }

    /// The ID lines that say something.
    pub fn properties(&self) -> Vec<(String, String)> {
        let lines = self.ids.iter().enumerate().filter(|(_, t)| !t.is_empty());
        lines.map(|(i, t)| (format!("ID line {}", i + 1), t.clone())).collect()
    }
}

fn axis(line: &[u8], units: Option<Units>) -> Option<Axis> {
    let mut fields = Fields(line);
    let data_type = fields.whole(10)?;
    fields.bytes(15);
    let label = fields.text(21);
    let unit = fields.text(21);
    let unit = if unit.is_empty() { units.map_or(String::new(), |u| u.of_type(data_type)) } else { unit };
    Some(Axis { data_type, label, unit })
}
