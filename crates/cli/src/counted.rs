//! Numbers of things in words: one case, two cases.

/// `1 case`, `2 cases`.
pub fn counted(count: usize, one: &str) -> String {
    match count {
        1 => format!("1 {one}"),
        _ => format!("{count} {one}s"),
    }
}

#[cfg(test)]
mod tests {
    use super::counted;

    #[test]
    fn one_is_no_plural() {
        let words = [0, 1, 2].map(|count| counted(count, "case"));
        assert_eq!(words, ["0 cases", "1 case", "2 cases"]);
    }
}
