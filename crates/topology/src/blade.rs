//! What a blade feels of the tissue that it cuts, and what the tissue feels of it.
//!
//! New area takes a fracture energy, so a blade that goes on by `ds` and lays `dA` open is pushed back by `G dA / ds` (Griffith 1921; for knives Atkins,
//! The Science and Engineering of Cutting, 2009), and pushes the tissue at the new area ahead by as much. Until it has begun to cut it must be pushed
//! with a threshold, and one that does not go where its edge is sharp does not cut: its body presses, which is the contact's to say.

use crate::body::{Body, Change};
use crate::push::{Opened, Push};
use crate::rest::{dot, length};
use crate::room::push;
use crate::{Point, Sweep, TopologyError};

/// A blade cuts where its way leans less from where it is sharp: the cosine of 60 degrees.
const LEAST_LEAN: f64 = 0.5;
/// A point of an element that lies this little outside of a cell is on its border.
const ON_BORDER: f64 = 1e-9;

/// A blade. By default it feels nothing and cuts whatever way it goes.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Blade {
    /// Fracture energy, J/m², which is mN/mm.
    /// 0 is a blade that feels nothing.
    pub energy: f64,
    /// With how much it must be pushed before it begins to cut, mN, ...
    pub threshold_mn: f64,
    /// ... and is.
    pub pushed_mn: f64,
    /// Where its edge is sharp, of any length; zero for everywhere.
    pub ahead: Point,
}

impl Blade {
    /// # Errors
    /// Numbers that are not finite, an energy or a threshold below zero.
    pub fn check(&self) -> Result<(), TopologyError> {
        let [x, y, z] = self.ahead;
        let own = [self.energy, self.threshold_mn, self.pushed_mn, x, y, z];
        if let Some(index) = own.iter().position(|x| !x.is_finite()) {
            return Err(TopologyError::NotFinite {
                field: "blade (energy, threshold, push, ahead)",
                index,
            });
        }
        match self.energy < 0.0 || self.threshold_mn < 0.0 {
            true => Err(TopologyError::Blade {
                energy: self.energy,
                threshold_mn: self.threshold_mn,
            }),
            false => Ok(()),
        }
    }

    /// Whether it cuts on a way; `has_begun` where it has already.
    fn cuts(&self, way: Point, has_begun: bool) -> bool {
        let size = length(self.ahead) * length(way);
        let leads = size == 0.0 || dot(self.ahead, way) >= LEAST_LEAN * size;
        leads && (has_begun || self.pushed_mn >= self.threshold_mn)
    }
}

impl Body {
    /// [`Body::cut`] by a blade that feels the tissue: nothing has changed where it does not cut, and [`Change::pushes`] says what it does to the tissue
    /// where it does.
    ///
    /// # Errors
    /// As there, and for a blade that cannot be.
    pub fn cut_with(
        &mut self,
        blade: &Blade,
        sweep: &Sweep,
        stroke: u32,
        positions: &[Point],
    ) -> Result<Change, TopologyError> {
        blade.check()?;
        self.check(positions)?;
        let has_begun = self.opened.get(&stroke).is_some_and(|own| !own.is_empty());
        // No error: a blade that rests on tissue presses it, and the contact solves that.
        if !blade.cuts(sweep.way(), has_begun) {
            return Ok(Change::default());
        }
        let mut next = self.clone();
        let mut opened = Vec::new();
        let mut change = next.cut_in_place(sweep, (stroke, None), positions, &mut opened)?;
        let way = sweep.way();
        // `G dA / ds` along the way: its direction is `way / |way|` and `ds = |way|`, hence the
        // square.
        let square = dot(way, way);
        if blade.energy > 0.0 && square > 0.0 {
            for part in opened {
                let force = way.map(|x| blade.energy * part.area_mm2 * x / square);
                next.push_at(part, force, &mut change.pushes)?;
            }
        }
        *self = next;
        Ok(change)
    }

    /// Shares a force between the cells on whose border its point lies.
    fn push_at(
        &self,
        part: Opened,
        force: Point,
        pushes: &mut Vec<Push>,
    ) -> Result<(), TopologyError> {
        let cells = self.cells(part.element);
        let has =
            |cell: &&crate::Cell| cell.is_alive && cell.material().depth(&part.at) >= -ON_BORDER;
        let count = cells.iter().filter(has).count();
        for cell in cells.iter().filter(has) {
            let own = Push {
                nodes: cell.nodes,
                weights: part.at,
                force: force.map(|x| x / count as f64),
            };
            push(pushes, own)?;
        }
        Ok(())
    }
}

impl Change {
    /// What the blade does to the tissue, mN.
    pub fn force(&self) -> Point {
        let forces = self.pushes.iter().map(|push| push.force);
        forces.fold([0.0; 3], |sum, force| [0, 1, 2].map(|k| sum[k] + force[k]))
    }
}
