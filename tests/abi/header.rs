//! The statuses that the comments of `include/upt.h` promise for each function.

use std::collections::{HashMap, HashSet};

/// Function name -> statuses other than `UPT_OK`.
pub type Documented = HashMap<String, HashSet<i32>>;

/// All functions that the header declares.
pub fn declared() -> HashSet<String> {
    let text = std::fs::read_to_string("include/upt.h").unwrap();
    let code = text.split("/**").map(|piece| {
        let code = piece.split_once("*/").map_or("", |(_, code)| code);
        code.split_once("(").map_or("", |(head, _)| head)
    });
    code.filter(|head| !head.contains("typedef") && !head.contains('{'))
        .filter_map(|head| head.split([' ', '*', '\n']).next_back())
        .filter(|name| name.starts_with("upt_"))
        .map(str::to_owned)
        .collect()
}

/// Reads the header.
pub fn documented() -> Documented {
    let text = std::fs::read_to_string("include/upt.h").unwrap();
    let codes: HashMap<&str, i32> = text
        .lines()
        .filter_map(|line| line.trim().split_once(" = "))
        .filter_map(|(name, value)| Some((name, value.trim_end_matches(',').parse().ok()?)))
        .collect();
    let mut own: HashMap<String, Vec<String>> = HashMap::new();
    for piece in text.split("/**").skip(1) {
        let Some((comment, code)) = piece.split_once("*/") else {
            continue;
        };
        let name = code
            .trim_start()
            .strip_prefix("upt_status ")
            .and_then(|code| code.split('(').next());
        if let Some(name) = name {
            let errors = comment
                .split_once("rrors:")
                .map_or("", |(_, errors)| errors);
            let words = |c: char| !c.is_ascii_alphanumeric() && c != '_';
            let mut words: Vec<String> = errors.split(words).map(str::to_owned).collect();
            if comment.contains("the step's") {
                words.push("upt_scene_step".into());
            }
            own.insert(name.to_owned(), words);
        }
    }
    assert!(
        own.len() >= 30,
        "the header documents {} functions",
        own.len()
    );
    let statuses = |name: &String| {
        // "as `upt_scene_step`": the other function's statuses too.
        let mut names = vec![name.clone()];
        let mut at = 0;
        while let Some(words) = names.get(at).map(|name| own[name].clone()) {
            let others = words.into_iter().filter(|word| own.contains_key(word));
            let new: Vec<String> = others.filter(|word| !names.contains(word)).collect();
            names.extend(new);
            at += 1;
        }
        let words = names.iter().flat_map(|name| &own[name]);
        words
            .filter_map(|word| codes.get(word.as_str()).copied())
            .collect()
    };
    own.keys()
        .map(|name| (name.clone(), statuses(name)))
        .collect()
}
