//! Times of day and dates in a cell.
//!
//! Times: `12:00:00`, `12:00:00.123`, `12:00:00,123`, `12:00:00:123`, `1:05:00.5 PM`, `05:00.5` (minutes and seconds, only
//! with a fraction). Dates before them: `2024-05-01` (also with `/` or `.`, also with `T` between), `01.05.2024` (day first),
//! `05/01/2024` (day or month first, in one order for the whole file: [`Dates`]), `01-May-2024`. A zone at the end is passed
//! over. Digits beyond picoseconds are cut.

use super::date::days;

/// Picoseconds of a second.
const PICO: i64 = 1_000_000_000_000;
const DAY: i64 = 86_400 * PICO;

/// Whether an integer is a time in nanoseconds since 1970, of the years 2001 to 2103: a double does not hold its digits.
pub(crate) fn in_nanoseconds(integer: i128) -> bool {
    (1_000_000_000_000_000_000..4_200_000_000_000_000_000).contains(&integer)
}

/// A time, and the day where the cell names it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Stamp {
    day: Option<Day>,
    /// Since midnight.
    picoseconds: i64,
}

/// Days since 1970-01-01, as either order reads the date; None where an order does not give a date.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Day {
    day_first: Option<i64>,
    month_first: Option<i64>,
}

/// What stands first in a date of three numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Order {
    Day,
    Month,
}

impl Day {
    fn of(self, order: Order) -> Option<i64> {
        match order {
            Order::Day => self.day_first.or(self.month_first),
            Order::Month => self.month_first.or(self.day_first),
        }
    }
}

impl Stamp {
    /// Seconds since `first`. `turns` counts the midnights that passed, where no day is named: the time falls by more than
    /// half a day.
    fn since(self, first: Stamp, last: Stamp, turns: &mut i64, order: Order) -> f64 {
        let days = match (self.day.and_then(|d| d.of(order)), first.day.and_then(|d| d.of(order))) {
            (Some(day), Some(first)) => day - first,
            _ => {
                *turns += i64::from(self.picoseconds < last.picoseconds - DAY / 2);
                *turns
            }
        };
        days as f64 * 86_400.0 + (self.picoseconds - first.picoseconds) as f64 / PICO as f64
    }

    /// Seconds since another stamp near it.
    pub fn after(self, first: Stamp) -> f64 {
        self.since(first, first, &mut 0, Order::Month)
    }
}

/// In which order the dates of a file are: all its cells decide.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Dates {
    decided: Option<Order>,
    /// Whether a cell can only be read with its day, or only with its month, first.
    only: [bool; 2],
    /// Longest step from a stamp to the next, s, by either order; infinite where one goes back.
    longest: [f64; 2],
}

/// Both orders, as [`Dates`] has them.
const ORDERS: [Order; 2] = [Order::Day, Order::Month];

impl Dates {
    fn note(&mut self, stamp: Stamp, last: Stamp) {
        let Some(day) = stamp.day else { return };
        self.only[0] |= day.month_first.is_none();
        self.only[1] |= day.day_first.is_none();
        for (longest, order) in self.longest.iter_mut().zip(ORDERS) {
            let step = stamp.since(last, last, &mut 0, order);
            *longest = longest.max(if step < 0.0 { f64::INFINITY } else { step });
        }
    }

    /// What these and `other` saw.
    pub fn join(&mut self, other: &Dates) {
        for i in 0..2 {
            self.only[i] |= other.only[i];
            self.longest[i] = self.longest[i].max(other.longest[i]);
        }
    }

    /// Settles the order: by a number above 12, else by the steps from one stamp to the next, which are the shorter ones in
    /// the right order; month first where nothing decides, as then nothing depends on it.
    ///
    /// # Errors
    /// Where some dates have a day above 12 first, and others second.
    pub fn settle(&mut self) -> Result<(), &'static str> {
        self.decided = Some(match self.only {
            [true, true] => return Err("some dates have their day first, others their month"),
            [true, false] => Order::Day,
            [false, true] => Order::Month,
            _ if self.longest[0] < self.longest[1] => Order::Day,
            _ => Order::Month,
        });
        Ok(())
    }

    fn order(&self) -> Order {
        self.decided.unwrap_or(Order::Month)
    }
}

/// Stamps one after the other, as seconds since the first.
#[derive(Clone, Debug, Default)]
pub(crate) struct Elapsed {
    first: Option<Stamp>,
    last: Option<Stamp>,
    turns: i64,
}

impl Elapsed {
    /// Seconds from the first stamp to this one, by the order of `dates`, which sees it.
    pub fn seconds(&mut self, stamp: Stamp, dates: &mut Dates) -> f64 {
        let first = *self.first.get_or_insert(stamp);
        let last = self.last.replace(stamp).unwrap_or(first);
        dates.note(stamp, last);
        stamp.since(first, last, &mut self.turns, dates.order())
    }
}

/// The time in a cell.
pub(crate) fn parse(cell: &[u8]) -> Option<Stamp> {
    if cell.len() > 48 || !cell.contains(&b':') {
        return None;
    }
    let text = std::str::from_utf8(cell).ok()?.trim();
    let (day, time) = match text.split_once(['T', ' ', '_']) {
        Some((date, time)) if !date.contains(':') => (Some(date_of(date.trim_end_matches(','))?), time.trim_start()),
        _ => (None, text),
    };
    Some(Stamp { day, picoseconds: time_of(time)? })
}

/// Whether a cell is a date without a time.
pub(crate) fn is_date(cell: &[u8]) -> bool {
    (8..=11).contains(&cell.len()) && std::str::from_utf8(cell).ok().and_then(date_of).is_some()
}

fn time_of(text: &str) -> Option<i64> {
    let lower = text.to_ascii_lowercase();
    let (text, half) = match (lower.strip_suffix("am"), lower.strip_suffix("pm")) {
        (Some(t), _) => (t.trim_end(), Some(0)),
        (_, Some(t)) => (t.trim_end(), Some(12)),
        _ => (lower.as_str(), None),
    };
    let (text, zone) = text.split_at(text.find(['+', '-', ' ', 'z']).unwrap_or(text.len()));
    let of_zone =
        |c: char| c.is_ascii_alphabetic() || "+-: ".contains(c) || c.is_ascii_digit() && zone.contains(['+', '-']);
    if !zone.chars().all(of_zone) {
        return None;
    }
    let parts: Vec<&str> = text.split(':').collect();
    let (hours, minutes, seconds, fraction) = match parts.as_slice() {
        [h, m, s] => (*h, *m, s.split(['.', ',']).next()?, s.split_once(['.', ',']).map_or("", |p| p.1)),
        [h, m, s, fraction] => (*h, *m, *s, *fraction),
        [m, s] => ("0", *m, s.split(['.', ',']).next()?, s.split_once(['.', ','])?.1),
        _ => return None,
    };
    let (mut hours, minutes, seconds) = (digits(hours, 2)?, digits(minutes, 2)?, digits(seconds, 2)?);
    if let Some(half) = half {
        hours = hours % 12 + half;
    }
    let fraction = fraction.get(..12).filter(|_| fraction.bytes().all(|b| b.is_ascii_digit())).unwrap_or(fraction);
    let fraction = if fraction.is_empty() { 0 } else { digits(fraction, 12)? * 10_i64.pow(12 - fraction.len() as u32) };
    (hours < 24 && minutes < 60 && seconds < 61).then(|| ((hours * 60 + minutes) * 60 + seconds) * PICO + fraction)
}

/// The date in a text, by either order.
fn date_of(text: &str) -> Option<Day> {
    let parts: Vec<&str> = text.split(['-', '/', '.']).collect();
    let [a, b, c] = parts.as_slice() else { return None };
    let of = |year: i64, month: i64, day: i64| {
        ((1..=12).contains(&month) && (1..=31).contains(&day)).then(|| days(year, month, day))
    };
    let one = |day: Option<i64>| Some(Day { day_first: Some(day?), month_first: day });
    if a.len() == 4 {
        return one(of(digits(a, 4)?, month_of(b)?, digits(c, 2)?));
    }
    let year = match c.len() {
        4 => digits(c, 4)?,
        2 if text.contains(['.', '/']) => 2000 + digits(c, 2)?,
        _ => return None,
    };
    let (first, second) = (digits(a, 2)?, month_of(b)?);
    if text.contains('.') || digits(b, 2).is_none() {
        return one(of(year, second, first));
    }
    let day = Day { day_first: of(year, second, first), month_first: of(year, first, second) };
    (day.day_first.is_some() || day.month_first.is_some()).then_some(day)
}

const MONTHS: [&str; 12] = ["jan", "feb", "mar", "apr", "may", "jun", "jul", "aug", "sep", "oct", "nov", "dec"];

fn month_of(text: &str) -> Option<i64> {
    match MONTHS.iter().position(|m| text.eq_ignore_ascii_case(m)) {
        Some(at) => Some(at as i64 + 1),
        None => digits(text, 2),
    }
}

/// A whole number of at most `most` digits.
fn digits(text: &str, most: usize) -> Option<i64> {
    let all = (1..=most).contains(&text.len()) && text.bytes().all(|b| b.is_ascii_digit());
    all.then(|| text.parse().ok()).flatten()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn between(first: &str, last: &str) -> f64 {
        let (first, last) = (parse(first.as_bytes()).unwrap(), parse(last.as_bytes()).unwrap());
        last.after(first)
    }

    fn whole(stamps: &[&str]) -> Result<Vec<f64>, &'static str> {
        let mut dates = Dates::default();
        let all: Vec<Stamp> = stamps.iter().map(|s| parse(s.as_bytes()).unwrap()).collect();
        let mut elapsed = Elapsed::default();
        for s in &all {
            elapsed.seconds(*s, &mut dates);
        }
        dates.settle()?;
        let mut elapsed = Elapsed::default();
        Ok(all.iter().map(|s| elapsed.seconds(*s, &mut dates)).collect())
    }

    #[test]
    fn dates_are_read_in_one_order_decided_by_all_cells() {
        // the 12th passes to the 13th at midnight: the second cell decides for the first
        assert_eq!(whole(&["12/01/2024 23:59:59", "13/01/2024 00:00:01"]), Ok(vec![0.0, 2.0]));
        assert_eq!(whole(&["01/12/2024 23:59:59", "01/13/2024 00:00:01"]), Ok(vec![0.0, 2.0]));
        // no number is above 12: the shorter step decides
        assert_eq!(whole(&["01/02/2024 23:59:59", "02/02/2024 00:00:01"]), Ok(vec![0.0, 2.0]));
        assert_eq!(whole(&["02/01/2024 23:59:59", "02/02/2024 00:00:01"]), Ok(vec![0.0, 2.0]));
        assert_eq!(whole(&["31-01-2024 23:59:59", "01-02-2024 00:00:01"]), Ok(vec![0.0, 2.0]));
        assert!(whole(&["13/01/2024 00:00:00", "01/13/2024 00:00:01"]).is_err());
    }

    #[test]
    fn times_are_seconds_apart() {
        assert_eq!(between("12:00:00.123", "12:00:00.124"), 0.001);
        assert_eq!(between("12:00:00,5", "12:01:00,25"), 59.75);
        assert_eq!(between("12:00:00:005", "12:00:00:010"), 0.005);
        assert_eq!(between("11:59:59 AM", "12:00:01 PM"), 2.0);
        assert_eq!(between("00:01.5", "01:00.0"), 58.5);
        assert_eq!(between("2024-02-28 23:59:59.5", "2024-03-01T00:00:00.5Z"), 86_401.0);
        assert_eq!(between("12:00:00+02:00", "12:00:01 UTC"), 1.0);
        assert_eq!(between("31.12.2023 23:59:59", "01.01.2024 00:00:00"), 1.0);
        assert_eq!(between("12/31/2023 23:59:59", "01/01/2024 00:00:00"), 1.0);
        assert_eq!(between("28-Feb-2023 00:00:00", "01-Mar-2023 00:00:00"), 86_400.0);
        assert_eq!(between("12:00:00.0019531249982946", "12:00:00.0039531249982946"), 0.002);
        assert_eq!(between("23:59:59", "00:00:01"), 2.0, "midnight passed");
    }

    #[test]
    fn what_is_no_time_is_none() {
        for text in ["12:30", "25:00:00", "12:61:00", "a:b:c", "::", "Force: 12:00:00", "2024-05-01 12:00:00 0.25"] {
            assert_eq!(parse(text.as_bytes()), None, "{text}");
        }
        assert!(is_date(b"2024-05-01") && is_date(b"01.05.2024") && !is_date(b"1.5.7") && !is_date(b"2024-13-01"));
    }
}
