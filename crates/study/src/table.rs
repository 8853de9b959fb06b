//! Tables: rows under titled columns, as Markdown and for a terminal.

/// Title of a column, and what it shows of a row.
pub type Column<R> = (&'static str, fn(&R) -> String);

/// Cells by row, below their titles.
pub struct Table {
    head: Vec<String>,
    rows: Vec<Vec<String>>,
    /// Places of the columns of words, which begin at the left; figures end at the right.
    words: &'static [usize],
}

impl Table {
    /// Without rows. Titles are parted by semicolons.
    pub fn new(words: &'static [usize], titles: &str) -> Self {
        Self {
            head: titles.split(';').map(|title| title.trim().into()).collect(),
            rows: Vec::new(),
            words,
        }
    }

    pub fn of<'a, R: 'a>(
        words: &'static [usize],
        columns: &[Column<R>],
        rows: impl IntoIterator<Item = &'a R>,
    ) -> Self {
        let cells = |row| columns.iter().map(|column| (column.1)(row)).collect();
        Self {
            head: columns.iter().map(|column| column.0.into()).collect(),
            rows: rows.into_iter().map(cells).collect(),
            words,
        }
    }

    /// One row more.
    pub fn push<const N: usize>(&mut self, cells: [String; N]) {
        debug_assert_eq!(N, self.head.len());
        self.rows.push(cells.into());
    }

    /// A table of Markdown.
    pub fn markdown(&self) -> String {
        let line = |cells: &[String]| {
            let cells: Vec<String> = cells.iter().map(|cell| cell.replace('|', "\\|")).collect();
            format!("| {} |\n", cells.join(" | "))
        };
        let rule = |at: usize| match self.words.contains(&at) {
            true => "---|",
            false => "---:|",
        };
        let rule: String = (0..self.head.len()).map(rule).collect();
        let rows: String = self.rows.iter().map(|row| line(row)).collect();
        format!("{}|{rule}\n{rows}", line(&self.head))
    }

    /// Aligned columns.
    pub fn text(&self) -> String {
        let lines = || std::iter::once(&self.head).chain(&self.rows);
        let width = |column: usize| lines().map(|line| line[column].chars().count()).max();
        let widths: Vec<usize> = (0..self.head.len()).filter_map(width).collect();
        let cell = |(at, cell): (usize, &String)| match (self.words.contains(&at), widths[at]) {
            (true, width) => format!("{cell:<width$}"),
            (false, width) => format!("{cell:>width$}"),
        };
        let line = |line: &Vec<String>| {
            let cells: Vec<String> = line.iter().enumerate().map(cell).collect();
            cells.join("  ").trim_end().to_owned() + "\n"
        };
        lines().map(line).collect()
    }
}

/// `-` of none.
pub fn or_dash<T>(value: Option<T>, shown: impl Fn(T) -> String) -> String {
    value.map_or_else(|| "-".into(), shown)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_begin_at_the_left_and_figures_end_at_the_right() {
        let mut table = Table::new(&[0], "case; |u|, mm");
        table.push(["a press".into(), "9.5".into()]);
        table.push(["two".into(), "10.25".into()]);
        let markdown = "| case | \\|u\\|, mm |\n|---|---:|\n| a press | 9.5 |\n| two | 10.25 |\n";
        assert_eq!(table.markdown(), markdown);
        assert_eq!(
            table.text(),
            "case     |u|, mm\na press      9.5\ntwo        10.25\n"
        );
    }
}
