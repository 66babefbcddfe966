//! Threads that survive a fork.
//!
//! Rayon starts its threads once per process, and a forked child (`multiprocessing` on Linux before
//! Python 3.14) has none of its parent's: it would wait for them for ever. So a child computes on a
//! pool of its own. The process that loaded this module uses rayon's, and pays nothing.

use crate::raise;
use graspmoduli::error::Error;
use pyo3::prelude::*;
use std::ops::ControlFlow;
use std::panic::resume_unwind;
use std::process::id;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::time::Duration;

/// The process that loaded this module.
static HOME: OnceLock<u32> = OnceLock::new();
/// The pool of the first forked process in this line of descent that needed one.
static CHILD: OnceLock<Pool> = OnceLock::new();

struct Pool {
    process: u32,
    threads: rayon::ThreadPool,
    /// Of a child of that process. What was copied from the parent is never dropped.
    next: OnceLock<Box<Pool>>,
}

/// To be called when the module is loaded.
pub fn remember_process() {
    HOME.get_or_init(id);
}

/// Between two looks at the signals that came.
const TICK: Duration = Duration::from_millis(50);

/// Releases the interpreter and computes; parallel work may be part of it.
pub fn detached<R: Send>(py: Python<'_>, task: impl FnOnce() -> R + Send) -> R {
    py.detach(|| pooled(task))
}

/// Releases the interpreter for work that asks now and then whether to go on: not after Ctrl-C.
pub fn heeding_signals<R: Send>(
    py: Python<'_>,
    work: impl FnOnce(&mut dyn FnMut() -> ControlFlow<()>) -> Result<R, Error> + Send,
) -> PyResult<R> {
    let mut failure = None;
    let result = py.detach(|| {
        work(&mut || match Python::attach(|py| py.check_signals()) {
            Ok(()) => ControlFlow::Continue(()),
            Err(error) => {
                failure = Some(error);
                ControlFlow::Break(())
            }
        })
    });
    match (result, failure) {
        (Ok(found), _) => Ok(found),
        (Err(_), Some(error)) => Err(error),
        (Err(error), None) => Err(raise(error)),
    }
}

/// The same for work of seconds and more, on a thread of its own, while this one waits for
/// signals: Ctrl-C sets the flag, which the work looks at, and is raised when it has ended.
pub fn interruptible<R: Send>(
    py: Python<'_>,
    task: impl FnOnce(&AtomicBool) -> Result<R, Error> + Send,
) -> PyResult<R> {
    let stop = AtomicBool::new(false);
    let mut signal = None;
    let result = py.detach(|| {
        std::thread::scope(|scope| {
            let (working, over) = channel::<()>();
            let stop = &stop;
            let work = scope.spawn(move || {
                // Dropped at the end, also by a panic.
                let _working = working;
                pooled(|| task(stop))
            });
            while over.recv_timeout(TICK) == Err(RecvTimeoutError::Timeout) {
                if let Err(raised) = Python::attach(|py| py.check_signals()) {
                    stop.store(true, Ordering::Relaxed);
                    signal = Some(raised);
                }
            }
            work.join().unwrap_or_else(|panic| resume_unwind(panic))
        })
    });
    match signal {
        Some(raised) => Err(raised),
        None => result.map_err(raise),
    }
}

/// Computes where this process has threads.
fn pooled<R: Send>(task: impl FnOnce() -> R + Send) -> R {
    if HOME.get() == Some(&id()) {
        return task();
    }
    let mut pool = CHILD.get_or_init(Pool::new);
    while pool.process != id() {
        pool = pool.next.get_or_init(|| Box::new(Pool::new()));
    }
    pool.threads.install(task)
}

impl Pool {
    fn new() -> Self {
        let threads = rayon::ThreadPoolBuilder::new().build();
        Self {
            process: id(),
            threads: threads
                .expect("a process that may not start threads cannot compute in parallel"),
            next: OnceLock::new(),
        }
    }
}
