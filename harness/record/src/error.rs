//! What is wrong with a campaign.

use std::path::Path;

/// One fault of a campaign: where, what, and the cure.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{file}{}: {what}; {cure}", if *.line > 0 { format!(":{}", .line) } else { String::new() })]
pub struct RecordError {
    /// Path of the file.
    pub file: String,
    /// Counted from 1; 0 where no line is to blame.
    pub line: usize,
    pub what: String,
    pub cure: String,
}

impl RecordError {
    pub(crate) fn new(file: &Path, line: usize, what: impl Into<String>, cure: impl Into<String>) -> RecordError {
        RecordError { file: file.display().to_string(), line, what: what.into(), cure: cure.into() }
    }
}

/// Everything wrong with a campaign, a line each: campaign.toml first, then its files in the order listed.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{}", .0.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n"))]
pub struct RecordErrors(pub Vec<RecordError>);
