//! What a mechanism is: one name of the vocabulary (or beyond it), its forms, and how each enters the physics.

use crate::physics::Physics;
pub use law::part::{Origin, Scales, StartsFrom};
use record::{Channel, Kind};

/// A campaign-wide parameter.
#[derive(Clone, Debug, PartialEq)]
pub struct Parameter {
    pub name: String,
    pub lower: f64,
    pub upper: f64,
    /// Step for differences.
    pub step: f64,
    /// Mean and standard deviation of a tolerance.
    pub prior: Option<(f64, f64)>,
    /// False where it changes the chain alone, so that no new simulation is needed.
    pub dynamic: bool,
}

/// What a mechanism may ask of the campaign before it offers forms.
#[derive(Clone, Debug)]
pub struct Context {
    pub kind: Kind,
    /// Which channels are recorded: force, acceleration, penetration.
    pub has: [bool; 3],
    pub scales: Scales,
    /// Terms the simulation holds already.
    pub terms: Vec<String>,
    /// Largest magnitude read on each channel, SI.
    pub top: [f64; 3],
    /// The channel whose recordings of different levels end in one and the same reading.
    pub flat: Option<Channel>,
    /// Strongest line of the force channel once the body has left, rad/s, where one stands out.
    pub ring: Option<f64>,
}

impl Context {
    /// Whether the motion is imposed, so that nothing moves by the forces on the body.
    pub fn is_imposed(&self) -> bool {
        self.kind == Kind::Indentation
    }
}

/// Applies a form's parameters (dimensionless, in the order of `Form::parameters`) to the physics.
pub type Apply = fn(&[f64], &Context, &mut Physics);

/// (name, value, unit) of a form's parameters in SI.
pub type Describe = fn(&[f64], &Context) -> Vec<(&'static str, f64, &'static str)>;

/// One form of a mechanism.
#[derive(Clone)]
pub struct Form {
    pub label: &'static str,
    pub parameters: Vec<Parameter>,
    /// Where a search starts; several where the effect is not convex. Of a form that extends another: the further
    /// parameters alone.
    pub starts: Vec<Vec<f64>>,
    /// Whether the first parameter is an amplitude in which the effect is linear while small.
    pub linear: bool,
    /// Label of the form whose parameters come first in this one's, and have the same meaning: it is tried only from that
    /// form's fit, and only where that leaves more than noise.
    pub extends: Option<&'static str>,
    pub apply: Apply,
    pub describe: Describe,
}

impl Form {
    /// Puts this form with the parameters `t`, dimensionless and in the order of [`Form::parameters`], into `p`.
    pub fn apply(&self, t: &[f64], c: &Context, p: &mut Physics) {
        (self.apply)(t, c, p);
    }

    /// (name, value, unit) of the parameters `t` in SI.
    pub fn describe(&self, t: &[f64], c: &Context) -> Vec<(&'static str, f64, &'static str)> {
        (self.describe)(t, c)
    }

    /// Of each of [`Form::describe`]'s quantities, whether it is a constant that no parameter moves from `t`.
    pub fn held(&self, t: &[f64], c: &Context) -> Vec<bool> {
        let said = self.describe(t, c);
        let moved = self.parameters.iter().enumerate().map(|(j, p)| {
            let mut v = t.to_vec();
            v[j] += p.step;
            self.describe(&v, c)
        });
        let moved: Vec<_> = moved.collect();
        (0..said.len()).map(|i| moved.iter().all(|m| m[i].1 == said[i].1)).collect()
    }

    /// This form with `further` parameters, which start from each of `starts`.
    pub fn extended(&self, label: &'static str, further: Vec<Parameter>, starts: Vec<Vec<f64>>) -> Form {
        let parameters = [self.parameters.clone(), further].concat();
        Form { label, parameters, starts, extends: Some(self.label), ..self.clone() }
    }
}

/// A mechanism.
#[derive(Clone, Copy)]
pub struct Mechanism {
    pub name: &'static str,
    pub origin: Origin,
    /// False for what stands in for physics nobody has named: it makes a verdict "unexplained".
    pub named: bool,
    pub equation: &'static str,
    pub source: &'static str,
    pub sentence: &'static str,
    /// What to do about it where the element itself is right, or what the element now holds.
    pub cure: &'static str,
    pub forms: fn(&Context) -> Vec<Form>,
    /// What its strength is measured by.
    pub acts: Acts,
    /// What search and report have to know of it beyond its forms.
    pub hints: Hints,
}

/// What search and report have to know of a mechanism beyond its forms.
#[derive(Clone, Copy, Debug)]
pub struct Hints {
    /// Whether its effect is far from linear in its parameters, so that a score along a tangent may miss it.
    pub strongly_nonlinear: bool,
    /// What its fits start from, beside the starts of its forms.
    pub starts_from: StartsFrom,
    /// Whether its parameter is one of a calibration, which the base already holds within a tolerance.
    pub is_calibration: bool,
    /// Whether it limits a reading, which shows as a flat top without any fit.
    pub limits_reading: bool,
    /// Whether it depends on the recordings taken before, so that a fresh spot shows it.
    pub depends_on_history: bool,
    /// Whether it swings on when nothing touches the body any more, which its acceleration shows.
    pub rings: bool,
    /// Whether it stands in for the unknown with so many parameters that it absorbs some of everything.
    pub is_flexible: bool,
    /// Names that no recordings of this kind distinguish from it.
    pub collinear_with: &'static [&'static str],
    /// Names of what does the opposite: both at once are one effect of another course, not two.
    pub opposite_of: &'static [&'static str],
    /// Kinds of campaigns whose rig declares it, so that a simulation that lists it holds it already.
    pub declared_by_rig: &'static [Kind],
}

impl Hints {
    /// Of a mechanism of which there is nothing to know but its forms.
    pub const PLAIN: Hints = Hints {
        strongly_nonlinear: false,
        starts_from: StartsFrom::Forms,
        is_calibration: false,
        limits_reading: false,
        depends_on_history: false,
        rings: false,
        is_flexible: false,
        collinear_with: &[],
        opposite_of: &[],
        declared_by_rig: &[],
    };
}

impl Mechanism {
    /// Its forms for a campaign; those that extend another come behind it.
    pub fn forms(&self, c: &Context) -> Vec<Form> {
        (self.forms)(c)
    }
}

/// How the strength of an effect is spread over the phases.
#[derive(Clone, Copy, Debug)]
pub enum Acts {
    /// By the difference it makes to the contact force or the reading.
    Reading,
    /// By the force on the body that it adds to contact and drive.
    Force,
    /// While the stop is pushed: proportional to the contact force.
    Push,
    /// By the force on the body that neither contact nor drive nor weight gives: what rides on the body exerts it.
    Rider,
}

/// A parameter of a form; dynamic unless `chain`.
pub fn parameter(name: &str, lower: f64, upper: f64, step: f64) -> Parameter {
    Parameter { name: name.to_string(), lower, upper, step, prior: None, dynamic: true }
}

/// A parameter that changes the chain alone.
pub fn chain_parameter(name: &str, lower: f64, upper: f64, step: f64) -> Parameter {
    Parameter { dynamic: false, ..parameter(name, lower, upper, step) }
}

/// All combinations of the values given for each parameter.
pub fn grid(values: &[&[f64]]) -> Vec<Vec<f64>> {
    values.iter().fold(vec![Vec::new()], |acc, v| {
        acc.iter().flat_map(|a| v.iter().map(move |x| [a.as_slice(), &[*x]].concat())).collect()
    })
}
