//! `upt reference`: every command and option as Markdown, for `docs/reference/cli.md`. Hidden from the help.

use std::fmt::Write;
use std::process::ExitCode;

use clap::{Arg, Command, CommandFactory};

const OPENING: &str = "# The command `upt`\n\n\
    `upt reference` writes this page from the program's own help; a test fails when it is stale. `cargo xtask package` puts the\n\
    command into `bin/`; `cargo build --release -p upt-cli` builds it in the repository.\n";

pub fn run<Arguments: CommandFactory>() -> anyhow::Result<ExitCode> {
    print!("{}", page(Arguments::command())?);
    Ok(ExitCode::SUCCESS)
}

/// The page: a section for each command, the subcommands of a command after it.
pub fn page(mut program: Command) -> Result<String, std::fmt::Error> {
    program.build();
    let mut text = String::from(OPENING);
    writeln!(text, "\n| command | what it does |\n|---|---|")?;
    index(&mut text, &program, "")?;
    for command in shown(&program) {
        section(&mut text, command, "upt")?;
    }
    Ok(text)
}

fn shown(command: &Command) -> impl Iterator<Item = &Command> {
    command
        .get_subcommands()
        .filter(|one| !one.is_hide_set() && one.get_name() != "help")
}

fn index(text: &mut String, command: &Command, before: &str) -> std::fmt::Result {
    for one in shown(command) {
        let name = format!("{before}{}", one.get_name());
        let anchor = format!("upt-{}", name.replace(' ', "-"));
        let about = one.get_about().map(ToString::to_string).unwrap_or_default();
        writeln!(text, "| [`upt {name}`](#{anchor}) | {} |", cell(&about))?;
        index(text, one, &format!("{name} "))?;
    }
    Ok(())
}

fn section(text: &mut String, command: &Command, before: &str) -> std::fmt::Result {
    let name = format!("{before} {}", command.get_name());
    let about = command.get_long_about().or(command.get_about());
    writeln!(
        text,
        "\n## `{name}`\n\n{}",
        about.map(ToString::to_string).unwrap_or_default()
    )?;
    let arguments: Vec<&Arg> = command
        .get_arguments()
        .filter(|one| !one.is_hide_set() && !["help", "version"].contains(&one.get_id().as_str()))
        .collect();
    if !arguments.is_empty() {
        writeln!(text, "\n| argument | meaning | default |\n|---|---|---|")?;
        for one in arguments {
            argument(text, one)?;
        }
    }
    if let Some(examples) = command.get_after_help() {
        writeln!(text, "\n```text\n{}\n```", examples.to_string().trim())?;
    }
    for one in shown(command) {
        section(text, one, &name)?;
    }
    Ok(())
}

fn argument(text: &mut String, one: &Arg) -> std::fmt::Result {
    let help = one.get_long_help().or(one.get_help());
    let mut help = help.map(ToString::to_string).unwrap_or_default();
    let choices: Vec<String> = one
        .get_possible_values()
        .iter()
        .filter(|value| !value.is_hide_set())
        .map(|value| format!("`{}`", value.get_name()))
        .collect();
    if one.get_action().takes_values() && !choices.is_empty() {
        if !help.is_empty() && !help.ends_with('.') {
            help.push('.');
        }
        write!(help, " One of {}", choices.join(", "))?;
    }
    let defaults: Vec<_> = one
        .get_default_values()
        .iter()
        .map(|value| format!("`{}`", value.to_string_lossy()))
        .collect();
    let defaults = if one.get_action().takes_values() && !one.is_hide_default_value_set() {
        defaults.join(" ")
    } else {
        String::new()
    };
    let usage = one.to_string();
    writeln!(
        text,
        "| `{}` | {} | {} |",
        usage.replace('|', "\\|"),
        cell(&help),
        cell(&defaults)
    )
}

/// Text of one cell of a table.
fn cell(text: &str) -> String {
    let line: Vec<&str> = text.split_whitespace().collect();
    line.join(" ").replace('|', "\\|").replace('<', "&lt;")
}

#[cfg(all(test, feature = "linear"))]
mod tests {
    #[test]
    fn the_committed_page_is_fresh() {
        let file =
            std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/reference/cli.md");
        let committed = std::fs::read_to_string(file).unwrap_or_default();
        let page = super::page(<crate::Arguments as clap::CommandFactory>::command()).unwrap();
        assert!(
            committed == page,
            "docs/reference/cli.md is stale; run `cargo run --release -p upt-cli -- reference > docs/reference/cli.md`"
        );
    }
}
