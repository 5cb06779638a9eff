//! Where on a sheet the table stands: which columns hold numbers, and in which row they begin.

/// What a cell holds, for finding where the samples begin.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Kind {
    /// Nothing, or a mark of a missing value.
    Empty,
    Number,
    Text,
}

/// A table on a sheet.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Layout {
    /// The first row of samples.
    pub first: usize,
    /// Of each column: whether it holds numbers.
    pub numeric: Vec<bool>,
}

/// The table whose first rows hold `kinds`; None where no column holds numbers.
pub(super) fn layout(kinds: &[Vec<Kind>]) -> Option<Layout> {
    let width = kinds.iter().map(Vec::len).max()?;
    let numeric: Vec<bool> = (0..width).map(|column| is_numeric(kinds, column)).collect();
    let columns: Vec<usize> = (0..width).filter(|&c| numeric[c]).collect();
    if columns.is_empty() {
        return None;
    }
    Some(Layout { first: first_row(kinds, &columns)?, numeric })
}

/// A column holds numbers where its lower half does: there are no names and descriptions there.
fn is_numeric(kinds: &[Vec<Kind>], column: usize) -> bool {
    let count = |of: Kind, rows: &[Vec<Kind>]| rows.iter().filter(|r| r.get(column) == Some(&of)).count();
    let lower = &kinds[kinds.len() / 2..];
    let (numbers, texts) = (count(Kind::Number, lower), count(Kind::Text, lower));
    if numbers + texts > 0 {
        return numbers > 0 && numbers >= texts;
    }
    // a column that ends early: its last cell tells
    kinds.iter().rev().filter_map(|r| r.get(column)).find(|k| **k != Kind::Empty) == Some(&Kind::Number)
}

/// The first row in which the numeric columns hold numbers and no text, and so does the row below it.
fn first_row(kinds: &[Vec<Kind>], columns: &[usize]) -> Option<usize> {
    let count = |row: usize, of: Kind| columns.iter().filter(|&&c| kinds[row].get(c) == Some(&of)).count();
    let samples = |row: usize| count(row, Kind::Number) * 2 >= columns.len() && count(row, Kind::Text) == 0;
    let some = |row: usize| count(row, Kind::Number) > 0 && count(row, Kind::Text) == 0;
    let found = (0..kinds.len()).find(|&r| samples(r) && (r + 1 == kinds.len() || count(r + 1, Kind::Text) == 0));
    found.or_else(|| (0..kinds.len()).find(|&r| some(r)))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Numbers are `1`, texts `a`, empty cells a space.
    fn of(rows: &[&str]) -> Option<Layout> {
        let kind = |c: char| match c {
            ' ' => Kind::Empty,
            '1' => Kind::Number,
            _ => Kind::Text,
        };
        layout(&rows.iter().map(|r| r.chars().map(kind).collect()).collect::<Vec<_>>())
    }

    #[test]
    fn samples_begin_below_the_last_text() {
        assert_eq!(of(&["11", "11"]), Some(Layout { first: 0, numeric: vec![true, true] }));
        assert_eq!(of(&["a", "a1a", "", "aa", "aa", "11", "11", "11"]).expect("a table").first, 5);
    }

    #[test]
    fn columns_of_text_and_columns_that_end_early_are_told() {
        let found = of(&["aaa", "1a1", "1a1", "1a ", "1a ", "1a ", "1a ", "1a "]).expect("a table");
        assert_eq!(found, Layout { first: 1, numeric: vec![true, false, true] });
    }

    #[test]
    fn cells_without_numbers_are_no_table() {
        assert_eq!((of(&["a", "b"]), of(&[])), (None, None));
    }
}
