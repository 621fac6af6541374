use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};

/// Results in the order of the cases.
pub fn in_parallel<C: Sync, R: Send>(
    cases: &[C],
    work: impl Fn(&C) -> R + Sync,
    name: impl Fn(&C) -> String + Sync,
    progress: impl Fn(&str, usize, usize) + Sync,
) -> Vec<R> {
    let (next, finished) = (AtomicUsize::new(0), AtomicUsize::new(0));
    let results = Mutex::new(Vec::with_capacity(cases.len()));
    let run = || {
        loop {
            let number = next.fetch_add(1, Ordering::Relaxed);
            let Some(case) = cases.get(number) else { return };
            let result = work(case);
            let finished = finished.fetch_add(1, Ordering::Relaxed) + 1;
            progress(&name(case), finished, cases.len());
            results.lock().unwrap_or_else(PoisonError::into_inner).push((number, result));
        }
    };
    let threads = std::thread::available_parallelism().map_or(1, usize::from).min(cases.len());
    std::thread::scope(|scope| {
        (0..threads).for_each(|_| drop(scope.spawn(run)));
    });
    let mut results = results.into_inner().unwrap_or_else(PoisonError::into_inner);
    results.sort_by_key(|(number, _)| *number);
    results.into_iter().map(|(_, result)| result).collect()
}
