//! Bodies that lie in each other at the start of a scene.

use super::spec::Scene;
use jostle_sim::math::ordered_bits;
use jostle_sim::{BodyDef, Motion, Shape, collide};

/// Pairs that are counted; more make no difference.
const COUNTED_MAX: u32 = 1_000_000;

/// Bodies that lie in each other at the start: those of `bodies` and of exact layouts, as other layouts keep theirs apart.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Overlaps {
    /// Pairs of them that collide.
    pub count: u32,
    /// Field of the file that brings most of them; empty if there are none.
    pub field: String,
}

/// A body at the start, and the number of its source.
#[derive(Clone, Copy)]
struct StartingBody {
    def: BodyDef,
    source: usize,
}

impl Overlaps {
    /// Counts them; sorted and swept along x.
    pub fn at_start(scene: &Scene) -> Overlaps {
        let starts = by_edge(starts(scene));
        let (mut count, mut by_source) = (0, vec![0u32; 1 + scene.layouts.len()]);
        for (index, a) in starts.iter().enumerate() {
            if count > COUNTED_MAX {
                break;
            }
            let right = a.def.position.x + a.def.shape.half_extent().x;
            let beside = starts[index + 1..].iter().take_while(|b| left(&b.def) < right);
            for b in beside.filter(|b| lie_in_each_other(scene, &a.def, &b.def)) {
                count += 1;
                by_source[a.source] += 1;
                by_source[b.source] += 1;
            }
        }
        let most = (0..by_source.len()).max_by_key(|&source| by_source[source]);
        let field = match most.filter(|&source| by_source[source] > 0) {
            None => String::new(),
            Some(0) => "bodies".to_owned(),
            Some(source) => format!("layouts[{}].count", source - 1),
        };
        Overlaps { count, field }
    }
}

/// All bodies whose start the file fixes: those of `bodies` are source 0, those of a layout its index and 1.
fn starts(scene: &Scene) -> Vec<StartingBody> {
    let bodies = scene.bodies.iter().map(|body| StartingBody { def: body.def, source: 0 });
    let layouts = scene.layouts.iter().enumerate().filter(|(_, layout)| layout.exact);
    let exact = layouts.flat_map(|(index, layout)| {
        // Of the shapes that the seed chooses from, the largest.
        let largest = layout.shapes.iter().copied().max_by(|a, b| area(*a).total_cmp(&area(*b)));
        let shape = largest.unwrap_or(layout.def.shape);
        (0..layout.count).map(move |number| {
            let position = layout.cell_center(number);
            StartingBody { def: BodyDef { shape, position, ..layout.def }, source: index + 1 }
        })
    });
    bodies.chain(exact).collect()
}

/// Sorts them by their left edges. Plain numbers are sorted, as in the broad phase: a sort of its own would take
/// 3 kB of the page's program.
fn by_edge(starts: Vec<StartingBody>) -> Vec<StartingBody> {
    let keys = starts.iter().zip(0u64..);
    let keys = keys.map(|(start, index)| u64::from(ordered_bits(left(&start.def))) << 32 | index);
    let mut keys: Vec<u64> = keys.collect();
    keys.sort_unstable();
    keys.iter().map(|&key| starts[key as u32 as usize]).collect()
}

fn area(shape: Shape) -> f32 {
    shape.half_extent().x * shape.half_extent().y
}

fn left(def: &BodyDef) -> f32 {
    def.position.x - def.shape.half_extent().x
}

/// Whether two bodies touch, and take part in a contact.
fn lie_in_each_other(scene: &Scene, a: &BodyDef, b: &BodyDef) -> bool {
    let movable = [a, b].iter().any(|def| def.motion == Motion::Dynamic);
    (movable || scene.world.solver.is_none())
        && scene.groups_meet(a.group, b.group)
        && collide(a.shape, a.position, b.shape, b.position, (0, 1)).is_some()
}
