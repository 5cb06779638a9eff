//! Where in a text the next table of numbers stands, and in which dialect.
//!
//! A window of lines is read in every dialect; the one that finds the most numbers in a run of lines of numbers only wins.

use crate::shared::cell::{bare, proves_thousands, split, text, Cell, Decimal, Delimiter, Dialect};
use crate::shared::lines::Mark;
use crate::shared::unit;

/// Lines that are looked at to find a table.
pub(crate) const WINDOW: usize = 512;
/// Lines of numbers that make a table beyond doubt.
const SURE: usize = 3;

/// A line kept.
#[derive(Clone, Debug)]
pub(crate) struct Kept {
    pub mark: Mark,
    pub bytes: Vec<u8>,
}

/// What a column holds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Kind {
    /// Nothing yet: the first cell decides.
    Open,
    Number,
    Stamp,
    Text,
}

/// A table found in a window.
#[derive(Clone, Debug)]
pub(crate) struct Layout {
    pub dialect: Dialect,
    /// Its first line in the window.
    pub start: usize,
    pub kinds: Vec<Kind>,
    /// Whether lines of numbers only were found, and not only numbers beside texts, as in lines of metadata.
    pub pure: bool,
}

/// The text of a comment line (`#`, `%`, `//`, and `;` where it is no delimiter), without its mark.
pub(crate) fn comment(line: &[u8], delimiter: Delimiter) -> Option<&[u8]> {
    let line = line.trim_ascii();
    let mark = match line {
        [b'#', rest @ ..]
            if ["N/A", "NUM!", "DIV/0!", "VALUE!", "REF!"].iter().any(|e| rest.starts_with(e.as_bytes())) =>
        {
            return None
        }
        [b'%', b'\t' | b',' | b';' | b'|', ..] => return None,
        [b'#' | b'%', ..] => line[0],
        [b'/', b'/', ..] => b'/',
        [b';', ..] if delimiter != Delimiter::Byte(b';') => b';',
        _ => return None,
    };
    let marks = line.iter().take_while(|b| **b == mark).count();
    Some(line[marks..].trim_ascii())
}

/// Whether a line holds nothing but spaces, delimiters and the end-of-file mark of DOS.
pub(crate) fn is_blank(line: &[u8], delimiter: Delimiter) -> bool {
    line.iter().all(|b| matches!(b, b' ' | b'\t' | 0x1A | 0x0C) || Delimiter::Byte(*b) == delimiter)
}

/// The next table in a window. `whole` says that the text ends with the window; `delimiter` is the one that the file
/// itself names; `last` is the dialect of the table before.
pub(crate) fn find(
    window: &[Kept],
    whole: bool,
    delimiter: Option<Delimiter>,
    last: Option<Dialect>,
) -> Option<Layout> {
    if let Some(dialect) = last {
        let rows = rows(window, dialect);
        if let Some(run) = run(&rows, whole).filter(|r| r.pure) {
            return Some(layout(&rows, &run, dialect));
        }
    }
    let mut best: Option<(Run, Dialect)> = None;
    for dialect in candidates(window, delimiter) {
        let Some(run) = run(&rows(window, dialect), whole) else { continue };
        match &mut best {
            Some((b, of)) if (b.pure, b.values) == (run.pure, run.values) => {
                // as many numbers with a point as with a comma: no number has either
                if of.delimiter == dialect.delimiter && dialect.delimiter != Delimiter::Byte(b',') {
                    of.decimal = Decimal::Open;
                }
            }
            Some((b, _)) if (b.pure, b.values) > (run.pure, run.values) => {}
            _ => best = Some((run, dialect)),
        }
    }
    let (best_run, mut dialect) = best?;
    if delimiter.is_none() && dialect.delimiter == Delimiter::Byte(b',') && halves(window, &best_run) {
        dialect = Dialect { delimiter: Delimiter::Byte(b'\t'), decimal: Decimal::Comma, thousands: false };
    }
    let mut cells = Vec::new();
    dialect.thousands = window[best_run.first..=best_run.last].iter().any(|line| {
        split(&line.bytes, dialect.delimiter, &mut cells);
        cells.iter().any(|c| proves_thousands(&line.bytes[c.clone()], dialect.decimal))
    });
    let rows = rows(window, dialect);
    Some(layout(&rows, &run(&rows, whole)?, dialect))
}

/// The dialects that a window may be of, the likelier ones first.
fn candidates(window: &[Kept], delimiter: Option<Delimiter>) -> Vec<Dialect> {
    let holds = |byte: u8| window.iter().any(|line| line.bytes.contains(&byte));
    let known = [b'\t', b';', b',', b'|'].map(Delimiter::Byte);
    let delimiters: Vec<Delimiter> = match delimiter {
        Some(d) => vec![d],
        // the tab stays where there is none: then a line is one cell
        None => known.into_iter().filter(|d| *d == known[0] || matches!(d, Delimiter::Byte(b) if holds(*b))).collect(),
    };
    let spaces = (delimiter.is_none() && holds(b' ')).then_some(Delimiter::Spaces);
    let of = |delimiter, decimal| Dialect { delimiter, decimal, thousands: false };
    let mut all = Vec::new();
    for delimiter in delimiters.into_iter().chain(spaces) {
        all.push(of(delimiter, Decimal::Point));
        if delimiter != Delimiter::Byte(b',') || holds(b'"') {
            all.push(of(delimiter, Decimal::Comma));
        }
    }
    all
}

/// The cells of each line; None for a blank line and a comment.
fn rows(window: &[Kept], mut dialect: Dialect) -> Vec<Option<Vec<Cell>>> {
    let mut cells = Vec::new();
    let row = |line: &Kept| {
        if is_blank(&line.bytes, dialect.delimiter) || comment(&line.bytes, dialect.delimiter).is_some() {
            return None;
        }
        split(&line.bytes, dialect.delimiter, &mut cells);
        Some(cells.iter().map(|c| dialect.cell(&line.bytes[c.clone()])).collect())
    };
    window.iter().map(row).collect()
}

/// Lines that hold a table.
#[derive(Clone, Debug)]
struct Run {
    first: usize,
    last: usize,
    lines: usize,
    values: usize,
    /// No text in it.
    pure: bool,
}

fn run(rows: &[Option<Vec<Cell>>], whole: bool) -> Option<Run> {
    let pure = |row: &[Cell], of: &[Cell]| {
        row.len() <= of.len()
            && row.iter().any(|c| c.is_value())
            && !row.iter().any(|c| matches!(c, Cell::Text | Cell::Date))
    };
    let alike = |row: &[Cell], of: &[Cell]| {
        row.len() == of.len()
            && row.iter().any(|c| c.is_value())
            && row.iter().zip(of).all(|(a, b)| a.is_value() == b.is_value())
    };
    let choose = |runs: Vec<Run>, least: usize| {
        let width = |r: &Run| rows[r.first].as_ref().map_or(0, Vec::len);
        // a few lines of one number each before a longer table of several columns are metadata
        let metadata =
            |r: &Run| width(r) == 1 && runs.iter().any(|o| width(o) > 1 && o.lines >= r.lines && o.first > r.first);
        let sure = runs.iter().position(|r| r.lines >= SURE && !(r.lines < 10 && metadata(r)));
        let longest =
            || (0..runs.len()).rev().max_by_key(|i| runs[*i].lines).filter(|i| whole && runs[*i].lines >= least);
        sure.or_else(longest).map(|i| runs[i].clone())
    };
    choose(runs(rows, true, pure), 1).or_else(|| choose(runs(rows, false, alike), 1))
}

/// Runs of lines that go with the first of the run.
fn runs(rows: &[Option<Vec<Cell>>], pure: bool, goes: impl Fn(&[Cell], &[Cell]) -> bool) -> Vec<Run> {
    let mut runs: Vec<Run> = Vec::new();
    let mut broken = true;
    for (i, row) in rows.iter().enumerate() {
        let Some(row) = row else { continue };
        let values = row.iter().filter(|c| c.is_value()).count();
        match runs.last_mut() {
            Some(run) if !broken && goes(row, rows[run.first].as_deref().unwrap_or_default()) => {
                run.last = i;
                run.lines += 1;
                run.values += values;
            }
            _ => {
                broken = !goes(row, row);
                if !broken {
                    runs.push(Run { first: i, last: i, lines: 1, values, pure });
                }
            }
        }
    }
    runs
}

/// The table that a run belongs to: it may begin above (metadata beside the first samples) and has columns of text.
fn layout(rows: &[Option<Vec<Cell>>], run: &Run, dialect: Dialect) -> Layout {
    let head: Vec<&Vec<Cell>> = rows[run.first..=run.last].iter().flatten().take(SURE).collect();
    let value = |row: &[Cell], c: usize| row.get(c).is_some_and(|cell| cell.is_value());
    let widest = head.iter().map(|r| r.len()).max().unwrap_or(0);
    let mut set: Vec<usize> = (0..widest).filter(|c| head.iter().all(|r| value(r, *c))).collect();
    if set.is_empty() {
        set = (0..widest).filter(|c| head.iter().any(|r| value(r, *c))).collect();
    }
    let fits = |row: &[Cell]| {
        set.iter().all(|c| matches!(row.get(*c), Some(Cell::Number(_) | Cell::Stamp(_) | Cell::Missing)))
            && set.iter().any(|c| value(row, *c))
    };
    let start = first_line(rows, run.first, set.len(), fits);
    let clash = |row: &[Cell]| set.iter().any(|c| matches!(row.get(*c), Some(Cell::Text | Cell::Date)));
    let below: Vec<&Vec<Cell>> = rows[start..].iter().flatten().collect();
    let end = below.iter().position(|r| clash(r));
    let mut table = below[..end.unwrap_or(below.len())].to_vec();
    // right above a line that is none of the table, a line with a text in a column that was empty so far is of the next header
    let text = |r: &[Cell], c: usize| matches!(r.get(c), Some(Cell::Text | Cell::Date));
    let begins = |t: &[&Vec<Cell>]| match t {
        [above @ .., last] => {
            (0..last.len()).any(|c| text(last, c) && above.iter().all(|r| matches!(r.get(c), None | Some(Cell::Empty))))
        }
        [] => false,
    };
    while end.is_some() && table.len() > 1 && begins(&table) {
        table.pop();
    }
    let table = if table.is_empty() { head } else { table };
    let mut kinds: Vec<Kind> = Vec::new();
    // a column that begins further down is none: a line with more cells than the first ones is at fault
    let width = rows[start..=run.last].iter().flatten().take(run.first - start + SURE).map(Vec::len).max().unwrap_or(0);
    for c in 0..width {
        let sure = set.binary_search(&c).is_ok();
        let kind = kind(&table, c, sure, kinds.last() == Some(&Kind::Text));
        kinds.push(kind);
    }
    Layout { dialect, start, kinds, pure: run.pure }
}

/// The first line of a table whose sure lines begin at `first`. One line that does not fit is passed over where it holds
/// numbers and a line that fits stands above it, and one with a number first and one text only is taken in: these are lines
/// of the table with a fault, which the reading names.
fn first_line(rows: &[Option<Vec<Cell>>], first: usize, columns: usize, fits: impl Fn(&[Cell]) -> bool) -> usize {
    let row = |i: usize| rows[i].as_deref();
    let width = row(first).map(<[Cell]>::len);
    let mut start = first;
    loop {
        let above = |n: usize| start.checked_sub(n).and_then(row);
        let near = above(1).filter(|r| columns > 1 && Some(r.len()) == width);
        if above(1).is_some_and(&fits) {
            start -= 1;
        } else if near.is_some_and(|r| r.iter().any(|c| c.is_value())) && above(2).is_some_and(&fits) {
            start -= 2;
        } else if near.is_some_and(|r| r[0].is_value() && r.iter().filter(|c| !c.is_value()).eq([&Cell::Text])) {
            return start - 1;
        } else {
            return start;
        }
    }
}

fn kind(table: &[&Vec<Cell>], column: usize, sure: bool, after_text: bool) -> Kind {
    let cell = |row: &[Cell]| row.get(column).copied().unwrap_or(Cell::Empty);
    let values = table.iter().filter(|r| cell(r).is_value()).count();
    let texts = table.iter().filter(|r| matches!(cell(r), Cell::Text | Cell::Date)).count();
    let first = table.iter().map(|r| cell(r)).find(|c| c.is_value());
    let of_values = match first {
        None => Kind::Open,
        Some(Cell::Stamp(_)) => Kind::Stamp,
        Some(_) => Kind::Number,
    };
    // numbers that stand only where a text stands before them, and not in every line, are metadata
    let labelled =
        after_text && values < table.len() && table.iter().all(|r| !cell(r).is_value() || r[column - 1] == Cell::Text);
    if !sure && (texts > 0 && values <= 10 * texts || values > 0 && labelled) {
        Kind::Text
    } else {
        of_values
    }
}

/// Whether what reads as two columns of whole numbers is one column with decimal commas: the second has a leading zero, or
/// the line above names one column.
fn halves(window: &[Kept], run: &Run) -> bool {
    let parts = |line: &[u8]| {
        let mut cells = Vec::new();
        split(line, Delimiter::Byte(b','), &mut cells);
        cells.iter().map(|c| bare(&line[c.clone()]).to_vec()).collect::<Vec<Vec<u8>>>()
    };
    let digits = |cell: &[u8]| !cell.is_empty() && cell.iter().all(u8::is_ascii_digit);
    let mut leading_zero = false;
    for line in &window[run.first..=run.last] {
        if is_blank(&line.bytes, Delimiter::Byte(b',')) {
            continue;
        }
        match parts(&line.bytes).as_slice() {
            [first, second] if digits(first.strip_prefix(b"-").unwrap_or(first)) && digits(second) => {
                leading_zero |= second.len() > 1 && second[0] == b'0';
            }
            _ => return false,
        }
    }
    leading_zero
        || window[..run.first].iter().rev().find(|l| !is_blank(&l.bytes, Delimiter::Byte(b','))).is_some_and(one_name)
}

/// Whether a line is the name of one column: a word, or a name with its unit.
fn one_name(line: &Kept) -> bool {
    let text = text(&line.bytes);
    !text.contains([',', ':', '=']) && (!text.contains(' ') || !unit::of_name(&text).1.is_empty())
}
