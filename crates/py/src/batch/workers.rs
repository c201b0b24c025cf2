//! Threads that take the steps of many simulations, each simulation on one of them.

use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};

use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};

use crate::threads;

/// Pools of one thread each: work that is parallel inside a simulation finds one thread, and stays on it.
pub(super) struct Workers {
    pools: Vec<ThreadPool>,
    /// Fork that they were started in.
    forks: u64,
}

impl Workers {
    pub(super) fn new(threads: usize) -> PyResult<Self> {
        let pool = || ThreadPoolBuilder::new().num_threads(1).build();
        let pools = (0..threads).map(|_| pool()).collect::<Result<_, _>>();
        let pools =
            pools.map_err(|error| PyRuntimeError::new_err(format!("cannot start threads: {error}")))?;
        Ok(Workers { pools, forks: threads::forks() })
    }

    /// Starts new ones in the child of a fork, where the old ones are not.
    pub(super) fn after_fork(&mut self) -> PyResult<()> {
        if self.forks != threads::forks() {
            let started = Workers::new(self.pools.len())?;
            std::mem::forget(std::mem::replace(self, started));
        }
        Ok(())
    }

    /// Results of `work` on each item, in their order. Every thread begins with a part of its own, and helps
    /// others when that is done.
    pub(super) fn each<I: Send, T: Send>(&self, items: Vec<I>, work: impl Fn(I) -> T + Sync) -> Vec<T> {
        let (count, parts) = (items.len(), self.pools.len());
        let part = |i: usize| i * count / parts;
        let next: Vec<AtomicUsize> = (0..parts).map(|i| AtomicUsize::new(part(i))).collect();
        let slots: Vec<Slot<I, T>> = items.into_iter().map(|item| Mutex::new((Some(item), None))).collect();
        let take = |thread: usize| {
            for i in (0..parts).map(|k| (thread + k) % parts) {
                let mine = || Some(next[i].fetch_add(1, Ordering::Relaxed)).filter(|at| *at < part(i + 1));
                while let Some(at) = mine() {
                    let mut slot = slots[at].lock().unwrap_or_else(PoisonError::into_inner);
                    let item = slot.0.take().expect("it is taken once");
                    slot.1 = Some(work(item));
                }
            }
        };
        on_all(&self.pools, 0, &take);
        let results = slots.into_iter().map(|slot| slot.into_inner().unwrap_or_else(PoisonError::into_inner));
        results.map(|(_, result)| result.expect("every item was worked on")).collect()
    }
}

/// An item until it is taken, and its result.
type Slot<I, T> = Mutex<(Option<I>, Option<T>)>;

/// Calls `take` with its number on each thread.
fn on_all(pools: &[ThreadPool], first: usize, take: &(impl Fn(usize) + Sync)) {
    if let Some((pool, others)) = pools.split_first() {
        pool.in_place_scope(|scope| {
            scope.spawn(|_| take(first));
            on_all(others, first + 1, take);
        });
    }
}
