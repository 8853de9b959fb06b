//! Random sequences of calls of the C ABI: wrong sizes, NULLs, closed and invented handles, values that are no numbers.
//!
//! After each call: the status is one that `include/upt.h` documents for the function, a failed call has written
//! nothing and left the scene's state to the bit, and what was handed out is finite. At the end all handles close.

mod abi;
mod explore;

use proptest::collection::vec;

/// Verifies REQ-010.
#[test]
fn any_sequence_of_calls_is_answered_as_documented() {
    fixture::find_runtime();
    let documented = abi::documented();
    let budget = explore::Budget {
        share: 1.0,
        round: 20,
        least_rounds: 3,
    };
    let sequence = vec(abi::call(), 1..60);
    explore::explore("sequences of calls", budget, &sequence, |calls| {
        let mut world = abi::World::new(&documented);
        for call in &calls {
            world.make(call);
        }
        world.end();
    });
}

/// A function that is new in the header is called here, or this fails.
#[test]
fn every_function_of_the_header_is_called() {
    let called: std::collections::HashSet<String> = abi::CALLED_BY
        .iter()
        .map(|(name, _)| (*name).to_owned())
        .collect();
    assert_eq!(called, abi::declared());
}
