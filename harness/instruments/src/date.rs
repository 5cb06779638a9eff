//! Dates from seconds.

/// The date and time at `seconds` and a `part` of a second after 1970-01-01, in UTC: `2024-05-01T12:00:00.250Z`.
pub(crate) fn utc(seconds: i64, part: f64) -> String {
    let (days, of_day) = (seconds.div_euclid(86_400), seconds.rem_euclid(86_400));
    let (year, month, day) = civil(days);
    let (hour, minute, second) = (of_day / 3600, of_day / 60 % 60, of_day % 60);
    let millis = ((part * 1000.0) as i64).clamp(0, 999);
    format!("{year:04}-{month:02}-{day:02}T{hour:02}:{minute:02}:{second:02}.{millis:03}Z")
}

/// Year, month and day of the Gregorian calendar, `days` after 1970-01-01.
fn civil(days: i64) -> (i64, i64, i64) {
    // days from 1 March of the year 0, in eras of 400 years; a year that begins in March ends with its leap day
    let days = i128::from(days) + 719_468;
    let (era, of_era) = (days.div_euclid(146_097), days.rem_euclid(146_097));
    let year_of_era = (of_era - of_era / 1460 + of_era / 36_524 - of_era / 146_096) / 365;
    let of_year = of_era - (365 * year_of_era + year_of_era / 4 - year_of_era / 100);
    let from_march = (5 * of_year + 2) / 153;
    let day = of_year - (153 * from_march + 2) / 5 + 1;
    let month = if from_march < 10 { from_march + 3 } else { from_march - 9 };
    let year = year_of_era + era * 400 + i128::from(month <= 2);
    (year as i64, month as i64, day as i64)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dates_of_leap_years_and_before_1970() {
        assert_eq!(utc(0, 0.0), "1970-01-01T00:00:00.000Z");
        assert_eq!(utc(951_782_400, 0.5), "2000-02-29T00:00:00.500Z");
        assert_eq!(utc(-2_082_844_800, 0.0), "1904-01-01T00:00:00.000Z");
        assert_eq!(utc(1_709_251_199, 0.999), "2024-02-29T23:59:59.999Z");
    }
}
