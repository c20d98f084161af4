//! Tables of a report.

/// Numbers with headings. Columns whose heading ends in ` ms` or ` s` are times: all others are the same in each run.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Table {
    /// Of its file, without folder and ending, and different from the figure's others.
    pub name: String,
    /// What is written above it.
    pub caption: String,
    /// Headings, with units.
    pub columns: Vec<String>,
    /// A cell for each heading.
    pub rows: Vec<Vec<String>>,
}

impl Table {
    /// Without rows.
    pub fn new(name: &str, caption: &str, columns: &[&str]) -> Self {
        let columns = columns.iter().map(|&column| column.to_owned()).collect();
        Self { name: name.into(), caption: caption.into(), columns, rows: Vec::new() }
    }

    /// Adds a row, of as many cells as there are columns.
    pub fn row<const N: usize>(&mut self, cells: [String; N]) {
        debug_assert_eq!(N, self.columns.len());
        self.rows.push(cells.into());
    }

    /// Comma-separated values (RFC 4180), with a line of headings.
    pub fn csv(&self) -> String {
        let line = |cells: &Vec<String>| cells.iter().map(|cell| quoted(cell)).collect::<Vec<_>>().join(",");
        let lines = std::iter::once(&self.columns).chain(&self.rows).map(line);
        lines.map(|line| line + "\n").collect()
    }
}

fn quoted(cell: &str) -> String {
    if cell.contains([',', '"', '\n']) { format!("\"{}\"", cell.replace('"', "\"\"")) } else { cell.into() }
}

/// A number with so many digits after the point, without a sign where it is 0.
pub fn number(value: f64, digits: usize) -> String {
    let text = format!("{value:.digits$}");
    if text.trim_start_matches('-').chars().all(|c| c == '0' || c == '.') {
        text.trim_start_matches('-').into()
    } else {
        text
    }
}
