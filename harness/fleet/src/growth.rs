//! What grows with a column, or differs between its values: over all campaigns of a fleet, false discoveries held.

use crate::answers::{Fleet, Judged};
use crate::statistics::{differs, discoveries, follows, slope, spearman};
use rayon::prelude::*;
use record::Label;
use serde::Serialize;
use std::collections::{BTreeMap, BTreeSet};

/// Campaigns that a comparison needs at least: with fewer no order of them is rare enough.
const FEWEST: usize = 6;
/// Share of the comparisons called discoveries that may be false in the mean.
pub const LEVEL: f64 = 0.05;

/// What of a mechanism is compared.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Figure {
    /// Probability that it is missing, in every campaign judged.
    Probability,
    /// Largest change that it makes to peak force, restitution, contact time or depth, in the campaigns that name it.
    Size,
    /// A parameter of it, in the campaigns that name it.
    Parameter(String),
}

/// One comparison of a mechanism's figure with a column.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Growth {
    pub column: String,
    pub mechanism: String,
    pub figure: Figure,
    /// Unit of the figure; 1 of probabilities and sizes.
    pub unit: String,
    /// Campaigns compared.
    pub campaigns: usize,
    /// Rank correlation with a column of numbers, -1 to 1.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub correlation: Option<f64>,
    /// Median slope, unit of the figure over that of the column.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub slope: Option<f64>,
    /// Where the figure is least and where it is most: of numbers the lowest third and the highest, in the column's order; of
    /// texts the values with the least mean and the most.
    pub from: End,
    pub to: End,
    /// Probability that campaigns in any order look so, and the least false discovery rate at which it is a discovery.
    pub p: f64,
    pub q: f64,
}

/// Campaigns at one end of a column, and the mean of their figures.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct End {
    pub of: String,
    pub mean: f64,
}

/// All comparisons, the surest first.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Growths {
    pub level: f64,
    pub all: Vec<Growth>,
}

impl Growths {
    /// Those that hold at the level.
    pub fn discoveries(&self) -> impl Iterator<Item = &Growth> {
        self.all.iter().filter(|g| g.q <= self.level)
    }
}

/// Points to compare: of each campaign the column's value and the figure.
struct Comparison {
    column: String,
    mechanism: String,
    figure: Figure,
    unit: String,
    points: Vec<(Label, f64)>,
}

/// The value of a column and the figure of every campaign that has both, in the order of the fleet's names.
pub fn points(fleet: &Fleet, column: &str, mechanism: &str, figure: &Figure) -> Vec<(Label, f64)> {
    let of = |j: &Judged| {
        let named = || j.missing.iter().find(|m| m.mechanism == mechanism);
        match figure {
            Figure::Probability => Some(j.probability_of(mechanism)),
            Figure::Size => named()?.size,
            Figure::Parameter(name) => named()?.parameters.iter().find(|p| p.0 == *name).map(|p| p.1),
        }
    };
    let mut all: Vec<(&str, Label, f64)> = fleet
        .judged()
        .filter_map(|(a, j)| Some((a.campaign.as_str(), a.columns.get(column)?.clone(), of(j)?)))
        .collect();
    // not by what matters: permutations are drawn from this order
    all.sort_by(|a, b| a.0.cmp(b.0));
    all.into_iter().map(|(_, l, v)| (l, v)).collect()
}

/// Compares every figure of every mechanism that a campaign names with every column, false discoveries held at [`LEVEL`]. What is
/// never more likely than not is not compared: the probabilities of a campaign add up to one, so that all others fall where one
/// grows.
pub fn growths(fleet: &Fleet) -> Growths {
    let parameters = parameters(fleet);
    let named = fleet.judged().flat_map(|(_, j)| j.missing.iter().map(|m| m.mechanism.clone()));
    let named: BTreeSet<String> = named.collect();
    let mut comparisons = Vec::new();
    for column in fleet.columns() {
        for mechanism in &named {
            let of_parameters = parameters.iter().filter(|p| p.0 .0 == *mechanism);
            let of_parameters = of_parameters.map(|((_, p), unit)| (Figure::Parameter(p.clone()), unit.clone()));
            let figures = [Figure::Probability, Figure::Size].map(|f| (f, "1".to_string()));
            for (figure, unit) in figures.into_iter().chain(of_parameters) {
                let points = points(fleet, &column, mechanism, &figure);
                let (column, mechanism) = (column.clone(), mechanism.clone());
                comparisons.push(Comparison { column, mechanism, figure, unit, points });
            }
        }
    }
    let found: Vec<Option<Growth>> =
        comparisons.into_par_iter().enumerate().map(|(i, c)| compared(c, 1 + i as u64)).collect();
    let mut all: Vec<Growth> = found.into_iter().flatten().collect();
    let q = discoveries(&all.iter().map(|g| g.p).collect::<Vec<_>>());
    all.iter_mut().zip(q).for_each(|(g, q)| g.q = q);
    all.sort_by(|a, b| a.q.total_cmp(&b.q).then(a.p.total_cmp(&b.p)));
    Growths { level: LEVEL, all }
}

/// Mechanisms and parameters estimated anywhere, with their units; those whose unit is not the same everywhere are none.
fn parameters(fleet: &Fleet) -> BTreeMap<(String, String), String> {
    let mut units: BTreeMap<(String, String), Option<String>> = BTreeMap::new();
    for m in fleet.judged().flat_map(|(_, j)| &j.missing) {
        for (name, _, unit) in &m.parameters {
            let of = units.entry((m.mechanism.clone(), name.clone())).or_insert_with(|| Some(unit.clone()));
            if of.as_ref().is_some_and(|u| u != unit) {
                *of = None;
            }
        }
    }
    units.into_iter().filter_map(|(k, unit)| Some((k, unit?))).collect()
}

fn mean(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, n) = values.fold((0.0, 0.0), |(s, n), v| (s + v, n + 1.0));
    sum / n
}

/// The comparison; None where there are too few campaigns, or all have the same value.
fn compared(c: Comparison, seed: u64) -> Option<Growth> {
    let figures: Vec<f64> = c.points.iter().map(|p| p.1).collect();
    let alike = |v: &[f64]| v.iter().all(|x| *x == v[0]);
    if figures.len() < FEWEST || alike(&figures) {
        return None;
    }
    let numbers: Option<Vec<f64>> = c
        .points
        .iter()
        .map(|p| match p.0 {
            Label::Number(x) => Some(x),
            Label::Text(_) => None,
        })
        .collect();
    let (correlation, of_slope, from, to, p) = match numbers {
        Some(x) => {
            if alike(&x) {
                return None;
            }
            let (from, to) = thirds(&x, &figures);
            (Some(spearman(&x, &figures)), slope(&x, &figures), from, to, follows(&x, &figures, seed))
        }
        None => {
            let texts: Vec<String> = c.points.iter().map(|p| text(&p.0)).collect();
            let mut names = texts.clone();
            names.sort();
            names.dedup();
            // where no value comes twice there is nothing to compare
            if names.len() < 2 || names.len() == texts.len() {
                return None;
            }
            let group: Vec<usize> = texts.iter().map(|t| names.binary_search(t).unwrap_or(0)).collect();
            let of = |g: usize| mean(group.iter().zip(&figures).filter(|(k, _)| **k == g).map(|(_, v)| *v));
            let mut ends: Vec<End> =
                names.iter().enumerate().map(|(g, n)| End { of: n.clone(), mean: of(g) }).collect();
            ends.sort_by(|a, b| a.mean.total_cmp(&b.mean));
            let (to, from) = (ends.pop()?, ends.into_iter().next()?);
            (None, None, from, to, differs(&group, &figures, seed))
        }
    };
    let Comparison { column, mechanism, figure, unit, points } = c;
    Some(Growth {
        column,
        mechanism,
        figure,
        unit,
        campaigns: points.len(),
        correlation,
        slope: of_slope,
        from,
        to,
        p,
        q: 1.0,
    })
}

/// A value of a column in words.
pub fn text(label: &Label) -> String {
    match label {
        Label::Number(x) => format!("{x}"),
        Label::Text(s) => s.clone(),
    }
}

/// Means of the figures where x is in its lowest third and in its highest.
fn thirds(x: &[f64], y: &[f64]) -> (End, End) {
    let mut order: Vec<usize> = (0..x.len()).collect();
    order.sort_by(|a, b| x[*a].total_cmp(&x[*b]));
    let third = x.len().div_ceil(3);
    let end = |part: &[usize]| {
        let (low, high) = (x[part[0]], x[part[part.len() - 1]]);
        let of = if low == high { format!("{low}") } else { format!("{low} to {high}") };
        End { of, mean: mean(part.iter().map(|i| y[*i])) }
    };
    (end(&order[..third]), end(&order[x.len() - third..]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::answers::tests::{verdict, write};
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    /// Sixty campaigns in three batches: wear grows with their order, and friction is in batch B alone.
    fn fleet() -> (tempfile::TempDir, Fleet) {
        let t = tempfile::tempdir().unwrap();
        let mut rng = ChaCha8Rng::seed_from_u64(5);
        for i in 0..60 {
            let batch = ["A", "B", "C"][i % 3];
            let missing = match i {
                _ if batch == "B" => Some(("guide_friction", 0.05 + 0.01 * rng.random::<f64>())),
                i if i > 15 => Some(("wear", 0.002 * i as f64 + 0.01 * rng.random::<f64>())),
                _ => None,
            };
            let columns = serde_json::json!({"order": i, "batch": batch, "temperature": 20.0 + rng.random::<f64>(), "serial": format!("n{i}")});
            write(t.path(), &format!("c{i:02}"), &verdict(missing, 0.01, 0.1, columns));
        }
        let f = Fleet::read(&[t.path().to_path_buf()]).unwrap();
        (t, f)
    }

    #[test]
    fn what_grows_is_found_and_nothing_else() {
        let (_t, f) = fleet();
        let g = growths(&f);
        let found = |column: &str, mechanism: &str, figure: Figure| {
            g.discoveries().find(|d| d.column == column && d.mechanism == mechanism && d.figure == figure)
        };
        let wear = found("order", "wear", Figure::Size).expect("wear grows with order");
        assert!(wear.correlation.unwrap() > 0.95 && (wear.slope.unwrap() - 0.002).abs() < 3e-4, "{wear:?}");
        assert!(wear.from.mean < wear.to.mean && wear.campaigns < 60);
        assert!(found("order", "wear", Figure::Parameter("a".into())).is_some());
        assert!(found("order", "wear", Figure::Probability).is_some());
        let friction = found("batch", "guide_friction", Figure::Probability).expect("friction differs between batches");
        assert_eq!((friction.to.of.as_str(), friction.to.mean, friction.from.mean), ("B", 0.9, 0.0));
        assert!(g.discoveries().all(|d| d.column != "temperature" && d.column != "serial"), "{g:?}");
        assert!(g.all.iter().all(|d| d.column != "serial"), "a text that never comes twice is no group");
        assert_eq!(growths(&f), g, "the same fleet shows the same");
    }

    #[test]
    fn of_columns_that_say_nothing_few_are_called_discoveries() {
        let t = tempfile::tempdir().unwrap();
        let mut rng = ChaCha8Rng::seed_from_u64(8);
        for i in 0..40 {
            let columns: BTreeMap<String, f64> = (0..60).map(|k| (format!("x{k}"), rng.random::<f64>())).collect();
            let missing = (rng.random::<f64>() < 0.5).then_some(("wear", rng.random::<f64>()));
            write(t.path(), &format!("c{i:02}"), &verdict(missing, 0.01, 0.1, serde_json::json!(columns)));
        }
        let g = growths(&Fleet::read(&[t.path().to_path_buf()]).unwrap());
        assert!(g.all.len() >= 120, "{}", g.all.len());
        assert!(g.all.iter().any(|d| d.p < 0.05), "by chance some are below 0.05");
        assert_eq!(g.discoveries().count(), 0);
    }
}
