//! The card on top of a diagnosis: what is wrong, how sure that is, what it does, what to do next.

use super::page::{safe_text, tight, LEAD};

/// A cause and its probability.
pub struct Chance {
    pub name: String,
    /// 0 to 1.
    pub probability: f64,
    /// As it is said, for example `above 0.99`.
    pub said: String,
}

/// What something does to figures, in words: (figure, change).
pub struct Effects {
    /// What does it; empty where there is one only.
    pub of: String,
    pub changes: Vec<(&'static str, String)>,
}

/// The card; what is empty is left out.
pub struct Card {
    /// What is wrong, in one sentence.
    pub wrong: String,
    /// More of it, a paragraph each.
    pub detail: Vec<String>,
    pub chances: Vec<Chance>,
    /// How sure that is, in words, a paragraph each.
    pub sure: Vec<String>,
    pub effects: Vec<Effects>,
    /// What it does, in words, a paragraph each.
    pub does: Vec<String>,
    /// What to do next, a step each.
    pub next: Vec<String>,
}

/// The card's first and last tag, for who takes it to another page.
pub(super) const OPEN: &str = "<section class=\"card\" aria-label=\"Finding\">";
pub(super) const CLOSE: &str = "</section>";

impl Card {
    pub(super) fn html(&self) -> String {
        let mut s = format!("{OPEN}\n{LEAD}{}</p>\n{}<dl>", safe_text(&self.wrong), paragraphs(&self.detail));
        let sure = self.chances() + &paragraphs(&self.sure);
        let does = self.effects() + &paragraphs(&self.does);
        for (name, inner) in [("How sure", sure), ("What it does", does), ("What to do next", self.next())] {
            if !inner.is_empty() {
                s += &format!("<div><dt>{name}</dt><dd>{inner}</dd></div>\n");
            }
        }
        tight(&s) + "</dl>" + CLOSE + "\n"
    }

    fn chances(&self) -> String {
        let row = |c: &Chance| {
            let share = if c.probability.is_nan() { 0.0 } else { 100.0 * c.probability.clamp(0.0, 1.0) };
            format!(
                "<li><span class=\"said\">{}</span><span class=\"bar\" aria-hidden=\"true\"><i style=\"width:{share:.1}%\"></i>\
                 </span><span>{}</span></li>",
                safe_text(&c.said),
                safe_text(&c.name)
            )
        };
        let rows: String = self.chances.iter().map(row).collect();
        if rows.is_empty() {
            rows
        } else {
            format!("<ul class=\"chances\">{rows}</ul>")
        }
    }

    fn effects(&self) -> String {
        let one = |e: &Effects| {
            let name = if e.of.is_empty() { String::new() } else { format!("<p>{}</p>", safe_text(&e.of)) };
            let change = |(what, by): &(&str, String)| {
                format!("<li><b>{}</b><span>{}</span></li>", safe_text(by), safe_text(what))
            };
            let changes: String = e.changes.iter().map(change).collect();
            format!("{name}<ul class=\"effects\">{changes}</ul>")
        };
        self.effects.iter().filter(|e| !e.changes.is_empty()).map(one).collect()
    }

    fn next(&self) -> String {
        let steps: String = self.next.iter().map(|n| format!("<li>{}</li>", safe_text(n))).collect();
        if steps.is_empty() {
            steps
        } else {
            format!("<ol class=\"next\">{steps}</ol>")
        }
    }
}

fn paragraphs(all: &[String]) -> String {
    all.iter().map(|t| format!("<p>{}</p>", safe_text(t))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_card_says_it_in_order_and_leaves_out_what_it_has_not() {
        let card = |next: Vec<String>| Card {
            wrong: "It leaves out <friction>.".into(),
            detail: vec!["the guide rubs".into()],
            chances: vec![Chance { name: "friction".into(), probability: 0.8, said: "0.80".into() }],
            sure: vec![],
            effects: vec![Effects { of: String::new(), changes: vec![("peak force", "+1.2 %".into())] }],
            does: vec![],
            next,
        };
        let html = card(vec!["add it".into()]).html();
        let at: Vec<usize> =
            ["&lt;friction&gt;", "How sure", "0.80", "What it does", "+1.2\u{a0}%", "What to do next", "add it"]
                .map(|t| html.find(t).unwrap())
                .to_vec();
        assert!(at.windows(2).all(|w| w[0] < w[1]), "{at:?}");
        assert!(!card(vec![]).html().contains("What to do next"));
    }
}
