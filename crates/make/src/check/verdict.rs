//! Whether a certificate's bundle is good enough, and if not, what to change: its first line.

use serde_json::{Value, json};

/// The error in contact over that of linear elasticity, at most.
const SHARE: f64 = 1.0 / 20.0;
/// Or over the mean square of the motion itself: where linear elasticity is nearly right there is little to gain.
const OF_MOTION: f64 = 1e-4;
/// The share in a region of the domain with at least so many steps, at most.
const REGION_SHARE: f64 = 0.2;
const REGION_STEPS: u64 = 20;
/// Corrections are at their limit where steps take this part of them.
const AT_LIMIT: f64 = 0.8;
/// Part of a programme's steps that may have inverted elements.
const INVERTED: f64 = 0.05;
/// Pushes that were too deep become this part of what they were.
const LESS: f64 = 0.7;

/// For the certificate: `good`, and a line of text.
pub fn of(certificate: &Value) -> Value {
    let contact = &certificate["contact"];
    let number = |value: &Value| value.as_f64().unwrap_or(f64::NAN);
    let share = number(&contact["share_of_linear"]);
    let reached = format!(
        "the error in contact is {} of linear elasticity's, at most 1/20 is wanted",
        part(share)
    );
    let faults = faults(certificate);
    let of_motion = number(&contact["mse_mm2"]) / number(&contact["true_mean_square_mm2"]);
    if let Some((what, change)) = faults.first() {
        let what = if what.is_empty() { &reached } else { what };
        return json!({"good": false, "text": format!("not good enough: {what}; {change}")});
    }
    let text = match share <= SHARE {
        true => format!("good: {reached}"),
        false => format!(
            "good: the error in contact is {:.1e} of the motion's mean square, where linear elasticity is nearly right too",
            of_motion
        ),
    };
    json!({"good": true, "text": text})
}

/// `1/250`, `1/3.1`.
fn part(share: f64) -> String {
    let over = 1.0 / share;
    match over < 10.0 {
        true => format!("1/{over:.1}"),
        false => format!("1/{over:.0}"),
    }
}

/// What is wrong and what to do, the gravest first; nothing of what for the error in contact.
fn faults(certificate: &Value) -> Vec<(String, String)> {
    let contact = &certificate["contact"];
    let number = |value: &Value| value.as_f64().unwrap_or(f64::NAN);
    let list = |value: &'_ Value| value.as_array().cloned().unwrap_or_default();
    let push = number(&certificate["envelope"]["max_push_mm"]);
    let shallower = format!(
        "lower --push from {push:.1} to {:.1}, narrow --domain to where more tissue lies beneath, or hold it elsewhere (--fixed)",
        LESS * push
    );
    let mut found = Vec::new();
    let programmes = list(&certificate["tested"]["programmes"]);
    if contact["steps"].as_u64().unwrap_or(0) == 0 {
        let change = "give more --minutes, or a wider --domain".to_owned();
        found.push(("no contact was tested".to_owned(), change));
        return found;
    }
    let refused: u64 = programmes
        .iter()
        .filter_map(|case| case["refused_steps"].as_u64())
        .sum();
    if refused > 0 {
        found.push((
            format!("the guard refused {refused} steps"),
            shallower.clone(),
        ));
    }
    let inverts = |case: &&Value| case["ended"].is_string() && case["frames_in_time"].is_null();
    let inverted = programmes.iter().filter(inverts).count();
    if inverted > 0 {
        let what = format!(
            "in {inverted} of {} contacts the reference solver's elements inverted",
            programmes.len()
        );
        found.push((what, shallower.clone()));
    }
    let share = number(&contact["share_of_linear"]);
    let of_motion = number(&contact["mse_mm2"]) / number(&contact["true_mean_square_mm2"]);
    if !(share <= SHARE || of_motion <= OF_MOTION) {
        let (taken, most) = (
            number(&certificate["tested"]["corrections_mean"]),
            number(&certificate["tested"]["corrections"]),
        );
        let change = match taken < AT_LIMIT * most {
            true => shallower,
            false => {
                format!("{shallower}; or allow more than {most:.0} corrections (--corrections)")
            }
        };
        found.push((String::new(), change));
    }
    for region in list(&certificate["regions"]) {
        let share = number(&region["share_of_linear"]);
        if region["steps"].as_u64() >= Some(REGION_STEPS)
            && share > REGION_SHARE
            && number(&region["mse_mm2"])
                > REGION_SHARE * OF_MOTION * number(&region["true_mean_square_mm2"])
            && found.is_empty()
        {
            let what = format!(
                "in one region of the domain the error is {} of linear elasticity's",
                part(share)
            );
            let change =
                "narrow --domain (certificate.html shows where), or lower --push".to_owned();
            found.push((what, change));
        }
    }
    for row in list(&certificate["tools"]) {
        let (bad, steps) = (number(&row["inverted_steps"]), number(&row["steps"]));
        if bad > INVERTED * steps {
            let name = row["programme"].as_str().unwrap_or_default();
            let what = format!("tools of `{name}` invert elements in {bad} of {steps} steps");
            found.push((what, "give a smaller --tool-scale or --push".to_owned()));
        }
    }
    let left_out = list(&certificate["tools_left_out"]);
    if !left_out.is_empty() {
        let names: Vec<&str> = left_out.iter().filter_map(Value::as_str).collect();
        let what = format!("tools of `{}` were not tested", names.join("`, `"));
        found.push((what, "give more --minutes".to_owned()));
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    fn certificate(share: f64, ended: Value) -> Value {
        json!({
            "contact": {"steps": 100, "mse_mm2": share, "true_mean_square_mm2": 4.0, "share_of_linear": share},
            "tested": {
                "corrections": 10, "corrections_mean": 9.5,
                "programmes": [{"refused_steps": 0, "ended": ended, "frames_in_time": null}],
            },
            "regions": [], "tools": [], "envelope": {"max_push_mm": 10.0},
        })
    }

    #[test]
    fn a_verdict_says_what_is_wrong_and_what_to_change() {
        let line = |value: &Value| of(value)["text"].as_str().unwrap().to_owned();
        let good = certificate(0.004, Value::Null);
        assert_eq!(of(&good)["good"], true);
        assert!(
            line(&good).starts_with("good: ") && line(&good).contains("1/250"),
            "{}",
            line(&good)
        );
        let bad = line(&certificate(0.4, Value::Null));
        assert!(
            bad.starts_with("not good enough: ")
                && bad.contains("1/2.5")
                && bad.contains("from 10.0 to 7.0")
                && bad.contains("--corrections"),
            "{bad}"
        );
        let inverted = line(&certificate(0.004, json!("an element inverted")));
        assert!(
            inverted.starts_with("not good enough: in 1 of 1 contacts"),
            "{inverted}"
        );
        // Time that was too short is no fault of the bundle.
        let mut short = certificate(0.004, json!("no time"));
        short["tested"]["programmes"][0]["frames_in_time"] = json!(30);
        assert_eq!(of(&short)["good"], true);
        let mut none = certificate(0.004, Value::Null);
        none["contact"]["steps"] = json!(0);
        assert_eq!(of(&none)["good"], false);
        // Linear elasticity may be right already.
        let mut small = certificate(0.4, Value::Null);
        small["contact"]["true_mean_square_mm2"] = json!(1e5);
        assert_eq!(of(&small)["good"], true, "{}", line(&small));
        let mut tools = certificate(0.004, Value::Null);
        tools["tools"] = json!([{"programme": "press", "steps": 100, "inverted_steps": 30}]);
        assert!(line(&tools).contains("`press`"), "{}", line(&tools));
        let mut untested = certificate(0.004, Value::Null);
        untested["tools_left_out"] = json!(["stroke"]);
        assert_eq!(
            line(&untested),
            "not good enough: tools of `stroke` were not tested; give more --minutes"
        );
    }
}
