//! What acts on a node of the mesh goes to those nodes whose tissue is there.

use crate::TopologyError;
use crate::body::Body;
use crate::room::push;

impl Body {
    /// The nodes that take what acts on a node of the mesh, ascending, with their parts of it, whose sum is 1: the living cells that have the node's own
    /// place in their material, by volume; where none has, all around it. One node but where a blade has gone through the place itself or it has been
    /// removed, and none where nothing is left around it.
    ///
    /// # Errors
    /// No memory.
    pub fn carriers(&self, node: u32, parts: &mut Vec<(u32, f64)>) -> Result<(), TopologyError> {
        parts.clear();
        let around = self.mesh().around(node);
        if !around.iter().any(|element| self.is_touched(*element)) {
            return push(parts, (node, 1.0));
        }
        // First the cells that have the place itself; only if there is none, all around it.
        for needs_place in [true, false] {
            for &element in around {
                let tet = self.mesh().tet(element);
                let corner = tet.iter().position(|own| *own == node).unwrap_or(0);
                let volume = self.mesh().volume(element);
                for cell in self.cells(element).iter().filter(|cell| cell.is_alive) {
                    let has_place =
                        (cell.polytope.as_ref()).is_none_or(|own| own.has_corner(corner));
                    if has_place || !needs_place {
                        push(parts, (cell.nodes[corner], volume * cell.share * cell.kept))?;
                    }
                }
            }
            if !parts.is_empty() {
                break;
            }
        }
        // A stable sort, so that the sum of each node is taken in the order of the elements.
        parts.sort_by_key(|part| part.0);
        parts.dedup_by(|next, own| {
            let is_same = next.0 == own.0;
            own.1 += if is_same { next.1 } else { 0.0 };
            is_same
        });
        let sum: f64 = parts.iter().map(|part| part.1).sum();
        parts.iter_mut().for_each(|part| part.1 /= sum);
        Ok(())
    }
}
