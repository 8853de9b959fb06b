//! A body of a file that holds several, and the list of them that an error shows.

/// Bodies that an error lists.
pub const LISTED: usize = 12;

/// A body, as far as one must know to choose it.
#[derive(Clone, Debug, PartialEq)]
pub struct FoundBody {
    /// What the file calls it; empty where it has no name.
    pub name: String,
    pub volume_mm3: f64,
    /// Of its volume, mm.
    pub centre: [f64; 3],
}

impl std::fmt::Display for FoundBody {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        if !self.name.is_empty() {
            write!(f, "`{}`, ", self.name)?;
        }
        let [x, y, z] = self.centre.map(|x| x + 0.0);
        write!(
            f,
            "{:.3} ml at ({x:.1}, {y:.1}, {z:.1}) mm",
            1e-3 * self.volume_mm3
        )
    }
}

/// For an error: one line for each body.
pub fn list(bodies: &[FoundBody]) -> String {
    let mut lines: Vec<String> = (bodies.iter().enumerate().take(LISTED))
        .map(|(at, body)| format!("\n  {}: {body}", at + 1))
        .collect();
    if bodies.len() > LISTED {
        lines.push(format!("\n  and {} more", bodies.len() - LISTED));
    }
    lines.concat()
}
