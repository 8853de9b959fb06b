//! The linear-elastic response `L(c)` of the held mesh to prescribed contact displacements
//! (`prior.safetensors` of `docs/reference/formats.md`), shared by both bundle kinds.
//!
//! Contact forces `f = A_CC^-1 c` from the compliance `A` between contact degrees of freedom, then the field in
//! block coordinates `q = sum_i f_i response[i]`, `u_k = U_k q_k`. With `vibration.safetensors` the response swings on
//! when the contact is gone.

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
