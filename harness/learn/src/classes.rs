//! The classes: what a force may depend on, each a family of shapes without units whose coefficients are not negative.
//!
//! A class that a mechanism of the vocabulary stands for carries its name; the others say what the force depends on.

use crate::press::{Path, Press};

/// A class of forces.
pub struct Class {
    /// Its name, in the field's words.
    pub name: &'static str,
    /// The mechanism of the vocabulary that it is; None where there is no name for it.
    pub mechanism: Option<&'static str>,
    /// Other mechanisms of the vocabulary that it stands for as well.
    pub also: &'static [&'static str],
    /// What the force depends on, in words.
    pub depends: &'static str,
    /// Whether it takes more than one rate, or a hold, to part it from a loss that does not depend on the rate.
    pub needs_rates: bool,
    /// Whether it acts on the body beside the contact, so that it may pull where the contact has let go.
    pub on_body: bool,
    /// Its shapes along a recording; none where this campaign cannot show it.
    pub shapes: fn(&Path, &Press) -> Vec<Vec<f64>>,
    /// Which of its shapes may be there together; None: all.
    pub together: Option<Together>,
}

/// Shapes in groups, of which only so many that follow each other may be there together: a quantity that has one value, and shapes of
/// several.
#[derive(Clone, Copy)]
pub struct Together {
    /// Shapes of a group.
    pub shapes: usize,
    /// Groups that may be there together.
    pub groups: usize,
}

/// Recordings of one rate and without a hold part neither damping nor relaxation from a loss that depends on the direction of the
/// motion alone: what they show is called by the first, which takes no rate to be seen, or one of the others instead.
pub const PARTED_BY_RATES: (Option<&str>, &[&str]) =
    (Some("guide_friction"), &["viscoelastic_relaxation", "viscous_damping", "hysteresis_damping"]);

/// The name of an elastic law of several powers of the depth, where the simulation has one power: a stiffness that grows.
pub const GROWS: &str = "secondary_stiffening";

/// The mechanism that a permanent set may be instead where no place is touched twice: a set that has not come back when a recording
/// ends may come back later, so that relaxation slower than the recordings last leaves the same. None of any other mechanism.
pub fn comes_back_instead(mechanism: &str) -> Option<&'static str> {
    (mechanism == "plastic_indentation").then_some("viscoelastic_relaxation")
}

/// The law that is there in any case: a sum of powers of the depth.
pub fn elastic(p: &Path, _: &Press) -> Vec<Vec<f64>> {
    [0.5, 0.75, 1.0, 1.25, 1.5, 1.75, 2.0, 2.5, 3.0].map(|e| p.each(|i| p.below(i).powf(e))).to_vec()
}

/// All classes, in the order in which they are tried.
pub const ALL: [Class; 12] = [
    Class {
        name: "preload",
        mechanism: Some("contact_preload"),
        also: &[],
        depends: "the contact alone: it is there at once from the touch on",
        needs_rates: false,
        on_body: false,
        shapes: |p, _| {
            let mut all = [0.003, 0.01, 0.03].map(|d| p.each(|i| 1.0 - (-p.below(i) / d).exp())).to_vec();
            all.push(p.each(|i| p.below(i).min(AT_ONCE) / AT_ONCE));
            all
        },
        together: None,
    },
    Class {
        name: "stiffening",
        mechanism: Some(GROWS),
        also: &[],
        depends: "the depth alone, beyond some depth",
        needs_rates: false,
        on_body: false,
        shapes: stiffening,
        together: None,
    },
    Class {
        name: "softening",
        mechanism: None,
        also: &[],
        depends: "the depth alone, and grows less than the depth does, or falls",
        needs_rates: false,
        on_body: false,
        shapes: softening,
        together: None,
    },
    Class {
        name: "friction",
        mechanism: Some("guide_friction"),
        also: &[],
        depends: "the direction of the motion, and on the place along the way",
        needs_rates: false,
        on_body: true,
        shapes: friction,
        together: None,
    },
    Class {
        name: "damping",
        mechanism: Some("viscous_damping"),
        also: &["hysteresis_damping"],
        depends: "the rate, and on the depth",
        needs_rates: true,
        on_body: true,
        shapes: |p, _| {
            let grows = |i: usize| (p.below(i) / 0.05).min(1.0);
            vec![
                p.each(|i| grows(i) * p.v[i]),
                p.each(|i| p.below(i) * p.v[i]),
                p.each(|i| p.below(i).powf(1.5) * p.v[i]),
            ]
        },
        together: None,
    },
    Class {
        name: "relaxation",
        mechanism: Some("viscoelastic_relaxation"),
        also: &[],
        depends: "the depth, and fades with time at constant depth",
        needs_rates: true,
        on_body: false,
        shapes: relaxation,
        together: None,
    },
    Class {
        name: "adhesion",
        mechanism: Some("adhesion"),
        also: &[],
        depends: "the depth, and pulls while the contact is left",
        needs_rates: false,
        on_body: false,
        shapes: adhesion,
        together: None,
    },
    Class {
        name: "plasticity",
        mechanism: Some("plastic_indentation"),
        also: &[],
        depends: "the depth and the deepest so far: it is gone before the depth is zero again",
        needs_rates: false,
        on_body: false,
        shapes: plasticity,
        // between two of the sets that are tried lies the one that there is
        together: Some(Together { shapes: BACK.len() * WAY_IN.len(), groups: 2 }),
    },
    Class {
        name: "hardening with order",
        mechanism: Some("cyclic_hardening"),
        also: &[],
        depends: "the depth, and grows with the order in which the recordings were taken",
        needs_rates: false,
        on_body: false,
        shapes: |p, press| by_order(p, press, 1.0),
        together: None,
    },
    Class {
        name: "softening with order",
        mechanism: Some("cyclic_softening"),
        also: &[],
        depends: "the depth, and falls with the order in which the recordings were taken",
        needs_rates: false,
        on_body: false,
        shapes: |p, press| by_order(p, press, -1.0),
        together: None,
    },
    Class {
        name: "of each level's own",
        mechanism: None,
        also: &[],
        depends: "the depth, otherwise at each level",
        needs_rates: false,
        on_body: false,
        shapes: |p, press| {
            if press.levels.len() < 2 {
                return Vec::new();
            }
            let of =
                |level: usize| OWN.map(|d| p.each(|i| if p.level == level { p.below(i).min(d) } else { 0.0 })).to_vec();
            press.levels.iter().flat_map(|l| of(*l)).collect()
        },
        together: None,
    },
    Class {
        name: "with the level",
        mechanism: None,
        also: &[],
        depends: "the depth, and changes in proportion to the value of the level",
        needs_rates: false,
        on_body: false,
        shapes: |p, press| {
            if press.values.is_none() {
                return Vec::new();
            }
            // a law of the least level and one of the largest, and in between in proportion
            let of = |share: f64| OWN.map(|d| p.each(|i| share * p.below(i).min(d)));
            [1.0 - p.value, p.value].into_iter().flat_map(of).collect()
        },
        together: None,
    },
];

/// Whether this class is a course by the order of the recordings.
pub fn follows_order(class: usize) -> bool {
    ["cyclic_hardening", "cyclic_softening"].iter().any(|name| ALL[class].mechanism == Some(name))
}

/// Whether this class says nothing of a level that it was not learned from.
pub fn is_of_seen_levels(class: usize) -> bool {
    ALL[class].name == "of each level's own"
}

/// Depth within which a force is there at once, for no touch is without a give.
const AT_ONCE: f64 = 0.05;
/// Depths from which on a force grows less.
const YIELDS: [f64; 7] = [0.1, 0.15, 0.2, 0.3, 0.45, 0.6, 0.8];
/// The same of a law that each level has of its own.
const OWN: [f64; 7] = [0.05, 0.1, 0.15, 0.2, 0.3, 0.45, 1.0];
/// Depths at which a stop or a second layer may begin.
const STOPS: [f64; 8] = [0.3, 0.45, 0.6, 0.7, 0.8, 0.9, 0.95, 0.98];

/// Forces that grow up to some depth only, and forces taken away from there on: that of a dome that snaps through falls with the depth.
fn softening(p: &Path, _: &Press) -> Vec<Vec<f64>> {
    YIELDS.iter().flat_map(|d| [p.each(|i| p.below(i).min(*d)), p.each(|i| (d - p.below(i)).min(0.0))]).collect()
}

fn stiffening(p: &Path, _: &Press) -> Vec<Vec<f64>> {
    let beyond = |d: f64, e: f64| p.each(|i| 10.0 * (p.below(i) - d).max(0.0).powf(e));
    STOPS.iter().flat_map(|d| [beyond(*d, 1.0), beyond(*d, 2.0)]).collect()
}

/// Ways, share of the depth, within which friction turns with the direction, where parts give before they slide.
const GIVES: [f64; 4] = [0.01, 0.03, 0.1, 0.2];

/// Constant along the way, hats of a quarter of it and of an eighth, and friction that gives before it slides (Prandtl 1928).
fn friction(p: &Path, _: &Press) -> Vec<Vec<f64>> {
    let touches = |i: usize| if p.x[i] > 0.0 { p.sign[i] } else { 0.0 };
    let hat = |c: f64, width: f64| p.each(|i| touches(i) * (1.0 - (p.below(i) - c).abs() / width).max(0.0));
    let hats = |n: usize| (0..=n).map(move |k| (k as f64 / n as f64, 1.0 / n as f64));
    let of_place = hats(4).chain(hats(8)).map(|(c, width)| hat(c, width));
    let that_gives = GIVES.map(|way| {
        let mut strain = 0.0f64;
        p.each_in_turn(|i| {
            let step = if i > 0 { p.below(i) - p.below(i - 1) } else { 0.0 };
            strain = if p.x[i] > 0.0 { (strain + step / way).clamp(-1.0, 1.0) } else { 0.0 };
            strain
        })
    });
    std::iter::once(p.each(touches)).chain(of_place).chain(that_gives).collect()
}

/// Time constants of a spectrum, the same for all recordings: from a 300th of the fastest way in and back to half of what the longest
/// recording lasts; and those of them, the slowest, that hardly fade while it lasts.
pub(crate) const RELAXES: usize = 7;
pub(crate) const SLOW: usize = 2;

/// Maxwell branches with a spectrum of time constants, driven by powers of the depth: of a layer, a sphere and a cone (Tschoegl 1989).
fn relaxation(p: &Path, press: &Press) -> Vec<Vec<f64>> {
    let n = p.time.len();
    let (least, most) = (press.lasts.0 / 300.0, press.lasts.1 / 2.0);
    let branch = |power: f64, tau: f64| {
        let mut q = vec![0.0; n];
        for i in 1..n {
            let h = (p.time[i] - p.time[i - 1]).max(f64::MIN_POSITIVE);
            let fades = (-h / tau).exp();
            q[i] = q[i - 1] * fades + (p.below(i).powf(power) - p.below(i - 1).powf(power)) * (tau / h) * (1.0 - fades);
        }
        q
    };
    let tau = |k: usize| least * (most / least).powf(k as f64 / (RELAXES - 1) as f64);
    [0.5, 1.0, 1.5, 2.0]
        .iter()
        .flat_map(|e| (0..RELAXES).map(move |k| (*e, tau(k))))
        .map(|(e, tau)| branch(e, tau))
        .collect()
}

/// Places along the pull at which a neck may let go, and necks' lengths, share of the pull's.
const LETS_GO: usize = 25;
const NECKS: [f64; 4] = [0.1, 0.25, 0.6, 1.2];
const HATS: usize = 14;

/// Necks that grow and let go at a place of their own while the contact is left (Johnson, Kendall and Roberts 1971; steps:
/// several of them), and a pull on either way, as where a tip snaps in.
fn adhesion(p: &Path, press: &Press) -> Vec<Vec<f64>> {
    let Some((low, high)) = press.pull else { return Vec::new() };
    let reach = (high - low).max(0.1);
    let low = low - 0.05 * reach;
    let leaves = |i: usize| p.leaving[i] && p.sign[i] < 0.3 && p.x[i] <= high;
    let neck = |at: f64, length: f64| {
        p.each(|i| {
            let away = p.x[i] - at;
            match leaves(i) {
                true if away >= 0.0 => -(1.0 - away / length).max(0.0),
                true => -(1.0 + away / (0.03 * reach)).max(0.0),
                false => 0.0,
            }
        })
    };
    let place = |k: usize, n: usize| low + reach * k as f64 / (n - 1) as f64;
    let width = reach / (HATS - 1) as f64;
    let hat = |at: f64, width: f64, i: usize| -(1.0 - (p.x[i] - at).abs() / width).max(0.0);
    let necks = (0..LETS_GO).flat_map(|k| NECKS.map(|l| neck(place(k, LETS_GO), l * reach)));
    let leaving = (0..2 * HATS - 1).map(|k| {
        let at = place(k, 2 * HATS - 1);
        p.each(|i| if leaves(i) { hat(at, 0.5 * width, i) } else { 0.0 })
    });
    let either = (0..HATS).map(|k| {
        let at = place(k, HATS);
        p.each(|i| if p.x[i] <= high { hat(at, width, i) } else { 0.0 })
    });
    necks.chain(leaving).chain(either).collect()
}

/// What is added to the law from the first recording to the last, evenly or at first faster.
fn by_order(p: &Path, press: &Press, sign: f64) -> Vec<Vec<f64>> {
    if press.orders.1 - press.orders.0 < 2.0 {
        return Vec::new();
    }
    // a recording from before the first is as that one, by what falls off
    [p.order, p.order.max(0.0).sqrt()].map(|g| p.each(|i| sign * g * p.below(i).powf(1.5))).to_vec()
}

/// Shares of the deepest point that come back, each four fifths of the one before: as little as of metals (Oliver and Pharr
/// 1992). Powers of the way back to the set, and of the way in that it takes the place of: between them lie the powers of the
/// elastic law.
const COMES_BACK: [f64; 17] =
    [0.9, 0.72, 0.58, 0.46, 0.37, 0.295, 0.236, 0.189, 0.151, 0.121, 0.097, 0.077, 0.062, 0.05, 0.04, 0.032, 0.025];
const BACK: [f64; 3] = [1.0, 1.5, 2.0];
const WAY_IN: [f64; 3] = [1.0, 1.5, 2.0];

/// The way back to a permanent set, all but `back` of the deepest point so far, by a power n of its own, less the way in by a power m
/// (Oliver and Pharr 1992, eq. 3).
fn plasticity(p: &Path, _: &Press) -> Vec<Vec<f64>> {
    let of = |back: f64, n: f64, m: f64| {
        p.each(|i| {
            let deepest = p.deepest[i].max(1e-9);
            let on_the_way = (1.0 - (1.0 - p.x[i] / deepest) / back).clamp(0.0, 1.0).powf(n);
            let way_in = (p.x[i] / deepest).clamp(0.0, 1.0).powf(m);
            (on_the_way - way_in) * deepest.powf(m)
        })
    };
    let powers = |back: f64| BACK.iter().flat_map(move |n| WAY_IN.map(|m| (back, *n, m)));
    COMES_BACK.iter().flat_map(|back| powers(*back)).map(|(back, n, m)| of(back, n, m)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_recording_from_before_the_first_has_a_shape_of_every_class() {
        let time: Vec<f64> = (0..50).map(f64::from).collect();
        let depth: Vec<f64> = time.iter().map(|t| 1e-3 * (1.0 - (t - 25.0).abs() / 20.0)).collect();
        let of = |order: f64| crate::Recording {
            force: depth.iter().map(|x| 1e4 * x.max(0.0)).collect(),
            rate: time.iter().map(|t| if *t < 25.0 { 5e-5 } else { -5e-5 }).collect(),
            time: time.clone(),
            depth: depth.clone(),
            counts: Vec::new(),
            order,
            level: 0,
            value: Some(order),
        };
        let press = Press::of(&[of(2.0), of(3.0), of(6.0)], &[0.0; 3], 0.01).unwrap();
        let path = Path::of(&of(1.0), 0.0, &press);
        let shapes = ALL.iter().flat_map(|c| (c.shapes)(&path, &press));
        assert!(shapes.flatten().all(f64::is_finite));
    }
}
