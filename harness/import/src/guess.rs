//! What each column of a group is: by what the user says, by its unit, by its name.

use crate::map::Mapped;
use crate::words::{says, Role, Says};
use instruments::{Channel, Group};
use record::units;

/// A column that is taken.
#[derive(Clone, Debug, PartialEq)]
pub struct Taken {
    /// Index among the group's channels.
    pub column: usize,
    pub name: String,
    pub role: Role,
    /// Factor to SI.
    pub factor: f64,
    /// -1 or 1 where the user says so; None: as the readings show.
    pub sign: Option<f64>,
    /// What it was taken by.
    pub why: String,
    /// How plain that is: 3 said, 2 unit and name, 1 one of them.
    pub(crate) plain: u8,
}

/// The columns of a group, each with its role.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Columns {
    pub taken: Vec<Taken>,
    /// Columns left out: the name, and why.
    pub left: Vec<(String, String)>,
    /// Roles that a name gives to a column whose unit has no meaning: what to say, to the user.
    pub unclear: Vec<(Role, String)>,
}

impl Columns {
    /// The columns taken as `role`, the plainest alone where one kind of plainness stands out.
    pub fn of(&self, role: Role) -> Vec<&Taken> {
        let all: Vec<&Taken> = self.taken.iter().filter(|t| t.role == role).collect();
        let most = all.iter().map(|t| t.plain).max().unwrap_or(0);
        all.into_iter().filter(|t| t.plain == most).collect()
    }
}

/// A column's name as the user sees it.
pub(crate) fn label(channel: &Channel, column: usize) -> String {
    if channel.name.is_empty() {
        format!("#{}", column + 1)
    } else {
        channel.name.clone()
    }
}

/// A unit that stands in a name: `Force_kN`, `time (ms)`; the last of them, and the word "in" before another is none.
fn unit_in(name: &str, role: Role) -> Option<(String, f64)> {
    let parts = name.split(['_', ' ', '(', ')', '[', ']', '/', ',']).filter(|p| !p.is_empty());
    let slashed = name.split(['_', ' ', '(', ')', '[', ']']).filter(|p| p.contains('/'));
    let meant = |u: &str| units::measured(u).filter(|m| m.0 == role.name()).map(|m| (u.to_string(), m.1));
    let mut parts: Vec<&str> = parts.skip(1).collect();
    let last = parts.pop();
    let others = parts.into_iter().rev().filter(|u| *u != "in");
    slashed.chain(last).chain(others).find_map(meant)
}

/// Guesses one column.
fn guess(channel: &Channel, column: usize) -> Result<Taken, (String, Option<Role>)> {
    let name = label(channel, column);
    let by_name = says(&channel.name);
    let taken = |role: Role, factor: f64, why: String, plain: u8| Taken {
        column,
        name: name.clone(),
        role,
        factor,
        sign: None,
        why,
        plain,
    };
    if let Says::Other(what) = by_name {
        let measures = units::measured(&channel.unit).is_some();
        // a weak word gives way to a unit that measures: `Channel 1 [kN]`
        if !measures || !matches!(what, "a number of the row" | "a voltage" | "a pressure" | "a current") {
            return Err((format!("by its name {what}"), None));
        }
    }
    let role_of = |quantity: &str| Role::ALL.into_iter().find(|r| r.name() == quantity);
    if let Some((role, factor)) = units::measured(&channel.unit).and_then(|(q, f)| Some((role_of(q)?, f))) {
        let both = by_name == Says::Role(role);
        let why = format!("by its unit {}{}", channel.unit, if both { " and its name" } else { "" });
        return Ok(taken(role, factor, why, if both { 2 } else { 1 }));
    }
    match by_name {
        Says::Role(role) if channel.unit.is_empty() => match unit_in(&channel.name, role) {
            Some((unit, factor)) => Ok(taken(role, factor, format!("by its name, in {unit}"), 2)),
            None => Err((format!("by its name {}, but it has no unit", role.name()), Some(role))),
        },
        Says::Role(role) => Err((
            format!("by its name {}, but its unit {} does not measure that", role.name(), channel.unit),
            Some(role),
        )),
        _ if channel.unit.is_empty() => Err(("neither name nor unit says what it is".into(), None)),
        _ => Err((format!("its unit {} measures no channel of a campaign", channel.unit), None)),
    }
}

/// Gives the columns of a group their roles. Roles that `map` gives are given to no other column.
///
/// # Errors
/// What is wrong with the map.
pub fn columns(group: &Group, map: &[Mapped]) -> Result<Columns, Vec<String>> {
    let mut found = Columns::default();
    let mut faults = Vec::new();
    let mut used = vec![false; group.channels.len()];
    for m in map {
        let meant = group.channels.iter().enumerate().find_map(|(i, c)| {
            let said = m.of(&group.name, &c.name, i + 1, &c.unit)?;
            Some((i, c, said))
        });
        // another group may hold it
        let Some((column, c, said)) = meant else { continue };
        used[column] = true;
        match said {
            Ok(said) => {
                let own = units::measured(&c.unit).filter(|u| u.0 == m.role.name()).map(|u| u.1);
                let Some(factor) = said.factor.or(own).or_else(|| unit_in(&c.name, m.role).map(|u| u.1)) else {
                    let of = if c.unit.is_empty() { "no unit".to_string() } else { format!("the unit {}", c.unit) };
                    faults.push(format!(
                        "--map {}={}: the column has {of}; say what it is in, such as {}",
                        m.role.name(),
                        m.text(),
                        example(m.role, &label(c, column), &c.unit)
                    ));
                    continue;
                };
                let note = said.note.map_or(String::new(), |n| format!("; {n}"));
                let why = format!("by --map {}={}{note}", m.role.name(), m.text());
                let name = label(c, column);
                found.taken.push(Taken { column, name, role: m.role, factor, sign: said.sign, why, plain: 3 });
            }
            Err(e) => faults.push(e),
        }
    }
    let said: Vec<Role> = found.taken.iter().map(|t| t.role).collect();
    for (i, c) in group.channels.iter().enumerate().filter(|c| !used[c.0]) {
        match guess(c, i) {
            Ok(t) if said.contains(&t.role) => {
                found.left.push((t.name, format!("--map takes another column as {}", t.role.name())));
            }
            Ok(t) => found.taken.push(t),
            Err((why, role)) => {
                let name = label(c, i);
                if let Some(role) = role.filter(|r| !said.contains(r)) {
                    found.unclear.push((role, format!("{name:?} is {why}; say {}", example(role, &name, &c.unit))));
                }
                found.left.push((name, why));
            }
        }
    }
    if faults.is_empty() {
        Ok(found)
    } else {
        Err(faults)
    }
}

/// A `--map` to write for a column in `unit`: what its sensor gives of it, its unit as it is spelt here, or another one
/// where that says nothing.
pub(crate) fn example(role: Role, column: &str, unit: &str) -> String {
    let of_sensor = match role {
        Role::Time => None,
        Role::Reading(c) => units::output(unit).map(|(base, _)| {
            let (v, a, q) = match c {
                record::Channel::Force => ("2.5mV/N", "4mA/kN", "4pC/N"),
                record::Channel::Acceleration => ("10mV/g", "4mA/g", "10pC/g"),
                record::Channel::Penetration => ("2mm/V", "1mm/mA", "4pC/mm"),
            };
            match base {
                "V" => v,
                "A" => a,
                _ => q,
            }
        }),
    };
    let usual = match role {
        Role::Time => "ms",
        Role::Reading(record::Channel::Force) => "kN",
        Role::Reading(record::Channel::Acceleration) => "g",
        Role::Reading(record::Channel::Penetration) => "mm",
    };
    let unit = of_sensor.or_else(|| units::nearest(role.name(), unit.trim())).unwrap_or(usual);
    let entry = format!("{}={column}:{unit}", role.name());
    if entry.contains(' ') {
        format!("--map '{entry}'")
    } else {
        format!("--map {entry}")
    }
}

/// The same with the group's name in front, by which `--map` names its columns where there are several groups.
pub(crate) fn listed_in(group: &Group, several: bool) -> String {
    if several && !group.name.is_empty() {
        format!("of {:?}: {}", group.name, listed(group))
    } else {
        listed(group)
    }
}

/// The columns of a group in a line: `"Zeit" [ms], "ai0" [V]`.
pub(crate) fn listed(group: &Group) -> String {
    let one = |(i, c): (usize, &Channel)| {
        let unit = if c.unit.is_empty() { String::new() } else { format!(" [{}]", c.unit) };
        format!("{:?}{unit}", label(c, i))
    };
    let most = 12;
    let mut all: Vec<String> = group.channels.iter().enumerate().take(most).map(one).collect();
    if group.channels.len() > most {
        all.push(format!("and {} more", group.channels.len() - most));
    }
    all.join(", ")
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::map::parse;

    pub(crate) fn group(columns: &[(&str, &str)]) -> Group {
        let channels = columns.iter().map(|c| Channel { name: c.0.into(), unit: c.1.into() }).collect();
        Group { channels, ..Group::default() }
    }

    fn roles(columns: &[(&str, &str)], map: &str) -> Vec<(String, &'static str, f64)> {
        let map = if map.is_empty() { Vec::new() } else { parse(map).unwrap() };
        let found = super::columns(&group(columns), &map).unwrap();
        Role::ALL.iter().flat_map(|r| found.of(*r)).map(|t| (t.name.clone(), t.role.name(), t.factor)).collect()
    }

    #[test]
    fn units_come_first_then_names() {
        let all = roles(&[("Zeit", "ms"), ("ai0", "kN"), ("Acc", "g"), ("Temp", "°C"), ("Weg", "mm")], "");
        let names: Vec<&str> = all.iter().map(|r| r.0.as_str()).collect();
        assert_eq!(names, ["Zeit", "ai0", "Acc", "Weg"]);
        assert_eq!(all[2].2, 9.80665);
        // one plain name takes it
        let all = roles(&[("t", "s"), ("Force", "N"), ("Aux", "N")], "");
        assert_eq!(all[1].0, "Force");
        // two that say as much stay two
        assert_eq!(roles(&[("t", "s"), ("Fx", "N"), ("Fz", "N")], "").len(), 3);
        assert_eq!(roles(&[("time_ms", ""), ("Force_kN", ""), ("Accel (m/s^2)", "")], "").len(), 3);
        assert_eq!(roles(&[("Channel 1", "N")], "")[0].1, "force");
        // "in" is a word before a unit, and inches where it is the last
        let factor = |name: &str| roles(&[(name, "")], "").first().map(|r| r.2);
        assert_eq!((factor("Weg in mm"), factor("displacement in")), (Some(1e-3), Some(0.0254)));
        assert_eq!(
            (factor("Depth in nm"), factor("Force in kN"), factor("Weg in Schritten")),
            (Some(1e-9), Some(1e3), None)
        );
    }

    #[test]
    fn what_is_left_out_is_said_and_a_map_decides() {
        let g = group(&[("t", "s"), ("ai0", "V"), ("Force", "V"), ("Kraft", ""), ("v", "m/s"), ("Drop height", "mm")]);
        let found = columns(&g, &[]).unwrap();
        assert_eq!(found.taken.len(), 1);
        assert_eq!(found.left.len(), 5);
        assert_eq!(found.unclear.len(), 2);
        assert!(found.unclear[0].1.contains("--map force=Force:2.5mV/N"), "{:?}", found.unclear);
        let cure = |unit: &str| example(Role::Reading(record::Channel::Force), "F", unit);
        assert_eq!((cure("Volts"), cure("pC")), ("--map force=F:2.5mV/N".into(), "--map force=F:4pC/N".into()));
        assert_eq!((cure("KN"), cure("")), ("--map force=F:kN".into(), "--map force=F:kN".into()));
        let found = columns(&g, &parse("force=ai0:2.5mV/N:negative").unwrap()).unwrap();
        let force = found.of(Role::Reading(record::Channel::Force))[0];
        assert_eq!((force.name.as_str(), force.factor, force.sign), ("ai0", 400.0, Some(-1.0)));
        assert!(found.unclear.is_empty());
        let e = columns(&g, &parse("force=ai0").unwrap()).unwrap_err();
        assert!(e[0].contains("has the unit V") && e[0].contains("force=ai0:2.5mV/N"), "{e:?}");
    }
}
