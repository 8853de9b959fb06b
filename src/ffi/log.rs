//! The log callback: a `tracing` subscriber that forwards events and the ends of spans of this library and of `ort`; spans go to a trace too
//! (`trace.rs`), where the process wants one.
//!
//! The callback runs on the host's threads only, inside of its calls. A managed host (Mono in Unity) takes each native
//! thread that calls into it for one of its own, and its domain reload then waits for that thread for ever. So what
//! the library's and ONNX Runtime's threads say waits in a queue for the next call of the host.
//!
//! REQ-018: A flag that rises is told once to the host's log receiver, which cannot call the library.

use crate::clock::Instant;
use std::cell::Cell;
use std::collections::{HashMap, VecDeque};
use std::ffi::{CString, c_void};
use std::fmt::{Debug, Write};
use std::sync::atomic::{AtomicBool, AtomicI32, AtomicU64, Ordering};
use std::sync::{LazyLock, Mutex, MutexGuard, Once, PoisonError, RwLock};

use tracing::field::{Field, Visit};
use tracing::span::{Attributes, Id, Record};
use tracing::subscriber::Interest;
use tracing::{Event, Level, Metadata, Subscriber};

use super::constants::*;
use super::failure::{Answer, fail};
use super::structs::upt_log_fn;
use super::trace;

/// The host's function with the pointer that it wants back.
struct Receiver {
    callback: upt_log_fn,
    user: *mut c_void,
}

// SAFETY: the host promises that its callback, with `user`, takes calls of any thread.
unsafe impl Send for Receiver {}
// SAFETY: as above.
unsafe impl Sync for Receiver {}

/// A reader holds the lock while the callback runs, so that a change waits for it.
static RECEIVER: RwLock<Receiver> = RwLock::new(Receiver {
    callback: None,
    user: std::ptr::null_mut(),
});
/// The most verbose level that is told; off without a receiver.
static LEVEL: AtomicI32 = AtomicI32::new(UPT_LOG_OFF);
/// 1 where the process's subscriber is [`Forward`]; nothing takes it back.
static INSTALLED: AtomicI32 = AtomicI32::new(0);
static INSTALL: Once = Once::new();
/// Open spans by number. One may be closed on another thread than it was opened on.
static SPANS: LazyLock<Mutex<HashMap<u64, OpenSpan>>> = LazyLock::new(Default::default);
static NEXT_SPAN: AtomicU64 = AtomicU64::new(1);

/// Messages of threads that are not the host's; the oldest make room.
static WAITING: Mutex<VecDeque<(i32, String)>> = Mutex::new(VecDeque::new());
/// Spares each call the lock where nothing waits, which is nearly always.
static ANY_WAITING: AtomicBool = AtomicBool::new(false);
/// A host that never calls again must not make them pile up.
const WAITING_LIMIT: usize = 1024;

thread_local! {
    /// Exported functions that this thread is inside of.
    static DEPTH: Cell<u32> = const { Cell::new(0) };
    /// The receiver runs on this thread.
    static IN_RECEIVER: Cell<bool> = const { Cell::new(false) };
}

/// Held while an exported function runs; the outermost hands over what waits when it ends.
pub(super) struct HostCall;

impl HostCall {
    pub(super) fn enter() -> HostCall {
        let _ = DEPTH.try_with(|depth| depth.set(depth.get() + 1));
        begin_trace();
        HostCall
    }
}

impl Drop for HostCall {
    fn drop(&mut self) {
        let outermost = DEPTH.try_with(|depth| {
            depth.set(depth.get() - 1);
            depth.get() == 0
        });
        if outermost == Ok(true) && ANY_WAITING.load(Ordering::Acquire) {
            for (level, text) in take_waiting() {
                hand_over(level, text);
            }
        }
    }
}

/// Whether this thread is inside of the receiver.
pub(super) fn in_receiver() -> bool {
    IN_RECEIVER.try_with(Cell::get).unwrap_or(false)
}

/// Empties the queue.
fn take_waiting() -> VecDeque<(i32, String)> {
    let mut waiting = WAITING.lock().unwrap_or_else(PoisonError::into_inner);
    ANY_WAITING.store(false, Ordering::Release);
    std::mem::take(&mut *waiting)
}

/// Why there is no trace, for the first receiver.
static TRACE_FAULT: Mutex<Option<String>> = Mutex::new(None);

fn lock_fault() -> MutexGuard<'static, Option<String>> {
    TRACE_FAULT.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Makes spans for a trace where the process wants one; at its first call.
fn begin_trace() {
    static BEGIN: Once = Once::new();
    BEGIN.call_once(|| match trace::start() {
        Ok(()) if trace::is_on() => {
            install();
        }
        Ok(()) => {}
        Err(fault) => *lock_fault() = Some(fault),
    });
}

/// Makes this file the process's subscriber; false where the process has one of its own.
fn install() -> bool {
    INSTALL.call_once(|| {
        let done = tracing::subscriber::set_global_default(Forward).is_ok();
        INSTALLED.store(done.into(), Ordering::Release);
    });
    INSTALLED.load(Ordering::Acquire) != 0
}

/// A span that has begun and not ended.
struct OpenSpan {
    name: &'static str,
    text: String,
    level: i32,
    start: Instant,
    references: usize,
}

/// The host's receiver from now on. It returns once no call of the former one runs any more.
pub(super) fn set(callback: upt_log_fn, user: *mut c_void, level: i32) -> Answer {
    if callback.is_some() && level != UPT_LOG_OFF && !install() {
        return fail(
            UPT_ERR_STATE,
            "the process has its own tracing subscriber; receive the log there",
        );
    }
    let mut receiver = RECEIVER.write().unwrap_or_else(PoisonError::into_inner);
    *receiver = Receiver { callback, user };
    take_waiting(); // said to the former receiver
    let level = if callback.is_some() {
        level
    } else {
        UPT_LOG_OFF
    };
    LEVEL.store(level, Ordering::Release);
    drop(receiver);
    if is_told(UPT_LOG_WARN)
        && let Some(fault) = lock_fault().take()
    {
        emit(UPT_LOG_WARN, fault);
    }
    Ok(UPT_OK)
}

/// To the receiver at once in the host's own call, else into the queue.
fn emit(level: i32, text: String) {
    if DEPTH.try_with(Cell::get).unwrap_or(0) > 0 && !in_receiver() {
        return hand_over(level, text);
    }
    let mut waiting = WAITING.lock().unwrap_or_else(PoisonError::into_inner);
    if waiting.len() == WAITING_LIMIT {
        waiting.pop_front();
    }
    waiting.push_back((level, text));
    ANY_WAITING.store(true, Ordering::Release);
}

/// Calls the receiver. A reader's lock is held meanwhile, and [`in_receiver`] keeps it from calling
/// back into the library.
fn hand_over(level: i32, text: String) {
    let receiver = RECEIVER.read().unwrap_or_else(PoisonError::into_inner);
    if let (Some(callback), Ok(text)) = (receiver.callback, CString::new(text.replace('\0', " "))) {
        let _ = IN_RECEIVER.try_with(|inside| inside.set(true));
        // SAFETY: the host passed this function with `user`, for calls like this one.
        unsafe { callback(level, text.as_ptr(), receiver.user) };
        let _ = IN_RECEIVER.try_with(|inside| inside.set(false));
    }
}

/// The header's number of a level.
fn level_of(metadata: &Metadata<'_>) -> i32 {
    match *metadata.level() {
        Level::ERROR => UPT_LOG_ERROR,
        Level::WARN => UPT_LOG_WARN,
        Level::INFO => UPT_LOG_INFO,
        Level::DEBUG => UPT_LOG_DEBUG,
        Level::TRACE => UPT_LOG_TRACE,
    }
}

/// `message field=value ...`
#[derive(Default)]
struct Text(String);

impl Visit for Text {
    fn record_debug(&mut self, field: &Field, value: &dyn Debug) {
        if !self.0.is_empty() {
            self.0.push(' ');
        }
        let _ = match field.name() {
            "message" => write!(self.0, "{value:?}"),
            name => write!(self.0, "{name}={value:?}"),
        };
    }
}

/// Whether the receiver wants messages of a level.
fn is_told(level: i32) -> bool {
    level <= LEVEL.load(Ordering::Acquire)
}

/// Crates of whose messages and spans a host is told: the library, its layers, and ONNX Runtime's binding.
const TOLD: [&str; 13] = [
    "upt", "ort", "bundle", "contact", "elements", "exchange", "field", "held", "implicit",
    "kernels", "lanes", "prior", "topology",
];

/// The subscriber: it keeps nothing but open spans.
struct Forward;

impl Subscriber for Forward {
    fn register_callsite(&self, metadata: &'static Metadata<'static>) -> Interest {
        let crate_name = metadata.target().split("::").next();
        match crate_name.is_some_and(|name| TOLD.contains(&name)) {
            true => Interest::sometimes(),
            false => Interest::never(),
        }
    }

    fn enabled(&self, metadata: &Metadata<'_>) -> bool {
        is_told(level_of(metadata)) || (metadata.is_span() && trace::is_on())
    }

    fn new_span(&self, attributes: &Attributes<'_>) -> Id {
        let mut text = Text(attributes.metadata().name().to_owned());
        attributes.record(&mut text);
        let span = OpenSpan {
            name: attributes.metadata().name(),
            text: text.0,
            level: level_of(attributes.metadata()),
            start: Instant::now(),
            references: 1,
        };
        let id = NEXT_SPAN.fetch_add(1, Ordering::Relaxed);
        SPANS
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .insert(id, span);
        Id::from_u64(id)
    }

    fn record(&self, id: &Id, values: &Record<'_>) {
        let mut spans = SPANS.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(span) = spans.get_mut(&id.into_u64()) {
            let mut text = Text(std::mem::take(&mut span.text));
            values.record(&mut text);
            span.text = text.0;
        }
    }

    fn record_follows_from(&self, _: &Id, _: &Id) {}

    fn event(&self, event: &Event<'_>) {
        let mut text = Text::default();
        event.record(&mut text);
        emit(level_of(event.metadata()), text.0);
    }

    fn enter(&self, _: &Id) {}

    fn exit(&self, _: &Id) {}

    fn clone_span(&self, id: &Id) -> Id {
        let mut spans = SPANS.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(span) = spans.get_mut(&id.into_u64()) {
            span.references += 1;
        }
        id.clone()
    }

    fn try_close(&self, id: Id) -> bool {
        let mut spans = SPANS.lock().unwrap_or_else(PoisonError::into_inner);
        let id = id.into_u64();
        match spans.get_mut(&id) {
            Some(span) if span.references > 1 => span.references -= 1,
            Some(_) => {
                let span = spans.remove(&id).expect("looked up under the same lock");
                let last = spans.is_empty();
                drop(spans);
                let fields = span.text[span.name.len()..].trim_start();
                trace::span(span.name, fields, span.start, last);
                if is_told(span.level) {
                    let milliseconds = span.start.elapsed().as_secs_f64() * 1e3;
                    emit(span.level, format!("{}: {milliseconds:.3} ms", span.text));
                }
                return true;
            }
            None => {}
        }
        false
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ffi::call::call;
    use std::ffi::{CStr, c_char};
    use std::thread::{self, ThreadId};

    static HEARD: Mutex<Vec<(String, ThreadId)>> = Mutex::new(Vec::new());

    /// A layer that is not in the list is silent.
    #[test]
    fn all_layers_are_heard() {
        let manifest = include_str!("../../Cargo.toml");
        let layers = manifest.lines().filter_map(|line| {
            let (name, rest) = line.split_once(" = { package = \"libupt-")?;
            rest.contains("path = \"crates/").then_some(name)
        });
        let silent: Vec<_> = layers.clone().filter(|name| !TOLD.contains(name)).collect();
        assert!(layers.count() > 8 && silent.is_empty(), "{silent:?}");
    }

    unsafe extern "C" fn hear(_: i32, text: *const c_char, _: *mut c_void) {
        // SAFETY: the log hands over a NUL-terminated text.
        let text = unsafe { CStr::from_ptr(text) }.to_str().unwrap().to_owned();
        HEARD.lock().unwrap().push((text, thread::current().id()));
    }

    #[test]
    fn the_librarys_threads_are_heard_on_the_hosts() {
        // Level off: no other test's events are made.
        assert!(set(Some(hear), std::ptr::null_mut(), UPT_LOG_OFF).is_ok());
        let worker = thread::spawn(|| {
            emit(UPT_LOG_INFO, "from the worker".into());
            thread::current().id()
        });
        let worker = worker.join().unwrap();
        call(
            "upt_x",
            || (),
            || {
                emit(UPT_LOG_INFO, "from the host".into());
                Ok(UPT_OK)
            },
        );
        let heard = HEARD.lock().unwrap();
        let thread_of = |text| {
            heard
                .iter()
                .find(|(said, _)| said == text)
                .map(|(_, id)| *id)
        };
        assert_eq!(thread_of("from the host"), Some(thread::current().id()));
        assert!(thread_of("from the worker").is_some_and(|thread| thread != worker));
        drop(heard);

        for i in 0..WAITING_LIMIT + 5 {
            emit(UPT_LOG_INFO, i.to_string());
        }
        let waiting = take_waiting();
        assert_eq!(waiting.len(), WAITING_LIMIT);
        assert_eq!(waiting[0].1, "5");
        assert!(set(None, std::ptr::null_mut(), UPT_LOG_OFF).is_ok());
    }
}
