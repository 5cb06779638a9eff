//! The vocabulary as a table: every mechanism with its equation, source, forms and quantities.

use crate::mechanism::{Context, Mechanism, Scales};
use crate::physics::{Given, Physics};
use crate::ALL;
use record::Kind;

/// A quantity that a fit of a mechanism reports.
#[derive(Clone, Debug, PartialEq, Eq, serde::Serialize)]
pub struct Quantity {
    pub name: &'static str,
    /// SI; "1" for none.
    pub unit: &'static str,
}

/// One mechanism of the table.
#[derive(Clone)]
pub struct Entry {
    pub mechanism: &'static Mechanism,
    /// Labels of its forms, over all kinds of campaigns.
    pub forms: Vec<&'static str>,
    /// Quantities of all its forms.
    pub quantities: Vec<Quantity>,
    /// Kinds of campaigns that can show it.
    pub kinds: Vec<Kind>,
    /// Keys by which a scenario holds it, in its table `[motion.NAME]`; empty where it has none there.
    pub keys: Vec<Given>,
}

/// A campaign of `kind` with every channel, ten recordings and sizes of one.
pub(crate) fn plain(kind: Kind) -> Context {
    Context {
        kind,
        has: [true; 3],
        scales: Scales {
            force: 1.0,
            depth: 1.0,
            speed: 1.0,
            duration: 1.0,
            mass: 1.0,
            length: 1.0,
            dt: 1.0,
            x_ref: 1.0,
            v_ref: 1.0,
            orders: 10.0,
            peak: 1.0,
            deepest: 1.0,
        },
        terms: Vec::new(),
        top: [1.0; 3],
        flat: None,
        ring: None,
    }
}

/// Every named mechanism, in the order of [`ALL`].
pub fn catalogue() -> Vec<Entry> {
    let named = ALL.iter().filter(|m| m.named);
    named
        .map(|mechanism| {
            let keys = Physics::keys().into_iter().filter(|k| k.mechanism == mechanism.name).collect();
            let mut entry = Entry { mechanism, forms: Vec::new(), quantities: Vec::new(), kinds: Vec::new(), keys };
            for kind in Kind::BUILT_IN {
                let c = plain(kind);
                let forms = mechanism.forms(&c);
                if !forms.is_empty() {
                    entry.kinds.push(kind);
                }
                for f in forms {
                    if !entry.forms.contains(&f.label) {
                        entry.forms.push(f.label);
                    }
                    let neutral = vec![0.0; f.parameters.len()];
                    for (name, _, unit) in f.describe(&neutral, &c) {
                        if entry.quantities.iter().all(|q| q.name != name) {
                            entry.quantities.push(Quantity { name, unit });
                        }
                    }
                }
            }
            entry
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_key_of_a_scenario_is_a_quantity_of_its_mechanism_and_changes_its_part() {
        let mut seen = 0;
        for e in catalogue() {
            for k in &e.keys {
                let same = |q: &&Quantity| q.name == k.name && q.unit == k.unit;
                assert!(e.quantities.iter().any(|q| same(&q)), "{}: {}", e.mechanism.name, k.name);
                let mut p = Physics::default();
                k.put(&mut p, 0.123);
                assert!(k.allowed.holds(0.123) && p != Physics::default(), "{}: {}", e.mechanism.name, k.name);
                seen += 1;
            }
        }
        assert!(seen >= 18, "{seen}");
    }

    #[test]
    fn what_does_the_opposite_says_so_of_each_other() {
        let mut pairs = 0;
        for m in ALL {
            for name in m.hints.opposite_of {
                let other = crate::named(name).unwrap_or_else(|| panic!("{}: {name} is no mechanism", m.name));
                assert!(other.hints.opposite_of.contains(&m.name), "{name} does not say so of {}", m.name);
                pairs += 1;
            }
        }
        assert!(pairs >= 2, "{pairs}");
    }

    #[test]
    fn every_named_mechanism_has_forms_a_source_and_quantities_with_units() {
        let table = catalogue();
        assert!(table.len() >= 23);
        for e in &table {
            let name = e.mechanism.name;
            assert!(!e.forms.is_empty() && !e.kinds.is_empty() && !e.quantities.is_empty(), "{name}");
            assert!(!e.mechanism.source.is_empty() && !e.mechanism.equation.is_empty(), "{name}");
            assert!(e.quantities.iter().all(|q| !q.unit.is_empty()), "{name}: {:?}", e.quantities);
        }
    }
}
