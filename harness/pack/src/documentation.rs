//! The pages inside an FMU: the model's texts in the style of touchdown's other pages, one file each, without a script.

use super::{generate, Label};
use anyhow::{Context, Result};
use chart::{Chart, Page, Style};
use law::Parameters;
use mechanisms::physics::Physics;
use plant::setup::Setup;
use plant::simulate::{simulate, Local};

/// Where the loop of the law as packed goes.
const LOOP: &str = "<!-- the loop of the law as packed -->\n";
/// Speeds at touch that are drawn where none are given, m/s.
const SPEEDS: [f64; 3] = [0.5, 1.0, 2.0];
/// Steps of a drawn contact, about, and at most.
const STEPS: f64 = 400.0;
const MOST: usize = 20_000;

/// A page of a model, styled.
///
/// # Errors
/// A text without a heading.
pub(super) fn plain(text: &str) -> Result<String> {
    page(text, None, None)
}

/// The element's page with the values it is packed with: start values, its loop, and what `label` holds.
///
/// # Errors
/// A text without a heading, or without a passage that is written from the parts.
pub(super) fn contact(text: &str, law: &Parameters, mass: f64, label: &Label) -> Result<String> {
    let value = |p: &law::part::Parameter| (p.get)(law);
    let text = generate::documentation(text, &value)?;
    let speeds = if label.speeds.is_empty() { &SPEEDS[..] } else { &label.speeds };
    let mut chart = Chart::new("One impact of the element as packed", "penetration [m]", "force [N]").size(620, 360);
    for (i, speed) in speeds.iter().enumerate() {
        let impact = Impact::of(law, mass, *speed);
        let rebound = impact.rebound.map_or(String::new(), |v| format!(": restitution {:.3}", v / speed));
        let name = format!("{}{rebound}", chart::quantity(*speed, "m/s"));
        chart = chart.curve(&name, &impact.penetration, &impact.force, &impact.time, Style::Line(i));
    }
    let caption = format!("A free body of {} from touch on; the loop is the energy lost.", chart::quantity(mass, "kg"));
    page(&text, label.page.clone(), Some((&chart, &caption)))
}

/// `text` under its heading as a page: before it `first`, with `picture`; without, the picture stands where the text
/// has a place for it.
fn page(text: &str, first: Option<Page>, picture: Option<(&Chart, &str)>) -> Result<String> {
    let inside = |from: &str, to: &str| text.split_once(from).and_then(|(_, rest)| rest.split_once(to));
    let (title, rest) = inside("<h1>", "</h1>").context("a page of the model has no heading")?;
    // what is wider than the page scrolls by itself
    let scroll = "<div class=\"scroll\" tabindex=\"0\" role=\"region\" aria-label=\"Table\"><table>";
    let rest = rest.replace("<table>", scroll).replace("</table>", "</table></div>");
    let mut chapters = rest.split("</body>").next().unwrap_or_default().split("<h2>");
    let drawn = |page: Page| picture.iter().fold(page, |p, (chart, caption)| p.chart(chart, caption));
    let is_first = first.is_some();
    let mut page = Page::new(title).still();
    if let Some(first) = first {
        page = page.then(drawn(first)).section(title);
    }
    page = page.passage(chapters.next().unwrap_or_default());
    for chapter in chapters {
        let (heading, rest) = chapter.split_once("</h2>").context("a heading of a page of the model has no end")?;
        page = page.section(heading);
        page = match rest.split_once(LOOP) {
            Some((before, after)) if is_first => page.passage(before).passage(after),
            Some((before, after)) => drawn(page.passage(before)).passage(after),
            None => page.passage(rest),
        };
    }
    Ok(page.html())
}

/// A free body's impact on the law.
struct Impact {
    /// s
    time: Vec<f64>,
    /// m
    penetration: Vec<f64>,
    /// N
    force: Vec<f64>,
    /// Speed of leaving, m/s; None where the body does not leave.
    rebound: Option<f64>,
}

impl Impact {
    /// Of `mass` kg at `speed` m/s, as a drop test without weight has it, until the body has left.
    fn of(law: &Parameters, mass: f64, speed: f64) -> Impact {
        // recommended_step gives a contact 20 steps
        let contact = 20.0 * law.recommended_step(mass, speed, 0.0);
        let time: Vec<f64> = (0..MOST).map(|i| contact * i as f64 / STEPS).collect();
        let physics = Physics { law: *law, mass, ..Physics::default() };
        let setup = Setup::drop_test(time, 0.5 * speed * contact, speed, contact);
        let trace = simulate(&physics, &setup, &Local { start: 0.0, speed, stiffness: 0.0, offset: 0.0 });
        let left = trace.position.iter().position(|x| *x < 0.0);
        let drawn = left.map_or(MOST, |i| i + 1);
        Impact {
            time: setup.time[..drawn].to_vec(),
            penetration: trace.position[..drawn].to_vec(),
            force: trace.force[..drawn].to_vec(),
            rebound: left.map(|i| -trace.velocity[i]),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_drawn_impact_is_the_exact_one() {
        let (k, p, mu) = (3.51e10, 2.79, 2.70e10);
        let drawn = Impact::of(&Parameters::power_law(k, p, mu), 1.0, 1.0);
        let exact = law::impact::impact(1.0, 1.0, k, p, mu).unwrap();
        let top = |y: &[f64]| y.iter().fold(0.0f64, |a, b| a.max(*b));
        assert!((drawn.rebound.unwrap() / exact.restitution - 1.0).abs() < 1e-3);
        assert!((top(&drawn.penetration) / exact.deepest - 1.0).abs() < 1e-3);
        assert!((top(&drawn.force) / exact.peak_force - 1.0).abs() < 1e-3);
    }

    #[test]
    fn a_page_has_our_style_the_values_packed_their_loop_and_no_script() {
        let mut law = Parameters::power_law(2.5e9, 1.7, 3e8);
        law.adhesion.form = 4;
        let page = Page::new("").section("What was found").paragraph("a pull");
        let label = Label { page: Some(page), speeds: vec![0.25], ..Label::default() };
        let html = contact(crate::PAGE, &law, 0.3, &label).unwrap();
        for wanted in
            ["<td>2.5e9</td>", "<td>growing</td>", "0.2500 m/s: restitution", "What was found", "@media print", "<svg"]
        {
            assert!(html.contains(wanted), "{wanted}: {html}");
        }
        for refused in ["<script", LOOP.trim_end(), "http://", "src="] {
            assert!(!html.replace("http://www.w3.org/2000/svg", "").contains(refused), "{refused}");
        }
        assert!(plain("<p>no heading</p>").is_err());
    }
}
