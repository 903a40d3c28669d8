//! Makes long lists grow by a quarter, where a `Vec` would double, and decides when to release scratch memory.

/// Number of steps over which the use of scratch memory is observed. The memory is released if its capacity
/// exceeds [`FAR_TOO_LARGE`] times the items used plus [`ITEMS_MIN`].
const WATCHED_STEPS: u32 = 128;
const FAR_TOO_LARGE: usize = 4;
const ITEMS_MIN: usize = 256;

/// Use of scratch in recent steps; not state.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct ScratchUse {
    steps: u32,
    /// Largest number of items used in one step.
    most: usize,
}

impl ScratchUse {
    /// Counts a step that used this many items, and returns whether recent steps used only a small part of the
    /// capacity.
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

/// Makes room for `len` items. A growing list gets a quarter more than it needs. If it doubled, it would waste half
/// of its length on average.
#[cold]
#[inline(never)]
pub(crate) fn reserve<T>(list: &mut Vec<T>, len: usize) {
    if list.capacity() < len {
        list.reserve_exact(len + len / 4 - list.len());
    }
}
