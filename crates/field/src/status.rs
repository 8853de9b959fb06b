//! What a call returns: the status numbers of the C ABI, which every error of the library has (`Error::status`).

/// What a call returns: 0 is success, positive values are not errors, negative values are errors.
#[allow(non_camel_case_types)] // its name in C
pub type upt_status = i32;

/// Success.
pub const UPT_OK: upt_status = 0;
/// The submitted step has not finished.
pub const UPT_PENDING: upt_status = 1;
/// A required pointer is NULL.
pub const UPT_ERR_NULL: upt_status = -1;
/// A size, index, enum or range is wrong.
pub const UPT_ERR_ARGUMENT: upt_status = -2;
/// This library does not know this `struct_size`.
pub const UPT_ERR_STRUCT_SIZE: upt_status = -3;
/// Not a live handle of this type.
pub const UPT_ERR_HANDLE: upt_status = -4;
/// The scene is in use by another thread or has a step in flight.
pub const UPT_ERR_BUSY: upt_status = -5;
/// An input holds NaN or Inf.
pub const UPT_ERR_NON_FINITE: upt_status = -6;
/// The call does not fit the state (for instance: wait without submit).
pub const UPT_ERR_STATE: upt_status = -7;
/// This build or this bundle cannot do it.
pub const UPT_ERR_UNSUPPORTED: upt_status = -8;
/// There is not enough memory for the call.
pub const UPT_ERR_OUT_OF_MEMORY: upt_status = -9;
/// ONNX Runtime is missing, too old or broken; the message lists what was tried.
pub const UPT_ERR_RUNTIME: upt_status = -20;
/// No provider of the list can run the model.
pub const UPT_ERR_PROVIDER: upt_status = -21;
/// A file cannot be read.
pub const UPT_ERR_IO: upt_status = -30;
/// A bundle is invalid; the message names the file and the field.
pub const UPT_ERR_BUNDLE: upt_status = -31;
/// The version of a bundle or snapshot is not supported.
pub const UPT_ERR_VERSION: upt_status = -32;
/// A snapshot is damaged or belongs to another model.
pub const UPT_ERR_SNAPSHOT: upt_status = -33;
/// The guard refused the new state; the last good state stays.
pub const UPT_ERR_GUARD: upt_status = -40;
/// A bug in the library; the scene can only be destroyed.
pub const UPT_ERR_PANIC: upt_status = -90;
