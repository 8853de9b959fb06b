//! Bodies that are cut in earnest: blades that leap across the organ while a ball leaps, a blade that cuts beneath a ball that presses, and an
//! aspirator that takes everything.

use std::path::Path;

use anyhow::Result;
use contact::Vector;
use tissue::schemes::SplitMix;
use upt::{ffi, flag};

use super::hand::{Site, between, sites};
use crate::bench::{Bench, names};
use crate::stress::Row;
use host::{self, Scene, instrument};

/// Operations of the first case, and steps after each.
const OPERATIONS: usize = 100;
const STEPS: usize = 2;
/// Of the ball, mm.
const BALL_MM: f32 = 4.0;
/// A ball that takes an organ whole, mm, and more than any has, mm³.
const WHOLE_MM: f32 = 400.0;
const ALL_MM3: f32 = 1e9;

/// What became of the tissue.
#[derive(Default)]
struct Seen {
    steps: usize,
    flags: u32,
    largest: f32,
    /// Operations that the library refused, and steps that the guard did.
    refused: [usize; 2],
    wrong: Option<String>,
}

struct Cuts<'a> {
    bench: &'a Bench,
    scene: Scene,
    sites: Vec<Site>,
    /// Of the surface's nodes, so that the output keeps its size.
    field: Vec<[f32; 3]>,
}

/// The cases; none for a bundle whose scenes make no corrections.
pub(super) fn rows(bench: &Bench, path: &Path) -> Result<Vec<Row>> {
    let model = host::Model::open(path, &host::ModelSettings::default())?;
    let nodes = model.indices(ffi::UPT_SET_SURFACE_NODES)?;
    let mut scene = Scene::create(&model, ffi::UPT_KERNEL_AUTO)?;
    scene.set_region(&nodes)?;
    let mut cuts = Cuts {
        bench,
        scene,
        sites: sites(bench, 24)?,
        field: vec![[0.0; 3]; nodes.len()],
    };
    let far = [
        [[5000.0, 0.0, 0.0], [5000.0, 10.0, 0.0]],
        [[5001.0, 0.0, 0.0], [5001.0, 10.0, 0.0]],
    ];
    if let Err(error) = cuts.scene.cut(0.0, 0, &far) {
        return Ok(vec![Row::left(
            &bench.subject,
            "cuts",
            &format!("{error:#}"),
        )]);
    }
    Ok(vec![cuts.leaps()?, cuts.beneath()?, cuts.all()?])
}

impl Cuts<'_> {
    /// Blades of up to 120 mm anywhere in the domain, aspirators and coagulation between them, and a ball that leaps to each place.
    fn leaps(&mut self) -> Result<Row> {
        let mut random = SplitMix(71);
        let mut seen = Seen::default();
        self.scene.reset()?;
        let operations = self.bench.steps(OPERATIONS).min(OPERATIONS);
        for count in 0..operations {
            let site = self.sites[(random.unit() * self.sites.len() as f64) as usize];
            let mut any = |size: f32| {
                let mut draw = || between(&mut random, -1.0, 1.0);
                Vector::new(draw(), draw(), draw()) * size
            };
            let made = match count % 4 {
                3 => self.scene.remove(&ball(6.0, site.at + any(6.0)), 300.0),
                _ => {
                    let [a, b, c] = [any(60.0), any(60.0), any(60.0)];
                    let edge = |shift: Vector| {
                        [site.at + shift - a, site.at + shift + a].map(|at| at.to_array())
                    };
                    self.scene.cut(10.0, count as u32, &[edge(b), edge(c)])
                }
            };
            seen.refused[0] += usize::from(made.is_err());
            if count % 10 == 9 {
                self.scene.drop_fragments()?;
            }
            let tool = ball(BALL_MM, site.at + site.inward * (3.0 - BALL_MM));
            for _ in 0..STEPS {
                self.step(&tool, &mut seen);
            }
        }
        let name = format!(
            "{operations} blades that leap up to 120 mm and aspirators, a ball leaps to each place"
        );
        Ok(self.judged(&name, seen))
    }

    /// A ball presses 4 mm deep while a blade goes back and forth beneath it; undo then gives the very body before.
    fn beneath(&mut self) -> Result<Row> {
        let mut seen = Seen::default();
        self.scene.reset()?;
        let site = self.sites[self.sites.len() / 2];
        let along = site.inward.any_orthonormal_vector();
        let across = site.inward.cross(along);
        let tool = ball(BALL_MM, site.at + site.inward * (4.0 - BALL_MM));
        for _ in 0..5 {
            self.step(&tool, &mut seen);
        }
        let saved = self.scene.save()?;
        self.step(&tool, &mut Seen::default());
        let wanted = self.field.clone();
        for pass in 0..20u32 {
            let deep = |aside: f32| {
                let middle = site.at + site.inward * (6.0 + 0.5 * pass as f32) + across * aside;
                [middle - along * 15.0, middle + along * 15.0].map(|at| at.to_array())
            };
            let made = self.scene.cut(10.0, pass, &[deep(-12.0), deep(12.0)]);
            seen.refused[0] += usize::from(made.is_err());
            self.step(&tool, &mut seen);
        }
        self.scene.restore(&saved)?;
        self.step(&tool, &mut Seen::default());
        if self.field != wanted {
            seen.wrong = Some("undo leads to another step".into());
        }
        Ok(self.judged("a blade cuts beneath a ball that presses; undo", seen))
    }

    /// An aspirator takes all that there is until the library refuses; the body before goes on.
    fn all(&mut self) -> Result<Row> {
        let mut seen = Seen::default();
        self.scene.reset()?;
        let middle = self.sites[0].at;
        let tool = ball(BALL_MM, middle + self.sites[0].inward * (3.0 - BALL_MM));
        for (radius, most) in [(10.0, 2000.0), (WHOLE_MM, ALL_MM3), (WHOLE_MM, ALL_MM3)] {
            let made = self.scene.remove(&ball(radius, middle), most);
            seen.refused[0] += usize::from(made.is_err());
            self.step(&tool, &mut seen);
        }
        if seen.refused[0] != 2 {
            seen.wrong = Some("an operation that leaves nothing was not refused".into());
        }
        Ok(self.judged(
            "everything is aspirated; refused, the body before goes on",
            seen,
        ))
    }

    fn step(&mut self, tool: &ffi::upt_instrument, seen: &mut Seen) {
        seen.steps += 1;
        let tools = std::slice::from_ref(tool);
        match self.scene.step_instruments(tools, &mut self.field) {
            Ok(()) => {}
            Err(error) if format!("{error:#}").contains("UPT_ERR_GUARD") => seen.refused[1] += 1,
            Err(error) => seen.wrong = Some(format!("{error:#}")),
        }
        match self.scene.stats() {
            Ok(stats) => seen.flags |= stats.flags,
            Err(error) => seen.wrong = Some(format!("{error:#}")),
        }
        for u in self.field.as_flattened() {
            if !u.is_finite() {
                seen.wrong = Some("not finite".into());
            }
            seen.largest = seen.largest.max(u.abs());
        }
    }

    fn judged(&self, name: &str, seen: Seen) -> Row {
        let mut text = format!(
            "{} steps, |u| at most {:.1} mm, {} operations and {} steps refused, flags {}",
            seen.steps,
            seen.largest,
            seen.refused[0],
            seen.refused[1],
            names(seen.flags)
        );
        // What lies beyond the bundle's bound must say so.
        let told = seen.flags & flag::BOUND != 0 || seen.largest <= self.bench.bound;
        if let Some(wrong) = &seen.wrong {
            text += &format!("; {wrong}");
        }
        Row::new(
            &self.bench.subject,
            name,
            text,
            seen.wrong.is_none() && told,
        )
    }
}

fn ball(radius: f32, at: Vector) -> ffi::upt_instrument {
    ffi::upt_instrument {
        shape: ffi::UPT_SHAPE_SPHERE,
        position: at.to_array(),
        radius,
        ..instrument()
    }
}
