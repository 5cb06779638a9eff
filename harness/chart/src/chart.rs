//! Line charts as SVG.

use plotters::prelude::*;

/// How a series is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Style {
    /// Measured: a broad grey line.
    Measured,
    /// Before: a red line.
    Before,
    /// After: a blue line.
    After,
    /// One of many: a line in the n-th of eight colours, from 0 on, over again beyond.
    Line(usize),
    /// What no recording shows, worked out: a green line.
    Inferred,
}

/// Colours of [`Style::Line`]: told apart without red and green (after Okabe and Ito 2008).
const COLOURS: [RGBColor; 8] = [
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(86, 180, 233),
    RGBColor(230, 159, 0),
    RGBColor(0, 0, 0),
    RGBColor(130, 110, 60),
];

struct Series {
    name: String,
    points: Vec<(f64, f64)>,
    style: Style,
}

/// A chart of several series over one axis.
pub struct Chart {
    title: String,
    x: String,
    y: String,
    series: Vec<Series>,
    bands: Vec<Vec<(f64, f64)>>,
    size: (u32, u32),
    names: bool,
}

/// Most points of a series that are drawn; longer series are thinned by bucket, extremes kept.
const MOST_POINTS: usize = 600;

impl Chart {
    /// An empty chart; axes carry their units.
    pub fn new(title: &str, x: &str, y: &str) -> Chart {
        Chart {
            title: title.into(),
            x: x.into(),
            y: y.into(),
            series: Vec::new(),
            bands: Vec::new(),
            size: (620, 330),
            names: true,
        }
    }

    /// Width and height in pixels (620 by 330 unless given).
    pub fn size(mut self, width: u32, height: u32) -> Chart {
        self.size = (width.max(120), height.max(80));
        self
    }

    /// Leaves the names of the series out, where a chart beside it has them.
    pub fn without_names(mut self) -> Chart {
        self.names = false;
        self
    }

    /// A shaded band between two curves; points that are not finite are left out.
    pub fn band(mut self, x: &[f64], low: &[f64], high: &[f64]) -> Chart {
        let edge = |y: &[f64]| {
            let all: Vec<(f64, f64)> =
                x.iter().cloned().zip(y.iter().cloned()).filter(|p| p.0.is_finite() && p.1.is_finite()).collect();
            let step = all.len().div_ceil(MOST_POINTS / 2).max(1);
            all.into_iter().step_by(step).collect::<Vec<_>>()
        };
        let mut outline = edge(low);
        outline.extend(edge(high).into_iter().rev());
        if outline.len() > 3 {
            self.bands.push(outline);
        }
        self
    }

    /// Adds a series; points that are not finite are left out.
    pub fn series(mut self, name: &str, x: &[f64], y: &[f64], style: Style) -> Chart {
        let points: Vec<(f64, f64)> =
            x.iter().cloned().zip(y.iter().cloned()).filter(|p| p.0.is_finite() && p.1.is_finite()).collect();
        self.series.push(Series { name: name.into(), points: thin(points), style });
        self
    }

    /// The chart as SVG text; an empty string where there is nothing to draw.
    pub fn svg(&self) -> String {
        let all: Vec<&(f64, f64)> =
            self.series.iter().flat_map(|s| &s.points).chain(self.bands.iter().flatten()).collect();
        let Some(first) = all.first() else { return String::new() };
        let (mut x0, mut x1, mut y0, mut y1) = (first.0, first.0, first.1, first.1);
        for p in &all {
            x0 = x0.min(p.0);
            x1 = x1.max(p.0);
            y0 = y0.min(p.1);
            y1 = y1.max(p.1);
        }
        if x1 <= x0 {
            x1 = x0 + 1.0;
        }
        let pad = if y1 > y0 { 0.06 * (y1 - y0) } else { 1.0 };
        let mut out = String::new();
        let drawn = self.draw(&mut out, (x0, x1), (y0 - pad, y1 + pad));
        if drawn.is_ok() {
            out
        } else {
            String::new()
        }
    }

    /// The place of the legend that covers the fewest points.
    fn emptiest(&self, x: (f64, f64), y: (f64, f64)) -> SeriesLabelPosition {
        use SeriesLabelPosition::{LowerLeft, LowerRight, MiddleRight, UpperLeft, UpperRight};
        // share of the width and height it takes, more or less
        let (wide, high) = (0.4, (0.05 + 0.06 * self.series.len() as f64).min(0.9));
        let places = [
            (MiddleRight, 1.0 - wide, 0.5 - high / 2.0),
            (UpperRight, 1.0 - wide, 1.0 - high),
            (UpperLeft, 0.0, 1.0 - high),
            (LowerRight, 1.0 - wide, 0.0),
            (LowerLeft, 0.0, 0.0),
        ];
        let covered = |left: f64, low: f64| {
            let points = self.series.iter().flat_map(|s| &s.points);
            let shares = points.map(|p| ((p.0 - x.0) / (x.1 - x.0), (p.1 - y.0) / (y.1 - y.0)));
            shares.filter(|p| (left..=left + wide).contains(&p.0) && (low..=low + high).contains(&p.1)).count()
        };
        places.into_iter().min_by_key(|p| covered(p.1, p.2)).map_or(MiddleRight, |p| p.0)
    }

    fn draw(
        &self,
        out: &mut String,
        x: (f64, f64),
        y: (f64, f64),
    ) -> Result<(), Box<dyn std::error::Error + Send + Sync>> {
        let fail = |e: String| -> Box<dyn std::error::Error + Send + Sync> { e.into() };
        let root = SVGBackend::with_string(out, self.size).into_drawing_area();
        root.fill(&WHITE).map_err(|e| fail(e.to_string()))?;
        let mut chart = ChartBuilder::on(&root)
            .caption(&self.title, ("sans-serif", 14))
            .margin(6)
            .x_label_area_size(34)
            .y_label_area_size(58)
            .build_cartesian_2d(x.0..x.1, y.0..y.1)
            .map_err(|e| fail(e.to_string()))?;
        chart
            .configure_mesh()
            .x_desc(&self.x)
            .y_desc(&self.y)
            .light_line_style(WHITE.mix(0.0))
            .x_labels(5)
            .y_labels(5)
            .label_style(("sans-serif", 11))
            .x_label_formatter(&|v| short(*v, x.1 - x.0))
            .y_label_formatter(&|v| short(*v, y.1 - y.0))
            .draw()
            .map_err(|e| fail(e.to_string()))?;
        for b in &self.bands {
            let fill = RGBColor(40, 140, 90).mix(0.2);
            chart.draw_series(std::iter::once(Polygon::new(b.clone(), fill))).map_err(|e| fail(e.to_string()))?;
        }
        for s in &self.series {
            let (colour, width) = match s.style {
                Style::Measured => (RGBColor(165, 165, 165), 3),
                Style::Before => (RGBColor(200, 40, 40), 1),
                Style::After => (RGBColor(30, 80, 200), 1),
                Style::Inferred => (RGBColor(30, 130, 80), 1),
                Style::Line(n) => (COLOURS[n % COLOURS.len()], 1),
            };
            chart
                .draw_series(LineSeries::new(s.points.iter().cloned(), colour.stroke_width(width)))
                .map_err(|e| fail(e.to_string()))?
                .label(&s.name)
                .legend(move |(x, y)| PathElement::new(vec![(x, y), (x + 14, y)], colour.stroke_width(width)));
        }
        if self.names {
            chart
                .configure_series_labels()
                .label_font(("sans-serif", 11))
                .position(self.emptiest(x, y))
                .background_style(WHITE.mix(0.8))
                .border_style(BLACK.mix(0.2))
                .draw()
                .map_err(|e| fail(e.to_string()))?;
        }
        root.present().map_err(|e| fail(e.to_string()))?;
        Ok(())
    }
}

/// A number short enough for an axis that spans `span`.
fn short(v: f64, span: f64) -> String {
    let a = v.abs();
    if a < 1e-9 * span {
        "0".into()
    } else if a != 0.0 && !(1e-2..1e5).contains(&a) {
        format!("{v:.1e}")
    } else if a >= 100.0 {
        format!("{v:.0}")
    } else {
        format!("{v:.3}").trim_end_matches('0').trim_end_matches('.').to_string()
    }
}

fn thin(points: Vec<(f64, f64)>) -> Vec<(f64, f64)> {
    if points.len() <= MOST_POINTS {
        return points;
    }
    let size = (2 * points.len()).div_ceil(MOST_POINTS);
    let mut out = Vec::with_capacity(MOST_POINTS);
    for b in points.chunks(size) {
        let lo = b.iter().enumerate().min_by(|a, c| a.1 .1.total_cmp(&c.1 .1)).map_or(0, |p| p.0);
        let hi = b.iter().enumerate().max_by(|a, c| a.1 .1.total_cmp(&c.1 .1)).map_or(0, |p| p.0);
        out.push(b[lo.min(hi)]);
        if lo != hi {
            out.push(b[lo.max(hi)]);
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_chart_holds_its_names_and_survives_what_is_not_finite() {
        let x: Vec<f64> = (0..5000).map(f64::from).collect();
        let mut y: Vec<f64> = x.iter().map(|v| (v * 0.01).sin()).collect();
        y[7] = f64::NAN;
        let svg = Chart::new("force", "time [s]", "force [N]").series("measured", &x, &y, Style::Measured).svg();
        assert!(svg.contains("<svg") && svg.contains("measured") && svg.len() < 200_000);
        assert_eq!(Chart::new("", "", "").svg(), "");
        assert!(thin(x.into_iter().zip(y).collect()).len() <= MOST_POINTS);
    }
}
