//! Scenarios a user writes in TOML: a drop test, or the opening of a magnetic contactor.

mod motion;

pub use motion::{simulate, Bounce, Outcome, Row};

use anyhow::{bail, Context, Result};
use hysteresis_contact::law::Parameters;
use serde::Deserialize;
use std::path::Path;

/// Standard gravity, m/s^2.
pub const GRAVITY: f64 = 9.80665;

/// What moves, and what drives it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Kind {
    /// A body falls on the stop (Ahn and Ryu 2005, eq. 6).
    DropTest,
    /// A bar is driven by its return spring, against a holding force that fades, on the stop.
    ContactorOpening,
}

/// A scenario file. Plain SI.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Scenario {
    /// What moves.
    pub kind: Kind,
    /// Mass, kg, > 0.
    pub mass: f64,
    /// Drop height, m, > 0; needs gravity.
    pub drop_height: Option<f64>,
    /// Speed at touch, m/s, > 0, instead of a drop height.
    pub impact_speed: Option<f64>,
    /// Whether gravity acts along +x, into the stop.
    #[serde(default)]
    pub gravity: bool,
    /// Coulomb friction of the guide, N, >= 0, smoothed as tanh(v / (1 mm/s)).
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
    /// Impacts to simulate at most, 1 to 1000; a rebound below `rest_height` ends them sooner.
    #[serde(default = "one")]
    pub impacts: usize,
    /// Rebound height taken as rest, m, >= 0.
    #[serde(default)]
    pub rest_height: f64,
    /// The contact.
    pub contact: Contact,
}

fn one() -> usize {
    1
}

/// The contact's parameters by the names of the FMU's contract.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Contact {
    /// k, N/m^p.
    pub stiffness: f64,
    /// p.
    pub exponent: f64,
    /// mu_d, N s/m^(p+1).
    #[serde(default)]
    pub hysteresis_damping: f64,
    /// c, N s/m.
    #[serde(default)]
    pub viscous_damping: f64,
}

impl Scenario {
    /// Reads and checks a file.
    ///
    /// # Errors
    /// Names the file, the line and the cure.
    pub fn load(path: &Path) -> Result<Scenario> {
        let text = std::fs::read_to_string(path)
            .with_context(|| format!("{}: cannot be read; give the path of a scenario file", path.display()))?;
        let s: Scenario = toml::from_str(&text).with_context(|| format!("{}: not a scenario", path.display()))?;
        if let Err((key, cure)) = s.check() {
            let line = text.lines().position(|l| l.split('=').next().is_some_and(|k| k.trim() == key));
            match line {
                Some(n) => bail!("{}:{}: {key}: give {cure}", path.display(), n + 1),
                None => bail!("{}: {key} is absent: give {cure}", path.display()),
            }
        }
        Ok(s)
    }

    /// The law's parameters.
    pub fn parameters(&self) -> Parameters {
        Parameters {
            stiffness: self.contact.stiffness,
            exponent: self.contact.exponent,
            hysteresis_damping: self.contact.hysteresis_damping,
            viscous_damping: self.contact.viscous_damping,
            ..Parameters::default()
        }
    }

    fn check(&self) -> std::result::Result<(), (&'static str, String)> {
        let good = |x: f64| x.is_finite() && x > 0.0;
        let zero = |x: f64| x.is_finite() && x >= 0.0;
        let need = |ok: bool, key, cure: &str| if ok { Ok(()) } else { Err((key, cure.to_string())) };
        need(good(self.mass), "mass", "a mass above 0, in kg")?;
        need(zero(self.guide_friction), "guide_friction", "a force from 0 on, in N")?;
        need((1..=1000).contains(&self.impacts), "impacts", "1 to 1000")?;
        need(zero(self.rest_height), "rest_height", "a height from 0 on, in m")?;
        match self.kind {
            Kind::DropTest => match (self.drop_height, self.impact_speed) {
                (Some(h), None) => {
                    need(good(h), "drop_height", "a height above 0, in m")?;
                    need(self.gravity, "drop_height", "gravity = true with it, or an impact_speed instead")?;
                    let weight = self.mass * GRAVITY;
                    need(self.guide_friction < weight, "guide_friction", "less than the weight, or the body hangs")?;
                }
                (None, Some(v)) => need(good(v), "impact_speed", "a speed above 0, in m/s")?,
                _ => return Err(("drop_height", "either drop_height or impact_speed, not both".into())),
            },
            Kind::ContactorOpening => {
                need(self.drop_height.is_none(), "drop_height", "travel instead of it for a contactor")?;
                need(self.impact_speed.is_none(), "impact_speed", "travel instead of it for a contactor")?;
                need(good(self.travel), "travel", "a travel above 0, in m")?;
                need(good(self.spring_preload), "spring_preload", "a force above 0, in N")?;
                need(zero(self.return_spring_rate), "return_spring_rate", "a rate from 0 on, in N/m")?;
                let end = self.spring_preload - self.return_spring_rate * self.travel;
                need(
                    end > self.guide_friction,
                    "spring_preload",
                    "one that still pushes harder than friction at the stop",
                )?;
                need(zero(self.holding_force), "holding_force", "a force from 0 on, in N")?;
                let fades = self.holding_force == 0.0 || good(self.holding_time);
                need(fades, "holding_time", "a time above 0, in s")?;
            }
        }
        self.parameters().validate().map_err(|e| (e.name, e.expected.to_string()))
    }
}
