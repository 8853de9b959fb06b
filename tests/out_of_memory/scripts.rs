//! Which calls a host makes, one after another.

use upt::ffi::UPT_MODE_GRASP;

use crate::calls::{Call, Rig};

const OPEN: Call = ("upt_model_create", Rig::open);
const CREATE: Call = ("upt_scene_create", Rig::create);

/// All of them, of a scene that corrects.
pub const CORRECTED: &[Call] = &[
    OPEN,
    CREATE,
    ("a first step with two tools", |rig| rig.drive(0.5)),
    ("readings", Rig::readings),
    ("a first frame", |rig| rig.present(0.01)),
    ("a second step", |rig| rig.drive(1.5)),
    ("a frame in which a step arrives", |rig| rig.present(0.005)),
    ("upt_scene_attach_points", Rig::attach),
    ("a frame of points", Rig::present_points),
    ("upt_haptics_create", Rig::feel),
    ("a step that a hand feels", |rig| rig.drive(2.5)),
    ("upt_haptics_render", Rig::render),
    ("a frame of another step", |rig| rig.present(0.005)),
    ("upt_scene_set_region", Rig::region),
    ("a frame of a region", |rig| rig.present(0.01)),
    ("upt_scene_decode", Rig::decode),
    ("a grasp", |rig| {
        rig.tools[1].mode = UPT_MODE_GRASP;
        rig.drive(2.5)
    }),
    ("a submitted step", |rig| rig.submit(2.0)),
    ("upt_scene_save", Rig::save),
    ("a step after a snapshot", |rig| rig.drive(1.0)),
    ("upt_scene_restore", Rig::restore),
    ("a frame after a restored state", |rig| rig.present(0.01)),
    ("a step after a restored state", |rig| rig.drive(1.0)),
    ("upt_scene_read_contact_force", Rig::contact_force),
    ("a free step", Rig::free),
    ("upt_scene_reset", Rig::reset),
    ("upt_scene_contacts_from_instruments", |rig| {
        rig.contacts(2.0)
    }),
    ("a step of nodes", |rig| rig.push(-0.5)),
    ("a frame of nodes", Rig::present_contacts),
    ("the forces of nodes", Rig::contact_force),
    ("a submitted step of nodes", Rig::submit_nodes),
    ("a last free step", Rig::free),
];

/// Those of a scene whose body is cut.
pub const CUT: &[Call] = &[
    OPEN,
    CREATE,
    ("a first step with two tools", |rig| rig.drive(0.5)),
    ("upt_scene_update_surface", Rig::surface),
    ("upt_scene_record", Rig::record),
    ("upt_scene_cut", Rig::cut),
    ("the surface of a cut", Rig::surface),
    ("a step of a cut body", |rig| rig.drive(1.5)),
    ("upt_scene_save of a cut body", Rig::save),
    ("upt_scene_remove", Rig::remove),
    ("upt_scene_tear", Rig::tear),
    ("upt_scene_scale_stiffness", Rig::stiffen),
    ("upt_scene_restore of a cut body", Rig::restore),
    ("upt_scene_reset of a cut body", Rig::reset),
    ("a recorded step", |rig| rig.drive(0.5)),
    ("the end of a recording", Rig::record),
    ("upt_scene_take_record", Rig::take_record),
    ("a step after a reset", |rig| rig.drive(1.0)),
];

/// Those of a scene whose bundle has support groups.
pub const GROUPS: &[Call] = &[
    OPEN,
    CREATE,
    ("a first step with two tools", |rig| rig.drive(0.5)),
    ("upt_haptics_create", Rig::feel),
    ("a step that leads a group", |rig| rig.lead(0.2, false, 0.0)),
    ("a frame with a group", |rig| rig.lead(0.3, false, 0.02)),
    ("a step that lets a group go", |rig| {
        rig.lead(0.0, true, 0.0)
    }),
    ("a step that holds it again", |rig| {
        rig.lead(0.0, false, 0.0)
    }),
    ("upt_scene_save of groups", Rig::save),
    ("a frame with a group held again", |rig| {
        rig.lead(0.1, false, 0.02)
    }),
    ("upt_scene_restore of groups", Rig::restore),
    ("a step after that", |rig| rig.lead(0.2, false, 0.0)),
];

/// Those of a scene that does not.
pub const PLAIN: &[Call] = &[
    OPEN,
    CREATE,
    ("a first step of nodes", |rig| rig.push(-0.5)),
    ("upt_scene_read_contact_force", Rig::contact_force),
    ("upt_scene_attach_points", Rig::attach),
    ("upt_scene_set_region", Rig::region),
    ("a step of a region", |rig| rig.push(-1.0)),
    ("upt_scene_decode", Rig::decode),
    ("the forces in a region", Rig::contact_force),
    ("upt_scene_save", Rig::save),
    ("a free step", Rig::free),
    ("upt_scene_restore", Rig::restore),
    ("upt_scene_contacts_from_instruments", |rig| {
        rig.contacts(2.0)
    }),
    ("a submitted step of nodes", Rig::submit_nodes),
];

/// More of a scene whose bundle has a linear response.
pub const DRIVEN: &[Call] = &[
    OPEN,
    CREATE,
    ("a first step with two tools", |rig| rig.drive(0.5)),
    ("readings", Rig::readings),
    ("a second step", |rig| rig.drive(1.5)),
    ("upt_scene_save", Rig::save),
    ("a step after a snapshot", |rig| rig.drive(1.0)),
    ("upt_scene_restore", Rig::restore),
    ("a step after a restored state", |rig| rig.drive(1.0)),
];
