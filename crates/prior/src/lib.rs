//! The linear-elastic response `L(c)` of the held mesh to prescribed contact displacements
//! (`prior.safetensors` of `docs/reference/formats.md`), shared by both bundle kinds.
//!
//! Contact forces `f = A_CC^-1 c` from the compliance `A` between contact degrees of freedom, then the field in
//! block coordinates `q = sum_i f_i response[i]`, `u_k = U_k q_k`. With `vibration.safetensors` the response swings on
//! when the contact is gone.
//!
//! With `A = K^-1` at the contact degrees of freedom, `f = A_CC^-1 c` are the forces that hold the
//! contact nodes where the collision field puts them, and `A f` is the displacement of all nodes
//! under those forces alone. `A f` is stored by blocks of neighbouring nodes, each with an
//! orthonormal basis `U_k` of the fields that occur there; `q` are the coordinates in it. A step so
//! reads a few rows of tables instead of solving with the stiffness of the whole mesh. Tables are
//! made by `upt make` and never change while a model is open; scenes share them.

mod compliance;
mod lost;
mod numbers;
mod reaction;
mod release;
mod response;
mod response_table;
mod space;
mod stepped;
mod table;
mod vibration;

// `derive(HeldBytes)` looks for it here.
use field::memory;
pub use lost::{Lost, LostElements};
pub use numbers::Numbers;
pub use response::{ContactResponse, SolveReport};
pub use response_table::Response;
pub use space::CoarseSpace;
pub use table::PriorTable;
pub use vibration::{FreeVibration, propagator};
