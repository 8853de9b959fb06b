//! Which provider runs each node of a session's graph: a GPU provider may leave nodes to the CPU without a word.

use std::collections::BTreeMap;
use std::ffi::CStr;

use ort::AsPointer;
use ort::session::Session;

use super::status;

/// The option that makes a session remember where its nodes went.
pub(super) const RECORD: &str = "session.record_ep_graph_assignment_info";

/// Nodes of the optimised graph by provider (`CPUExecutionProvider`, ...); empty where the library does not say.
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
        if status::check(status).is_err() || parts.is_null() {
            return counts;
        }
        for &part in std::slice::from_raw_parts(parts, count) {
            let (mut name, mut nodes, mut size) = (std::ptr::null(), std::ptr::null(), 0);
            if status::check((api.EpAssignedSubgraph_GetEpName)(part, &mut name)).is_ok()
                && !name.is_null()
                && status::check((api.EpAssignedSubgraph_GetNodes)(
                    part, &mut nodes, &mut size,
                ))
                .is_ok()
            {
                let name = CStr::from_ptr(name).to_string_lossy().into_owned();
                *counts.entry(name).or_default() += size;
            }
        }
    }
    counts
}
