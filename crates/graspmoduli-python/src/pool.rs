//! Threads that survive a fork.
//!
//! Rayon starts its threads once per process, and a forked child (`multiprocessing` on Linux before
//! Python 3.14) has none of its parent's: it would wait for them for ever. So a child computes on a
//! pool of its own. The process that loaded this module uses rayon's, and pays nothing.

use pyo3::prelude::*;
use std::process::id;
use std::sync::OnceLock;

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

/// Releases the interpreter and computes; parallel work may be part of it.
pub fn detached<R: Send>(py: Python<'_>, task: impl FnOnce() -> R + Send) -> R {
    py.detach(|| {
        if HOME.get() == Some(&id()) {
            return task();
        }
        let mut pool = CHILD.get_or_init(Pool::new);
        while pool.process != id() {
            pool = pool.next.get_or_init(|| Box::new(Pool::new()));
        }
        pool.threads.install(task)
    })
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
