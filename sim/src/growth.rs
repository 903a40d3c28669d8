//! Growth of long lists: by a quarter, where a `Vec` would double.

/// Adds an item.
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
