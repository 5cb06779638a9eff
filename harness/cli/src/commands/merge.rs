//! `touchdown merge`.

use super::form::Form;
use crate::print::{self, Shown};
use crate::progress::UNJUDGED_CODE;
use crate::tasks::merge::{merge, Summary};
use anyhow::Result;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

const EXAMPLES: &str = "Examples:
  touchdown merge answers                                # then open answers/index.html
  touchdown merge node1/answers node2/answers --out fleet";

#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Arguments {
    /// Folders that diagnose has had as --out
    #[arg(required = true)]
    answers: Vec<PathBuf>,
    /// Folder that fleet.parquet, fleet.json and index.html go to (default: the first folder of answers)
    #[arg(long)]
    out: Option<PathBuf>,
    #[command(flatten)]
    form: Form,
}

impl Arguments {
    /// Where it writes.
    pub fn out(&self) -> &Path {
        self.out.as_deref().unwrap_or_else(|| self.answers.first().map_or(Path::new("."), PathBuf::as_path))
    }
}

pub fn run(a: &Arguments) -> Result<ExitCode> {
    let m = merge(&a.answers, a.out())?;
    print::warnings(&m.notes);
    let words = |s: &Summary| {
        let mut text = print::with_lead(&m.sentence) + "\n";
        for (kind, all) in [("lost", &s.lost), ("cannot be judged", &s.not_judged)] {
            all.iter().for_each(|w| {
                text += &format!("{kind}: {}: {}\n", print::spelled_out(&w.campaign), print::spelled_out(&w.why))
            });
        }
        for g in s.growth.discoveries() {
            let way = match g.correlation {
                Some(c) => format!("rank correlation {c:.2} with {}", g.column),
                None => format!("differs by {}, least in {}, most in {}", g.column, g.from.of, g.to.of),
            };
            text += &format!(
                "{} of {}: {way} (q {:.1e}, {} campaigns)\n",
                figure(&g.figure),
                g.mechanism,
                g.q,
                g.campaigns
            );
        }
        text + &format!("page: {}\ntable: {}\n", m.page.shown(), m.table.shown())
    };
    print::beside(&a.form.of(&m.summary, words)?);
    Ok(match (m.summary.lost.is_empty(), m.summary.not_judged.is_empty()) {
        (false, _) => ExitCode::from(2),
        (_, false) => ExitCode::from(UNJUDGED_CODE),
        _ => ExitCode::SUCCESS,
    })
}

fn figure(f: &fleet::growth::Figure) -> String {
    use fleet::growth::Figure;
    match f {
        Figure::Probability => "probability".into(),
        Figure::Size => "size".into(),
        Figure::Parameter(name) => name.clone(),
    }
}
