//! Vectors, poses and grasps in a snapshot.

/// Three numbers.
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
