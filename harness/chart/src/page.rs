//! One self-contained HTML page.

/// Opens a sentence.
const LEAD: &str = "<p class=\"lead\">";

/// A page built top to bottom.
pub struct Page {
    title: String,
    body: String,
}

/// Text safe inside HTML and SVG.
pub(super) fn escape(s: &str) -> String {
    s.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

impl Page {
    /// An empty page.
    pub fn new(title: &str) -> Page {
        Page { title: title.into(), body: String::new() }
    }

    /// The sentence a reader should take away.
    pub fn sentence(mut self, text: &str) -> Page {
        self.body += &format!("{LEAD}{}</p>\n", escape(text));
        self
    }

    /// A heading.
    pub fn section(mut self, text: &str) -> Page {
        self.body += &format!("<h2>{}</h2>\n", escape(text));
        self
    }

    /// A paragraph.
    pub fn paragraph(mut self, text: &str) -> Page {
        self.body += &format!("<p>{}</p>\n", escape(text));
        self
    }

    /// A table.
    pub fn table(mut self, head: &[&str], rows: &[Vec<String>]) -> Page {
        self.body += "<table><tr>";
        for h in head {
            self.body += &format!("<th>{}</th>", escape(h));
        }
        self.body += "</tr>\n";
        for r in rows {
            self.body += "<tr>";
            for c in r {
                self.body += &format!("<td>{}</td>", escape(c));
            }
            self.body += "</tr>\n";
        }
        self.body += "</table>\n";
        self
    }

    /// A picture with its caption.
    pub fn figure(mut self, svg: &str, caption: &str) -> Page {
        if !svg.is_empty() {
            self.body += &format!("<figure>{svg}<figcaption>{}</figcaption></figure>\n", escape(caption));
        }
        self
    }

    /// A command as typed.
    pub fn code(mut self, text: &str) -> Page {
        self.body += &format!("<pre>{}</pre>\n", escape(text));
        self
    }

    /// A link to another file.
    pub fn link(mut self, to: &str, text: &str) -> Page {
        self.body += &format!("<p><a href=\"{}\">{}</a></p>\n", escape(to), escape(text));
        self
    }

    /// What `inner` holds, folded away until a reader opens it.
    pub fn folded(mut self, title: &str, inner: impl FnOnce(Page) -> Page) -> Page {
        let part = inner(Page { title: String::new(), body: String::new() });
        self.body += &format!("<details><summary>{}</summary>\n{}</details>\n", escape(title), part.body);
        self
    }

    /// The whole page.
    pub fn html(&self) -> String {
        format!(
            "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><title>{t}</title>\n<style>\
             body{{font:14px/1.45 sans-serif;max-width:1320px;margin:1.2em auto;padding:0 1em;color:#222}}\
             h1{{font-size:1.3em;margin:.3em 0}}h2{{font-size:1.1em;margin:1.1em 0 .3em}}p{{margin:.3em 0;max-width:75em}}\
             .lead{{font-size:1.25em;border-left:4px solid #1e50c8;padding-left:.7em}}\
             table{{border-collapse:collapse}}td,th{{border:1px solid #ccc;padding:.25em .6em;text-align:left}}\
             figure{{display:inline-block;margin:.2em}}pre{{background:#f4f4f4;padding:.4em .7em;overflow:auto}}summary{{cursor:pointer;color:#1e50c8;margin:.4em 0}}\
             figcaption{{font-size:.85em;color:#555}}</style></head>\n\
             <body><h1>{t}</h1>\n{b}</body></html>\n",
            t = escape(&self.title),
            b = self.body
        )
    }
}

/// What `html` has between `start` and `end`, first time.
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

/// The first picture of a page of ours, SVG.
pub fn picture(html: &str) -> Option<&str> {
    between(html, "<figure>", "<figcaption>")?.strip_prefix("<figure>")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sentence_and_picture_are_found_again() {
        let page = Page::new("t")
            .paragraph("p")
            .sentence("a < \"b\" & c")
            .figure("<svg>1</svg>", "x")
            .figure("<svg>2</svg>", "y");
        let h = page.html();
        assert_eq!(lead(&h).as_deref(), Some("a < \"b\" & c"));
        assert_eq!(picture(&h), Some("<svg>1</svg>"));
        assert_eq!((lead("<p>none</p>"), picture("")), (None, None));
    }

    #[test]
    fn what_a_user_names_cannot_break_the_page() {
        let h = Page::new("<b>").paragraph("a<script>").table(&["x"], &[vec!["<td>".into()]]).html();
        assert!(!h.contains("<script>") && h.contains("&lt;td&gt;") && h.contains("<title>&lt;b&gt;</title>"));
    }
}
