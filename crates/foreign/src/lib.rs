//! What libraries of Python do for the command `upt`, in an environment that is made once for a user.
//!
//! [`labels::convert`] turns a label volume of a scan (NIfTI, NRRD, MetaImage) into a surface; [`python`] is the interpreter with the
//! packages that it takes, and the folder in which the command keeps what it fetched.

pub mod labels;
pub mod python;
