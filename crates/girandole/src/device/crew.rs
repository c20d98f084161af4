//! Threads that compile kernels ahead, in the order in which these were asked for.

use std::collections::VecDeque;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;

/// More threads find nothing to do: there are a few dozen kernels.
const MOST_THREADS: usize = 8;

type Job = Box<dyn FnOnce() + Send>;

/// Threads that live while there is something to do. Dropped, it waits for those that are at work, and leaves the rest undone.
#[derive(Default)]
pub(super) struct Crew(Arc<Mutex<State>>);

#[derive(Default)]
struct State {
    jobs: VecDeque<Job>,
    at_work: usize,
    threads: Vec<JoinHandle<()>>,
}

fn locked(state: &Mutex<State>) -> MutexGuard<'_, State> {
    state.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Crew {
    /// Has something done by the next thread that is free. Where no thread can be had, nothing is.
    pub fn send(&self, job: impl FnOnce() + Send + 'static) {
        let most = std::thread::available_parallelism().map_or(1, usize::from).min(MOST_THREADS);
        let mut state = locked(&self.0);
        state.jobs.push_back(Box::new(job));
        if state.at_work >= most {
            return;
        }
        let shared = self.0.clone();
        let work = move || {
            while let Some(job) = next(&shared) {
                // What fails is left to those who need its result.
                let _ = catch_unwind(AssertUnwindSafe(job));
            }
        };
        state.at_work += 1;
        match std::thread::Builder::new().name("kernels".into()).spawn(work) {
            Ok(thread) => {
                state.threads.retain(|thread| !thread.is_finished());
                state.threads.push(thread);
            }
            Err(_) => state.at_work -= 1,
        }
    }
}

/// The next job. Whoever finds none is no longer at work.
fn next(state: &Mutex<State>) -> Option<Job> {
    let mut state = locked(state);
    let job = state.jobs.pop_front();
    state.at_work -= usize::from(job.is_none());
    job
}

impl Drop for Crew {
    fn drop(&mut self) {
        let mut state = locked(&self.0);
        state.jobs.clear();
        let threads = std::mem::take(&mut state.threads);
        drop(state);
        for thread in threads {
            let _ = thread.join();
        }
    }
}
