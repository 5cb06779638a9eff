//! What became of the campaigns of one call.

use crate::print::{self, Shown};
use crate::progress::{interrupted_code, UNJUDGED_CODE};
use serde::Serialize;
use std::path::Path;
use std::process::ExitCode;

/// Campaigns by what became of them, by folder.
#[derive(Debug, Default, Serialize)]
pub struct Batch {
    pub finished: Vec<String>,
    /// Those with an answer from before that still holds.
    pub up_to_date: Vec<String>,
    /// Those whose answer says why they cannot be judged.
    pub unjudged: Vec<String>,
    /// Those whose other replicates are not there yet.
    pub waiting: Vec<String>,
    /// Those that are bad input, or whose answer cannot be written; reported as errors.
    pub failed: Vec<String>,
    /// Those that were under way when the user ended the command.
    pub left: Vec<String>,
    /// Those that had not begun then.
    pub not_begun: Vec<String>,
    /// Whether the page of all answers, or the fleet's register, could not be written; reported as an error.
    #[serde(skip)]
    pub unlisted: bool,
}

impl Batch {
    /// Puts every list in order: processes come to their ends in any.
    pub fn sort(&mut self) {
        let lists = [&mut self.finished, &mut self.up_to_date, &mut self.unjudged, &mut self.waiting];
        lists.into_iter().chain([&mut self.failed, &mut self.left, &mut self.not_begun]).for_each(|l| l.sort());
    }

    /// Which campaigns came to what, a line each; nothing of a single one.
    pub fn summary(&self) -> String {
        let kinds = [
            ("finished", &self.finished),
            ("up to date", &self.up_to_date),
            ("cannot be judged", &self.unjudged),
            ("waiting for other replicates", &self.waiting),
            ("failed", &self.failed),
            ("not finished", &self.left),
            ("not begun", &self.not_begun),
        ];
        if kinds.iter().map(|(_, all)| all.len()).sum::<usize>() < 2
            && self.up_to_date.is_empty()
            && self.waiting.is_empty()
        {
            return String::new();
        }
        let line = |(kind, all): &(&str, &Vec<String>)| {
            format!("{kind}: {} ({})\n", all.len(), print::spelled_out(&all.join(", ")))
        };
        kinds.iter().filter(|(_, all)| !all.is_empty()).map(line).collect()
    }

    /// What a command that was ended leaves in `out`.
    pub fn unfinished(&self, out: &Path) -> String {
        let mut text = match &self.left[..] {
            [] => String::from("interrupted"),
            [one] => format!("interrupted: {one} is not finished, nothing of it is written"),
            several => format!("interrupted: {} are not finished, nothing of them is written", several.join(", ")),
        };
        if !self.not_begun.is_empty() {
            text += &format!("\nnot begun: {}", self.not_begun.join(", "));
        }
        match self.finished.len() + self.up_to_date.len() + self.unjudged.len() {
            0 => {}
            1 => text += &format!("\nfinished and whole in {}: 1 campaign", out.shown()),
            n => text += &format!("\nfinished and whole in {}: {n} campaigns", out.shown()),
        }
        text + "\nto do the rest: the same command with --resume, which a --shard has by itself"
    }

    /// Whether the user ended the command before all was done.
    pub fn is_interrupted(&self) -> bool {
        !self.left.is_empty() || !self.not_begun.is_empty()
    }

    /// The exit code: that of the signal, of what failed, of what cannot be judged, or 0.
    pub fn exit_code(&self) -> ExitCode {
        match self {
            b if b.is_interrupted() => interrupted_code(),
            b if !b.failed.is_empty() || b.unlisted => ExitCode::from(2),
            b if !b.unjudged.is_empty() => ExitCode::from(UNJUDGED_CODE),
            _ => ExitCode::SUCCESS,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(names: &[&str]) -> Vec<String> {
        names.iter().map(ToString::to_string).collect()
    }

    #[test]
    fn a_batch_says_what_came_of_every_campaign() {
        let b = Batch { finished: of(&["a", "b"]), failed: of(&["c"]), ..Batch::default() };
        assert_eq!(b.summary(), "finished: 2 (a, b)\nfailed: 1 (c)\n");
        assert_eq!(format!("{:?}", b.exit_code()), format!("{:?}", ExitCode::from(2)));
    }

    #[test]
    fn of_a_single_campaign_its_answer_is_enough() {
        let b = Batch { unlisted: true, ..Batch::default() };
        assert_eq!(format!("{:?}", b.exit_code()), format!("{:?}", ExitCode::from(2)));
        let b = Batch { unjudged: of(&["a"]), ..Batch::default() };
        assert_eq!(b.summary(), "");
        assert_eq!(format!("{:?}", b.exit_code()), format!("{:?}", ExitCode::from(3)));
    }
}
