//! What came out, as tables and figures.

use super::outcome::{Bounce, Exact, Outcome, Row};
use super::plan::Case;
use anyhow::Result;
use law::impact::impact;
use serde::Serialize;
use std::sync::Arc;

/// The exact impact beside a simulated one; None where more than the plain law acts, or it is not over.
pub(super) fn compare_exact(case: &Case, b: &Bounce) -> Option<Exact> {
    if !case.is_free_and_plain() || b.separation.is_none() {
        return None;
    }
    let (l, m, v) = (&case.law, case.rig.mass(), b.impact_speed);
    let e = impact(m, v, l.elastic.stiffness, l.elastic.exponent, l.hysteresis_damping.coefficient)?;
    let off = |a: f64, b: f64| a / b - 1.0;
    Some(Exact {
        deepest: e.deepest,
        restitution: e.restitution,
        peak_force: e.peak_force,
        duration: e.duration,
        energy_lost: e.energy_lost,
        impulse: e.impulse,
        differences: [
            off(b.deepest, e.deepest),
            off(b.restitution, e.restitution),
            off(b.peak_force, e.peak_force),
            off(b.duration, e.duration),
            (b.energy_lost - e.energy_lost) / (0.5 * m * v * v),
            off(b.impulse, e.impulse),
        ],
    })
}

/// Time and height of the largest of `value` between two times, from the parabola through the largest row and its
/// neighbours. None without rows there.
pub fn peak(rows: &[Row], from: f64, to: f64, value: &dyn Fn(&Row) -> f64) -> Option<(f64, f64)> {
    let inside = |r: &&Row| r.time >= from && r.time <= to;
    let (i, _) = rows.iter().enumerate().filter(|(_, r)| inside(r)).max_by(|a, b| value(a.1).total_cmp(&value(b.1)))?;
    let here = (rows[i].time, value(&rows[i]));
    if i == 0 || i + 1 >= rows.len() {
        return Some(here);
    }
    let (a, b) = (&rows[i - 1], &rows[i + 1]);
    let (ta, tb) = (a.time - here.0, b.time - here.0);
    let (fa, fb) = (value(a) - here.1, value(b) - here.1);
    if !(ta < 0.0 && tb > 0.0 && (fa < 0.0 || fb < 0.0)) {
        return Some(here);
    }
    // s t + c t^2 through both neighbours
    let c = (fb / tb - fa / ta) / (tb - ta);
    let s = fa / ta - c * ta;
    let t = (-s / (2.0 * c)).clamp(ta, tb);
    Some((here.0 + t, here.1 + t * (s + c * t)))
}

/// What a sensor makes of an impact's largest contact force.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct SensorPeak {
    /// Largest reading: N for the transducer, m/s^2 (of being pushed back) for the accelerometer.
    pub peak: f64,
    /// The force it reports over the largest contact force; the accelerometer's reading times all masses.
    pub over_contact: f64,
    /// The same with rigid springs: what lies above the transducer over all masses; 1 for the accelerometer.
    pub over_contact_if_rigid: f64,
    /// How much later its peak comes than the contact's, s.
    pub delay: f64,
}

impl Outcome {
    /// (force transducer, accelerometer) at an impact, for three bodies.
    pub fn sensors(&self, case: &Case, b: &Bounce) -> Option<(SensorPeak, SensorPeak)> {
        let rig = &case.rig;
        rig.sensors(&self.rows.first()?.state)?;
        let end = b.separation? + b.duration;
        let read = |r: &Row| rig.sensors(&r.state).unwrap_or((0.0, 0.0));
        let force = peak(&self.rows, b.touch, end, &|r| read(r).0)?;
        let pushed = peak(&self.rows, b.touch, end, &|r| -read(r).1)?;
        let all = rig.mass();
        let of = |p: (f64, f64), factor: f64, rigid: f64| SensorPeak {
            peak: p.1,
            over_contact: p.1 * factor / b.peak_force,
            over_contact_if_rigid: rigid,
            delay: p.0 - b.peak_time,
        };
        Some((of(force, 1.0, (all - rig.masses()[0]) / all), of(pushed, all, 1.0)))
    }
}

/// Columns of numbers with the names and units of results.csv.
#[derive(Clone, Debug, PartialEq)]
pub struct Table {
    /// `name [unit]`, in order.
    pub head: Vec<String>,
    /// As many columns, of one length.
    pub columns: Vec<Vec<f64>>,
}

/// The rows of every run, run after run, numbered from 1 on. Columns that no run has are left out; what a run does
/// not have is NaN.
pub fn table(runs: &[(&Case, &Outcome)]) -> Table {
    type Of = fn(&Case, &Row) -> f64;
    let all: [(&str, Of); 18] = [
        ("time [s]", |_, r| r.time),
        ("penetration [m]", |_, r| r.state[0]),
        ("velocity [m/s]", |_, r| r.state[1]),
        ("force [N]", |_, r| r.force),
        ("stored energy [J]", |_, r| r.stored),
        ("dissipated energy [J]", |_, r| r.dissipated),
        ("kinetic energy [J]", |_, r| r.kinetic),
        ("potential energy [J]", |_, r| r.potential),
        ("contact work [J]", |c, r| r.state[c.rig.places().work]),
        ("heat outside contact [J]", |c, r| r.state[c.rig.places().heat]),
        ("work against holding force [J]", |c, r| c.rig.spring.map_or(f64::NAN, |_| r.state[c.rig.places().holding])),
        ("impulse [N s]", |c, r| r.state[c.rig.places().impulse]),
        ("body position [m]", |c, r| if c.rig.count() == 3 { r.state[2] } else { f64::NAN }),
        ("body velocity [m/s]", |c, r| if c.rig.count() == 3 { r.state[3] } else { f64::NAN }),
        ("accelerometer position [m]", |c, r| if c.rig.count() == 3 { r.state[4] } else { f64::NAN }),
        ("accelerometer velocity [m/s]", |c, r| if c.rig.count() == 3 { r.state[5] } else { f64::NAN }),
        ("transducer force [N]", |c, r| c.rig.sensors(&r.state).map_or(f64::NAN, |s| s.0)),
        ("accelerometer reading [m/s^2]", |c, r| c.rig.sensors(&r.state).map_or(f64::NAN, |s| s.1)),
    ];
    let mut t = Table { head: vec!["run [1]".into()], columns: vec![Vec::new()] };
    for (i, (_, o)) in runs.iter().enumerate() {
        t.columns[0].extend(o.rows.iter().map(|_| (i + 1) as f64));
    }
    for (name, of) in all {
        let column: Vec<f64> = runs.iter().flat_map(|(c, o)| o.rows.iter().map(move |r| of(c, r))).collect();
        if column.iter().any(|v| !v.is_nan()) || name == "time [s]" {
            t.head.push(name.into());
            t.columns.push(column);
        }
    }
    t
}

impl Table {
    /// The table as CSV: every number reads back as the same double, nothing stands for NaN.
    pub fn csv(&self) -> String {
        let mut out = self.head.join(",") + "\n";
        for i in 0..self.columns[0].len() {
            for (j, c) in self.columns.iter().enumerate() {
                if j > 0 {
                    out.push(',');
                }
                if !c[i].is_nan() {
                    out += &format!("{:e}", c[i]);
                }
            }
            out.push('\n');
        }
        out
    }

    /// The table as Parquet: a double a column, nothing compressed, the names those of the CSV.
    ///
    /// # Errors
    /// As the writer gives them.
    pub fn parquet(&self) -> Result<Vec<u8>> {
        use parquet::basic::{Repetition, Type as Physical};
        use parquet::data_type::DoubleType;
        use parquet::file::properties::WriterProperties;
        use parquet::file::writer::SerializedFileWriter;
        use parquet::schema::types::Type;
        let mut fields = Vec::new();
        for name in &self.head {
            let field = Type::primitive_type_builder(name, Physical::DOUBLE).with_repetition(Repetition::REQUIRED);
            fields.push(Arc::new(field.build()?));
        }
        let schema = Arc::new(Type::group_type_builder("results").with_fields(fields).build()?);
        let properties = Arc::new(WriterProperties::builder().set_dictionary_enabled(false).build());
        let mut writer = SerializedFileWriter::new(Vec::new(), schema, properties)?;
        let mut group = writer.next_row_group()?;
        for column in &self.columns {
            if let Some(mut w) = group.next_column()? {
                w.typed::<DoubleType>().write_batch(column, None, None)?;
                w.close()?;
            }
        }
        group.close()?;
        Ok(writer.into_inner()?)
    }
}
