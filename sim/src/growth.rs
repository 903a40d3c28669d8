//! Growth of long lists, by a quarter where a `Vec` would double, and when to release scratch.

/// Steps over which the use of scratch is watched. It is released if there is room for more than [`FAR_TOO_LARGE`] times the
/// items that were used, and [`ITEMS_MIN`] more.
const WATCHED_STEPS: u32 = 128;
const FAR_TOO_LARGE: usize = 4;
const ITEMS_MIN: usize = 256;

/// Use of scratch in the last steps; not state.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct ScratchUse {
    steps: u32,
    /// Most items of a step.
    most: usize,
}

impl ScratchUse {
    /// Counts a step that used this many items; returns whether the last ones used few of those that there is room for.
    pub fn is_small(&mut self, used: usize, capacity: usize) -> bool {
        (self.steps, self.most) = (self.steps + 1, self.most.max(used));
        if self.steps < WATCHED_STEPS {
            return false;
        }
        let most = std::mem::take(self).most;
        capacity > FAR_TOO_LARGE * most + ITEMS_MIN
    }
}

#[inline]
pub(crate) fn push<T>(list: &mut Vec<T>, item: T) {
    if list.len() == list.capacity() {
        reserve(list, list.len() + 1);
    }
    list.push(item);
}

/// Makes room for `len` items. A list that grows gets a quarter more: one that doubles has room for half as many again, on
/// average.
#[cold]
#[inline(never)]
pub(crate) fn reserve<T>(list: &mut Vec<T>, len: usize) {
    if list.capacity() < len {
        list.reserve_exact(len + len / 4 - list.len());
    }
}
