//! What the workers of a search share: the best so far, and how many of them are at work.

use super::Ranked;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Condvar, Mutex, PoisonError};
use std::time::Duration;

/// Between two calls of the progress function.
const TICK: Duration = Duration::from_millis(100);

/// How many workers are at work.
pub(super) struct Running {
    number: Mutex<usize>,
    changed: Condvar,
}

impl Running {
    pub fn new(number: usize) -> Self {
        Self {
            number: Mutex::new(number),
            changed: Condvar::new(),
        }
    }

    /// Waits a little for all workers to end.
    pub fn is_over(&self) -> bool {
        let number = self.number.lock().unwrap_or_else(PoisonError::into_inner);
        if *number == 0 {
            return true;
        }
        let (number, _) = self
            .changed
            .wait_timeout(number, TICK)
            .unwrap_or_else(PoisonError::into_inner);
        *number == 0
    }
}

/// Counts a worker out, also one that panics, for which nobody must wait.
pub(super) struct Leave<'a>(pub &'a Running);

impl Drop for Leave<'_> {
    fn drop(&mut self) {
        let running = self.0;
        *running
            .number
            .lock()
            .unwrap_or_else(PoisonError::into_inner) -= 1;
        running.changed.notify_one();
    }
}

/// The best so far, shared by all workers.
pub(super) struct Board {
    top: usize,
    best: Mutex<Vec<Ranked>>,
    /// Bits of the quality that a grasp must reach to enter; positive floats order as integers.
    threshold: AtomicU64,
}

impl Board {
    pub fn new(top: usize) -> Self {
        Self {
            top,
            best: Mutex::new(Vec::new()),
            threshold: AtomicU64::new(0),
        }
    }

    pub fn threshold(&self) -> f64 {
        f64::from_bits(self.threshold.load(Ordering::Relaxed))
    }

    pub fn offer(&self, candidate: Ranked) {
        let mut best = self.best.lock().unwrap_or_else(PoisonError::into_inner);
        let place = best.partition_point(|other| {
            (-other.quality, &other.indices) < (-candidate.quality, &candidate.indices)
        });
        if best
            .get(place)
            .is_some_and(|other| other.indices == candidate.indices)
        {
            return;
        }
        best.insert(place, candidate);
        best.truncate(self.top);
        if best.len() == self.top {
            let lowest = best[self.top - 1].quality;
            self.threshold.store(lowest.to_bits(), Ordering::Relaxed);
        }
    }

    pub fn into_best(self) -> Vec<Ranked> {
        self.best
            .into_inner()
            .unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nobody_waits_for_a_worker_that_panicked() {
        let running = Running::new(2);
        std::thread::scope(|scope| {
            let panics = scope.spawn(|| {
                let _guard = Leave(&running);
                panic!("a worker's end, which the test wants");
            });
            assert!(panics.join().is_err());
            assert!(!running.is_over());
            drop(Leave(&running));
            assert!(running.is_over());
        });
    }
}
