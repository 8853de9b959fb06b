//! `--fibre [NAME=]X,Y,Z`: the direction of the fibres of a region, or of the whole body.

use std::fmt;
use std::str::FromStr;

/// A direction at rest, and the region whose tetrahedra have it.
#[derive(Clone, Debug, PartialEq)]
pub struct Fibre {
    /// None: the whole body.
    pub name: Option<String>,
    /// Unit.
    pub direction: [f32; 3],
}

impl FromStr for Fibre {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (name, numbers) = match text.rsplit_once('=') {
            None => (None, text),
            Some((name, _)) if name.trim().is_empty() => {
                return Err(format!("`{text}` has no name before its equals sign"));
            }
            Some((name, numbers)) => (Some(name.trim().to_owned()), numbers),
        };
        let fault = || format!("`{numbers}` is no direction; write X,Y,Z, three numbers not all 0");
        let parts = numbers.split(',').map(|part| part.trim().parse::<f64>());
        let parts: Vec<f64> = parts.collect::<Result<_, _>>().map_err(|_| fault())?;
        let own: [f64; 3] = parts.try_into().map_err(|_| fault())?;
        let length = own.iter().map(|x| x * x).sum::<f64>().sqrt();
        if !(length > 0.0 && length.is_finite()) {
            return Err(fault());
        }
        Ok(Self {
            name,
            direction: own.map(|x| (x / length) as f32),
        })
    }
}

impl fmt::Display for Fibre {
    fn fmt(&self, to: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(name) = &self.name {
            write!(to, "{name}=")?;
        }
        let [x, y, z] = self.direction;
        write!(to, "{x},{y},{z}")
    }
}

#[cfg(test)]
mod tests {
    use super::Fibre;

    #[test]
    fn a_direction_is_a_unit_vector_of_a_region_or_of_the_body() {
        let own: Fibre = "muscle=0,3,4".parse().unwrap();
        assert_eq!(own.name.as_deref(), Some("muscle"));
        assert_eq!(own.direction, [0.0, 0.6, 0.8]);
        assert_eq!(own.to_string().parse::<Fibre>().unwrap(), own);
        let whole: Fibre = "-2,0,0".parse().unwrap();
        assert_eq!((whole.name, whole.direction), (None, [-1.0, 0.0, 0.0]));
        for (text, told) in [
            ("0,0,0", "not all 0"),
            ("1,2", "X,Y,Z"),
            ("1,2,3,4", "X,Y,Z"),
            ("NaN,0,1", "no direction"),
            ("inf,0,1", "no direction"),
            ("a,b,c", "no direction"),
            ("=1,0,0", "no name"),
        ] {
            let error = text.parse::<Fibre>().unwrap_err();
            assert!(error.contains(told), "{text}: {error}");
        }
    }
}
