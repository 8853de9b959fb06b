//! `report.html`: one file with everything in it, no scripts from elsewhere, no fonts, no network.

use std::fmt::Write;

use base64::Engine;

use super::plot::{self, Band, Latencies, Point, Stages};
use super::row::{Measurement, Row};
use super::table::COLUMNS;
use host::Effort;
use picture::plot::{colour, escape};

/// Facts above the figures: name and value.
pub type Facts = Vec<(String, String)>;

/// A rendered picture with its caption.
pub struct Picture {
    pub caption: String,
    pub png: Vec<u8>,
}

/// Pictures of one moment, a column a method: the truth first, then each prediction above its error.
pub struct Gallery {
    pub title: String,
    pub columns: Vec<Vec<Picture>>,
    /// Legends of the two colour scales, already as HTML.
    pub legend: String,
}

pub struct Page<'a> {
    pub title: &'a str,
    /// One sentence under the title.
    pub lead: String,
    pub facts: Facts,
    pub measurements: &'a [Measurement],
    /// Indices of the measurements that the curves, histogram and stages show.
    pub shown: Vec<usize>,
    pub galleries: Vec<Gallery>,
    /// A page of [`page`] in which the first case plays.
    pub viewer: Option<String>,
    pub dt: f64,
    /// Remarks under the table: what was left out and why.
    pub notes: Vec<String>,
}

const STYLE: &str = "
:root{color-scheme:light}
body{font:15px/1.5 system-ui,-apple-system,'Segoe UI',Roboto,'DejaVu Sans',sans-serif;color:#1d2733;background:#f6f7f9;margin:0}
main{max-width:1280px;margin:0 auto;padding:32px 24px 64px}
h1{font-size:28px;margin:0 0 4px}h2{font-size:19px;margin:0 0 4px}
p{margin:4px 0 12px;color:#44505c;max-width:80ch}
section{background:#fff;border:1px solid #e1e5ea;border-radius:8px;padding:20px 24px;margin:20px 0;overflow-x:auto}
table{border-collapse:collapse;font-size:13px;font-variant-numeric:tabular-nums;width:100%}
th{text-align:right;font-weight:600;color:#44505c;border-bottom:2px solid #d5dae0;padding:5px 7px;vertical-align:bottom}
td{text-align:right;padding:4px 7px;border-bottom:1px solid #eef0f3;white-space:nowrap}
th:nth-child(-n+2),td:nth-child(-n+2){text-align:left}
tr.plain td{color:#6b5f50}tr.front td:first-child{font-weight:600}
td i.key{display:inline-block;width:9px;height:9px;border-radius:50%;margin-right:7px}
dl{display:grid;grid-template-columns:max-content 1fr;gap:2px 18px;margin:0;font-size:14px}dt{color:#6a7683}dd{margin:0;overflow-wrap:anywhere}
svg{width:100%;max-width:1200px;height:auto;display:block}
svg .grid{stroke:#eceff2}svg .frame{stroke:#9aa5b1;fill:none}
svg text{font:12px system-ui,-apple-system,'Segoe UI',Roboto,'DejaVu Sans',sans-serif;fill:#44505c}
svg .label{font-size:13px;fill:#1d2733}svg .mark{font-weight:600;fill:#1d2733;paint-order:stroke;stroke:#fff;stroke-width:3px}
svg .inbar{fill:#fff;font-size:11px}
.legend{display:flex;flex-wrap:wrap;gap:4px 18px;font-size:13px;margin:6px 0 8px}
.legend i{display:inline-block;width:12px;height:12px;border-radius:3px;margin-right:6px;vertical-align:-1px}
.legend .ramp{width:150px}
.gallery{display:grid;grid-template-columns:repeat(auto-fit,minmax(200px,1fr));gap:14px}
figure{margin:0 0 10px}figure img{width:100%;background:#fbfbfc;border:1px solid #eef0f3;border-radius:6px;display:block}
figcaption{font-size:13px;color:#44505c;margin-top:4px}
ul{margin:8px 0 0;padding-left:20px;color:#44505c;font-size:14px}
";

pub const VIEWER_STYLE: &str =
    "iframe{display:block;width:100%;height:560px;border:0;border-radius:6px}";

/// In the browser's tab.
const ICON: &str = "data:image/svg+xml,%3Csvg xmlns='http://www.w3.org/2000/svg' viewBox='0 0 16 16'%3E%3Ccircle cx='8' cy='8' r='7' fill='%23b5533c'/%3E%3C/svg%3E";

/// Text with `code` in it.
pub fn inline(text: &str) -> String {
    let mut out = String::new();
    let mut parts = text.split('`').peekable();
    let mut inside = false;
    while let Some(part) = parts.next() {
        // A last one that nothing closes is itself.
        match (inside, parts.peek().is_some()) {
            (false, _) => out.push_str(&escape(part)),
            (true, true) => {
                let _ = write!(out, "<code>{}</code>", escape(part));
            }
            (true, false) => {
                let _ = write!(out, "`{}", escape(part));
            }
        }
        inside = !inside;
    }
    out
}

/// The page up to its first section; `style` is added to that of all pages.
pub fn opening(title: &str, lead: &str, style: &str) -> String {
    format!(
        "<!doctype html><html lang=\"en\"><head><meta charset=\"utf-8\"><meta name=\"viewport\" content=\"width=device-width\"><title>{}</title><link rel=\"icon\" href=\"{ICON}\"><style>{STYLE}{style}</style></head><body><main><h1>{}</h1><p>{}</p>",
        escape(&title.replace('`', "")),
        inline(title),
        inline(lead)
    )
}

/// The page with its last section: how it was measured.
pub fn closing(mut out: String, facts: &Facts) -> String {
    let facts: String = facts
        .iter()
        .map(|(name, value)| format!("<dt>{}</dt><dd>{}</dd>", escape(name), escape(value)))
        .collect();
    section(
        &mut out,
        "How this was measured",
        "",
        &format!("<dl>{facts}</dl>"),
    );
    out.push_str("</main></body></html>\n");
    out
}

/// The section with a page of [`page`] in it.
pub fn playing(out: &mut String, viewer: &str) {
    let body = format!(
        "<iframe title=\"the first case, playing\" srcdoc=\"{}\"></iframe>",
        viewer.replace('&', "&amp;").replace('"', "&quot;")
    );
    section(
        out,
        "The first case, playing",
        "Turn it and zoom; stop it and move through its time. Colours show the displacement or the error of that moment.",
        &body,
    );
}

pub fn page(page: &Page<'_>) -> String {
    let mut out = opening(page.title, &page.lead, VIEWER_STYLE);
    if let Some(viewer) = &page.viewer {
        playing(&mut out, viewer);
    }
    for gallery in &page.galleries {
        out.push_str(&gallery_section(gallery));
    }
    let points = points(page.measurements);
    section(
        &mut out,
        "Error against run time",
        "Each disc is a row of the table below; hollow discs are plain methods. A coloured line joins the numbers of corrections (k) of one bundle in one configuration. The dashed line is the Pareto front: no row lies below and to the left of it.",
        &plot::frontier(&points),
    );
    section(
        &mut out,
        "Rows",
        "Mean ± standard deviation over the cases; times are of single steps of 50 ms of tissue. Bold: on the Pareto front.",
        &table(page, &points),
    );
    let shown: Vec<&Measurement> = page
        .shown
        .iter()
        .map(|index| &page.measurements[*index])
        .collect();
    let bands: Vec<Band> = shown
        .iter()
        .filter(|one| !one.curve.is_empty() && one.row.method != "TLED")
        .map(|one| Band {
            name: one.row.family(),
            steps: one.curve.clone(),
        })
        .collect();
    section(
        &mut out,
        "Error over time",
        "Autoregressive: each step starts from the method's own last state.",
        &plot::error_over_time(&bands, page.dt),
    );
    let latencies: Vec<Latencies> = shown
        .iter()
        .filter(|one| one.latencies.len() > 1)
        .map(|one| Latencies {
            name: format!("{} ({})", one.row.family(), one.row.variant()),
            milliseconds: one.latencies.clone(),
        })
        .collect();
    if !latencies.is_empty() {
        section(
            &mut out,
            "Step times",
            "Wall time around the call, every step of every case.",
            &plot::latency_histogram(&latencies),
        );
    }
    let stages: Vec<Stages> = page
        .measurements
        .iter()
        .filter(|one| !one.stages.is_empty())
        .map(|one| Stages {
            name: stage_name(one),
            stages: one.stages.clone(),
        })
        .collect();
    if !stages.is_empty() {
        section(
            &mut out,
            "Where a step's time goes",
            "Shares of each configuration's own step; figures in ms.",
            &plot::stage_breakdown(&stages),
        );
    }
    closing(out, &page.facts)
}

fn stage_name(one: &Measurement) -> String {
    let row = &one.row;
    format!(
        "{} {} {} {}T",
        row.bundle, row.precision, row.region, row.threads
    )
}

pub fn section(out: &mut String, title: &str, explanation: &str, body: &str) {
    let explanation = if explanation.is_empty() {
        String::new()
    } else {
        format!("<p>{}</p>", inline(explanation))
    };
    let _ = write!(
        out,
        "<section><h2>{}</h2>{explanation}{body}</section>",
        inline(title)
    );
}

/// What rows of one colour have in common: the bundle, whatever its number of corrections, or the plain method.
fn group(row: &Row) -> String {
    row.curve()
        .map_or_else(|| row.family(), |(bundle, _)| bundle)
}

/// Every row that has a time as a point of the frontier.
pub fn points(measurements: &[Measurement]) -> Vec<Point> {
    measurements
        .iter()
        .map(|one| Point {
            family: group(&one.row),
            label: one.row.variant(),
            corrections: one
                .row
                .curve()
                .map_or(Effort::NONE, |(_, corrections)| corrections),
            milliseconds: one.row.ms_p50.max(1e-4),
            mse: one.row.mse_mm2,
            plain: one.row.is_plain(),
        })
        .collect()
}

fn table(page: &Page<'_>, points: &[Point]) -> String {
    let front = plot::pareto_front(points);
    let mut families: Vec<String> = Vec::new();
    let mut body = String::new();
    for (index, one) in page.measurements.iter().enumerate() {
        let family = group(&one.row);
        if !families.contains(&family) {
            families.push(family.clone());
        }
        let at = families
            .iter()
            .position(|known| *known == family)
            .unwrap_or(0);
        let classes = [
            (one.row.is_plain(), "plain"),
            (front.contains(&index), "front"),
        ];
        let classes: Vec<&str> = classes
            .iter()
            .filter(|class| class.0)
            .map(|class| class.1)
            .collect();
        let _ = write!(body, "<tr class=\"{}\">", classes.join(" "));
        for (column, (_, cell)) in COLUMNS.iter().enumerate() {
            let key = if column == 0 {
                format!("<i class=\"key\" style=\"background:{}\"></i>", colour(at))
            } else {
                String::new()
            };
            let _ = write!(body, "<td>{key}{}</td>", escape(&cell(&one.row)));
        }
        body.push_str("</tr>");
    }
    let head: String = COLUMNS
        .iter()
        .map(|column| format!("<th>{}</th>", escape(column.0)))
        .collect();
    let notes: String = page
        .notes
        .iter()
        .map(|note| format!("<li>{}</li>", inline(note)))
        .collect();
    let notes = if notes.is_empty() {
        notes
    } else {
        format!("<ul>{notes}</ul>")
    };
    format!("<table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>{notes}")
}

fn gallery_section(gallery: &Gallery) -> String {
    let mut body = String::new();
    for column in &gallery.columns {
        body.push_str("<div>");
        for picture in column {
            let data = base64::engine::general_purpose::STANDARD.encode(&picture.png);
            let caption = escape(&picture.caption);
            let _ = write!(
                body,
                "<figure><img alt=\"{caption}\" src=\"data:image/png;base64,{data}\"><figcaption>{caption}</figcaption></figure>"
            );
        }
        body.push_str("</div>");
    }
    format!(
        "<section><h2>{}</h2>{}<div class=\"gallery\">{body}</div></section>",
        escape(&gallery.title),
        gallery.legend
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn code_is_set_as_code_and_not_in_the_tab() {
        let page = opening("`upt tools` of a < b", "With `k = 3`, and a ` alone.", "");
        assert!(
            page.contains("<title>upt tools of a &lt; b</title>"),
            "{page}"
        );
        assert!(page.contains("<h1><code>upt tools</code> of a &lt; b</h1>"));
        assert!(page.contains("<code>k = 3</code>, and a ` alone.</p>"));
    }
}
