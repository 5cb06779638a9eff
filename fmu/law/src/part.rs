//! What a part of the contact law declares about itself: its parameters, what a reader has to know of it, and how a fit
//! searches it. All of it is static data; FMU variables, model description, scenario keys and diagnosis follow from it.

use crate::{Memory, ParameterError, Parameters};

/// Type of a parameter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// A real number.
    Real,
    /// One of a list, kept as `i32`: the place in the list.
    Enumeration(&'static [Item]),
}

/// One of the items to choose from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Item {
    /// Name, a word that stands in files and in a simulator's list.
    pub name: &'static str,
    /// What it does, in one line.
    pub text: &'static str,
}

impl Kind {
    /// The items to choose from, numbered from 0 on; none for a number.
    pub const fn items(self) -> &'static [Item] {
        match self {
            Kind::Real => &[],
            Kind::Enumeration(items) => items,
        }
    }
}

/// What a parameter may be.
#[derive(Clone, Copy)]
pub struct Range {
    /// Least value that the model description names; None: none.
    pub least: Option<f64>,
    /// Largest value that the model description names; None: none.
    pub most: Option<f64>,
    /// The range in words, for errors.
    pub words: &'static str,
    /// Whether a finite value is within.
    pub holds: fn(f64) -> bool,
}

impl Range {
    /// Above 0.
    pub const POSITIVE: Range = Range { least: None, most: None, words: "a finite number above 0", holds: |v| v > 0.0 };
    /// From 0 on.
    pub const FROM_ZERO: Range =
        Range { least: Some(0.0), most: None, words: "a finite number from 0 on", holds: |v| v >= 0.0 };
    /// A power of the depth.
    pub const POWER: Range =
        Range { least: Some(0.5), most: Some(5.0), words: "0.5 to 5", holds: |v| (0.5..=5.0).contains(&v) };
    /// A power of the depth, or 0 for the exponent of the elastic law.
    pub const POWER_OR_ZERO: Range = Range {
        least: Some(0.0),
        most: Some(5.0),
        words: "0, or 0.5 to 5",
        holds: |v| v == 0.0 || (0.5..=5.0).contains(&v),
    };
}

/// One parameter of a part.
#[derive(Clone, Copy)]
pub struct Parameter {
    /// Name: FMU variable and scenario key.
    pub name: &'static str,
    /// Value reference in the FMU.
    pub reference: u32,
    /// Type.
    pub kind: Kind,
    /// Unit; empty for a choice.
    pub unit: &'static str,
    /// Unit a host should show it in; empty: `unit`.
    pub display: &'static str,
    /// Value at which it is left alone, plain SI.
    pub neutral: f64,
    /// What it may be.
    pub range: Range,
    /// What it is, in one line.
    pub text: &'static str,
    /// Reads it.
    pub get: fn(&Parameters) -> f64,
    /// Sets it, unchecked; the number of a choice loses its fraction.
    pub set: fn(&mut Parameters, f64),
}

impl core::fmt::Debug for Parameter {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(self.name)
    }
}

impl Parameter {
    /// Checks a value against the range.
    ///
    /// # Errors
    /// Name, value, and what it may be.
    pub fn check(&self, value: f64) -> Result<(), ParameterError> {
        let whole = self.kind == Kind::Real || value.fract() == 0.0;
        if value.is_finite() && whole && (self.range.holds)(value) {
            Ok(())
        } else {
            Err(ParameterError { name: self.name, value, expected: self.range.words })
        }
    }
}

/// Sizes typical of a campaign, plain SI: what makes searched parameters dimensionless.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scales {
    /// Force, N.
    pub force: f64,
    /// Depth, m.
    pub depth: f64,
    /// Speed, m/s.
    pub speed: f64,
    /// Duration of a contact, s.
    pub duration: f64,
    /// Moving mass, kg.
    pub mass: f64,
    /// Length of a recording, s.
    pub length: f64,
    /// Sampling interval, s.
    pub dt: f64,
    /// Depth, m, that anchors the reference force and the damping ratio.
    pub x_ref: f64,
    /// Speed, m/s, that anchors the damping ratio.
    pub v_ref: f64,
    /// Number of recordings.
    pub orders: f64,
    /// Largest peak force, N (or mass times peak acceleration).
    pub peak: f64,
    /// Depth of the deepest impact, m.
    pub deepest: f64,
}

/// The part of the system a mechanism sits in.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Origin {
    /// Between the faces.
    Contact,
    /// On the body.
    Motion,
    /// In the measuring chain.
    Chain,
}

impl Origin {
    /// The word the verdict uses.
    pub fn name(self) -> &'static str {
        match self {
            Origin::Contact => "contact",
            Origin::Motion => "motion",
            Origin::Chain => "chain",
        }
    }
}

/// The kind of an experiment.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Experiment {
    /// A body falls on a stop.
    DropTest,
    /// A contactor opens and its armature meets the stop.
    ContactorOpening,
    /// A face is pressed in slowly and drawn back.
    Indentation,
}

/// Every kind of experiment.
pub const EVERY_EXPERIMENT: &[Experiment] =
    &[Experiment::DropTest, Experiment::ContactorOpening, Experiment::Indentation];

/// What the strength of an effect is measured by, phase by phase.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Strength {
    /// The difference it makes to the contact force or the reading.
    Reading,
    /// The contact force, to which it is proportional.
    ContactForce,
}

/// A parameter that a fit searches, dimensionless.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Searched {
    /// Name.
    pub name: &'static str,
    /// Lower bound.
    pub lower: f64,
    /// Upper bound.
    pub upper: f64,
    /// Step for differences.
    pub step: f64,
    /// Mean and standard deviation of what is known beforehand; None: nothing.
    pub prior: Option<(f64, f64)>,
    /// Another upper bound in one kind of experiment.
    pub upper_in: Option<(Experiment, f64)>,
}

/// A searched parameter without prior, its bounds the same in every experiment.
pub const fn searched(name: &'static str, lower: f64, upper: f64, step: f64) -> Searched {
    Searched { name, lower, upper, step, prior: None, upper_in: None }
}

/// A quantity, plain SI, that a fitted form reports.
#[derive(Clone, Copy)]
pub struct Quantity {
    /// Name.
    pub name: &'static str,
    /// Unit.
    pub unit: &'static str,
    /// From the searched parameters.
    pub value: fn(&[f64], &Scales) -> f64,
}

/// One form in which a mechanism is searched.
#[derive(Clone, Copy)]
pub struct Form {
    /// Label, one of its mechanism's own.
    pub label: &'static str,
    /// What is searched; of a form that extends another, that form's parameters first.
    pub parameters: &'static [Searched],
    /// Values a search starts from, for each parameter; all combinations are tried. Of a form that extends another: for
    /// each further parameter.
    pub starts: &'static [&'static [f64]],
    /// Whether the first parameter is an amplitude in which the effect is linear while small.
    pub linear: bool,
    /// Label of the form it extends; None: it stands for itself.
    pub extends: Option<&'static str>,
    /// Kinds of experiment it is offered in.
    pub experiments: &'static [Experiment],
    /// Whether the hysteresis damping goes with 1/impact speed, as given at the reference speed (Lankarani and
    /// Nikravesh 1990).
    pub per_impact_speed: bool,
    /// Puts the searched parameters into the law.
    pub apply: fn(&[f64], &Scales, &mut Parameters),
    /// What it reports.
    pub quantities: &'static [Quantity],
}

/// What a fit of a mechanism starts from, beside the starts of its forms.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StartsFrom {
    /// Nothing else.
    Forms,
    /// The drift of the stiffness with the order of the recordings, fitted with every recording's stiffness free.
    Drift,
    /// The law of the shallower recordings.
    Shallow,
}

/// A mechanism as the vocabulary has it.
#[derive(Clone, Copy)]
pub struct Mechanism {
    /// Name in the vocabulary.
    pub name: &'static str,
    /// The part of the system it sits in.
    pub origin: Origin,
    /// What it does, in a sentence without full stop.
    pub sentence: &'static str,
    /// Equation.
    pub equation: &'static str,
    /// Author, year.
    pub source: &'static str,
    /// What to do about it.
    pub cure: &'static str,
    /// Its parameters.
    pub parameters: &'static [Parameter],
    /// Its forms, in the order they are tried.
    pub forms: &'static [Form],
    /// Names of mechanisms that are hard to distinguish from it.
    pub collinear: &'static [&'static str],
    /// Whether its effect is far from linear in its parameters, so that a score along a tangent may miss it.
    pub strongly_nonlinear: bool,
    /// What its fits start from.
    pub starts_from: StartsFrom,
    /// What its strength is measured by.
    pub strength: Strength,
}

/// The cure of a mechanism that the element holds.
pub const HELD: &str = "The element now holds it: import the FMU written beside this report.";

/// A point of the contact, as a damping force sees it.
#[derive(Clone, Copy)]
pub struct Point<'a> {
    /// The whole law.
    pub law: &'a Parameters,
    /// Penetration, m, > 0.
    pub x: f64,
    /// Speed, m/s.
    pub v: f64,
    /// (force N, slope N/m) of the loading or unloading branch at `x`.
    pub branch: (f64, f64),
}

/// A step of the contact, in which a part's memory moves.
#[derive(Clone, Copy)]
pub struct Step<'a> {
    /// The whole law.
    pub law: &'a Parameters,
    /// Memory before.
    pub before: &'a Memory,
    /// Penetration before, m.
    pub x0: f64,
    /// Penetration after, m.
    pub x1: f64,
    /// Duration, s.
    pub dt: f64,
}

/// A part of the contact law: what it declares and what it adds. A part that only adds a force with a potential or a
/// damping force is whole with these; what is not given is none. So that a part that is off costs no more than a
/// comparison, a force that takes more than a power stands in a function that is not inlined.
pub trait Part: Copy + PartialEq + Default {
    /// What it declares.
    const MECHANISM: Mechanism;

    /// Whether it adds nothing.
    fn is_neutral(&self) -> bool;

    /// Whether it keeps F = k x^p + mu_d x^p v as it is.
    #[inline(always)]
    fn keeps_power_law(&self) -> bool {
        self.is_neutral()
    }

    /// Checks what the ranges of the single parameters, checked before, do not say.
    ///
    /// # Errors
    /// The parameter at fault.
    fn check(&self, _law: &Parameters) -> Result<(), ParameterError> {
        Ok(())
    }

    /// (force N, slope N/m) at `x` m, > 0, of a force that has a potential.
    #[inline(always)]
    fn spring(&self, _x: f64) -> Option<(f64, f64)> {
        None
    }

    /// Energy of that force at `x` m, J, zero at 0 and below.
    #[inline(always)]
    fn spring_energy(&self, _x: f64) -> Option<f64> {
        None
    }

    /// (force N, d/dx N/m, d/dv N s/m) of a force that has none; asked only where a branch of the elastic law acts.
    #[inline(always)]
    fn damper(&self, _at: &Point<'_>) -> Option<(f64, f64, f64)> {
        None
    }

    /// Whether [`Part::damper`] gives any.
    #[inline(always)]
    fn damps(&self) -> bool {
        false
    }

    /// Depth, m, at which the damping force has a kink.
    #[inline(always)]
    fn kink(&self) -> Option<f64> {
        None
    }

    /// Whether the damping force has a kink where the speed changes sign.
    #[inline(always)]
    fn kink_at_rest(&self) -> bool {
        false
    }

    /// Moves what the part remembers in `after`, whose deepest point is that after the step already.
    #[inline(always)]
    fn remember(&self, _step: &Step<'_>, _after: &mut Memory) {}

    /// Multiplies every stiffness it has by `factor`.
    #[inline(always)]
    fn scale_stiffness(&mut self, _factor: f64) {}
}

/// A part's struct, its neutral default and the declaration of its parameters, from one list: field, type, neutral
/// value, name, value reference, unit, unit to show, range, text, and the items where it is a choice.
macro_rules! parameters {
    ($(#[$meta:meta])* $part:ident: $Part:ident {$(
        $(#[$doc:meta])*
        $field:ident: $type:ident = $neutral:literal, $name:literal, $reference:literal, $unit:literal, $display:literal,
        $range:expr, $text:literal $(, $items:expr)?;
    )*}) => {
        $(#[$meta])*
        #[derive(Clone, Copy, Debug, PartialEq)]
        pub struct $Part {$(
            $(#[$doc])*
            pub $field: $type,
        )*}

        impl Default for $Part {
            fn default() -> Self {
                $Part { $($field: $neutral),* }
            }
        }

        const PARAMETERS: &[crate::part::Parameter] = &[$(crate::part::Parameter {
            name: $name,
            reference: $reference,
            kind: crate::part::parameters!(kind $type $($items)?),
            unit: $unit,
            display: $display,
            neutral: $neutral as f64,
            range: $range,
            text: $text,
            get: |p| p.$part.$field as f64,
            set: |p, v| p.$part.$field = v as $type,
        }),*];
    };
    (kind f64) => { crate::part::Kind::Real };
    (kind i32 $items:expr) => { crate::part::Kind::Enumeration($items) };
}
pub(crate) use parameters;
