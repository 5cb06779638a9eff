//! Line charts as SVG with places finer than a pixel, in colours that the page gives.
//!
//! Written here and not by a drawing crate: plotters rounds to whole pixels and writes colours into its shapes, where a page
//! wants sub-pixel places, classes for light, dark and paper, and text for a screen reader.

use super::axis::{shared, unit_of, Axis, Scale, LARGEST};
use super::line::{drawn, Stretch};
use super::page::{escape, safe_text};
use super::points::{encoded, Column};

/// How a series is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Style {
    /// Measured: a broad grey line.
    Measured,
    /// The simulation as its user gave it.
    Given,
    /// Before: the simulation recalibrated, or where a fit starts.
    Before,
    /// After: with the physics found, or where a fit ends.
    After,
    /// One of many: a line in the n-th of eight colours, from 0 on, over again beyond, dashed.
    Line(usize),
    /// What no recording shows, worked out.
    Inferred,
}

/// Colours and strokes, of charts in a page and alone.
pub(crate) const STYLE: &str = include_str!("chart.css");
/// Height of a row of names below a chart that stands alone, px, and how many stand beside each other.
const NAME: f64 = 20.0;
const BESIDE: usize = 2;
/// Begins the attribute with a chart's points.
pub(crate) const POINTS: &str = "data-points=\"";
/// Colours of [`Style::Line`].
const LINES: usize = 8;

impl Style {
    /// Shape of its marks, from their middle on, distinguished without colour: a dot, a cross, a diamond.
    fn mark(self) -> &'static str {
        match self {
            Style::Given => "m-4,-4l8,8m0,-8l-8,8",
            Style::Before => "m0,-5l5,5l-5,5l-5,-5z",
            _ => "l0,0",
        }
    }

    /// Its class in the page's style sheet.
    fn class(self) -> String {
        match self {
            Style::Measured => "measured".into(),
            Style::Given => "given".into(),
            Style::Before => "before".into(),
            Style::After => "after".into(),
            Style::Inferred => "inferred".into(),
            Style::Line(n) => format!("line{}{}", n % LINES, if n < LINES { "" } else { " again" }),
        }
    }
}

#[derive(Clone, Debug)]
struct Series {
    name: String,
    points: Vec<(f64, f64)>,
    /// What runs along the curve, where a cursor over another chart shall find its point.
    along: Vec<f64>,
    style: Style,
    marks: bool,
}

/// A chart of several series over one axis.
#[derive(Clone, Debug)]
pub struct Chart {
    title: String,
    x: String,
    y: String,
    series: Vec<Series>,
    bands: Vec<Vec<(f64, f64)>>,
    size: (f64, f64),
    names: bool,
    focus: Option<(f64, f64)>,
    link: String,
    scale: Scale,
    /// Whether the chart below it has the name of x.
    shared: bool,
    /// Values that the units of x and y suit, where charts beside it share them.
    suits: [Option<f64>; 2],
}

/// Space around the plot, px: left for numbers, above for the name of y, below for numbers and the name of x.
const LEFT: f64 = 52.0;
const RIGHT: f64 = 12.0;
const TOP: f64 = 24.0;
const BELOW: f64 = 42.0;
/// The same below for numbers alone.
const NUMBERS: f64 = 24.0;
/// Room that a number takes along x, and along y, px.
const ROOM: (f64, f64) = (66.0, 36.0);
/// Share of the values' span left free above and below them.
const PAD: f64 = 0.05;
/// Rows of the table behind a chart.
const ROWS: usize = 13;
/// Points of a series up to which its file of values holds all of them; of more, those that are drawn.
const WHOLE: usize = 4000;

/// A plot's axes and its size in px.
struct Frame {
    x: Axis,
    y: Axis,
    width: f64,
    height: f64,
}

impl Frame {
    fn px(&self, p: (f64, f64)) -> (f64, f64) {
        (self.width * self.x.place(p.0), self.height * (1.0 - self.y.place(p.1)))
    }
}

impl Chart {
    /// An empty chart; axes carry their units, as in `force [N]`. SI values are shown in ms, um, kN, as suits them.
    pub fn new(title: &str, x: &str, y: &str) -> Chart {
        Chart {
            title: title.into(),
            x: x.into(),
            y: y.into(),
            series: Vec::new(),
            bands: Vec::new(),
            size: (400.0, 270.0),
            names: true,
            focus: None,
            link: String::new(),
            scale: Scale::Linear,
            shared: false,
            suits: [None, None],
        }
    }

    /// Width and height in pixels (400 by 270 unless given).
    pub fn size(mut self, width: u32, height: u32) -> Chart {
        self.size = (f64::from(width.max(120)), f64::from(height.max(90)));
        self
    }

    /// Both axes by powers of ten.
    pub fn logarithmic(mut self) -> Chart {
        self.scale = Scale::Logarithmic;
        self
    }

    /// Leaves the name of x out, where the chart below has it.
    pub(crate) fn above(mut self) -> Chart {
        self.shared = true;
        self
    }

    /// Leaves the names of the series out, where a chart beside it has them.
    pub fn without_names(mut self) -> Chart {
        self.names = false;
        self
    }

    /// The part of x that is shown first, from `low` to `high`; the rest is there for who zooms out. Without effect by powers of
    /// ten, and where one is
    /// not finite or too large to be drawn, or they are not in order.
    pub fn focus(mut self, low: f64, high: f64) -> Chart {
        self.focus = (low >= -LARGEST && high <= LARGEST && low < high).then_some((low, high));
        self
    }

    /// Links its cursor with that of the other charts of this name.
    pub fn linked(mut self, group: &str) -> Chart {
        self.link = group.into();
        self
    }

    /// A shaded band between two curves; points that are not finite are left out.
    pub fn band(mut self, x: &[f64], low: &[f64], high: &[f64]) -> Chart {
        let edge = |y: &[f64]| -> Vec<(f64, f64)> {
            x.iter().copied().zip(y.iter().copied()).filter(|p| p.0.is_finite() && p.1.is_finite()).collect()
        };
        let mut outline = edge(low);
        outline.extend(edge(high).into_iter().rev());
        if outline.len() > 3 {
            self.bands.push(outline);
        }
        self
    }

    /// Adds a series; a point that is not finite is a gap.
    pub fn series(self, name: &str, x: &[f64], y: &[f64], style: Style) -> Chart {
        self.push(name, x, y, &[], style, false)
    }

    /// Adds a curve along which `along` runs, such as the time along a loop: the cursor of a linked chart over that axis
    /// finds its point.
    pub fn curve(self, name: &str, x: &[f64], y: &[f64], along: &[f64], style: Style) -> Chart {
        self.push(name, x, y, along, style, false)
    }

    /// Adds single points.
    pub fn marks(self, name: &str, x: &[f64], y: &[f64], style: Style) -> Chart {
        self.push(name, x, y, &[], style, true)
    }

    fn push(mut self, name: &str, x: &[f64], y: &[f64], along: &[f64], style: Style, marks: bool) -> Chart {
        let points = x.iter().copied().zip(y.iter().copied()).collect();
        self.series.push(Series { name: name.into(), points, along: along.to_vec(), style, marks });
        self
    }

    /// Whether `p` can be drawn.
    fn drawable(&self, p: &(f64, f64)) -> bool {
        let log = self.scale == Scale::Logarithmic;
        p.0.abs() <= LARGEST && p.1.abs() <= LARGEST && !(log && (p.0 <= 0.0 || p.1 <= 0.0))
    }

    /// Axes that hold what is shown first; None where there is nothing to draw.
    fn frame(&self) -> Option<Frame> {
        let finite = |p: &&(f64, f64)| self.drawable(p);
        let inside = |p: &&(f64, f64)| self.focus.is_none_or(|(a, b)| (a..=b).contains(&p.0));
        let all = || self.series.iter().flat_map(|s| &s.points).chain(self.bands.iter().flatten()).filter(finite);
        let span = |v: &mut dyn Iterator<Item = f64>| -> Option<(f64, f64)> {
            let of = |v: f64| if self.scale == Scale::Logarithmic { v.log10() } else { v };
            v.map(of).fold(None, |s, v| s.map_or(Some((v, v)), |(a, b): (f64, f64)| Some((a.min(v), b.max(v)))))
        };
        let (mut x0, mut x1) = span(&mut all().map(|p| p.0))?;
        let whole = span(&mut all().map(|p| p.1))?;
        if let Some((a, b)) = self.focus.filter(|_| self.scale == Scale::Linear) {
            (x0, x1) = (a, b);
        } else if self.series.iter().all(|s| s.marks) || self.series.iter().any(|s| self.is_loop(s)) {
            let pad = PAD * (x1 - x0);
            (x0, x1) = (x0 - pad, x1 + pad);
        }
        let (y0, y1) = span(&mut all().filter(inside).map(|p| p.1)).unwrap_or(whole);
        let apart = |a: f64, b: f64| if b > a { 0.0 } else { 0.5 * a.abs().max(1e-12) };
        let (dx, dy) = (apart(x0, x1), apart(y0, y1));
        let pad = PAD * (y1 - y0);
        Some(Frame {
            x: Axis::new(&self.x, x0 - dx, x1 + dx, self.scale, self.suits[0]),
            y: Axis::new(&self.y, y0 - pad - dy, y1 + pad + dy, self.scale, self.suits[1]),
            width: self.size.0 - LEFT - RIGHT,
            height: self.size.1 - TOP - if self.shared { NUMBERS } else { BELOW },
        })
    }

    /// The picture alone, as SVG text; an empty string where there is nothing to draw.
    pub fn svg(&self) -> String {
        self.frame().map_or(String::new(), |f| self.picture(&f))
    }

    /// The picture with title, colours and names of its own, as an SVG file; empty where there is nothing to draw.
    pub fn alone(&self) -> String {
        let Some(f) = self.frame() else { return String::new() };
        let named: Vec<&Series> = self.series.iter().filter(|s| !s.name.is_empty()).collect();
        let (w, h, top) = (self.size.0, self.size.1, 1.4 * NAME);
        let all = h + top + NAME * (named.len().div_ceil(BESIDE) as f64 + 0.5);
        let mut s = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{w}\" height=\"{all}\" viewBox=\"-8 0 {:.0} {all}\" \
             font-family=\"Helvetica, Arial, sans-serif\">\n<style>\n{STYLE}rect {{ fill: var(--paper); }}\n\
             text {{ fill: var(--ink); font-size: 12px; }}</style>\n<rect x=\"-8\" width=\"100%\" height=\"100%\"/>\
             <text y=\"16\" style=\"font-size:14px\">{}</text>\n\
             <svg y=\"{top}\" width=\"{w}\" height=\"{h}\">{}</svg>\n<g class=\"plot\">",
            w + 16.0,
            escape(&self.title),
            self.picture(&f)
        );
        for (i, series) in named.into_iter().enumerate() {
            let (x, y) = (w / BESIDE as f64 * (i % BESIDE) as f64, top + h + NAME * (0.5 + (i / BESIDE) as f64));
            s += &format!(
                "<g transform=\"translate({x:.1},{y:.1})\"><path class=\"{}\" d=\"M1,5H21\"/><text x=\"30\" y=\"9\">{}</text></g>\n",
                self.class(series),
                escape(&series.name)
            );
        }
        s + "</g></svg>\n"
    }

    /// The picture with its names, its readout and its table, as HTML; an empty string where there is nothing to draw.
    pub(crate) fn figure(&self, caption: &str) -> String {
        let Some(f) = self.frame() else { return String::new() };
        let title = match (self.title.is_empty(), caption.is_empty()) {
            (true, true) => String::new(),
            (true, false) => format!("<figcaption>{}</figcaption>", safe_text(caption)),
            _ => format!("<figcaption><b>{}</b> {}</figcaption>", escape(&self.title), safe_text(caption)),
        };
        format!("<figure>{title}{}{}{}</figure>\n", self.keys(), self.picture(&f), self.table(&f))
    }

    /// The names of the series with a piece of their line.
    fn keys(&self) -> String {
        if !self.names {
            return String::new();
        }
        let item = |(i, s): (usize, &Series)| {
            let piece = if s.marks { format!("M11,5{}", s.style.mark()) } else { "M1,5H21".into() };
            format!(
                "<li data-s=\"{i}\"><svg class=\"piece\" viewBox=\"0 0 22 10\" aria-hidden=\"true\"><path class=\"{}\" \
                 d=\"{piece}\"/></svg>{}</li>",
                self.class(s),
                escape(&s.name)
            )
        };
        let items: String = self
            .series
            .iter()
            .enumerate()
            .filter(|(_, s)| !s.points.is_empty() && !s.name.is_empty())
            .map(item)
            .collect();
        format!("<ul class=\"keys\">{items}</ul>")
    }

    fn class(&self, s: &Series) -> String {
        format!("{}{}", s.style.class(), if s.marks { " marks" } else { "" })
    }

    fn picture(&self, f: &Frame) -> String {
        let (w, h) = self.size;
        let mut s = format!(
            "<svg class=\"chart\" xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {w} {h}\" style=\"--w:{w}\" role=\"img\" \
             aria-label=\"{label}\"{data}><title>{label}</title><desc>{}</desc>\n<g class=\"grid\">",
            escape(&self.described(f)),
            label = escape(&self.label(f)),
            data = self.data(f)
        );
        let (xs, ys) = (f.x.ticks((f.width / ROOM.0) as usize), f.y.ticks(((f.height / ROOM.1) as usize).max(3)));
        let (left, low) = (LEFT, TOP + f.height);
        for (u, _) in &ys {
            let y = low - u * f.height;
            s += &format!("<path d=\"M{left},{y:.2}H{:.2}\"/>", left + f.width);
        }
        for (u, _) in &xs {
            s += &format!("<path d=\"M{:.2},{low:.2}v4\"/>", left + u * f.width);
        }
        s += &format!("<path class=\"base\" d=\"M{left},{low:.2}h{:.2}\"/></g><g class=\"x\">", f.width);
        for (u, text) in &xs {
            s += &format!("<text x=\"{:.2}\" y=\"{:.2}\">{}</text>", left + u * f.width, low + 17.0, escape(text));
        }
        s += "</g><g class=\"y\">";
        for (u, text) in &ys {
            let y = low - u * f.height;
            s += &format!("<text x=\"{:.2}\" y=\"{y:.2}\" dy=\".35em\">{}</text>", left - 8.0, escape(text));
        }
        s += &format!("</g><text class=\"name\" x=\"0\" y=\"13\">{}</text>", escape(&f.y.title()));
        if !self.shared {
            let (right, y) = (left + f.width, h - 5.0);
            let name = escape(&f.x.title());
            s += &format!("<text class=\"name end\" x=\"{right:.2}\" y=\"{y:.2}\">{name}</text>\n");
        }
        s += &format!(
            "<svg class=\"plot\" x=\"{left}\" y=\"{TOP}\" width=\"{:.2}\" height=\"{:.2}\">",
            f.width, f.height
        );
        for b in &self.bands {
            s += &format!("<path class=\"band\" d=\"{}\"/>", path(&self.stretches(f, b), ""));
        }
        for (i, series) in self.series.iter().enumerate() {
            s += &self.line(f, i, series);
        }
        s + "</svg></svg>"
    }

    /// Points as they are drawn; what cannot be is a gap.
    fn stretches(&self, f: &Frame, points: &[(f64, f64)]) -> Vec<Stretch> {
        let gap = (f64::NAN, f64::NAN);
        drawn(points.iter().map(|p| if self.drawable(p) { f.px(*p) } else { gap }), f.width)
    }

    fn line(&self, f: &Frame, i: usize, s: &Series) -> String {
        let stretches = self.stretches(f, &s.points);
        if stretches.is_empty() {
            return String::new();
        }
        let mut along = String::new();
        if self.is_loop(s) {
            let of: Vec<String> = stretches.iter().flatten().map(|p| format!("{:.4e}", s.along[p.2])).collect();
            along = format!(" data-along=\"{}\"", of.join(" "));
        }
        format!(
            "<path class=\"{}\" data-s=\"{i}\" data-n=\"{}\"{along} d=\"{}\"/>\n",
            self.class(s),
            escape(&s.name),
            path(&stretches, if s.marks { s.style.mark() } else { "" })
        )
    }

    /// What the script has to know: ends, factors and units of both axes, and the whole span of x.
    fn data(&self, f: &Frame) -> String {
        let all = self.series.iter().flat_map(|s| &s.points).filter(|p| self.drawable(p)).map(|p| f.x.place(p.0));
        let (least, most) = all.filter(|u| u.is_finite()).fold((0.0f64, 1.0f64), |(a, b), u| (a.min(u), b.max(u)));
        let axis = |a: &Axis| format!("{:e} {:e} {:e} {}", a.low, a.high, a.factor, escape(&a.unit));
        let mut s = format!(" data-x=\"{}\" data-y=\"{}\"", axis(&f.x), axis(&f.y));
        s += &format!(" data-whole=\"{least:.4} {most:.4}\"");
        if self.scale == Scale::Logarithmic {
            s += " data-log=\"1\"";
        }
        if !self.link.is_empty() {
            s += &format!(" data-link=\"{}\"", escape(&self.link));
        }
        s
    }

    /// What the script makes a file of values from, as an attribute; empty where nothing is drawn.
    fn points(&self, f: &Frame) -> String {
        let text = encoded(&self.columns(f));
        if text.is_empty() {
            text
        } else {
            format!(" {POINTS}{text}\"")
        }
    }

    /// The points in columns: series over the same x stand beside it. SI, as given.
    fn columns(&self, f: &Frame) -> Vec<Column> {
        let x = |s: &Series| s.points.iter().map(|p| p.0.to_bits()).collect::<Vec<u64>>();
        let mut groups: Vec<(Vec<u64>, Vec<&Series>)> = Vec::new();
        for s in self.series.iter().filter(|s| !s.points.is_empty()) {
            let of = x(s);
            match groups.iter_mut().find(|g| g.0 == of && !self.is_loop(s)) {
                Some(g) => g.1.push(s),
                None => groups.push((of, vec![s])),
            }
        }
        let called = |s: &Series, axis: &str| match s.name.is_empty() {
            true => axis.to_string(),
            false => format!("{}: {axis}", s.name),
        };
        let mut columns = Vec::new();
        for (_, all) in &groups {
            let Some(first) = all.first() else { continue };
            let mut rows: Vec<usize> = (0..first.points.len()).collect();
            if rows.len() > WHOLE {
                rows = all.iter().flat_map(|s| self.stretches(f, &s.points)).flatten().map(|p| p.2).collect();
                rows.sort_unstable();
                rows.dedup();
            }
            let own = groups.len() > 1 && all.len() == 1;
            let name = if own { called(first, &self.x) } else { self.x.clone() };
            columns.push(Column { name, values: rows.iter().map(|i| first.points[*i].0).collect() });
            columns.extend(
                all.iter().map(|s| Column {
                    name: called(s, &self.y),
                    values: rows.iter().map(|i| s.points[*i].1).collect(),
                }),
            );
        }
        for band in &self.bands {
            let (low, high) = band.split_at(band.len() / 2);
            let of = |name: &str, values: Vec<f64>| Column { name: name.into(), values };
            columns.push(of(&format!("band: {}", self.x), low.iter().map(|p| p.0).collect()));
            columns.push(of(&format!("band, low: {}", self.y), low.iter().map(|p| p.1).collect()));
            columns.push(of(&format!("band, high: {}", self.y), high.iter().rev().map(|p| p.1).collect()));
        }
        columns
    }

    /// Whether a series is a curve that something else than x runs along.
    fn is_loop(&self, s: &Series) -> bool {
        !s.points.is_empty() && s.along.len() == s.points.len()
    }

    fn label(&self, f: &Frame) -> String {
        let what = format!("{} over {}", f.y.name, f.x.name);
        if self.title.is_empty() {
            what
        } else {
            format!("{}: {what}", self.title)
        }
    }

    /// Largest and least of every series in words.
    fn described(&self, f: &Frame) -> String {
        let of = |s: &Series| {
            let (low, high) = self.extremes(s)?;
            let at = |p: (f64, f64)| format!("{} at {}", with_unit(&f.y, p.1), with_unit(&f.x, p.0));
            Some(format!("{}: least {}, largest {}.", s.name, at(low), at(high)))
        };
        self.series.iter().filter_map(of).collect::<Vec<_>>().join(" ")
    }

    /// The points of least and largest y.
    fn extremes(&self, s: &Series) -> Option<((f64, f64), (f64, f64))> {
        let all = || s.points.iter().filter(|p| self.drawable(p)).copied();
        Some((all().min_by(|a, b| a.1.total_cmp(&b.1))?, all().max_by(|a, b| a.1.total_cmp(&b.1))?))
    }

    /// A table of what is drawn, folded away: every series' values at places spread over what is shown first.
    fn table(&self, f: &Frame) -> String {
        let mut rows = String::new();
        for s in &self.series {
            let inside = |p: &&(f64, f64)| self.drawable(p) && self.focus.is_none_or(|(a, b)| (a..=b).contains(&p.0));
            let points: Vec<&(f64, f64)> = s.points.iter().filter(inside).collect();
            let step = points.len().div_ceil(ROWS).max(1);
            let cells = |of: &dyn Fn(&(f64, f64)) -> String| -> String {
                points.iter().step_by(step).map(|p| format!("<td>{}</td>", of(p))).collect()
            };
            rows += &format!("<tr><th>{}</th>{}</tr>", escape(&s.name), cells(&|p| f.y.value(p.1)));
            rows += &format!("<tr><th>at {}</th>{}</tr>\n", escape(&f.x.title()), cells(&|p| f.x.value(p.0)));
        }
        let of = if self.title.is_empty() { format!(": {}", escape(&f.y.name)) } else { String::new() };
        format!(
            "<div class=\"below\"{}><details class=\"data\"><summary>Values{of}</summary><p>{}</p><div class=\"scroll\" tabindex=\"0\" role=\"region\" \
             aria-label=\"Values of {}\"><table>{rows}</table></div></details></div>",
            self.points(f),
            escape(&self.described(f)),
            escape(&self.label(f))
        )
    }
}

/// Charts that stand beside each other, each quantity in one unit in all of them; one that has its units from others keeps them.
pub fn alike(mut charts: Vec<Chart>) -> Vec<Chart> {
    // of every axis its unit as given and its largest value
    let axes = |c: &Chart| {
        let f = c.frame();
        let of = |text: &str, a: Option<&Axis>| (unit_of(text), a.map_or(0.0, |a| a.low.abs().max(a.high.abs())));
        [of(&c.x, f.as_ref().map(|f| &f.x)), of(&c.y, f.as_ref().map(|f| &f.y))]
    };
    let all: Vec<(String, f64)> = charts.iter().flat_map(axes).collect();
    for c in &mut charts {
        let texts = [c.x.clone(), c.y.clone()];
        for (suits, text) in c.suits.iter_mut().zip(&texts).filter(|(suits, _)| suits.is_none()) {
            let unit = unit_of(text);
            let largest: Vec<f64> = all.iter().filter(|a| a.0 == unit).map(|a| a.1).collect();
            *suits = shared(&unit, &largest);
        }
    }
    charts
}

fn with_unit(a: &Axis, v: f64) -> String {
    format!("{} {}", a.value(v), a.unit).trim_end().into()
}

/// Stretches as the commands of a path; with a mark one at every point.
fn path(stretches: &[Stretch], mark: &str) -> String {
    let mut s = String::new();
    for stretch in stretches {
        for (k, (x, y, _)) in stretch.iter().enumerate() {
            s.push(if k == 0 || !mark.is_empty() { 'M' } else { 'L' });
            s += &format!("{x:.2},{y:.2}{mark}");
        }
    }
    s
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::collection::vec;
    use proptest::prelude::*;
    use proptest::sample::select;
    use proptest::test_runner::{Config, RngSeed};
    use proptest::{num, option};

    /// Points of the n-th line drawn.
    fn points(svg: &str, n: usize) -> Vec<(f64, f64)> {
        let line = svg.split("data-s=\"").nth(n + 1).unwrap();
        let d = line.split(" d=\"").nth(1).unwrap().split('"').next().unwrap();
        let pair = |p: &str| p.split_once(',').map(|(x, y)| (x.parse().unwrap(), y.parse().unwrap()));
        d.split(['M', 'L']).filter_map(pair).collect()
    }

    #[test]
    fn a_spike_of_one_sample_in_a_million_is_drawn_at_its_full_height() {
        let n = 1_000_000;
        let x: Vec<f64> = (0..n).map(|i| f64::from(i) * 1e-6).collect();
        let y: Vec<f64> = (0..n).map(|i| if i == 123_457 { 1250.0 } else { 0.0 }).collect();
        let svg = Chart::new("", "time [s]", "force [N]").series("measured", &x, &y, Style::Measured).svg();
        let plot = 270.0 - TOP - BELOW;
        let highest = points(&svg, 0).iter().map(|p| p.1).fold(f64::MAX, f64::min);
        // 5 % of the span is left free above it and below
        assert!((highest - plot * PAD / (1.0 + 2.0 * PAD)).abs() < 0.01, "{highest}");
        assert!(svg.contains("largest 1.250 kN at 0.1235 s") && svg.len() < 60_000, "{}", svg.len());
    }

    #[test]
    fn charts_beside_each_other_have_one_unit_for_a_quantity() {
        let of =
            |most: f64| Chart::new("", "time [s]", "force [N]").series("a", &[0.0, 1e-3], &[0.0, most], Style::After);
        let units = |c: &Chart| c.frame().map(|f| (f.x.unit, f.y.unit)).unwrap();
        assert_eq!(units(&of(2500.0)).1, "kN");
        let all = alike(vec![of(2500.0), of(250.0), Chart::new("", "time [s]", "force [N]")]);
        assert!(all[..2].iter().all(|c| units(c) == ("ms".into(), "N".into())));
        // what has its units keeps them
        assert_eq!(units(&alike(vec![all[0].clone()])[0]).1, "N");
    }

    #[test]
    fn a_loop_ends_before_the_frame_and_its_file_has_every_lines_own_places() {
        let (x, t) = ([0.0, 1.0, 0.5], [0.0, 0.1, 0.2]);
        let c = Chart::new("", "penetration [m]", "force [N]")
            .curve("a", &x, &[0.0, 5.0, 1.0], &t, Style::After)
            .curve("b", &x, &[0.0, 4.0, f64::NAN], &t, Style::Before);
        let f = c.frame().unwrap();
        assert!(f.x.low < 0.0 && f.x.high > 1.0);
        let names: Vec<String> = c.columns(&f).into_iter().map(|c| c.name).collect();
        assert_eq!(names, ["a: penetration [m]", "a: force [N]", "b: penetration [m]", "b: force [N]"]);
    }

    #[test]
    fn a_file_of_values_has_every_sample_and_of_a_million_those_that_are_drawn() {
        let of = |n: usize| {
            let x: Vec<f64> = (0..n).map(|i| i as f64).collect();
            let y: Vec<f64> = (0..n).map(|i| if i == n / 3 { 9.0 } else { 0.0 }).collect();
            let c = Chart::new("", "time [s]", "force [N]").series("a", &x, &y, Style::After).series(
                "",
                &x,
                &y,
                Style::Given,
            );
            c.columns(&c.frame().unwrap())
        };
        let small = of(WHOLE);
        assert_eq!((small.len(), small[0].values.len(), small[2].name.as_str()), (3, WHOLE, "force [N]"));
        let large = of(1_000_000);
        assert!(large[0].values.len() < WHOLE && large[1].values.contains(&9.0));
    }

    #[test]
    fn places_are_finer_than_a_pixel() {
        let x: Vec<f64> = (0..700).map(|i| f64::from(i) * 1e-5).collect();
        let y: Vec<f64> = x.iter().map(|t| 800.0 * (t * 448.0).sin()).collect();
        let svg = Chart::new("", "time [s]", "force [N]").series("a", &x, &y, Style::After).svg();
        let all = points(&svg, 0);
        let whole = |v: f64| (v - v.round()).abs() < 0.005;
        assert!(all.len() > 600 && all.iter().filter(|p| whole(p.0) && whole(p.1)).count() < all.len() / 10);
        let f = Chart::new("", "time [s]", "force [N]").series("a", &x, &y, Style::After).frame().unwrap();
        let (px, drawn) = (f.px((x[10], y[10])), all.iter().find(|p| (p.0 - f.px((x[10], 0.0)).0).abs() < 0.01));
        assert!((drawn.unwrap().1 - px.1).abs() < 0.01);
    }

    #[test]
    fn the_axis_shows_the_pulse_and_the_rest_is_there() {
        let x: Vec<f64> = (0..100_000).map(|i| f64::from(i) * 1e-5).collect();
        let y: Vec<f64> =
            x.iter().map(|t| if *t > 0.9 { 5000.0 } else { (1.0 - (t - 0.5).abs() / 1e-3).max(0.0) }).collect();
        let c = Chart::new("", "time [s]", "force [N]").series("a", &x, &y, Style::After).focus(0.498, 0.502);
        let f = c.frame().unwrap();
        assert!(f.y.high < 1.1 && f.x.high < 0.503, "{} {}", f.y.high, f.x.high);
        let all = points(&c.svg(), 0);
        assert!(all.iter().any(|p| p.1 < -1000.0), "outside what is shown, for who zooms out");
        assert!(all.iter().filter(|p| (0.0..=336.0).contains(&p.0)).count() > 300 && all.len() < 5000, "{}", all.len());
    }

    proptest! {
        #![proptest_config(Config { rng_seed: RngSeed::Fixed(1), failure_persistence: None, ..Config::default() })]
        #[test]
        fn every_chart_ends_and_shows_no_number_that_is_none(
            x in vec(any_number(), 0..60),
            y in vec(any_number(), 0..60),
            focus in option::of((any_number(), any_number())),
            logarithmic: bool,
            marks: bool,
        ) {
            let mut c = Chart::new("title", "time [s]", "penetration [m]").band(&x, &y, &x);
            c = if marks { c.marks("a", &x, &y, Style::Before) } else { c.curve("a", &x, &y, &x, Style::After) };
            if let Some((a, b)) = focus {
                c = c.focus(a, b);
            }
            if logarithmic {
                c = c.logarithmic();
            }
            for drawn in [c.alone(), c.figure("caption")] {
                let none = |w: &str| w == "NaN" || w == "inf";
                prop_assert!(!drawn.split(|c: char| !c.is_alphanumeric()).any(none), "{drawn}");
                prop_assert!(drawn.len() < 400_000, "{}", drawn.len());
            }
        }
    }

    /// Numbers of any size, and what is none.
    fn any_number() -> impl Strategy<Value = f64> {
        const EDGES: &[f64] =
            &[f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 0.0, 1.7e308, -1.7e308, 1e300, 5e-324, 1.0, -0.0];
        prop_oneof![num::f64::ANY, select(EDGES), -1e3..1e3]
    }

    #[test]
    fn a_penetration_of_the_largest_number_is_left_out_and_the_chart_ends() {
        let x: Vec<f64> = (0..200).map(f64::from).collect();
        let mut y = x.clone();
        y[100] = 1.7e308;
        let svg = Chart::new("", "time [s]", "penetration [m]").series("a", &x, &y, Style::After).svg();
        assert!(svg.contains("largest 199.0 m at 199.0 s") && svg.len() < 20_000, "{svg}");
    }

    #[test]
    fn a_chart_survives_what_cannot_be_drawn_and_escapes_names() {
        assert_eq!(Chart::new("", "", "").svg(), "");
        let nan = [f64::NAN; 3];
        assert_eq!(Chart::new("", "", "").series("a", &nan, &nan, Style::Before).figure("x"), "");
        let one = Chart::new("<b>", "x", "y").series("<script>", &[1.0], &[0.0], Style::Line(9)).figure("c");
        assert!(
            one.contains("&lt;script&gt;")
                && !one.contains("<script>")
                && one.contains("line1")
                && !one.contains("NaN")
        );
        let alone = Chart::new("a & b", "x", "y").series("<c>", &[0.0, 1.0], &[0.0, 1.0], Style::Line(0)).alone();
        assert!(alone.contains("a &amp; b") && alone.contains("&lt;c&gt;") && alone.contains("--l0"));
        assert_eq!(alone.matches("<svg").count(), alone.matches("</svg>").count());
        let log =
            Chart::new("", "n", "e").logarithmic().series("a", &[1.0, 10.0, 100.0], &[1.0, 0.0, 0.01], Style::Before);
        let f = log.frame().unwrap();
        assert!((f.x.low, f.x.high) == (0.0, 2.0) && log.svg().matches('M').count() > 2);
    }
}
