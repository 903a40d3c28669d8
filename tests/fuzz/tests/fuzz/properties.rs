//! Checks that the properties hold for the corpus, for thousands of mutations of it, and for random bytes. The fuzzer
//! does the same, guided by coverage and for as long as desired.

use jostle_fuzz::{corpus, property};
use proptest::prelude::*;
use proptest::sample::Index;
use proptest::test_runner::{Config, RngSeed, TestRunner};
use std::fs;
use std::path::{Path, PathBuf};

/// An edit of an input: the kind, the position and a byte.
type Edit = (u8, Index, u8);

fn here() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// Returns a property's corpus and other valid inputs.
fn inputs(name: &str) -> Vec<Vec<u8>> {
    let mut inputs = corpus(name);
    if name == "scene" {
        let folders = ["../../assets/scenes", "../scenes"];
        let files = folders.iter().flat_map(|path| files(&here().join(path)));
        inputs.extend(files.map(|path| fs::read(path).expect("a file that was just listed")));
    }
    inputs
}

fn files(dir: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(dir).unwrap_or_else(|error| panic!("{}: {error}", dir.display()));
    let mut paths: Vec<_> = entries.map(|entry| entry.expect("a readable entry").path()).collect();
    paths.sort();
    paths
}

fn mutated(mut bytes: Vec<u8>, other: &[u8], edits: &[Edit]) -> Vec<u8> {
    for &(kind, position, byte) in edits {
        let at = position.index(bytes.len() + 1);
        let end = (at + usize::from(byte % 8) + 1).min(bytes.len());
        match kind % 8 {
            _ if at == bytes.len() => bytes.push(byte),
            0 => bytes.truncate(at),
            1 => bytes.insert(at, byte),
            2 => drop(bytes.drain(at..end)),
            3 => bytes[at] = byte,
            4 => bytes[at] = [0, 1, 0x7f, 0x80, 0xff][usize::from(byte % 5)],
            5 => drop(bytes.splice(at..end, other.iter().copied().skip(at).take(8))),
            _ => bytes[at] ^= 1 << (byte % 8),
        }
    }
    bytes
}

/// Tries the corpus and `cases` mutations and random inputs.
fn check(name: &str, cases: u32) {
    let property = property(name).expect("a property");
    let inputs = inputs(name);
    assert!(inputs.len() > 2, "{name} has a corpus");
    inputs.iter().for_each(|input| property(input));
    let config = Config {
        cases,
        rng_seed: RngSeed::Fixed(0x4655_5a5a),
        failure_persistence: None,
        ..Config::default()
    };
    let edits = prop::collection::vec(any::<Edit>(), 0..8);
    let mutation = (any::<Index>(), any::<Index>(), edits).prop_map(|(one, other, edits)| {
        mutated(one.get(&inputs).clone(), other.get::<Vec<u8>>(&inputs), &edits)
    });
    let noise = prop::collection::vec(any::<u8>(), 0..64);
    TestRunner::new(config)
        .run(&prop_oneof![9 => mutation, 1 => noise], |bytes| {
            property(&bytes);
            Ok(())
        })
        .unwrap_or_else(|error| panic!("{name}: {error}"));
}

#[test]
fn a_client_message_has_one_form() {
    check("client_message", 20_000);
}

#[test]
fn a_server_message_has_one_form() {
    check("server_message", 20_000);
}

#[test]
fn a_keyframe_has_one_form() {
    check("keyframe", 5_000);
}

#[test]
fn a_delta_is_sound_or_changes_nothing() {
    check("delta", 5_000);
}

#[test]
fn events_have_one_form() {
    check("events", 20_000);
}

#[test]
fn decoded_particles_can_be_played() {
    check("particles", 5_000);
}

#[test]
fn a_replay_is_refused_or_plays_as_far_as_it_goes() {
    check("replay", 500);
}

#[test]
fn a_scene_is_refused_or_can_be_played() {
    check("scene", 500);
}

#[test]
fn clients_do_no_harm_to_a_room() {
    check("room", 500);
}

#[test]
fn a_link_means_a_room_or_nothing() {
    check("link", 20_000);
}

#[test]
fn bytes_before_a_session_are_answered_or_dropped() {
    check("handshake", 2_000);
}

#[test]
fn only_signed_tokens_are_believed() {
    check("token", 20_000);
}

#[test]
fn a_run_is_proven_or_refused_with_a_sentence() {
    check("run", 1_000);
}

#[test]
fn a_guests_scene_keeps_to_its_budget_or_is_refused_by_a_line() {
    check("guest_scene", 500);
}

#[test]
fn a_map_of_tiled_is_refused_or_becomes_a_scene() {
    check("tiled_map", 2_000);
}
