//! Tests of the test helpers for pictures and random guest scenes.

use jostle_server::guests::read;
use jostle_server::limits::GUEST_BUDGET;
use jostle_tests::guest_scenes::{DEAR, random_scene};
use jostle_tests::picture::{Difference, Picture};
use std::collections::BTreeSet;

#[test]
fn random_scenes_keep_to_the_budget_or_are_refused_by_many_fields() {
    let (mut kept, mut fields) = (0, BTreeSet::new());
    for seed in 0..1000 {
        match read(random_scene(seed).as_bytes()) {
            Ok(scene) => {
                kept += 1;
                assert_eq!(GUEST_BUDGET.check(&scene), Ok(()));
                assert!(scene.world.bodies_max <= GUEST_BUDGET.bodies);
            }
            Err(error) => drop(fields.insert(error.field)),
        }
    }
    println!("{kept} kept, {fields:?}");
    assert!((200..800).contains(&kept), "{kept} of 1000 keep to the budget");
    assert!(fields.len() > 8, "refused by {fields:?}");
    assert!(read(DEAR.as_bytes()).is_ok_and(|scene| scene.layouts[0].count == 990));
}

fn picture(rgb: &[[u8; 3]]) -> Picture {
    Picture { width: rgb.len() as u32, height: 1, rgb: rgb.to_vec() }
}

#[test]
fn a_picture_survives_a_png() {
    let original = picture(&[[1, 2, 3], [250, 0, 128]]);
    let png = original.encode().unwrap();
    assert_eq!(Picture::decode(&png).unwrap(), original);
    assert!(Picture::decode(&png[..20]).is_err());
}

#[test]
fn differences_are_measured() {
    let (left, right) = (picture(&[[0; 3], [10, 10, 10]]), picture(&[[0; 3], [10, 13, 22]]));
    let difference = left.compare(&right, 8).unwrap();
    assert_eq!(difference, Difference { mean: 15.0 / 6.0, max: 12, outliers: 1 });
    assert!(left.compare(&picture(&[[0; 3]]), 8).is_err());
}

#[test]
fn pixels_are_counted_around_a_point() {
    let row = picture(&[[255; 3], [0; 3], [255; 3], [255; 3]]);
    assert_eq!(row.count_near(0.5, 0.5, 2.0, |pixel| pixel[0] == 255), 2);
    assert_eq!(row.colors(), 2);
    assert_eq!(row.pixel(1.2, 9.0), [0; 3]);
}
