//! Determines which displayed bodies overlap, using the simulation's narrow phase after a sweep along x. Only the
//! bounds view needs this.

use crate::net::timeline::Sample;
use jostle_sim::math::ordered_bits;
use jostle_sim::{Aabb, collide};

/// Calls `report(i, j)` for each pair of overlapping bodies for which `meets(i, j)` holds.
pub fn pairs(
    bodies: &[Sample],
    meets: impl Fn(usize, usize) -> bool,
    mut report: impl FnMut(usize, usize),
) {
    let boxes: Vec<Aabb> =
        bodies.iter().map(|b| Aabb::around(b.center, b.shape.half_extent())).collect();
    let keys = boxes.iter().zip(0u64..);
    let keys = keys.map(|(around, i)| u64::from(ordered_bits(around.low.x)) << 32 | i);
    let mut order: Vec<u64> = keys.collect();
    order.sort_unstable();
    let body = |key: u64| key as u32 as usize;
    for (place, i) in order.iter().map(|&key| body(key)).enumerate() {
        for j in order[place + 1..].iter().map(|&key| body(key)) {
            if boxes[j].low.x >= boxes[i].high.x {
                break;
            }
            if boxes[i].overlaps(&boxes[j]) && meets(i, j) && touching(&bodies[i], &bodies[j]) {
                report(i, j);
            }
        }
    }
}

/// Whether two bodies overlap; mere contact does not count.
pub fn touching(a: &Sample, b: &Sample) -> bool {
    collide(a.shape, a.center, b.shape, b.center, (a.id.index, b.id.index)).is_some()
}
