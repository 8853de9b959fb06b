//! The contact forces as the instruments feel them, node by node.

use super::response::ContactResponse;
use super::table::PriorTable;

impl ContactResponse {
    /// Force of the tissue on the instrument at each of `nodes` of the last solve, mN: `-f` at a column's own node; the
    /// nodes that borrow a column share its `-f` equally, and get none where its own node is in contact as well; a node
    /// that the solve left out gets none.
    ///
    /// That is the virtual work of the forces: the solve imposes the mean of the borrowers, or what the own node has.
    /// `held [K]` and `nodes` as in [`ContactResponse::solve`]; the force of `nodes[i]` goes to row `places[i]` of `out [m,3]`.
    pub fn reaction(
        &mut self,
        table: &PriorTable,
        held: &[bool],
        nodes: &[u32],
        places: &[u32],
        out: &mut [f32],
    ) {
        // `imposed` is zero between calls: it is filled here, read, and zeroed again below for the
        // columns that were used. A walk over the whole table would cost more than the contact.
        out.fill(0.0);
        for &node in nodes {
            if let Some((slot, own)) = table.column_for(held, node) {
                self.imposed.count[slot] += 1;
                self.imposed.own[slot] |= own;
            }
        }
        // In a second pass, since a share is known only once all borrowers have been counted.
        for (&node, &place) in nodes.iter().zip(places) {
            let Some((slot, own)) = table.column_for(held, node) else {
                continue;
            };
            let share = match (self.imposed.own[slot], own) {
                (true, true) => 1.0,
                (true, false) => continue,
                (false, _) => 1.0 / self.imposed.count[slot] as f32,
            };
            if let Ok(row) = self.columns.binary_search(&(slot as u32)) {
                let out = &mut out[3 * place as usize..][..3];
                for (out, force) in out.iter_mut().zip(&self.forces[3 * row..][..3]) {
                    *out = -share * force;
                }
            }
        }
        for &column in &self.columns {
            self.imposed.count[column as usize] = 0;
            self.imposed.own[column as usize] = false;
        }
    }
}
