//! The user's system handed back, with an FMU of ours in the place of the contact at a bond.

use super::layout::system_of;
use crate::master::{export_ssp, System};
use crate::value::Value;
use crate::Isolation;
use anyhow::{Context, Result};
use record::FmuSystem;
use std::fmt::Write;
use std::path::Path;
use toml::Spanned;

/// Name of the element in the system, and of its file.
const FOUND: &str = "found";
const FILE: &str = "HysteresisContact.fmu";

/// Whether another FMU feeds the force of bond `b`, so that ours can take its place.
pub fn replaceable(of: &FmuSystem, b: usize) -> bool {
    let Ok(s) = system_of(&of.path(), &Isolation::None) else { return false };
    let force = of.bonds.get(b).and_then(|b| b.force.as_ref());
    force.is_some_and(|f| s.connect.iter().any(|c| c.to.get_ref() == &f.text))
}

/// Files of the system that simulates a campaign, by name: system.toml, system.ssp and the FMUs, with `element` in the place of
/// what feeds bond `b`, and the variables of `free` at these values.
///
/// # Errors
/// The system cannot be read or written; says which file.
pub fn handed_back(of: &FmuSystem, b: usize, free: &[(String, f64)], element: &[u8]) -> Result<Vec<(String, Vec<u8>)>> {
    let mut s = system_of(&of.path(), &Isolation::None)?;
    let bond = of.bonds.get(b).context("there is no such bond")?;
    let force = bond.force.as_ref().context("the bond takes no force")?;
    for (name, value) in free {
        let (fmu, variable) = name.split_once('.').context("a free variable of no FMU")?;
        if let Some(c) = s.fmu.iter_mut().find(|c| c.name.get_ref() == fmu) {
            c.set.insert(variable.to_string(), Spanned::new(0..0, Value::Real(*value)));
        }
    }
    let mut name = FOUND.to_string();
    while s.fmu.iter().any(|c| c.name.get_ref() == &name) {
        name.push('_');
    }
    let folder = output::Scratch::new("handed")?;
    let mut files: Vec<(String, Vec<u8>)> = vec![(FILE.into(), element.to_vec())];
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
    let text = written(&s, bond, &force.text, &name);
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

/// The system file, with the FMU `name` feeding `force` of `bond`.
fn written(s: &System, bond: &record::Bond, force: &str, name: &str) -> String {
    let mut o = format!(
        "# {} with what was found, in the place of what fed {force}\nname = {}\n",
        s.title(),
        quoted(&s.title())
    );
    // writing to a String cannot fail
    for c in &s.fmu {
        let _ = write!(o, "\n[[fmu]]\nname = {}\nfile = {}\n", quoted(c.name.get_ref()), quoted(c.file.get_ref()));
        if let Some(n) = c.input_orders {
            let _ = writeln!(o, "input_orders = {n}");
        }
        if !c.set.is_empty() {
            o += "[fmu.set]\n";
        }
        for (variable, value) in &c.set {
            let _ = writeln!(o, "{} = {}", quoted(variable), value.get_ref());
        }
    }
    let _ = write!(o, "\n[[fmu]]\nname = {}\nfile = {}\n", quoted(name), quoted(FILE));
    let mut connect = |from: &str, to: &str, factor: f64, offset: f64| {
        let _ = write!(o, "\n[[connect]]\nfrom = {}\nto = {}\n", quoted(from), quoted(to));
        if factor != 1.0 {
            let _ = writeln!(o, "factor = {factor:?}");
        }
        if offset != 0.0 {
            let _ = writeln!(o, "offset = {offset:?}");
        }
    };
    for c in &s.connect {
        if c.to.get_ref() == force {
            connect(&format!("{name}.force"), force, if c.factor < 0.0 { -1.0 } else { 1.0 }, 0.0);
        } else {
            connect(c.from.get_ref(), c.to.get_ref(), c.factor, c.offset);
        }
    }
    connect(&bond.penetration.text, &format!("{name}.penetration"), 1.0, 0.0);
    connect(&bond.velocity.text, &format!("{name}.velocity"), 1.0, 0.0);
    let m = &s.master;
    let _ =
        write!(o, "\n[master]\nmethod = {}\nstart = {:?}\nstop = {:?}\n", quoted(m.method.get_ref()), m.start, m.stop);
    for (key, value) in [("inputs", &m.inputs), ("shape", &m.shape)] {
        if let Some(v) = value {
            let _ = writeln!(o, "{key} = {}", quoted(v.get_ref()));
        }
    }
    for (key, value) in [("step", m.step), ("tolerance", m.tolerance)] {
        if let Some(v) = value {
            let _ = writeln!(o, "{key} = {v:?}");
        }
    }
    for t in &s.touch {
        let _ = write!(o, "\n[[touch]]\nof = {}\nat = {:?}\n", quoted(t.of.get_ref()), t.at);
    }
    o
}
