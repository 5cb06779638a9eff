//! `--map`: what the user says of a column.

use crate::amount::{instead, split};
use crate::words::Role;
use record::units;

/// What one entry of `--map` says: `force=ai0:2.5mV/N:negative`.
#[derive(Clone, Debug, PartialEq)]
pub struct Mapped {
    pub role: Role,
    /// The column, and behind it what else is said, as written: a column's name may hold colons.
    text: String,
}

/// What a column is multiplied by.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Said {
    /// Factor to SI; None: that of the unit in the file.
    pub factor: Option<f64>,
    /// -1 or 1; None: as the readings show.
    pub sign: Option<f64>,
    /// What had to be assumed.
    pub note: Option<String>,
}

/// Reads a list of entries, parted by commas before the next `ROLE=`.
///
/// # Errors
/// What is wrong with it.
pub fn parse(text: &str) -> Result<Vec<Mapped>, String> {
    let mut entries: Vec<String> = Vec::new();
    for part in text.split(',') {
        let begins = part.split_once('=').is_some_and(|(role, _)| Role::named(role).is_some());
        match entries.last_mut() {
            Some(last) if !begins && !part.contains('=') => {
                last.push(',');
                last.push_str(part);
            }
            _ => entries.push(part.to_string()),
        }
    }
    let one = |entry: &String| {
        let (role, column) = entry
            .split_once('=')
            .filter(|e| !e.1.trim().is_empty())
            .ok_or_else(|| format!("--map {entry}: no column is named; write --map force=COLUMN:UNIT"))?;
        let known = Role::ALL.map(Role::name);
        let role = Role::named(role)
            .ok_or_else(|| format!("--map {entry}: {role:?} is no channel; {}", instead(role, &known)))?;
        Ok(Mapped { role, text: column.trim().to_string() })
    };
    entries.iter().map(one).collect()
}

impl Mapped {
    /// What the entry says where it means the column of that name, the `number`-th of the group `group`, counted from 1; None
    /// where it means another one. A column of one group among several is also `GROUP/COLUMN` and `GROUP/#3`.
    ///
    /// # Errors
    /// What is wrong with what stands behind the column's name.
    pub fn of(&self, group: &str, name: &str, number: usize, unit: &str) -> Option<Result<Said, String>> {
        let after = |column: &str| {
            let head = self.text.get(..column.len()).filter(|h| h.eq_ignore_ascii_case(column))?;
            let rest = &self.text[head.len()..];
            (rest.is_empty() || rest.starts_with(':')).then_some(rest)
        };
        let of_group = |column: &str| {
            let joined = || ['/', '.'].into_iter().find_map(|by| after(&format!("{group}{by}{column}")));
            after(column).or_else(|| if group.is_empty() { None } else { joined() })
        };
        // as the header of the file has it, with its unit behind it
        let as_in_file = || {
            let forms = [
                format!("{name} ({unit})"),
                format!("{name} [{unit}]"),
                format!("{name}({unit})"),
                format!("{name}[{unit}]"),
            ];
            forms.iter().find_map(|f| of_group(f))
        };
        let with_unit = || if unit.is_empty() { None } else { as_in_file() };
        let named = if name.is_empty() { None } else { of_group(name).or_else(with_unit) };
        let rest = named.or_else(|| of_group(&format!("#{number}")))?;
        Some(self.said(rest, unit).map_err(|e| format!("--map {}={}: {e}", self.role.name(), self.text)))
    }

    /// The column of a group that the entry means, from 0; None where it means none.
    pub(crate) fn column(&self, group: &instruments::Group) -> Option<usize> {
        let means = |(k, c): (usize, &instruments::Channel)| self.of(&group.name, &c.name, k + 1, &c.unit).is_some();
        group.channels.iter().enumerate().position(means)
    }

    /// The column as the entry names it, to say that there is none.
    pub fn text(&self) -> &str {
        &self.text
    }

    fn said(&self, rest: &str, unit: &str) -> Result<Said, String> {
        let mut said = Said::default();
        for word in rest.split(':').map(str::trim).filter(|w| !w.is_empty()) {
            match word {
                "negative" => said.sign = Some(-1.0),
                "positive" => said.sign = Some(1.0),
                _ => {
                    let (factor, note) = self.factor(word, unit)?;
                    (said.factor, said.note) = (Some(factor), note);
                }
            }
        }
        Ok(said)
    }

    /// Factor to SI out of a unit, a number with a unit for a reading of one, or a sensitivity either way round.
    fn factor(&self, word: &str, in_file: &str) -> Result<(f64, Option<String>), String> {
        let (number, unit) = split(word).unwrap_or((1.0, word));
        let quantity = self.role.name();
        let of = |unit: &str| {
            units::factor(quantity, unit)
                .ok_or_else(|| format!("unit {unit:?} does not measure {quantity}; {}", units::instead(quantity, unit)))
        };
        let wrong = |n: f64| !(n.is_finite() && n != 0.0);
        if wrong(number) {
            return Err(format!("a factor of {number} leaves nothing"));
        }
        // reading / sensitivity: 2.5mV/N
        let sensitivity = unit.split_once('/').and_then(|(o, u)| Some((units::output(o)?, u, -1)));
        // reading x gain: 200N/V
        let gain = unit.rsplit_once('/').and_then(|(u, o)| Some((units::output(o)?, u, 1)));
        let Some(((base, per), unit, way)) = sensitivity.or(gain) else { return Ok((number * of(unit)?, None)) };
        let (reading, note) = match units::output(in_file) {
            Some((b, f)) if b == base => (f, None),
            Some(_) => return Err(format!("the column is in {in_file}, the sensitivity in {base}")),
            None if in_file.is_empty() => (1.0, Some(format!("its readings, without a unit, are taken as {base}"))),
            None => return Err(format!("the column is in {in_file}, which needs no sensitivity")),
        };
        let factor = if way < 0 { reading * of(unit)? / (number * per) } else { reading * number * of(unit)? / per };
        Ok((factor, note))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn said(text: &str, name: &str, unit: &str) -> Result<Said, String> {
        parse(text).unwrap()[0].of("", name, 2, unit).unwrap()
    }

    fn factor(text: &str, name: &str, unit: &str) -> f64 {
        said(text, name, unit).unwrap().factor.unwrap()
    }

    #[test]
    fn units_signs_and_sensitivities() {
        let near = |a: f64, b: f64| assert!((a / b - 1.0).abs() < 1e-12, "{a} {b}");
        near(factor("force=ai0:kN", "ai0", "V"), 1e3);
        assert_eq!(
            said("acceleration=AI1:g:negative", "ai1", ""),
            Ok(Said { factor: Some(9.80665), sign: Some(-1.0), note: None })
        );
        near(factor("force=Scale (grams):gf", "Scale", "grams"), 9.80665e-3);
        near(factor("force=Load [lbf]:lbf", "Load", "lbf"), 4.4482216152605);
        assert!(parse("force=Scale (grams):gf").unwrap()[0].of("", "Scale", 2, "N").is_none());
        near(factor("force=ai0:2.5mV/N", "ai0", "V"), 400.0);
        near(factor("force=ai0:2.5mV/N", "ai0", "mV"), 0.4);
        near(factor("force=ai0:0,2kN/V", "ai0", "V"), 200.0);
        near(factor("acceleration=#2:10mV/g", "anything", "V"), 980.665);
        near(factor("acceleration=#2:1.02mV/m/s^2", "anything", "V"), 1e3 / 1.02);
        near(factor("acceleration=x:100 m/s^2/V", "x", "V"), 100.0);
        near(factor("force=x:4pC/N", "x", "pC"), 0.25);
        near(factor("force=x:0.5N", "x", ""), 0.5);
        for volts in ["Volt", "Volts", "volts", "VDC"] {
            near(factor("force=x:200N/V", "x", volts), 200.0);
            near(factor("force=x:2.5mVolt/lbf", "x", volts), 400.0 * 4.4482216152605);
        }
        near(factor("force=x:200N/V", "x", "mVolt"), 0.2);
        near(factor("acceleration=x:ft/s^2", "x", ""), 0.3048);
        near(factor("force=x:lbs", "x", ""), 4.4482216152605);
        assert!(said("force=x:2.5mV/N", "x", "").unwrap().note.unwrap().contains("taken as V"));
        assert_eq!(said("force=Dev1:ai0", "Dev1:ai0", ""), Ok(Said::default()));
    }

    #[test]
    fn entries_are_parted_and_wrong_ones_reported() {
        let all = parse("force=a, b:kN,time=t:ms,displacement=#3").unwrap();
        assert_eq!(all.len(), 3);
        assert_eq!((all[0].text(), all[2].role.name()), ("a, b:kN", "penetration"));
        assert!(all[1].of("", "force", 1, "").is_none());
        let of = |group: &str| {
            parse("force=drop_2/force:kN").unwrap()[0].of(group, "force", 1, "").map(|s| s.unwrap().factor)
        };
        assert_eq!((of("drop_1"), of("drop_2")), (None, Some(Some(1e3))));
        assert!(parse("farce=a").unwrap_err().contains("did you mean \"force\""));
        assert!(parse("force=").is_err());
        for (text, unit, part) in [
            ("force=x:mm", "", "measures penetration"),
            ("force=x:2mV/N", "kN", "needs no sensitivity"),
            ("force=x:2mV/N", "pC", "the column is in pC"),
            ("force=x:0mV/N", "V", "leaves nothing"),
        ] {
            assert!(said(text, "x", unit).unwrap_err().contains(part), "{text}");
        }
    }
}
