//! One self-contained HTML page.

use super::card::{self, Card};
use super::cells::{Cells, Shares};
use super::chart::{alike, Chart, POINTS, STYLE};
use super::heat::Heat;
use super::number::dashed;
use super::table::{table, Datum};

/// Opens a sentence.
pub(super) const LEAD: &str = "<p class=\"lead\">";
/// Opens the links to other pages; there on every page, so that an index can put a link to itself in.
const PAGES: &str = "<nav class=\"pages\" aria-label=\"Pages\">";
/// Opens a row of pictures.
const FIGURES: &str = "<div class=\"figures\">\n";
/// Opens what says where a page comes from.
const FOOT: &str = "<footer class=\"trace\" aria-labelledby=\"trace\">";
/// Sections from which a page has a list of them.
const LISTED: usize = 4;

/// A page built top to bottom.
#[derive(Clone)]
pub struct Page {
    title: String,
    body: String,
    /// Identifier and heading of every section.
    sections: Vec<(String, String)>,
    /// Whether a row of pictures is open.
    row: bool,
    /// Where the list of sections goes, in the body.
    list_at: usize,
    up: Option<(String, String)>,
    /// Whether it comes without a script.
    still: bool,
    /// Where it comes from, HTML; empty where nothing is said of that.
    foot: String,
}

/// Text safe inside HTML and SVG.
pub(super) fn escape(s: &str) -> String {
    s.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

/// A text of the page, safe inside HTML and SVG: a number in it that is not finite is a dash.
pub(super) fn safe_text(s: &str) -> String {
    escape(&dashed(s))
}

/// Numbers as print has them: per cent on the number's line, a minus for a hyphen before a digit.
pub(super) fn tight(html: &str) -> String {
    let mut s = html.replace(" %", "\u{a0}%");
    for digit in '0'..='9' {
        for before in [' ', '('] {
            s = s.replace(&format!("{before}-{digit}"), &format!("{before}\u{2212}{digit}"));
        }
    }
    s
}

impl Page {
    /// An empty page.
    pub fn new(title: &str) -> Page {
        let (title, body) = (title.into(), String::new());
        Page { title, body, sections: Vec::new(), row: false, list_at: 0, up: None, still: false, foot: String::new() }
    }

    /// The page without a script, for places that run none: its charts are shown, and nothing on it moves.
    pub fn still(mut self) -> Page {
        self.still = true;
        self
    }

    /// HTML that the program brings along, as it stands; never a user's.
    pub fn passage(self, html: &str) -> Page {
        self.add(html).list_below()
    }

    /// Links to the page above this one, its index.
    pub fn up(mut self, to: &str, text: &str) -> Page {
        self.up = Some((to.into(), text.into()));
        self
    }

    /// Adds `html` after what is there; a row of pictures ends before it.
    fn add(mut self, html: &str) -> Page {
        if self.row {
            self.body += "</div>\n";
            self.row = false;
        }
        self.body += html;
        self
    }

    /// Adds a picture to the row of pictures.
    fn add_picture(mut self, html: &str) -> Page {
        if html.is_empty() {
            return self;
        }
        if !self.row {
            self.body += FIGURES;
            self.row = true;
        }
        self.body += html;
        self
    }

    /// The sentence a reader should take away.
    pub fn sentence(self, text: &str) -> Page {
        self.add(&format!("{LEAD}{}</p>\n", safe_text(text))).list_below()
    }

    /// What is wrong, how sure that is, what it does, what to do next.
    pub fn card(self, card: &Card) -> Page {
        self.add(&card.html()).list_below()
    }

    /// A card of another page of ours, as [`card`] finds it.
    pub fn card_of(self, html: &str) -> Page {
        self.add(html)
    }

    /// The list of sections stands no higher than here.
    fn list_below(mut self) -> Page {
        if self.sections.is_empty() {
            self.list_at = self.body.len();
        }
        self
    }

    /// A heading.
    pub fn section(mut self, text: &str) -> Page {
        let id = format!("s{}", self.sections.len() + 1);
        self.sections.push((id.clone(), text.into()));
        self.add(&format!("<h2 id=\"{id}\">{}</h2>\n", escape(text)))
    }

    /// A paragraph.
    pub fn paragraph(self, text: &str) -> Page {
        self.add(&format!("<p>{}</p>\n", tight(&safe_text(text))))
    }

    /// A list.
    pub fn list(self, items: &[String]) -> Page {
        let items: String = items.iter().map(|t| format!("<li>{}</li>", safe_text(t))).collect();
        self.add(&format!("<ul class=\"plain\">{items}</ul>\n"))
    }

    /// A table.
    pub fn table(self, head: &[&str], rows: &[Vec<String>]) -> Page {
        let cells = |tag: &str, cells: &mut dyn Iterator<Item = &str>| -> String {
            cells.map(|c| format!("<{tag}>{}</{tag}>", safe_text(c))).collect()
        };
        let name = head.first().copied().unwrap_or("table");
        let mut s = format!(
            "<div class=\"scroll\" tabindex=\"0\" role=\"region\" aria-label=\"Table by {}\"><table><thead><tr>{}</tr></thead><tbody>",
            escape(name),
            cells("th", &mut head.iter().copied())
        );
        for r in rows {
            s += &format!("<tr>{}</tr>\n", cells("td", &mut r.iter().map(String::as_str)));
        }
        self.add(&(s + "</tbody></table></div>\n"))
    }

    /// A table with numbers in it: a column of one quantity has one unit, which its head names.
    pub fn values(self, head: &[&str], rows: &[Vec<Datum>]) -> Page {
        self.add(&table(head, rows))
    }

    /// Where what the page says comes from, at its foot: names and what they are, in their order.
    pub fn trace(mut self, rows: &[(String, String)]) -> Page {
        let row = |(name, of): &(String, String)| {
            let of: String = of.lines().map(|l| format!("<span>{}</span>", escape(l))).collect();
            format!("<div><dt>{}</dt><dd>{of}</dd></div>\n", escape(name))
        };
        self.foot = format!(
            "{FOOT}<h2 id=\"trace\">Traceability</h2>\n<dl>{}</dl></footer>\n",
            rows.iter().map(row).collect::<String>()
        );
        self
    }

    /// A table whose rows begin with a link each: where to (none: no link), and the cells.
    pub fn ledger(self, head: &[&str], rows: &[(Option<String>, Vec<String>)]) -> Page {
        let name = head.first().copied().unwrap_or("table");
        let heads: String = head.iter().map(|c| format!("<th>{}</th>", safe_text(c))).collect();
        let mut s = format!(
            "<div class=\"scroll\" tabindex=\"0\" role=\"region\" aria-label=\"Table by {}\"><table><thead><tr>{heads}</tr></thead><tbody>",
            escape(name)
        );
        for (to, cells) in rows {
            let mut cells = cells.iter();
            let first = cells.next().map_or(String::new(), |c| safe_text(c));
            let first = to.as_ref().map_or(first.clone(), |to| format!("<a href=\"{}\">{first}</a>", escape(to)));
            let rest: String = cells.map(|c| format!("<td>{}</td>", tight(&safe_text(c)))).collect();
            s += &format!("<tr><td>{first}</td>{rest}</tr>\n");
        }
        self.add(&(s + "</tbody></table></div>\n"))
    }

    /// Squares of many things, by kind.
    pub fn cells(self, cells: &Cells) -> Page {
        self.add(&cells.html())
    }

    /// A table of counts.
    pub fn shares(self, shares: &Shares) -> Page {
        self.add(&shares.html())
    }

    /// A heat table.
    pub fn heat(self, heat: &Heat) -> Page {
        self.add(&heat.html())
    }

    /// A chart with its caption; nothing where it has nothing to draw.
    pub fn chart(self, chart: &Chart, caption: &str) -> Page {
        self.add_picture(&chart.figure(caption))
    }

    /// Charts that belong together, one below the other in one place of the row, each quantity in one unit.
    pub fn stack(self, charts: Vec<(Chart, &str)>) -> Page {
        let last = charts.len().saturating_sub(1);
        let (charts, captions): (Vec<Chart>, Vec<&str>) = charts.into_iter().unzip();
        let charts = alike(charts).into_iter().zip(captions);
        let one = |(i, (c, caption)): (usize, (Chart, &str))| if i < last { c.above() } else { c }.figure(caption);
        let all: String = charts.enumerate().map(one).collect();
        let html = if all.is_empty() { all } else { format!("<div class=\"stack\">{all}</div>\n") };
        self.add_picture(&html)
    }

    /// A picture of another page of ours, as [`picture`] finds it.
    pub fn picture_of(self, html: &str) -> Page {
        self.add_picture(html)
    }

    /// A command as typed.
    pub fn code(self, text: &str) -> Page {
        self.add(&format!("<pre tabindex=\"0\">{}</pre>\n", escape(text)))
    }

    /// A link to another file.
    pub fn link(self, to: &str, text: &str) -> Page {
        self.add(&format!("<p><a href=\"{}\">{}</a></p>\n", escape(to), escape(text)))
    }

    /// An entry of an index: a link, and what is found there.
    pub fn entry(self, to: &str, name: &str, text: &str) -> Page {
        self.add(&format!(
            "<article class=\"entry\"><h2><a href=\"{}\">{}</a></h2><p>{}</p></article>\n",
            escape(to),
            escape(name),
            safe_text(text)
        ))
    }

    /// What `inner` holds, folded away until a reader opens it.
    pub fn folded(self, title: &str, inner: impl FnOnce(Page) -> Page) -> Page {
        let part = inner(Page::new("")).add("");
        self.add(&format!("<details><summary>{}</summary>\n{}</details>\n", escape(title), part.body))
    }

    /// What `rest` holds, after what is here; the list of sections stands where `rest` has it, but in a page that had some.
    pub fn then(mut self, rest: Page) -> Page {
        let rest = rest.add("");
        self = self.add("").list_below();
        if self.sections.is_empty() {
            self.list_at += rest.list_at;
        }
        self = self.add(&rest.body);
        self.sections.extend(rest.sections);
        self
    }

    /// The list of sections; empty where they are few.
    fn contents(&self) -> String {
        if self.sections.len() < LISTED {
            return String::new();
        }
        let item = |(id, text): &(String, String)| format!("<li><a href=\"#{id}\">{}</a></li>", escape(text));
        let items: String = self.sections.iter().map(item).collect();
        format!("<nav class=\"contents\" aria-label=\"On this page\"><ul>{items}</ul></nav>\n")
    }

    /// The whole page.
    pub fn html(&self) -> String {
        let end = if self.row { "</div>\n" } else { "" };
        let (top, rest) = self.body.split_at(self.list_at);
        // what only the script reads
        let [top, rest] = [top, rest].map(|part| if self.still { without_points(part) } else { part.into() });
        let up = self.up.as_ref().map_or(String::new(), |(to, text)| anchor(to, text));
        format!(
            "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><title>{t}</title>\n\
             <meta name=\"viewport\" content=\"width=device-width,initial-scale=1\">\n\
             <meta name=\"color-scheme\" content=\"light dark\">\n<link rel=\"icon\" href=\"data:,\">\n\
             <style>\n{css}</style></head>\n<body><a class=\"skip\" href=\"#main\">To the content</a>\n\
             <header>{PAGES}{up}</nav><h1>{t}</h1></header>\n\
             <main id=\"main\">\n{top}{contents}{rest}{end}</main>\n{foot}{js}</body></html>\n",
            foot = self.foot,
            t = escape(&self.title),
            css = STYLE.to_owned() + include_str!("style.css"),
            js = if self.still { String::new() } else { format!("<script>\n{}</script>", include_str!("script.js")) },
            contents = self.contents(),
        )
    }
}

/// `html` without the points of its charts.
fn without_points(html: &str) -> String {
    let attribute = format!(" {POINTS}");
    let mut parts = html.split(&attribute);
    let first = parts.next().unwrap_or_default();
    let rest = parts.map(|p| p.split_once('"').map_or(p, |(_, after)| after));
    std::iter::once(first).chain(rest).collect()
}

fn anchor(to: &str, text: &str) -> String {
    format!("<a href=\"{}\">{}</a>", escape(to), escape(text))
}

/// `html`, a page of ours, with a link to the page `to` above it in the place of the one it has.
pub fn linked(html: &str, to: &str, text: &str) -> String {
    match between(html, PAGES, "</nav>") {
        Some(old) => html.replacen(old, &format!("{PAGES}{}", anchor(to, text)), 1),
        None => html.into(),
    }
}

/// What `html` has between `start` and `end`, first time, with `start`.
fn between<'a>(html: &'a str, start: &str, end: &str) -> Option<&'a str> {
    let from = html.find(start)?;
    let to = html[from..].find(end)?;
    Some(&html[from..from + to])
}

/// The first sentence of a page of ours.
pub fn lead(html: &str) -> Option<String> {
    let inner = between(html, LEAD, "</p>")?.strip_prefix(LEAD)?;
    Some(inner.replace("&lt;", "<").replace("&gt;", ">").replace("&quot;", "\"").replace("&amp;", "&"))
}

/// The first picture of a page of ours, HTML.
pub fn picture(html: &str) -> Option<String> {
    Some(between(html, "<figure>", "</figure>")?.to_string() + "</figure>\n")
}

/// The card of a page of ours, HTML.
pub fn card(html: &str) -> Option<String> {
    Some(between(html, card::OPEN, card::CLOSE)?.to_string() + card::CLOSE + "\n")
}

#[cfg(test)]
mod tests {
    use super::super::chart::Style;
    use super::*;

    fn chart(name: &str) -> Chart {
        Chart::new(name, "x", "y").series(name, &[0.0, 1.0], &[0.0, 1.0], Style::Before)
    }

    #[test]
    fn sentence_and_picture_are_found_again() {
        let page = Page::new("t")
            .paragraph("p")
            .sentence("a < \"b\" & c")
            .chart(&chart("first"), "x")
            .chart(&chart("second"), "y");
        let h = page.html();
        assert_eq!(lead(&h).as_deref(), Some("a < \"b\" & c"));
        let first = picture(&h).unwrap();
        assert!(first.contains("first") && !first.contains("second") && first.ends_with("</figure>\n"));
        assert_eq!((lead("<p>none</p>"), picture(""), card(&h)), (None, None, None));
    }

    #[test]
    fn what_a_user_names_cannot_break_the_page() {
        let h = Page::new("<b>").paragraph("a<script>").table(&["x"], &[vec!["<td>".into()]]).html();
        assert!(!h.contains("a<script>") && h.contains("&lt;td&gt;") && h.contains("<title>&lt;b&gt;</title>"));
    }

    #[test]
    fn pages_are_linked_and_a_row_of_pictures_is_closed() {
        let h =
            Page::new("t").up("../index.html", "all").chart(&chart("a"), "").section("b").chart(&chart("c"), "").html();
        assert!(h.contains("<a href=\"../index.html\">all</a>"));
        assert_eq!(h.matches("<div").count(), h.matches("</div>").count());
        let other = linked(&h, "../../index.html", "the demo");
        assert!(other.contains("../../index.html") && !other.contains("\"../index.html\""));
    }

    #[test]
    fn a_still_page_has_its_charts_and_no_script() {
        let page = Page::new("t").chart(&chart("a"), "").passage("<em>own</em>");
        let (moving, still) = (page.clone().html(), page.still().html());
        assert!(moving.contains("<script>") && !still.contains("<script"));
        assert!(moving.contains(POINTS) && !still.contains(POINTS) && still.contains("<summary>Values"));
        assert!(
            still.contains("<svg class=\"chart\"") && still.contains("<em>own</em>") && still.contains("@media print")
        );
    }

    #[test]
    fn where_a_page_comes_from_stands_at_its_foot() {
        let rows = [("command".to_string(), "touchdown <x>".to_string()), ("input".into(), "a 1\nb 2".into())];
        let h = Page::new("t").sentence("s").trace(&rows).html();
        let foot = h.split("</main>").nth(1).unwrap();
        assert!(foot.contains("touchdown &lt;x&gt;") && foot.contains("<span>a 1</span><span>b 2</span>"), "{foot}");
        assert!(!Page::new("t").html().contains("<footer"));
    }

    #[test]
    fn a_page_asks_for_nothing_from_a_network() {
        let h = Page::new("t").chart(&chart("a"), "").html().replace("http://www.w3.org/2000/svg", "");
        for word in ["http:", "https:", "url(", "@import", "src="] {
            assert!(!h.contains(word), "{word}");
        }
    }
}
