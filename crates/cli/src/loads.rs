//! Schemes and programmes of tools on the command line: values and help of options, and `upt loads`. All of it is read from
//! the tables of `tissue`.

use std::process::ExitCode;

use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use tissue::loads::{programmes_table, schemes_table};
use tissue::programmes::{self, ToolProgramme};
use tissue::schemes::{self, Group, Scheme};

#[derive(clap::Args)]
#[command(after_help = "Examples:\n  upt loads\n  upt loads --json")]
pub struct Options {
    /// All ranges of all rows as JSON; units are in the names.
    #[arg(long)]
    json: bool,
}

pub fn run(options: &Options) -> anyhow::Result<ExitCode> {
    if options.json {
        print!("{}", tissue::loads::json()?);
    } else {
        println!("{}\n{}", schemes_table(), programmes_table());
    }
    Ok(ExitCode::SUCCESS)
}

/// A value of `--scheme`: those that move.
pub fn scheme() -> impl TypedValueParser<Value = Scheme> {
    let rows = schemes::TABLE
        .iter()
        .filter(|row| row.group != Group::Static);
    let values = rows.map(|row| PossibleValue::new(row.name).help(row.summary));
    PossibleValuesParser::new(values).try_map(|name| name.parse::<Scheme>())
}

/// A value of `--tool`.
pub fn programme() -> impl TypedValueParser<Value = ToolProgramme> {
    let rows = programmes::TABLE.iter();
    let values = rows.map(|row| PossibleValue::new(row.name).help(row.summary));
    PossibleValuesParser::new(values).try_map(|name| name.parse::<ToolProgramme>())
}

/// Help of an option that takes a list of schemes.
pub fn schemes_help() -> String {
    let names = |wanted: &dyn Fn(Group) -> bool| {
        let rows = schemes::TABLE.iter().filter(|row| wanted(row.group));
        let names: Vec<String> = rows.map(|row| format!("`{}`", row.name)).collect();
        names.join(", ")
    };
    format!(
        "Schemes, such as `1-4` or `1,3`; `hard` for all hard ones. One or more of {}; equilibria: {}",
        names(&|group| group != Group::Static),
        names(&|group| group == Group::Static)
    )
}

/// Help of an option that takes a list of programmes.
pub fn programmes_help() -> String {
    let names = |extreme: bool| {
        let rows = programmes::TABLE
            .iter()
            .filter(|row| row.extreme == extreme);
        let names: Vec<String> = rows.map(|row| format!("`{}`", row.name)).collect();
        names.join(", ")
    };
    format!(
        "Programmes of rigid tools, such as `press,stroke`; `all` for every one of {}; extreme ones are {}",
        names(false),
        names(true)
    )
}
