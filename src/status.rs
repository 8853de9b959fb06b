//! What a call returns: the status numbers of the C ABI, which every error of the library has (`Error::status`).

/// What a call returns: 0 is success, positive values are not errors, negative values are errors.
#[allow(non_camel_case_types)] // its name in C
pub type upt_status = i32;

/// Success.
pub const UPT_OK: i32 = 0;
/// The submitted step has not finished.
pub const UPT_PENDING: i32 = 1;
/// A required pointer is NULL.
pub const UPT_ERR_NULL: i32 = -1;
/// A size, index, enum or range is wrong.
pub const UPT_ERR_ARGUMENT: i32 = -2;
/// This library does not know this `struct_size`.
pub const UPT_ERR_STRUCT_SIZE: i32 = -3;
/// Not a live handle of this type.
pub const UPT_ERR_HANDLE: i32 = -4;
/// The scene is in use by another thread or has a step in flight.
pub const UPT_ERR_BUSY: i32 = -5;
/// An input holds NaN or Inf.
pub const UPT_ERR_NON_FINITE: i32 = -6;
/// The call does not fit the state (for instance: wait without submit).
pub const UPT_ERR_STATE: i32 = -7;
/// This build or this bundle cannot do it.
pub const UPT_ERR_UNSUPPORTED: i32 = -8;
/// There is not enough memory for the call.
pub const UPT_ERR_OUT_OF_MEMORY: i32 = -9;
/// ONNX Runtime is missing, too old or broken; the message lists what was tried.
pub const UPT_ERR_RUNTIME: i32 = -20;
/// No provider of the list can run the model.
pub const UPT_ERR_PROVIDER: i32 = -21;
/// A file cannot be read.
pub const UPT_ERR_IO: i32 = -30;
/// A bundle is invalid; the message names the file and the field.
pub const UPT_ERR_BUNDLE: i32 = -31;
/// The version of a bundle or snapshot is not supported.
pub const UPT_ERR_VERSION: i32 = -32;
/// A snapshot is damaged or belongs to another model.
pub const UPT_ERR_SNAPSHOT: i32 = -33;
/// The guard refused the new state; the last good state stays.
pub const UPT_ERR_GUARD: i32 = -40;
/// A bug in the library; the scene can only be destroyed.
pub const UPT_ERR_PANIC: i32 = -90;
