//! `--tool-scale`: how large the tools of the programmes are.

use clap::Args;
use tissue::programmes::ToolScale;

/// The option that commands with tools share.
#[derive(Args, Clone, Copy, Debug, Default)]
pub struct Arguments {
    /// Factor on the sizes, depths, ways and speeds of tools, whose programmes are made for a brain. Default: 1 on a body as large as a brain,
    /// less on a smaller or thinner one.
    #[arg(long, value_name = "FACTOR", value_parser = factor)]
    pub tool_scale: Option<f64>,
}

fn factor(text: &str) -> Result<f64, String> {
    let factor = text
        .parse()
        .map_err(|_| format!("`{text}` is not a number; write a factor such as 0.5"))?;
    ToolScale::of_factor(factor).map(|scale| scale.factor)
}
