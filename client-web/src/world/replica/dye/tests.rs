use super::*;
use jostle_game::{Scene, Seat};
use jostle_sim::Shape;
use std::sync::Arc;

fn sample(index: u32, kind: Kind, size: Vec2, center: Vec2) -> Sample {
    Sample {
        id: BodyId { index, generation: 0 },
        kind,
        owner: None,
        group: 0,
        shape: Shape::rect(size.x, size.y),
        center,
        velocity: Vec2::ZERO,
    }
}

/// A hero on a platform, below a ceiling that is far away.
fn room() -> RoomView {
    let scene = Scene::built_in().into_iter().find(|scene| scene.name == "splash");
    let mut room = RoomView::new(Arc::new(scene.expect("a shipped scene")), Seat(0));
    room.samples = vec![
        sample(0, Kind::Hero, Vec2::new(9.0, 12.0), Vec2::new(50.0, 58.0)),
        sample(1, Kind::Platform, Vec2::new(40.0, 4.0), Vec2::new(50.0, 50.0)),
        sample(2, Kind::Wall, Vec2::new(400.0, 40.0), Vec2::new(160.0, 180.0)),
        sample(3, Kind::Hero, Vec2::new(9.0, 12.0), Vec2::new(62.0, 58.0)),
    ];
    room
}

fn shown(dye: &mut Dye, room: &mut RoomView, tick: f64) -> FrameRoom {
    let mut drawn = FrameRoom::default();
    room.display = tick;
    dye.lay_out(room, &mut drawn);
    drawn
}

#[test]
fn a_burst_stains_the_hero_and_the_platform_and_fades_in_half_a_minute() {
    let (mut dye, mut room) = (Dye::default(), room());
    let hero = room.samples[0].id;
    dye.burst(&room, 100, hero, Vec2::new(46.0, 57.0), 2);
    let drawn = shown(&mut dye, &mut room, 100.0);
    let bodies: Vec<u32> = drawn.stains.iter().map(|stain| stain.body.index).collect();
    assert_eq!(bodies, [0, 1], "neither the far wall nor the other hero");
    for stain in &drawn.stains {
        let body = &room.samples[stain.body.index as usize];
        let reach = (stain.at * body.shape.half_extent()).abs() + stain.half;
        assert!(reach.cmple(body.shape.half_extent() + Vec2::splat(1e-3)).all(), "{stain:?}");
        assert_eq!((stain.color, stain.left), (2, 1.0));
    }
    assert!(drawn.stains[1].at.y > 0.0, "on the upper side");
    let half = shown(&mut dye, &mut room, 1000.0);
    assert!((half.stains[0].left - 0.5).abs() < 1e-3);
    assert!(shown(&mut dye, &mut room, 1901.0).stains.is_empty());
}

#[test]
fn stains_and_dyed_bursts_are_bounded() {
    let (mut dye, mut room) = (Dye::default(), room());
    let hero = room.samples[0].id;
    let at = Vec2::new(46.0, 57.0);
    for seed in 0..1000 {
        dye.burst(&room, 100, hero, at, 2);
        let source = Source::Point(at);
        dye.emit(100, EmitterDef { recipe: 0, count: 5000, seed, source });
    }
    let drawn = shown(&mut dye, &mut room, 101.0);
    assert_eq!(drawn.stains.len(), STAINS_MAX);
    assert_eq!(drawn.dyes.len(), BURSTS_MAX * DYED_MAX);
    assert!(drawn.dyes.is_sorted());
    assert!(shown(&mut dye, &mut room, 500.0).dyes.is_empty());
}

#[test]
fn only_the_emitter_of_a_burst_is_dyed() {
    let (mut dye, mut room) = (Dye::default(), room());
    let (hero, at) = (room.samples[0].id, Vec2::new(46.0, 57.0));
    let emitter = |at| EmitterDef { recipe: 0, count: 9, seed: 4, source: Source::Point(at) };
    dye.burst(&room, 100, hero, at, 5);
    dye.emit(100, emitter(Vec2::new(90.0, 57.0)));
    assert!(shown(&mut dye, &mut room, 100.0).dyes.is_empty(), "another explosion");
    dye.emit(100, emitter(at));
    dye.emit(100, emitter(at));
    let mut seeds = emitter(at).seeds();
    seeds.sort_unstable();
    let dyes = shown(&mut dye, &mut room, 100.0).dyes;
    assert_eq!(dyes, seeds.into_iter().map(|seed| (seed, 5)).collect::<Vec<_>>());
}

#[test]
fn bursts_flash_at_most_three_times_a_second() {
    let mut dye = Dye::default();
    let flashes: Vec<u32> = (0..600).filter(|&tick| dye.flashes(tick)).collect();
    assert!(flashes.windows(2).all(|two| two[1] - two[0] >= 20));
    assert_eq!(flashes.len(), 30);
}
