//! `--gravity X,Y,Z`.

/// The largest gravity along an axis, m/s².
const LARGEST: f64 = upt::LARGEST_GRAVITY as f64;

/// Gravity, m/s².
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gravity(pub [f64; 3]);

/// `X,Y,Z`.
pub fn gravity(text: &str) -> Result<Gravity, String> {
    let parts: Vec<f64> = (text.split(','))
        .map(|part| part.trim().parse::<f64>())
        .collect::<Result<_, _>>()
        .map_err(|_| format!("`{text}` is not three numbers; write X,Y,Z in m/s²"))?;
    let Ok(gravity) = <[f64; 3]>::try_from(parts) else {
        return Err(format!(
            "`{text}` is not three numbers; write X,Y,Z in m/s²"
        ));
    };
    if let Some(wrong) = gravity.iter().find(|g| g.is_nan() || g.abs() > LARGEST) {
        return Err(format!(
            "{wrong} m/s² is no gravity, must be at most {LARGEST}"
        ));
    }
    if gravity == [0.0; 3] {
        return Err("is zero, which is what acts without the option; leave it out".into());
    }
    Ok(Gravity(gravity))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn three_numbers_are_a_gravity() {
        assert_eq!(gravity("0, -9.81,0"), Ok(Gravity([0.0, -9.81, 0.0])));
        for (text, wrong) in [
            ("0,-9.81", "three numbers"),
            ("down", "three numbers"),
            ("0,0,nan", "no gravity"),
            ("0,-9810,0", "at most 1000"),
            ("0,0,0", "leave it out"),
        ] {
            let error = gravity(text).unwrap_err();
            assert!(error.contains(wrong), "{text}: {error}");
        }
    }
}
