//! Distributes work that is not timed over all cores.

use std::sync::Mutex;

/// Returns the result of `work` for each item, in the order of the items.
pub fn on_all_cores<T: Sync, R: Send>(items: &[T], work: impl Fn(&T) -> R + Sync) -> Vec<R> {
    let next = Mutex::new(items.iter().enumerate());
    let found = Mutex::new(Vec::new());
    let workers = std::thread::available_parallelism().map_or(1, |count| count.get());
    std::thread::scope(|scope| {
        for _ in 0..workers {
            scope.spawn(|| {
                loop {
                    let taken = next.lock().expect("no worker panics with it").next();
                    let Some((index, item)) = taken else { return };
                    let made = work(item);
                    found.lock().expect("no worker panics with it").push((index, made));
                }
            });
        }
    });
    let mut found = found.into_inner().expect("no worker panics with it");
    found.sort_by_key(|(index, _)| *index);
    found.into_iter().map(|(_, made)| made).collect()
}
