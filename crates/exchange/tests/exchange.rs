//! What the reader sees is whole, never goes back, and in the end is the last.
//!
//! With `--cfg loom` each test runs once for every order that the memory model allows, and loom looks at each access to a buffer.

use exchange::exchange;
#[cfg(loom)]
use loom::{model, thread};
#[cfg(not(loom))]
use std::thread;

#[cfg(not(loom))]
fn model(run: impl Fn() + Sync + Send + 'static) {
    run();
}

/// How often a thread publishes: every order of more than a few cannot be tried, and Miri is slow.
const COUNT: u32 = if cfg!(loom) {
    3
} else if cfg!(miri) {
    30
} else {
    200_000
};

#[test]
fn nothing_is_seen_before_it_is_published() {
    model(|| {
        let (mut writer, mut reader) = exchange([7; 3]);
        assert!(!reader.update());
        assert_eq!(*reader.buffer(), 7);
        writer.write(8);
        assert!(reader.update());
        assert_eq!(*reader.buffer(), 8);
        assert!(!reader.update());
        assert_eq!(*reader.buffer(), 8);
    });
}

#[test]
fn what_is_seen_is_whole_and_never_goes_back() {
    model(|| {
        let (mut writer, mut reader) = exchange([[0_u32; 2]; 3]);
        let writing = thread::spawn(move || {
            for number in 1..=COUNT {
                let buffer = writer.buffer();
                buffer[0] = number;
                buffer[1] = number;
                writer.publish();
            }
        });
        let mut last = 0;
        for _ in 0..COUNT {
            let new = reader.update();
            let [a, b] = *reader.buffer();
            assert_eq!(a, b, "torn");
            assert!(if new { a > last } else { a == last }, "{a} after {last}");
            last = a;
        }
        writing.join().unwrap();
        assert_eq!(reader.read()[0], COUNT);
    });
}

#[test]
fn either_end_may_go_first() {
    model(|| {
        let (mut writer, mut reader) = exchange([0, 0, 0].map(Box::new));
        let reading = thread::spawn(move || **reader.read());
        writer.write(Box::new(1));
        drop(writer);
        assert!(reading.join().unwrap() <= 1);
    });
}

#[test]
fn two_exchanges_between_the_same_threads() {
    model(|| {
        // As a hand and its scene: poses one way, steps the other.
        let (mut pose, mut seen) = exchange([0_u32; 3]);
        let (mut step, mut felt) = exchange([0_u32; 3]);
        let scene = thread::spawn(move || {
            for _ in 0..COUNT.min(2) {
                let at = *seen.read();
                step.write(at);
            }
        });
        for number in 1..=COUNT.min(2) {
            pose.write(number);
            assert!(*felt.read() <= number);
        }
        scene.join().unwrap();
        assert!(*felt.read() <= COUNT);
    });
}
