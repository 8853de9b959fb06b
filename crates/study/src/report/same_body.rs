//! Whether two meshes fill the same body: `coarse TLED` on another organ's mesh would be a number that means nothing.

use tissue::mesh::Mesh;
use tissue::mesh_quality::measure;

/// Corners of the boxes around both may differ by this part of the diagonal, volumes by this part.
const APART: f64 = 0.1;
const VOLUME: f64 = 0.25;

/// Why the meshes are of two bodies; nothing where they may be of one.
pub fn difference(coarse: &Mesh, fine: &Mesh) -> Option<String> {
    let (a, b) = (measure(coarse), measure(fine));
    let diagonal = (0..3)
        .map(|k| f64::from(b.high_mm[k] - b.low_mm[k]).powi(2))
        .sum::<f64>()
        .sqrt();
    let apart = (0..3)
        .flat_map(|k| [a.low_mm[k] - b.low_mm[k], a.high_mm[k] - b.high_mm[k]])
        .fold(0.0f64, |most, x| most.max(f64::from(x.abs())));
    if apart > APART * diagonal {
        return Some(format!(
            "the boxes around them differ by {apart:.0} mm, of a diagonal of {diagonal:.0} mm"
        ));
    }
    let ratio = a.volume_mm3 / b.volume_mm3;
    ((ratio - 1.0).abs() > VOLUME).then(|| {
        format!(
            "their volumes are {:.1} and {:.1} ml",
            a.volume_mm3 * 1e-3,
            b.volume_mm3 * 1e-3
        )
    })
}

#[cfg(test)]
mod tests {
    use super::difference;
    use tissue::mesh::regular_box;

    #[test]
    fn two_lattices_of_a_box_are_one_body_and_another_box_is_not() {
        let fine = regular_box([40.0, 30.0, 20.0], [8, 6, 4]).unwrap();
        let coarse = regular_box([40.0, 30.0, 20.0], [4, 3, 2]).unwrap();
        assert_eq!(difference(&coarse, &fine), None);
        let other = regular_box([40.0, 30.0, 40.0], [4, 3, 4]).unwrap();
        assert!(difference(&other, &fine).unwrap().contains("boxes"));
        let mut hollow = coarse.clone();
        hollow.tets.truncate(hollow.tets.len() / 2);
        assert!(difference(&hollow, &fine).unwrap().contains("ml"));
    }
}
