//! Blade, aspirator and coagulator of one client: what they do to the body at each step, how it is undone, and what the page is told of its
//! surface.
//!
//! The tools' places are those of the tissue at rest that the mouse points at, as the pressing tool's are. The blade's edge goes up from the tool's tip along its axis; the aspirator is the
//! ball at the tip, and so is what the coagulator reaches. Where the page has asked for it, tissue that a pressing tool stretches too far tears.

use anyhow::Result;
use upt::contact::PUT_MM;
use upt::ffi;

use super::protocol::{Kind, SurfaceHeader, Tool};
use super::undone::{Account, Before, keep};
use host::{Model, Scene, instrument};

/// Of the blade, from its tip, mm.
const EDGE_MM: f32 = 20.0;
/// What new area takes, J/m²: at the low end of what is measured, since a brain goes along with the blade by a centimetre at 25.
const FRACTURE_ENERGY: f32 = 10.0;
/// A blade that goes less far since its last step waits, mm.
const STILL_MM: f32 = 0.02;
/// The aspirator's, mm³/s.
const RATE: f64 = 500.0;
/// Elements that tear in a step, at the most.
const TORN: u32 = 4;
/// What coagulation multiplies stiffness by, once an element.
const HARDER: f32 = 4.0;
pub struct Surgery {
    /// K, and of each node whether it is of the domain.
    domain: Vec<bool>,
    /// Middles of the elements at rest, mm.
    middles: Vec<[f32; 3]>,
    corners: Vec<[u32; 4]>,
    /// By element: it was coagulated.
    hard: Vec<bool>,
    /// The scene shows its whole surface, not the region.
    pub begun: bool,
    /// The body has changed since the page was told of its surface.
    changed: bool,
    vertices: usize,
    last: Option<Tool>,
    stroke: u32,
    /// Until the tool is lifted: its stroke has been taken back.
    waits: bool,
    /// The body before the stroke that goes on, until it has done something.
    pending: Option<Before>,
    /// The stroke has done something.
    effective: bool,
    undone: Vec<Before>,
    pub account: Account,
    /// What the tissue does to the blade, mN, and how long the last change took, ms.
    pub force: [f32; 3],
    pub change_ms: f32,
    /// Tissue that a tool stretches beyond this tears; 0: none does.
    pub limit: f32,
    /// Why the last operation was refused, until the page is told.
    pub refused: Option<String>,
}

impl Surgery {
    pub fn new(model: &Model) -> Result<Self> {
        let positions = model.positions()?;
        let mut domain = vec![false; positions.len()];
        for node in model.indices(ffi::UPT_SET_DOMAIN_NODES)? {
            domain[node as usize] = true;
        }
        let tets = model.indices(ffi::UPT_SET_TETS)?;
        let corners = tets.as_chunks::<4>().0.to_vec();
        let middle = |corners: &[u32; 4]| {
            [0, 1, 2].map(|k| {
                let sum: f32 = corners
                    .iter()
                    .map(|node| positions[*node as usize][k])
                    .sum();
                0.25 * sum
            })
        };
        Ok(Self {
            middles: corners.iter().map(middle).collect(),
            hard: vec![false; corners.len()],
            domain,
            corners,
            begun: false,
            changed: false,
            vertices: 0,
            last: None,
            stroke: 0,
            waits: false,
            pending: None,
            effective: false,
            undone: Vec::new(),
            account: Account::default(),
            force: [0.0; 3],
            change_ms: 0.0,
            limit: 0.0,
            refused: None,
        })
    }

    /// Strokes that can be undone.
    pub fn undo_count(&self) -> usize {
        self.undone.len()
    }

    /// The tool of the step that begins: what it does to the body. No step is in flight.
    ///
    /// # Errors
    /// What ends the conversation; an operation that the library refuses is told to the page.
    pub fn operate(&mut self, scene: &mut Scene, tool: Option<Tool>, step_s: f64) -> Result<()> {
        let tears = self.limit > 0.0;
        let tool = tool.filter(|tool| tears || tool.kind != Kind::Press);
        let last = std::mem::replace(&mut self.last, tool);
        self.force = [0.0; 3];
        self.waits &= tool.is_some();
        if self.waits {
            self.last = None;
            return Ok(());
        }
        let goes_on = last.zip(tool).filter(|(from, to)| from.kind == to.kind);
        if goes_on.is_none() && last.is_some() {
            self.end(scene)?;
        }
        let Some(tool) = tool else {
            return Ok(());
        };
        if goes_on.is_none() {
            self.begin(scene)?;
        }
        let begun = std::time::Instant::now();
        let made = match tool.kind {
            Kind::Press => (scene.tear(self.stroke, self.limit, TORN))
                .map(|torn| Some(torn).filter(|torn| torn.is_changed != 0)),
            Kind::Blade => match goes_on {
                Some((from, to)) => self.cut(scene, &from, &to),
                None => Ok(None),
            },
            Kind::Aspirator => {
                let ball = ffi::upt_instrument {
                    shape: ffi::UPT_SHAPE_SPHERE,
                    position: along(&tool, -tool.half_length),
                    radius: tool.radius,
                    ..instrument()
                };
                scene.remove(&ball, (RATE * step_s) as f32).map(Some)
            }
            Kind::Coagulator => self.coagulate(scene, &tool),
        };
        match made {
            Ok(Some(cut)) => self.note(&cut, begun.elapsed().as_secs_f32() * 1e3),
            Ok(None) => {}
            Err(error) => self.refused = Some(format!("{error:#}")),
        }
        Ok(())
    }

    fn begin(&mut self, scene: &mut Scene) -> Result<()> {
        if !self.begun {
            scene.set_region(&[])?;
            self.begun = true;
            self.changed = true;
        }
        self.stroke += 1;
        self.effective = false;
        self.pending = Some(Before {
            snapshot: scene.save()?,
            account: self.account,
            hard: self.hard.clone(),
        });
        Ok(())
    }

    /// The stroke is over: pieces that nothing holds leave.
    fn end(&mut self, scene: &mut Scene) -> Result<()> {
        self.pending = None;
        if std::mem::take(&mut self.effective) {
            let dropped = scene.drop_fragments()?;
            self.account.removed_mm3 += dropped.removed_mm3;
            self.changed |= dropped.is_changed != 0;
        }
        Ok(())
    }

    fn note(&mut self, cut: &ffi::upt_cut, ms: f32) {
        self.change_ms = ms;
        self.force = cut.force;
        self.account.area_mm2 += cut.area_mm2;
        self.account.removed_mm3 += cut.removed_mm3;
        self.account.copies = (cut.node_count as usize - self.domain.len()) as u32;
        self.changed = true;
        self.effective = true;
        if let Some(before) = self.pending.take() {
            keep(&mut self.undone, before);
        }
    }

    fn cut(&self, scene: &mut Scene, from: &Tool, to: &Tool) -> Result<Option<ffi::upt_cut>> {
        let edges = [from, to].map(|tool| {
            let tip = -tool.half_length - tool.radius;
            [along(tool, tip), along(tool, tip + EDGE_MM)]
        });
        let way = |end: usize| distance(edges[0][end], edges[1][end]);
        let most = way(0).max(way(1));
        if !(STILL_MM..=PUT_MM).contains(&most) || swept(&edges) < STILL_MM * EDGE_MM {
            return Ok(None);
        }
        let cut = scene.cut(FRACTURE_ENERGY, self.stroke, &edges)?;
        Ok(Some(cut).filter(|cut| cut.is_changed != 0))
    }

    fn coagulate(&mut self, scene: &mut Scene, tool: &Tool) -> Result<Option<ffi::upt_cut>> {
        let at = along(tool, -tool.half_length);
        let near = |middle: &[f32; 3]| distance(*middle, at) < tool.radius;
        let own: Vec<u32> = (0..)
            .zip(&self.middles)
            .filter(|(element, middle)| !self.hard[*element as usize] && near(middle))
            .map(|(element, _)| element)
            .collect();
        if own.is_empty() {
            return Ok(None);
        }
        let made = scene.scale_stiffness(&own, HARDER)?;
        own.iter()
            .for_each(|element| self.hard[*element as usize] = true);
        Ok(Some(made))
    }

    /// The body before the last stroke; false where there is none. No step is in flight.
    ///
    /// # Errors
    /// Those of `upt_scene_restore`.
    pub fn undo(&mut self, scene: &mut Scene) -> Result<bool> {
        let Some(before) = self.undone.pop() else {
            return Ok(false);
        };
        scene.restore(&before.snapshot)?;
        self.account = before.account;
        self.hard = before.hard;
        self.stop();
        Ok(true)
    }

    /// The intact body is back.
    pub fn reset(&mut self) {
        self.account = Account::default();
        self.hard.fill(false);
        self.undone.clear();
        self.stop();
        // The clock begins anew, without the poses before.
        self.waits = false;
    }

    fn stop(&mut self) {
        self.waits |= self.last.is_some();
        (self.last, self.pending, self.effective) = (None, None, false);
        self.force = [0.0; 3];
        self.changed = self.begun;
    }

    /// Vertices of the surface that frames show.
    pub fn vertices(&self) -> usize {
        self.vertices
    }

    /// What the page must know of the surface, text and numbers (protocol.rs), where it has changed.
    ///
    /// # Errors
    /// Those of `upt_scene_update_surface`.
    pub fn news(&mut self, scene: &mut Scene) -> Result<Option<(SurfaceHeader, Vec<u8>)>> {
        if !std::mem::take(&mut self.changed) {
            return Ok(None);
        }
        let news = scene.update_surface()?;
        self.vertices = news.rest.len();
        let first = news.update.first_vertex as usize;
        let mut hard: Vec<u32> = (self.corners.iter().zip(&self.hard))
            .filter(|(_, hard)| **hard)
            .flat_map(|(corners, _)| *corners)
            .collect();
        hard.sort_unstable();
        hard.dedup();
        let header = SurfaceHeader {
            vertices: news.rest.len(),
            slots: news.triangles.len(),
            first_vertex: first,
            changed: news.changed.len(),
            hardened: hard.len(),
            is_new: news.update.is_new != 0,
        };
        let mut bytes = Vec::new();
        for x in news.rest[first..].as_flattened() {
            bytes.extend(x.to_le_bytes());
        }
        let in_domain = |vertex: usize| self.domain.get(vertex).copied().unwrap_or(true);
        let domain = (first..news.rest.len()).map(|vertex| u32::from(in_domain(vertex)));
        let corners = news
            .changed
            .iter()
            .flat_map(|slot| news.triangles[*slot as usize]);
        let inside = news
            .changed
            .iter()
            .map(|slot| u32::from(news.inside[*slot as usize]));
        let numbers = (domain.chain(news.changed.iter().copied())).chain(corners);
        for x in numbers.chain(inside).chain(hard) {
            bytes.extend(x.to_le_bytes());
        }
        Ok(Some((header, bytes)))
    }
}

/// The point of the tool's axis so far from its middle.
fn along(tool: &Tool, far: f32) -> [f32; 3] {
    let [x, y, z, w] = tool.rotation;
    let axis = [
        2.0 * (x * y - z * w),
        1.0 - 2.0 * (x * x + z * z),
        2.0 * (y * z + x * w),
    ];
    [0, 1, 2].map(|k| tool.position[k] + far * axis[k])
}

fn distance(a: [f32; 3], b: [f32; 3]) -> f32 {
    (0..3).map(|k| (a[k] - b[k]).powi(2)).sum::<f32>().sqrt()
}

/// Area between two places of an edge, mm²: none where it goes along itself.
fn swept(edges: &[[[f32; 3]; 2]; 2]) -> f32 {
    let minus = |a: [f32; 3], b: [f32; 3]| [0, 1, 2].map(|k| a[k] - b[k]);
    let [[a, b], [c, d]] = *edges;
    let (p, q) = (minus(d, a), minus(c, b));
    let cross = [
        p[1] * q[2] - p[2] * q[1],
        p[2] * q[0] - p[0] * q[2],
        p[0] * q[1] - p[1] * q[0],
    ];
    0.5 * distance(cross, [0.0; 3])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_tip_is_below_the_middle_along_the_axis() {
        let tool = Tool {
            position: [1.0, 2.0, 30.0],
            // The axis, local y, along z.
            rotation: [
                std::f32::consts::FRAC_1_SQRT_2,
                0.0,
                0.0,
                std::f32::consts::FRAC_1_SQRT_2,
            ],
            radius: 5.0,
            half_length: 20.0,
            friction: 0.0,
            grasp: false,
            kind: Kind::Blade,
        };
        assert!(distance(along(&tool, -25.0), [1.0, 2.0, 5.0]) < 1e-4);
    }

    #[test]
    fn an_edge_that_goes_along_itself_sweeps_nothing() {
        let edge = |at: [f32; 3]| [at, [at[0], at[1], at[2] + 20.0]];
        assert!(swept(&[edge([0.0; 3]), edge([0.0, 0.0, 3.0])]) < 1e-4);
        assert!((swept(&[edge([0.0; 3]), edge([3.0, 0.0, 0.0])]) - 60.0).abs() < 1e-3);
    }
}
