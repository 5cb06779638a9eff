//! The user's system handed back, with FMUs of ours at a bond that hold what was found.

use super::layout::system_of;
use crate::master::{export_ssp, Connection, System};
use crate::value::Value;
use crate::Isolation;
use anyhow::{Context, Result};
use record::FmuSystem;
use std::fmt::Write;
use std::path::Path;
use toml::Spanned;

/// Names of ours in the system, and their files: the element, and the forces on the body.
const CONTACT: (&str, &str) = ("found", "HysteresisContact.fmu");
const BODY: (&str, &str) = ("found_on_body", "BodyForce.fmu");

/// FMUs of ours for a bond, and whether its input takes forces into the stop.
#[derive(Clone, Copy, Default)]
pub struct Ours<'a> {
    /// The element, in the place of what feeds the bond.
    pub element: Option<&'a [u8]>,
    /// Forces on the body, beside what feeds the bond.
    pub body: Option<&'a [u8]>,
    pub turned: bool,
}

/// Whether another FMU feeds the force of bond `b`, so that ours can take its place.
pub fn replaceable(of: &FmuSystem, b: usize) -> bool {
    let Ok(s) = system_of(&of.path(), &Isolation::None) else { return false };
    let force = of.bonds.get(b).and_then(|b| b.force.as_ref());
    force.is_some_and(|f| s.connect.iter().any(|c| c.to.get_ref() == &f.text))
}

/// Files of the system that simulates a campaign, by name: system.toml, system.ssp and the FMUs, with `ours` at bond `b`, and
/// the variables of `free` at these values.
///
/// # Errors
/// The system cannot be read or written; says which file.
pub fn handed_back(
    of: &FmuSystem,
    b: usize,
    free: &[(String, f64)],
    ours: &Ours<'_>,
) -> Result<Vec<(String, Vec<u8>)>> {
    let mut s = system_of(&of.path(), &Isolation::None)?;
    let bond = of.bonds.get(b).context("there is no such bond")?;
    let force = bond.force.as_ref().context("the bond takes no force")?;
    for (name, value) in free {
        let (fmu, variable) = name.split_once('.').context("a free variable of no FMU")?;
        if let Some(c) = s.fmu.iter_mut().find(|c| c.name.get_ref() == fmu) {
            c.set.insert(variable.to_string(), Spanned::new(0..0, Value::Real(*value)));
        }
    }
    let folder = output::Scratch::new("handed")?;
    let added = [(CONTACT, ours.element), (BODY, ours.body)];
    let added = added.into_iter().filter_map(|((_, file), fmu)| Some((file.to_string(), fmu?.to_vec())));
    let mut files: Vec<(String, Vec<u8>)> = added.collect();
    for c in s.fmu.iter_mut().filter(|c| c.own().is_none()) {
        let path = s.folder.join(c.file.get_ref());
        let bytes = input::bytes(&path, input::LIBRARY).with_context(|| path.display().to_string())?;
        let own = Path::new(c.file.get_ref()).file_name().map_or("model.fmu".into(), |n| n.to_string_lossy());
        // two of one name from two folders are two files
        let mut own = own.into_owned();
        while files.iter().any(|(n, other)| *n == own && *other != bytes) {
            own.insert(0, '_');
        }
        c.file = Spanned::new(0..0, own.clone());
        if files.iter().all(|(n, _)| *n != own) {
            files.push((own, bytes));
        }
    }
    let text = written(&s, bond, &force.text, ours);
    files.push(("system.toml".into(), text.into_bytes()));
    for (name, bytes) in &files {
        output::write(&folder.path().join(name), bytes)?;
    }
    let ssp = folder.path().join("system.ssp");
    export_ssp(&System::load(&folder.path().join("system.toml"))?, &ssp)?;
    files.push(("system.ssp".into(), input::bytes(&ssp, input::LIBRARY)?));
    Ok(files)
}

fn quoted(s: &str) -> String {
    Value::Text(s.to_string()).to_string()
}

/// A name that no FMU of the system has yet.
fn free_name(s: &System, name: &str) -> String {
    let mut name = name.to_string();
    while s.fmu.iter().any(|c| c.name.get_ref() == &name) {
        name.push('_');
    }
    name
}

/// The system file, with `ours` feeding `force` of `bond`.
fn written(s: &System, bond: &record::Bond, force: &str, ours: &Ours<'_>) -> String {
    let how = match (ours.element, ours.body) {
        (Some(_), None) => format!("in the place of what fed {force}"),
        (None, _) => format!("beside what fed {force}"),
        _ => format!("in the place of what fed {force}, and beside it"),
    };
    let mut o = format!("# {} with what was found, {how}\nname = {}\n", s.title(), quoted(&s.title()));
    // writing to a String cannot fail
    for c in &s.fmu {
        let _ = write!(o, "\n[[fmu]]\nname = {}\nfile = {}\n", quoted(c.name.get_ref()), quoted(c.file.get_ref()));
        if let Some(n) = c.input_orders {
            let _ = writeln!(o, "input_orders = {n}");
        }
        if let Some(t) = c.tolerance {
            let _ = writeln!(o, "tolerance = {t:?}");
        }
        if !c.set.is_empty() {
            o += "[fmu.set]\n";
        }
        for (variable, value) in &c.set {
            let _ = writeln!(o, "{} = {}", quoted(variable), value.get_ref());
        }
    }
    let contact = ours.element.map(|_| free_name(s, CONTACT.0));
    let body = ours.body.map(|_| free_name(s, BODY.0));
    for (name, file) in contact.iter().map(|n| (n, CONTACT.1)).chain(body.iter().map(|n| (n, BODY.1))) {
        let _ = write!(o, "\n[[fmu]]\nname = {}\nfile = {}\n", quoted(name), quoted(file));
    }
    let mut connect = |c: &Connection| {
        let _ = write!(o, "\n[[connect]]\nfrom = {}\nto = {}\n", quoted(c.from.get_ref()), quoted(c.to.get_ref()));
        if c.factor != 1.0 {
            let _ = writeln!(o, "factor = {:?}", c.factor);
        }
        if c.offset != 0.0 {
            let _ = writeln!(o, "offset = {:?}", c.offset);
        }
        if c.suppress_unit_conversion {
            let _ = writeln!(o, "suppress_unit_conversion = true");
        }
        if !c.map.is_empty() {
            let entries: Vec<String> = c.map.iter().map(|(a, b)| format!("[{a}, {b}]")).collect();
            let _ = writeln!(o, "map = [{}]", entries.join(", "));
        }
    };
    let with = |from: &str, to: &str, factor: f64| Connection { factor, ..Connection::plain(from.into(), to.into()) };
    // ours give forces out of the stop
    let out = if ours.turned { -1.0 } else { 1.0 };
    let onward = body.as_ref().map(|b| format!("{b}.other_force"));
    for c in &s.connect {
        match (c.to.get_ref() == force, &contact, &onward) {
            (true, Some(_), _) => {}
            (true, None, Some(onward)) => {
                let to = Spanned::new(0..0, onward.clone());
                connect(&Connection { to, factor: out * c.factor, offset: out * c.offset, ..c.clone() });
            }
            _ => connect(c),
        }
    }
    if let Some(contact) = &contact {
        let from = format!("{contact}.force");
        match &onward {
            Some(onward) => connect(&with(&from, onward, 1.0)),
            None => connect(&with(&from, force, out)),
        }
    }
    if let Some(body) = &body {
        connect(&with(&format!("{body}.force"), force, out));
    }
    for name in contact.iter().chain(&body) {
        connect(&with(&bond.penetration.text, &format!("{name}.penetration"), 1.0));
        connect(&with(&bond.velocity.text, &format!("{name}.velocity"), 1.0));
    }
    let m = &s.master;
    let _ =
        write!(o, "\n[master]\nmethod = {}\nstart = {:?}\nstop = {:?}\n", quoted(m.method.get_ref()), m.start, m.stop);
    for (key, value) in [("inputs", &m.inputs), ("shape", &m.shape)] {
        if let Some(v) = value {
            let _ = writeln!(o, "{key} = {}", quoted(v.get_ref()));
        }
    }
    for (key, value) in [("step", m.step), ("tolerance", m.tolerance), ("iteration_tolerance", m.iteration_tolerance)] {
        if let Some(v) = value {
            let _ = writeln!(o, "{key} = {v:?}");
        }
    }
    for t in &s.touch {
        let _ = write!(o, "\n[[touch]]\nof = {}\nat = {:?}\n", quoted(t.of.get_ref()), t.at);
    }
    o
}
