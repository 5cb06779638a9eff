//! A scenario file: what may stand in it, and what is wrong with it.

use super::contact::{Contact, Faces, Fault};
use super::locate::line_of;
use super::motion::Motion;
use super::GRAVITY;
use anyhow::{anyhow, bail, Result};
use schemars::JsonSchema;
use serde::Deserialize;
use std::path::Path;

/// What moves, and what drives it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(try_from = "String")]
#[schemars(extend("enum" = KINDS))]
pub enum Kind {
    /// A body falls on the stop.
    DropTest,
    /// A bar is driven by its return spring, against a holding force that fades, on the stop.
    ContactorOpening,
}

/// The kinds as a file spells them, with `_` or `-`.
const KINDS: [&str; 4] = ["drop_test", "contactor_opening", "drop-test", "contactor-opening"];

impl TryFrom<String> for Kind {
    type Error = String;

    /// The kind of that name, spelt with `_` or `-`.
    fn try_from(name: String) -> Result<Kind, String> {
        match name.replace('-', "_").as_str() {
            "drop_test" => Ok(Kind::DropTest),
            "contactor_opening" => Ok(Kind::ContactorOpening),
            _ => {
                let instead = record::words::instead(&name, &KINDS[..2]);
                Err(format!("kind {name:?} is not known; {instead}"))
            }
        }
    }
}

/// How many bodies a drop test has.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Model {
    /// All masses as one (Ahn and Ryu 2005, eq. 6).
    #[default]
    Reduced,
    /// Accelerometer, body and tip, with the sensors' springs between (eqs 3 to 5).
    ThreeMass,
}

/// The three masses, kg, > 0.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Masses {
    /// Seismic mass of the accelerometer.
    pub accelerometer: f64,
    /// Falling body.
    pub body: f64,
    /// Impact tip, below the force transducer; absent where every `[[tip]]` has its own mass.
    #[serde(default)]
    pub tip: f64,
}

/// Springs of the sensors.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Sensors {
    /// Between accelerometer and body, N/m, > 0.
    pub accelerometer_stiffness: f64,
    /// Of the force transducer, between body and tip, N/m, > 0.
    pub transducer_stiffness: f64,
    /// Damping ratio of the accelerometer's mass on its spring, 0 to below 1.
    #[serde(default)]
    pub accelerometer_damping_ratio: f64,
    /// Damping ratio of the tip on the transducer's spring, 0 to below 1.
    #[serde(default)]
    pub transducer_damping_ratio: f64,
}

/// Photo interrupters in a row above the stop.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PhotoInterrupters {
    /// From one to the next, m, > 0.
    #[serde(default = "six_mm")]
    pub spacing: f64,
    /// From the last one to touch, m, >= 0.
    pub last_to_touch: f64,
    /// How many, 3 to 12 (the paper has 6); the last three give the speed.
    #[serde(default = "three")]
    pub count: usize,
    /// Step of the clock that times them, s, >= 0; 0: exact.
    #[serde(default)]
    pub clock: f64,
}

fn six_mm() -> f64 {
    0.006
}

fn three() -> usize {
    3
}

/// An impact tip.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Tip {
    /// Its name.
    pub name: String,
    /// Its mass, kg, >= 0: added to `mass`, or in place of the tip of `[masses]`.
    #[serde(default)]
    pub mass: f64,
    /// Its contact.
    pub contact: Contact,
}

/// Another stiffness to put beside the scenario's own.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Compare {
    /// Its name.
    pub name: String,
    /// k, N/m^p.
    pub stiffness: Option<f64>,
    /// Faces whose theoretical stiffness is taken instead.
    pub faces: Option<Faces>,
}

/// A scenario file. Plain SI.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Scenario {
    /// What moves.
    pub kind: Kind,
    /// One body or three.
    #[serde(default)]
    pub model: Model,
    /// Moving mass, kg, > 0; `masses` instead where they are given one by one.
    pub mass: Option<f64>,
    /// Drop height, m, > 0.
    pub drop_height: Option<f64>,
    /// Several of them, a run each.
    #[serde(default)]
    pub drop_heights: Vec<f64>,
    /// Speed at touch, m/s, > 0, instead of a drop height.
    pub impact_speed: Option<f64>,
    /// Whether gravity acts along +x, into the stop, from the first touch on; the fall before it is always under
    /// gravity.
    #[serde(default)]
    pub gravity: bool,
    /// Coulomb friction of the guide, N, >= 0, smoothed as tanh(v / (5 mm/s)).
    #[serde(default)]
    pub guide_friction: f64,
    /// From rest to the stop, m, > 0 (contactor).
    #[serde(default)]
    pub travel: f64,
    /// Return spring at rest, N, > 0 (contactor).
    #[serde(default)]
    pub spring_preload: f64,
    /// Rate of the return spring, N/m, >= 0 (contactor).
    #[serde(default)]
    pub return_spring_rate: f64,
    /// Holding force at the first instant, N, >= 0 (contactor).
    #[serde(default)]
    pub holding_force: f64,
    /// Time constant with which the holding force fades, s, > 0 where there is one.
    #[serde(default)]
    pub holding_time: f64,
    /// Impacts to simulate at most, 1 to 10000; rest ends them sooner. Absent: 1 for a drop test, to rest for a
    /// contactor.
    pub impacts: Option<usize>,
    /// Rebound height taken as rest, m, >= 0.
    #[serde(default = "one_micrometre")]
    pub rest_height: f64,
    /// Mechanisms that act on the body on its way.
    #[serde(default)]
    pub motion: Motion,
    /// The three masses.
    pub masses: Option<Masses>,
    /// The sensors' springs.
    pub sensors: Option<Sensors>,
    /// Photo interrupters.
    pub photo_interrupters: Option<PhotoInterrupters>,
    /// The contact; absent where there are tips.
    pub contact: Option<Contact>,
    /// Impact tips, each run in turn.
    #[serde(default)]
    pub tip: Vec<Tip>,
    /// Other stiffnesses, each run in turn and put beside the first.
    #[serde(default)]
    pub compare: Vec<Compare>,
}

fn one_micrometre() -> f64 {
    1e-6
}

/// Most runs one file may ask for.
const MOST_RUNS: usize = 100_000;

/// Where a fault is: table, its index, key, cure.
type Place = (&'static str, usize, &'static str, String);

fn need(ok: bool, key: &'static str, cure: &str) -> Result<(), Place> {
    need_in(ok, "", key, cure)
}

fn need_in(ok: bool, table: &'static str, key: &'static str, cure: &str) -> Result<(), Place> {
    if ok {
        Ok(())
    } else {
        Err((table, 0, key, cure.to_string()))
    }
}

fn good(x: f64) -> bool {
    x.is_finite() && x > 0.0
}

fn zero(x: f64) -> bool {
    x.is_finite() && x >= 0.0
}

impl Scenario {
    /// Reads and checks a file.
    ///
    /// # Errors
    /// Names the file, the line and the cure.
    pub fn load(path: &Path) -> Result<Scenario> {
        let name = path.display();
        let text = input::text(path, input::TEXT).map_err(|e| {
            let cure = input::cure(&e).unwrap_or("give the path of a scenario file");
            anyhow!("{name}: cannot be read ({e}); {cure}")
        })?;
        let dir = path.parent().unwrap_or(Path::new(""));
        Scenario::parse(&text).and_then(|s| s.check_files(&text, dir).map(|()| s)).map_err(|(line, what)| match line {
            Some(n) => anyhow!("{name}:{n}: {what}"),
            None => anyhow!("{name}: {what}"),
        })
    }

    /// Reads and checks a file's text.
    ///
    /// # Errors
    /// The line, where it is known, and what is wrong with the cure.
    pub fn parse(text: &str) -> Result<Scenario, (Option<usize>, String)> {
        let s: Scenario = toml::from_str(text).map_err(|e| {
            let line = e.span().map(|s| text[..s.start.min(text.len())].matches('\n').count() + 1);
            (line, format!("{}; correct it or leave it out", record::words::with_meant(e.message())))
        })?;
        match s.check() {
            Ok(()) => Ok(s),
            Err((table, index, key, cure)) => {
                let line = line_of(text, table, index, key);
                let of = if table.is_empty() { String::new() } else { format!("[{table}] ") };
                Err((line, format!("{of}{key}: give {cure}")))
            }
        }
    }

    /// Sees that every FMU named is there.
    fn check_files(&self, text: &str, dir: &Path) -> Result<(), (Option<usize>, String)> {
        let tips = self.tip.iter().enumerate().map(|(i, t)| ("tip.contact", i, &t.contact));
        for (table, i, c) in self.contact.iter().map(|c| ("contact", 0, c)).chain(tips) {
            if let Some(f) = c.fmu.as_ref().filter(|f| !dir.join(f).is_file()) {
                let line = line_of(text, table, i, "fmu");
                let cure = "give its path from the scenario's folder";
                return Err((line, format!("[{table}] fmu: there is no file {}; {cure}", dir.join(f).display())));
            }
        }
        Ok(())
    }

    /// All drop heights, m; empty with an impact speed or a contactor.
    pub fn heights(&self) -> Vec<f64> {
        self.drop_height.iter().chain(&self.drop_heights).copied().collect()
    }

    /// Impacts to simulate at most.
    pub fn most_impacts(&self) -> usize {
        self.impacts.unwrap_or(if self.kind == Kind::DropTest { 1 } else { 10_000 })
    }

    /// Masses of tip-less parts and of the tip number `tip`, all together, kg.
    pub fn moving_mass(&self, tip: Option<&Tip>) -> f64 {
        let own = tip.map_or(0.0, |t| t.mass);
        match (&self.masses, self.mass) {
            (Some(m), _) => m.accelerometer + m.body + if own > 0.0 { own } else { m.tip },
            (None, m) => m.unwrap_or(0.0) + own,
        }
    }

    fn check(&self) -> Result<(), Place> {
        self.check_bodies()?;
        need(zero(self.guide_friction), "guide_friction", "a force from 0 on, in N")?;
        let once = "either this or [motion.guide_friction] friction, not both";
        need(self.guide_friction == 0.0 || !self.motion.gives("guide_friction", "friction"), "guide_friction", once)?;
        let once = "either this or [motion.residual_magnetism] magnet_force, not both";
        let held = self.motion.gives("residual_magnetism", "magnet_force");
        need(self.holding_force == 0.0 || !held, "holding_force", once)?;
        need((1..=10_000).contains(&self.most_impacts()), "impacts", "1 to 10000")?;
        need(zero(self.rest_height), "rest_height", "a height from 0 on, in m")?;
        match self.kind {
            Kind::DropTest => self.check_drop()?,
            Kind::ContactorOpening => self.check_contactor()?,
        }
        self.check_contacts()?;
        let runs = self.heights().len().max(1) * self.tip.len().max(1) * (1 + self.compare.len());
        need(runs <= MOST_RUNS, "drop_heights", "fewer heights, tips or comparisons: at most 100000 runs")
    }

    fn check_bodies(&self) -> Result<(), Place> {
        match (self.mass, &self.masses) {
            (Some(m), None) => need(good(m), "mass", "a mass above 0, in kg")?,
            (None, Some(m)) => {
                need_in(good(m.accelerometer), "masses", "accelerometer", "a mass above 0, in kg")?;
                need_in(good(m.body), "masses", "body", "a mass above 0, in kg")?;
                let own = !self.tip.is_empty() && self.tip.iter().all(|t| t.mass > 0.0);
                need_in(good(m.tip) || own, "masses", "tip", "a mass above 0, in kg, or a mass in every [[tip]]")?;
            }
            _ => return Err(("", 0, "mass", "either mass, in kg, or a table [masses], not both".into())),
        }
        if self.model == Model::ThreeMass {
            need(self.masses.is_some(), "model", "[masses] accelerometer, body and tip with three_mass")?;
            need(self.kind == Kind::DropTest, "model", "reduced: a contactor has one body")?;
            need(self.sensors.is_some(), "model", "[sensors] with the stiffness of both sensors with three_mass")?;
        }
        if let Some(s) = &self.sensors {
            let ratio = |z: f64| (0.0..1.0).contains(&z);
            need(self.model == Model::ThreeMass, "model", "three_mass with [sensors], or leave [sensors] out")?;
            let at = "sensors";
            need_in(good(s.accelerometer_stiffness), at, "accelerometer_stiffness", "a stiffness above 0, in N/m")?;
            need_in(good(s.transducer_stiffness), at, "transducer_stiffness", "a stiffness above 0, in N/m")?;
            need_in(ratio(s.accelerometer_damping_ratio), at, "accelerometer_damping_ratio", "0 to below 1")?;
            need_in(ratio(s.transducer_damping_ratio), at, "transducer_damping_ratio", "0 to below 1")?;
        }
        Ok(())
    }

    fn check_drop(&self) -> Result<(), Place> {
        let heights = self.heights();
        let key = if self.drop_heights.is_empty() { "drop_height" } else { "drop_heights" };
        if let Some(v) = self.impact_speed {
            need(heights.is_empty(), key, "either a drop height or impact_speed, not both")?;
            need(good(v), "impact_speed", "a speed above 0, in m/s")?;
            need(self.photo_interrupters.is_none(), "impact_speed", "a drop height instead: interrupters time a fall")?;
        } else {
            need(!heights.is_empty(), "drop_height", "either drop_height, in m, or impact_speed, in m/s")?;
            need(heights.iter().all(|h| good(*h)), key, "heights above 0, in m")?;
            let least = self.tip.iter().map(|t| self.moving_mass(Some(t))).fold(f64::INFINITY, f64::min);
            let least = if self.tip.is_empty() { self.moving_mass(None) } else { least };
            let cure = "less than the weight, or the body hangs";
            need(self.guide_friction < least * GRAVITY, "guide_friction", cure)?;
        }
        if self.most_impacts() > 1 {
            need(self.gravity, "gravity", "true with several impacts, or the body does not come back")?;
        }
        if let Some(p) = &self.photo_interrupters {
            let at = "photo_interrupters";
            need_in(good(p.spacing), at, "spacing", "a distance above 0, in m")?;
            need_in(zero(p.last_to_touch), at, "last_to_touch", "a distance from 0 on, in m")?;
            need_in((3..=12).contains(&p.count), at, "count", "3 to 12")?;
            need_in(zero(p.clock), at, "clock", "a time from 0 on, in s")?;
            let first = p.last_to_touch + (p.count - 1) as f64 * p.spacing;
            let cure = "less than the drop height leaves above the last interrupter: the first one stands higher";
            need_in(heights.iter().all(|h| *h > first), at, "spacing", cure)?;
        }
        Ok(())
    }

    fn check_contactor(&self) -> Result<(), Place> {
        need(self.drop_height.is_none(), "drop_height", "travel instead of it for a contactor")?;
        need(self.drop_heights.is_empty(), "drop_heights", "travel instead of them for a contactor")?;
        need(self.impact_speed.is_none(), "impact_speed", "travel instead of it for a contactor")?;
        let none = self.photo_interrupters.is_none();
        need_in(none, "photo_interrupters", "spacing", "no interrupters for a contactor")?;
        need(good(self.travel), "travel", "a travel above 0, in m")?;
        need(good(self.spring_preload), "spring_preload", "a force above 0, in N")?;
        need(zero(self.return_spring_rate), "return_spring_rate", "a rate from 0 on, in N/m")?;
        let end = self.spring_preload - self.return_spring_rate * self.travel;
        need(end > self.guide_friction, "spring_preload", "one that still pushes harder than friction at the stop")?;
        need(zero(self.holding_force), "holding_force", "a force from 0 on, in N")?;
        let fades = self.holding_force == 0.0 || good(self.holding_time);
        need(fades, "holding_time", "a time above 0, in s")
    }

    fn check_contacts(&self) -> Result<(), Place> {
        let at = |table: &'static str, i: usize| move |(key, cure): Fault| (table, i, key, cure);
        match (&self.contact, self.tip.is_empty()) {
            (Some(c), true) => {
                c.parameters().map_err(at("contact", 0))?;
            }
            (None, false) => {}
            (None, true) => return Err(("", 0, "contact", "a table [contact] with stiffness and exponent".into())),
            (Some(_), false) => return Err(("", 0, "contact", "either [contact] or [[tip]], not both".into())),
        }
        for (i, t) in self.tip.iter().enumerate() {
            if !zero(t.mass) {
                return Err(("tip", i, "mass", "a mass from 0 on, in kg".into()));
            }
            t.contact.parameters().map_err(at("tip.contact", i))?;
        }
        for (i, c) in self.compare.iter().enumerate() {
            let k = match (&c.faces, c.stiffness) {
                (Some(f), None) => f.stiffness().map_err(at("compare", i))?,
                (None, Some(k)) => k,
                _ => return Err(("compare", i, "stiffness", "either stiffness, in N/m^p, or faces".into())),
            };
            if !good(k) {
                return Err(("compare", i, "stiffness", "a stiffness above 0, in N/m^p".into()));
            }
        }
        Ok(())
    }
}

/// Reads a file and says what it is, or fails as [`Scenario::load`] does; for tests and other commands.
impl std::str::FromStr for Scenario {
    type Err = anyhow::Error;

    fn from_str(text: &str) -> Result<Scenario> {
        match Scenario::parse(text) {
            Ok(s) => Ok(s),
            Err((Some(n), what)) => bail!("line {n}: {what}"),
            Err((None, what)) => bail!("{what}"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_kind_is_spelt_with_either_hyphen_and_a_slip_finds_its_word() {
        let text = |kind: &str| {
            format!("kind = \"{kind}\"\nmass = 1.0\nimpact_speed = 1.0\n[contact]\nstiffness = 7e6\nexponent = 1.0\n")
        };
        for kind in ["drop_test", "drop-test"] {
            assert_eq!(Scenario::parse(&text(kind)).unwrap().kind, Kind::DropTest);
        }
        let (line, what) = Scenario::parse(&text("droptest")).unwrap_err();
        assert_eq!(line, Some(1));
        assert!(what.starts_with("kind \"droptest\" is not known; did you mean \"drop_test\"?"), "{what}");
    }
}
