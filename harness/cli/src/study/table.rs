//! The study as Markdown, CSV and a picture.

use super::coupling::{Study, LADDER};
use chart::{Chart, Style};

/// A share in as few characters as it needs.
fn share(v: f64) -> String {
    if !v.is_finite() || v >= 1.0 {
        return "-".into();
    }
    format!("{v:.0e}")
}

impl Study {
    /// Least macro-steps of plain Gauss-Seidel for a thousandth over those of another master.
    pub fn ratio(&self, master: usize) -> Option<f64> {
        Some(self.rows[0].steps_for_a_thousandth? / self.rows[master].steps_for_a_thousandth?)
    }

    /// The tables as Markdown.
    pub fn markdown(&self) -> String {
        let mut o = String::from("Worst error of restitution, energy of rebound (of the impact's) / peak force:\n\n");
        o += "| master, macro-steps a contact |";
        for n in LADDER {
            o += &format!(" {n} |");
        }
        o += &("\n|---|".to_string() + &"---|".repeat(LADDER.len()) + "\n");
        for r in self.rows.iter().filter(|r| !r.adapts) {
            o += &format!("| {} |", r.master);
            for e in &r.errors {
                o += &format!(" {}, {} / {} |", share(e.restitution), share(e.energy), share(e.peak));
            }
            o.push('\n');
        }
        o += "\nAdaptive masters, by tolerance: mean macro-steps a contact, worst error of restitution:\n\n";
        for r in self.rows.iter().filter(|r| r.adapts) {
            o += "| tolerance |";
            for t in &r.fineness {
                o += &format!(" {t:.0e} |");
            }
            o += &("\n|---|".to_string() + &"---|".repeat(r.fineness.len()) + "\n");
            o += &format!("| {} |", r.master);
            for e in &r.errors {
                o += &format!(" {:.0}, {} |", e.steps, share(e.restitution));
            }
            o += "\n\n";
        }
        o += "| master | steps to 0.1 % | fewer than plain | steps to 1e-6 | set down 0.1 % off its rest, leaves it by |\n|---|---|---|---|---|\n";
        for (i, r) in self.rows.iter().enumerate() {
            let steps = |s: Option<f64>| s.map_or("-".into(), |v| format!("{v:.0}"));
            let ratio = self.ratio(i).map_or("-".into(), |v| format!("{v:.0} x"));
            let rest = if self.rest[i].moves >= 1.0 { "all".into() } else { share(self.rest[i].moves) };
            o += &format!(
                "| {} | {} | {ratio} | {} | {rest} |\n",
                r.master,
                steps(r.steps_for_a_thousandth),
                steps(r.steps_for_a_millionth)
            );
        }
        o
    }

    /// Every figure, a row a master and fineness.
    pub fn csv(&self) -> String {
        let mut o = String::from(
            "master,macro-steps a contact or tolerance,restitution,peak force,energy,dissipated energy reported,\
             steps in contact,calls of fmi2DoStep\n",
        );
        for r in &self.rows {
            for (f, e) in r.fineness.iter().zip(&r.errors) {
                let n = [*f, e.restitution, e.peak, e.energy, e.reported, e.steps, e.calls];
                o += &format!("\"{}\",{}\n", r.master, n.map(|v| format!("{v:e}")).join(","));
            }
        }
        o
    }

    /// Error of restitution against macro-steps a contact, both logarithmic, as SVG.
    pub fn picture(&self) -> String {
        let title = "Worst error of restitution over 4 impacts and 8 phases";
        let mut chart = Chart::new(title, "macro-steps a contact", "relative error").logarithmic().size(884, 470);
        for (i, r) in self.rows.iter().enumerate() {
            let points = r.errors.iter().zip(&r.fineness);
            let (x, y): (Vec<f64>, Vec<f64>) = points
                .map(|(e, f)| (if r.adapts { e.steps } else { *f }, e.restitution.clamp(1e-9, 1.0)))
                .filter(|p| p.0 >= 8.0 && p.0 <= 800.0)
                .unzip();
            chart = chart.series(r.master, &x, &y, Style::Line(i)).marks("", &x, &y, Style::Line(i));
        }
        chart.alone()
    }
}
