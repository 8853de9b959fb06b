//! Who hears how far long work is: a terminal's bars, a server's log, or nobody.

use std::fmt;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

/// Hears of long work, from any thread.
pub trait Listener: Send + Sync {
    /// Work of `count` parts begins; none: nobody knows of how many. It ends when the counter is dropped.
    fn start(&self, what: &str, count: Option<u64>) -> Box<dyn Counter>;

    /// A line about what was found or decided.
    fn tell(&self, line: &str);
}

/// Hears how many parts are done.
pub trait Counter: Send + Sync {
    fn set(&self, done: u64);
}

/// Hands on to a listener; by default to nobody.
#[derive(Clone, Default)]
pub struct Watch(Option<Arc<dyn Listener>>);

impl fmt::Debug for Watch {
    fn fmt(&self, to: &mut fmt::Formatter<'_>) -> fmt::Result {
        to.write_str(if self.0.is_some() { "told" } else { "silent" })
    }
}

impl Watch {
    pub fn new(listener: impl Listener + 'static) -> Self {
        Self(Some(Arc::new(listener)))
    }

    /// Begins work of `count` parts.
    pub fn bar(&self, count: u64, what: &str) -> Bar {
        self.begin(what, Some(count))
    }

    /// Begins work of which nobody knows how many parts it has.
    pub fn spinner(&self, what: &str) -> Bar {
        self.begin(what, None)
    }

    fn begin(&self, what: &str, count: Option<u64>) -> Bar {
        Bar {
            done: AtomicU64::new(0),
            counter: (self.0.as_ref()).map(|listener| listener.start(what, count)),
        }
    }

    pub fn tell(&self, line: &str) {
        if let Some(listener) = &self.0 {
            listener.tell(line);
        }
    }
}

/// Work that has begun; it ends when this is dropped.
pub struct Bar {
    done: AtomicU64,
    counter: Option<Box<dyn Counter>>,
}

impl Bar {
    /// So many parts more are done.
    pub fn inc(&self, parts: u64) {
        let done = self.done.fetch_add(parts, Ordering::Relaxed) + parts;
        self.counter.iter().for_each(|counter| counter.set(done));
    }

    /// So many parts are done.
    pub fn set_position(&self, done: u64) {
        self.done.store(done, Ordering::Relaxed);
        self.counter.iter().for_each(|counter| counter.set(done));
    }

    /// How many parts are done.
    pub fn position(&self) -> u64 {
        self.done.load(Ordering::Relaxed)
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Mutex;

    use super::*;

    #[derive(Clone, Default)]
    struct Heard(Arc<Mutex<Vec<String>>>);

    impl Heard {
        fn add(&self, text: String) {
            self.0.lock().unwrap().push(text);
        }
    }

    impl Listener for Heard {
        fn start(&self, what: &str, count: Option<u64>) -> Box<dyn Counter> {
            self.add(format!("{what} {count:?}"));
            Box::new(self.clone())
        }

        fn tell(&self, line: &str) {
            self.add(line.to_owned());
        }
    }

    impl Counter for Heard {
        fn set(&self, done: u64) {
            self.add(done.to_string());
        }
    }

    #[test]
    fn a_listener_hears_all_and_silence_still_counts() {
        let heard = Heard::default();
        for watch in [Watch::new(heard.clone()), Watch::default()] {
            let bar = watch.bar(3, "solves");
            bar.inc(1);
            bar.inc(1);
            bar.set_position(3);
            assert_eq!(bar.position(), 3);
            watch.tell("solved");
            watch.spinner("factor");
        }
        let all = heard.0.lock().unwrap().join(", ");
        assert_eq!(all, "solves Some(3), 1, 2, 3, solved, factor None");
    }
}
