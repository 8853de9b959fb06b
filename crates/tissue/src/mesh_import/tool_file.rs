//! A tool of one's own: the convex hull of an STL, OBJ or PLY file.

use super::{ImportError, surface_files};
use contact::Shape;
use std::path::Path;

/// Reads the convex hull of a surface, `scale` millimetres a unit of the file. Its y axis is the shaft, upwards; the end that
/// touches is the lowest.
///
/// # Errors
/// [`ImportError`] for a file that is no surface, or one whose points have no volume between them.
pub fn tool_shape(path: &Path, scale: f64) -> Result<Shape, ImportError> {
    if !(scale.is_finite() && scale > 0.0) {
        return Err(ImportError::Scale(scale));
    }
    let extension = super::extension_of(path);
    if !surface_files::EXTENSIONS.contains(&extension.as_str()) {
        return Err(ImportError::Format {
            path: path.into(),
            reason: "a tool is read from .stl, .obj, .ply or .off".into(),
        });
    }
    let surface = surface_files::read(path, &extension)?;
    let points = surface.positions.iter();
    let points: Vec<[f32; 3]> = points.map(|p| p.map(|v| (v * scale) as f32)).collect();
    Shape::hull_of(&points).map_err(|error| ImportError::Format {
        path: path.into(),
        reason: error.to_string(),
    })
}
