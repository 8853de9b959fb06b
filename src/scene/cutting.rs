//! Operations that change the body of a scene.

use std::borrow::Cow;
use std::sync::MutexGuard;

use ::contact::Vector;
pub use topology::Blade;
use topology::{Change, Sweep};

use super::Scene;
use super::presenter::Presenters;
use super::shared::lock;
use crate::contact::Tool;
use crate::error::Result;
use crate::replay::Recorder;
use crate::replay::lines::{self, Line};

/// What an operation did to the body.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Cut {
    /// The body is another one: its surface wants to be updated ([`SceneSurface::update`](super::SceneSurface::update)) before it is read. Ask this, not the area: an edge that goes along a
    /// face opens nothing and fixes on which side of it tissue lies.
    pub is_changed: bool,
    /// New area of a cut, mm².
    pub area_mm2: f32,
    /// Volume that the body has lost, mm³.
    pub removed_mm3: f32,
    /// What the tissue does to the blade ([`Scene::cut_with`]), mN.
    pub force: [f32; 3],
    /// Of each new node, whose number is the next after the ones that there were: the node whose place and velocity it took.
    pub copied: Vec<u32>,
    /// Elements of the intact mesh of which something has changed, ascending.
    pub elements: Vec<u32>,
}

impl From<Change> for Cut {
    fn from(change: Change) -> Cut {
        Cut {
            is_changed: change != Change::default(),
            area_mm2: change.area_mm2 as f32,
            removed_mm3: change.removed_mm3 as f32,
            force: change.force().map(|force| -force as f32),
            copied: change.copied,
            elements: change.elements,
        }
    }
}

/// The way of an edge of `points` points from pose to pose.
fn sweep(points: usize, poses: &[[f32; 3]]) -> Result<Sweep> {
    let wide = |point: &[f32; 3]| point.map(f64::from);
    let edges: Vec<_> = (poses.chunks(points.max(1)))
        .map(|edge| edge.iter().map(wide).collect())
        .collect();
    Ok(Sweep::new(&edges)?)
}

impl Scene {
    /// A blade's edge, `points` points in a line, goes from pose to pose, `poses [.., points, 3]`, mm, and cuts what it passes of the tissue as it is now. Calls with
    /// the same `stroke` are one blade that goes on; another number cuts anew, also through what the first has cut.
    ///
    /// Elements that the blade has touched become two, with copies of nodes where they have come apart
    /// (`docs/decisions/027-virtual-nodes.md`): the lips lie on the blade's path to a tenth of an element's edge, mass and volume stay, and nothing moves
    /// before the next step. The scene has more nodes then ([`Scene::node_count`]); those that there were keep their numbers. From then on the elements make
    /// each step, with tools or without.
    ///
    /// # Errors
    /// [`crate::Error::Argument`] for a blade that sweeps no area, poses of other lengths, and more copies than nodes; [`crate::Error::NonFinite`];
    /// [`crate::Error::Unsupported`] for a scene without corrections. The scene is then what it was.
    pub fn cut(&self, stroke: u32, points: usize, poses: &[[f32; 3]]) -> Result<Cut> {
        self.cut_with(&Blade::default(), stroke, points, poses)
    }

    /// The same by a blade that feels the tissue. It cuts where it goes where its edge is sharp and, until its stroke has begun to cut, is pushed with
    /// the threshold at least; else nothing changes, and the area is 0: its body, an instrument, presses. New area takes the fracture energy:
    /// [`Cut::force`] is `-G dA / ds`, and the next step ends with its reaction at the tissue that has been laid open.
    ///
    /// # Errors
    /// As [`Scene::cut`]; [`crate::Error::Argument`] and [`crate::Error::NonFinite`] for the blade's numbers.
    pub fn cut_with(
        &self,
        blade: &Blade,
        stroke: u32,
        points: usize,
        poses: &[[f32; 3]],
    ) -> Result<Cut> {
        let sweep = sweep(points, poses)?;
        let _frames = self.hold_frames(true)?;
        let line = Line::Cut(lines::Cut {
            stroke,
            points,
            poses: Cow::Borrowed(poses),
            blade: (*blade != Blade::default()).then_some(lines::Blade {
                fracture_energy: blade.energy,
                threshold: blade.threshold_mn,
                pushed: blade.pushed_mn,
                ahead: blade.ahead,
            }),
        });
        let line = |recorder: &mut Recorder| recorder.open(&line);
        let change = self.core()?.told(Some(line), |core, published| {
            core.change(published, |body, at| {
                body.cut_with(blade, &sweep, stroke, at)
            })
        });
        change.map(Cut::from)
    }

    /// Removes what lies inside of a tool, the deepest first, up to `most_mm3`: an aspirator with a rate takes that times the step. Elements are removed in 64 parts
    /// each; what is left of one counts by its share.
    ///
    /// # Errors
    /// As [`Scene::cut`]; [`crate::Error::Argument`] where nothing would be left.
    pub fn remove(&self, tool: &Tool, most_mm3: f32) -> Result<Cut> {
        let depth = |at: [f64; 3]| {
            let at = Vector::from(at.map(|x| x as f32));
            f64::from(-tool.body.nearest_at(&tool.pose, at).distance)
        };
        let _frames = self.hold_frames(true)?;
        let line = |recorder: &mut Recorder| {
            let instrument = recorder.instrument(tool)?;
            recorder.open(&Line::Remove(lines::Remove {
                instrument,
                most_mm3,
            }))
        };
        let change = self.core()?.told(Some(line), |core, published| {
            core.change(published, |body, at| {
                body.remove(depth, f64::from(most_mm3), at)
            })
        });
        change.map(Cut::from)
    }

    /// Parts tissue that is longer than `stretch` times its length at rest in some direction, across that direction as a blade would: the most stretched elements
    /// first, `most` of them and what their tears touch at most. Nothing tears unless this is called; called once before each step, a tear grows from step to
    /// step. Calls with the same `stroke` are one tear that goes on: what it has parted it does not part again.
    ///
    /// # Errors
    /// As [`Scene::cut`]; [`crate::Error::Argument`] for a stretch that is not above 1.
    pub fn tear(&self, stroke: u32, stretch: f32, most: u32) -> Result<Cut> {
        let _frames = self.hold_frames(true)?;
        let line = Line::Tear(lines::Tear {
            stroke,
            stretch,
            most,
        });
        let line = |recorder: &mut Recorder| recorder.open(&line);
        let change = self.core()?.told(Some(line), |core, published| {
            core.change(published, |body, at| {
                body.tear(f64::from(stretch), most as usize, stroke, at)
            })
        });
        change.map(Cut::from)
    }

    /// Multiplies the stiffness of elements of the intact mesh: coagulation, oedema, softening.
    ///
    /// # Errors
    /// As [`Scene::cut`]; [`crate::Error::Argument`] for a factor that takes an element out of 0.001 to 1000 times its own.
    pub fn scale_stiffness(&self, elements: &[u32], factor: f32) -> Result<Cut> {
        let _frames = self.hold_frames(true)?;
        let line = Line::ScaleStiffness(lines::Stiffness {
            elements: Cow::Borrowed(elements),
            factor,
        });
        let line = |recorder: &mut Recorder| recorder.open(&line);
        let change = self.core()?.told(Some(line), |core, published| {
            core.change(published, |body, _| body.scale_stiffness(elements, factor))
        });
        change.map(Cut::from)
    }

    /// Takes the pieces that nothing holds out of the body; their volumes, mm³.
    ///
    /// # Errors
    /// As [`Scene::cut`].
    pub fn drop_fragments(&self) -> Result<Vec<f32>> {
        let _frames = self.hold_frames(true)?;
        let line = |recorder: &mut Recorder| recorder.open(&Line::DropFragments {});
        self.core()?.told(Some(line), |core, published| {
            let Some(cut) = &core.maker.body.cut else {
                return Ok(Vec::new());
            };
            let held = &cut.intact.mesh.held_nodes;
            let is_held = |node| held.binary_search(&cut.body.parent(node)).is_ok();
            let fragments = cut.body.fragments(is_held)?;
            let cells: Vec<_> = fragments.iter().flat_map(|one| one.cells.clone()).collect();
            if !cells.is_empty() {
                core.change(published, |body, _| body.drop_cells(&cells))?;
            }
            Ok(fragments.iter().map(|one| one.volume_mm3 as f32).collect())
        })
    }

    /// Keeps frames from being made while the body changes, where it may; those that there were are forgotten.
    ///
    /// # Errors
    /// [`crate::Error::Busy`] while one is made.
    pub(super) fn hold_frames(
        &self,
        may_change: bool,
    ) -> Result<Option<MutexGuard<'_, Presenters>>> {
        if !may_change {
            return Ok(None);
        }
        let mut frames = lock(&self.tools.presenters)?;
        *frames = Presenters::default();
        Ok(Some(frames))
    }
}
