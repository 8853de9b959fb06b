//! A part of space by which nodes and faces are chosen: a ball, a half-space, the inside of another closed surface.

use super::{Ball, ImportError, SurfaceDistance, closed_surface, surface_files};
use crate::mesh::{Mesh, face_centroid};
use crate::stuffing::Field;
use std::path::PathBuf;
use std::str::FromStr;

/// How a part of space is written: `ball:x,y,z,r`, `plane:a,b,c,d`, `inside:FILE`, `all`, `not:` and one of them.
#[derive(Clone, Debug, PartialEq)]
pub enum Region {
    Ball(Ball),
    /// Where `a x + b y + c z + d > 0`, with `(a, b, c)` of length 1.
    Plane([f64; 4]),
    /// Inside of a closed surface (`.stl`, `.obj`, `.ply`) in the units of the mesh's file.
    Inside(PathBuf),
    All,
    Not(Box<Region>),
}

impl FromStr for Region {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        if text.trim() == "all" {
            return Ok(Self::All);
        }
        let (kind, rest) = text.split_once(':').unwrap_or(("ball", text));
        match kind.trim() {
            "ball" => rest.parse().map(Self::Ball),
            "plane" => {
                let numbers: Option<Vec<f64>> = rest
                    .split(',')
                    .map(|part| part.trim().parse::<f64>().ok().filter(|x| x.is_finite()))
                    .collect();
                let plane: [f64; 4] = numbers
                    .and_then(|numbers| numbers.try_into().ok())
                    .ok_or_else(|| format!("`{text}` is not a plane; write plane:a,b,c,d for a x + b y + c z + d > 0, in mm"))?;
                let length = plane[..3].iter().map(|x| x * x).sum::<f64>().sqrt();
                if length > 0.0 {
                    Ok(Self::Plane(plane.map(|x| x / length)))
                } else {
                    Err(format!("`{text}`: the normal a,b,c must not be zero"))
                }
            }
            "inside" if !rest.is_empty() => Ok(Self::Inside(rest.into())),
            "not" => Ok(Self::Not(Box::new(rest.parse()?))),
            _ => Err(format!(
                "`{text}` is no region; write ball:x,y,z,r, plane:a,b,c,d, inside:FILE, all, or not: and one of them"
            )),
        }
    }
}

impl std::fmt::Display for Region {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Ball(Ball {
                centre: [x, y, z],
                radius,
            }) => write!(f, "ball:{x},{y},{z},{radius}"),
            Self::Plane([a, b, c, d]) => write!(f, "plane:{a},{b},{c},{d}"),
            Self::Inside(path) => write!(f, "inside:{}", path.display()),
            Self::All => write!(f, "all"),
            Self::Not(region) => write!(f, "not:{region}"),
        }
    }
}

/// A region with its files read.
pub enum Opened {
    Ball(Ball),
    Plane([f64; 4]),
    Inside(Box<SurfaceDistance>),
    All,
    Not(Box<Opened>),
}

impl Region {
    /// Reads the surface of `inside:`, `scale` millimetres a unit of its file.
    ///
    /// # Errors
    /// [`ImportError`] of that file.
    pub fn open(&self, scale: f64) -> Result<Opened, ImportError> {
        Ok(match self {
            Self::Ball(ball) => Opened::Ball(*ball),
            Self::Plane(plane) => Opened::Plane(*plane),
            Self::All => Opened::All,
            Self::Not(region) => Opened::Not(Box::new(region.open(scale)?)),
            Self::Inside(path) => {
                let extension = path.extension().map(|e| e.to_string_lossy().to_lowercase());
                let extension = extension.unwrap_or_default();
                if !["stl", "obj", "ply"].contains(&extension.as_str()) {
                    return Err(ImportError::Format {
                        path: path.into(),
                        reason: "the surface of inside: is read from .stl, .obj or .ply".into(),
                    });
                }
                let mut surface = surface_files::read(path, &extension)?;
                super::scale(&mut surface.positions, scale);
                closed_surface::check(&mut surface, true, &mut Vec::new())?;
                Opened::Inside(Box::new(SurfaceDistance::new(surface)?))
            }
        })
    }
}

impl Opened {
    /// Whether a point, mm, belongs to it.
    pub fn holds(&self, point: [f64; 3]) -> bool {
        match self {
            Self::Ball(ball) => ball.holds(point),
            Self::Plane([a, b, c, d]) => a * point[0] + b * point[1] + c * point[2] + d > 0.0,
            Self::Inside(surface) => surface.value(point) > 0.0,
            Self::All => true,
            Self::Not(region) => !region.holds(point),
        }
    }
}

/// Nodes in any of the regions, ascending.
pub fn nodes_in(mesh: &Mesh, regions: &[Opened]) -> Vec<u32> {
    let holds = |&node: &u32| {
        let point = mesh.positions[node as usize].map(f64::from);
        regions.iter().any(|region| region.holds(point))
    };
    (0..mesh.node_count() as u32).filter(holds).collect()
}

/// Rows of `surface` with their centroid in any of the regions, ascending.
pub fn faces_in(mesh: &Mesh, regions: &[Opened]) -> Vec<u32> {
    let holds = |&row: &u32| {
        let point = face_centroid(&mesh.positions, mesh.surface[row as usize]);
        regions.iter().any(|region| region.holds(point))
    };
    (0..mesh.surface.len() as u32).filter(holds).collect()
}
