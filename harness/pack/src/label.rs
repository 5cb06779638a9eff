//! What distinguishes one FMU from another: the campaign that it comes from, and when it was made.

use anyhow::{Context, Result};
use chart::Page;
use chrono::{DateTime, SecondsFormat};

/// How an FMU describes itself beside what every one of its model says. The default says nothing more.
#[derive(Clone, Default)]
pub struct Label {
    /// What the model is called, in words; becomes a part of the model's name.
    pub name: Option<String>,
    /// What it is, in a sentence or two.
    pub description: Option<String>,
    /// When what is in it was made, s since 1970-01-01; SOURCE_DATE_EPOCH stands above it.
    pub made: Option<i64>,
    /// Typical sizes of variables by name, in the variables' units.
    pub nominals: Vec<(&'static str, f64)>,
    /// What its documentation says first.
    pub page: Option<Page>,
    /// Speeds at touch that its loop is drawn for, m/s; empty: some.
    pub speeds: Vec<f64>,
}

/// The time that the environment variable SOURCE_DATE_EPOCH sets, s since 1970-01-01 (reproducible-builds.org); None where it is
/// not set.
///
/// # Errors
/// SOURCE_DATE_EPOCH is no time.
pub fn source_date() -> Result<Option<i64>> {
    let Some(set) = std::env::var_os("SOURCE_DATE_EPOCH") else { return Ok(None) };
    let seconds = set.to_str().and_then(|s| s.parse().ok()).filter(|s| DateTime::from_timestamp(*s, 0).is_some());
    let wrong = || format!("SOURCE_DATE_EPOCH is {set:?}: give seconds since 1970-01-01, or unset it");
    Ok(Some(seconds.with_context(wrong)?))
}

impl Label {
    /// The label with the time that the environment variable SOURCE_DATE_EPOCH sets, where it does
    /// (reproducible-builds.org): a clock never gets in.
    ///
    /// # Errors
    /// SOURCE_DATE_EPOCH is no time.
    pub(super) fn dated(mut self) -> Result<Label> {
        self.made = source_date()?.or(self.made);
        Ok(self)
    }

    /// The model's name in this FMU: a valid identifier, as hosts make variables and files of it.
    pub(super) fn model_name(&self, model: &str) -> String {
        let Some(name) = &self.name else { return model.into() };
        let plain: String = name.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '_' }).collect();
        format!("{model}_{plain}")
    }

    /// The attributes of the description's root.
    pub(super) fn attributes(&self, model: &str, guid: &str) -> Vec<(&'static str, String)> {
        let version = env!("CARGO_PKG_VERSION");
        let mut all = vec![
            ("modelName", self.model_name(model)),
            ("guid", guid.to_string()),
            ("version", version.into()),
            ("generationTool", format!("touchdown {version}")),
        ];
        all.extend(self.description.clone().map(|d| ("description", d)));
        let made = self.made.and_then(|s| DateTime::from_timestamp(s, 0));
        all.extend(made.map(|t| ("generationDateAndTime", t.to_rfc3339_opts(SecondsFormat::Secs, true))));
        all
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_becomes_an_identifier_and_a_time_a_date_in_utc() {
        let label = Label { name: Some("bench drop, 3\u{b5}m".into()), made: Some(1_600_000_000), ..Label::default() };
        assert_eq!(label.model_name("X"), "X_bench_drop__3_m");
        let all = label.attributes("X", "{g}");
        let of = |name: &str| all.iter().find(|a| a.0 == name).map(|a| a.1.as_str());
        assert_eq!(of("generationDateAndTime"), Some("2020-09-13T12:26:40Z"));
        assert_eq!((of("guid"), of("description")), (Some("{g}"), None));
        assert_eq!(Label::default().attributes("X", "{g}")[0].1, "X");
    }
}
