//! All schemes as one table of specifications: what a scheme is called, what it is for, and the ranges that its cases span.
//! The motion itself, push factor and angles over time, is a function ([`super::Scheme::pose`]).

use std::f64::consts::PI;

use serde::Serialize;

use super::Scheme;
use super::random::Range;

/// What a scheme is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Group {
    /// The paper's four that models are trained and tested on.
    Trained,
    /// The paper's fifth, which models are only tested on.
    Withheld,
    /// Regimes beyond the paper's.
    Hard,
    /// For training only: many sites a case.
    Probe,
    /// For training only: lists of equilibria.
    Static,
}

/// A row of the table.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Specification {
    #[serde(skip)]
    pub scheme: Scheme,
    /// Name in files and on the command line.
    pub name: &'static str,
    pub group: Group,
    /// What it does, in one phrase.
    pub summary: &'static str,
    /// Where it comes from; the paper's section is [`PAPER_SECTION`].
    pub source: &'static str,
    /// Largest displacement, mm; a case draws it.
    pub magnitude_mm: Range,
    /// Area of a contact as a number of the paper's collision faces ([`crate::contact::FACE_AREA_MM2`] each); a case draws it.
    pub faces: Range,
    /// Angle from the inward normal over all times and draws, radians.
    pub tilt_rad: Range,
    /// Damping relative to the material's.
    pub damping: f64,
    /// Sites of a case, one after another.
    pub sites: usize,
    /// Contacts at the same time.
    pub instruments: usize,
    /// Equilibria at a site, equally spaced in depth; 0 for a motion.
    pub depths: usize,
}

/// The paper's section that describes its schemes: the third in full, of the others the bounds 10 to 15 mm and 25 to 100 faces.
pub const PAPER_SECTION: &str = "Transient deformation and simulation schemes";

/// What most rows share.
const PLAIN: Specification = Specification {
    scheme: Scheme::One,
    name: "",
    group: Group::Hard,
    summary: "",
    source: "libupt",
    magnitude_mm: [10.0, 15.0],
    faces: [25.0, 75.0],
    tilt_rad: [0.0, 0.0],
    damping: 1.0,
    sites: 1,
    instruments: 1,
    depths: 0,
};

const NUMBERED: Specification = Specification {
    group: Group::Trained,
    source: "after the paper",
    ..PLAIN
};

const STATIC: Specification = Specification {
    group: Group::Static,
    magnitude_mm: [8.0, 16.0],
    faces: [25.0, 100.0],
    tilt_rad: [0.0, PI / 4.0],
    sites: 8,
    depths: 4,
    ..PLAIN
};

/// All schemes, in the order of [`Scheme`].
pub const TABLE: [Specification; 14] = [
    Specification {
        name: "1",
        scheme: Scheme::One,
        summary: "straight push in 2.5 s, hold, slow release from 4.5 to 7.5 s",
        magnitude_mm: [12.0; 2],
        faces: [50.0; 2],
        ..NUMBERED
    },
    Specification {
        name: "2",
        scheme: Scheme::Two,
        summary: "three presses of growing depth, tilt swinging to and fro while it turns",
        magnitude_mm: [10.0; 2],
        faces: [25.0; 2],
        tilt_rad: [0.0, PI / 6.0],
        ..NUMBERED
    },
    Specification {
        name: "3",
        scheme: Scheme::Three,
        summary: "one full turn over the push, lifted abruptly at 6.5 s",
        source: "the paper",
        magnitude_mm: [13.0; 2],
        faces: [60.0; 2],
        tilt_rad: [PI / 8.0; 2],
        ..NUMBERED
    },
    Specification {
        name: "4",
        scheme: Scheme::Four,
        summary: "quick push, then the direction slides from one side to the other while held, retreat in two stages",
        magnitude_mm: [15.0; 2],
        faces: [100.0; 2],
        tilt_rad: [-PI / 5.0, PI / 5.0],
        ..NUMBERED
    },
    Specification {
        name: "5",
        scheme: Scheme::Five,
        group: Group::Withheld,
        summary: "pulsating push, growing tilt, turning to and fro, lifted at 5.5 s",
        magnitude_mm: [12.5; 2],
        faces: [75.0; 2],
        tilt_rad: [0.0, PI / 7.0],
        ..NUMBERED
    },
    Specification {
        name: "hard-deep",
        scheme: Scheme::HardDeep,
        summary: "slow deep push",
        magnitude_mm: [20.0, 40.0],
        // Deep pushes on few faces would only tear the mesh.
        faces: [60.0, 100.0],
        tilt_rad: [PI / 12.0; 2],
        ..PLAIN
    },
    Specification {
        name: "hard-fast",
        scheme: Scheme::HardFast,
        summary: "full depth in one or two frames, held 1.6 s, lifted, again",
        tilt_rad: [PI / 10.0; 2],
        ..PLAIN
    },
    Specification {
        name: "hard-two",
        scheme: Scheme::HardTwo,
        summary: "two instruments at once",
        tilt_rad: [0.0, PI / 8.0],
        instruments: 2,
        ..PLAIN
    },
    Specification {
        name: "hard-slide",
        scheme: Scheme::HardSlide,
        summary: "the contact walks 25 mm along the surface",
        magnitude_mm: [8.0, 12.0],
        ..PLAIN
    },
    Specification {
        name: "hard-ring",
        scheme: Scheme::HardRing,
        summary: "scheme 3 with a tenth of the damping",
        magnitude_mm: [13.0; 2],
        faces: [60.0; 2],
        tilt_rad: [PI / 8.0; 2],
        damping: 0.1,
        ..PLAIN
    },
    Specification {
        name: "probe",
        scheme: Scheme::Probe,
        group: Group::Probe,
        summary: "five sites in a row, 1.6 s each: pushed within 0.6 s, tilted, lifted abruptly at 0.8 s",
        magnitude_mm: [8.0, 15.0],
        faces: [25.0, 100.0],
        tilt_rad: [0.0, PI / 4.0],
        sites: 5,
        ..PLAIN
    },
    Specification {
        name: "static",
        scheme: Scheme::Static,
        summary: "equilibria, no motion: every depth tilted its own way",
        ..STATIC
    },
    Specification {
        name: "static-two",
        scheme: Scheme::StaticTwo,
        summary: "equilibria with two instruments at once",
        magnitude_mm: [5.0, 16.0],
        instruments: 2,
        ..STATIC
    },
    Specification {
        name: "static-deep",
        scheme: Scheme::StaticDeep,
        summary: "equilibria of deep pushes",
        magnitude_mm: [20.0, 40.0],
        faces: [50.0, 100.0],
        tilt_rad: [0.0, PI / 6.0],
        ..STATIC
    },
];

/// Each scheme finds its row by its place: a row that is missing or out of order stops the compiler.
const _: () = {
    let mut row = 0;
    while row < TABLE.len() {
        assert!(
            TABLE[row].scheme as usize == row,
            "rows are in the order of `Scheme`"
        );
        row += 1;
    }
    assert!(TABLE.len() == Scheme::COUNT);
};
