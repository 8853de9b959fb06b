//! A part of a body by which nodes, faces and tetrahedra are chosen: a ball, a half-space, the inside of another closed surface,
//! a part that the mesh's file names.

use super::labels::{Group, sorted};
use super::{Ball, ImportError, RawSurface, SurfaceDistance, closed_surface, space, surface_files};
use crate::mesh::{Mesh, face_centroid};
use crate::stuffing::Field;
use std::cell::OnceCell;
use std::collections::HashSet;
use std::path::{Path, PathBuf};
use std::str::FromStr;

/// How a part is written: `ball:x,y,z,r`, `plane:a,b,c,d`, `inside:FILE`, `group:NAME`, `shell:MM`, `all`, `not:` and one of them.
#[derive(Clone, Debug, PartialEq)]
pub enum Region {
    Ball(Ball),
    /// Where `a x + b y + c z + d > 0`, with `(a, b, c)` of length 1.
    Plane([f64; 4]),
    /// Inside of a closed surface (`.stl`, `.obj`, `.ply`) in the units of the mesh's file, and in its space where both files name one.
    Inside(PathBuf),
    /// What the mesh's own file calls so ([`super::Labels`]).
    Group(String),
    /// Less than so many millimetres from the body's own surface.
    Shell(f64),
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
            "group" if !rest.trim().is_empty() => Ok(Self::Group(rest.trim().into())),
            "shell" => match rest.trim().parse::<f64>() {
                Ok(depth) if depth.is_finite() && depth > 0.0 => Ok(Self::Shell(depth)),
                _ => Err(format!(
                    "`{text}` is not a shell; write shell:MM with a depth above 0 mm"
                )),
            },
            "not" => Ok(Self::Not(Box::new(rest.parse()?))),
            _ => Err(format!(
                "`{text}` is not a region; write ball:x,y,z,r, plane:a,b,c,d, inside:FILE, group:NAME, shell:MM, all, or not: before one of these"
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
            Self::Group(name) => write!(f, "group:{name}"),
            Self::Shell(depth) => write!(f, "shell:{depth}"),
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
    Group(Box<Group>),
    /// With the surface of the body that was asked first.
    Shell(f64, OnceCell<Option<Box<SurfaceDistance>>>),
    All,
    Not(Box<Opened>),
}

impl Region {
    /// Reads the surface of `inside:` and the names of `group:` out of the mesh's file `input`, `scale` millimetres a unit.
    ///
    /// # Errors
    /// [`ImportError`] of those files; a name that is not there, with those that are.
    pub fn open(&self, input: &Path, scale: f64) -> Result<Opened, ImportError> {
        Ok(match self {
            Self::Ball(ball) => Opened::Ball(*ball),
            Self::Plane(plane) => Opened::Plane(*plane),
            Self::Shell(depth) => Opened::Shell(*depth, OnceCell::new()),
            Self::All => Opened::All,
            Self::Not(region) => Opened::Not(Box::new(region.open(input, scale)?)),
            Self::Group(name) => {
                let group = super::read_labels(input)?.group(name, input, scale)?;
                Opened::Group(Box::new(group))
            }
            Self::Inside(path) => {
                let extension = super::extension_of(path);
                if !surface_files::EXTENSIONS.contains(&extension.as_str()) {
                    return Err(ImportError::Format {
                        path: path.into(),
                        reason: "the surface of inside: is read from .stl, .obj, .ply or .off"
                            .into(),
                    });
                }
                let mut surface = surface_files::read(path, &extension)?;
                space::turn(&mut surface.positions, path, input)?;
                super::scale(&mut surface.positions, scale);
                closed_surface::check(&mut surface, true, &mut Vec::new())?;
                Opened::Inside(Box::new(SurfaceDistance::new(surface)?))
            }
        })
    }
}

/// What a point of a body is.
#[derive(Clone, Copy)]
enum Kind {
    /// A face's centroid.
    Face,
    /// A tetrahedron's centroid.
    Tet,
}

impl Opened {
    /// Whether a point, mm, belongs to it.
    fn holds(&self, mesh: &Mesh, point: [f64; 3], kind: Kind) -> bool {
        match self {
            Self::Ball(ball) => ball.holds(point),
            Self::Plane([a, b, c, d]) => a * point[0] + b * point[1] + c * point[2] + d > 0.0,
            Self::Inside(surface) => surface.value(point) > 0.0,
            Self::Group(group) => match kind {
                Kind::Face => group.holds_by_face(point) || group.holds_by_corner(point),
                Kind::Tet => group.holds_tet(point),
            },
            Self::Shell(depth, surface) => {
                let made = surface.get_or_init(|| surface_of(mesh).map(Box::new));
                made.as_ref()
                    .is_some_and(|surface| surface.value(point).abs() < *depth)
            }
            Self::All => true,
            Self::Not(region) => !region.holds(mesh, point, kind),
        }
    }

    /// Whether each face of the surface belongs to it, by its centroid. A group has the faces of its tetrahedra too.
    fn faces(&self, mesh: &Mesh) -> Vec<bool> {
        let by_centroid = |region: &Self| -> Vec<bool> {
            let centroid = |&face: &[u32; 3]| face_centroid(&mesh.positions, face);
            let holds = |face: &[u32; 3]| region.holds(mesh, centroid(face), Kind::Face);
            mesh.surface.iter().map(holds).collect()
        };
        match self {
            Self::Not(region) => region.faces(mesh).iter().map(|held| !held).collect(),
            Self::Group(group) if group.has_tets() => {
                let own: HashSet<[u32; 3]> = (tets_in(mesh, self).into_iter())
                    .flat_map(|row| {
                        let [a, b, c, d] = mesh.tets[row];
                        [[a, b, c], [a, b, d], [a, c, d], [b, c, d]].map(sorted)
                    })
                    .collect();
                let flags = by_centroid(self).into_iter().zip(&mesh.surface);
                flags
                    .map(|(held, &face)| held || own.contains(&sorted(face)))
                    .collect()
            }
            region => by_centroid(region),
        }
    }

    /// Whether each node belongs to it. A group has the nodes of its faces and tetrahedra, and those whose own corner in the file it
    /// names.
    fn nodes(&self, mesh: &Mesh) -> Vec<bool> {
        let positions = || mesh.positions.iter().map(|p| p.map(f64::from));
        match self {
            Self::Not(region) => region.nodes(mesh).iter().map(|held| !held).collect(),
            Self::Group(group) => {
                let mut flags = vec![false; mesh.node_count()];
                if group.has_tets() {
                    let tets = tets_in(mesh, self).into_iter();
                    tets.flat_map(|row| mesh.tets[row])
                        .for_each(|node| flags[node as usize] = true);
                }
                for &face in &mesh.surface {
                    let whole = group.holds_by_face(face_centroid(&mesh.positions, face));
                    for node in face.map(|node| node as usize) {
                        let place = mesh.positions[node].map(f64::from);
                        flags[node] |= whole || group.holds_by_corner(place);
                    }
                }
                flags
            }
            region => positions()
                .map(|p| region.holds(mesh, p, Kind::Tet))
                .collect(),
        }
    }
}

/// The body's surface; none where it is not closed.
fn surface_of(mesh: &Mesh) -> Option<SurfaceDistance> {
    let surface = RawSurface {
        positions: mesh.positions.iter().map(|p| p.map(f64::from)).collect(),
        faces: mesh.surface.clone(),
    };
    SurfaceDistance::new(surface).ok()
}

/// Nodes in any of the regions, ascending.
pub fn nodes_in(mesh: &Mesh, regions: &[Opened]) -> Vec<u32> {
    let flags: Vec<Vec<bool>> = regions.iter().map(|region| region.nodes(mesh)).collect();
    (0..mesh.node_count() as u32)
        .filter(|&node| flags.iter().any(|flags| flags[node as usize]))
        .collect()
}

/// Rows of `surface` in any of the regions, ascending.
pub fn faces_in(mesh: &Mesh, regions: &[Opened]) -> Vec<u32> {
    let flags: Vec<Vec<bool>> = regions.iter().map(|region| region.faces(mesh)).collect();
    (0..mesh.surface.len() as u32)
        .filter(|&row| flags.iter().any(|flags| flags[row as usize]))
        .collect()
}

/// Rows of `tets` with their centroid in the region, ascending.
pub fn tets_in(mesh: &Mesh, region: &Opened) -> Vec<usize> {
    let holds = |&row: &usize| {
        let corners = mesh.tets[row].map(|node| mesh.positions[node as usize].map(f64::from));
        let centre: [f64; 3] =
            std::array::from_fn(|k| corners.iter().map(|p| p[k]).sum::<f64>() / 4.0);
        region.holds(mesh, centre, Kind::Tet)
    };
    (0..mesh.tets.len()).filter(holds).collect()
}
