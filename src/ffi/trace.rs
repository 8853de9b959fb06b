//! Spans of steps as a file for profilers: Chrome's trace events, which Perfetto opens and Tracy imports (`tracy-import-chrome`).
//!
//! The environment variable `UPT_TRACE` names the file; it is read at the process's first call. The file is a complete JSON array whenever no span
//! is open: the closing bracket is written each time, and the next events take its place.

use std::cell::Cell;
use std::fmt::Write as _;
use std::fs::File;
use std::io::{Seek, SeekFrom, Write as _};
use std::path::Path;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, OnceLock, PoisonError};

use crate::clock::Instant;

const VARIABLE: &str = "UPT_TRACE";
/// Bytes of events that wait at most: a write for each span would cost more than the span.
const WAITING: usize = 1 << 16;

/// None in it where no trace was asked for, or its file cannot be written.
static TRACE: OnceLock<Option<Trace>> = OnceLock::new();
/// Threads are numbered as they appear; their own numbers differ between systems.
static NEXT_THREAD: AtomicU64 = AtomicU64::new(1);

thread_local! {
    /// 0 before the first span.
    static THREAD: Cell<u64> = const { Cell::new(0) };
}

struct Trace {
    /// Zero of the times in the file.
    start: Instant,
    /// Spans end on any thread.
    sink: Mutex<Sink>,
}

struct Sink {
    /// Always a complete array: it ends in `\n]`, over which the next events are written.
    file: File,
    /// Events that are not in the file yet, each with its comma.
    waiting: String,
    /// Events are in the file already.
    begun: bool,
}

/// Opens the file that the variable names. Only the first call of a process does anything; an error is why there is no trace.
pub(super) fn start() -> Result<(), String> {
    let mut fault = Ok(());
    TRACE.get_or_init(|| {
        let path = std::env::var_os(VARIABLE)?;
        let opened = open(Path::new(&path));
        fault = opened.as_ref().map(|_| ()).map_err(|error| {
            let path = Path::new(&path).display();
            format!("{VARIABLE}: cannot write {path}: {error}")
        });
        let sink = Mutex::new(opened.ok()?);
        let start = Instant::now();
        Some(Trace { start, sink })
    });
    fault
}

fn open(path: &Path) -> std::io::Result<Sink> {
    let mut file = File::create(path)?;
    file.write_all(b"[\n]")?;
    Ok(Sink {
        file,
        waiting: String::new(),
        begun: false,
    })
}

/// Whether spans are wanted.
pub(super) fn is_on() -> bool {
    TRACE.get().is_some_and(Option::is_some)
}

/// Takes a span that ends now on this thread. `fields` says what it was about; `last` that no other span is open.
pub(super) fn span(name: &str, fields: &str, begun: Instant, last: bool) {
    let Some(Some(trace)) = TRACE.get() else {
        return;
    };
    let ended = trace.start.elapsed().as_secs_f64() * 1e6;
    let lasted = begun.elapsed().as_secs_f64() * 1e6;
    let mut sink = trace.sink.lock().unwrap_or_else(PoisonError::into_inner);
    let comma = if sink.begun { "," } else { "" };
    sink.begun = true;
    let fields = serde_json::Value::from(fields);
    let (from, thread) = ((ended - lasted).max(0.0), thread());
    let _ = write!(
        sink.waiting,
        "{comma}\n{{\"name\":\"{name}\",\"cat\":\"upt\",\"ph\":\"X\",\"ts\":{from:.3},\"dur\":{lasted:.3},\"pid\":1,\"tid\":{thread},\
         \"args\":{{\"of\":{fields}}}}}"
    );
    if last || sink.waiting.len() > WAITING {
        sink.hand_over();
    }
}

impl Sink {
    /// A file that takes no more is left as it is: a profile is no reason to fail.
    fn hand_over(&mut self) {
        self.waiting.push_str("\n]");
        let placed = self.file.seek(SeekFrom::End(-2));
        let _ = placed.and_then(|_| self.file.write_all(self.waiting.as_bytes()));
        self.waiting.clear();
    }
}

/// A number of this thread; 0 as it ends.
fn thread() -> u64 {
    let own = THREAD.try_with(|number| {
        if number.get() == 0 {
            number.set(NEXT_THREAD.fetch_add(1, Ordering::Relaxed));
        }
        number.get()
    });
    own.unwrap_or(0)
}
