//! The parts of the contact law, a file each, and the law they make up. A part that only adds a force is a file here, its
//! `mod` and its line in [`contact_mechanisms`](crate::contact_mechanisms).

mod adhesion;
mod contact_preload;
mod elastic;
mod hysteresis_damping;
mod learned_law;
mod plastic_indentation;
mod secondary_stiffening;
mod viscoelastic_relaxation;
mod viscous_damping;

use crate::part::{Mechanism, Parameter, Part, Point, Step};
use crate::Memory;
pub use adhesion::{Adhesion, AdhesionForm};
pub use contact_preload::ContactPreload;
pub use elastic::Elastic;
pub use hysteresis_damping::HysteresisDamping;
pub use learned_law::LearnedLaw;
pub use plastic_indentation::{PlasticForm, PlasticIndentation};
pub use secondary_stiffening::SecondaryStiffening;
pub use viscoelastic_relaxation::ViscoelasticRelaxation;
pub use viscous_damping::ViscousDamping;

/// Gives the list of mechanisms beyond the elastic law (field of [`Parameters`], type) to the macro `$then`, in the
/// order in which forces are summed and forms are tried.
#[macro_export]
macro_rules! contact_mechanisms {
    ($then:ident) => {
        $then! {
            hysteresis_damping: HysteresisDamping,
            viscous_damping: ViscousDamping,
            plastic_indentation: PlasticIndentation,
            adhesion: Adhesion,
            viscoelastic_relaxation: ViscoelasticRelaxation,
            secondary_stiffening: SecondaryStiffening,
            contact_preload: ContactPreload,
            learned_law: LearnedLaw,
        }
    };
}

macro_rules! compose {
    ($($part:ident: $Part:ident,)*) => {
        /// Parameters of the contact law, plain SI, part by part. The default is elastic, every further part neutral.
        #[derive(Clone, Copy, Debug, Default, PartialEq)]
        pub struct Parameters {
            /// F = k x^p.
            pub elastic: Elastic,
            $(#[doc = concat!("See [`", stringify!($Part), "`].")] pub $part: $Part,)*
        }

        /// Every mechanism of the law, the elastic law first.
        pub const MECHANISMS: &[Mechanism] = &[Elastic::MECHANISM, $($Part::MECHANISM),*];

        impl Parameters {
            /// Checks every range.
            ///
            /// # Errors
            /// The first parameter out of its range.
            pub fn validate(&self) -> Result<(), ParameterError> {
                self.check_part(&self.elastic)?;
                $(self.check_part(&self.$part)?;)*
                Ok(())
            }

            /// Multiplies every stiffness by `factor`; damping stays.
            #[inline]
            pub fn scale_stiffness(&mut self, factor: f64) {
                self.elastic.scale_stiffness(factor);
                $(self.$part.scale_stiffness(factor);)*
            }

            /// Whether the law is F = k x^p + mu_d x^p v alone, whose free impact is known exactly.
            pub fn is_power_law(&self) -> bool {
                $((self.$part.is_neutral() || self.$part.keeps_power_law()))&&*
            }

            /// Whether the law is F = k x^p + mu_d x^p v alone and remembers nothing but its depth and its energies, so
            /// that the work of a step has a closed form.
            #[inline(always)]
            pub fn keeps_power_law(&self) -> bool {
                $(self.$part.keeps_power_law())&&*
            }

            /// (force N, slope N/m) at `x` > 0 of all parts that have a potential of `x` alone, on top of `sum`.
            #[inline(always)]
            pub(crate) fn springs(&self, mut sum: (f64, f64), x: f64) -> (f64, f64) {
                $(if let Some((f, slope)) = self.$part.spring(x) {
                    sum.0 += f;
                    sum.1 += slope;
                })*
                sum
            }

            /// Energy of those, J.
            #[inline]
            pub(crate) fn spring_energy(&self, x: f64) -> f64 {
                let mut sum = 0.0;
                $(if let Some(e) = self.$part.spring_energy(x) {
                    sum += e;
                })*
                sum
            }

            /// (force N, d/dx N/m, d/dv N s/m) of all damping parts.
            #[inline(always)]
            pub(crate) fn dampers(&self, at: &Point<'_>) -> (f64, f64, f64) {
                let mut sum = (0.0, 0.0, 0.0);
                $(if let Some((g, gx, gv)) = self.$part.damper(at) {
                    sum.0 += g;
                    sum.1 += gx;
                    sum.2 += gv;
                })*
                sum
            }

            /// Whether any part damps.
            #[inline]
            pub(crate) fn damps(&self) -> bool {
                $(self.$part.damps())||*
            }

            /// Calls `with` on every depth at which a damping force has a kink, m.
            #[inline]
            pub(crate) fn kinks(&self, mut with: impl FnMut(f64)) {
                $(if let Some(x) = self.$part.kink() {
                    with(x);
                })*
            }

            /// Whether a damping force has a kink where the speed changes sign.
            #[inline]
            pub(crate) fn kink_at_rest(&self) -> bool {
                $(self.$part.kink_at_rest())||*
            }

            /// Moves the memory of every part.
            #[inline(always)]
            pub(crate) fn remember(&self, step: &Step<'_>, after: &mut Memory) {
                $(self.$part.remember(step, after);)*
            }
        }
    };
}
contact_mechanisms!(compose);

impl Parameters {
    /// F = k x^p + mu_d x^p v, every other part neutral: `k` N/m^p, `p`, `mu_d` N s/m^(p+1); unchecked.
    pub fn power_law(k: f64, p: f64, mu_d: f64) -> Parameters {
        Parameters {
            elastic: Elastic { stiffness: k, exponent: p },
            hysteresis_damping: HysteresisDamping { coefficient: mu_d, ..HysteresisDamping::default() },
            ..Parameters::default()
        }
    }

    /// The parameters given by name, every other one neutral; unchecked. None where a name is no parameter's.
    pub fn from_names<'a>(values: impl IntoIterator<Item = (&'a str, f64)>) -> Option<Parameters> {
        let mut law = Parameters::default();
        for (name, value) in values {
            (parameter(name)?.set)(&mut law, value);
        }
        Some(law)
    }

    fn check_part<P: Part>(&self, part: &P) -> Result<(), ParameterError> {
        for p in P::MECHANISM.parameters {
            p.check((p.get)(self))?;
        }
        part.check(self)
    }

    /// Every parameter with its value, in the order of the parts.
    pub fn values(&self) -> impl Iterator<Item = (&'static Parameter, f64)> + '_ {
        parameters().map(move |p| (p, (p.get)(self)))
    }
}

/// Every parameter, in the order of the parts.
pub fn parameters() -> impl Iterator<Item = &'static Parameter> {
    MECHANISMS.iter().flat_map(|m| m.parameters)
}

/// The parameter of a name; None where there is none.
pub fn parameter(name: &str) -> Option<&'static Parameter> {
    parameters().find(|p| p.name == name)
}

/// Number of parameters of the law.
pub const COUNT: usize = count();

const fn count() -> usize {
    let (mut n, mut m) = (0, 0);
    while m < MECHANISMS.len() {
        n += MECHANISMS[m].parameters.len();
        m += 1;
    }
    n
}

/// Every parameter, ordered by value reference.
pub const BY_REFERENCE: [Parameter; COUNT] = by_reference();

const fn by_reference() -> [Parameter; COUNT] {
    let mut table = [Elastic::MECHANISM.parameters[0]; COUNT];
    let (mut n, mut m) = (0, 0);
    while m < MECHANISMS.len() {
        let mut i = 0;
        while i < MECHANISMS[m].parameters.len() {
            // insertion by reference, from the end
            let p = MECHANISMS[m].parameters[i];
            let mut at = n;
            while at > 0 && table[at - 1].reference > p.reference {
                table[at] = table[at - 1];
                at -= 1;
            }
            assert!(at == 0 || table[at - 1].reference != p.reference, "two parameters have one value reference");
            table[at] = p;
            n += 1;
            i += 1;
        }
        m += 1;
    }
    table
}

/// A parameter out of its range.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ParameterError {
    /// Name of the parameter.
    pub name: &'static str,
    /// What it was.
    pub value: f64,
    /// What it may be.
    pub expected: &'static str,
}

impl core::fmt::Display for ParameterError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        write!(f, "{} is {}: give {}", self.name, self.value, self.expected)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::part::Kind;

    #[test]
    fn every_parameter_is_neutral_by_default_and_reads_what_was_set() {
        assert_eq!(BY_REFERENCE.len(), parameters().count());
        for (p, value) in Parameters::default().values() {
            assert_eq!(value, p.neutral, "{}", p.name);
            assert!(p.check(value).is_ok(), "{}", p.name);
            assert_eq!(parameter(p.name).map(|q| q.reference), Some(p.reference), "{} is there twice", p.name);
        }
        let mut law = Parameters::default();
        for (i, p) in BY_REFERENCE.iter().enumerate() {
            (p.set)(&mut law, 40.0 + i as f64);
        }
        for (i, p) in BY_REFERENCE.iter().enumerate() {
            assert_eq!((p.get)(&law), 40.0 + i as f64, "{}", p.name);
        }
        assert!(BY_REFERENCE.windows(2).all(|w| w[0].reference < w[1].reference));
    }

    #[test]
    fn bounds_of_the_description_are_those_of_the_range() {
        for p in parameters() {
            let name = p.name;
            if let Some(least) = p.range.least {
                assert!(p.check(least).is_ok() && p.check(least - 1e-6).is_err(), "{name}");
            }
            if let Some(most) = p.range.most {
                assert!(p.check(most + 1e-6 + if name.ends_with("form") { 1.0 } else { 0.0 }).is_err(), "{name}");
            }
            assert!(p.check(f64::NAN).is_err() && p.check(f64::INFINITY).is_err(), "{name}");
        }
    }

    #[test]
    fn every_choice_names_the_numbers_of_its_range_and_no_other() {
        let choices: Vec<&Parameter> = parameters().filter(|p| p.kind != Kind::Real).collect();
        assert_eq!(choices.len(), 4);
        for p in choices {
            let items = p.kind.items();
            for (n, item) in items.iter().enumerate() {
                assert!(p.check(n as f64).is_ok(), "{} {}", p.name, item.name);
                assert!(p.range.words.contains(&format!("{} ({n})", item.name)), "{} {}", p.name, item.name);
                let word = |c: char| c.is_ascii_lowercase() || c == '_';
                assert!(item.name.chars().all(word) && !item.text.is_empty(), "{}", item.name);
                assert!(items[..n].iter().all(|i| i.name != item.name), "{} is there twice", item.name);
            }
            assert!(p.check(items.len() as f64).is_err() && p.check(0.5).is_err(), "{}", p.name);
        }
    }

    #[test]
    fn every_form_is_labelled_once_and_starts_within_its_bounds() {
        for m in MECHANISMS {
            for (i, f) in m.forms.iter().enumerate() {
                assert!(m.forms[i + 1..].iter().all(|g| g.label != f.label), "{} {}", m.name, f.label);
                let lead = f.extends.map_or(0, |label| {
                    let plain = m.forms.iter().find(|g| g.label == label).expect(label);
                    assert!(plain.extends.is_none(), "{label}");
                    assert_eq!(plain.parameters, &f.parameters[..plain.parameters.len()], "{}", f.label);
                    plain.parameters.len()
                });
                assert_eq!(f.starts.len() + lead, f.parameters.len(), "{} {}", m.name, f.label);
                for (q, starts) in f.parameters[lead..].iter().zip(f.starts) {
                    assert!(starts.iter().all(|v| q.lower <= *v && *v <= q.upper), "{} {}", m.name, q.name);
                }
            }
        }
    }
}
