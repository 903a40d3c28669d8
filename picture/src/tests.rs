//! Tests rendering without a window on any available adapter.

use super::{Headless, Picture};
use jostle_client_web::replay::player::ReplayPlayer;
use jostle_client_web::view::draw::DrawList;
use jostle_client_web::view::frame::{Frame, FrameBody, FrameRoom, View};
use jostle_client_web::view::palette::{self, INK};
use jostle_game::Kind;
use jostle_sim::{BodyId, EmitterDef, Particles, Recipe, Shape, Source, Vec2};
use std::fs;
use std::io::BufReader;
use std::path::Path;

/// A point far outside the world, where the ground has a uniform dark colour.
const DARK: Vec2 = Vec2::new(-9000.0, -9000.0);
const SIZE: [u32; 2] = [64, 64];

fn open() -> Headless {
    Headless::open().expect("an adapter; Mesa's software drivers will do")
}

fn room(bodies: &[FrameBody]) -> FrameRoom {
    FrameRoom { bodies: bodies.to_vec(), ..FrameRoom::default() }
}

fn frame<'a>(center: Vec2, room: &'a FrameRoom, particles: &'a Particles) -> Frame<'a> {
    Frame {
        view: View { center, height: 40.0, pixels: SIZE },
        world_size: Vec2::new(200.0, 112.5),
        room,
        particles,
        particle_lead: 0.0,
        time: 1.0,
        bounds: false,
        calm: false,
        copy: 0,
        dimmed: false,
        sketch: None,
        ghost: None,
    }
}

fn draw(headless: &mut Headless, frame: &Frame) -> Picture {
    let mut list = DrawList::new();
    list.fill(frame);
    headless.picture(SIZE, &list).expect("the picture can be read back")
}

/// Motionless particles of one tint at a single point.
fn heap(count: u16, tint: [f32; 3], at: Vec2) -> Particles {
    let [r, g, b] = tint;
    let recipe = Recipe {
        life_ticks: [1000, 1000],
        color_start: [r, g, b, 1.0],
        color_end: [[r, g, b, 1.0]; 2],
        size: [24.0, 24.0],
        size_factor: 1.0,
        velocity: [Vec2::ZERO; 2],
        acceleration: Vec2::ZERO,
        ..Recipe::default()
    };
    let mut particles = Particles::new(vec![recipe], 100);
    particles.start(EmitterDef { recipe: 0, count, seed: 1, source: Source::Point(at) });
    particles.step(&[], |_| None);
    assert_eq!(particles.len(), usize::from(count));
    particles
}

#[test]
fn particles_add_up_until_they_saturate() {
    let mut headless = open();
    let ground = draw(&mut headless, &frame(DARK, &room(&[]), &Particles::default()));
    let tint = [100.0 / 255.0, 40.0 / 255.0, 10.0 / 255.0];
    for count in [1, 2, 3, 4] {
        let particles = heap(count, tint, DARK);
        let picture = draw(&mut headless, &frame(DARK, &room(&[]), &particles));
        let under = ground.pixel(32, 32);
        let sum = [100, 40, 10, 0].map(|c| c * u32::from(count));
        let expected = [0, 1, 2, 3].map(|i| (u32::from(under[i]) + sum[i]).min(255) as u8);
        assert_eq!(picture.pixel(32, 32), expected, "{count} on {}", headless.adapter);
        assert_eq!(picture.pixel(1, 1), ground.pixel(1, 1), "nothing beside them");
    }
    let bright = heap(1, [4.0, 0.5, 0.25], DARK);
    let pixel = draw(&mut headless, &frame(DARK, &room(&[]), &bright)).pixel(32, 32);
    assert_eq!((pixel[0], pixel[3]), (255, 255), "a tint may exceed 1: {pixel:?}");
}

#[test]
fn drawing_after_particles_has_normal_alpha() {
    let mut headless = open();
    let particles = heap(4, [1.0, 1.0, 1.0], DARK);
    let (empty, square) = (room(&[]), room(&[body(Kind::Platform, Shape::rect(20.0, 20.0))]));
    let dimmed = Frame { dimmed: true, ..frame(DARK, &empty, &particles) };
    let pixel = draw(&mut headless, &dimmed).pixel(32, 32);
    for (channel, ink) in pixel.into_iter().zip(INK[0]) {
        let veil = 158.0 / 255.0;
        let expected = 255.0 * (1.0 - veil) + f32::from(ink) * veil;
        assert!((f32::from(channel) - expected).abs() <= 1.0, "{pixel:?}");
    }
    let bounds = Frame { bounds: true, ..frame(DARK, &square, &particles) };
    let picture = draw(&mut headless, &bounds);
    // The left side of the box, 10 units from the centre, is drawn over saturated particles.
    let red = (14..18).any(|x| picture.pixel(x, 32)[0] > 150 && picture.pixel(x, 32)[1] < 60);
    assert!(red, "{:?}", [14, 15, 16, 17].map(|x| picture.pixel(x, 32)));
}

#[test]
fn a_scene_without_particles_makes_no_particle_pipeline() {
    let mut headless = open();
    let hero = body(Kind::Hero, Shape::rect(16.0, 22.0));
    draw(&mut headless, &frame(DARK, &room(&[hero]), &Particles::default()));
    assert_eq!(headless.renderer.made().pipelines, ["ground", "solids"]);
    draw(&mut headless, &frame(DARK, &room(&[hero]), &heap(1, [1.0; 3], DARK)));
    let made = headless.renderer.made();
    assert_eq!(made.pipelines, ["ground", "solids", "particles"]);
    assert_eq!(made.textures[1], ("particle sprite", 64 * 64 * 4));
}

#[test]
fn a_hero_has_its_players_colour_on_a_dark_stage() {
    let mut headless = open();
    let at = Vec2::new(100.0, 56.25);
    for color in 0..8 {
        let mut hero = body(Kind::Hero, Shape::rect(16.0, 22.0));
        hero.center = at;
        hero.color = Some(color);
        let picture = draw(&mut headless, &frame(at, &room(&[hero]), &Particles::default()));
        // Below the face, above the shaded edge.
        let found = picture.pixel(32, 40);
        for (channel, wanted) in found.into_iter().zip(palette::player(color)) {
            let away = i32::from(channel) - i32::from(wanted);
            assert!(away.abs() < 44, "player {color}: {found:?}");
        }
        let stage = picture.pixel(3, 32);
        assert!(stage[..3].iter().all(|&c| c < 100), "the stage is dark: {stage:?}");
        assert_eq!(stage[3], 255, "the canvas is opaque");
    }
}

fn body(kind: Kind, shape: Shape) -> FrameBody {
    FrameBody {
        id: BodyId { index: 0, generation: 0 },
        kind,
        color: None,
        shape,
        center: DARK,
        velocity: Vec2::ZERO,
        age: 10.0,
        gaze: None,
        touching: false,
        hidden: false,
        hot: false,
        cracked: false,
        ring: None,
        squash: None,
    }
}

/// The browser tests compare the page's drawing of the same tick and view with the same file.
#[test]
fn a_tick_of_a_golden_replay_looks_as_it_does_in_the_page() {
    let goldens = Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/goldens");
    let bytes = fs::read(goldens.join("replays/arena.jostle")).expect("the golden replay");
    let mut player = ReplayPlayer::open(bytes).expect("a replay");
    player.seek(240);
    let (center, height, pixels) = (Vec2::new(160.0, 44.1), 275.4, [640, 360]);
    let mut list = DrawList::new();
    list.fill(&player.frame(View { center, height, pixels }));
    let mut headless = open();
    let drawn = headless.picture(pixels, &list).expect("the picture can be read back");

    let file = fs::File::open(goldens.join("replay.png")).expect("the golden picture");
    let mut reader = png::Decoder::new(BufReader::new(file)).read_info().expect("a PNG");
    let mut golden = vec![0; reader.output_buffer_size().expect("a size")];
    reader.next_frame(&mut golden).expect("a whole PNG");
    assert_eq!((reader.info().width, reader.info().height), pixels.into());
    let drawn = drawn.rgba.chunks_exact(4).flat_map(|pixel| &pixel[..3]);
    let apart: Vec<u8> = drawn.zip(&golden).map(|(a, b)| a.abs_diff(*b)).collect();
    assert_eq!(apart.len(), golden.len());
    let mean = apart.iter().map(|&apart| f64::from(apart)).sum::<f64>() / apart.len() as f64;
    let outliers = apart.iter().filter(|&&apart| apart > 8).count();
    assert!(mean < 0.5, "the mean difference of a channel is {mean}");
    assert!(outliers < apart.len() / 1000, "{outliers} of {} channels differ", apart.len());
}
