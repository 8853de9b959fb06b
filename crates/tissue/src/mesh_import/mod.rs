//! Meshes from other programs: tetrahedra as they are, closed surfaces through [`crate::stuffing`].
//!
//! | extension | read as |
//! |---|---|
//! | `.vtk`, `.vtu` | tetrahedra of a VTK legacy or XML unstructured grid |
//! | `.msh` | tetrahedra of a Gmsh file, version 2.0 to 2.2 or 4.1, text or binary, or version 1 |
//! | `.inp` | tetrahedra (C3D4, C3D10) of an Abaqus or CalculiX input file |
//! | `.feb` | tetrahedra (tet4, tet10) of a FEBio model |
//! | `.mesh` | tetrahedra, or a closed surface, of a Medit file |
//! | `.node`, `.ele` | tetrahedra of TetGen |
//! | `.stl`, `.obj`, `.ply`, `.off`, VTK polydata (`.vtk`, `.vtp`) | a closed surface, filled with tetrahedra of a chosen spacing |
//!
//! Of tetrahedra of higher order the corners are read, which [`Imported::repairs`] says. Only regular files are opened, and no file
//! makes a reader take far more memory than it has bytes: counts are held against what is left of the file.
//!
//! Coordinates are taken as millimetres times [`ImportOptions::scale`]. What is wrong with a file is
//! an [`ImportError`] that names the element; with [`ImportOptions::repair`] the fault is removed
//! where that is safe and listed in [`Imported::repairs`].
//!
//! REQ-090: A damaged mesh file is refused or read within bounds of memory and work.

mod ball;
mod bodies;
mod body;
mod choice;
mod closed_surface;
mod distance;
mod error;
mod far;
mod fill;
mod found_body;
mod gmsh;
mod labelled;
mod labels;
mod medit;
mod named_tets;
mod polygons;
mod raw;
mod region;
mod repair;
mod self_crossing;
mod solid;
mod space;
mod surface_files;
mod surface_repair;
mod tetgen;
mod thickness;
mod tool_file;
mod vtk;
mod walls;
mod words;

pub use ball::Ball;
pub use distance::SurfaceDistance;
pub use error::{ImportError, Repair};
pub use found_body::FoundBody;
pub use labels::{Group, Labels};
pub use region::{Opened, Region, faces_in, nodes_in, tets_in};
pub use tool_file::tool_shape;

use body::{Body, Read};
use choice::Names;

use crate::mesh::Mesh;
pub use labelled::read_labels;
use raw::extension_of;
pub use raw::{ImportOptions, RawSurface, RawTets, Resolution};
use std::path::{Path, PathBuf};

/// A mesh that passed every check, and what was changed on the way.
#[derive(Clone, Debug)]
pub struct Imported {
    pub mesh: Mesh,
    pub repairs: Vec<Repair>,
    /// What else there is to know, in words: where a filled surface is finer, how far a count was missed.
    pub notes: Vec<String>,
}

/// Reads `path` by its extension, checks it, and fills it if it is a surface. Its sets are empty.
///
/// # Errors
/// [`ImportError`], naming the file's element or field and what to do.
pub fn import(path: &Path, options: &ImportOptions) -> Result<Imported, ImportError> {
    if !(options.scale.is_finite() && options.scale > 0.0) {
        return Err(ImportError::Scale(options.scale));
    }
    let Read {
        body,
        notes: mut repairs,
    } = read_file(path)?;
    let mut notes = Vec::new();
    let names = || Names::of(path, options.scale);
    let mut own = options.clone();
    let raw = match body {
        Body::Tets(mut raw) if !options.refill => {
            scale(&mut raw.positions, options.scale);
            raw
        }
        body => {
            let mut surface = match body {
                Body::Surface(surface) => surface,
                Body::Tets(raw) => repair::boundary(raw, &mut repairs)?,
            };
            scale(&mut surface.positions, options.scale);
            let repair = options.repair || options.refill;
            closed_surface::check(&mut surface, repair, &mut repairs)?;
            bodies::keep_one(&mut surface, options, names, &mut repairs, &mut notes)?;
            self_crossing::check(&surface, repair, &mut repairs)?;
            let resolution = options.resolution.ok_or(ImportError::NoResolution)?;
            let filled = fill::fill(surface, resolution)?;
            notes.extend(filled.notes);
            // The body is chosen.
            own.part = None;
            filled.raw
        }
    };
    let mut mesh = checked(raw, &own, names, &mut repairs, &mut notes)?;
    let file = path.file_name().unwrap_or_default().to_string_lossy();
    mesh.source = format!("imported from {file}");
    mesh.license = "as the source file's".into();
    mesh.name = options.name.clone().unwrap_or_else(|| {
        path.file_stem()
            .unwrap_or_default()
            .to_string_lossy()
            .into_owned()
    });
    mesh.validate()?;
    Ok(Imported {
        mesh,
        repairs,
        notes,
    })
}

/// What a file holds, by its extension.
fn read_file(path: &Path) -> Result<Read, ImportError> {
    let extension = extension_of(path);
    Ok(match extension.as_str() {
        "vtk" | "vtu" | "vtp" => vtk::read(path)?,
        "msh" => gmsh::read(path)?,
        "inp" | "feb" => named_tets::read(path)?,
        "mesh" => medit::read(path)?,
        "node" | "ele" => tetgen::read(path)?,
        surface if surface_files::EXTENSIONS.contains(&surface) => {
            surface_files::read(path, surface)?.into()
        }
        other => {
            return Err(match unread(other) {
                Some(reason) => ImportError::format(path, reason),
                None => ImportError::Extension { path: path.into() },
            });
        }
    })
}

/// What a known format is that is not read, and how to convert it.
fn unread(extension: &str) -> Option<&'static str> {
    Some(match extension {
        "meshb" => {
            "binary Medit (.meshb) is not read: write it as text, `transmesh IN.meshb OUT.mesh` (libMeshb) or `mmg3d_O3 -nomove -noinsert -noswap \
             IN.meshb OUT.mesh`"
        }
        "nhdr" => {
            "an NRRD header beside its data (.nhdr) is not read: write both into one file, in 3D Slicer by saving as .nrrd, or with `unu save -f nrrd \
             -i IN.nhdr -o OUT.nrrd`"
        }
        "mhd" => {
            "a MetaImage header beside its data (.mhd) is not read: write both into one file, in 3D Slicer or ITK-SNAP by saving as .mha, or in Python with \
             `SimpleITK.WriteImage(SimpleITK.ReadImage('IN.mhd'), 'OUT.mha')`"
        }
        _ => return None,
    })
}

/// The files that [`import`] reads for `path`: TetGen's come in pairs.
pub fn files_of(path: &Path) -> Vec<PathBuf> {
    match extension_of(path).as_str() {
        "node" | "ele" => vec![path.with_extension("node"), path.with_extension("ele")],
        _ => vec![path.into()],
    }
}

/// Checks tetrahedra and makes them a mesh without named sets.
///
/// With `repair`, faults are removed and listed in `repairs`; without, the first is an error.
pub fn from_tets(
    raw: RawTets,
    repair: bool,
    repairs: &mut Vec<Repair>,
) -> Result<Mesh, ImportError> {
    let options = ImportOptions {
        repair,
        ..ImportOptions::default()
    };
    checked(raw, &options, Names::default, repairs, &mut Vec::new())
}

fn checked(
    mut raw: RawTets,
    options: &ImportOptions,
    names: impl FnOnce() -> Names,
    repairs: &mut Vec<Repair>,
    notes: &mut Vec<String>,
) -> Result<Mesh, ImportError> {
    repair::tets(&mut raw, options, names, repairs, notes)?;
    let mesh = Mesh {
        surface: crate::mesh::boundary_faces(&raw.tets)?,
        positions: raw.positions.iter().map(|p| p.map(|x| x as f32)).collect(),
        tets: raw.tets,
        ..Mesh::default()
    };
    mesh.validate()?;
    Ok(mesh)
}

fn scale(positions: &mut [[f64; 3]], factor: f64) {
    if factor != 1.0 {
        positions.iter_mut().flatten().for_each(|x| *x *= factor);
    }
}
