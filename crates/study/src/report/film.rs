//! The first case through the first bundle, as a page in which it plays.

use anyhow::Result;
use serde_json::json;
use tissue::mesh::Mesh;

use super::cases::Cases;
use super::float32_frames;
use super::measure::Plan;
use super::method::Method;
use page::{Content, Film, page};

/// The page; none where no bundle is in the report.
pub fn viewer(cases: &Cases, mesh: &Mesh, methods: &[Method]) -> Result<Option<String>> {
    let recommended = |method: &&Method| match method {
        Method::Surrogate {
            bundle,
            corrections,
            ..
        } => *corrections == bundle.corrections.unwrap_or_default(),
        _ => false,
    };
    let any = |method: &&Method| matches!(method, Method::Surrogate { .. });
    let method = (methods.iter().find(recommended)).or_else(|| methods.iter().find(any));
    let Some(
        method @ Method::Surrogate {
            bundle,
            corrections,
            ..
        },
    ) = method
    else {
        return Ok(None);
    };
    let plan = Plan {
        mesh,
        cases,
        pictured: &[],
        step_limit: usize::MAX,
        case_limit: 1,
        hausdorff: false,
    };
    let Some(frames) = float32_frames(method, &plan)? else {
        return Ok(None);
    };
    let case = &cases.list[0];
    let trajectory = &case.trajectory;
    let mut film = Film::new(mesh, case.name.clone(), trajectory.header.dt_s);
    for (at, field) in frames.iter().enumerate() {
        let truth = trajectory.frame(at + 1);
        film.add(mesh, field, truth, trajectory.contact(at + 1).0);
    }
    let facts = [
        ("bundle", bundle.name.clone()),
        ("corrections a step", corrections.to_string()),
        ("nodes", mesh.node_count().to_string()),
    ]
    .map(|(name, value)| (name.to_owned(), value));
    let text = page(&Content {
        mesh,
        node_errors: None,
        facts: &facts,
        film: &match frames.is_empty() {
            true => json!(null),
            false => film.json(),
        },
        pick: false,
    })?;
    Ok(Some(text))
}
