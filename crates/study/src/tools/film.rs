//! The first case through the first bundle that solves contact, as a page in which it plays with its tools.

use anyhow::Result;
use tissue::mesh::Mesh;

use page::{Content, Film, page};
use yardstick::Method;
use yardstick::cases::ToolCases;
use yardstick::drive::{Drive, Driver};

/// The page; none where no method solves contact.
pub fn viewer(
    methods: &[Method],
    cases: &ToolCases,
    mesh: &Mesh,
    threads: u32,
) -> Result<Option<String>> {
    let solved = || {
        methods
            .iter()
            .filter(|method| method.drive == Drive::Solved)
    };
    let recommended =
        |method: &&Method| method.corrections == method.bundle.corrections.unwrap_or_default();
    let Some(method) = solved().find(recommended).or_else(|| solved().next()) else {
        return Ok(None);
    };
    let settings = host::ModelSettings {
        threads,
        corrections: Some(method.corrections),
        ..host::ModelSettings::default()
    };
    let model = host::Model::open(&method.bundle.path, &settings)?;
    let mut driver = Driver::new(&model, method.drive)?;
    let case = &cases.list[0];
    driver.take(&case.tools)?;
    let trajectory = &case.trajectory;
    let mut film = Film::new(mesh, case.name.clone(), trajectory.header.dt_s);
    film.take(&case.tools);
    let mut field = vec![[0.0f32; 3]; mesh.node_count()];
    for frame in 1..case.poses.len() {
        driver.step(&case.poses[frame], &mut field)?;
        film.add_tools(mesh, &field, trajectory.frame(frame), &case.poses[frame]);
    }
    let facts = [
        ("bundle", method.bundle.name.clone()),
        ("corrections a step", method.corrections.to_string()),
        ("nodes", mesh.node_count().to_string()),
        ("tools", case.tools.len().to_string()),
    ]
    .map(|(name, value)| (name.to_owned(), value));
    let text = page(&Content {
        mesh,
        node_errors: None,
        facts: &facts,
        film: &film.json(),
        pick: false,
    })?;
    Ok(Some(text))
}
