//! Forces on the body besides the contact's: what guides, fluids, springs and magnets do at a place and a speed.
//!
//! Each `on` puts its force on another, N along +x; x is the penetration, m, positive into the stop, v its rate, m/s. Each
//! `slope` is what that force grows by with x and with v, N/m and N s/m. The default of each part is no force.

use crate::elementary::{exp, pow, tanh};
use crate::learned::{of_speed, slope_of_speed, Learned, WithSpeed, TERMS};

/// Speed over which Coulomb friction turns with the motion, m/s: its sign is smoothed as tanh(v/[`SLIP_SPEED`])
/// (Andersson, Soderberg, Bjorklund 2007, Tribology International 40, 580). Five times sharper, estimation's integration
/// errs by 5e-4 of range where it errs by less than 3e-4 now.
pub const SLIP_SPEED: f64 = 5e-3;

/// Friction of a guide: F = -(F_c (1 + s exp(-(v/v_s)^2)) tanh(v/v_0) + c v) (Coulomb 1785; Stribeck 1902).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GuideFriction {
    /// Coulomb's level F_c, N.
    pub coulomb: f64,
    /// Static excess s over that level, as a ratio of it.
    pub stribeck_excess: f64,
    /// Speed v_s over which the excess fades, m/s.
    pub stribeck_speed: f64,
    /// Viscous friction c, N s/m.
    pub viscous: f64,
}

impl Default for GuideFriction {
    fn default() -> Self {
        GuideFriction { coulomb: 0.0, stribeck_excess: 0.0, stribeck_speed: 0.05, viscous: 0.0 }
    }
}

impl GuideFriction {
    /// Share of the static excess that is left at `v` m/s.
    fn excess(&self, v: f64) -> f64 {
        if self.stribeck_excess == 0.0 {
            return 0.0;
        }
        let u = v / self.stribeck_speed;
        self.stribeck_excess * exp(-u * u)
    }

    /// `f` with the friction, N.
    #[inline]
    pub fn on(&self, v: f64, mut f: f64) -> f64 {
        if self.coulomb != 0.0 {
            f -= self.coulomb * (1.0 + self.excess(v)) * tanh(v / SLIP_SPEED);
        }
        f - self.viscous * v
    }

    /// Its growth with the speed, N s/m.
    pub fn slope(&self, v: f64) -> f64 {
        let (turned, excess) = (tanh(v / SLIP_SPEED), self.excess(v));
        let fades = -2.0 * v / (self.stribeck_speed * self.stribeck_speed) * excess;
        -self.coulomb * (fades * turned + (1.0 + excess) * (1.0 - turned * turned) / SLIP_SPEED) - self.viscous
    }
}

/// Drag of the surrounding fluid: F = -c v |v|^(n-1), n near 2 (Newton 1687; Rayleigh 1876), c falling to a share of itself
/// where the boundary layer turns turbulent (Achenbach 1972).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FluidDrag {
    /// Drag c at 1 m/s, N.
    pub coefficient: f64,
    /// Power n of the speed.
    pub power: f64,
    /// Drag on the way back over that on the way in: the body flies through its own wake.
    pub back: f64,
    /// Speed about which the boundary layer turns turbulent, m/s; None: it does not.
    pub crisis_speed: Option<f64>,
    /// Share of the drag left beyond that speed.
    pub beyond: f64,
}

impl Default for FluidDrag {
    fn default() -> Self {
        FluidDrag { coefficient: 0.0, power: 2.0, back: 1.0, crisis_speed: None, beyond: 1.0 }
    }
}

impl FluidDrag {
    /// The share of the drag left at the speed `v`, m/s, and its growth with it: from 1 far below the crisis to `beyond` far
    /// above it, half of the way at it; times that of the way back.
    fn share(&self, v: f64) -> (f64, f64) {
        let way = if v < 0.0 { self.back } else { 1.0 };
        let crisis = match self.crisis_speed {
            Some(crisis) => crisis,
            None => return (way, 0.0),
        };
        let u = v / crisis;
        let square = u * u;
        let past = 1.0 + square * square * square * square;
        let less = 1.0 - self.beyond;
        let growth = -less * 8.0 * square * square * square * u / crisis / (past * past);
        (way * (self.beyond + less / past), way * growth)
    }

    /// `f` with the drag, N.
    #[inline]
    pub fn on(&self, v: f64, f: f64) -> f64 {
        if self.coefficient == 0.0 {
            return f;
        }
        f - self.share(v).0 * self.coefficient * v * pow(v.abs(), self.power - 1.0)
    }

    /// Its growth with the speed, N s/m.
    pub fn slope(&self, v: f64) -> f64 {
        if self.coefficient == 0.0 {
            return 0.0;
        }
        let ((share, growth), rest) = (self.share(v), pow(v.abs(), self.power - 1.0));
        -self.coefficient * rest * (share * self.power + growth * v)
    }
}

/// A spring against +x: F = -(P + r x + g x^3) (Hooke 1678; Duffing 1918).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ReturnSpring {
    /// Preload P at the nominal surface, N; negative where the spring drives into the stop.
    pub preload: f64,
    /// Rate r, N/m.
    pub rate: f64,
    /// Growth g of the rate, N/m^3.
    pub growth: f64,
}

impl ReturnSpring {
    /// `f` with the spring, N.
    #[inline]
    pub fn on(&self, x: f64, f: f64) -> f64 {
        f - self.preload - (self.rate + self.growth * x * x) * x
    }

    /// Its growth with the place, N/m.
    pub fn slope(&self, x: f64) -> f64 {
        -(self.rate + 3.0 * self.growth * x * x)
    }
}

/// A pull towards the place of rest: F = -F_m exp(-t/tau) / (1 + z/z_0)^2 (Maxwell 1873; reluctance of an air gap).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ResidualMagnetism {
    /// Force F_m at closed gap and release, N.
    pub force: f64,
    /// Gap z_0 over which it fades, m; infinite: it does not fade with the gap.
    pub gap: f64,
    /// Time tau in which it fades, s; infinite: it does not fade with time.
    pub time: f64,
}

impl Default for ResidualMagnetism {
    fn default() -> Self {
        ResidualMagnetism { force: 0.0, gap: f64::INFINITY, time: f64::INFINITY }
    }
}

impl ResidualMagnetism {
    /// `f` with the pull, N, `time` s after release and `way` m from the place of rest.
    #[inline]
    pub fn on(&self, time: f64, way: f64, f: f64) -> f64 {
        if self.force == 0.0 {
            return f;
        }
        let z = 1.0 + way.max(0.0) / self.gap;
        f - self.force * exp(-time / self.time) / (z * z)
    }

    /// Its growth with the way, N/m.
    pub fn slope(&self, time: f64, way: f64) -> f64 {
        if self.force == 0.0 || way < 0.0 {
            return 0.0;
        }
        let z = 1.0 + way / self.gap;
        2.0 * self.force * exp(-time / self.time) / (z * z * z * self.gap)
    }
}

/// Film of fluid between body and stop: F = -c v (g/(gap + g))^n (Reynolds 1886; Stefan 1874).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SqueezeFilm {
    /// Coefficient c at no gap, N s/m.
    pub coefficient: f64,
    /// Gap g at which it has halved (at n = 1), m.
    pub gap: f64,
    /// Power n.
    pub power: f64,
    /// Whether the film pushes on the transducer as well: it does where the transducer carries the stop.
    pub reads: bool,
}

impl Default for SqueezeFilm {
    fn default() -> Self {
        SqueezeFilm { coefficient: 0.0, gap: 1.0, power: 1.0, reads: true }
    }
}

impl SqueezeFilm {
    /// Damping at `x` m, N s/m.
    fn damping(&self, x: f64) -> f64 {
        self.coefficient * pow(self.gap / ((-x).max(0.0) + self.gap), self.power)
    }

    /// Force against the motion into the stop, N.
    #[inline]
    pub fn force(&self, x: f64, v: f64) -> f64 {
        if self.coefficient == 0.0 {
            return 0.0;
        }
        self.damping(x) * v
    }

    /// `f` with the film, N.
    #[inline]
    pub fn on(&self, x: f64, v: f64, f: f64) -> f64 {
        f - self.force(x, v)
    }

    /// Its growth with the place, N/m, and with the speed, N s/m.
    pub fn slope(&self, x: f64, v: f64) -> (f64, f64) {
        if self.coefficient == 0.0 {
            return (0.0, 0.0);
        }
        let damping = self.damping(x);
        let by_place = if x < 0.0 { -damping * v * self.power / (self.gap - x) } else { 0.0 };
        (by_place, -damping)
    }
}

/// A force of a shape of its own on the body, learned from recordings: F = -(b(z) + c(z) w) - w d(|w|), z the way before the stop
/// over its range and w the speed over the one that counts as 1, or for c the sign of the speed (see
/// [`learned`](crate::learned)).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LearnedForce {
    /// b and c, with the range, 0 where there is neither, and the speed that counts as 1, 0 where nothing depends on the speed.
    pub of_place: Learned,
    /// Whether c goes with the direction of the motion, and not with the speed.
    pub turns: bool,
    /// Coefficients of d, N.
    pub of_speed: [f64; TERMS],
}

impl Default for LearnedForce {
    fn default() -> Self {
        let of_place = Learned { range: 0.0, speed: 0.0, ..Learned::default() };
        LearnedForce { of_place, turns: false, of_speed: [0.0; TERMS] }
    }
}

impl LearnedForce {
    fn depends_on_place(&self) -> bool {
        self.of_place.range > 0.0
    }

    fn depends_on_speed(&self) -> bool {
        self.of_place.speed > 0.0
    }

    /// How what depends on the place goes with the speed.
    fn goes(&self) -> WithSpeed {
        match self.turns {
            true => WithSpeed::Direction,
            false if self.depends_on_speed() => WithSpeed::Linear,
            false => WithSpeed::No,
        }
    }

    /// `f` with the force, N.
    #[inline]
    pub fn on(&self, x: f64, v: f64, mut f: f64) -> f64 {
        if self.depends_on_place() {
            f += self.of_place.of_place(self.goes(), x, v);
        }
        if self.depends_on_speed() {
            f += of_speed(&self.of_speed, self.of_place.speed, v);
        }
        f
    }

    /// Its growth with the place, N/m, and with the speed, N s/m.
    pub fn slope(&self, x: f64, v: f64) -> (f64, f64) {
        let (mut by_place, mut by_speed) = (0.0, 0.0);
        if self.depends_on_place() {
            let slopes = self.of_place.slopes_of_place(self.goes(), x, v);
            by_place = slopes.0;
            by_speed = slopes.1;
        }
        if self.depends_on_speed() {
            by_speed += slope_of_speed(&self.of_speed, self.of_place.speed, v);
        }
        (by_place, by_speed)
    }

    /// Whether the place, m, or the speed, m/s, is beyond what was learned.
    pub fn is_beyond(&self, x: f64, v: f64) -> bool {
        let is_farther = self.depends_on_place() && self.of_place.is_farther(-x);
        is_farther || (self.depends_on_speed() && self.of_place.is_faster(v))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Central difference of `f` at `x`.
    fn difference(f: &dyn Fn(f64) -> f64, x: f64) -> f64 {
        let h = 1e-6 * x.abs().max(1e-3);
        (f(x + h) - f(x - h)) / (2.0 * h)
    }

    fn near(a: f64, b: f64) {
        assert!((a - b).abs() < 1e-5 * (1.0 + a.abs()), "{} {}", a, b);
    }

    #[test]
    fn every_slope_is_that_of_its_force() {
        let friction = GuideFriction { coulomb: 3.0, stribeck_excess: 0.4, stribeck_speed: 0.1, viscous: 2.0 };
        let drag = FluidDrag { coefficient: 5.0, power: 1.8, back: 1.3, crisis_speed: Some(0.6), beyond: 0.4 };
        let spring = ReturnSpring { preload: 4.0, rate: 30.0, growth: 7e4 };
        let pull = ResidualMagnetism { force: 9.0, gap: 1e-3, time: 0.01 };
        let film = SqueezeFilm { coefficient: 6.0, gap: 2e-3, power: 1.5, reads: true };
        let mut learned = LearnedForce::default();
        (learned.of_place.range, learned.of_place.speed) = (0.02, 0.8);
        let coefficients = &mut learned.of_place.coefficients;
        (coefficients[1], coefficients[14], learned.of_speed[2]) = (3.0, 2.0, -1.5);
        for v in [-1.1, -0.3, -0.01, 0.004, 0.2, 0.7, 2.0] {
            near(difference(&|v| friction.on(v, 1.0), v), friction.slope(v));
            near(difference(&|v| drag.on(v, 1.0), v), drag.slope(v));
            for x in [-0.01, -1e-3, 2e-3] {
                near(difference(&|x| spring.on(x, 1.0), x), spring.slope(x));
                near(difference(&|x| pull.on(0.004, x + 0.02, 1.0), x), pull.slope(0.004, x + 0.02));
                let (by_place, by_speed) = film.slope(x, v);
                near(difference(&|x| film.on(x, v, 1.0), x), by_place);
                near(difference(&|v| film.on(x, v, 1.0), v), by_speed);
                let (by_place, by_speed) = learned.slope(x, v);
                near(difference(&|x| learned.on(x, v, 1.0), x), by_place);
                near(difference(&|v| learned.on(x, v, 1.0), v), by_speed);
            }
        }
    }

    #[test]
    fn what_is_not_there_adds_nothing_and_what_is_has_its_equation() {
        assert_eq!(GuideFriction::default().on(0.3, 2.0), 2.0);
        assert_eq!(FluidDrag::default().on(0.3, 2.0), 2.0);
        assert_eq!(ReturnSpring::default().on(0.3, 2.0), 2.0);
        assert_eq!(ResidualMagnetism::default().on(0.1, 0.3, 2.0), 2.0);
        assert_eq!(SqueezeFilm::default().on(-0.1, 0.3, 2.0), 2.0);
        assert_eq!(LearnedForce::default().on(-0.1, 0.3, 2.0), 2.0);
        let friction = GuideFriction { coulomb: 3.0, viscous: 2.0, ..GuideFriction::default() };
        assert!((friction.on(-1.0, 0.0) - 5.0).abs() < 1e-12);
        let drag = FluidDrag { coefficient: 5.0, ..FluidDrag::default() };
        assert!((drag.on(-2.0, 0.0) - 20.0).abs() < 1e-12);
        assert!((ReturnSpring { preload: 4.0, rate: 30.0, growth: 0.0 }.on(0.1, 0.0) + 7.0).abs() < 1e-12);
        let pull = ResidualMagnetism { force: 8.0, gap: 1e-3, ..ResidualMagnetism::default() };
        assert!((pull.on(5.0, 1e-3, 0.0) + 2.0).abs() < 1e-12);
        let film = SqueezeFilm { coefficient: 6.0, gap: 1e-3, ..SqueezeFilm::default() };
        assert!((film.on(-1e-3, 2.0, 0.0) + 6.0).abs() < 1e-12);
    }
}
