//! The study as Markdown, CSV and a picture.

use super::coupling::{Study, LADDER};
use anyhow::{anyhow, Result};
use plotters::prelude::*;

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
    ///
    /// # Errors
    /// As the drawing gives them.
    pub fn picture(&self) -> Result<String> {
        let mut out = String::new();
        let fail = |e: String| anyhow!("the picture cannot be drawn: {e}");
        {
            let root = SVGBackend::with_string(&mut out, (900, 640)).into_drawing_area();
            root.fill(&WHITE).map_err(|e| fail(e.to_string()))?;
            let (plot, names) = root.split_vertically(430);
            let mut chart = ChartBuilder::on(&plot)
                .caption("Worst error of restitution over 4 impacts and 8 phases", ("sans-serif", 17))
                .margin(10)
                .x_label_area_size(40)
                .y_label_area_size(70)
                .build_cartesian_2d((8f64..800f64).log_scale(), (1e-9f64..1f64).log_scale())
                .map_err(|e| fail(e.to_string()))?;
            chart
                .configure_mesh()
                .x_desc("macro-steps a contact")
                .y_desc("relative error")
                .y_label_formatter(&|v| format!("{v:.0e}"))
                .x_label_formatter(&|v| format!("{v:.0}"))
                .draw()
                .map_err(|e| fail(e.to_string()))?;
            for (i, r) in self.rows.iter().enumerate() {
                let colour = Palette99::pick(i).to_rgba();
                let points: Vec<(f64, f64)> = r
                    .errors
                    .iter()
                    .zip(&r.fineness)
                    .map(|(e, f)| (if r.adapts { e.steps } else { *f }, e.restitution.clamp(1e-9, 1.0)))
                    .filter(|p| p.0 >= 8.0 && p.0 <= 800.0)
                    .collect();
                let line = colour.stroke_width(if r.adapts { 1 } else { 2 });
                chart.draw_series(LineSeries::new(points.clone(), line)).map_err(|e| fail(e.to_string()))?;
                chart
                    .draw_series(points.iter().map(|p| Circle::new(*p, 3, colour.filled())))
                    .map_err(|e| fail(e.to_string()))?;
                let (x, y) = (20 + 440 * (i as i32 % 2), 12 + 26 * (i as i32 / 2));
                let at = [(x, y + 6), (x + 24, y + 6)];
                names.draw(&PathElement::new(at, colour.stroke_width(2))).map_err(|e| fail(e.to_string()))?;
                let text = Text::new(r.master, (x + 30, y), ("sans-serif", 12).into_font());
                names.draw(&text).map_err(|e| fail(e.to_string()))?;
            }
            root.present().map_err(|e| fail(e.to_string()))?;
        }
        Ok(out)
    }
}
