//! Vectors, poses, grasps and ties in a snapshot.

/// Three numbers.
// Types of `crates/contact` are written as plain numbers, in the order that snapshots have had.
pub mod vector {
    use ::contact::Vector;
    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    pub fn serialize<S: Serializer>(vector: &Vector, serializer: S) -> Result<S::Ok, S::Error> {
        vector.to_array().serialize(serializer)
    }

    pub fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Vector, D::Error> {
        <[f32; 3]>::deserialize(deserializer).map(Vector::from_array)
    }
}

/// Where it is and its quaternion `x y z w`.
pub mod pose {
    use ::contact::{Pose, Rotation, Vector};
    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    pub fn serialize<S: Serializer>(pose: &Pose, serializer: S) -> Result<S::Ok, S::Error> {
        (pose.translation.to_array(), pose.rotation.to_array()).serialize(serializer)
    }

    pub fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Pose, D::Error> {
        let (place, turn) = <([f32; 3], [f32; 4])>::deserialize(deserializer)?;
        let (place, turn) = (Vector::from_array(place), Rotation::from_array(turn));
        Ok(Pose::from_parts(place, turn))
    }
}

/// Samples and their places on the tool.
pub mod grasp {
    use ::contact::{Grasp, Vector, grasp::Anchor};
    use serde::{Deserialize, Deserializer, Serializer};

    pub fn serialize<S: Serializer>(grasp: &Grasp, serializer: S) -> Result<S::Ok, S::Error> {
        let anchors = grasp.anchors().iter();
        serializer.collect_seq(anchors.map(|anchor| (anchor.sample, anchor.place.to_array())))
    }

    pub fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Grasp, D::Error> {
        let anchors = Vec::<(u32, [f32; 3])>::deserialize(deserializer)?.into_iter();
        let anchor = |(sample, place)| Anchor {
            sample,
            place: Vector::from_array(place),
        };
        let mut grasp = Grasp::default();
        grasp.restore(anchors.map(anchor).collect());
        Ok(grasp)
    }
}

/// Point, far end, spring and strength.
pub mod tie {
    use ::contact::{End, Spring, Tie, TiePoint, Vector};
    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    type Point = ([u32; 3], [f32; 3]);

    // A variant is written by its place in this list: new ones go to the end.
    #[derive(Serialize, Deserialize)]
    enum Far {
        World([f32; 3]),
        Support([f32; 3]),
        Tool(u32, [f32; 3]),
        Tissue(Point),
    }

    fn taken(sample: &TiePoint) -> Point {
        (sample.nodes, sample.weights)
    }

    fn given((nodes, weights): Point) -> TiePoint {
        TiePoint { nodes, weights }
    }

    pub fn serialize<S: Serializer>(tie: &Tie, serializer: S) -> Result<S::Ok, S::Error> {
        let far = match tie.end {
            End::World(place) => Far::World(place.to_array()),
            End::Support(place) => Far::Support(place.to_array()),
            End::Tool { tool, place } => Far::Tool(tool, place.to_array()),
            End::Tissue(sample) => Far::Tissue(taken(&sample)),
        };
        let Spring {
            stiffness,
            slack_mm,
            damping,
            pushes,
        } = tie.spring;
        let numbers = [stiffness, slack_mm, damping, tie.break_mn];
        (taken(&tie.point), far, numbers, pushes).serialize(serializer)
    }

    pub fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Tie, D::Error> {
        let (point, far, numbers, pushes) =
            <(Point, Far, [f32; 4], bool)>::deserialize(deserializer)?;
        let [stiffness, slack_mm, damping, break_mn] = numbers;
        let end = match far {
            Far::World(place) => End::World(Vector::from(place)),
            Far::Support(place) => End::Support(Vector::from(place)),
            Far::Tool(tool, place) => End::Tool {
                tool,
                place: Vector::from(place),
            },
            Far::Tissue(point) => End::Tissue(given(point)),
        };
        Ok(Tie {
            point: given(point),
            end,
            spring: Spring {
                stiffness,
                slack_mm,
                damping,
                pushes,
            },
            break_mn,
        })
    }
}
