//! The game and those who hear of it have the same particles, to the last bit: who is there from the
//! beginning, and who joins while emitters run and bursts are in the air. The browser's tests have the
//! page hear the same streams.

use jostle_client_web::witness::particle_digests;
use jostle_tests::streams::{TICKS, play, scenes};

#[test]
fn the_game_and_all_who_hear_it_have_the_same_particles() {
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
                "{name}, from {}: {compared} ticks equal; keyframe of {} bytes, {} particles",
                client.first, client.keyframe_bytes, client.particles[1]
            );
            let all = (TICKS - client.first + 1) as usize;
            assert!(compared + 13 >= all, "{name}: {compared} of {all} ticks were heard of");
        }
    }
}
