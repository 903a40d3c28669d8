use super::*;
use crate::world::replica::{Eye, Replica};

fn request(query: &str) -> Option<DemoRequest> {
    DemoRequest::parse(query)
}

#[test]
fn the_address_names_scene_seed_and_ticks() {
    let full = request("?demo=arena&seed=7&ticks=120&bots=2&hud=1").expect("asks for a demo");
    assert_eq!((full.scene.as_str(), full.seed, full.ticks, full.bots), ("arena", 7, Some(120), 2));
    assert!(full.hud);
    let short = request("?demo=arena").expect("asks for a demo");
    assert_eq!((short.seed, short.ticks, short.bots, short.hud), (1, None, 0, false));
    assert_eq!(request("?seed=3"), None);
    assert_eq!(request(""), None);
}

fn hello() -> Vec<u8> {
    let appearance = Appearance { name: "Me".into(), color: 0 };
    ClientMessage::Hello {
        version: jostle_protocol::VERSION,
        appearance,
        token: None,
        host_key: None,
        role: jostle_protocol::Role::Player,
    }
    .encode()
}

/// Plays a scripted demo through encoded messages, as the page does.
fn play(scene: &Arc<Scene>, ticks: u32) -> (RoomInPage, Replica) {
    let mut demo = RoomInPage::new(scene.clone(), 1, 2, true);
    demo.receive(&hello());
    let mut replica = None;
    for _ in 0..=ticks {
        for bytes in demo.take() {
            match ServerMessage::decode(&bytes).expect("the room speaks the protocol") {
                ServerMessage::Welcome { seat: Some(own), .. } => {
                    replica = Some(Replica::new(scene.clone(), own.seat));
                }
                ServerMessage::Snapshot(coded) => {
                    let replica = replica.as_mut().expect("a welcome comes first");
                    let (arrival, _) = replica.hear(&coded).expect("a valid snapshot");
                    replica.advance(f64::from(arrival.tick), Eye::default());
                }
                other => panic!("unexpected {other:?}"),
            }
        }
        demo.tick();
    }
    (demo, replica.expect("a welcome came"))
}

#[test]
fn the_page_grows_the_particles_of_the_room() {
    for scene in Scene::built_in() {
        let scene = Arc::new(scene);
        let (demo, replica) = play(&scene, 300);
        // `play` ends one tick after the displayed one.
        let mut again = RoomInPage::new(scene.clone(), 1, 2, true);
        again.receive(&hello());
        while again.tick < replica.room.display as u32 {
            again.tick();
        }
        assert!(demo.tick == again.tick + 1);
        let world = again.room.game().world();
        assert_eq!(replica.particles().len(), world.particles().len(), "{}", scene.name);
        assert_eq!(replica.particles().digest(), world.particles().digest(), "{}", scene.name);
    }
}

#[test]
fn the_page_shows_the_bodies_of_the_room() {
    let scene = Arc::new(Scene::built_in().swap_remove(0));
    let (_, replica) = play(&scene, 200);
    let newest = replica.room.newest().expect("snapshots came");
    assert_eq!(f64::from(newest.tick), replica.room.display);
    assert_eq!(replica.bodies().len(), newest.bodies.len());
    assert!(replica.own_hero().is_some(), "the own hero is on display");
    assert_eq!(replica.room.players().len(), 3);
}

#[test]
fn a_late_page_skips_what_it_cannot_catch_up() {
    let scene = Arc::new(Scene::built_in().swap_remove(0));
    let mut demo = RoomInPage::new(scene, 1, 0, false);
    demo.receive(&hello());
    demo.advance(0.0, || 0.0);
    demo.advance(10_000.0, || 0.0);
    assert_eq!(demo.tick, 5);
    demo.advance(10_000.0 + 2.0 * TICK_MS + 0.001, || 0.0);
    assert_eq!(demo.tick, 7);
}
