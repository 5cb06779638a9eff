//! learned_law: a force between the faces of a shape of its own, learned from recordings; a diagnosis writes its coefficients.

use crate::learned::{Learned, WithSpeed, COEFFICIENTS};
use crate::part::{Item, Kind, Mechanism, Origin, Parameter, Part, Range, StartsFrom, Strength, HELD};

/// A force between the faces of a shape of its own.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LearnedLaw {
    /// How it goes with the speed: the number of an item of `learned_form`.
    pub form: i32,
    /// Its series; a range of 0 turns it off.
    pub shape: Learned,
}

impl Default for LearnedLaw {
    fn default() -> Self {
        LearnedLaw { form: 0, shape: Learned { range: 0.0, ..Learned::default() } }
    }
}

/// How a learned force may go with the speed.
pub const HOW: &[Item] = &[
    Item { name: "not", text: "On the depth alone, g(x)" },
    Item { name: "speed", text: "g(x) + h(x) w, w the speed over learned_speed" },
    Item { name: "direction", text: "g(x) + h(x) times the sign of the speed" },
    Item { name: "speed_squared", text: "g(x) + h(x) w |w|" },
];

/// Factor of the speed for each item of [`HOW`], in the same order.
const GOES: [WithSpeed; 4] = [WithSpeed::No, WithSpeed::Linear, WithSpeed::Direction, WithSpeed::Squared];

/// Parameters, and a coefficient of its own for each number.
macro_rules! with_coefficients {
    ($($first:expr,)* ; $($i:literal $name:literal $reference:literal),* $(,)?) => {
        &[$($first,)* $(Parameter {
            name: $name,
            reference: $reference,
            kind: Kind::Real,
            unit: "N",
            display: "kN",
            neutral: 0.0,
            range: ANY,
            text: COEFFICIENT_TEXT[$i / (COEFFICIENTS / 2)],
            get: |p| p.learned_law.shape.coefficients[$i],
            set: |p, v| p.learned_law.shape.coefficients[$i] = v,
        },)*]
    };
}

const ANY: Range = Range { least: None, most: None, words: "a finite number", holds: |_| true };

const COEFFICIENT_TEXT: [&str; 2] = [
    "Coefficient of g(x): c_1 + sum of c_j sqrt(2) cos((j - 1) pi x/learned_range), j from 2 to 24",
    "Coefficient of h(x), as of g(x)",
];

const PARAMETERS: &[Parameter] = with_coefficients! {
    Parameter {
        name: "learned_form",
        reference: 130,
        kind: Kind::Enumeration(HOW),
        unit: "",
        display: "",
        neutral: 0.0,
        range: Range {
            least: Some(0.0),
            most: Some(3.0),
            words: "not (0), speed (1), direction (2) or speed_squared (3)",
            holds: |v| (0.0..=3.0).contains(&v),
        },
        text: "How the learned force goes with the speed",
        get: |p| f64::from(p.learned_law.form),
        set: |p, v| p.learned_law.form = v as i32,
    },
    Parameter {
        name: "learned_range",
        reference: 131,
        kind: Kind::Real,
        unit: "m",
        display: "mm",
        neutral: 0.0,
        range: Range::FROM_ZERO,
        text: "Depth up to which a force was learned; deeper, its factors stay as there; 0 turns it off",
        get: |p| p.learned_law.shape.range,
        set: |p, v| p.learned_law.shape.range = v,
    },
    Parameter {
        name: "learned_speed",
        reference: 132,
        kind: Kind::Real,
        unit: "m/s",
        display: "",
        neutral: 1.0,
        range: Range::POSITIVE,
        text: "Speed that counts as 1 in the learned force, above 0; it was learned up to twice that",
        get: |p| p.learned_law.shape.speed,
        set: |p, v| p.learned_law.shape.speed = v,
    },;
    0 "learned_rest_1" 133,
    1 "learned_rest_2" 134,
    2 "learned_rest_3" 135,
    3 "learned_rest_4" 136,
    4 "learned_rest_5" 137,
    5 "learned_rest_6" 138,
    6 "learned_rest_7" 139,
    7 "learned_rest_8" 140,
    8 "learned_rest_9" 141,
    9 "learned_rest_10" 142,
    10 "learned_rest_11" 143,
    11 "learned_rest_12" 144,
    12 "learned_rest_13" 145,
    13 "learned_rest_14" 146,
    14 "learned_rest_15" 147,
    15 "learned_rest_16" 148,
    16 "learned_rest_17" 149,
    17 "learned_rest_18" 150,
    18 "learned_rest_19" 151,
    19 "learned_rest_20" 152,
    20 "learned_rest_21" 153,
    21 "learned_rest_22" 154,
    22 "learned_rest_23" 155,
    23 "learned_rest_24" 156,
    24 "learned_speed_1" 157,
    25 "learned_speed_2" 158,
    26 "learned_speed_3" 159,
    27 "learned_speed_4" 160,
    28 "learned_speed_5" 161,
    29 "learned_speed_6" 162,
    30 "learned_speed_7" 163,
    31 "learned_speed_8" 164,
    32 "learned_speed_9" 165,
    33 "learned_speed_10" 166,
    34 "learned_speed_11" 167,
    35 "learned_speed_12" 168,
    36 "learned_speed_13" 169,
    37 "learned_speed_14" 170,
    38 "learned_speed_15" 171,
    39 "learned_speed_16" 172,
    40 "learned_speed_17" 173,
    41 "learned_speed_18" 174,
    42 "learned_speed_19" 175,
    43 "learned_speed_20" 176,
    44 "learned_speed_21" 177,
    45 "learned_speed_22" 178,
    46 "learned_speed_23" 179,
    47 "learned_speed_24" 180,
};

impl Part for LearnedLaw {
    const MECHANISM: Mechanism = Mechanism {
        name: "learned_law",
        origin: Origin::Contact,
        sentence: "a force between the faces of a shape of its own, learned from recordings",
        equation: "F = (1 - exp(-x/(0.03 r))) (g(x) + h(x) w)",
        source: "Solin and Sarkka 2020 (a Gaussian process on a reduced basis)",
        cure: HELD,
        parameters: PARAMETERS,
        forms: &[],
        collinear: &[],
        strongly_nonlinear: false,
        starts_from: StartsFrom::Forms,
        strength: Strength::Reading,
    };

    #[inline(always)]
    fn is_neutral(&self) -> bool {
        !self.acts()
    }
}

impl LearnedLaw {
    /// Whether there is any.
    #[inline(always)]
    pub fn acts(&self) -> bool {
        self.shape.range > 0.0
    }

    fn goes(&self) -> WithSpeed {
        usize::try_from(self.form).ok().and_then(|form| GOES.get(form).copied()).unwrap_or(WithSpeed::No)
    }

    /// The number of a form that goes so with the speed.
    pub fn form_of(goes: WithSpeed) -> i32 {
        GOES.iter().position(|g| *g == goes).map_or(0, |form| form as i32)
    }

    /// Force, N, at `x` m and `v` m/s, where it acts; a function of its own, so that a law without it only passes it by.
    #[inline(never)]
    pub fn force(&self, x: f64, v: f64) -> f64 {
        self.shape.between(self.goes(), x, v)
    }

    /// Growth of that with x, N/m, and with v, N s/m.
    #[inline(never)]
    pub fn slopes(&self, x: f64, v: f64) -> (f64, f64) {
        self.shape.slopes_between(self.goes(), x, v)
    }

    /// Energy, J, that it holds at `x` m; 0 where there is none.
    pub fn energy(&self, x: f64) -> f64 {
        if self.acts() {
            self.shape.energy_between(x)
        } else {
            0.0
        }
    }

    /// Work, J, over a step of straight x and v, where it acts.
    pub(crate) fn work(&self, from: (f64, f64), to: (f64, f64)) -> f64 {
        let l = &self.shape;
        l.energy_between(to.0) - l.energy_between(from.0) + l.work_between(self.goes(), from, to)
    }

    /// Whether the depth, m, or where it depends on the speed, the speed, m/s, is beyond what was learned.
    pub fn is_beyond(&self, x: f64, v: f64) -> bool {
        let is_faster = self.goes() != WithSpeed::No && self.shape.is_faster(v);
        self.acts() && (self.shape.is_farther(x) || is_faster)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Memory, Parameters};

    fn law() -> Parameters {
        let mut p = Parameters::power_law(2e6, 1.5, 0.0);
        let l = &mut p.learned_law;
        l.form = 1;
        l.shape.range = 1e-3;
        l.shape.speed = 0.5;
        l.shape.coefficients[0] = -20.0;
        l.shape.coefficients[2] = 15.0;
        l.shape.coefficients[COEFFICIENTS / 2] = 30.0;
        p
    }

    #[test]
    fn it_is_added_to_the_law_it_may_pull_and_slopes_are_those_of_the_force() {
        let (p, m) = (law(), Memory::default());
        let plain = Parameters { learned_law: LearnedLaw::default(), ..p };
        assert_eq!(p.force(&m, -1e-9, 1.0), 0.0);
        for (x, v) in [(3e-5, 0.1), (4e-4, -0.3), (1.4e-3, 0.2)] {
            let f = p.force(&m, x, v);
            assert!((f - plain.force(&m, x, v) - p.learned_law.force(x, v)).abs() < 1e-12);
            let (fx, fv) = p.derivatives(&m, x, v);
            let h = 1e-9;
            assert!((fx - (p.force(&m, x + h, v) - p.force(&m, x - h, v)) / (2.0 * h)).abs() < 1e-3 * fx.abs());
            assert!((fv - (p.force(&m, x, v + h) - p.force(&m, x, v - h)) / (2.0 * h)).abs() < 1e-3 * fv.abs());
        }
        assert!(p.force(&m, 1e-5, -1.0) < 0.0);
        assert!(!p.is_power_law() && plain.is_power_law());
    }

    #[test]
    fn its_energy_comes_back_and_what_damps_is_lost() {
        let mut p = law();
        let round = |p: &Parameters| {
            let mut m = Memory::default();
            let at = |i: i32| 1.2e-3 * (1.0 - (f64::from(i) / 20.0 - 1.0).abs()) - 1e-5;
            let speed = |i: i32| if i < 20 { 0.3 } else { -0.3 };
            for i in 0..40 {
                m = p.advance(&m, at(i), speed(i), at(i + 1), speed(i), 1e-4);
            }
            m
        };
        let lost = round(&p).dissipated();
        // 2 times the work of h(x) w, h constant beyond the rise
        let want = 2.0 * 30.0 * 0.3 / 0.5 * (1.19e-3 - 3e-5);
        assert!((lost / want - 1.0).abs() < 1e-3, "{} {}", lost, want);
        p.learned_law.form = 0;
        let m = round(&p);
        assert!(m.dissipated().abs() < 1e-12 && m.stored == 0.0, "{:?}", m);
    }

    #[test]
    fn beyond_what_was_learned_is_told_where_it_counts() {
        let mut l = law().learned_law;
        assert!(!l.is_beyond(9e-4, 0.9) && l.is_beyond(1.1e-3, 0.0) && l.is_beyond(5e-4, 1.1));
        l.form = 0;
        assert!(!l.is_beyond(5e-4, 1.1));
        assert!(!LearnedLaw::default().is_beyond(1.0, 1.0));
    }
}
