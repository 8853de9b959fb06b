//! Which tool made a bundle: an error about one of its files says so, since that tool makes it again.

use serde_json::Value;

use field::error::Error;

/// Longer words are no command.
const LONGEST: usize = 80;

/// The command that made the bundle of a manifest's fields, as far as they name it.
pub(super) fn of(fields: &Value) -> Option<String> {
    if let Some(command) = fields["provenance"]["command"].as_str() {
        let plain = |c: char| c.is_ascii_graphic() || c == ' ';
        return (command.len() <= LONGEST && command.chars().all(plain))
            .then(|| command.to_owned());
    }
    let trained = match fields["kind"].as_str() {
        Some("upt") => "python -m upt_training export",
        Some("reduced") if fields["reduced"].is_object() => "python -m upt_training.reduced",
        _ => return None,
    };
    Some(trained.to_owned())
}

/// Adds the command to an error about the bundle.
pub(super) fn name(error: Error, command: Option<&str>) -> Error {
    match (error, command) {
        (Error::Bundle { file, message }, Some(command)) => Error::Bundle {
            file,
            message: format!("{message}; the bundle was made with `{command}`"),
        },
        (error, _) => error,
    }
}
