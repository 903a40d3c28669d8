//! Tests that separations are right at rest, are exact where the current velocities lead, and do not affect pairs that
//! pass each other.

use super::*;
use crate::narrow_phase::overlap::collide;
use crate::rng::Rng;

fn placed(shape: Shape, x: f32, y: f32, slot: u32) -> PlacedShape {
    PlacedShape { shape, center: Vec2::new(x, y), slot }
}

fn manifold_at(a: Shape, b: Shape, at: (f32, f32), path: (f32, f32)) -> Option<Manifold> {
    let path = Vec2::new(path.0, path.1);
    between(placed(a, 0.0, 0.0, 0), placed(b, at.0, at.1, 1), path, Axis::Free)
}

#[track_caller]
fn expect(manifold: Option<Manifold>, normal: (f32, f32), separation: f32) {
    let manifold = manifold.expect("a manifold");
    assert!((manifold.normal - Vec2::new(normal.0, normal.1)).length() < 1e-4, "{manifold:?}");
    assert!(
        (manifold.separation - separation).abs() < 1e-4,
        "{manifold:?} instead of {separation}"
    );
}

#[test]
fn at_rest_the_separation_is_the_distance_of_the_shapes() {
    let (ball, block) = (Shape::circle(1.0), Shape::rect(4.0, 2.0));
    expect(manifold_at(ball, ball, (3.0, 4.0), (0.0, 0.0)), (0.6, 0.8), 3.0);
    expect(manifold_at(block, block, (1.0, 2.5), (0.0, 0.0)), (0.0, 1.0), 0.5);
    expect(manifold_at(block, ball, (0.5, 3.0), (0.0, 0.0)), (0.0, 1.0), 1.0);
    expect(manifold_at(block, ball, (5.0, 5.0), (0.0, 0.0)), (0.6, 0.8), 4.0);
    expect(manifold_at(ball, block, (-5.0, -5.0), (0.0, 0.0)), (-0.6, -0.8), 4.0);
}

#[test]
fn an_overlap_is_a_negative_separation() {
    let mut rng = Rng::new(4, 0);
    for _ in 0..20_000 {
        let mut shape = || match rng.below(2) {
            0 => Shape::circle(rng.range(0.5, 3.0)),
            _ => Shape::rect(rng.range(1.0, 5.0), rng.range(1.0, 5.0)),
        };
        let (a, b) = (shape(), shape());
        let at = Vec2::new(rng.range(-4.0, 4.0), rng.range(-4.0, 4.0));
        let overlap = collide(a, Vec2::ZERO, b, at, (0, 1));
        let manifold = manifold_at(a, b, (at.x, at.y), (0.0, 0.0));
        match (overlap, manifold) {
            // Corner to corner, two boxes may overlap slightly without a manifold.
            (Some(overlap), None) => assert!(overlap.separation >= -CORNER),
            (Some(overlap), Some(manifold)) if overlap.separation < -CORNER => {
                assert!(
                    (overlap.separation - manifold.separation).abs() < 1e-5,
                    "{overlap:?} {manifold:?}"
                );
                assert!(
                    (overlap.normal - manifold.normal).length() < 1e-5,
                    "{overlap:?} {manifold:?}"
                );
            }
            (None, Some(manifold)) => assert!(manifold.separation >= 0.0, "{manifold:?}"),
            _ => {}
        }
    }
}

#[test]
fn a_body_that_hits_is_stopped_at_the_surface() {
    let (ball, block) = (Shape::circle(1.0), Shape::rect(4.0, 2.0));
    // Centres 6 apart along x and 1.2 along y: the circles touch when they are 1.6 apart along x.
    expect(manifold_at(ball, ball, (-6.0, 1.2), (10.0, 0.0)), (-0.8, 0.6), 4.4 * 0.8);
    // The ball hits the corner, while the normal at rest would lean far to the side.
    expect(manifold_at(block, ball, (-9.0, 1.6), (20.0, 0.0)), (-0.8, 0.6), 6.2 * 0.8);
    // The two boxes begin to overlap on y first and on x last.
    expect(manifold_at(block, block, (-9.0, 3.0), (8.0, -2.0)), (-1.0, 0.0), 5.0);
}

#[test]
fn the_manifold_holds_every_hit_and_no_pass_at_the_present_velocities() {
    let mut rng = Rng::new(5, 0);
    let (mut hits, mut passes) = (0, 0);
    for _ in 0..50_000 {
        let mut shape = || match rng.below(2) {
            0 => Shape::circle(rng.range(0.05, 1.0)),
            _ => Shape::rect(rng.range(0.1, 2.0), rng.range(0.1, 2.0)),
        };
        let (a, b) = (shape(), shape());
        let at = Vec2::new(rng.range(-8.0, 8.0), rng.range(-8.0, 8.0));
        let path = Vec2::new(rng.range(-20.0, 20.0), rng.range(-20.0, 20.0));
        if collide(a, Vec2::ZERO, b, at, (0, 1)).is_some() {
            continue;
        }
        // The path is sampled finely, with a margin so that neither a graze nor the tolerance at corners makes a
        // difference.
        let deepest = (0..=2000)
            .filter_map(|k| collide(a, Vec2::ZERO, b, at + path * (k as f32 / 2000.0), (0, 1)))
            .fold(0.0, |deepest, overlap| max(deepest, -overlap.separation));
        let manifold = manifold_at(a, b, (at.x, at.y), (path.x, path.y));
        let left = manifold.map_or(0.0, |manifold| manifold.separation + manifold.normal.dot(path));
        if deepest > 2.0 * CORNER {
            hits += 1;
            assert!(left < 0.0, "{a:?} {b:?} {at} {path}: passes through, {manifold:?}");
        } else if deepest == 0.0 {
            passes += 1;
            assert!(left > -0.02, "{a:?} {b:?} {at} {path}: hits a ghost, {manifold:?}");
        }
    }
    assert!(hits > 3_000 && passes > 20_000, "{hits} hits and {passes} passes");
}

#[test]
fn boxes_keep_their_axis_and_never_catch_on_a_corner() {
    let block = Shape::rect(2.0, 2.0);
    let between = |at: (f32, f32), kept| {
        between(placed(block, 0.0, 0.0, 0), placed(block, at.0, at.1, 1), Vec2::ZERO, kept)
    };
    // With overlaps of 0.1 and 0.11, this is the axis of least overlap, unless the contact was on the other axis.
    expect(between((1.9, 1.89), Axis::Free), (1.0, 0.0), -0.1);
    expect(between((1.9, 1.89), Axis::Y), (0.0, 1.0), -0.11);
    expect(between((1.9, 1.85), Axis::Y), (1.0, 0.0), -0.1);
    assert_eq!(between((1.995, 1.999), Axis::Free), None);
}

#[test]
fn a_box_that_slides_over_flush_tiles_touches_only_their_tops() {
    let tile = Shape::rect(2.0, 2.0);
    for path in [0.01, 0.5, 1.5] {
        let manifold = manifold_at(tile, tile, (-2.3, 2.0), (path, 0.0));
        let ahead = manifold.map_or(0.0, |manifold| {
            manifold.separation + manifold.normal.dot(Vec2::new(path, 0.0))
        });
        assert!(ahead >= 0.0, "stopped by {manifold:?}");
    }
}
