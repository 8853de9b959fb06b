//! `tools.html`: the rows, and for each case the dent under the tool and its force over time.

use std::fmt::Write;

use crate::report::html::{Facts, VIEWER_STYLE, closing, inline, opening, playing, section};
use picture::plot::{escape, legend};

use super::row::{ALL, Row};
use super::section::{REST, TOOL, TRUTH};
use super::table::{COLUMNS, MEANING, by_programme};

/// The pictures of one case, as HTML.
pub struct Pictured {
    pub title: String,
    pub sections: String,
    pub forces: String,
}

pub struct Page<'a> {
    pub title: &'a str,
    pub lead: String,
    pub rows: &'a [Row],
    /// Names of the methods in the pictures, with their colours.
    pub keys: Vec<(String, &'static str)>,
    pub pictured: Vec<Pictured>,
    /// A page of [`page`] in which the first case plays with its tools.
    pub viewer: Option<String>,
    pub notes: Vec<String>,
    pub facts: Facts,
}

const STYLE: &str = "svg.section{background:#fbfbfc;border:1px solid #eef0f3;border-radius:6px}\
    th:nth-child(3),td:nth-child(3){text-align:left}tr.all td{font-weight:600}\
    main{max-width:1760px}.gallery.wide{grid-template-columns:repeat(auto-fill,minmax(380px,1fr))}\
    .gallery.forces{grid-template-columns:repeat(auto-fill,minmax(560px,1fr))}table{font-size:12px}";

pub fn page(page: &Page<'_>) -> String {
    let style = format!("{STYLE}{VIEWER_STYLE}");
    let mut out = opening(page.title, &page.lead, &style);
    if let Some(viewer) = &page.viewer {
        playing(&mut out, viewer);
    }
    let over_all: Vec<&Row> = page
        .rows
        .iter()
        .filter(|row| row.programme == ALL)
        .collect();
    if !over_all.is_empty() {
        section(
            &mut out,
            "All programmes but grasp",
            MEANING,
            &table(&over_all),
        );
    }
    let explanation = if over_all.is_empty() { MEANING } else { "" };
    let notes: String = page
        .notes
        .iter()
        .map(|note| format!("<li>{}</li>", inline(note)))
        .collect();
    let notes = match notes.is_empty() {
        true => notes,
        false => format!("<ul>{notes}</ul>"),
    };
    let body = table(&by_programme(page.rows)) + &notes;
    section(&mut out, "By programme", explanation, &body);
    let mut keys = vec![
        ("at rest".to_owned(), REST),
        ("tool".to_owned(), TOOL),
        ("reference solver".to_owned(), TRUTH),
    ];
    keys.extend(page.keys.iter().cloned());
    for case in &page.pictured {
        let body = format!(
            "{}<div class=\"gallery wide\">{}</div><div class=\"gallery forces\">{}</div>",
            legend(&keys),
            case.sections,
            case.forces
        );
        section(
            &mut out,
            &case.title,
            "The dent under the tool at its largest force, in the plane of its shaft; below, the force over time.",
            &body,
        );
    }
    closing(out, &page.facts)
}

fn table(rows: &[&Row]) -> String {
    let head: String = COLUMNS
        .iter()
        .map(|column| format!("<th>{}</th>", escape(column.0)))
        .collect();
    let mut body = String::new();
    for row in rows {
        let class = if row.bundle.is_empty() {
            " class=\"plain\""
        } else {
            ""
        };
        let _ = write!(body, "<tr{class}>");
        for (_, cell) in COLUMNS {
            let _ = write!(body, "<td>{}</td>", escape(&cell(row)));
        }
        body.push_str("</tr>");
    }
    format!("<table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>")
}
