//! Heat tables as SVG: rows by columns, a value and its colour in every cell.

use super::page::escape;

/// A heat table; values count from 1 (nothing) upwards on a logarithmic colour scale.
pub struct Heat {
    title: String,
    columns: Vec<String>,
    rows: Vec<(String, Vec<Option<f64>>)>,
}

const WIDTH: usize = 62;
const HEIGHT: usize = 22;
const LEFT: usize = 96;
const TOP: usize = 74;
/// Value at which the colour is full.
const FULL: f64 = 20.0;

impl Heat {
    /// An empty table; a column's name may be two lines, parted by `\n`.
    pub fn new(title: &str, columns: &[String]) -> Heat {
        Heat { title: title.into(), columns: columns.to_vec(), rows: Vec::new() }
    }

    /// Adds a row; None where there is nothing to tell.
    pub fn row(mut self, name: &str, values: &[Option<f64>]) -> Heat {
        self.rows.push((name.into(), values.to_vec()));
        self
    }

    /// The table as SVG text.
    pub fn svg(&self) -> String {
        let (w, h) = (LEFT + WIDTH * self.columns.len() + 4, TOP + HEIGHT * self.rows.len() + 6);
        let mut s = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{w}\" height=\"{h}\" font-family=\"sans-serif\" font-size=\"11\">\n\
             <text x=\"4\" y=\"16\" font-size=\"14\">{}</text>\n",
            escape(&self.title)
        );
        for (i, c) in self.columns.iter().enumerate() {
            for (k, line) in c.split('\n').enumerate() {
                let (x, y) = (LEFT + WIDTH * i + WIDTH / 2, 42 + 15 * k);
                s += &format!("<text x=\"{x}\" y=\"{y}\" text-anchor=\"middle\">{}</text>\n", escape(line));
            }
        }
        for (j, (name, values)) in self.rows.iter().enumerate() {
            let y = TOP + HEIGHT * j;
            s += &format!("<text x=\"{}\" y=\"{}\" text-anchor=\"end\">{}</text>\n", LEFT - 6, y + 15, escape(name));
            for (i, v) in values.iter().enumerate() {
                let x = LEFT + WIDTH * i;
                let (fill, ink, text) = match v {
                    Some(v) => {
                        let u = shade(*v);
                        (colour(u), if u > 0.6 { "#fff" } else { "#222" }, format!("{v:.1}"))
                    }
                    None => ("#f4f4f4".into(), "#999", "-".into()),
                };
                s += &format!(
                    "<rect x=\"{x}\" y=\"{y}\" width=\"{}\" height=\"{}\" fill=\"{fill}\"/>\
                     <text x=\"{}\" y=\"{}\" text-anchor=\"middle\" fill=\"{ink}\">{text}</text>\n",
                    WIDTH - 2,
                    HEIGHT - 2,
                    x + WIDTH / 2 - 1,
                    y + 15
                );
            }
        }
        s + "</svg>\n"
    }
}

/// 0 at noise to 1 at `FULL` times noise.
fn shade(v: f64) -> f64 {
    if v.is_finite() {
        ((v.max(1e-9) / 1.1).ln() / FULL.ln()).clamp(0.0, 1.0)
    } else {
        1.0
    }
}

/// White to dark red.
fn colour(u: f64) -> String {
    let mix = |a: f64, b: f64| (a + (b - a) * u).round() as u8;
    format!("#{:02x}{:02x}{:02x}", mix(255.0, 165.0), mix(255.0, 15.0), mix(255.0, 21.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn noise_is_white_and_what_stands_out_is_red() {
        assert_eq!(colour(shade(1.0)), "#ffffff");
        assert_eq!(colour(shade(50.0)), "#a50f15");
        let svg = Heat::new("a < b", &["force\nloading".into()]).row("0.1 m", &[Some(3.25)]).row("x", &[None]).svg();
        assert!(svg.contains("a &lt; b") && svg.contains(">3.2<") && svg.matches("<rect").count() == 2);
    }
}
