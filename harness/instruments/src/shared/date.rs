//! Days of the calendar, and dates in the form of ISO 8601.

/// Days around 1970-01-01 that are written as a date: the years that have four digits, and some more.
const DATES: i64 = 4_000_000;
/// Days from 1 March of the year 0 to 1970-01-01.
const FROM_MARCH: i64 = 719_468;
/// Days of 400 years.
const ERA: i64 = 146_097;

/// Days since the start of 1970 and seconds of the day as `2024-03-12T10:00:00.250`; whole seconds without the
/// fraction. A day some ten thousand years away, as damaged files have, is given by its number.
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

/// The date and time at `seconds` and a `part` of a second after the start of 1970, in UTC: `2024-05-01T12:00:00.250Z`.
pub(crate) fn utc(seconds: i64, part: f64) -> String {
    let date = iso(seconds.div_euclid(86_400), seconds.rem_euclid(86_400) as f64 + part);
    if date.contains('T') {
        date + "Z"
    } else {
        date
    }
}

/// Days of the Gregorian calendar from 1970-01-01 to the date; for any year of four digits.
pub(crate) fn days(year: i64, month: i64, day: i64) -> i64 {
    // years begin in March, so that the leap day is their last
    let (year, month) = if month > 2 { (year, month - 3) } else { (year - 1, month + 9) };
    let leap_days = year.div_euclid(4) - year.div_euclid(100) + year.div_euclid(400);
    365 * year + leap_days + (153 * month + 2) / 5 + day - 1 - FROM_MARCH
}

/// Year, month and day of the Gregorian calendar, `days` after 1970-01-01.
fn civil(days: i64) -> (i64, i64, i64) {
    let days = days + FROM_MARCH;
    let (era, of_era) = (days.div_euclid(ERA), days.rem_euclid(ERA));
    let year_of_era = (of_era - of_era / 1460 + of_era / 36_524 - of_era / (ERA - 1)) / 365;
    let of_year = of_era - (365 * year_of_era + year_of_era / 4 - year_of_era / 100);
    let month = (5 * of_year + 2) / 153;
    let day = of_year - (153 * month + 2) / 5 + 1;
    let (year, month) = if month < 10 { (year_of_era, month + 3) } else { (year_of_era + 1, month - 9) };
    (year + era * 400, month, day)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dates_and_days_agree() {
        assert_eq!([days(1970, 1, 1), days(2000, 2, 29), days(1899, 12, 30)], [0, 11_016, -25_569]);
        for of in (-800_000..800_000).step_by(97) {
            let (y, m, d) = civil(of);
            assert_eq!(days(y, m, d), of);
        }
    }

    #[test]
    fn dates_are_written_with_what_they_hold_of_a_second() {
        assert_eq!(iso(19_794, 36_000.25), "2024-03-12T10:00:00.250");
        assert_eq!(iso(0, -1.0), "1969-12-31T23:59:59");
        assert_eq!(iso(0, 86_399.999_9), "1970-01-02T00:00:00");
        assert_eq!(iso(i64::MAX, 0.0), "day 9223372036854775807 since 1970-01-01");
        assert_eq!(utc(951_782_400, 0.5), "2000-02-29T00:00:00.500Z");
        assert_eq!(utc(-2_082_844_800, 0.0), "1904-01-01T00:00:00Z");
        assert_eq!(utc(i64::MIN, 0.0), "day -106751991167301 since 1970-01-01");
    }
}
