//! Tests of the draw list: drawn items, their colours and order, and culling.

use super::*;
use crate::view::frame::{Effect, EffectKind, FrameBody, FrameRoom, View};
use jostle_game::scene::Plan;
use jostle_game::{Kind, Scene};
use jostle_sim::{BodyId, EmitterDef, Particles, Recipe, Shape, Source};

const VIEW: View = View { center: Vec2::new(100.0, 56.25), height: 112.5, pixels: [1280, 720] };

fn body(index: u32, kind: Kind, shape: Shape, center: Vec2) -> FrameBody {
    FrameBody {
        id: BodyId { index, generation: 0 },
        kind,
        color: None,
        shape,
        center,
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

fn room(bodies: &[FrameBody]) -> FrameRoom {
    FrameRoom { bodies: bodies.to_vec(), ..FrameRoom::default() }
}

fn frame<'a>(room: &'a FrameRoom, particles: &'a Particles) -> Frame<'a> {
    Frame {
        view: VIEW,
        world_size: Vec2::new(200.0, 112.5),
        room,
        particles,
        particle_lead: 0.0,
        time: 1.0,
        bounds: false,
        calm: true,
        copy: 0,
        dimmed: false,
        sketch: None,
        ghost: None,
    }
}

fn quads(vertices: &[SolidVertex]) -> Vec<SolidVertex> {
    for four in vertices.chunks(4) {
        assert_eq!(four.len(), 4, "quads have four vertices");
        assert!(four.iter().all(|v| v == &four[0]), "the four vertices of a quad are equal");
    }
    vertices.iter().step_by(4).copied().collect()
}

/// The quads above the particles when `bodies` are shown with outlines.
fn bounds_of(bodies: &[FrameBody]) -> Vec<SolidVertex> {
    let particles = Particles::default();
    let mut list = DrawList::new();
    list.fill(&Frame { bounds: true, ..frame(&room(bodies), &particles) });
    quads(&list.solids()[list.overlay_start..])
}

/// The two end points of a drawn line. Its round ends extend half its width beyond them.
fn ends(line: &SolidVertex) -> [Vec2; 2] {
    let along = Vec2::from(line.axis) * (line.half[0] - line.half[1]);
    [Vec2::from(line.center) - along, Vec2::from(line.center) + along]
}

fn burst(count: u16, at: Vec2, ticks: usize) -> Particles {
    let mut particles = Particles::new(vec![Recipe::default()], 30_000);
    let source = Source::Point(at);
    particles.start(EmitterDef { recipe: 0, count, seed: 3, source });
    for _ in 0..ticks {
        particles.step(&[], |_| None);
    }
    particles
}

#[test]
fn a_circle_has_sixteen_segments_from_angle_zero() {
    let center = Vec2::new(50.0, 50.0);
    let lines = bounds_of(&[body(0, Kind::Hero, Shape::circle(9.0), center)]);
    assert_eq!(lines.len(), 16 + 2, "16 segments and the two strokes of the mark");
    for (i, line) in lines[..16].iter().enumerate() {
        let [from, to] = ends(line);
        for (point, step) in [(from, i), (to, i + 1)] {
            let angle = step as f32 * std::f32::consts::TAU / 16.0;
            let corner = center + Vec2::from_angle(angle) * 9.0;
            assert!(point.distance(corner) < 1e-3, "segment {i}: {point} is not {corner}");
        }
    }
}

#[test]
fn a_box_has_four_sides_and_a_mark_of_half_a_unit() {
    let center = Vec2::new(50.0, 50.0);
    let lines = bounds_of(&[body(0, Kind::Block, Shape::rect(10.0, 6.0), center)]);
    assert_eq!(lines.len(), 4 + 2);
    for line in &lines[..4] {
        for end in ends(line) {
            let away = (end - center).abs();
            assert!(away.distance(Vec2::new(5.0, 3.0)) < 1e-3, "{end} is no corner");
        }
    }
    for line in &lines[4..] {
        for end in ends(line) {
            let away = (end - center).abs();
            assert!(away.distance(Vec2::splat(0.25)) < 1e-3, "{end} is no corner of the mark");
        }
    }
}

#[test]
fn bounds_have_the_colours_of_the_chapter() {
    let colors = [
        (Kind::Hero, [0, 255, 0, 255]),
        (Kind::Minion, [0, 255, 0, 255]),
        (Kind::Marble, [255, 255, 255, 255]),
        (Kind::Platform, [255, 51, 51, 255]),
    ];
    for (kind, color) in colors {
        let mut shown = body(0, kind, Shape::rect(8.0, 8.0), Vec2::new(50.0, 50.0));
        assert!(bounds_of(&[shown]).iter().all(|line| line.fill == color), "{}", kind.name());
        shown.touching = true;
        let red = [255, 0, 0, 255];
        assert!(bounds_of(&[shown]).iter().all(|line| line.fill == red), "{}", kind.name());
    }
}

#[test]
fn a_hidden_body_keeps_only_its_bounds() {
    let particles = Particles::default();
    let mut shown = body(0, Kind::Hero, Shape::circle(9.0), Vec2::new(50.0, 50.0));
    shown.hidden = true;
    let mut list = DrawList::new();
    list.fill(&Frame { bounds: true, ..frame(&room(&[shown]), &particles) });
    assert_eq!(list.overlay_start, 0, "nothing under the bounds");
    let quads = list.solids();
    let is_fill = |quad: &&SolidVertex| quad.half == [9.0, 9.0];
    let fill = quads.iter().find(is_fill).expect("its inside is filled");
    assert!(fill.fill[3] < 128, "lightly: {:?}", fill.fill);
}

#[test]
fn bodies_out_of_view_cost_nothing() {
    let far = Vec2::new(1000.0, 56.0);
    let bodies: Vec<_> =
        Kind::ALL.iter().map(|&kind| body(0, kind, Shape::circle(5.0), far)).collect();
    let particles = burst(50, far, 5);
    assert!(!particles.is_empty());
    let mut list = DrawList::new();
    let effect = Effect {
        kind: EffectKind::Splash,
        point: far,
        age: 0.1,
        color: Some(1),
        strength: 1.0,
        body: None,
    };
    list.fill(&Frame {
        bounds: true,
        ..frame(&FrameRoom { effects: vec![effect], ..room(&bodies) }, &particles)
    });
    assert!(list.solids().is_empty());
    assert!(list.particles.is_empty());
    assert!(!list.light.lit);
}

#[test]
fn a_body_half_in_view_is_drawn() {
    let particles = Particles::default();
    let edge = Vec2::new(-4.0, 56.0);
    let mut list = DrawList::new();
    list.fill(&frame(&room(&[body(0, Kind::Block, Shape::rect(10.0, 10.0), edge)]), &particles));
    assert!(quads(list.solids()).iter().any(|q| q.kind == SolidKind::Crate as u32));
}

#[test]
fn a_crowd_is_drawn_in_full_and_without_allocations() {
    let bodies: Vec<_> = (0..5000)
        .map(|i| {
            let at = Vec2::new((i % 100) as f32 * 2.0, (i / 100) as f32 * 2.0);
            body(i, Kind::Marble, Shape::circle(1.0), at)
        })
        .collect();
    let particles = burst(20_000, Vec2::new(100.0, 56.0), 29);
    let mut list = DrawList::new();
    list.fill(&Frame { calm: false, ..frame(&room(&bodies), &particles) });
    let bodies_drawn =
        quads(list.solids()).iter().filter(|q| q.kind == SolidKind::MatteOval as u32).count();
    assert_eq!(bodies_drawn, 5000);
    assert_eq!(list.particles.len(), particles.len() * 4);
    let before = (list.solids().as_ptr(), list.particles.as_ptr());
    list.fill(&Frame { calm: false, ..frame(&room(&bodies), &particles) });
    assert_eq!((list.solids().as_ptr(), list.particles.as_ptr()), before);
}

#[test]
fn particles_are_drawn_at_their_present_position_with_their_own_look() {
    let particles = burst(5, Vec2::new(100.0, 60.0), 3);
    let mut list = DrawList::new();
    let lead = 0.01;
    list.fill(&Frame { particle_lead: lead, calm: false, ..frame(&room(&[]), &particles) });
    for (i, vertex) in list.particles.iter().step_by(4).enumerate() {
        let place = particles.positions()[i] + particles.velocities()[i] * lead;
        let look = particles.appearance(i);
        assert_eq!(Vec2::from(vertex.center), place);
        assert_eq!(vertex.size, look.size);
        assert_eq!(vertex.tint[..], look.color[..3]);
    }
}

#[test]
fn a_calm_picture_has_few_dim_particles_and_no_flash() {
    let particles = burst(200, Vec2::new(100.0, 60.0), 3);
    let spark = Effect {
        kind: EffectKind::Spark,
        point: Vec2::new(100.0, 60.0),
        age: 0.02,
        strength: 60.0,
        color: None,
        body: None,
    };
    let mut list = DrawList::new();
    let mut drawn = |calm| {
        list.fill(&Frame {
            calm,
            ..frame(&FrameRoom { effects: vec![spark], ..room(&[]) }, &particles)
        });
        let glows =
            quads(list.solids()).iter().filter(|q| q.kind == SolidKind::Glow as u32).count();
        let brightest = list.particles.iter().map(|vertex| vertex.tint[0]).fold(0.0, f32::max);
        (list.particles.len() / 4, brightest, glows)
    };
    let ((many, bright, glows), (few, dim, none)) = (drawn(false), drawn(true));
    assert!(few * 3 < many && few > 0, "{few} of {many}");
    assert!(dim < 0.6 * bright && dim > 0.0, "{dim} of {bright}");
    assert!(glows > 0 && none == 0, "{glows}, then {none}");
}

#[test]
fn a_lost_connection_dims_everything_last() {
    let particles = burst(5, Vec2::new(100.0, 60.0), 3);
    let bodies = [body(0, Kind::Hero, Shape::rect(16.0, 22.0), Vec2::new(50.0, 50.0))];
    let mut list = DrawList::new();
    list.fill(&Frame { bounds: true, dimmed: true, ..frame(&room(&bodies), &particles) });
    let all = quads(list.solids());
    let veil = all.last().expect("a veil");
    assert_eq!(veil.half, list.globals.half, "it covers the view");
    assert!(list.overlay_start < list.solids().len() - 4);
}

/// The light in the cell at this world point, 0..=1.
fn light_at(light: &LightField, point: Vec2) -> [f32; 3] {
    let at = (point - light.low) / light.size() * LIGHT_CELLS as f32;
    let index = (at.y as usize * LIGHT_CELLS + at.x as usize) * 4;
    [0, 1, 2].map(|i| (f32::from(light.texels[index + i]) / 255.0).powi(2))
}

#[test]
fn explosions_light_only_nearby_bodies() {
    let at = Vec2::new(60.0, 56.0);
    let particles = burst(200, at, 20);
    let mut list = DrawList::new();
    list.fill(&Frame { calm: false, ..frame(&room(&[]), &particles) });
    assert_eq!(list.globals.light_on, 1.0);
    let near = light_at(&list.light, at + Vec2::new(6.0, 0.0))[0];
    let far = light_at(&list.light, at + Vec2::new(100.0, 0.0))[0];
    assert!(near > 0.5, "near: {near}");
    assert!(far < 0.02, "far: {far}");
    list.fill(&frame(&room(&[]), &Particles::default()));
    assert_eq!(list.globals.light_on, 0.0, "the light goes out with the fire");
}

/// The ratio of height to width of the first matte box drawn.
fn slimness(list: &DrawList) -> f32 {
    let all = quads(list.solids());
    let matte = all.iter().find(|q| q.kind == SolidKind::MatteBox as u32).expect("a hero");
    matte.half[1] / matte.half[0]
}

#[test]
fn a_landing_flattens_a_hero_for_a_moment() {
    let particles = Particles::default();
    let mut list = DrawList::new();
    let mut hero = body(0, Kind::Hero, Shape::rect(16.0, 22.0), Vec2::new(50.0, 50.0));
    let at_rest = 22.0 / 16.0;
    let mut flattest = f32::MAX;
    for i in 0..120 {
        hero.velocity = if i < 30 { Vec2::new(0.0, -30.0) } else { Vec2::ZERO };
        let time = 1.0 + i as f32 / 60.0;
        list.fill(&Frame { time, calm: false, ..frame(&room(&[hero]), &particles) });
        let now = slimness(&list);
        assert!((now / at_rest - 1.0).abs() < 0.4, "frame {i}: {now}");
        flattest = flattest.min(now);
    }
    assert!(flattest < 0.93 * at_rest, "it never got flatter than {flattest}");
    assert!((slimness(&list) / at_rest - 1.0).abs() < 0.01, "it is itself again");

    list.fill(&Frame { time: 4.0, ..frame(&room(&[hero]), &particles) });
    assert_eq!(slimness(&list), at_rest, "nothing moves for who wants calm");
}

#[test]
fn a_body_in_flight_when_the_connection_was_lost_does_not_land_after_it() {
    let particles = Particles::default();
    let flatness = |copy| {
        let mut list = DrawList::new();
        let mut hero = body(0, Kind::Hero, Shape::rect(16.0, 22.0), Vec2::new(50.0, 50.0));
        hero.velocity = Vec2::new(0.0, -30.0);
        list.fill(&Frame { time: 1.0, calm: false, copy: 1, ..frame(&room(&[hero]), &particles) });
        hero.velocity = Vec2::ZERO;
        list.fill(&Frame { time: 1.05, calm: false, copy, ..frame(&room(&[hero]), &particles) });
        slimness(&list) / (22.0 / 16.0)
    };
    assert!(flatness(1) < 0.99, "a landing");
    assert_eq!(flatness(2), 1.0, "another copy of the room");
}

#[test]
fn a_hit_widens_the_eyes_of_that_hero_only() {
    let particles = Particles::default();
    let heroes = [30.0, 100.0]
        .map(|x| body(x as u32, Kind::Hero, Shape::rect(16.0, 22.0), Vec2::new(x, 50.0)));
    let hit = Effect {
        kind: EffectKind::Splash,
        point: Vec2::new(30.0, 90.0),
        age: 0.05,
        color: Some(2),
        strength: 1.0,
        body: Some(heroes[0].id),
    };
    let mut list = DrawList::new();
    list.fill(&Frame { ..frame(&FrameRoom { effects: vec![hit], ..room(&heroes) }, &particles) });
    let widest = |from: f32, to: f32| {
        let ovals = quads(list.solids()).into_iter().filter(|q| q.kind == SolidKind::Oval as u32);
        let there = ovals.filter(|q| q.center[0] > from && q.center[0] < to && q.center[1] < 60.0);
        there.map(|q| q.half[0]).fold(0.0, f32::max)
    };
    let (hit, other) = (widest(20.0, 40.0), widest(90.0, 110.0));
    assert!(other > 0.0, "both have eyes");
    assert!(hit > 1.1 * other, "{hit} against {other}");
}

#[test]
fn a_particle_is_full_in_the_middle_and_nothing_at_the_rim() {
    let texels = sprite::particle_texels();
    let alpha = |x: usize, y: usize| texels[(y * sprite::SIDE + x) * 4 + 3];
    assert_eq!(alpha(32, 32), 255, "full in the middle");
    assert_eq!(alpha(0, 32), 0, "nothing at the rim");
}

#[test]
fn icons_are_small_squares() {
    let folder = std::path::Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../assets/sprites"));
    for (name, side) in [("favicon.png", 64), ("icon-180.png", 180), ("icon-512.png", 512)] {
        let file = std::fs::File::open(folder.join(name)).expect(name);
        assert!(file.metadata().expect(name).len() < 32 << 10, "{name}");
        let decoder = png::Decoder::new(std::io::BufReader::new(file));
        assert_eq!(decoder.read_info().expect(name).info().size(), (side, side), "{name}");
    }
}

#[test]
fn every_scene_has_a_picture() {
    let folder = std::path::Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../assets/pictures"));
    for scene in Scene::built_in() {
        let path = folder.join(format!("{}.webp", scene.name));
        let file = std::fs::read(&path).expect("run the example `picture` to draw it");
        let bytes = file.len();
        assert!(bytes < 32_000, "{}: {bytes} bytes, at most 32000", scene.name);
        assert_eq!((&file[..4], &file[8..16]), (&b"RIFF"[..], &b"WEBPVP8 "[..]), "{}", scene.name);
        let side = |at: usize| u16::from_le_bytes([file[at], file[at + 1]]);
        assert_eq!([side(26), side(28)], [640, 360], "{}", scene.name);
    }
}

#[test]
fn heroes_are_drawn_over_the_heap_that_they_stand_in() {
    let hero = body(0, Kind::Hero, Shape::rect(16.0, 22.0), Vec2::new(50.0, 50.0));
    let marble = body(1, Kind::Marble, Shape::circle(6.5), Vec2::new(52.0, 50.0));
    let particles = Particles::new(Vec::new(), 0);
    let mut list = DrawList::new();
    list.fill(&frame(&room(&[hero, marble]), &particles));
    let last = list.solids().iter().rposition(|quad| quad.center == [52.0, 50.0]);
    let first = list.solids().iter().position(|quad| quad.kind == SolidKind::MatteBox as u32);
    assert!(last < first, "{last:?} and {first:?}");
}

#[test]
fn the_plan_of_a_scene_decides_which_resources_are_created() {
    for scene in Scene::built_in() {
        let needed = Plan::of(&scene).features.particles;
        let lacks =
            ["bounds", "impulse", "pile", "roundup", "lamp", "bounce", "planets", "listing"];
        let lacks = lacks.contains(&scene.name.as_str());
        assert_eq!(needed, !lacks, "{}", scene.name);
    }
}
