//! Which provider runs each node of a session's graph: a GPU provider may leave nodes to the CPU without a word.

use std::collections::BTreeMap;
use std::ffi::CStr;

use ort::AsPointer;
use ort::session::Session;

/// The option that makes a session remember where its nodes went.
pub(super) const RECORD: &str = "session.record_ep_graph_assignment_info";

/// Nodes of the optimised graph by provider (`CPUExecutionProvider`, ...); empty where the library does not tell.
pub(super) fn nodes_by_provider(session: &Session) -> BTreeMap<String, usize> {
    let api = ort::api();
    let mut counts = BTreeMap::new();
    let (mut parts, mut count) = (std::ptr::null(), 0);
    let session = session.inner();
    // SAFETY: the session is alive; the arrays belong to it and are read while it is; every status is released.
    unsafe {
        let status = (api.Session_GetEpGraphAssignmentInfo)(
            AsPointer::ptr(&*session),
            &mut parts,
            &mut count,
        );
        if !done(status) || parts.is_null() {
            return counts;
        }
        for &part in std::slice::from_raw_parts(parts, count) {
            let (mut name, mut nodes, mut size) = (std::ptr::null(), std::ptr::null(), 0);
            if done((api.EpAssignedSubgraph_GetEpName)(part, &mut name))
                && !name.is_null()
                && done((api.EpAssignedSubgraph_GetNodes)(
                    part, &mut nodes, &mut size,
                ))
            {
                let name = CStr::from_ptr(name).to_string_lossy().into_owned();
                *counts.entry(name).or_default() += size;
            }
        }
    }
    counts
}

/// Whether a call succeeded; releases the status of one that did not.
///
/// # Safety
/// `status` comes from a call of the API just made.
unsafe fn done(status: ort::sys::OrtStatusPtr) -> bool {
    if status.0.is_null() {
        return true;
    }
    // SAFETY: as above; a status that is not null is released once.
    unsafe { (ort::api().ReleaseStatus)(status.0) };
    false
}
