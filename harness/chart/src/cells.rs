//! Many things by kind: a small square for each, and tables of shares.

use super::heat::DEEP;
use super::page::{escape, safe_text};

/// Colours of the kinds, over again beyond.
const COLOURS: usize = 8;

/// A thing of a kind: what is shown where one points at it, a link, and how strongly it is coloured, 0 to 1.
pub struct Cell {
    pub said: String,
    pub to: Option<String>,
    pub strength: f64,
}

/// A square for each of many things, in rows by kind.
#[derive(Default)]
pub struct Cells {
    rows: Vec<(String, Vec<Cell>)>,
}

impl Cells {
    /// Adds a kind with its things.
    pub fn row(mut self, name: &str, cells: Vec<Cell>) -> Cells {
        self.rows.push((name.into(), cells));
        self
    }

    pub(crate) fn html(&self) -> String {
        let one = |c: &Cell| {
            let u = if c.strength.is_nan() { 0.0 } else { 100.0 * c.strength.clamp(0.0, 1.0) };
            let said = safe_text(&c.said);
            match &c.to {
                Some(to) => {
                    format!(
                        "<a href=\"{}\" title=\"{said}\" aria-label=\"{said}\" style=\"--u:{u:.0}%\"></a>",
                        escape(to)
                    )
                }
                None => format!("<i title=\"{said}\" style=\"--u:{u:.0}%\"></i>"),
            }
        };
        let row = |(i, (name, cells)): (usize, &(String, Vec<Cell>))| {
            let all: String = cells.iter().map(one).collect();
            format!(
                "<div><dt>{}<span>{}</span></dt><dd class=\"cells\" style=\"--c:var(--l{})\">{all}</dd></div>\n",
                safe_text(name),
                cells.len(),
                i % COLOURS
            )
        };
        let rows: String = self.rows.iter().enumerate().map(row).collect();
        format!("<dl class=\"map\">\n{rows}</dl>\n")
    }
}

/// A table of counts: rows by columns, each cell shaded by its share of its column.
pub struct Shares {
    title: String,
    columns: Vec<String>,
    rows: Vec<(String, Vec<usize>)>,
}

impl Shares {
    pub fn new(title: &str, columns: &[String]) -> Shares {
        Shares { title: title.into(), columns: columns.to_vec(), rows: Vec::new() }
    }

    /// Adds a row with a count for each column.
    pub fn row(mut self, name: &str, counts: &[usize]) -> Shares {
        self.rows.push((name.into(), counts.to_vec()));
        self
    }

    pub(crate) fn html(&self) -> String {
        let whole = |k: usize| self.rows.iter().filter_map(|r| r.1.get(k)).sum::<usize>();
        let cell = |(k, n): (usize, &usize)| {
            let share = *n as f64 / whole(k).max(1) as f64;
            let class = match *n {
                0 => " class=\"none\"",
                _ if share > DEEP => " class=\"deep\"",
                _ => "",
            };
            format!("<td{class} style=\"--u:{:.0}%\">{n}</td>", 100.0 * share)
        };
        let head: String = self.columns.iter().map(|c| format!("<th scope=\"col\">{}</th>", escape(c))).collect();
        let row = |(name, counts): &(String, Vec<usize>)| {
            let cells: String = counts.iter().enumerate().map(cell).collect();
            format!("<tr><th scope=\"row\">{}</th>{cells}</tr>\n", escape(name))
        };
        let rows: String = self.rows.iter().map(row).collect();
        let title = escape(&self.title);
        format!(
            "<div class=\"scroll\" tabindex=\"0\" role=\"region\" aria-label=\"{title}\"><table class=\"heat\">\
             <caption>{title}</caption><thead><tr><td></td>{head}</tr></thead><tbody>{rows}</tbody></table></div>\n"
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_thing_has_its_square_and_what_a_user_names_stays_text() {
        let cell = |to: Option<&str>| Cell { said: "a <b>".into(), to: to.map(String::from), strength: 0.5 };
        let html = Cells::default().row("x & y", vec![cell(Some("a\"b.html")), cell(None)]).row("z", vec![]).html();
        assert!(html.contains("x &amp; y<span>2</span>") && html.contains("title=\"a &lt;b&gt;\""), "{html}");
        assert!(
            html.contains("href=\"a&quot;b.html\"") && html.matches("--u:50%").count() == 2 && !html.contains("<b>")
        );
    }

    #[test]
    fn counts_are_shaded_by_their_share_of_the_column() {
        let html = Shares::new("t", &["a".into(), "b".into()]).row("x", &[4, 0]).row("y", &[1, 0]).html();
        assert!(html.contains("class=\"deep\" style=\"--u:80%\">4<") && html.contains("style=\"--u:20%\">1<"));
        assert_eq!(html.matches("class=\"none\"").count(), 2);
    }
}
