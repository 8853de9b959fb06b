//! Rigid tools in the reference solver: forces, friction, energy, grasping, refusals, and the same bits for any
//! number of threads. Hertz's law and the other tables of docs/reference/solver.md are in `examples/tool_tables.rs`.

mod bench;
mod calculix;
mod failures;
mod forces;
mod grasp;
mod programmes;
