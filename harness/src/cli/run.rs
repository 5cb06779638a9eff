//! `touchdown run`.

use anyhow::{Context, Result};
use std::path::PathBuf;
use std::process::ExitCode;
use touchdown::files;
use touchdown::report::{Chart, Page, Style};
use touchdown::scenario::{simulate, Scenario};

#[derive(clap::Args)]
pub struct Arguments {
    /// Scenario file (TOML)
    scenario: PathBuf,
    /// Folder for results.csv, summary.json and report.html
    #[arg(long)]
    out: PathBuf,
}

pub fn run(a: &Arguments) -> Result<ExitCode> {
    let s = Scenario::load(&a.scenario)?;
    let o = simulate(&s).with_context(|| format!("{}", a.scenario.display()))?;
    let mut csv =
        String::from("time [s],penetration [m],velocity [m/s],force [N],stored energy [J],dissipated energy [J]\n");
    for r in &o.rows {
        csv += &format!(
            "{:e},{:e},{:e},{:e},{:e},{:e}\n",
            r.time, r.penetration, r.velocity, r.force, r.stored, r.dissipated
        );
    }
    let column = |f: fn(&touchdown::scenario::Row) -> f64| o.rows.iter().map(f).collect::<Vec<f64>>();
    let (t, x, f) = (column(|r| r.time), column(|r| r.penetration), column(|r| r.force));
    let head = [
        "touch, s",
        "speed, m/s",
        "deepest, m",
        "peak force, N",
        "duration, s",
        "restitution",
        "lost, J",
        "rebound, m",
    ];
    let rows: Vec<Vec<String>> = o
        .bounces
        .iter()
        .map(|b| {
            let figures = [b.touch, b.impact_speed, b.deepest, b.peak_force, b.duration, b.restitution, b.energy_lost];
            let mut r: Vec<String> = figures.iter().map(|v| format!("{v:.6e}")).collect();
            r.push(b.rebound_height.map_or(String::from("-"), |v| format!("{v:.6e}")));
            r
        })
        .collect();
    let title = a.scenario.file_stem().map_or(String::from("run"), |n| n.to_string_lossy().into_owned());
    let html = Page::new(&title)
        .section("Impacts")
        .table(&head, &rows)
        .figure(
            &Chart::new("Force", "time [s]", "force [N]").series("contact", &t, &f, Style::After).svg(),
            "Force against time",
        )
        .figure(
            &Chart::new("Force", "penetration [m]", "force [N]").series("contact", &x, &f, Style::After).svg(),
            "Force against penetration",
        )
        .figure(
            &Chart::new("Energy", "time [s]", "energy [J]")
                .series("stored", &t, &column(|r| r.stored), Style::After)
                .series("dissipated", &t, &column(|r| r.dissipated), Style::Before)
                .svg(),
            "Energy in the contact",
        )
        .html();
    let summary = serde_json::to_string_pretty(&serde_json::json!({"impacts": o.bounces}))? + "\n";
    for (name, text) in [("results.csv", &csv), ("summary.json", &summary), ("report.html", &html)] {
        let path = a.out.join(name);
        files::write(&path, text.as_bytes()).with_context(|| format!("{}: cannot be written", path.display()))?;
    }
    for (i, b) in o.bounces.iter().enumerate() {
        println!(
            "impact {}: {:.6} m/s, deepest {:.6e} m, peak {:.6e} N, restitution {:.6}, lasts {:.6e} s",
            i + 1,
            b.impact_speed,
            b.deepest,
            b.peak_force,
            b.restitution,
            b.duration
        );
    }
    println!("pictures: {}", a.out.join("report.html").display());
    Ok(ExitCode::SUCCESS)
}
