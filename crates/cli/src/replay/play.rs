//! A line of a replay, done again by a scene.

use anyhow::{Context, Result, anyhow};
use contact::Body;
use upt::replay::drive::Rows;
use upt::replay::lines::{Cut, Line, Step};
use upt::replay::loads::Pose;
use upt::{
    Blade, Contact, GroupMotion, Loads, PointForce, Pressure, Scene, StepInput, SupportPose, Tie,
    Tool,
};

use yardstick::manifest::hex;

/// A scene, and the hulls that its lines have named.
pub struct Player {
    pub scene: Scene,
    hulls: Vec<Body>,
}

impl Player {
    pub fn new(scene: Scene) -> Player {
        Player {
            scene,
            hulls: Vec::new(),
        }
    }

    /// Does what a line says; of a step the hash of what came of it.
    ///
    /// # Errors
    /// What the scene says to it; rows that are none of its mesh.
    pub fn play(&mut self, line: &Line<'_>) -> Result<Option<String>> {
        let scene = &self.scene;
        match line {
            Line::Step(step) => return self.step(step).map(Some),
            Line::Hull(shape) => self.hulls.push(Body::new(shape)?),
            Line::Cut(Cut {
                stroke,
                points,
                poses,
                blade,
            }) => {
                let blade = blade.map_or(Blade::default(), |own| Blade {
                    energy: own.fracture_energy,
                    threshold_mn: own.threshold,
                    pushed_mn: own.pushed,
                    ahead: own.ahead,
                });
                scene.cut_with(&blade, *stroke, *points, poses)?;
            }
            Line::Remove(remove) => {
                scene.remove(&remove.instrument.tool(&self.hulls)?, remove.most_mm3)?;
            }
            Line::Tear(tear) => {
                scene.tear(tear.stroke, tear.stretch, tear.most)?;
            }
            Line::ScaleStiffness(given) => {
                scene.scale_stiffness(&given.elements, given.factor)?;
            }
            Line::DropFragments {} => {
                scene.drop_fragments()?;
            }
            Line::Reset {} => scene.reset()?,
            Line::Restore(bytes) => scene.restore(&bytes.0)?,
            Line::Region(nodes) => scene.set_region(nodes.as_deref())?,
            Line::End(_) => unreachable!("the reader ends there"),
        }
        Ok(None)
    }

    fn step(&self, step: &Step<'_>) -> Result<String> {
        let field = |name: &str, rows: &Option<Rows<'_>>| {
            let made = rows
                .as_ref()
                .map(|rows| rows.field(self.scene.mesh().node_count()));
            made.map(|field| {
                field
                    .with_context(|| format!("{name}: three numbers a node of the mesh are needed"))
            })
            .transpose()
        };
        let tools: Vec<Tool> = (step.instruments.iter().flatten().enumerate())
            .map(|(at, given)| {
                let tool = given.tool(&self.hulls);
                tool.with_context(|| format!("instrument {at}"))
            })
            .collect::<Result<_>>()?;
        let [collision, displacement, forces] = [
            field("collision", &step.collision)?,
            field("displacement", &step.displacement)?,
            field("forces", &step.loads.forces)?,
        ];
        let contact = match (&step.instruments, &step.contact, &collision) {
            (None, None, None) => Contact::None,
            (Some(_), None, None) => Contact::Tools(&tools),
            (None, Some(Rows { nodes, vectors }), None) => Contact::Sparse { nodes, vectors },
            (None, None, Some(field)) => Contact::Dense(field),
            _ => {
                return Err(anyhow!(
                    "give one of `instruments`, `contact` and `collision`"
                ));
            }
        };
        let given = &step.loads;
        let pose = |pose: Pose| SupportPose {
            position: pose.position,
            rotation: pose.rotation,
        };
        let pressures = given.pressures.iter().map(|own| Pressure {
            nodes: &own.nodes,
            pascal: own.pascal,
        });
        let supports = given.supports.iter().map(|own| GroupMotion {
            group: own.group,
            let_go: own.let_go,
            pose: own.pose.map(pose),
            displacements: own.displacements.as_deref(),
        });
        let (pressures, supports): (Vec<_>, Vec<_>) = (pressures.collect(), supports.collect());
        let at_points = given.point_forces.iter().map(|own| PointForce {
            nodes: own.nodes,
            weights: own.weights,
            force: own.force,
        });
        let point_forces: Vec<_> = at_points.collect();
        let ties: Vec<Tie> = given.ties.iter().map(Tie::from).collect();
        let input = StepInput {
            displacement: displacement.as_deref(),
            contact,
            loads: Loads {
                gravity: given.gravity,
                gravity_at_rest: given.gravity_at_rest,
                forces: forces.as_deref(),
                point_forces: &point_forces,
                pressures: &pressures,
                support: given.support.map(pose),
                ties: &ties,
                supports: &supports,
            },
            time_s: step.time_s,
        };
        let mut field = vec![0.0f32; 3 * self.scene.region_count()];
        self.scene.step(input, Some(&mut field))?;
        let bytes: Vec<u8> = field.into_iter().flat_map(f32::to_le_bytes).collect();
        Ok(hex(&bytes))
    }
}
