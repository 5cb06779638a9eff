//! loose_part: a part loose inside the body strikes late

use crate::mechanism::*;
use crate::part::Part;
use crate::physics::Physics;
use record::Kind;

/// a mass m_l strikes inside the body after a gap (Lieber and Jensen 1945 (acceleration damper); its contact linear or of any power: Hertz 1882).
pub const MECHANISM: Mechanism = Mechanism {
    name: "loose_part",
    origin: Origin::Motion,
    named: true,
    equation: "a mass m_l strikes inside the body after a gap",
    source: "Lieber and Jensen 1945 (acceleration damper); Hertz 1882 (its contact of power 1.5)",
    sentence: "a part loose inside the body strikes late",
    cure: "The contact element is right; in the rig's model split the body as given here, or fasten the part.",
    forms,
    acts: Acts::Rider,
    hints: Hints { strongly_nonlinear: true, rings: true, ..Hints::PLAIN },
};

/// A part loose inside the body, taken out of the moving mass.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LoosePart {
    /// kg; 0: none.
    pub mass: f64,
    /// Way to the wall before it, m.
    pub gap: f64,
    /// Way to a wall behind it, alike in stiffness and damping, m; infinite: none.
    pub back: f64,
    /// Stiffness of its contact with a wall, N/m; of one that is not linear, of the chord to `reference`.
    pub stiffness: f64,
    /// Power of that contact's force over its depth, 1: linear, 1.5: Hertz 1882.
    pub exponent: f64,
    /// Depth of that contact at which the force is `stiffness` times the depth whatever the power, m.
    pub reference: f64,
    /// Damping of that contact, N s/m.
    pub damping: f64,
    /// Way over which that damping comes in, m; 0: at once.
    pub ramp: f64,
    /// Whether the body bears the part's weight although the part flies free inside it.
    pub borne: bool,
}

impl Default for LoosePart {
    fn default() -> Self {
        LoosePart {
            mass: 0.0,
            gap: 0.0,
            back: f64::INFINITY,
            stiffness: 0.0,
            exponent: 1.0,
            reference: 0.0,
            damping: 0.0,
            ramp: 0.0,
            borne: false,
        }
    }
}

impl Part for LoosePart {
    const RIDES: bool = true;

    #[inline]
    fn needs_integration(&self) -> bool {
        self.mass > 0.0
    }
    #[inline]
    fn riding_mass(&self) -> f64 {
        self.mass
    }
    /// From the wall before it once the gap is closed, from the wall behind it once the play there is.
    #[inline]
    fn riding_force(&self, z: f64, w: f64) -> f64 {
        let pushed = |e: f64, w: f64| {
            let come = if e < self.ramp { e / self.ramp } else { 1.0 };
            let pressed =
                if self.exponent == 1.0 { e } else { self.reference * (e / self.reference).powf(self.exponent) };
            (self.stiffness * pressed + come * self.damping * w).max(0.0)
        };
        if z > self.gap {
            pushed(z - self.gap, w)
        } else if z < -self.back {
            -pushed(-z - self.back, -w)
        } else {
            0.0
        }
    }
    fn riding_play(&self, z: f64) -> f64 {
        (self.gap - z).min(z + self.back)
    }
    fn riding_seat(&self) -> Option<f64> {
        Some(self.stiffness)
    }
    #[inline]
    fn bears_riding_weight(&self) -> bool {
        self.borne
    }
}

/// Share of the depth to which the part would be pressed over which its damping comes in: there at once, it would jump.
const EASED: f64 = 0.05;

fn forms(c: &Context) -> Vec<Form> {
    if c.is_imposed() {
        return Vec::new();
    }
    let form = |label, apply: Apply| Form {
        label,
        parameters: vec![
            // down to a thousandth of the body: a stiff part that strikes at full speed is felt even so
            parameter("ln mass", -7.0, -0.7, 2e-2),
            parameter("gap", 0.0, 6.0, 3e-3),
            // slower than the impact itself it would be no strike, but a second body on a spring
            parameter("ln frequency", 0.3, 4.0, 2e-2),
            parameter("ln damping", -6.0, 0.5, 5e-2),
        ],
        starts: grid(&[&[-5.0, -3.3, -1.8], &[0.02, 0.3, 0.8, 1.8], &[0.6, 1.2, 2.0], &[-2.0]]),
        linear: false,
        extends: None,
        apply,
        describe: described,
    };
    let plain = form("linear inner contact", |t, c, p| part(t, c, p, false));
    // as in the contact itself, damping that is there at once would pull and jump (Hunt and Crossley 1975)
    let mut eased = plain.extended(
        "linear inner contact, its damping ramped in",
        vec![parameter("ln ramp", -7.0, 0.0, 2e-2)],
        grid(&[&[-4.0, -2.0]]),
    );
    eased.apply = |t, c, p| {
        part(t, c, p, false);
        p.loose_part.ramp = c.scales.depth * t[4].exp();
    };
    eased.describe = |t, c| [described(t, c), vec![("loose_ramp", c.scales.depth * t[4].exp(), "m")]].concat();
    let mut v = vec![plain, eased];
    if c.kind == Kind::DropTest {
        // thrown forward, it comes back against a wall behind it
        let mut both = v[0].extended(
            "linear inner contact on both sides",
            vec![parameter("back", 0.0, 6.0, 3e-3)],
            grid(&[&[0.1, 0.4, 1.0]]),
        );
        both.apply = between;
        both.describe = described_between;
        v.push(both);
        let of = |from: &Form, label: &'static str| {
            let further = vec![parameter("power", 1.0, 2.5, 1e-2)];
            from.extended(label, further, grid(&[&[1.5]]))
        };
        let mut curved = of(&v[0], "inner contact of any power");
        curved.apply = |t, c, p| {
            part(t, c, p, false);
            bend(t[4], c, p);
        };
        curved.describe = |t, c| [described(t, c), vec![("loose_power", t[4], "1")]].concat();
        let mut curved_both = of(&v[2], "inner contact of any power on both sides");
        curved_both.apply = |t, c, p| {
            between(t, c, p);
            bend(t[5], c, p);
        };
        curved_both.describe = |t, c| [described_between(t, c), vec![("loose_power", t[5], "1")]].concat();
        v.push(curved);
        v.push(curved_both);
        v.push(form("linear inner contact, its weight on the body", |t, c, p| part(t, c, p, true)));
    }
    v
}

/// Stiffness of the inner contact, N/m, from the loose part's mass and frequency on it, the latter beside the root of
/// force over mass and depth of the impact.
fn stiffness(t: &[f64], c: &Context) -> f64 {
    c.scales.force / c.scales.depth * (t[0] + 2.0 * t[2]).exp()
}

fn described(t: &[f64], c: &Context) -> Vec<(&'static str, f64, &'static str)> {
    vec![
        ("loose_mass", c.scales.mass * t[0].exp(), "kg"),
        ("loose_gap", c.scales.depth * t[1], "m"),
        ("loose_stiffness", stiffness(t, c), "N/m"),
    ]
}

/// The part between two walls.
fn between(t: &[f64], c: &Context, p: &mut Physics) {
    part(t, c, p, false);
    p.loose_part.back = c.scales.depth * t[4];
}

fn described_between(t: &[f64], c: &Context) -> Vec<(&'static str, f64, &'static str)> {
    [described(t, c), vec![("loose_back", c.scales.depth * t[4], "m")]].concat()
}

/// Depth to which the part is pressed into a linear wall at the speed of the impact, m.
fn pressed(c: &Context, p: &Physics) -> f64 {
    c.scales.speed * (p.loose_part.mass / p.loose_part.stiffness).sqrt()
}

/// Gives the inner contact the power `exponent`, its force at the depth [`pressed`] as it was.
fn bend(exponent: f64, c: &Context, p: &mut Physics) {
    p.loose_part.reference = pressed(c, p);
    p.loose_part.exponent = exponent;
}

fn part(t: &[f64], c: &Context, p: &mut Physics, borne: bool) {
    p.loose_part.mass = c.scales.mass * t[0].exp();
    p.loose_part.gap = c.scales.depth * t[1];
    p.loose_part.stiffness = stiffness(t, c);
    p.loose_part.damping = 2.0 * t[3].exp() * (p.loose_part.stiffness * p.loose_part.mass).sqrt();
    p.loose_part.ramp = EASED * pressed(c, p);
    p.loose_part.borne = borne;
    if c.kind.starts_driven() {
        // a body that a spring sets in motion from rest would leave the part where it was, were it not carried along
        p.loose_part.back = 0.0;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_inner_contact_of_another_power_has_the_linear_ones_force_at_its_reference() {
        let linear = LoosePart { mass: 0.1, gap: 1e-4, back: 2e-4, stiffness: 1e6, ..LoosePart::default() };
        let hertz = LoosePart { exponent: 1.5, reference: 5e-5, ..linear };
        let at = |e: f64| (linear.riding_force(1e-4 + e, 0.0), hertz.riding_force(1e-4 + e, 0.0));
        let (a, b) = at(5e-5);
        assert!((a - 50.0).abs() < 1e-9 && (b - a).abs() < 1e-9, "{a} {b}");
        // four times as deep: eight times the force, and on the other side the same, pulled
        let (a, b) = (hertz.riding_force(1e-4 + 2e-4, 0.0), hertz.riding_force(-2e-4 - 2e-4, 0.0));
        assert!((a - 400.0).abs() < 1e-9 && (a + b).abs() < 1e-9, "{a} {b}");
        assert_eq!(hertz.riding_force(0.0, 0.0), 0.0);
    }
}
