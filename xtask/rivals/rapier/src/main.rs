//! Soft bodies of rapier on the folder of a case (`outside.py` says what it holds): `rivals-rapier FOLDER`.
//!
//! Centimetres and grams, so that its tolerances suit a body of 15 cm: stresses are in dyn/cm², 0.1 Pa.

use std::path::Path;
use std::time::Instant;

use rapier3d::prelude::*;
use serde_json::{Value, json};

const CM: f32 = 100.0;
const GRAM: f32 = 1000.0;
const DYN_CM2: f32 = 10.0;

fn read<const N: usize, T>(path: &Path, convert: impl Fn([u8; 4]) -> T) -> Vec<[T; N]> {
    let bytes = std::fs::read(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    let values: Vec<T> = bytes
        .as_chunks::<4>()
        .0
        .iter()
        .map(|&four| convert(four))
        .collect();
    let mut values = values.into_iter();
    std::iter::from_fn(|| {
        let row: Vec<T> = values.by_ref().take(N).collect();
        row.try_into().ok()
    })
    .collect()
}

/// Processor time of this thread, the only one, s (Linux).
fn processor_s() -> f64 {
    let text = std::fs::read_to_string("/proc/self/schedstat").unwrap_or_default();
    let nanoseconds: f64 = text
        .split(' ')
        .next()
        .and_then(|n| n.parse().ok())
        .unwrap_or(0.0);
    1e-9 * nanoseconds
}

fn main() {
    let folder = std::env::args()
        .nth(1)
        .expect("usage: rivals-rapier FOLDER");
    let at = |name: &str| Path::new(&folder).join(name);
    let case: Value = serde_json::from_slice(&std::fs::read(at("case.json")).unwrap()).unwrap();
    let number = |name: &str| {
        case[name]
            .as_f64()
            .unwrap_or_else(|| panic!("case.json: {name}")) as f32
    };
    let setting = |name: &str| {
        case["setting"][name]
            .as_u64()
            .unwrap_or_else(|| panic!("setting: {name}"))
    };
    let began = Instant::now();

    let rest: Vec<Vector> = read::<3, f32>(&at("positions.f32"), f32::from_le_bytes)
        .into_iter()
        .map(|[x, y, z]| Vector::new(x, y, z) * CM)
        .collect();
    let masses = read::<1, f32>(&at("masses.f32"), f32::from_le_bytes);
    let held = read::<1, u32>(&at("held.u32"), u32::from_le_bytes);
    let poses = read::<7, f32>(&at("poses.f32"), f32::from_le_bytes);
    let tools = case["tools"].as_array().unwrap();
    let fem = case["setting"]["solver"] == "fem";

    let mut world = PhysicsWorld::new();
    world.gravity = Vector::ZERO;
    let (frame_s, steps) = (number("frame_s"), setting("steps"));
    world.integration_parameters.dt = frame_s / steps as f32;
    world.integration_parameters.num_solver_iterations = setting("iterations") as usize;
    let friction = tools[0]["friction"].as_f64().unwrap() as f32;
    let body = SoftBodyBuilder::new(rest.clone())
        .cells(read::<4, u32>(&at("tets.u32"), u32::from_le_bytes))
        .masses(masses.iter().map(|[m]| m * GRAM).collect())
        .pinned_particles(held.iter().map(|[node]| *node))
        .cell_model(SoftBodyCellModel::NeoHookean)
        .material(SoftBodyMaterial {
            young_modulus: number("young_pa") * DYN_CM2,
            poisson_ratio: number("poisson"),
            elastic_damping_ratio: 0.0,
            ..SoftBodyMaterial::default()
        })
        .solver(if fem {
            SoftBodySolver::Fem
        } else {
            SoftBodySolver::Constraints
        })
        .linear_damping(number("damping"))
        .surface_collider(ColliderBuilder::ball(1.0).friction(friction))
        .can_sleep(false);
    let body = world.insert_soft_body(body);
    let capsules: Vec<RigidBodyHandle> = tools
        .iter()
        .zip(&poses)
        .map(|(tool, pose)| {
            let length = |name: &str| tool[name].as_f64().unwrap() as f32 * CM;
            let shape = ColliderBuilder::capsule_y(length("half_length"), length("radius"));
            let mut rigid = RigidBodyBuilder::kinematic_position_based().build();
            rigid.set_position(placed(pose, pose, 1.0), true);
            let friction = tool["friction"].as_f64().unwrap() as f32;
            world.insert(rigid, shape.friction(friction)).0
        })
        .collect();
    let set_up_s = began.elapsed().as_secs_f64();

    let frames = case["frames"].as_u64().unwrap() as usize;
    let mut out: Vec<u8> = vec![0; 12 * rest.len()];
    let (mut processor, mut wall) = (vec![0.0], vec![0.0]);
    for frame in 1..frames {
        let (clock, cpu) = (Instant::now(), processor_s());
        for step in 0..steps {
            let part = (step + 1) as f32 / steps as f32;
            for (index, &capsule) in capsules.iter().enumerate() {
                let row = |frame: usize| &poses[frame * capsules.len() + index];
                let place = placed(row(frame - 1), row(frame), part);
                world.bodies[capsule].set_next_kinematic_position(place);
            }
            world.step();
        }
        wall.push(clock.elapsed().as_secs_f64());
        processor.push(processor_s() - cpu);
        for (now, rest) in world.soft_bodies[body].particle_positions().zip(&rest) {
            let moved = (now - *rest) / CM;
            [moved.x, moved.y, moved.z]
                .iter()
                .for_each(|x| out.extend(x.to_le_bytes()));
        }
    }
    std::fs::write(at("out.f32"), out).unwrap();
    let result = json!({"processor": processor, "wall": wall, "set_up_s": set_up_s, "versions": {"rapier3d": "0.36.1"}});
    std::fs::write(at("out.json"), result.to_string()).unwrap();
}

/// `part` of the way between two poses `[x, y, z, qx, qy, qz, qw]` in metres.
fn placed(a: &[f32; 7], b: &[f32; 7], part: f32) -> Pose {
    let place = |p: &[f32; 7]| Vector::new(p[0], p[1], p[2]) * CM;
    let turn = |p: &[f32; 7]| Rotation::from_xyzw(p[3], p[4], p[5], p[6]);
    Pose::from_parts(place(a).lerp(place(b), part), turn(a).slerp(turn(b), part))
}
