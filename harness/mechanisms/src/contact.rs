//! The mechanisms of the contact, as the law declares them, each part in its file of fmu/law/src/parts.

use crate::mechanism::*;
use crate::physics::Physics;
use law::part::{self, Experiment, Part, Strength};
use record::Kind;

/// Forms a mechanism of the law may have.
const MOST_FORMS: usize = 16;

macro_rules! mechanisms {
    ($($part:ident: $Part:ident,)*) => { &[$(mechanism::<law::parts::$Part>()),*] };
}

/// Every mechanism of the law that is searched for, in the law's order.
pub const CONTACT: &[Mechanism] = law::contact_mechanisms!(mechanisms);

const fn mechanism<P: Part>() -> Mechanism {
    let m = P::MECHANISM;
    assert!(m.forms.len() <= MOST_FORMS, "more forms than MOST_FORMS");
    Mechanism {
        name: m.name,
        origin: m.origin,
        // what no search takes has no name in the vocabulary
        named: !m.forms.is_empty(),
        equation: m.equation,
        source: m.source,
        sentence: m.sentence,
        cure: m.cure,
        forms: forms::<P>,
        acts: match m.strength {
            Strength::Reading => Acts::Reading,
            Strength::ContactForce => Acts::Push,
        },
        hints: Hints { strongly_nonlinear: m.strongly_nonlinear, starts_from: m.starts_from, ..Hints::PLAIN },
    }
}

/// The forms of a part for a campaign whose simulation does not hold it already.
fn forms<P: Part>(c: &Context) -> Vec<Form> {
    let experiment = match c.kind {
        Kind::DropTest => Experiment::DropTest,
        // driven into the stop, bouncing: what a contactor shows, FMUs may show
        Kind::ContactorOpening | Kind::System => Experiment::ContactorOpening,
        Kind::Indentation => Experiment::Indentation,
    };
    if c.terms.iter().any(|t| t == P::MECHANISM.name) {
        return Vec::new();
    }
    let functions: [(Apply, Describe); MOST_FORMS] = functions::<P>();
    let offered = P::MECHANISM.forms.iter().zip(functions).filter(|(f, _)| f.experiments.contains(&experiment));
    let parameter = |q: &part::Searched| {
        let upper = q.upper_in.filter(|(e, _)| *e == experiment).map_or(q.upper, |(_, upper)| upper);
        Parameter { prior: q.prior, ..parameter(q.name, q.lower, upper, q.step) }
    };
    let form = |(f, (apply, describe)): (&part::Form, (Apply, Describe))| Form {
        label: f.label,
        parameters: f.parameters.iter().map(parameter).collect(),
        starts: grid(f.starts),
        linear: f.linear,
        extends: f.extends,
        apply,
        describe,
    };
    offered.map(form).collect()
}

/// What each form of a part does: a function of its own for each, as [`Form`] asks for.
fn functions<P: Part>() -> [(Apply, Describe); MOST_FORMS] {
    macro_rules! all {
        ($($i:literal)*) => { [$((apply::<P, $i>, describe::<P, $i>)),*] };
    }
    all!(0 1 2 3 4 5 6 7 8 9 10 11 12 13 14 15)
}

fn apply<P: Part, const FORM: usize>(t: &[f64], c: &Context, p: &mut Physics) {
    if let Some(form) = P::MECHANISM.forms.get(FORM) {
        (form.apply)(t, &c.scales, &mut p.law);
        if form.per_impact_speed {
            p.damping_speed = Some(c.scales.v_ref);
        }
    }
}

fn describe<P: Part, const FORM: usize>(t: &[f64], c: &Context) -> Vec<(&'static str, f64, &'static str)> {
    let quantities = P::MECHANISM.forms.get(FORM).map_or(&[][..], |form| form.quantities);
    quantities.iter().map(|q| (q.name, (q.value)(t, &c.scales), q.unit)).collect()
}
