//! What an estimation leaves behind: fit.json, certificate.json and report.html.

use crate::trace::{self, Made};
use chart::{alike, dashed, Chart, Datum, Page, Style};
use diagnose::verdict::Input;
use estimate::case::{Case, Estimate, Interval, Method, CLOSE};
use estimate::levels::{name as name_of, nrmse, Level, Readings};
use record::{pulse, Campaign, Channel, Kind};
use serde_json::{json, Map, Value};
use std::path::Path;

/// Everything the files show.
pub struct Answer<'a> {
    pub campaign: &'a Campaign,
    pub case: &'a Case,
    pub estimate: &'a Estimate,
    /// Readings at the start and at the end.
    pub initial: Readings,
    pub last: Readings,
    pub levels: Vec<Level>,
    pub made: &'a Made,
    /// Files that were read.
    pub inputs: &'a [Input],
}

const LAW: [(&str, &str); 3] = [("k", "N/m^p"), ("p", "1"), ("mu_d", "N s/m^(p+1)")];

/// What is not finite becomes null in JSON anyway; said here so that it is meant.
fn bounds(i: &Interval) -> Value {
    if i.low.is_finite() && i.high.is_finite() {
        json!([i.low, i.high])
    } else {
        Value::Null
    }
}

impl Answer<'_> {
    /// fit.json: k N/m^p, p, mu_d N s/m^(p+1); an interval that is not finite is null.
    pub fn json(&self) -> Value {
        let e = self.estimate;
        let data = &self.case.data;
        let law = e.law(self.case);
        let (mut parameters, mut ci) = (Map::new(), Map::new());
        for ((name, _), i) in LAW.iter().zip(&law) {
            parameters.insert(name.to_string(), json!(i.value));
            ci.insert(name.to_string(), bounds(i));
        }
        let mut shares = Map::new();
        for (r, rec) in data.records.iter().enumerate() {
            let mut of = Map::new();
            for c in data.compared(r) {
                let share = rec.y[c.index()].as_ref().and_then(|m| nrmse(m, &self.last[r][c.index()]));
                of.insert(c.name().into(), json!(share));
            }
            shares.insert(rec.file.clone(), Value::Object(of));
        }
        json!({
            "parameters": parameters,
            "ci95": ci,
            "converged": e.converged,
            "iterations": e.iterations,
            "objective": e.objective,
            "nrmse": shares,
        })
    }

    /// certificate.json: why the answer may be believed or not, the terms beyond the law, and each level.
    pub fn certificate(&self) -> Value {
        let e = self.estimate;
        let terms: Map<String, Value> = e
            .terms(self.case)
            .into_iter()
            .map(|(name, unit, i)| (name, json!({"value": i.value, "unit": unit, "ci95": bounds(&i)})))
            .collect();
        let reference = e.reference_force();
        json!({
            "campaign": self.campaign.folder,
            "method": match e.method { Method::Simplex => "simplex", Method::LevenbergMarquardt => "lm" },
            "converged": e.converged,
            "stopped": e.stopped.map(|s| s.to_string()),
            "held": if self.case.hysteresis() { vec![] } else { vec!["mu_d"] },
            "at_bounds": e.bounds,
            "terms": terms,
            "reference": {"depth": self.case.data.scales.x_ref, "force": reference.value, "ci95": bounds(&reference)},
            "gradient_in_standard_errors": e.gradient,
            "least_rise_when_probed": e.rise,
            "variance_widened_by": e.widening,
            "starts": e.runs.iter().map(|r| json!({
                "origin": r.origin, "objective_first": r.first, "objective_last": r.last,
                "iterations": r.iterations, "distance_in_standard_errors": r.distance,
            })).collect::<Vec<_>>(),
            "levels": self.levels.iter().map(|l| json!({
                "level": l.text, "recordings": l.recordings,
                "nrmse": by_channel(&l.nrmse), "rms_over_noise": by_channel(&l.noises), "peak_error": by_channel(&l.peak),
                "alone": l.alone.map(|a| json!({"force_at_reference_depth": a.0, "p": a.1, "nrmse": a.2})),
            })).collect::<Vec<_>>(),
        })
    }

    /// The sentence to take away.
    pub fn sentence(&self) -> String {
        let e = self.estimate;
        let [k, p, mu] = e.law(self.case).map(|i| i.value);
        let end = match (e.converged, e.stopped) {
            (true, _) => format!("converged after {} iterations", e.iterations),
            (_, Some(why)) => format!("not converged: {why} after {} iterations", e.iterations),
            _ => format!("not converged after {} iterations: see the certificate", e.iterations),
        };
        dashed(&format!(
            "k = {k:.4e} N/m^p, p = {p:.4}, mu_d = {mu:.4e} N s/m^(p+1); misfit {:.2} % of range; {end}.",
            100.0 * self.misfit()
        ))
    }

    /// How far the law is from each level, a line each.
    pub fn by_level(&self) -> String {
        let mut out = String::new();
        for l in &self.levels {
            out += &format!("level {}:", l.text);
            for c in self.channels() {
                let i = c.index();
                if let (Some(n), Some(s), Some(p)) = (l.nrmse[i], l.noises[i], l.peak[i]) {
                    out += &format!(
                        " {} off by {:.2} % of range ({s:.1} noise), peak by {:+.2} %;",
                        c.name(),
                        100.0 * n,
                        100.0 * p
                    );
                }
            }
            if let Some((_, p, m)) = l.alone {
                out += &format!(" alone {:.2} % with p = {p:.3}", 100.0 * m);
            }
            out = out.trim_end_matches(';').to_string() + "\n";
        }
        dashed(&out)
    }

    /// Mean nrmse over recordings and channels.
    pub fn misfit(&self) -> f64 {
        let data = &self.case.data;
        let all: Vec<f64> = (0..data.records.len())
            .flat_map(|r| {
                data.compared(r).filter_map(move |c| {
                    data.records[r].y[c.index()].as_ref().and_then(|m| nrmse(m, &self.last[r][c.index()]))
                })
            })
            .collect();
        all.iter().sum::<f64>() / all.len().max(1) as f64
    }

    /// report.html.
    pub fn page(&self) -> String {
        let e = self.estimate;
        let data = &self.case.data;
        let long = |v: f64, unit: &str| Datum::said(v, unit, &format!("{v:.5e}"));
        let row = |name: &str, unit: &str, i: &Interval, first: Option<f64>| {
            let start = first.map_or("".into(), |f| long(f, unit));
            let ends = [i.low, i.high].map(|v| long(v, unit));
            let [low, high] = ends;
            vec![name.into(), unit.into(), start, long(i.value, unit), low, high]
        };
        let first = Estimate::law_at(self.case, &e.start.theta);
        let mut rows: Vec<Vec<Datum>> = LAW
            .iter()
            .zip(&e.law(self.case))
            .zip(first)
            .filter(|((l, _), _)| l.0 != "mu_d" || self.case.hysteresis())
            .map(|(((name, unit), i), f)| row(name, unit, i, Some(f)))
            .collect();
        let r = e.reference_force();
        rows.push(row(&format!("force at {:.3e} m", data.scales.x_ref), "N", &r, Some(e.start.theta[0].exp())));
        for (name, unit, i) in e.terms(self.case) {
            rows.push(row(&name, unit, &i, None));
        }
        let runs: Vec<Vec<Datum>> = e
            .runs
            .iter()
            .map(|r| {
                let far = if r.distance.is_nan() { "not followed".into() } else { Datum::fixed(r.distance, 3) };
                let of = |v: f64| Datum::said(v, "1", &format!("{v:.6e}"));
                vec![r.origin.into(), of(r.first), of(r.last), r.iterations.to_string().into(), far]
            })
            .collect();
        let n: Vec<f64> = (0..e.objective.len()).map(|i| i as f64).collect();
        let fall: Vec<f64> = e.objective.iter().map(|v| v.log10()).collect();
        let chart = Chart::new("", "iteration", "log10 of the objective");
        let mut page = Page::new(&format!("Fit of {}", self.campaign.name))
            .sentence(&self.sentence())
            .values(&["parameter", "unit", "start", "estimate", "95 %, from", "to"], &rows)
            .section("Initial and final curves")
            .paragraph("One recording a level. Grey: measured. Red: the start. Blue: the estimate.");
        let (charts, captions): (Vec<Chart>, Vec<String>) = self.curves().into_iter().unzip();
        for (chart, caption) in alike(charts).iter().zip(captions) {
            page = page.chart(chart, &caption);
        }
        page = page
            .section("Objective by iteration")
            .chart(&chart.series(name(e.method), &n, &fall, Style::After), "Sum of squared whitened residuals and priors")
            .section("Certificate")
            .paragraph(&format!(
                "Steps of {CLOSE} standard errors both ways along every principal axis raise the objective by {:.3} or more, in units of the misfit's overdispersion; a parabola rises by {:.3}. The gradient is {:.3} standard errors long. Variances are widened {:.2} times for overdispersion. Starts:",
                e.rise, CLOSE * CLOSE, e.gradient, e.widening
            ))
            .paragraph(&if e.bounds.is_empty() {
                "No parameter rests at a bound.".to_string()
            } else {
                format!("At a bound, so that its interval has one side only: {}.", e.bounds.join(", "))
            })
            .values(&["start", "objective, first", "objective, last", "iterations", "distance, standard errors"], &runs)
            .section("Level by level: how far the law alone is")
            .paragraph("Misfit: rms over range, and in standard deviations of the noise. Peak: simulated over measured, less 1. The last columns hold the law fitted to the level alone: where they drift from level to level, the law lacks something.")
            .values(&self.level_head(), &self.level_rows());
        page.trace(&trace::rows(self.made, &trace::of_campaign(self.campaign, self.inputs))).html()
    }

    /// Writes the files to `dir`, all of them or none.
    ///
    /// # Errors
    /// As the file system gives them.
    pub fn write(&self, dir: &Path) -> std::io::Result<output::Committed> {
        let text =
            |v: &Value| Ok::<_, std::io::Error>(serde_json::to_string_pretty(v).map_err(std::io::Error::other)? + "\n");
        let answer = output::Answer::begin(dir, "fit")?;
        answer.write("report.html", self.page().as_bytes())?;
        answer.write("certificate.json", text(&self.certificate())?.as_bytes())?;
        answer.write("fit.json", text(&self.json())?.as_bytes())?;
        answer.commit()
    }

    fn channels(&self) -> Vec<Channel> {
        Channel::ALL.into_iter().filter(|c| self.levels.iter().any(|l| l.nrmse[c.index()].is_some())).collect()
    }

    fn level_head(&self) -> Vec<&'static str> {
        let mut head = vec!["level", "recordings"];
        for c in self.channels() {
            head.extend([c.name(), "over noise", "peak"]);
        }
        head.extend(["alone: force at reference depth", "alone: p", "alone: misfit"]);
        head
    }

    fn level_rows(&self) -> Vec<Vec<Datum>> {
        let percent = |v: Option<f64>| v.map_or("-".into(), |v| Datum::percent(v, 2));
        self.levels
            .iter()
            .map(|l| {
                let mut row: Vec<Datum> = vec![l.text.clone().into(), l.recordings.to_string().into()];
                for c in self.channels() {
                    let i = c.index();
                    row.push(percent(l.nrmse[i]));
                    row.push(l.noises[i].map_or("-".into(), |v| Datum::fixed(v, 1)));
                    row.push(percent(l.peak[i]));
                }
                match l.alone {
                    Some((f, p, m)) => row.extend([Datum::number(f, "N"), Datum::fixed(p, 3), percent(Some(m))]),
                    None => row.extend(["-".into(), "-".into(), "-".into()]),
                }
                row
            })
            .collect()
    }

    /// (chart, caption): the first recording of every level, each channel; an indentation against its depth.
    fn curves(&self) -> Vec<(Chart, String)> {
        let data = &self.case.data;
        let mut seen = Vec::new();
        let mut out = Vec::new();
        for (r, rec) in data.records.iter().enumerate() {
            if seen.contains(&rec.level) || seen.len() >= MOST_LEVELS {
                continue;
            }
            seen.push(rec.level);
            let level = name_of(self.campaign, rec.level);
            for c in data.compared(r) {
                let i = c.index();
                let Some(y) = &rec.y[i] else { continue };
                let indentation = data.kind == Kind::Indentation;
                let (x, axis) =
                    if indentation { (&rec.setup.imposed, "penetration [m]") } else { (&rec.setup.time, "time [s]") };
                let unit = ["force [N]", "acceleration [m/s^2]", "penetration [m]"][i];
                let mut chart = Chart::new(&rec.file, axis, unit).series("measured", x, y, Style::Measured);
                let read = [0, 1].iter().find_map(|i| rec.y[*i].as_ref());
                if let Some((first, last)) = read.filter(|_| !indentation).and_then(|y| pulse(x, y)) {
                    let around = AROUND * (last - first);
                    chart = chart.focus((first - around).max(x[0]), (last + around).min(x[x.len() - 1]));
                }
                if !self.initial[r][i].is_empty() {
                    chart = chart.series("initial", x, &self.initial[r][i], Style::Before);
                }
                if !self.last[r][i].is_empty() {
                    chart = chart.series("final", x, &self.last[r][i], Style::After);
                }
                out.push((chart, format!("{}, level {level}", c.name())));
            }
        }
        out
    }
}

/// Share of the pulse shown on either side of it.
const AROUND: f64 = 0.4;
/// Levels drawn at most.
const MOST_LEVELS: usize = 8;

fn name(m: Method) -> &'static str {
    match m {
        Method::Simplex => "simplex",
        Method::LevenbergMarquardt => "Levenberg-Marquardt",
    }
}

fn by_channel(v: &[Option<f64>; 3]) -> Value {
    Value::Object(Channel::ALL.iter().filter_map(|c| v[c.index()].map(|x| (c.name().to_string(), json!(x)))).collect())
}
