//! Tables for a terminal.

/// Rows of cells with each column as wide as its widest cell, a line each, two spaces before.
pub fn aligned<R: AsRef<[String]>>(rows: &[R]) -> String {
    let columns = rows.iter().map(|r| r.as_ref().len()).max().unwrap_or(0);
    let width = |j: usize| rows.iter().filter_map(|r| Some(r.as_ref().get(j)?.chars().count())).max().unwrap_or(0);
    let widths: Vec<usize> = (0..columns).map(width).collect();
    let line = |r: &R| {
        let cells: Vec<String> = r.as_ref().iter().zip(&widths).map(|(cell, w)| format!("{cell:<w$}")).collect();
        format!("  {}\n", cells.join("  ").trim_end())
    };
    rows.iter().map(line).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_are_as_wide_as_their_widest_cell() {
        let rows = [["a", "b"].map(String::from), ["long", "c"].map(String::from)];
        assert_eq!(aligned(&rows), "  a     b\n  long  c\n");
        assert_eq!(aligned::<Vec<String>>(&[]), "");
    }
}
