//! Tests the meter with pictures of known flashes, and the golden replays with the meter.

use super::{FLASHES_MAX, FlashMeter, SIZE, of_replay};
use crate::{Headless, Picture};
use jostle_client_web::replay::player::ReplayPlayer;
use jostle_game::Seat;
use std::fs;
use std::path::Path;
use std::thread;

/// A picture whose left part, a share of the whole, has one colour and whose rest is black.
fn picture(share: f32, [r, g, b]: [u8; 3]) -> Picture {
    let [width, height] = SIZE;
    let is_left = |pixel: u32| ((pixel % width) as f32) < share * width as f32;
    let pixel = |at| if is_left(at) { [r, g, b, 255] } else { [0, 0, 0, 255] };
    Picture { size: SIZE, rgba: (0..width * height).flat_map(pixel).collect() }
}

/// The most flashes per second when the left part of the picture alternates between two colours at a rate per second.
fn flashes(share: f32, colors: [[u8; 3]; 2], rate: u32) -> u32 {
    let mut meter = FlashMeter::new(60.0);
    for frame in 0..180 {
        let half = (frame * rate * 2 / 60) % 2;
        meter.note(&picture(share, colors[half as usize]));
    }
    meter.worst().flashes
}

#[test]
fn flashes_are_counted_by_area_contrast_and_rate() {
    let (black, white, grey) = ([0; 3], [255; 3], [110; 3]);
    for rate in [1, 2, 3, 5, 10, 15] {
        assert_eq!(flashes(1.0, [black, white], rate), rate, "{rate} a second");
        assert_eq!(flashes(0.3, [black, grey], rate), rate, "{rate} a second, less of it");
        assert_eq!(flashes(0.2, [black, white], rate), 0, "too small a part");
        assert_eq!(flashes(1.0, [[100; 3], grey], rate), 0, "too little contrast");
        assert_eq!(flashes(1.0, [[240; 3], white], rate), 0, "both are bright");
        assert_eq!(flashes(1.0, [[160, 0, 0], [100, 60, 0]], rate), rate, "saturated red");
    }
}

#[test]
fn slow_brightening_and_a_moving_edge_are_no_flashes() {
    let mut meter = FlashMeter::new(60.0);
    for frame in 0..=255 {
        meter.note(&picture(1.0, [frame; 3]));
    }
    for frame in 0..60 {
        meter.note(&picture(1.0 - frame as f32 / 60.0, [255; 3]));
    }
    assert_eq!(meter.worst().flashes, 0, "up at once, but down piece by piece");
}

#[test]
fn no_golden_replay_flashes_more_than_three_times_a_second() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/goldens/replays");
    let files = fs::read_dir(folder).expect("the golden replays");
    let mut paths: Vec<_> = files.map(|entry| entry.expect("an entry").path()).collect();
    paths.sort();
    assert!(paths.len() > 20, "{paths:?}");
    let half = paths.len().div_ceil(2);
    thread::scope(|scope| {
        for paths in paths.chunks(half) {
            scope.spawn(|| paths.iter().for_each(|path| check_flashes(path)));
        }
    });
}

/// Counts the flashes that a spectator sees, and those that the first player sees.
fn check_flashes(path: &Path) {
    let mut headless = Headless::open().expect("an adapter; Mesa's software drivers will do");
    for follow in [None, Some(Seat(0))] {
        let bytes = fs::read(path).expect("a golden replay");
        let mut player = ReplayPlayer::open(bytes).expect("a golden replay");
        player.follow(follow);
        let worst = of_replay(&mut headless, &mut player).expect("pictures");
        let name = path.display();
        println!("{name}, {follow:?}: {worst:?}");
        assert!(worst.flashes <= FLASHES_MAX, "{name}: {worst:?}");
    }
}
