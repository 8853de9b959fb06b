//! The contact of the measurements: a patch of nodes that is pushed by 5 mm.

use upt::bundle::Mesh;
use upt::{Contact, Scene, StepInput};

/// Nodes of the domain within 8 mm of one of them.
pub fn patch(mesh: &Mesh, around: usize) -> Vec<u32> {
    let domain = &mesh.domain.nodes;
    let centre = mesh.position(domain[around % domain.len()]);
    let near = |node: &u32| {
        let p = mesh.position(*node);
        (0..3)
            .map(|axis| (p[axis] - centre[axis]).powi(2))
            .sum::<f32>()
            < 64.0
    };
    domain.iter().copied().filter(near).collect()
}

/// A push of 5 mm that moves a little each step.
pub fn pushed(nodes: &[u32], t: usize) -> Vec<f32> {
    let depth = -5.0 + 0.01 * (t % 7) as f32;
    nodes.iter().flat_map(|_| [0.0, 0.0, depth]).collect()
}

/// A step with that push.
pub fn push(scene: &Scene, nodes: &[u32], t: usize, out: Option<&mut [f32]>) -> upt::Result<()> {
    let vectors = pushed(nodes, t);
    let contact = Contact::Sparse {
        nodes,
        vectors: &vectors,
    };
    let displacement = None;
    scene.step(
        StepInput {
            displacement,
            contact,
            ..StepInput::default()
        },
        out,
    )
}
