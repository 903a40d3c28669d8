//! Growth of long lists: by a quarter, where a `Vec` would double.

/// Makes room for `len` items. A list that grows gets a quarter more: one that doubles has room for half as many again, on
/// average.
pub(crate) fn reserve<T>(list: &mut Vec<T>, len: usize) {
    if list.capacity() < len {
        list.reserve_exact(len + len / 4 - list.len());
    }
}
