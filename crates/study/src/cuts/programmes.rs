//! Programmes of cuts: what is done to the body before each frame, and where a ball is at its end.
//!
//! A case is a flat place of the domain, drawn from a seed. Places are millimetres from it: ahead along the surface, aside, and above the tissue.

use contact::Vector;

use super::site::Site;

/// Of the ball that presses and holds, mm.
pub const BALL_MM: f32 = 3.0;

/// What is done to the body.
#[derive(Clone, Copy, Debug)]
pub enum Operation {
    /// A straight edge goes from one place to the next.
    Blade {
        stroke: u32,
        edges: [[[f32; 3]; 2]; 2],
    },
    /// A ball takes what is inside of it, up to a volume.
    Aspirate {
        at: [f32; 3],
        radius: f32,
        most_mm3: f32,
    },
    /// Elements whose middle is inside of a ball.
    Stiffen {
        at: [f32; 3],
        radius: f32,
        factor: f32,
    },
    /// Pieces that nothing holds leave.
    Drop,
}

/// A frame of 50 ms.
#[derive(Clone, Debug, Default)]
pub struct Frame {
    pub operations: Vec<Operation>,
    /// Middle of the ball at its end; none: above the place, away from the tissue.
    pub ball: Option<[f32; 3]>,
    pub grasp: bool,
}

/// A row of the table.
pub struct Programme {
    pub name: &'static str,
    pub frames: fn(&Site) -> Vec<Frame>,
    /// What is done at another place of the same body before.
    pub elsewhere: Option<fn(&Site) -> Vec<Frame>>,
    /// Whether blades feel the tissue. What pushes a piece that they have cut free throws it away, by metres in the reference solver.
    pub feels: bool,
    /// It takes minutes, and is measured where it is asked for by name.
    pub is_long: bool,
}

pub const PROGRAMMES: [Programme; 10] = [
    Programme {
        name: "incise",
        frames: incise,
        elsewhere: None,
        feels: true,
        is_long: false,
    },
    Programme {
        name: "again",
        frames: again,
        elsewhere: Some(|site| slit(site, 1)),
        feels: true,
        is_long: false,
    },
    Programme {
        name: "flap",
        frames: flap,
        elsewhere: None,
        feels: true,
        is_long: false,
    },
    Programme {
        name: "resect",
        frames: resect,
        elsewhere: None,
        feels: true,
        is_long: false,
    },
    Programme {
        name: "biopsy",
        frames: biopsy,
        elsewhere: None,
        feels: false,
        is_long: false,
    },
    Programme {
        name: "divide",
        frames: divide,
        elsewhere: None,
        feels: false,
        is_long: false,
    },
    Programme {
        name: "wall",
        frames: wall,
        elsewhere: None,
        feels: false,
        is_long: false,
    },
    Programme {
        name: "part",
        frames: part,
        elsewhere: None,
        feels: true,
        is_long: false,
    },
    Programme {
        name: "coagulate",
        frames: coagulate,
        elsewhere: None,
        feels: true,
        is_long: false,
    },
    Programme {
        name: "aspirate",
        frames: aspirate,
        elsewhere: None,
        feels: false,
        is_long: true,
    },
];

fn cut(stroke: u32, from: [[f32; 3]; 2], to: [[f32; 3]; 2]) -> Frame {
    Frame {
        operations: vec![Operation::Blade {
            stroke,
            edges: [from, to],
        }],
        ..Frame::default()
    }
}

/// The ball goes from place to place in so many frames.
fn go(frames: &mut Vec<Frame>, grasp: bool, count: usize, from: [f32; 3], to: [f32; 3]) {
    let (from, to) = (Vector::from(from), Vector::from(to));
    frames.extend((1..=count).map(|at| {
        let part = at as f32 / count as f32;
        Frame {
            ball: Some((from + (to - from) * part).to_array()),
            grasp,
            ..Frame::default()
        }
    }));
}

/// The ball comes to a place from farther above it, slowly: where the tissue bulges it has not leapt into it.
fn come(frames: &mut Vec<Frame>, site: &Site, over: [f32; 3]) {
    let high = Vector::from(over) + site.normal * 8.0;
    go(frames, false, 6, high.to_array(), over);
}

/// What has been cut free comes to rest; then the ball presses it 1.5 mm deep, grasps it and lifts it by 4.5 mm. What a grasp catches of tissue that swings by
/// millimetres is a matter of chance, in the reference solver as well.
fn lift(frames: &mut Vec<Frame>, site: &Site, aside: f32) {
    let [over, on, up] = [5.0, -1.5, 3.0].map(|above| site.place(0.0, aside, BALL_MM + above));
    go(frames, false, 10, over, over);
    go(frames, false, 4, over, on);
    go(frames, true, 1, on, on);
    go(frames, true, 8, on, up);
    go(frames, true, 8, up, up);
}

/// 24 mm long, 8 mm deep, in pieces of 2 mm.
fn slit(site: &Site, stroke: u32) -> Vec<Frame> {
    let edge = |piece: i32| site.upright(2.0 * piece as f32 - 12.0, 0.0, 8.0);
    let pieces = (0..12).map(|piece| cut(stroke, edge(piece), edge(piece + 1)));
    pieces.collect()
}

/// Beside a ball that presses 4 mm deep, 7 mm from it, a slit is cut.
fn again(site: &Site) -> Vec<Frame> {
    let mut frames = Vec::new();
    let (over, deep) = (
        site.place(0.0, 7.0, 5.0),
        site.place(0.0, 7.0, BALL_MM - 4.0),
    );
    come(&mut frames, site, over);
    go(&mut frames, false, 4, over, deep);
    go(&mut frames, false, 6, deep, deep);
    frames.extend(slit(site, 0).into_iter().map(|frame| Frame {
        ball: Some(deep),
        ..frame
    }));
    go(&mut frames, false, 6, deep, deep);
    frames
}

/// A slit; then a ball presses one lip 4 mm deep and 3 mm aside.
fn incise(site: &Site) -> Vec<Frame> {
    let mut frames = slit(site, 0);
    let (over, deep) = (
        site.place(0.0, 4.5, 5.0),
        site.place(0.0, 4.5, BALL_MM - 4.0),
    );
    let aside = site.place(0.0, 7.5, BALL_MM - 4.0);
    come(&mut frames, site, over);
    go(&mut frames, false, 4, over, deep);
    go(&mut frames, false, 3, deep, aside);
    go(&mut frames, false, 8, aside, aside);
    frames
}

/// A flap of 20 x 12 mm, 5 mm thick, hangs by one side; a grasp lifts its free edge.
fn flap(site: &Site) -> Vec<Frame> {
    let mut frames = vec![
        cut(
            0,
            site.upright(-10.0, 0.0, 7.0),
            site.upright(10.0, 0.0, 7.0),
        ),
        cut(
            1,
            site.upright(-10.0, -1.0, 7.0),
            site.upright(-10.0, 12.0, 7.0),
        ),
        cut(
            2,
            site.upright(10.0, -1.0, 7.0),
            site.upright(10.0, 12.0, 7.0),
        ),
    ];
    let under = |aside: f32| {
        [
            site.place(-11.0, aside, -5.0),
            site.place(11.0, aside, -5.0),
        ]
    };
    frames.push(cut(3, under(-1.0), under(12.0)));
    lift(&mut frames, site, 4.0);
    frames
}

/// A ball of 6 mm takes 100 mm³ a frame, 20 times, on a way of 10 mm; then a ball presses the floor of the cavity.
fn resect(site: &Site) -> Vec<Frame> {
    let mut frames: Vec<Frame> = (0..20)
        .map(|at| Frame {
            operations: vec![Operation::Aspirate {
                at: site.place(0.5 * at as f32 - 5.0, 0.0, -3.0),
                radius: 6.0,
                most_mm3: 100.0,
            }],
            ..Frame::default()
        })
        .collect();
    frames.push(Frame {
        operations: vec![Operation::Drop],
        ..Frame::default()
    });
    let (over, deep) = (
        site.place(0.0, 0.0, 4.0),
        site.place(0.0, 0.0, -9.0 + BALL_MM - 3.0),
    );
    come(&mut frames, site, over);
    go(&mut frames, false, 8, over, deep);
    go(&mut frames, false, 8, deep, deep);
    frames
}

/// A ball presses 3 mm deep, 12 mm aside, while an aspirator of 6 mm takes 5 cm³ in a minute, to and fro over 20 mm and ever deeper: no node may leap.
fn aspirate(site: &Site) -> Vec<Frame> {
    const FRAMES: usize = 1200;
    let (over, deep) = (
        site.place(0.0, 12.0, 5.0),
        site.place(0.0, 12.0, BALL_MM - 3.0),
    );
    let mut frames = Vec::new();
    come(&mut frames, site, over);
    go(&mut frames, false, 8, over, deep);
    frames.extend((0..FRAMES).map(|at| {
        let part = at as f32 / FRAMES as f32;
        let ahead = 10.0 * (std::f32::consts::TAU * 6.0 * part).sin();
        Frame {
            operations: vec![Operation::Aspirate {
                at: site.place(ahead, 0.0, 3.0 - 12.0 * part),
                radius: 6.0,
                most_mm3: 5000.0 / FRAMES as f32,
            }],
            ball: Some(deep),
            grasp: false,
        }
    }));
    frames
}

/// A plug of 10 mm across is cut free 9 mm deep but for its base; a grasp pulls it.
fn biopsy(site: &Site) -> Vec<Frame> {
    let edge = |piece: i32| {
        let (sin, cos) = (std::f32::consts::TAU * piece as f32 / 24.0).sin_cos();
        site.upright(5.0 * cos, 5.0 * sin, 9.0)
    };
    let piece = |at: i32| Operation::Blade {
        stroke: 0,
        edges: [edge(at), edge(at + 1)],
    };
    let mut frames: Vec<Frame> = (0..12)
        .map(|at| Frame {
            operations: vec![piece(2 * at), piece(2 * at + 1)],
            ..Frame::default()
        })
        .collect();
    lift(&mut frames, site, 0.0);
    frames
}

/// A wedge of 40 x 24 mm, 12 mm deep, is cut out and leaves.
fn wedge(site: &Site) -> Vec<Frame> {
    // Two planes at 45 degrees that cross below, and two upright ones across their ends.
    let slant = |from: f32, to: f32, part: f32| {
        let aside = from + (to - from) * part;
        [-24.0, 24.0].map(|ahead| site.place(ahead, aside, 4.0 - 20.0 * part))
    };
    let end = |ahead: f32, part: f32| site.upright(ahead, 32.0 * part - 4.0, 16.0);
    let mut frames = Vec::new();
    for at in 0..4 {
        let parts = [0.25 * at as f32, 0.25 * at as f32 + 0.25];
        let [from, to] = parts.map(|part| slant(-4.0, 16.0, part));
        frames.push(cut(0, from, to));
        let [from, to] = parts.map(|part| slant(28.0, 8.0, part));
        frames.push(cut(1, from, to));
    }
    for (stroke, ahead) in [(2, -20.0), (3, 20.0)] {
        frames.push(cut(stroke, end(ahead, 0.0), end(ahead, 0.5)));
        frames.push(cut(stroke, end(ahead, 0.5), end(ahead, 1.0)));
    }
    frames.push(Frame {
        operations: vec![Operation::Drop],
        ..Frame::default()
    });
    frames
}

/// A ball presses what stays 3 mm deep, beside the edge of the wedge.
fn divide(site: &Site) -> Vec<Frame> {
    let mut frames = wedge(site);
    let (over, deep) = (
        site.place(0.0, -6.0, 5.0),
        site.place(0.0, -6.0, BALL_MM - 3.0),
    );
    come(&mut frames, site, over);
    go(&mut frames, false, 6, over, deep);
    go(&mut frames, false, 8, deep, deep);
    frames
}

/// A ball presses the middle of the wall that the wedge leaves 3 mm deep, and goes 3 mm along it.
fn wall(site: &Site) -> Vec<Frame> {
    let mut frames = wedge(site);
    // The wall goes down at 45 degrees from the place.
    let off = |ahead: f32, above: f32| {
        let part = (above + BALL_MM) * std::f32::consts::FRAC_1_SQRT_2;
        site.place(ahead, 5.0 + part, part - 5.0)
    };
    let (over, deep, along) = (off(0.0, 1.5), off(0.0, -3.0), off(3.0, -3.0));
    go(&mut frames, false, 6, site.place(0.0, 9.0, 20.0), over);
    go(&mut frames, false, 6, over, deep);
    go(&mut frames, false, 4, deep, along);
    go(&mut frames, false, 6, along, along);
    frames
}

/// A slit; then a ball goes into it from above, 5 mm deep, and pushes one of its walls 3 mm aside.
fn part(site: &Site) -> Vec<Frame> {
    let mut frames = slit(site, 0);
    let (over, deep) = (
        site.place(0.0, 0.0, 5.0),
        site.place(0.0, 0.0, BALL_MM - 5.0),
    );
    let aside = site.place(0.0, 3.0, BALL_MM - 5.0);
    come(&mut frames, site, over);
    go(&mut frames, false, 8, over, deep);
    go(&mut frames, false, 4, deep, aside);
    go(&mut frames, false, 8, aside, aside);
    frames
}

/// Tissue within 10 mm becomes four times as stiff while a ball presses it 4 mm deep.
fn coagulate(site: &Site) -> Vec<Frame> {
    let (over, deep) = (
        site.place(0.0, 0.0, 5.0),
        site.place(0.0, 0.0, BALL_MM - 4.0),
    );
    let mut frames = Vec::new();
    come(&mut frames, site, over);
    go(&mut frames, false, 4, over, deep);
    go(&mut frames, false, 6, deep, deep);
    frames[12].operations.push(Operation::Stiffen {
        at: site.place(0.0, 0.0, -4.0),
        radius: 10.0,
        factor: 4.0,
    });
    go(&mut frames, false, 8, deep, deep);
    frames
}
