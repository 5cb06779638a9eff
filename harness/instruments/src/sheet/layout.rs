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
    let mut columns: Vec<usize> = (0..width).filter(|&c| is_numeric(kinds, c)).collect();
    // a column that ends early: its last cell decides
    let last = |c: usize| kinds.iter().rposition(|row| row.get(c).is_some_and(|k| *k != Kind::Empty));
    let early = |c: &usize| last(*c).filter(|&row| kinds[row][*c] == Kind::Number);
    if columns.is_empty() {
        columns = (0..width).filter(|c| early(c).is_some()).collect();
    }
    if columns.is_empty() {
        return None;
    }
    let first = first_row(kinds, &columns)?;
    let mut numeric = vec![false; width];
    columns.iter().for_each(|c| numeric[*c] = true);
    let holds = |c: usize| numeric[c] || last(c) < Some(kinds.len() / 2) && early(&c) >= Some(first);
    Some(Layout { first, numeric: (0..width).map(holds).collect() })
}

/// A column holds numbers where its lower half does: there are no names and descriptions there.
fn is_numeric(kinds: &[Vec<Kind>], column: usize) -> bool {
    let lower = &kinds[kinds.len() / 2..];
    let count = |of: Kind| lower.iter().filter(|r| r.get(column) == Some(&of)).count();
    count(Kind::Number) > 0 && count(Kind::Number) >= count(Kind::Text)
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
    fn columns_of_text_and_columns_that_end_early_are_reported() {
        let found = of(&["aaa", "1a1", "1a1", "1a ", "1a ", "1a ", "1a ", "1a "]).expect("a table");
        assert_eq!(found, Layout { first: 1, numeric: vec![true, false, true] });
    }

    #[test]
    fn numbers_in_the_rows_above_make_no_column() {
        let found = of(&["a1a", "", "a", "a", "1", "1", "1", "1", "1", "1"]).expect("a table");
        assert_eq!(found, Layout { first: 4, numeric: vec![true, false, false] });
    }

    #[test]
    fn cells_without_numbers_are_no_table() {
        assert_eq!((of(&["a", "b"]), of(&[])), (None, None));
    }
}
