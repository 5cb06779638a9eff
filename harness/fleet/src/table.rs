//! A fleet as one table, a row a campaign: Parquet.

use crate::answers::{Fleet, State};
use crate::growth::text;
use anyhow::Result;
use parquet::basic::{LogicalType, Repetition, Type as Physical};
use parquet::data_type::{BoolType, ByteArray, ByteArrayType, DoubleType};
use parquet::file::properties::WriterProperties;
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::types::Type;
use record::Label;
use std::collections::BTreeSet;
use std::sync::Arc;

/// The name of the file.
pub const FILE: &str = "fleet.parquet";

/// The values of a column; None: there is none.
enum Values {
    Bool(Vec<Option<bool>>),
    Double(Vec<Option<f64>>),
    Text(Vec<Option<String>>),
}

/// The table as Parquet, nothing compressed, the rows in the fleet's order. Columns of the user's own are called `column.NAME`;
/// `probability.MECHANISM` is that the mechanism is missing, `size.MECHANISM` the largest change that it makes where it is
/// named, `parameter.MECHANISM.NAME` a parameter there.
///
/// # Errors
/// As the writer gives them.
pub fn parquet(fleet: &Fleet) -> Result<Vec<u8>> {
    let columns = columns(fleet);
    let mut fields = Vec::new();
    for (name, values) in &columns {
        let (physical, logical) = match values {
            Values::Bool(_) => (Physical::BOOLEAN, None),
            Values::Double(_) => (Physical::DOUBLE, None),
            Values::Text(_) => (Physical::BYTE_ARRAY, Some(LogicalType::String)),
        };
        let field = Type::primitive_type_builder(name, physical).with_repetition(Repetition::OPTIONAL);
        fields.push(Arc::new(field.with_logical_type(logical).build()?));
    }
    let schema = Arc::new(Type::group_type_builder("fleet").with_fields(fields).build()?);
    let properties = Arc::new(WriterProperties::builder().set_dictionary_enabled(false).build());
    let mut writer = SerializedFileWriter::new(Vec::new(), schema, properties)?;
    let mut group = writer.next_row_group()?;
    for (_, values) in &columns {
        if let Some(mut w) = group.next_column()? {
            match values {
                Values::Bool(v) => w.typed::<BoolType>().write_batch(&there(v), Some(&levels(v)), None)?,
                Values::Double(v) => w.typed::<DoubleType>().write_batch(&there(v), Some(&levels(v)), None)?,
                Values::Text(v) => {
                    let bytes: Vec<ByteArray> = v.iter().flatten().map(|s| ByteArray::from(s.as_str())).collect();
                    w.typed::<ByteArrayType>().write_batch(&bytes, Some(&levels(v)), None)?
                }
            };
            w.close()?;
        }
    }
    group.close()?;
    Ok(writer.into_inner()?)
}

fn there<T: Copy>(values: &[Option<T>]) -> Vec<T> {
    values.iter().flatten().copied().collect()
}

/// Definition levels: 1 where there is a value.
fn levels<T>(values: &[Option<T>]) -> Vec<i16> {
    values.iter().map(|v| i16::from(v.is_some())).collect()
}

fn columns(fleet: &Fleet) -> Vec<(String, Values)> {
    let all = &fleet.answers;
    let texts = |f: &dyn Fn(&crate::Answer) -> Option<String>| Values::Text(all.iter().map(f).collect());
    let doubles = |f: &dyn Fn(&crate::Judged) -> Option<f64>| {
        let finite = |v: f64| v.is_finite().then_some(v);
        Values::Double(all.iter().map(|a| a.judged().and_then(f).and_then(finite)).collect())
    };
    let bools = |f: &dyn Fn(&crate::Judged) -> bool| Values::Bool(all.iter().map(|a| a.judged().map(f)).collect());
    let state = |a: &crate::Answer| match a.state {
        State::Judged(_) => "judged",
        State::Unjudged(_) => "not judged",
        State::Lost(_) => "lost",
    };
    let why = |a: &crate::Answer| match &a.state {
        State::Judged(_) => None,
        State::Unjudged(why) | State::Lost(why) => Some(why.clone()),
    };
    let mut found = vec![
        ("campaign".to_string(), texts(&|a| Some(a.campaign.clone()))),
        ("state".into(), texts(&|a| Some(state(a).into()))),
        ("why".into(), texts(&why)),
        ("detected".into(), bools(&|j| j.detected)),
        ("false_alarm_probability".into(), doubles(&|j| Some(j.false_alarm_probability))),
        ("false_discovery_rate".into(), doubles(&|j| Some(j.false_discovery_rate))),
        ("cause".into(), texts(&|a| a.judged().map(|j| j.cause()))),
        ("probability".into(), doubles(&|j| Some(j.sure()))),
        ("unexplained".into(), bools(&|j| j.unexplained)),
        ("heldout_nrmse_before".into(), doubles(&|j| j.before)),
        ("heldout_nrmse_after".into(), doubles(&|j| j.after)),
    ];
    for name in fleet.columns() {
        let labels = || all.iter().map(|a| a.columns.get(&name));
        let is_number = labels().flatten().all(|l| matches!(l, Label::Number(_)));
        let number = |l: &Label| match l {
            Label::Number(x) => Some(*x),
            Label::Text(_) => None,
        };
        let values = if is_number {
            Values::Double(labels().map(|l| l.and_then(number)).collect())
        } else {
            Values::Text(labels().map(|l| l.map(text)).collect())
        };
        found.push((format!("column.{name}"), values));
    }
    for m in fleet.mechanisms() {
        found.push((format!("probability.{m}"), doubles(&|j| Some(j.probability_of(&m)))));
    }
    let named: Vec<&crate::Named> = fleet.judged().flat_map(|(_, j)| &j.missing).collect();
    let names: BTreeSet<&str> = named.iter().map(|n| n.mechanism.as_str()).collect();
    for m in names {
        found.push((format!("size.{m}"), doubles(&|j| j.missing.iter().find(|n| n.mechanism == m)?.size)));
    }
    let parameters: BTreeSet<(&str, &str)> =
        named.iter().flat_map(|n| n.parameters.iter().map(|p| (n.mechanism.as_str(), p.0.as_str()))).collect();
    for (m, name) in parameters {
        let of = |j: &crate::Judged| {
            let n = j.missing.iter().find(|n| n.mechanism == m)?;
            n.parameters.iter().find(|p| p.0 == name).map(|p| p.1)
        };
        found.push((format!("parameter.{m}.{name}"), doubles(&of)));
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::answers::tests::{verdict, write};
    use parquet::file::reader::{FileReader, SerializedFileReader};
    use parquet::record::RowAccessor;

    #[test]
    fn the_table_has_a_row_for_every_campaign_and_the_same_bytes_twice() {
        let t = tempfile::tempdir().unwrap();
        write(t.path(), "a", &verdict(Some(("wear", 0.2)), 1e-9, 0.05, serde_json::json!({"order": 3, "batch": "B"})));
        write(t.path(), "b", &verdict(None, 0.5, 0.01, serde_json::json!({"order": 1, "batch": 7})));
        crate::register::lose(t.path(), "c", "aborted").unwrap();
        let f = Fleet::read(&[t.path().to_path_buf()]).unwrap();
        let bytes = super::parquet(&f).unwrap();
        assert_eq!(bytes, super::parquet(&f).unwrap());
        let reader = SerializedFileReader::new(bytes::Bytes::from(bytes)).unwrap();
        let names: Vec<String> =
            reader.metadata().file_metadata().schema().get_fields().iter().map(|f| f.name().to_string()).collect();
        let at = |name: &str| names.iter().position(|n| n == name).unwrap_or_else(|| panic!("{name} of {names:?}"));
        let rows: Vec<_> = reader.get_row_iter(None).unwrap().map(Result::unwrap).collect();
        let of = |name: &str| rows.iter().map(|r| r.get_string(at(name)).cloned().ok()).collect::<Vec<_>>();
        let text = |s: &str| Some(s.to_string());
        assert_eq!(of("campaign"), [text("c"), text("a"), text("b")]);
        assert_eq!(of("state"), [text("lost"), text("judged"), text("judged")]);
        assert_eq!(of("why"), [text("aborted"), None, None]);
        assert_eq!(of("column.batch"), [None, text("B"), text("7")]);
        assert_eq!(rows[1].get_double(at("column.order")).unwrap(), 3.0);
        assert_eq!(rows[1].get_double(at("size.wear")).unwrap(), 0.2);
        assert_eq!(rows[1].get_double(at("parameter.wear.a")).unwrap(), 0.2);
        assert_eq!(rows[2].get_double(at("probability.wear")).unwrap(), 0.0);
        assert!(rows[2].get_double(at("size.wear")).is_err() && rows[0].get_bool(at("detected")).is_err());
    }
}
