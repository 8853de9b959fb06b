//! Tools placed at the tissue for the bench: random shapes, sites of the domain, poses with the end at a depth.

use anyhow::{Context, Result};
use contact::{Body, Pose, Rotation, Shape, Vector};
use tissue::schemes::SplitMix;
use tissue::solver::{Tool, ToolPose};

use crate::bench::Bench;

/// Half the length of a shaft, mm.
const SHAFT_MM: f32 = 20.0;

/// A place of the domain, mm, and the way in.
#[derive(Clone, Copy, Debug)]
pub struct Site {
    pub at: Vector,
    pub inward: Vector,
}

/// A rod of a radius, mm.
pub fn rod(radius: f32, friction: f32) -> Tool {
    tool(
        Shape::Capsule {
            half_length: SHAFT_MM,
            radius,
        },
        friction,
    )
}

pub fn tool(shape: Shape, friction: f32) -> Tool {
    Tool {
        shape,
        friction,
        tear_off_mn: 0.0,
    }
}

/// A number between two.
pub fn between(random: &mut SplitMix, low: f64, high: f64) -> f32 {
    (low + (high - low) * random.unit()) as f32
}

/// A tool of any simple shape, 2 to 10 mm wide, that grips every fourth time.
pub fn any(random: &mut SplitMix) -> Tool {
    let width = between(random, 2.0, 10.0);
    let shape = match (random.unit() * 4.0) as usize {
        0 => Shape::Sphere { radius: width },
        1 => Shape::Capsule {
            half_length: SHAFT_MM,
            radius: width,
        },
        2 => Shape::Box {
            half_extents: [width, SHAFT_MM, 0.4 * width],
        },
        _ => Shape::Spatula {
            half_extents: [width, SHAFT_MM, 0.5 * width],
            radius: 0.4 * width,
        },
    };
    let friction = between(random, 0.0, 0.6);
    Tool {
        tear_off_mn: if random.unit() < 0.5 { 80.0 } else { 0.0 },
        ..tool(shape, friction)
    }
}

/// Places evenly spread over the domain's faces.
pub fn sites(bench: &Bench, count: usize) -> Result<Vec<Site>> {
    let faces = bench.domain.face_count();
    (0..count)
        .map(|k| {
            let patch = bench.patch(k * faces / count, bench.area)?;
            let vector = |v: [f64; 3]| Vector::from(v.map(|x| x as f32));
            Ok(Site {
                at: vector(patch.site),
                inward: vector(patch.inward),
            })
        })
        .collect()
}

/// The middle of the domain.
pub fn central(bench: &Bench) -> Result<Site> {
    let patch = bench.central()?;
    let vector = |v: [f64; 3]| Vector::from(v.map(|x| x as f32));
    Ok(Site {
        at: vector(patch.site),
        inward: vector(patch.inward),
    })
}

/// A pose with the tool's lowest end `depth` mm deep at a site, its shaft (y) along the way out.
pub fn at(tool: &Tool, site: &Site, depth: f32) -> Result<ToolPose> {
    let body = Body::new(&tool.shape).context("the bench's own tool")?;
    let (low, _) = body.bounds(&Pose::IDENTITY, 0.0);
    let rotation = Rotation::from_rotation_arc(Vector::Y, -site.inward);
    let centre = site.at + site.inward * (depth + low.y);
    Ok(ToolPose {
        pose: Pose::from_parts(centre, rotation),
        grasp: false,
    })
}

/// The same pose elsewhere.
pub fn moved(pose: &ToolPose, by: Vector) -> ToolPose {
    ToolPose {
        pose: Pose::from_parts(pose.pose.translation + by, pose.pose.rotation),
        grasp: pose.grasp,
    }
}
