//! `touchdown paper`.

use crate::print::{self, Shown};
use crate::typed::{self, COMMIT};
use anyhow::{anyhow, Result};
use chart::{Chart, Page, Style};
use estimate::paper::{contactor_table, drop, repeat, AGREED, MASS, SPEED};
use report::trace::Made;
use std::path::PathBuf;
use std::process::ExitCode;

const EXAMPLES: &str = "Examples:
  touchdown paper --out paper                            # then open paper/report.html
  touchdown paper --out paper > tables.md                # the tables as markdown";

#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Arguments {
    /// Folder for report.html
    #[arg(long)]
    pub out: PathBuf,
}

/// Cells of a markdown table: head and rows.
fn cells(markdown: &str) -> (Vec<String>, Vec<Vec<String>>) {
    let mut rows: Vec<Vec<String>> = markdown
        .lines()
        .filter(|l| !l.starts_with("|---"))
        .map(|l| l.trim_matches('|').split('|').map(|c| c.trim().to_string()).collect())
        .collect();
    let head = if rows.is_empty() { Vec::new() } else { rows.remove(0) };
    (head, rows)
}

pub fn run(a: &Arguments) -> Result<ExitCode> {
    let r = repeat().ok_or_else(|| anyhow!("the paper's drop cannot be simulated"))?;
    let (estimation, contactor) = (r.table(), contactor_table());
    let last = drop(&r.law(r.minimum.iterations)).ok_or_else(|| anyhow!("the last values cannot be simulated"))?;
    let mut page = Page::new("Ahn and Ryu 2005").sentence(&match r.within {
        Some(i) => format!(
            "From the paper's initial values the simplex is within 1 % of the force curve from iteration {i} on."
        ),
        None => "From the paper's initial values the simplex does not come within 1 % of the force curve.".into(),
    });
    let (h, rows) = cells(&estimation);
    page = page
        .section("Estimation (paper Table 1, figures 7 and 8)")
        .paragraph(&format!(
            "The data are the drop of {MASS} kg at {SPEED} m/s on the paper's estimated values, by its reduced equation 6; the simplex starts at its initial values and moves in ln F at 1.5 mm, p and mu_d/k."
        ))
        .table(&h.iter().map(String::as_str).collect::<Vec<_>>(), &rows);
    let force = Chart::new("", "time [s]", "force [N]")
        .series("data", &r.data.time, &r.data.force, Style::Measured)
        .series("initial", &r.first.time, &r.first.force, Style::Before)
        .series("final", &last.time, &last.force, Style::After);
    let loops = Chart::new("", "penetration [m]", "force [N]")
        .series("data", &r.data.penetration, &r.data.force, Style::Measured)
        .series("initial", &r.first.penetration, &r.first.force, Style::Before)
        .series("final", &last.penetration, &last.force, Style::After);
    let n: Vec<f64> = (0..r.minimum.path.len()).map(|i| i as f64).collect();
    let objective: Vec<f64> = r.minimum.path.iter().map(|p| p.1.log10()).collect();
    let most: Vec<f64> = r.largest.iter().map(|v| v.log10()).collect();
    let fall = Chart::new("", "iteration", "log10 of share of force")
        .series("rms of the difference (objective)", &n, &objective, Style::After)
        .series("largest difference", &n, &most, Style::Before);
    let (h, rows) = cells(&contactor);
    page = page
        .chart(&force, "Paper figure 7: initial and final curve on the data")
        .chart(&loops, "The same against penetration")
        .chart(&fall, &format!("Paper figure 8: objective by iteration; the paper agrees by {AGREED}"))
        .section("Contactor (paper figures 10 to 12)")
        .paragraph("The paper prints the estimated stiffness as 2270 N/m beside a calculated 19300 N/mm. In N/m the bar would sink deeper than it falls; in N/mm peak and duration are those of an impact.")
        .table(&h.iter().map(String::as_str).collect::<Vec<_>>(), &rows)
        .trace(&Made::now(COMMIT, &typed::line())?.rows());
    let path = a.out.join("report.html");
    print::warnings(&crate::place::write(&a.out, "paper", &[("report.html", page.html().as_bytes())])?);
    print::beside(&format!("{estimation}\n{contactor}\npictures: {}\n", path.shown()));
    Ok(ExitCode::SUCCESS)
}
