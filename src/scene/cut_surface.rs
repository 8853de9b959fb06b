//! The closed surface of a body that is cut, as a host follows it: what changed since it last asked, and where its vertices are.

use std::sync::Arc;

use super::Scene;
use super::followed_surface::{self, Followed};
use super::maker::StepMaker;
use super::points::AttachedPoints;
use super::published::lock_read;
use super::published::{BodyNumber, Published};
use super::shared::lock;
use crate::error::{Error, Result};
use crate::memory;
use crate::output::Output;

/// The closed surface of a scene's body, as a host follows it: [`Scene::surface`].
#[derive(Clone, Copy)]
pub struct SceneSurface<'a>(&'a Scene);

/// What [`SceneSurface::update`] has found.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SurfaceUpdate {
    /// All vertices and triangles are new: the first call, and the first one after the body before was put back.
    pub is_new: bool,
    /// Vertices now. They keep their numbers, places at rest and nodes.
    pub vertices: usize,
    /// Slots of triangles now, empty ones included.
    pub triangles: usize,
    /// Vertices from here on are new.
    pub first_vertex: usize,
    /// Slots whose corners are others than before.
    pub changed: usize,
}

/// The surface as the last [`SceneSurface::update`] left it.
#[derive(Clone, Copy, Debug)]
pub struct CutSurface<'a> {
    /// Where each vertex lies in the tissue at rest, mm, for textures. The first `K` are the mesh's nodes, also those that no triangle has.
    pub rest: &'a [[f32; 3]],
    /// Corners of each slot, outward; `[0, 0, 0]` where it is empty.
    pub triangles: &'a [[u32; 3]],
    /// By slot: the triangle was inside of the intact body.
    pub inside: &'a [bool],
    /// The slots that the last update has changed, ascending.
    pub changed: &'a [u32],
}

impl Scene {
    /// The closed surface of the body, which cuts change.
    pub fn surface(&self) -> SceneSurface<'_> {
        SceneSurface(self)
    }
}

impl SceneSurface<'_> {
    /// Brings the closed surface of the body up to date: the mesh's own where nothing has happened, the lips of cuts, and what removal has
    /// laid bare. What it finds is what has changed since the last call. Where the body has not changed since, it does nothing.
    ///
    /// Vertices and slots of triangles keep their numbers where nothing changed, until the intact body is put back by [`Scene::reset`] or a body by
    /// [`Scene::restore`]. Vertices that nothing uses any more stay in the list.
    ///
    /// ```
    /// # use std::path::Path;
    /// # use upt::{Model, ModelOptions, Scene, SceneOptions};
    /// # let model = Model::open(Path::new("onnx/liver-coarse"), &ModelOptions::default())?;
    /// # let scene = Scene::new(model.clone(), &SceneOptions::default())?;
    /// let surface = scene.surface();
    /// let update = surface.update()?;
    /// assert!(update.is_new && update.changed == update.triangles);
    /// let mut positions = vec![0.0; 3 * update.vertices];
    /// surface.positions(&mut positions)?;
    /// let triangles = surface.read(|own| own.triangles.to_vec())?;
    /// assert_eq!(surface.update()?.changed, 0);
    /// # assert_eq!(triangles.len(), update.triangles);
    /// # upt::Result::Ok(())
    /// ```
    ///
    /// # Errors
    /// [`Error::Busy`], [`Error::OutOfMemory`].
    pub fn update(&self) -> Result<SurfaceUpdate> {
        let mut held = lock(&self.0.tools.surface)?;
        self.0.core()?.call(|core, published| {
            let body = lock_read(published).body.number;
            let (first_vertex, is_new) = match &mut *held {
                Some(own) if own.is_of(body) => {
                    own.changed.clear();
                    (own.rest.len(), false)
                }
                _ => follow(&core.maker, &mut held, body)?,
            };
            let own = held.as_ref();
            let [vertices, triangles, changed] = own.map_or([0; 3], |own| {
                [
                    own.rest.len(),
                    own.surface.triangles.len(),
                    own.changed.len(),
                ]
            });
            Ok(SurfaceUpdate {
                is_new,
                vertices,
                triangles,
                first_vertex,
                changed,
            })
        })
    }

    /// Reads the surface as the last [`SceneSurface::update`] left it.
    ///
    /// # Errors
    /// [`Error::State`] before the first update, [`Error::Busy`] while another thread uses the surface.
    pub fn read<T>(&self, read: impl FnOnce(CutSurface<'_>) -> T) -> Result<T> {
        let held = lock(&self.0.tools.surface)?;
        let own = held.as_ref().ok_or_else(not_asked)?;
        Ok(read(CutSurface {
            rest: &own.rest,
            triangles: &own.surface.triangles,
            inside: &own.surface.inside,
            changed: &own.changed,
        }))
    }

    /// Where the vertices of the surface are in the last published state, `[vertices, 3]`, mm. Any thread, also while a step is in flight.
    ///
    /// # Errors
    /// [`Error::State`] where the surface is not that of the body as it is now: update it; [`Error::Argument`] for an output of another
    /// length, [`Error::Unsupported`] for a scene with a region, whose other nodes are not decoded, [`Error::Busy`].
    pub fn positions(&self, out: &mut [f32]) -> Result<()> {
        self.positions_to(out.into())
    }

    /// [`SceneSurface::positions`] into memory that need not be initialised.
    pub(crate) fn positions_to(&self, out: Output<'_, f32>) -> Result<()> {
        let held = lock(&self.0.tools.surface)?;
        let own = held.as_ref().ok_or_else(not_asked)?;
        let shown = lock_read(&self.0.shared.published);
        own.check(&shown, out.len())?;
        let moved = shown.last.field.as_chunks::<3>().0;
        let vertices = own.surface.vertices.iter().zip(&own.rest);
        out.write_rows(vertices.map(|(vertex, rest)| {
            let mut at = *rest;
            for (node, weight) in vertex.nodes.into_iter().zip(vertex.weights) {
                if node != topology::surface::NONE {
                    let u = moved[node as usize];
                    at = [0, 1, 2].map(|k| at[k] + weight as f32 * u[k]);
                }
            }
            at
        }));
        Ok(())
    }

    /// The vertices as points on nodes, for frames of `len` floats. No body changes while frames are held.
    ///
    /// # Errors
    /// As [`SceneSurface::positions`].
    pub(super) fn points(&self, len: usize) -> Result<Arc<AttachedPoints>> {
        let mut held = lock(&self.0.tools.surface)?;
        let own = held.as_mut().ok_or_else(not_asked)?;
        own.check(&lock_read(&self.0.shared.published), len)?;
        own.points()
    }

    /// Bytes of the surface that a host follows.
    pub(super) fn held_bytes(&self) -> usize {
        let held = lock(&self.0.tools.surface);
        held.map_or(0, |held| held.as_ref().map_or(0, Followed::held_bytes))
    }
}

impl Followed {
    /// Whether it is the surface of the body that is shown, with all its nodes, and an output of `len` floats has its size.
    fn check(&self, shown: &Published, len: usize) -> Result<()> {
        if !self.is_of(shown.body.number) {
            return Err(Error::State(
                "surface: the body has changed since its surface was updated; update it first"
                    .into(),
            ));
        }
        if shown.region.is_some() {
            return Err(Error::Unsupported(
                "surface: a scene with a region decodes its nodes alone; take the region off first"
                    .into(),
            ));
        }
        if len == 3 * self.rest.len() {
            return Ok(());
        }
        Err(Error::Argument(format!(
            "out has {len} floats, must have {}: 3 for each vertex of the surface",
            3 * self.rest.len()
        )))
    }
}

/// Makes or updates the surface. Returns the first new vertex, and whether all are new.
fn follow(
    maker: &StepMaker,
    held: &mut Option<Followed>,
    body: BodyNumber,
) -> Result<(usize, bool)> {
    let own_body = &maker.body;
    memory::probe(own_body.most_surface_bytes(), followed_surface::WHAT)?;
    let whole;
    let now = match &own_body.cut {
        Some(cut) => &cut.body,
        None => {
            whole = own_body.whole_body()?;
            if maker.corrected.is_some() {
                let material = &own_body.model.manifest.step_material();
                (own_body.model.corrections()?).prepare_cut(&own_body.mesh, material)?;
            }
            &whole
        }
    };
    if held.as_ref().is_some_and(|own| own.body.line != body.line) {
        *held = None;
    }
    let own = match held {
        Some(own) => own,
        None => held.insert(Followed::new(now.mesh())?),
    };
    let found = own.follow(now, &own_body.mesh)?;
    own.body = body;
    Ok(found)
}

fn not_asked() -> Error {
    Error::State("surface: there is none before the first update; update it first".into())
}
