//! Channels, speeds, heights and files of a campaign, compared with each other before anything is fitted.

mod contact;
mod files;
mod ratio;
mod slips;

use crate::figure::figure;
use contact::{contact, ends, impulse, push, Contact};
use estimate::impact::touch;
use files::{files, is_flat};
use ratio::{weighed, Answer, Ratio, Slip, GAIN, MASS, WAY};
use record::statistics::median;
use record::{Campaign, Kind, Recording, GRAVITY};
use serde::Serialize;
use slips::{
    ACCELERATION_OVER_SPEED, FORCE_OVER_MA, FORCE_OVER_SPEED, SPEED_OVER_FALL, WAY_OVER_SPEED, WAY_OVER_TRAVEL,
};

/// Standard deviation of the logarithm of a sum over a contact: where it ends, and how its zero drifts meanwhile.
const SUMS: f64 = 0.02;
/// Standard deviations that leave one in a thousand outside.
const IN_A_THOUSAND: f64 = 3.29;
/// Standard deviation of a height or a travel read off a ruler: m, and as a share.
const RULER: f64 = 5e-4;
const RULED: f64 = 0.01;
/// Standard deviation of the logarithm by which guides slow a fall.
const GUIDES: f64 = 0.5;

/// A comparison that was made, over all recordings that allow it.
#[derive(Clone, Debug, Serialize)]
pub struct Compared {
    pub what: &'static str,
    pub value: f64,
    /// 95 %.
    pub interval: [f64; 2],
    /// Where it is expected, sensors being as good as they are calibrated.
    pub expected: [f64; 2],
    pub recordings: usize,
}

/// The result of all comparisons.
#[derive(Clone, Debug, Default)]
pub struct Agreement {
    pub compared: Vec<Compared>,
    /// Differences that sensors alone do not explain, but a rig may.
    pub doubts: Vec<String>,
    /// Differences that nothing but a mistake explains.
    pub contradictions: Vec<String>,
    /// Those of the contradictions that a unit taken for another explains.
    pub units: Vec<String>,
}

/// Where a ratio is expected: within `right`, to a standard deviation `tolerance` of its logarithm by calibrations; `below`:
/// by which standard deviation a rig lowers it, where that is more than it raises it.
struct Expected {
    right: [f64; 2],
    tolerance: f64,
    below: f64,
}

impl Agreement {
    /// Adds a comparison: what it is, and what to do where it is off.
    fn ratio(
        &mut self,
        what: &'static str,
        all: &[f64],
        Expected { right, tolerance, below }: Expected,
        slips: &[Slip],
        cure: &str,
    ) {
        let Some(r) = Ratio::of(all) else { return };
        let expected = [
            right[0] * (-IN_A_THOUSAND * tolerance.hypot(r.error)).exp(),
            right[1] * (IN_A_THOUSAND * tolerance.hypot(r.error)).exp(),
        ];
        let said = format!(
            "{what} is {} ({} to {}), where sensors as they are calibrated give {} to {}",
            figure(r.value(), ""),
            figure(r.interval()[0], ""),
            figure(r.interval()[1], ""),
            figure(expected[0], ""),
            figure(expected[1], "")
        );
        match weighed(&r, right, tolerance, below, slips) {
            Answer::Sensors => {}
            Answer::Rig => self.doubts.push(format!("{said}: {cure}")),
            Answer::Unit(s) => {
                let text = format!("{said}: {}; correct the unit", s.words);
                self.units.push(text.clone());
                self.contradictions.push(text);
            }
            Answer::Nothing => self.contradictions.push(format!("{said}: {cure}")),
        }
        self.compared.push(Compared { what, value: r.value(), interval: r.interval(), expected, recordings: r.count });
    }
}

/// Compares what a campaign holds, its files as they are.
pub fn agreement(c: &Campaign) -> Agreement {
    let mut a = Agreement::default();
    same_content(c, &mut a);
    if c.kind == Kind::System {
        return a;
    }
    signs(c, &mut a);
    if c.kind == Kind::Indentation {
        return a;
    }
    let mass = c.moving_mass.unwrap_or(1.0);
    let contacts: Vec<Option<Contact>> = c.recordings.iter().map(|r| contact(c.kind, r, mass)).collect();
    let whole = || c.recordings.iter().zip(&contacts).filter_map(|(r, k)| Some((r, k.as_ref()?)));
    let both = |(r, k): (&Recording, &Contact)| {
        let of = |channel| push(r, channel, mass, k.first, k.last - k.first).map(|p| impulse(&r.time, &p, k));
        Some(of(0)? / of(1)?)
    };
    let ratios: Vec<f64> = whole().filter(|(r, k)| ends(k) && !is_flat(r, k)).filter_map(both).collect();
    let before = a.contradictions.len();
    let of_both = GAIN.hypot(GAIN).hypot(MASS);
    let cure =
        "check moving_mass and the calibrations of both, and that no mass lies between the two sensors; a diagnosis \
                tells a gain from a mass that strikes apart";
    a.ratio(
        "force over mass times acceleration",
        &ratios,
        Expected { right: [1.0, 1.0], tolerance: of_both, below: 0.0 },
        &FORCE_OVER_MA,
        cure,
    );
    if a.contradictions.len() > before || ratios.is_empty() {
        swapped(c, mass, &mut a);
    }
    if c.kind == Kind::DropTest {
        let all: Vec<_> = whole().collect();
        speeds(&all, mass, &mut a);
        weight(c, &all, mass, &mut a);
    }
    if let (Kind::ContactorOpening, Some(travel)) = (c.kind, c.travel) {
        begins(&whole().collect::<Vec<_>>(), travel, &mut a);
    }
    files(c, &contacts, &mut a);
    a
}

/// Says so where penetration is to mass times acceleration what force should be.
fn swapped(c: &Campaign, mass: f64, a: &mut Agreement) {
    let as_force = |r: &Recording| {
        let mut one = r.clone();
        one.channels.swap(0, 2);
        let k = contact(c.kind, &one, mass)?;
        let of = |channel| push(&one, channel, mass, k.first, k.last - k.first).map(|p| impulse(&r.time, &p, &k));
        Some(of(0)? / of(1)?)
    };
    let all: Vec<f64> = c.recordings.iter().filter_map(as_force).collect();
    let Some(r) = Ratio::of(&all) else { return };
    if let Answer::Sensors | Answer::Rig = weighed(&r, [1.0, 1.0], GAIN, 0.0, &FORCE_OVER_MA) {
        a.contradictions.push(
            "penetration is what force should be, mass times acceleration: the columns force and penetration look swapped; \
             correct the header"
                .into(),
        );
    }
}

/// Pushes and ways against the speeds given, and speeds against heights.
fn speeds(all: &[(&Recording, &Contact)], mass: f64, a: &mut Agreement) {
    let share = |r: &Recording| r.impact_speed.filter(|v| v.0 > 0.0).map(|(v, std)| (v, std / v));
    let spread = |of: Vec<f64>| if of.is_empty() { 0.0 } else { median(of) };
    let known = spread(all.iter().filter_map(|(r, _)| share(r)).map(|s| s.1).collect());
    let pushed = |(r, k): &(&Recording, &Contact)| {
        let (v, _) = share(r)?;
        // of an acceleration no mass is asked
        let by_acceleration = || push(r, 1, mass, k.first, k.last - k.first);
        let pushes = by_acceleration().unwrap_or_else(|| k.push.clone());
        (ends(k) && !is_flat(r, k)).then(|| impulse(&r.time, &pushes, k) / (mass * v))
    };
    let ratios: Vec<f64> = all.iter().filter_map(pushed).collect();
    // gravity pushes as long as the contact lasts, and drives the body on until the stop bears its weight
    let weight = |(r, k): &(&Recording, &Contact)| {
        let (v, _) = share(r)?;
        Some(GRAVITY * (r.time[k.last] - r.time[k.first.saturating_sub((k.last - k.first) / 2)]) / v)
    };
    let weight = spread(all.iter().filter_map(weight).collect());
    let cure = "check moving_mass, the speed or height of the fall, and that the zero of the channel does not drift";
    let tolerance = GAIN.hypot(MASS).hypot(known).hypot(SUMS);
    let what = "the push over mass times speed of impact (1 + restitution)";
    let by_acceleration = all.iter().any(|(r, _)| r.channels[1].is_some());
    let slips: &[Slip] = if by_acceleration { &ACCELERATION_OVER_SPEED } else { &FORCE_OVER_SPEED };
    a.ratio(what, &ratios, Expected { right: [1.0, 2.0 + weight], tolerance, below: GUIDES }, slips, cure);
    let moved = |(r, k): &(&Recording, &Contact)| {
        let (v, _) = share(r)?;
        let x = r.channels[2].as_ref()?;
        let from = k.first.saturating_sub(((k.last - k.first) / 2).max(8));
        (ends(k) && k.first >= from + 8).then(|| slope(&r.time[from..k.first], &x[from..k.first]) / v)
    };
    let ratios: Vec<f64> = all.iter().filter_map(moved).collect();
    let cure = "check the calibration of the displacement and the speed given";
    let what = "the speed of the penetration before the touch over the speed given";
    let right = [1.0 / (1.0 + weight), 1.0 + weight];
    a.ratio(what, &ratios, Expected { right, tolerance: WAY.hypot(known), below: GUIDES }, &WAY_OVER_SPEED, cure);
    let fallen = |(r, _): &(&Recording, &Contact)| {
        let ((v, _), h) = (share(r)?, r.drop_height.filter(|h| *h > 0.0)?);
        let fall = (2.0 * GRAVITY * h).sqrt();
        // a speed that was worked out of the height says nothing
        ((v / fall - 1.0).abs() > 1e-9).then_some((v / fall, h))
    };
    let falls: Vec<(f64, f64)> = all.iter().filter_map(fallen).collect();
    let ruled = spread(falls.iter().map(|(_, h)| 0.5 * (RULER / h).hypot(RULED)).collect());
    let ratios: Vec<f64> = falls.iter().map(|f| f.0).collect();
    let cure = "nothing falls faster than freely: check drop_height and impact_speed";
    let what = "the speed of impact over that of a free fall";
    a.ratio(
        what,
        &ratios,
        Expected { right: [1.0, 1.0], tolerance: ruled.hypot(known), below: GUIDES },
        &SPEED_OVER_FALL,
        cure,
    );
}

/// Slope of a straight line through samples, least squares.
fn slope(t: &[f64], x: &[f64]) -> f64 {
    let n = t.len() as f64;
    let (mt, mx) = (t.iter().sum::<f64>() / n, x.iter().sum::<f64>() / n);
    let (mut stt, mut stx) = (0.0, 0.0);
    for (t, x) in t.iter().zip(x) {
        stt += (t - mt).powi(2);
        stx += (t - mt) * (x - mx);
    }
    stx / stt
}

/// Least peak force over the weight of a body that meets a contact F = k x^p: m v^2 / 2 + m g x = F x / (p + 1), so that it is p + 1 at
/// least; p from 0.5.
const PEAK_OVER_WEIGHT: f64 = 1.5;

/// Whether a body that weighs as much as the simulation has it could be stopped by so small a force.
fn weight(c: &Campaign, all: &[(&Recording, &Contact)], mass: f64, a: &mut Agreement) {
    let weight = mass * GRAVITY;
    if c.moving_mass.is_none() || !c.simulation.terms.iter().any(|t| t == "gravity") {
        return;
    }
    let peak = |(r, k): &(&Recording, &Contact)| {
        let of = |channel| push(r, channel, mass, k.first, k.last - k.first);
        let push = of(0).or_else(|| of(1))?;
        Some(push[k.first..=k.last].iter().copied().fold(0.0, f64::max))
    };
    let peaks: Vec<f64> = all.iter().filter_map(peak).collect();
    if peaks.is_empty() {
        return;
    }
    let peak = median(peaks);
    if peak >= PEAK_OVER_WEIGHT * weight {
        return;
    }
    a.doubts.push(format!(
        "the middling peak is {} and the weight {}, where a contact that stops a falling body reaches {PEAK_OVER_WEIGHT} times its \
         weight and more: if the body moves level, leave gravity out of [simulation] terms; else check moving_mass and the \
         unit of what was read",
        figure(peak, "N"),
        figure(weight, "N")
    ));
}

/// Where a contactor begins against its travel.
fn begins(all: &[(&Recording, &Contact)], travel: f64, a: &mut Agreement) {
    let begin = |(r, k): &(&Recording, &Contact)| {
        let x = r.channels[2].as_ref()?;
        let early = (k.first / 50).clamp(1, 20);
        Some(-median(x[..early].to_vec()) / travel)
    };
    let ratios: Vec<f64> = all.iter().filter_map(begin).collect();
    let tolerance = WAY.hypot(RULED).hypot(RULER / travel / IN_A_THOUSAND);
    let cure = "the zero of the displacement is not at the stop, or travel is another one: set one of them right";
    a.ratio(
        "the way from the first sample to the stop over travel",
        &ratios,
        Expected { right: [1.0, 1.0], tolerance, below: 0.0 },
        &WAY_OVER_TRAVEL,
        cure,
    );
    let wrong = all.iter().filter_map(begin).filter(|b| *b <= 0.0).count();
    if wrong > 0 {
        a.contradictions.push(format!(
            "in {wrong} recordings penetration begins at or behind the stop, though the bar is released {travel} m before \
             it: turn its sign, or set its zero to the stop"
        ));
    }
}

/// Names of the files for which `of` holds, a few of them.
fn named(all: &[&str]) -> String {
    match all.len() {
        0..=3 => all.join(", "),
        n => format!("{}, {} and {} more", all[0], all[1], n - 2),
    }
}

/// Recordings of the same content.
fn same_content(c: &Campaign, a: &mut Agreement) {
    for (i, r) in c.recordings.iter().enumerate() {
        let same = |o: &&Recording| o.channels == r.channels && o.channels.iter().any(Option::is_some);
        if let Some(o) = c.recordings[..i].iter().find(same) {
            a.contradictions.push(format!(
                "{} holds the same readings as {}: two impacts never do; take one of them out",
                r.file, o.file
            ));
        }
    }
}

/// Forces and accelerations whose sign is turned.
fn signs(c: &Campaign, a: &mut Agreement) {
    let mass = c.moving_mass.unwrap_or(1.0);
    let mut turned: [Vec<&str>; 2] = Default::default();
    for r in &c.recordings {
        for channel in [0, 1] {
            let Some(y) = &r.channels[channel] else { continue };
            // an indentation may be pulled harder than it is pushed, and a ringing force with it
            let zero = median(y[..(y.len() / 20).max(4).min(y.len())].to_vec());
            let by = if channel == 0 { 1.0 } else { -1.0 };
            let three = |w: &[f64], up: f64| w.iter().map(|v| up * by * (v - zero)).fold(f64::INFINITY, f64::min);
            let away = |up: f64| y.windows(3).map(|w| three(w, up)).fold(0.0, f64::max);
            let (right, wrong) = (away(1.0), away(-1.0));
            let alone = |y: Vec<f64>| {
                let mut one = r.clone();
                one.channels = [None, None, None];
                one.channels[channel] = Some(y);
                touch(c.kind, &one, mass)
            };
            let only_turned = || alone(y.clone()).is_none() && alone(y.iter().map(|v| -v).collect()).is_some();
            if c.kind != Kind::Indentation && wrong > right && (wrong > 2.0 * right || only_turned()) {
                turned[channel].push(&r.file);
            }
        }
    }
    // an acceleration beside a force that is right is judged by that
    let beside = |file: &&str| c.recordings.iter().any(|r| r.file == *file && r.channels[0].is_some());
    let force_right = |file: &&str| beside(file) && !turned[0].contains(file);
    turned[1] = turned[1].iter().copied().filter(|f| !force_right(f)).collect();
    let texts = [
        "force falls in the impact: its sign is turned; it is positive while the stop is pressed",
        "acceleration rises in the impact: its sign is turned; it is negative while the stop pushes back",
    ];
    if !turned[0].is_empty() && turned[0] == turned[1] {
        a.contradictions.push(format!(
            "{}: force falls and acceleration rises in the impact: the columns force and acceleration look swapped, or both \
             signs are turned; correct the header",
            named(&turned[0])
        ));
        return;
    }
    for (list, text) in turned.iter().zip(texts).filter(|l| !l.0.is_empty()) {
        a.contradictions.push(format!("{}: {text}", named(list)));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Half sines of 2 ms at 10 ms in force and acceleration, a way before it, of a body of 1 kg.
    fn campaign(gain: f64) -> Campaign {
        let n = 3000;
        let noise = |i: usize, k: usize| {
            let z = ((i * 31 + k * 1_000_003 + 7) as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15);
            ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64 - 0.5
        };
        let time: Vec<f64> = (0..n).map(|i| 1e-5 * i as f64).collect();
        let shape = |t: f64| {
            if (0.010..0.012).contains(&t) {
                (std::f64::consts::PI * (t - 0.010) / 0.002).sin()
            } else {
                0.0
            }
        };
        let recordings = (0..6)
            .map(|k| {
                let peak = 500.0 + 100.0 * k as f64;
                // 2 peak T / pi = m v (1 + e), e 0.7
                let v = 2.0 * peak * 2e-3 / std::f64::consts::PI / 1.7;
                let force = (0..n).map(|i| gain * (peak * shape(time[i]) + noise(i, k))).collect();
                let acceleration = (0..n).map(|i| -peak * shape(time[i]) + noise(i, k + 50)).collect();
                let way = (0..n).map(|i| v * (time[i].min(0.011) - 0.010) + 1e-6 * noise(i, k + 90)).collect();
                Recording {
                    order: k as f64,
                    level: k,
                    drop_height: Some(v * v / (2.0 * GRAVITY)),
                    impact_speed: Some((1.0001 * v, 0.003 * v)),
                    ..Recording::of(&format!("r{k:02}.csv"), time.clone(), [Some(force), Some(acceleration), Some(way)])
                }
            })
            .collect();
        Campaign { moving_mass: Some(1.0), ..Campaign::of("c", Kind::DropTest, recordings) }
    }

    #[test]
    fn a_peak_below_the_weight_is_no_fall() {
        let mut c = campaign(1.0);
        c.simulation.terms = vec!["gravity".into()];
        assert_eq!(said(&c).0, "");
        for r in &mut c.recordings {
            let soft = |y: &mut Vec<f64>| y.iter_mut().for_each(|v| *v *= 0.01);
            r.channels.iter_mut().take(2).flatten().for_each(soft);
        }
        let doubts = said(&c).0;
        assert!(doubts.contains("leave gravity out of [simulation] terms"), "{doubts}");
        c.simulation.terms.clear();
        assert!(!said(&c).0.contains("gravity"));
    }

    fn said(c: &Campaign) -> (String, String) {
        let a = agreement(c);
        (a.doubts.join("\n"), a.contradictions.join("\n"))
    }

    #[test]
    fn what_agrees_is_compared_and_nothing_is_said() {
        let a = agreement(&campaign(1.0));
        assert_eq!((a.doubts, a.contradictions), (Vec::new(), Vec::new()));
        assert_eq!(a.compared.len(), 4);
        assert!(
            (a.compared[0].value - 1.0).abs() < 5e-3 && (a.compared[1].value - 1.7).abs() < 0.02,
            "{:?}",
            a.compared
        );
    }

    #[test]
    fn a_force_in_lbf_is_named() {
        let (_, c) = said(&campaign(1.0 / 4.448));
        assert!(c.contains("force looks like lbf"), "{c}");
    }

    #[test]
    fn a_mass_ten_per_cent_off_is_a_doubt() {
        let mut c = campaign(1.0);
        c.moving_mass = Some(1.1);
        let (doubts, contradictions) = said(&c);
        assert!(doubts.contains("force over mass times acceleration is 0.9") && contradictions.is_empty(), "{doubts}");
    }

    #[test]
    fn a_height_in_mm_is_named() {
        let mut c = campaign(1.0);
        for r in &mut c.recordings {
            let h = 1e3 * r.drop_height.unwrap();
            (r.drop_height, r.impact_speed) = (Some(h), Some(((2.0 * GRAVITY * h).sqrt(), 0.01)));
        }
        assert!(said(&c).1.contains("drop_height looks like mm"), "{:?}", said(&c));
    }

    #[test]
    fn a_turned_force_is_named_though_the_others_of_its_files_go_on() {
        let mut c = campaign(1.0);
        for r in &mut c.recordings[1..] {
            r.channels[0].iter_mut().flatten().for_each(|f| *f = -*f);
        }
        assert!(said(&c).1.contains("r01.csv, r02.csv and 3 more: force falls in the impact"), "{:?}", said(&c));
    }

    #[test]
    fn the_same_content_twice_is_no_two_impacts() {
        let mut c = campaign(1.0);
        c.recordings[4].channels = c.recordings[1].channels.clone();
        assert!(said(&c).1.contains("r04.csv holds the same readings as r01.csv"));
    }

    #[test]
    fn swapped_columns_are_named() {
        let mut c = campaign(1.0);
        c.recordings.iter_mut().for_each(|r| r.channels.swap(0, 2));
        assert!(said(&c).1.contains("force and penetration look swapped"), "{:?}", said(&c));
        let mut c = campaign(1.0);
        c.recordings.iter_mut().for_each(|r| r.channels.swap(0, 1));
        assert!(said(&c).1.contains("force and acceleration look swapped"), "{:?}", said(&c));
    }

    #[test]
    fn a_contactor_that_begins_where_its_travel_says_is_right_and_another_is_not() {
        let mut c = campaign(1.0);
        (c.kind, c.travel) = (Kind::ContactorOpening, Some(0.004));
        for r in &mut c.recordings {
            for (x, t) in r.channels[2].as_mut().unwrap().iter_mut().zip(&r.time) {
                *x = -0.004 * (1.0 - (t / 0.010).min(1.0).powi(2));
            }
        }
        assert_eq!(said(&c), (String::new(), String::new()));
        let shift = |c: &mut Campaign, by: &dyn Fn(f64) -> f64| {
            c.recordings.iter_mut().for_each(|r| r.channels[2].iter_mut().flatten().for_each(|x| *x = by(*x)));
        };
        let mut twice = c.clone();
        let x = twice.recordings[0].channels[2].as_mut().unwrap();
        let (first, n) = (x[..1000].to_vec(), x.len());
        x[n - 1000..].copy_from_slice(&first);
        assert!(said(&twice).0.contains("give each operation a file"), "{:?}", said(&twice));
        shift(&mut c, &|x| x - 0.0008);
        assert!(said(&c).0.contains("the way from the first sample to the stop over travel is 1.2"), "{:?}", said(&c));
        shift(&mut c, &|x| x + 0.0058);
        assert!(said(&c).1.contains("begins at or behind the stop"), "{:?}", said(&c));
    }

    #[test]
    fn a_flat_top_a_cut_contact_a_far_zero_and_a_second_drop_are_doubts() {
        let mut c = campaign(1.0);
        c.recordings[0].channels[0].iter_mut().flatten().for_each(|f| *f = f.min(400.0));
        let cut = &mut c.recordings[1];
        cut.time.truncate(1100);
        cut.channels.iter_mut().flatten().for_each(|y| y.truncate(1100));
        for r in &mut c.recordings[2..] {
            r.channels[2].iter_mut().flatten().for_each(|x| *x -= 0.01);
        }
        // the same pulse again, 16 ms later: no bounce is as hard
        let again = c.recordings[3].channels.clone();
        for (y, first) in c.recordings[3].channels.iter_mut().zip(again).take(2) {
            for (i, v) in first.unwrap()[900..1300].iter().enumerate() {
                y.as_mut().unwrap()[2500 + i] = 1.2 * v;
            }
        }
        let (doubts, _) = said(&c);
        for (file, words) in [
            ("r00.csv", "flat top"),
            ("r01.csv", "inside of the contact"),
            ("r02.csv", "farther from zero"),
            ("r03.csv", "no bounce"),
        ] {
            assert!(doubts.lines().any(|l| l.starts_with(file) && l.contains(words)), "{file}: {doubts}");
        }
    }
}
