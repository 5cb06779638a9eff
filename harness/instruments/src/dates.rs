//! Dates in the form of ISO 8601.

/// Days that are written as a date: the years that have four digits, and some more.
const DATES: i64 = 4_000_000;

/// Days since the start of 1970 and seconds of the day as `2024-03-12T10:00:00.250`; whole seconds without the
/// fraction. A day some ten thousand years away, as damaged files tell, is given by its number.
pub(crate) fn iso(days: i64, seconds: f64) -> String {
    if !(-DATES..DATES).contains(&days) || seconds.abs() > 1e6 {
        return format!("day {days} since 1970-01-01");
    }
    let milliseconds = (seconds * 1e3).round() as i64;
    let (days, milliseconds) = (days + milliseconds.div_euclid(86_400_000), milliseconds.rem_euclid(86_400_000));
    let (year, month, day) = civil(days);
    let (seconds, fraction) = (milliseconds / 1000, milliseconds % 1000);
    let time = format!("{:02}:{:02}:{:02}", seconds / 3600, seconds / 60 % 60, seconds % 60);
    let fraction = if fraction == 0 { String::new() } else { format!(".{fraction:03}") };
    format!("{year:04}-{month:02}-{day:02}T{time}{fraction}")
}

/// Days of the Gregorian calendar since 1970-01-01 of the date; for any year of four digits.
pub(crate) fn days(year: i64, month: i64, day: i64) -> i64 {
    // years begin in March, so that the leap day is their last
    let year = if month <= 2 { year - 1 } else { year };
    let month = (month + 9) % 12;
    365 * year + year.div_euclid(4) - year.div_euclid(100) + year.div_euclid(400) + (153 * month + 2) / 5 + day
        - 1
        - 719_468
}

/// Year, month and day of a day counted from 1970-01-01.
fn civil(of: i64) -> (i64, i64, i64) {
    let mut year = 1970 + (of as f64 / 365.2425).floor() as i64;
    while days(year + 1, 1, 1) <= of {
        year += 1;
    }
    while days(year, 1, 1) > of {
        year -= 1;
    }
    let month = (1..=12).rev().find(|&m| days(year, m, 1) <= of).unwrap_or(1);
    (year, month, of - days(year, month, 1) + 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dates_and_days_agree() {
        assert_eq!(days(1970, 1, 1), 0);
        assert_eq!(days(2000, 2, 29), 11_016);
        assert_eq!(days(1899, 12, 30), -25_569);
        for of in (-800_000..800_000).step_by(97) {
            let (y, m, d) = civil(of);
            assert_eq!(days(y, m, d), of);
        }
        assert_eq!(iso(19_794, 36_000.25), "2024-03-12T10:00:00.250");
        assert_eq!(iso(i64::MAX, 0.0), "day 9223372036854775807 since 1970-01-01");
        assert_eq!(iso(0, -1.0), "1969-12-31T23:59:59");
        assert_eq!(iso(0, 86_399.999_9), "1970-01-02T00:00:00");
    }
}
