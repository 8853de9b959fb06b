//! What page and server say to each other.
//!
//! From the page, JSON text of at most 1,024 bytes:
//!
//! ```json
//! {"tool": {"position": [0,0,0], "rotation": [0,0,0,1], "radius": 5, "half_length": 20, "friction": 0.3, "grasp": false, "kind": "press"}, "sequence": 7}
//! {"tool": null, "sequence": 8}      no tool
//! {"reset": true}                    back to rest
//! {"record": true}                   start a recording (false: end it)
//! {"replay": true}                   from rest through the recording
//! {"breathe": true}                  what holds the organ goes up and down (false: it does not), and a ball hangs on the organ
//! {"tear": 1.5}                      tissue that a pressing tool stretches beyond this tears from now on (0: none does)
//! {"undo": true}                     the body before the last stroke of a blade, aspirator or coagulator
//! ```
//!
//! A message about the tool asks for a frame: the page sends one for each picture that it draws, so that nothing piles up where it is
//! slow, and each picture shows the tissue of its own moment. Several that have come at once get one answer, with the last one's sequence.
//!
//! To the page: first JSON text (`Hello`), then a binary message of the surface, rest positions `[n,3]` f32, faces `[m,3]`
//! u32 and 1 for each node of the domain `[n]` u32, then a binary message a frame: [`HEADER`] numbers of 32 bits, little-endian, then displacements
//! `[n,3]` f32, mm.
//!
//! Where a blade, an aspirator or a coagulator has changed the body, text (`SurfaceHeader`) and a binary message come before the first frame of its new surface: rest
//! positions of the new vertices `[vertices - first_vertex, 3]` f32, 1 for each of them that is of the domain, the slots of triangles that have changed `[changed]`,
//! their corners `[changed, 3]` (0, 0, 0: none), 1 for each of them that was inside of the intact body, and the hardened vertices `[hardened]`, all u32. From then on a
//! frame has a displacement for each vertex. What the library refuses to do is told as text, `{"refused": "..."}`.

use serde::{Deserialize, Serialize};

/// Bytes that a message from the page may have.
pub const LONGEST_MESSAGE: usize = 1024;
/// Numbers before the displacements of a frame: sequence, flags, contacts, state (u32: 1 recording, 2 replaying, 4 asleep),
/// step ms, indicator, force x y z (mN), largest displacement (mm), ms that the frame took to make, steps (u32),
/// corrections (u32), their estimated error (mm), deepest tissue inside of the tool (mm), then where the tool is in this frame: 1 or 0
/// (u32), position x y z, rotation x y z w, radius, and what it is (u32: 0 presses, 1 blade, 2 aspirator, 3 coagulator); area cut (mm²), volume removed (mm³),
/// copies of nodes (u32), strokes that can be undone (u32), ms that the last change of the body took; how far up the organ's frame is (mm), where the ball is x y z and its radius (0: there
/// is none), and how many of its ties have torn (u32). Tools and the ball are in the world, displacements in the organ's frame. The force on a blade is in place of the pressing tool's.
pub const HEADER: usize = 36;
/// No organ and no tool is larger, mm.
const FARTHEST: f32 = 10_000.0;
/// No tool rubs more.
const STICKIEST: f32 = 2.0;

/// A capsule; its axis is local y.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Tool {
    pub position: [f32; 3],
    /// Unit quaternion x, y, z, w.
    pub rotation: [f32; 4],
    pub radius: f32,
    pub half_length: f32,
    /// Coulomb's coefficient.
    pub friction: f32,
    /// It holds what it touches.
    #[serde(default)]
    pub grasp: bool,
    #[serde(default)]
    pub kind: Kind,
}

/// What a tool does.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Kind {
    /// It presses, or holds.
    #[default]
    Press = 0,
    Blade = 1,
    Aspirator = 2,
    Coagulator = 3,
}

/// One wish of the page.
#[derive(Debug, PartialEq)]
pub enum Wish {
    Tool(Option<Tool>, u32),
    Reset,
    Record(bool),
    Replay,
    Breathe(bool),
    /// Tissue that a tool stretches beyond this tears; 0: none does.
    Tear(f32),
    Undo,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Message {
    #[serde(default, deserialize_with = "given")]
    tool: Option<Option<Tool>>,
    sequence: Option<u32>,
    reset: Option<bool>,
    record: Option<bool>,
    replay: Option<bool>,
    breathe: Option<bool>,
    tear: Option<f32>,
    undo: Option<bool>,
}

/// Tells `"tool": null` from no tool at all.
fn given<'de, D: serde::Deserializer<'de>>(source: D) -> Result<Option<Option<Tool>>, D::Error> {
    Option::<Tool>::deserialize(source).map(Some)
}

impl Wish {
    /// # Errors
    /// What is wrong with the message, for the closing frame.
    pub fn parse(text: &str) -> Result<Self, String> {
        let message: Message = serde_json::from_str(text).map_err(|error| error.to_string())?;
        let sequence = message.sequence.unwrap_or(0);
        let given = [
            message.tool.map(|tool| Wish::Tool(tool, sequence)),
            message.reset.filter(|yes| *yes).map(|_| Wish::Reset),
            message.record.map(Wish::Record),
            message.replay.filter(|yes| *yes).map(|_| Wish::Replay),
            message.breathe.map(Wish::Breathe),
            message.tear.map(Wish::Tear),
            message.undo.filter(|yes| *yes).map(|_| Wish::Undo),
        ];
        let mut given = given.into_iter().flatten();
        match (given.next(), given.next()) {
            (Some(Wish::Tool(Some(tool), sequence)), None) => {
                tool.check()?;
                Ok(Wish::Tool(Some(tool), sequence))
            }
            (Some(Wish::Tear(limit)), None) if limit != 0.0 && (limit <= 1.0 || limit.is_nan()) => {
                Err(format!(
                    "tear: {limit} is not a stretch: give more than 1, or 0 for none"
                ))
            }
            (Some(wish), None) => Ok(wish),
            _ => Err(
                "a message must hold one of tool, reset, record, replay, breathe, tear, undo"
                    .into(),
            ),
        }
    }
}

impl Tool {
    fn check(&self) -> Result<(), String> {
        let all = self.position.iter().chain(&self.rotation);
        if !all
            .chain([&self.radius, &self.half_length, &self.friction])
            .all(|x| x.is_finite() && x.abs() <= FARTHEST)
        {
            return Err("tool: a number is not finite or too large".into());
        }
        let length = self.rotation.iter().map(|x| x * x).sum::<f32>().sqrt();
        if (length - 1.0).abs() > 1e-3 {
            return Err(format!("tool.rotation has length {length}; it must be 1"));
        }
        if !(0.1..=50.0).contains(&self.radius) || !(0.0..=200.0).contains(&self.half_length) {
            return Err("tool: radius must be 0.1 to 50 mm and half_length 0 to 200 mm".into());
        }
        if !(0.0..=STICKIEST).contains(&self.friction) {
            return Err(format!(
                "tool.friction is {}; it must be 0 to {STICKIEST}",
                self.friction
            ));
        }
        Ok(())
    }
}

/// The first message to the page.
#[derive(Serialize)]
pub struct Hello {
    pub bundle: String,
    /// K.
    pub node_count: usize,
    pub surface_node_count: usize,
    pub surface_face_count: usize,
    /// Seconds.
    pub dt: f32,
    pub max_push_mm: f32,
    /// Whether frames show the tissue of their own moment; otherwise they run one step behind, and the body cannot be cut.
    pub presents: bool,
}

/// Before the numbers of a surface that has changed.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct SurfaceHeader {
    pub vertices: usize,
    /// Of triangles, empty ones included.
    pub slots: usize,
    pub first_vertex: usize,
    pub changed: usize,
    pub hardened: usize,
    /// Vertices and slots before are forgotten.
    pub is_new: bool,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_wish_is_read() {
        let tool = r#"{"tool":{"position":[1,2,3],"rotation":[0,0,0,1],"radius":5,"half_length":20,"friction":0.3},"sequence":7}"#;
        let Ok(Wish::Tool(Some(read), 7)) = Wish::parse(tool) else {
            panic!()
        };
        assert_eq!(read.position, [1.0, 2.0, 3.0]);
        assert_eq!(
            Wish::parse(r#"{"tool":null,"sequence":8}"#),
            Ok(Wish::Tool(None, 8))
        );
        assert_eq!(Wish::parse(r#"{"reset":true}"#), Ok(Wish::Reset));
        assert_eq!(Wish::parse(r#"{"undo":true}"#), Ok(Wish::Undo));
        assert_eq!(Wish::parse(r#"{"tear":1.5}"#), Ok(Wish::Tear(1.5)));
        assert_eq!(Wish::parse(r#"{"tear":0}"#), Ok(Wish::Tear(0.0)));
        assert!(Wish::parse(r#"{"tear":0.9}"#).is_err_and(|why| why.contains("0.9")));
        let breathe = Wish::parse(r#"{"breathe":true}"#);
        assert_eq!(breathe, Ok(Wish::Breathe(true)));
        let blade = tool.replace(r#""friction":0.3"#, r#""friction":0.3,"kind":"blade""#);
        let Ok(Wish::Tool(Some(read), _)) = Wish::parse(&blade) else {
            panic!()
        };
        assert_eq!(read.kind, Kind::Blade);
        assert_eq!(Wish::parse(r#"{"record":false}"#), Ok(Wish::Record(false)));
    }

    #[test]
    fn what_is_no_wish_is_refused() {
        let with = |field: &str, value: &str| {
            let mut fields = std::collections::BTreeMap::from([
                ("position", "[0,0,0]"),
                ("rotation", "[0,0,0,1]"),
                ("radius", "5"),
                ("half_length", "20"),
                ("friction", "0.3"),
            ]);
            fields.insert(field, value);
            let fields: Vec<String> = fields.iter().map(|(k, v)| format!("\"{k}\":{v}")).collect();
            format!("{{\"tool\":{{{}}}}}", fields.join(","))
        };
        let mut bad: Vec<String> = [
            "",
            "{}",
            "[]",
            "null",
            "{\"reset\":true,\"replay\":true}",
            "{\"reset\":1}",
        ]
        .map(String::from)
        .into();
        bad.extend([
            with("position", "[NaN,0,0]"),
            with("position", "[1e39,0,0]"),
            with("position", "[1e5,0,0]"),
            with("position", "[0,0]"),
            with("rotation", "[0,0,0,2]"),
            with("radius", "0"),
            with("radius", "-1"),
            with("friction", "-0.1"),
            with("friction", "3"),
            with("friction", "NaN"),
            with("friction", "null"),
            with("colour", "1"),
            with("kind", "\"saw\""),
        ]);
        for text in bad {
            assert!(Wish::parse(&text).is_err(), "{text}");
        }
        assert!(Wish::parse(&with("radius", "6")).is_ok());
        assert!(Wish::parse(&with("friction", "0")).is_ok());
    }
}
