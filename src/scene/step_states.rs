//! The contact and the displacements of the step being made, beside what a scene knows of the steps before it in numbers.
//!
//! The fields of the last two steps are published ([`super::published`]); here is what only the stepping thread touches.

use super::counters::{Counters, Source};
use super::published::{Frame, Published};
use crate::bundle::Mesh;
use crate::error::Result;
use crate::field::ContactSet;
use crate::memory::HeldBytes;

/// After tools let go, the elements make the steps while the last state is displaced by more than this, mm. The displacement at which the
/// model's own free motion ends is added, or a network that rests farther out would never take over. The elements know
/// what the tools did; the learned part would go on from a field that it did not predict.
const SWUNG_MM: f32 = 0.1;

/// See the module.
#[derive(HeldBytes)]
pub struct StepStates {
    /// Contact of the step being made; it becomes `contact` when that step is published, and is scratch between steps.
    pub incoming: ContactSet,
    /// Contact of the last published step, and of the one before it.
    pub contact: ContactSet,
    pub contact_before: ContactSet,
    #[held(skip)]
    pub counters: Counters,
    /// The state being made. It is valid from the end of the prediction or the contact solve until it is published, when it
    /// changes places with the oldest published frame; a refused step leaves it behind, and the next one overwrites it.
    pub next: Frame,
    /// Whether that state comes from the corrections, and not from the learned part alone.
    pub next_corrected: bool,
}

impl StepStates {
    /// Rest, of so many nodes.
    pub fn rest(count: usize) -> Result<StepStates> {
        let contact = ContactSet::with_capacity(count)?;
        Ok(StepStates {
            incoming: ContactSet::with_capacity(count)?,
            contact_before: ContactSet::with_capacity(count)?,
            contact,
            counters: Counters::REST,
            next: Frame::rest(count)?,
            next_corrected: false,
        })
    }

    /// Held nodes to zero, contact nodes to what is imposed; a held node stays held in contact.
    pub fn enforce(&mut self, mesh: &Mesh, held: &[bool]) {
        enforce(&mesh.held_nodes, held, &self.incoming, &mut self.next.field);
    }

    /// Whether the last state is displaced by more than where the model's own free motion ends, mm.
    pub fn is_swung(&self, rest_displacement_mm: f32) -> bool {
        self.counters.max_displacement > SWUNG_MM + rest_displacement_mm
    }

    /// The contact of the step being made becomes the last; `next` was made by the model or took the place of what it made.
    pub fn commit(&mut self, replaced: bool) {
        let counters = &mut self.counters;
        counters.was_corrected = [self.next_corrected && !replaced, counters.was_corrected[0]];
        let source = match replaced {
            true => Source::Fallback,
            false => Source::Model,
        };
        counters.sources = [source, counters.sources[0]];
        std::mem::swap(&mut self.contact_before, &mut self.contact);
        std::mem::swap(&mut self.contact, &mut self.incoming);
    }

    /// `next` becomes exactly rest, made by nothing.
    pub fn rest_next(&mut self) {
        self.counters.was_corrected = [false; 2];
        self.counters.sources = [Source::Rest; 2];
        self.next.field.fill(0.0);
        self.next.points.fill(0.0);
    }

    /// `next` becomes the last frame, the last the one before.
    pub fn rotate(&mut self, shared: &mut Published) {
        if let Some(earlier) = &mut shared.earlier {
            std::mem::swap(earlier, &mut shared.before);
        }
        std::mem::swap(&mut shared.before, &mut shared.last);
        std::mem::swap(&mut shared.last, &mut self.next);
    }

    /// The last step's contacts in the host's order.
    pub fn show_contacts(&self, shared: &mut Published) {
        shared.contact.nodes.clear();
        shared.contact.vectors.clear();
        shared.contact.nodes.resize(self.contact.len(), 0);
        shared.contact.vectors.resize(3 * self.contact.len(), 0.0);
        for (i, &at) in self.contact.order.iter().enumerate() {
            let at = at as usize;
            shared.contact.nodes[at] = self.contact.nodes[i];
            shared.contact.vectors[3 * at..3 * at + 3]
                .copy_from_slice(&self.contact.vectors[3 * i..3 * i + 3]);
        }
    }
}

/// Held nodes of `field` to zero, contact nodes to what is imposed.
pub fn enforce(held_nodes: &[u32], held: &[bool], contact: &ContactSet, field: &mut [f32]) {
    for (&node, c) in contact.nodes.iter().zip(contact.vectors.chunks_exact(3)) {
        if !held[node as usize] {
            field[3 * node as usize..3 * node as usize + 3].copy_from_slice(c);
        }
    }
    for &node in held_nodes {
        field[3 * node as usize..3 * node as usize + 3].fill(0.0);
    }
}
