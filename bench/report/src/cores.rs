//! Work that needs no clock of its own takes turns on all cores.

use std::sync::Mutex;

/// What `work` makes of each item, in the order of the items.
pub fn on_all_cores<T: Sync, R: Send>(items: &[T], work: impl Fn(&T) -> R + Sync) -> Vec<R> {
    let next = Mutex::new(items.iter().enumerate());
    let found = Mutex::new(Vec::new());
    let workers = std::thread::available_parallelism().map_or(1, |count| count.get());
    std::thread::scope(|scope| {
        for _ in 0..workers {
            scope.spawn(|| {
                loop {
                    let taken = next.lock().expect("no worker panics with it").next();
                    let Some((place, item)) = taken else { return };
                    let made = work(item);
                    found.lock().expect("no worker panics with it").push((place, made));
                }
            });
        }
    });
    let mut found = found.into_inner().expect("no worker panics with it");
    found.sort_by_key(|(place, _)| *place);
    found.into_iter().map(|(_, made)| made).collect()
}
