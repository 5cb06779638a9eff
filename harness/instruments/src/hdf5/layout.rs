//! What a dataset is to the reader: channels, or a reason why not.

use super::element::{is_number, is_plain, numbers_of};
use super::Dialect;
use hdf5_reader::{dtype_element_size, Dataset, Datatype};

/// Channels of one dataset, at most; a dataset with more on its shorter axis is a picture or a map.
const CHANNELS: u64 = 4096;
/// Bytes of samples that a byte of the file can hold at most: deflate packs 1032 to 1.
const PACKED: u64 = 1100;
/// Bytes that a dataset may hold whatever the length of its file: values that were never written take no place.
const SPARSE: u64 = 1 << 20;

/// Channels of a dataset.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Layout {
    /// The axis along which the samples follow each other.
    pub time: usize,
    pub samples: u64,
    /// Names below the dataset's own: the fields of a record, or the places on the other axis; one empty name for a
    /// dataset that is one channel.
    pub names: Vec<String>,
    pub kind: Kind,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Kind {
    /// One axis.
    Line,
    /// Two axes; `across`: the axis of the channels comes before that of the samples.
    Table { across: bool },
    /// Compound records.
    Records,
}

/// The channels in `dataset`, of a file of `length` bytes.
///
/// # Errors
/// Why it holds none.
pub(super) fn layout(dataset: &Dataset, dialect: Dialect, length: u64) -> Result<Layout, String> {
    let shape = dataset.shape();
    let long: Vec<usize> = (0..shape.len()).filter(|&i| shape[i] > 1).collect();
    let elements = shape.iter().try_fold(1u64, |n, d| n.checked_mul(*d)).ok_or("its size is beyond all measure")?;
    let size = dtype_element_size(dataset.dtype()).map_err(|e| e.to_string())? as u64;
    if elements.saturating_mul(size) > length.saturating_mul(PACKED).saturating_add(SPARSE) {
        return Err(format!("it claims {elements} elements, more than the file can hold"));
    }
    if let Datatype::Compound { fields, .. } = dataset.dtype() {
        let names = fields.iter().flat_map(|f| field_names(&f.name, &f.datatype)).take(CHANNELS as usize + 1).collect();
        return records(names, &long, shape);
    }
    if !is_number(dataset.dtype()) || !is_plain(&dataset.raw_datatype().map_err(|e| e.to_string())?) {
        return Err("its elements are not numbers of a known kind".into());
    }
    match long[..] {
        [] => Err("it is empty".into()),
        [time] => Ok(Layout { time, samples: shape[time], names: vec![String::new()], kind: Kind::Line }),
        [first, second] => table(first, second, shape, dialect),
        _ => Err(format!("it has {} axes; channels have one or two", long.len())),
    }
}

fn records(names: Vec<String>, long: &[usize], shape: &[u64]) -> Result<Layout, String> {
    match long {
        _ if names.is_empty() => Err("its records hold no numbers".into()),
        _ if names.len() as u64 > CHANNELS => Err(format!("its records hold more than {CHANNELS} numbers")),
        [time] => Ok(Layout { time: *time, samples: shape[*time], names, kind: Kind::Records }),
        [] => Err("it is one record".into()),
        _ => Err(format!("it has {} axes of records; a table has one", long.len())),
    }
}

/// Names of the numbers of a compound field; none where it holds none.
fn field_names(name: &str, of: &Datatype) -> Vec<String> {
    match (numbers_of(of), of) {
        (None, _) => Vec::new(),
        (Some((count, _)), Datatype::Array { .. }) => {
            (0..count.min(CHANNELS + 1)).map(|i| format!("{name}[{i}]")).collect()
        }
        (Some(_), _) => vec![name.to_string()],
    }
}

/// The longer axis is time; of two equal ones the first, in MATLAB the rows, which it stores last.
fn table(first: usize, second: usize, shape: &[u64], dialect: Dialect) -> Result<Layout, String> {
    let across = shape[second] > shape[first] || (shape[second] == shape[first] && dialect == Dialect::Matlab);
    let (time, other) = if across { (second, first) } else { (first, second) };
    if shape[other] > CHANNELS {
        return Err(format!("{} by {} numbers are no table of channels", shape[first], shape[second]));
    }
    let name = |i: u64| match (dialect, across) {
        (Dialect::Plain, false) => format!("[:, {i}]"),
        (Dialect::Plain, true) => format!("[{i}, :]"),
        (Dialect::Matlab, true) => format!("(:, {})", i + 1),
        (Dialect::Matlab, false) => format!("({}, :)", i + 1),
    };
    Ok(Layout {
        time,
        samples: shape[time],
        names: (0..shape[other]).map(name).collect(),
        kind: Kind::Table { across },
    })
}
