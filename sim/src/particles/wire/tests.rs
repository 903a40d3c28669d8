use super::*;
use crate::body::BodyId;
use crate::particles::{EmitterDef, Source};
use crate::rng::Rng;
use glam::Vec2;

fn recipes() -> Vec<Recipe> {
    let brief = Recipe { life_ticks: [1, 9], round: true, ..Recipe::default() };
    vec![Recipe::default(), brief]
}

/// Live particles of both recipes, and running emitters, one of them following a body.
fn busy() -> Particles {
    let mut particles = Particles::new(recipes(), 2000);
    let body = BodyId { index: 3, generation: 2 };
    for tick in 0..40u16 {
        let source = match tick % 3 {
            0 => Source::Body(body),
            _ => Source::Point(Vec2::new(f32::from(tick), 3.5)),
        };
        let count = 20 + 10 * tick;
        let def = EmitterDef { recipe: (tick % 2) as u8, count, seed: u32::from(tick), source };
        particles.start(def);
        particles.step(&[], |_| Some(Vec2::new(9.0, f32::from(tick))));
    }
    particles
}

fn decode(bytes: &[u8]) -> Result<Particles, StateError> {
    Particles::decode(recipes(), 2000, bytes)
}

#[test]
fn decoded_particles_continue_bit_for_bit() {
    let mut there = busy();
    assert!(there.len() > 500 && there.emitter_count() > 5);
    let bytes = there.encode();
    let particles = there.len();
    assert!(bytes.len() < 21 * particles + 41 * there.emitter_count() + 8, "{}", bytes.len());
    assert!(bytes.len() <= encoded_bytes_max(particles));
    let mut here = decode(&bytes).unwrap();
    assert_eq!(here.encode(), bytes);
    while there.is_active() {
        assert_eq!(here.digest(), there.digest());
        for end in [&mut here, &mut there] {
            end.step(&[], |_| None);
        }
    }
    assert!(!here.is_active());
}

#[test]
fn no_particles_are_encoded_in_eight_bytes() {
    let nothing = Particles::new(recipes(), 5).encode();
    assert_eq!(nothing, [0; 8]);
    assert!(!decode(&nothing).unwrap().is_active());
}

#[test]
fn impossible_particles_are_refused() {
    let run = |recipe: u8, age: u8, run: u8| vec![recipe, age, 0, run];
    let particle = [[0; 4], [0; 4], [0; 4], [0; 4], [7, 0, 0, 0]].concat();
    let decode = |count: u8, parts: &[&[u8]]| {
        decode(&[&[0, 0, 0, 0, count, 0, 0, 0], &parts.concat()[..]].concat())
    };
    let one = &particle[..];
    assert!(decode(1, &[&run(0, 2, 1), one]).is_ok());
    assert!(decode(2, &[&run(0, 2, 1), one, &run(0, 3, 1), one]).is_ok());
    let refused = |count: u8, parts: &[&[u8]], field| {
        assert_eq!(decode(count, parts).unwrap_err().field, field);
    };
    refused(1, &[&run(2, 2, 1), one], "recipe of particles");
    refused(1, &[&run(0, 231, 1), one], "age");
    refused(1, &[&run(0, 2, 0), one], "particles alike");
    refused(1, &[&run(0, 2, 2), one, one], "particles alike");
    refused(2, &[&run(0, 2, 1), one, &run(0, 2, 1), one], "particles alike");
    refused(2, &[one], "number of particles");
    refused(1, &[&run(0, 2, 1), one, one], "end");
    let (nan, far) = (f32::NAN.to_le_bytes(), 1e10f32.to_le_bytes());
    refused(1, &[&run(0, 2, 1), &[&nan, &one[4..]].concat()], "position of a particle");
    refused(1, &[&run(0, 2, 1), &[&one[..8], &far, &one[12..]].concat()], "velocity of a particle");
}

#[test]
fn corrupt_bytes_never_panic_and_decoded_particles_can_be_stepped() {
    let whole = busy().encode();
    let mut rng = Rng::new(8, 0);
    let mut accepted = 0;
    for _ in 0..2000 {
        let mut bytes = whole.clone();
        let index = rng.below(bytes.len() as u32) as usize;
        match rng.below(4) {
            0 => bytes.truncate(index),
            1 => drop(bytes.remove(index)),
            _ => bytes[index] ^= 1 << rng.below(8),
        }
        if let Ok(mut particles) = decode(&bytes) {
            accepted += 1;
            assert!(particles.encode().len() == bytes.len(), "nothing is made up");
            particles.step(&[], |_| None);
        }
    }
    assert!(accepted > 100, "{accepted} of 2000");
}
