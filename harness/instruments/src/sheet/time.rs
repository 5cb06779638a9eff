//! Dates and times of spreadsheets, in days.

use crate::shared::date;

/// A date of ISO 8601, with or without a time of day, in days since the start of 1970; None for other text.
pub(super) fn date(text: &str) -> Option<f64> {
    let (date, time) = text.split_once(['T', ' ']).unwrap_or((text, ""));
    let mut parts =
        date.splitn(3, '-').map(|p| p.bytes().all(|b| b.is_ascii_digit()).then(|| p.parse::<i64>().ok()).flatten());
    let (year, month, day) = (parts.next()??, parts.next()??, parts.next()??);
    let fits = date.len() == 10 && (1..=12).contains(&month) && (1..=31).contains(&day);
    let time = if time.is_empty() { 0.0 } else { clock(time.trim_end_matches('Z'))? };
    fits.then(|| date::days(year, month, day) as f64 + time)
}

/// `10:00:00.25` in days.
fn clock(text: &str) -> Option<f64> {
    let mut parts = text.splitn(3, ':');
    let hours: f64 = parts.next()?.parse().ok()?;
    let minutes: f64 = parts.next()?.parse().ok()?;
    let seconds: f64 = parts.next().map_or(Some(0.0), |s| s.parse().ok())?;
    Some((hours * 3600.0 + minutes * 60.0 + seconds) / 86_400.0).filter(|d| d.is_finite())
}

/// A duration of ISO 8601, such as `PT1H30M0.25S`, in days; None for other text.
pub(super) fn duration(text: &str) -> Option<f64> {
    let (sign, text) = text.strip_prefix('-').map_or((1.0, text), |t| (-1.0, t));
    let (days, mut rest) = text.strip_prefix('P')?.split_once('T')?;
    let mut seconds = days.strip_suffix('D').map_or(Some(0.0), |d| d.parse::<f64>().ok())? * 86_400.0;
    for (mark, unit) in [('H', 3600.0), ('M', 60.0), ('S', 1.0)] {
        if let Some((number, after)) = rest.split_once(mark) {
            seconds += number.replace(',', ".").parse::<f64>().ok()? * unit;
            rest = after;
        }
    }
    (rest.is_empty() && seconds.is_finite()).then_some(sign * seconds / 86_400.0)
}

/// Days since the start of 1970 as ISO 8601.
pub(super) fn iso(days: f64) -> String {
    date::iso(days.floor() as i64, (days - days.floor()) * 86_400.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dates_and_durations_are_read() {
        assert_eq!(date("1970-01-02"), Some(1.0));
        assert_eq!(date("1970-01-01T12:00:00"), Some(0.5));
        assert_eq!(date("1970-01-01 06:00"), Some(0.25));
        assert_eq!((date("12:30"), date("1970-13-01"), date("a-b-c"), date("1-2-3")), (None, None, None, None));
        assert_eq!(duration("PT06H00M00S"), Some(0.25));
        assert_eq!(duration("-PT0H1M26,4S"), Some(-1e-3));
        assert_eq!((duration("P1DT12H"), duration("PT5"), duration("x")), (Some(1.5), None, None));
        assert_eq!(iso(19_794.5), "2024-03-12T12:00:00");
    }
}
