//! Tests which shapes overlap (A1.12 to A1.17), how deeply and along which normal (A2.13 to A2.17), and that the
//! chapter's defects of detection are avoided (C01 to C07).

use super::*;
use crate::rng::Rng;

const IDS: (u32, u32) = (0, 1);

fn circle(radius: f32) -> Shape {
    Shape::circle(radius)
}

fn rect(width: f32, height: f32) -> Shape {
    Shape::rect(width, height)
}

fn at(a: Shape, b: Shape, x: f32, y: f32) -> Option<Manifold> {
    collide(a, Vec2::ZERO, b, Vec2::new(x, y), IDS)
}

#[track_caller]
fn expect(manifold: Option<Manifold>, normal: (f32, f32), depth: f32) {
    let manifold = manifold.expect("the shapes overlap");
    let found = -manifold.separation;
    let off = (manifold.normal - Vec2::new(normal.0, normal.1)).length();
    assert!(off < 1e-5, "normal {} instead of {normal:?}", manifold.normal);
    assert!((found - depth).abs() < 1e-5, "depth {found} instead of {depth}");
}

#[test]
fn circles_overlap_below_the_sum_of_radii_and_not_at_it() {
    expect(at(circle(3.0), circle(2.0), 4.0, 0.0), (1.0, 0.0), 1.0);
    expect(at(circle(3.0), circle(2.0), 0.0, -4.5), (0.0, -1.0), 0.5);
    assert_eq!(at(circle(3.0), circle(2.0), 5.0, 0.0), None, "touching is no contact (C01)");
    assert_eq!(at(circle(3.0), circle(2.0), 3.0, 4.0), None, "touching is no contact (C01)");
    assert_eq!(at(circle(3.0), circle(2.0), 5.1, 0.0), None);
}

#[test]
fn concentric_circles_separate_at_full_depth_in_varied_directions() {
    expect(at(circle(6.5), circle(6.5), 0.0, 0.0), (0.0, 1.0), 13.0);
    expect(at(circle(6.5), circle(6.5), 1e-7, 0.0), (0.0, 1.0), 13.0);
    let mut sum = Vec2::ZERO;
    for id in 1..=40 {
        let heap = collide(circle(1.0), Vec2::ONE, circle(1.0), Vec2::ONE, (0, id));
        let manifold = heap.expect("one centre overlaps");
        assert!((manifold.normal.length() - 1.0).abs() < 1e-6);
        let swapped = collide(circle(1.0), Vec2::ONE, circle(1.0), Vec2::ONE, (id, 0));
        assert_eq!(swapped.expect("overlap").normal, -manifold.normal);
        sum += manifold.normal;
    }
    assert!(sum.length() < 4.0, "40 pairs leave in one direction: {sum} (C04)");
}

#[test]
fn boxes_separate_along_the_axis_of_least_overlap() {
    let (a, b) = (rect(10.0, 4.0), rect(6.0, 2.0));
    expect(at(a, b, 7.5, 0.0), (1.0, 0.0), 0.5);
    expect(at(a, b, -7.5, 0.5), (-1.0, 0.0), 0.5);
    expect(at(a, b, 3.0, 2.75), (0.0, 1.0), 0.25);
    expect(at(a, b, 3.0, -2.75), (0.0, -1.0), 0.25);
    expect(at(rect(2.0, 2.0), rect(2.0, 2.0), 1.0, 1.0), (0.0, 1.0), 1.0);
    expect(at(rect(4.0, 2.0), rect(4.0, 2.0), 0.0, 0.0), (0.0, 1.0), 2.0);
    assert_eq!(at(a, b, 8.0, 0.0), None, "touching is no contact (A1.14)");
    assert_eq!(at(a, b, 0.0, 3.0), None, "touching is no contact (A1.14)");
    assert_eq!(at(a, b, 8.1, 0.0), None);
}

#[test]
fn a_circle_outside_a_box_is_pushed_from_the_nearest_point() {
    let platform = rect(30.0, 3.0);
    expect(at(platform, circle(2.0), 4.0, 3.0), (0.0, 1.0), 0.5);
    expect(at(platform, circle(2.0), 4.0, -3.0), (0.0, -1.0), 0.5);
    expect(at(platform, circle(2.0), 16.5, 1.0), (1.0, 0.0), 0.5);
    expect(at(platform, circle(2.0), -16.5, 1.0), (-1.0, 0.0), 0.5);
}

#[test]
fn a_circle_at_a_corner_touches_only_within_its_radius() {
    let block = rect(2.0, 2.0);
    expect(at(block, circle(6.0), 4.0, 5.0), (0.6, 0.8), 1.0);
    assert_eq!(at(block, circle(5.0), 4.0, 5.0), None, "touching is no contact");
    assert_eq!(at(block, circle(4.9), 4.0, 5.0), None, "the boxes overlap, the shapes do not");
    assert_eq!(at(block, circle(1.0), 2.0, 0.0), None, "touching is no contact");
}

#[test]
fn a_center_inside_a_box_leaves_by_the_nearest_of_all_four_sides() {
    for (width, height) in [(30.0, 3.0), (2.0, 16.0), (16.0, 22.0)] {
        let (shape, half) = (rect(width, height), Vec2::new(width, height) * 0.5);
        let radius = 1.5;
        let inside = 0.1;
        let depth = radius + inside;
        expect(at(shape, circle(radius), half.x - inside, 0.0), (1.0, 0.0), depth);
        expect(at(shape, circle(radius), inside - half.x, 0.0), (-1.0, 0.0), depth);
        expect(at(shape, circle(radius), 0.0, half.y - inside), (0.0, 1.0), depth);
        expect(at(shape, circle(radius), 0.0, inside - half.y), (0.0, -1.0), depth);
    }
    expect(at(rect(2.0, 2.0), circle(1.0), 0.0, 0.0), (0.0, 1.0), 2.0);
}

#[test]
fn a_center_on_the_border_of_a_box_leaves_outwards_at_full_radius() {
    let block = rect(30.0, 3.0);
    expect(at(block, circle(2.0), 15.0, 0.0), (1.0, 0.0), 2.0);
    expect(at(block, circle(2.0), -15.0, 0.0), (-1.0, 0.0), 2.0);
    expect(at(block, circle(2.0), 3.0, 1.5), (0.0, 1.0), 2.0);
    expect(at(block, circle(2.0), 3.0, -1.5), (0.0, -1.0), 2.0);
    expect(at(block, circle(2.0), 15.0, 1.5), (0.0, 1.0), 2.0);
}

#[test]
fn containment_is_strict() {
    assert!(circle(2.0).contains(Vec2::new(1.9, 0.0)));
    assert!(!circle(2.0).contains(Vec2::new(2.0, 0.0)));
    assert!(rect(4.0, 2.0).contains(Vec2::new(1.9, -0.9)));
    assert!(!rect(4.0, 2.0).contains(Vec2::new(2.0, 0.0)));
}

#[test]
fn either_order_gives_the_same_manifold_and_a_unit_normal() {
    let mut rng = Rng::new(11, 0);
    let draw_shape = |rng: &mut Rng| {
        if rng.unit() < 0.5 {
            circle(rng.range(0.01, 4.0))
        } else {
            rect(rng.range(0.01, 8.0), rng.range(0.01, 8.0))
        }
    };
    let mut hits = 0;
    for _ in 0..20_000 {
        let (a, b) = (draw_shape(&mut rng), draw_shape(&mut rng));
        let position = |rng: &mut Rng| Vec2::new(rng.range(-4.0, 4.0), rng.range(-4.0, 4.0));
        let (center_a, center_b) = (position(&mut rng), position(&mut rng));
        let there = collide(a, center_a, b, center_b, (3, 9));
        let back = collide(b, center_b, a, center_a, (9, 3));
        assert_eq!(there.map(Manifold::flipped), back, "{a:?} {center_a} {b:?} {center_b}");
        if let Some(manifold) = there {
            hits += 1;
            assert!((manifold.normal.length() - 1.0).abs() < 1e-5);
            assert!(manifold.separation < 0.0);
        }
    }
    assert!((5_000..15_000).contains(&hits), "{hits} of 20000 placements overlap");
}

#[test]
fn moving_by_the_depth_separates_the_shapes() {
    let mut rng = Rng::new(12, 0);
    for _ in 0..5_000 {
        let (a, b) = (circle(rng.range(0.5, 3.0)), rect(rng.range(1.0, 6.0), rng.range(1.0, 6.0)));
        let center = Vec2::new(rng.range(-4.0, 4.0), rng.range(-4.0, 4.0));
        let Some(manifold) = collide(a, Vec2::ZERO, b, center, IDS) else { continue };
        let moved = center + manifold.normal * (1e-4 - manifold.separation);
        assert_eq!(collide(a, Vec2::ZERO, b, moved, IDS), None, "{a:?} {b:?} {center}");
    }
}

#[test]
fn a_corner_distance_too_small_to_square_still_has_a_unit_normal() {
    let block = rect(2.0, 2.0);
    let corner = 1.0 + f32::EPSILON;
    let manifold = at(block, circle(1e-3), corner, corner).expect("a corner inside the radius");
    assert!((manifold.normal.length() - 1.0).abs() < 1e-5, "normal {} (C05)", manifold.normal);
}
