//! The quality of a mesh, printed.

use tissue::mesh_quality::Quality;

/// The lines of `upt mesh info` that are about shape.
pub(super) fn print_quality(q: &Quality) {
    let row = |label: &str, text: String| println!("{label:24}{text}");
    row("nodes", q.nodes.to_string());
    row("tetrahedra", q.tets.to_string());
    row(
        "surface",
        format!(
            "{} faces, {} nodes, {:.0} mm²",
            q.surface_faces, q.surface_nodes, q.surface_area_mm2
        ),
    );
    row(
        "domain",
        format!("{} faces, {:.0} mm²", q.domain_faces, q.domain_area_mm2),
    );
    row(
        "held nodes",
        format!("{} fixed, {} supported", q.fixed_nodes, q.supported_nodes),
    );
    row("components", q.components.to_string());
    row("volume", format!("{:.1} ml", q.volume_mm3 * 1e-3));
    row("box", format!("{:?} to {:?} mm", q.low_mm, q.high_mm));
    row(
        "edges",
        format!(
            "{:.3} to {:.3} mm, mean {:.3}; surface mean {:.3}",
            q.min_edge_mm, q.max_edge_mm, q.mean_edge_mm, q.mean_surface_edge_mm
        ),
    );
    row(
        "dihedral angles",
        format!(
            "{:.2} to {:.2} degrees",
            q.min_dihedral_deg, q.max_dihedral_deg
        ),
    );
    row(
        "inscribed radius",
        format!(
            "{:.4} mm at least (tet {})",
            q.min_inscribed_radius_mm, q.min_inscribed_radius_tet
        ),
    );
    row("smallest tet", format!("{:.4} mm³", q.min_tet_volume_mm3));
    let mut boundary = String::from("manifold");
    if !q.non_manifold_edges.is_empty() || !q.non_manifold_nodes.is_empty() {
        boundary = format!(
            "not manifold at edges {:?} and nodes {:?}",
            q.non_manifold_edges, q.non_manifold_nodes
        );
    }
    row(
        "boundary",
        format!(
            "{boundary}, Euler characteristic {}",
            q.euler_characteristic
        ),
    );
}
