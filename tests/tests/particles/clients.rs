//! Checks that the game and its clients have exactly the same particles, down to the last bit. Some clients are present
//! from the start; others join while emitters run and bursts are in the air. A browser test feeds the same streams to
//! the page.

mod streams;

use jostle_client_web::world::particle_probe::particle_digests;
use jostle_game::Scene;
use jostle_room::{Rate, Room};
use std::sync::Arc;
use streams::{TICKS, play, scenes};

/// Fires above a floor, with the largest number of particles that a scene may have.
const FIREWORKS: &str = r#"title = "Fireworks"
size = [400, 200]
groups = ["floor"]
particles_meet = ["floor"]

[limits]
particles = 20000

[[bodies]]
kind = "wall"
position = [200, 10]
size = [400, 20]
group = "floor"
"#;
/// Number of bursts per second, each of 200 particles that live for 2.2 s, which is enough for 20,000 particles in the
/// air.
const BURSTS: u32 = 54;

fn fireworks() -> Arc<Scene> {
    let mut source = FIREWORKS.to_owned();
    for number in 0..BURSTS {
        let (x, start) = (5 + 390 * number / BURSTS, 60 * number / BURSTS);
        source.push_str(&format!(
            "[[emitters]]\nrecipe = \"fire\"\ncount = 200\nposition = [{x}, 60]\n\
             start = {start}\nevery = 60\n"
        ));
    }
    Arc::new(Scene::parse("fireworks.toml", &source).unwrap_or_else(|error| panic!("{error}")))
}

#[test]
fn twenty_thousand_particles_cost_at_most_600_bytes_a_second() {
    let mut room = Room::new("fireworks", fireworks(), 1);
    (0..300).for_each(|_| room.tick());
    let (reader, keyframe) = room.subscribe(Rate::Full);
    let (mut fewest, mut payload, mut messages) = (usize::MAX, 0, 0);
    let seconds = 5;
    for _ in 0..60 * seconds {
        room.tick();
        fewest = fewest.min(room.game().world().particles().len());
        let message = room.message(&reader);
        payload += message.map_or(0, |message| message.len());
        messages += message.iter().len();
    }
    println!(
        "{fewest} particles at least: {} B/s in {} messages, keyframe of {} bytes",
        payload / seconds,
        messages / seconds,
        keyframe.len()
    );
    assert!(fewest > 19_900, "{fewest} particles");
    assert!(payload / seconds <= 600, "{} bytes a second", payload / seconds);
}

#[test]
fn the_game_and_all_its_clients_have_the_same_particles() {
    for scene in scenes().expect("scenes") {
        let name = &scene.title;
        let clients = play(&scene).expect("a game");
        assert!(clients[0].particles[0] > 100, "{name}: something flies");
        assert!(clients[1..].iter().any(|client| client.particles[1] > 0), "{name}: at a join");
        for client in &clients {
            let digests = particle_digests(&client.scene, &client.recording).expect("a stream");
            let compared =
                client.compare(&digests).unwrap_or_else(|error| panic!("{name}: {error}"));
            println!(
                "{name}, from {}: {compared} ticks equal; {} particles at the join",
                client.first, client.particles[1]
            );
            let all = (TICKS - client.first + 1) as usize;
            assert!(compared + 13 >= all, "{name}: {compared} of {all} ticks were received");
        }
    }
}
