//! A value of `--material`: the numbers of the body, or the law of a region, with its density and its relaxation where it has them of its own.

use elements::{Region, Relaxation};
use make::{Choice, ELASTIC};

use crate::materials;

/// Densities that tissue may have, kg/m³: what is given in g/cm³ or g/l would be another material.
const DENSITIES: std::ops::RangeInclusive<f64> = 50.0..=2e4;

/// `NAME`, or `REGION=LAW[@DENSITY][~RELAXATION]`; what clap calls.
pub fn choice(text: &str) -> Result<Choice, String> {
    let Some((name, law)) = text.split_once('=') else {
        return Ok(Choice::Numbers(text.trim().to_owned()));
    };
    let name = name.trim().to_owned();
    if name.is_empty() {
        return Err(format!("`{text}` has no region before its equals sign"));
    }
    let of_region = |error: String| format!("region `{name}`: {error}");
    let (law, relaxation) = match law.split_once('~') {
        None => (law, None),
        Some((law, own)) => {
            let own = match own.trim() {
                ELASTIC => Ok(Relaxation::default()),
                "" => Err(format!(
                    "nothing behind its ~; use ~SHARE,TAU_S[,...] or ~{ELASTIC}"
                )),
                own => materials::relaxation(own),
            };
            (law, Some(own.map_err(of_region)?))
        }
    };
    let (law, density) = match law.split_once('@') {
        None => (law, None),
        Some((law, own)) => (law, Some(density(own).map_err(of_region)?)),
    };
    let own = materials::law(law.trim()).map_err(of_region)?;
    let region = Region {
        source: materials::source_of(&own),
        law: own,
        name,
        density_kg_m3: density,
        relaxation,
    };
    Ok(Choice::Law(Box::new(region), law.trim().to_owned()))
}

fn density(text: &str) -> Result<f64, String> {
    let text = text.trim();
    match text.parse() {
        Ok(density) if DENSITIES.contains(&density) => Ok(density),
        Ok(density) => Err(format!(
            "a density of {density}; it is in kg/m³, from 50 to 20000 (water has 1000)"
        )),
        Err(_) => Err(format!("density `{text}` is not a number")),
    }
}

#[cfg(test)]
mod tests {
    use super::choice;
    use make::Choice;

    #[test]
    fn a_region_has_a_law_and_may_have_a_density_and_a_relaxation() {
        for text in [
            "brain",
            "grey=cortex",
            "bone=neo-hookean@1850",
            "grey=cortex@1045~0.45,0.5,0.365,50",
            "bone=neo-hookean~none",
        ] {
            assert_eq!(choice(text).unwrap().to_string(), text);
        }
        let Choice::Law(region, _) = choice("bone=neo-hookean@1850").unwrap() else {
            panic!("a region")
        };
        assert_eq!(region.density_kg_m3, Some(1850.0));
        for (text, words) in [
            ("bone=neo-hookean@1.85", "region `bone`: a density of 1.85"),
            ("bone=neo-hookean@x", "region `bone`: density `x`"),
            ("bone=cortx@1850", "region `bone`: law"),
            (
                "grey=cortex~1.2,0.5",
                "region `grey`: relaxation[0].share is 1.2",
            ),
            ("grey=cortex~", "region `grey`: nothing behind"),
            (
                "grey=cortex~cortex",
                "region `grey`: no relaxation of `cortex`",
            ),
        ] {
            let error = choice(text).unwrap_err();
            assert!(error.contains(words), "{error}");
        }
    }
}
