//! The evidence of a structure, with a discrepancy of every size in the likelihood; and that of a cause in no vocabulary.

use estimate::discrepancy::{Disturbance, Disturbed};
use estimate::evidence::{Evidence, Reduced};
use estimate::fitted::Fitted;
use estimate::flat::flat_top;
use estimate::problem::Data;
use estimate::response::Place;
use rayon::prelude::*;

/// Sizes of the discrepancy that all recordings share, as a share of force and readings.
pub const SIZES: [f64; 6] = [0.0, 0.001, 0.003, 0.01, 0.03, 0.1];
/// Size of a discrepancy from which on it is no small print, share of force.
pub const LARGE: f64 = 0.03;
/// Sizes of what each recording has of its own, where the cause is in no vocabulary.
pub const OWN_SIZES: [f64; 4] = [0.01, 0.03, 0.1, 0.3];
/// Sizes of the shared discrepancy beside it.
const SHARED_BESIDE: [f64; 2] = [0.0, 0.01];

/// A structure, weighed.
#[derive(Clone, Debug, PartialEq)]
pub struct Weighed {
    pub names: Vec<&'static str>,
    pub forms: Vec<&'static str>,
    /// False where a term stands in for physics that nobody has named.
    pub named: bool,
    /// Parameters of the mechanisms added.
    pub parameters: usize,
    pub chi2: f64,
    /// ln evidence by [`SIZES`], of instruments that only have noise, and of disturbed ones, every set of
    /// [`Disturbance`] in every channel being as likely; NaN where the normal matrix is singular.
    pub ln: [Vec<f64>; 2],
    /// Overdispersion of the residual, and of what the likeliest discrepancy leaves of it.
    pub overdispersion: f64,
    pub left: f64,
    /// Nats that its fit would still gain, as its linearised equations have it; NaN where the normal matrix is singular.
    pub pending: f64,
    /// Whether a parameter of a mechanism rests at a bound.
    pub at_bound: bool,
    /// Misfit over range on levels its fit did not see, where it was worked out.
    pub heldout: Option<f64>,
}

impl Weighed {
    /// Takes back what its fit was to gain and has not gained, where that is more than `most` nats.
    pub fn forgo_pending(&mut self, most: f64) {
        if self.pending > most {
            self.ln.iter_mut().flatten().for_each(|ln| *ln -= self.pending);
            self.pending = 0.0;
        }
    }

    /// A fit of which no evidence is known.
    pub fn without_evidence(f: &Fitted) -> Weighed {
        Weighed {
            names: f.names(),
            forms: f.structure.terms().iter().map(|t| t.form.label).collect(),
            named: f.is_named(),
            parameters: f.parameters() as usize,
            chi2: f.chi2(),
            overdispersion: f.overdispersion(),
            left: f64::NAN,
            pending: f64::NAN,
            at_bound: !f.at_bounds().is_empty(),
            heldout: None,
            ln: [Vec::new(), Vec::new()],
        }
    }
}

/// A cause outside the vocabulary, beside a structure, weighed.
#[derive(Clone, Debug, PartialEq)]
pub struct Unknown {
    pub beside: Vec<&'static str>,
    pub place: Place,
    /// ln evidence by [`OWN_SIZES`], for each size of the shared discrepancy beside it.
    pub ln: Vec<f64>,
}

/// What a decision is weighed by.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Evidences {
    /// The simulation as given first.
    pub structures: Vec<Weighed>,
    pub unknown: Vec<Unknown>,
    /// Levels of the campaign.
    pub levels: usize,
    /// ln of how much likelier the repeated readings at the top of a channel are at the end of its range than by chance; 0
    /// where no channel ends in a flat top.
    pub flat: f64,
}

impl Evidences {
    /// Nothing weighed yet of the campaign that `base` is fitted to.
    pub fn of(base: &Fitted) -> Evidences {
        let flat = flat_top(&base.data).map_or(0.0, |f| f.nats);
        Evidences { levels: base.data.levels().len(), flat, ..Evidences::default() }
    }

    /// ln of how many times better structure `i` predicts levels not seen than the simulation as given; None where that was
    /// not worked out, and of the simulation itself.
    pub fn better(&self, i: usize) -> Option<f64> {
        let given = self.structures.first()?.heldout?;
        let with = self.structures[i].heldout.filter(|_| i > 0)?;
        (given > 0.0 && with > 0.0).then(|| (given / with).ln())
    }

    /// Index of the named structure with the most evidence of all.
    pub fn most(&self) -> Option<usize> {
        let most = |w: &Weighed| w.ln.iter().flatten().copied().filter(|ln| ln.is_finite()).reduce(f64::max);
        let named = self.structures.iter().enumerate().filter(|(_, w)| w.named);
        named.filter_map(|(i, w)| Some((i, most(w)?))).max_by(|a, b| a.1.total_cmp(&b.1)).map(|of| of.0)
    }

    /// Whether it predicts them worse.
    pub fn is_worse(&self, i: usize) -> bool {
        self.better(i).is_some_and(|b| b < 0.0)
    }
}

/// ln(sum of exp).
pub fn ln_sum(v: &[f64]) -> f64 {
    let top = v.iter().cloned().fold(f64::NEG_INFINITY, f64::max);
    if top.is_finite() {
        top + v.iter().map(|x| (x - top).exp()).sum::<f64>().ln()
    } else {
        top
    }
}

fn finite(v: Option<f64>) -> f64 {
    v.unwrap_or(f64::NAN)
}

/// What is disturbed, with the evidence by [`SIZES`].
struct Set<'a> {
    disturbed: Vec<Disturbed>,
    reduced: Reduced<'a>,
    ln: [f64; SIZES.len()],
}

impl<'a> Set<'a> {
    /// None where the normal matrix is singular at every size.
    fn new(evidence: &'a Evidence<'_>, disturbed: Vec<Disturbed>) -> Option<Set<'a>> {
        let reduced = evidence.beside(None, &disturbed)?;
        let ln = SIZES.map(|size| finite(reduced.ln(size)));
        ln.iter().any(|ln| ln.is_finite()).then_some(Set { disturbed, reduced, ln })
    }

    /// The most evidence, and the size that has it.
    fn most(&self) -> (f64, f64) {
        let of = self.ln.iter().zip(SIZES).filter(|(ln, _)| ln.is_finite()).map(|(ln, size)| (*ln, size));
        of.max_by(|a, b| a.0.total_cmp(&b.0)).unwrap_or((f64::NEG_INFINITY, 0.0))
    }
}

/// The sets of disturbances that hold nearly all of the evidence, none first: each disturbance of each channel alone, then
/// together those that raise it alone, from the one that does most, as long as it rises.
fn sets<'a>(evidence: &'a Evidence<'_>, data: &Data) -> Option<Vec<Set<'a>>> {
    let none = Set::new(evidence, Vec::new())?;
    let single = |d: Disturbed| Set::new(evidence, vec![d]);
    let mut alone: Vec<Set<'a>> = Disturbed::all(data).into_par_iter().filter_map(single).collect();
    alone.sort_by(|a, b| b.most().0.total_cmp(&a.most().0));
    let mut together: Vec<Set<'a>> = Vec::new();
    let best = |together: &[Set<'a>]| together.last().or(alone.first()).map(|s| (s.most().0, s.disturbed.clone()));
    for next in alone.iter().skip(1).filter(|s| s.most().0 > none.most().0) {
        let Some((most, mut disturbed)) = best(&together) else { break };
        let next = next.disturbed[0];
        if disturbed.iter().all(|d| next.goes_with(*d)) {
            disturbed.push(next);
            together.extend(Set::new(evidence, disturbed).filter(|s| s.most().0 > most));
        }
    }
    Some([none].into_iter().chain(alone).chain(together).collect())
}

/// The evidence of one fit; None where it cannot be simulated.
pub fn weighed(f: &Fitted) -> Option<Weighed> {
    let all = Disturbed::all(&f.data);
    let evidence = Evidence::new(f, &[], &all)?;
    let sets = sets(&evidence, &f.data)?;
    let (none, disturbed) = sets.split_first()?;
    let channels = all.len() / Disturbance::ALL.len();
    let possible = Disturbance::sets(channels as u32) as f64 - 1.0;
    // what was not worked out has next to no evidence
    let mean = |size: usize| {
        let of: Vec<f64> = disturbed.iter().map(|s| s.ln[size]).filter(|ln| ln.is_finite()).collect();
        ln_sum(&of) - possible.ln()
    };
    let ln = [none.ln.to_vec(), (0..SIZES.len()).map(mean).collect()];
    let likeliest = sets.iter().max_by(|a, b| a.most().0.total_cmp(&b.most().0))?;
    let left = likeliest.reduced.overdispersion(likeliest.most().1);
    let pending = finite(none.reduced.pending());
    Some(Weighed { left: finite(left), pending, ln, ..Weighed::without_evidence(f) })
}

/// ln of the evidence of a fit where what it leaves is noise, and the nats that the fit would still gain, which count as gained; None
/// where it cannot be simulated, or its normal matrix is singular.
pub fn of_noise(f: &Fitted) -> Option<(f64, f64)> {
    let evidence = Evidence::of_noise(f)?;
    let reduced = evidence.beside(None, &[])?;
    Some((reduced.ln(0.0)?, reduced.pending()?))
}

/// The evidence of a cause in no vocabulary beside `f`, by the place at which it enters.
pub fn unknown(f: &Fitted) -> Vec<Unknown> {
    let places = Place::all(&f.data);
    let Some(evidence) = Evidence::new(f, &places, &[]) else { return Vec::new() };
    let at = |(i, place): (usize, &Place)| {
        let reduced = OWN_SIZES.map(|own| evidence.beside(Some((i, own)), &[]));
        let of = |size: f64| reduced.iter().map(move |r| finite(r.as_ref().and_then(|r| r.ln(size))));
        Unknown { beside: f.names(), place: *place, ln: SHARED_BESIDE.into_iter().flat_map(of).collect() }
    };
    places.par_iter().enumerate().map(at).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use estimate::prepare::Prepared;
    use plant::recipe::{write_campaign, Recipe};

    /// The simulation as given of a campaign with that hum of 60 Hz in its acceleration, m/s^2, fitted to it.
    fn fitted(hum: f64) -> Fitted {
        let dir = tempfile::tempdir().unwrap();
        write_campaign(dir.path(), &Recipe { samples: 1200, ..Recipe::default() }).unwrap();
        for (i, path) in std::fs::read_dir(dir.path()).unwrap().map(|e| e.unwrap().path()).enumerate() {
            if path.extension().is_none_or(|e| e != "csv") {
                continue;
            }
            let text = std::fs::read_to_string(&path).unwrap();
            let mut lines = text.lines();
            let mut out = format!("{}\n", lines.next().unwrap());
            for line in lines {
                let mut v: Vec<f64> = line.split(',').map(|x| x.parse().unwrap()).collect();
                let phase = std::f64::consts::TAU * 60.0 * v[0] + i as f64;
                v[2] += hum * (phase.sin() + (3.0 * phase + 1.0).sin() / 3.0);
                out += &format!("{:.9e},{:.6e},{:.6e},{:.6e}\n", v[0], v[1], v[2], v[3]);
            }
            std::fs::write(&path, out).unwrap();
        }
        let campaign = record::load(dir.path(), &mechanisms::terms()).unwrap();
        let prepared = Prepared::new(&campaign).unwrap();
        Fitted::base(&prepared.data, &prepared.structure, &prepared.guess)
    }

    fn most(of: &[f64]) -> f64 {
        of.iter().copied().filter(|ln| ln.is_finite()).fold(f64::NEG_INFINITY, f64::max)
    }

    #[test]
    fn the_hum_of_one_channel_is_neither_physics_nor_an_unknown_cause() {
        let humming = fitted(8.0);
        let w = weighed(&humming).unwrap();
        let unknown: Vec<f64> = unknown(&humming).iter().flat_map(|u| u.ln.clone()).collect();
        assert!(most(&w.ln[1]) > most(&w.ln[0]) + 100.0, "{:?}", w.ln);
        assert!(most(&w.ln[1]) > most(&unknown) + 10.0, "{:?} {}", w.ln, most(&unknown));
        assert!(w.left < 1.2, "{}", w.left);
        let sets = Evidence::new(&humming, &[], &Disturbed::all(&humming.data)).unwrap();
        let sets = super::sets(&sets, &humming.data).unwrap();
        let likeliest = sets.iter().max_by(|a, b| a.most().0.total_cmp(&b.most().0)).unwrap();
        // recordings shorter than a cycle do not part 50 Hz from 60 Hz
        let hums = |d: &Disturbed| matches!(d.by, Disturbance::Hum50 | Disturbance::Hum60);
        assert_eq!(likeliest.disturbed.iter().filter(|d| hums(d)).count(), 1, "{:?}", likeliest.disturbed);
        let channel = record::Channel::Acceleration;
        assert!(likeliest.disturbed.iter().all(|d| d.channel == channel), "{:?}", likeliest.disturbed);
    }

    #[test]
    fn instruments_of_noise_alone_are_not_disturbed() {
        let w = weighed(&fitted(0.0)).unwrap();
        assert!(most(&w.ln[0]) > most(&w.ln[1]), "{:?}", w.ln);
    }

    #[test]
    fn what_a_fit_was_to_gain_and_has_not_gained_counts_for_nothing() {
        let fit = fitted(0.0);
        let mut away = fit.clone();
        away.fit.point.theta[0] += 1e-3;
        away.fit.point = away.problem().evaluate(away.point().theta.clone(), away.point().locals.clone());
        let (at_end, mut before, ended) = [&fit, &away, &away.to_its_end()].map(|f| weighed(f).unwrap()).into();
        let alone = of_noise(&away).unwrap();
        assert!((alone.0 - before.ln[0][0]).abs() < 1e-6 && (alone.1 - before.pending).abs() < 1e-6, "{alone:?}");
        assert!(at_end.pending < 1.0 && before.pending > 1.0 && ended.pending < 1.0, "{before:?}");
        // what is foretold is what is there, where the equations are right
        assert!((ended.ln[0][0] - before.ln[0][0]).abs() < 1.0, "{before:?} {ended:?}");
        let (ln, pending) = (before.ln.clone(), before.pending);
        before.forgo_pending(2.0 * pending);
        assert_eq!(before.ln, ln);
        before.forgo_pending(1.0);
        let less = ln.iter().flatten().zip(before.ln.iter().flatten()).map(|(a, b)| a - b);
        assert!(less.filter(|d| d.is_finite()).all(|d| (d - pending).abs() < 1e-6) && before.pending == 0.0);
    }
}
