//! The tables of schemes and programmes in Markdown, for `docs/guide/datasets.md` and `upt loads`.

use std::fmt::Write;

use crate::programmes::{self, BLADE_MM, FOOT_MM, Tip};
use crate::schemes::Range;
use crate::schemes::{self, Group};

/// `2 to 6`, or `2` where there is nothing to draw. Two digits after the point are enough for every row.
fn span([low, high]: Range) -> String {
    let short = |x: f64| {
        let text = format!("{x:.2}");
        text.trim_end_matches('0').trim_end_matches('.').to_owned()
    };
    match short(low) == short(high) {
        true => short(low),
        false => format!("{} to {}", short(low), short(high)),
    }
}

fn degrees(radians: Range) -> String {
    span(radians.map(|x| x.to_degrees().round())) + "°"
}

/// The schemes.
pub fn schemes_table() -> String {
    let mut text = String::from(
        "| scheme | magnitude, mm | faces | tilt | what it does | source |\n|---|---|---|---|---|---|\n",
    );
    for row in &schemes::TABLE {
        let group = match row.group {
            Group::Trained | Group::Hard => "",
            Group::Withheld => " (never trained on)",
            Group::Probe | Group::Static => " (training only)",
        };
        let sites = match row.depths {
            0 => String::new(),
            depths => format!(", {} sites, {depths} depths each", row.sites),
        };
        let each = if row.instruments > 1 { " each" } else { "" };
        let _ = writeln!(
            text,
            "| `{}`{group} | {}{each} | {}{each} | {} | {}{sites} | {} |",
            row.name,
            span(row.magnitude_mm),
            span(row.faces),
            degrees(row.tilt_rad),
            row.summary,
            row.source,
        );
    }
    text
}

/// The programmes of tools.
pub fn programmes_table() -> String {
    let mut text = String::from(
        "| programme | tool | depth, mm | way in, mm/s | way out, mm/s | hold, s | what it does |\n|---|---|---|---|---|---|---|\n",
    );
    for row in &programmes::TABLE {
        let wide = span(row.radius_mm.map(|x| 2.0 * x));
        let thick = |half: f32| 2.0 * half;
        let tool = match row.tip {
            Tip::Rod => format!("rod, radius {} mm", span(row.radius_mm)),
            Tip::Blade => format!("blade, {wide} mm wide, {} mm thick", thick(BLADE_MM[0])),
            Tip::Foot => format!("foot, {wide} mm wide, {} mm thick", thick(FOOT_MM[0])),
        };
        let _ = writeln!(
            text,
            "| `{}` | {tool} | {} | {} | {} | {} | {}{} |",
            row.name,
            span(row.depth_mm),
            span(row.press_mm_s),
            span(row.lift_mm_s),
            span(row.hold_s),
            row.summary,
            more(row),
        );
    }
    text
}

/// The ranges that few rows have, after what they do.
fn more(row: &programmes::Specification) -> String {
    let mut ranges = Vec::new();
    if row.slide_mm[1] > 0.0 {
        let (way, speed) = (span(row.slide_mm), span(row.slide_mm_s));
        ranges.push(format!("{way} mm at {speed} mm/s"));
    }
    if let [tilt, turn] = row.wobble_rad
        && tilt > 0.0
    {
        ranges.push(format!("{} and {}", degrees([tilt; 2]), degrees([turn; 2])));
    }
    if row.pull_mm[1] > 0.0 {
        let (way, force) = (span(row.pull_mm), span(row.tear_off_mn));
        ranges.push(format!("{way} mm, {force} mN"));
    }
    if let Some(apart) = row.second_mm {
        ranges.push(format!("{} mm apart", span(apart)));
    }
    match ranges.is_empty() {
        true => String::new(),
        false => format!(" ({})", ranges.join(", ")),
    }
}

/// A page with the text between `<!-- marker -->` and the next `<!-- end -->` replaced; none where they are missing.
pub fn replace(page: &str, marker: &str, table: &str) -> Option<String> {
    let start = format!("<!-- {marker} -->\n");
    let from = page.find(&start)? + start.len();
    let to = from + page[from..].find("<!-- end -->")?;
    Some(format!("{}{table}{}", &page[..from], &page[to..]))
}
