//! What is wrong with a campaign.

use crate::words::beginning;
use std::path::Path;

/// Bytes from which of what is wrong only the beginning is said: it repeats what somebody's file holds.
const LONGEST: usize = 2000;

/// The page of the documentation that describes campaigns, from the project's root.
pub const PAGE: &str = "docs/src/formats/recordings.md";

/// A section of the page of the documentation that describes campaigns.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Section {
    FormatKey,
    Campaign,
    Rig,
    Simulation,
    SystemsOfFmus,
    Recording,
    SpeedsAndHeights,
    CsvHeader,
    Units,
    Time,
    NumberOfSamples,
    MissingValues,
    NoImpact,
    WhatContradicts,
}

impl Section {
    pub const ALL: [Section; 14] = [
        Section::FormatKey,
        Section::Campaign,
        Section::Rig,
        Section::Simulation,
        Section::SystemsOfFmus,
        Section::Recording,
        Section::SpeedsAndHeights,
        Section::CsvHeader,
        Section::Units,
        Section::Time,
        Section::NumberOfSamples,
        Section::MissingValues,
        Section::NoImpact,
        Section::WhatContradicts,
    ];

    /// The section that describes a table of campaign.toml.
    pub(crate) fn of_table(name: &str) -> Section {
        match name {
            "campaign" => Section::Campaign,
            "rig" => Section::Rig,
            "simulation" => Section::Simulation,
            "simulation.free" | "simulation.bond" | "simulation.channels" => Section::SystemsOfFmus,
            "recording" => Section::Recording,
            _ => Section::FormatKey,
        }
    }

    /// Its heading.
    pub fn heading(self) -> &'static str {
        match self {
            Section::FormatKey => "Format key",
            Section::Campaign => "Campaign",
            Section::Rig => "Rig",
            Section::Simulation => "Simulation",
            Section::SystemsOfFmus => "Systems of FMUs",
            Section::Recording => "Recording",
            Section::SpeedsAndHeights => "Speeds and heights",
            Section::CsvHeader => "CSV header",
            Section::Units => "Units",
            Section::Time => "Time",
            Section::NumberOfSamples => "Number of samples",
            Section::MissingValues => "Missing values",
            Section::NoImpact => "No impact",
            Section::WhatContradicts => "What contradicts",
        }
    }

    /// A link to it, from the project's root.
    pub fn link(self) -> String {
        format!("{PAGE}#{}", self.heading().to_lowercase().replace(' ', "-"))
    }
}

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
    /// Where the documentation says what is right.
    pub section: Section,
}

impl RecordError {
    pub(crate) fn new(
        section: Section,
        file: &Path,
        line: usize,
        what: impl Into<String>,
        cure: impl Into<String>,
    ) -> RecordError {
        let (what, cure) = (what.into(), cure.into());
        let short = |text: String| if text.len() > LONGEST { beginning(&text).into_owned() } else { text };
        RecordError { file: file.display().to_string(), line, what: short(what), cure: short(cure), section }
    }
}

/// Everything wrong with a campaign, a line each: campaign.toml first, then its files in the order listed.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{}", .0.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n"))]
pub struct RecordErrors(pub Vec<RecordError>);

/// Faults of a campaign that are each told, at most.
pub(crate) const TOLD: usize = 1000;

impl RecordErrors {
    /// The first of `errors`, and how many more there are in the campaign file `path`; where the last of them says that already, all.
    pub(crate) fn first(mut errors: Vec<RecordError>, path: &Path) -> RecordErrors {
        if errors.len() <= TOLD + 1 {
            return RecordErrors(errors);
        }
        let more = errors.len() - TOLD;
        errors.truncate(TOLD);
        errors.push(RecordError::untold(more, path));
        RecordErrors(errors)
    }
}

impl RecordError {
    /// That there are `more` faults than are told.
    pub(crate) fn untold(more: usize, path: &Path) -> RecordError {
        let what = format!("{more} faults more are not told");
        RecordError::new(Section::FormatKey, path, 0, what, "correct those that are, and see what is left")
    }
}
