//! MAT-files of version 4: matrices one after the other, each behind a head of five numbers.

use super::{Contents, Matrix};
use crate::shared::binary::{Bytes, Number, Order, Walk, EXPORT};
use crate::Fault;

/// Letters of a name, at most.
const NAME: u32 = 256;

fn order(head: [u8; 4]) -> Option<Order> {
    // MOPT: 0 or 1 for the order of bytes, 0, kind of number 0 to 5, kind of matrix 0 to 2
    let valid = |kind: u32, machine: u32| kind / 1000 == machine && kind % 1000 < 60 && kind % 10 < 3;
    match (valid(u32::from_le_bytes(head), 0), valid(u32::from_be_bytes(head), 1)) {
        (true, _) => Some(Order::Little),
        (_, true) => Some(Order::Big),
        _ => None,
    }
}

pub(super) fn is(head: &[u8]) -> bool {
    let kind = head.get(..4).and_then(|h| h.try_into().ok()).and_then(order);
    let number = |order, at: usize| {
        let bytes: [u8; 4] = head.get(at..at + 4)?.try_into().ok()?;
        Some(if order == Order::Big { u32::from_be_bytes(bytes) } else { u32::from_le_bytes(bytes) })
    };
    kind.is_some_and(|o| number(o, 12).is_some_and(|i| i < 2) && number(o, 16).is_some_and(|n| (1..=NAME).contains(&n)))
}

pub(super) fn read(bytes: Bytes) -> Result<Contents, Fault> {
    let mut contents = Contents::new(bytes);
    contents.read_all(0, variable)?;
    Ok(contents)
}

/// Reads the variable at `at`; where the next begins, None where the file ends before.
fn variable(contents: &mut Contents, at: u64) -> Result<Option<u64>, Fault> {
    let length = contents.areas[0].length();
    let mut walk = Walk { bytes: &mut contents.areas[0], at, end: length, order: Order::Little };
    if !walk.has(20) {
        return Ok(None);
    }
    let head = walk.array::<4>()?;
    walk.order = order(head).ok_or_else(|| walk.bytes.fault(at, "no variable of a MAT-file begins here", EXPORT))?;
    let kind = if walk.order == Order::Big { u32::from_be_bytes(head) } else { u32::from_le_bytes(head) };
    let (rows, columns, imaginary, letters) = (walk.u32()?, walk.u32()?, walk.u32()?, walk.u32()?);
    if letters > NAME || imaginary > 1 {
        return Err(walk.fault(format!("a name of {letters} letters is claimed"), EXPORT));
    }
    let number =
        [Number::F64, Number::F32, Number::I32, Number::I16, Number::U16, Number::U8][(kind / 10 % 10) as usize];
    let size = u64::from(rows).checked_mul(columns.into()).and_then(|n| n.checked_mul(number.size()));
    let size = size.and_then(|s| s.checked_mul(1 + u64::from(imaginary)));
    if !size.and_then(|s| s.checked_add(letters.into())).is_some_and(|s| walk.has(s)) {
        return Ok(None);
    }
    let name = walk.text(letters.into())?.trim_end_matches('\0').to_string();
    let (data, order, size) = (walk.at, walk.order, size.unwrap_or(0));
    let matrix = Matrix { name, area: 0, at: data, number, order, rows: rows.into(), columns: columns.into() };
    match (kind % 10, imaginary) {
        (0, 0) => contents.add(matrix)?,
        (0, _) => contents.leave_out(&matrix.name, "its numbers are complex"),
        (1, _) => text(contents, matrix)?,
        _ => contents.leave_out(&matrix.name, "it is a sparse matrix; save full(...) of it"),
    }
    Ok(Some(data + size))
}

/// A text of one line as a property.
fn text(contents: &mut Contents, matrix: Matrix) -> Result<(), Fault> {
    if matrix.rows != 1 || matrix.columns > 1 << 16 {
        contents.leave_out(&matrix.name, "it is text of many lines");
        return Ok(());
    }
    let mut letters = vec![0.0; matrix.columns as usize];
    contents.areas[0].numbers(matrix.at, matrix.number.size(), matrix.number, matrix.order, &mut letters)?;
    let text = letters.iter().map(|c| char::from_u32(*c as u32).unwrap_or('\u{FFFD}')).collect();
    contents.say(matrix.name, text);
    Ok(())
}
