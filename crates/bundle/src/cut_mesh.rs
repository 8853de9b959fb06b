//! The mesh of a body that has been cut.
//!
//! A cut adds nodes and elements behind those that are there and never renumbers a node: loads,
//! points and hosts name nodes of the intact mesh for as long as a scene lives. Elements are
//! numbered anew, the whole ones in their old order without those that changed, and then the cells;
//! laws and directions go through the same order.

use topology::{Body, Changes, Skin};

use super::domain::{Bounds, Domain, Opened};
use super::mesh::Mesh;
use super::node_set::{NodeSet, unique, unique_below};
use field::error::Result;
use field::memory;

const WHAT: &str = "the mesh of a cut body";

/// What is left of a set of nodes: those that have elements around them, and of the copies those that stem from one of the set.
fn cut_set(set: &NodeSet, body: &Body, is_left: &dyn Fn(u32) -> bool) -> Result<NodeSet> {
    let own = body.mesh().node_count() as u32;
    let (mut nodes, mut rows) = (Vec::new(), Vec::new());
    let copies = own..body.node_count() as u32;
    for node in set.nodes.iter().copied().chain(copies) {
        if let (Ok(row), true) = (set.nodes.binary_search(&body.parent(node)), is_left(node)) {
            memory::push(&mut nodes, node, WHAT)?;
            memory::push(&mut rows, row as u32, WHAT)?;
        }
    }
    Ok(NodeSet {
        name: set.name.clone(),
        nodes,
        rows,
    })
}

impl Mesh {
    /// This mesh as a body that was made of it is now: copies of nodes behind the mesh's own; elements without those that have changed, and behind them the
    /// cells of these. Nodes that nothing is left around are held. Boundary triangles, their areas and the hash stay those of the intact mesh.
    ///
    /// # Errors
    /// [`field::Error::OutOfMemory`].
    pub fn cut(&self, body: &Body, changes: &Changes) -> Result<Mesh> {
        let (count, own) = (body.node_count(), self.node_count());
        let Changes { gone, new } = changes;
        let mut positions = memory::room(3 * count, WHAT)?;
        positions.extend_from_slice(&self.positions);
        for &parent in body.parents() {
            positions.extend(self.position(parent));
        }
        let whole = self.tets.len() / 4;
        let mut tets = memory::room(4 * (whole + new.len()), WHAT)?;
        // `gone` is ascending: each stretch of elements between two of its numbers is copied at
        // once.
        let ends = gone.iter().map(|element| *element as usize);
        let mut start = 0;
        for end in ends.chain([whole]) {
            tets.extend_from_slice(&self.tets[4 * start..4 * end]);
            start = end + 1;
        }
        tets.extend(new.iter().flat_map(|element| element.nodes));
        let skin = body.skin()?;
        let touchable = body.touchable_of(self.domain_sides(body)?, &skin)?;
        let domain_faces = memory::copied(touchable.faces.as_flattened(), WHAT)?;
        let most = domain_faces.len() + 4 * touchable.corners.len();
        let domain_nodes = memory::collected(most, touchable.nodes(), WHAT)?;
        let domain_nodes = unique_below(count, &domain_nodes)?;
        let mut left = memory::room(4 * new.len(), WHAT)?;
        left.extend(new.iter().flat_map(|element| element.nodes));
        let left = unique(left);
        let mesh = body.mesh();
        // Whether any tissue is left at a node: an element that stays, or a new one.
        let is_left = |node: u32| {
            let is_around = |element: &u32| gone.binary_search(element).is_err();
            let stays = (node as usize) < own && mesh.around(node).iter().any(is_around);
            stays || left.binary_search(&node).is_ok()
        };
        let corners = gone.iter().flat_map(|element| mesh.tet(*element));
        let copies = own as u32..count as u32;
        let mut held_nodes = memory::copied(&self.held_nodes, WHAT)?;
        for node in corners.chain(copies) {
            let is_held = self.held_nodes.binary_search(&body.parent(node)).is_ok();
            // A node without tissue has no stiffness: free, it would make the equations singular.
            if is_held || !is_left(node) {
                memory::push(&mut held_nodes, node, WHAT)?;
            }
        }
        let mut supports = memory::room(self.supports.len(), WHAT)?;
        for set in &self.supports {
            supports.push(cut_set(set, body, &is_left)?);
        }
        Ok(Mesh {
            positions,
            tets,
            laws: self.laws.cut(whole, changes)?,
            surface: self.surface.with_nodes(count)?,
            domain: Domain {
                faces: domain_faces,
                nodes: domain_nodes,
                opened: Opened {
                    corners: touchable.corners,
                    pieces: touchable.pieces,
                    first_wall: touchable.first_wall,
                    bounds: self.bounds(body, &skin)?,
                    ..Opened::default()
                },
            },
            held_nodes: unique(held_nodes),
            supports,
            regions: Vec::new(),
            sha256: self.sha256.clone(),
        })
    }

    /// All that bounds the cut body. The border of the intact mesh is found at the first cut and
    /// kept with it.
    fn bounds(&self, body: &Body, skin: &Skin) -> Result<Bounds> {
        let border = match self.domain.opened.border.get() {
            Some(border) => border,
            None => {
                let border = body.mesh().border(|_| true)?;
                self.domain.opened.border.get_or_init(|| border)
            }
        };
        let topology::Bounds {
            faces,
            corners,
            pieces,
        } = body.bounds(border, skin)?;
        Ok(Bounds {
            nodes: unique_below(body.node_count(), faces.as_flattened())?,
            faces,
            corners,
            pieces,
        })
    }

    /// The domain's triangles as faces of elements, found by their sorted corners; like the border
    /// they are kept.
    fn domain_sides(&self, body: &Body) -> Result<&[(u32, u8)]> {
        if let Some(sides) = self.domain.opened.domain_sides.get() {
            return Ok(sides);
        }
        let mut domain = memory::room(self.domain.faces.len() / 3, WHAT)?;
        for face in self.domain.faces.as_chunks::<3>().0 {
            let mut corners = *face;
            corners.sort_unstable();
            domain.push(corners);
        }
        domain.sort_unstable();
        let sides = (body.mesh()).border(|corners| domain.binary_search(&corners).is_ok())?;
        Ok(self.domain.opened.domain_sides.get_or_init(|| sides))
    }
}
