//! Rooms with guests' scenes. A player uploads a scene file and gets a room that plays it.
//!
//! A stranger's scene must not slow down other rooms, so there are three safeguards. [`read`] refuses a file that needs
//! more than [`limits::GUEST_BUDGET`]. [`try_out`] plays the first seconds on a low-priority thread, after waiting for
//! its turn in a [`TrialQueue`], and refuses the scene if that takes too long. The room itself has a
//! [`ProcessorShare`], and is closed if it exceeds that share for long. The number of such rooms is limited
//! ([`limits::guest_rooms_max`]).

mod share;
mod trial;

pub use share::ProcessorShare;

use crate::host::thread_time;
use crate::limits::trial_queue::TrialQueue;
use crate::limits::{self, Timeouts};
use jostle_game::Scene;
use jostle_game::scene::{SceneError, line_at};
use jostle_protocol::{first_forbidden, has_visible};
use std::io;
use std::net::IpAddr;
use std::sync::Arc;

/// The name of every guest's scene. In error messages, the file is called `guest.toml`.
pub const NAME: &str = "guest";
const FILE: &str = "guest.toml";

/// Whether guests may open rooms with their own scenes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum GuestScenes {
    Off,
    /// Only in unlisted rooms.
    #[default]
    Private,
    /// In listed rooms too.
    All,
}

impl GuestScenes {
    /// The setting's name in flags and answers.
    pub fn name(self) -> &'static str {
        match self {
            GuestScenes::Off => "off",
            GuestScenes::Private => "private",
            GuestScenes::All => "all",
        }
    }
}

/// Parses a guest's scene, checks that it stays within its budget, and limits its steps.
pub fn read(text: &[u8]) -> Result<Scene, SceneError> {
    let text = std::str::from_utf8(text).map_err(|error| {
        let line = line_at(text, error.valid_up_to());
        about_file(line, "bytes that are not UTF-8".to_owned(), "UTF-8 text".to_owned())
    })?;
    if text.len() > limits::GUEST_SCENE_BYTES_MAX {
        return Err(too_long(format!("{} bytes", text.len())));
    }
    let mut scene = Scene::parse(FILE, text)?;
    limits::GUEST_BUDGET.check(&scene)?;
    check_texts(&scene)?;
    scene.world.budget = limits::GUEST_STEP;
    Ok(scene)
}

/// The refusal of a text that is too long. `found` describes the length.
pub fn too_long(found: String) -> SceneError {
    about_file(1, found, format!("at most {} bytes", limits::GUEST_SCENE_BYTES_MAX))
}

fn about_file(line: usize, found: String, allowed: String) -> SceneError {
    SceneError { file: FILE.to_owned(), line, field: "file".to_owned(), found, allowed }
}

/// Checks that texts shown to others follow the rules for names.
fn check_texts(scene: &Scene) -> Result<(), SceneError> {
    for (field, text) in scene.texts() {
        let found = match first_forbidden(text) {
            Some(character) => format!("the character U+{:04X}", u32::from(character)),
            None if !has_visible(text) => "a text without a visible character".to_owned(),
            None => continue,
        };
        let allowed = "visible characters, without control and direction marks".to_owned();
        return Err(SceneError::in_scene(scene, &field, found, allowed));
    }
    Ok(())
}

/// Reads a scene sent from this address, and plays its trial when its turn comes; `None` if too many are already
/// waiting. The outer error is a server error.
pub async fn try_out(
    text: Vec<u8>,
    waits: Timeouts,
    address: IpAddr,
    trials: &Arc<TrialQueue>,
) -> io::Result<Option<Result<Arc<Scene>, SceneError>>> {
    trials.run(address, "trial", move |_| try_here(&text, &waits)).await
}

fn try_here(text: &[u8], waits: &Timeouts) -> Result<Arc<Scene>, SceneError> {
    let scene = Arc::new(read(text)?);
    // The trial is idle half of the time, even if no other work is waiting.
    let times = [waits.guest_trial, waits.guest_trial_later];
    trial::play(&scene, times, thread_time::taken, std::thread::sleep)?;
    Ok(scene)
}

#[cfg(test)]
mod tests {
    use super::*;

    mod worst;

    /// A scene with this title and these limits.
    fn text(title: &str, limits: &str) -> String {
        format!(
            "title = \"{title}\"\nsize = [100, 100]\ngroups = [\"wall\"]\nlimits = {{ {limits} }}\n"
        )
    }

    fn refused(text: impl AsRef<[u8]>) -> String {
        read(text.as_ref()).expect_err("a refusal").to_string()
    }

    #[test]
    fn every_shipped_scene_but_the_largest_may_be_a_guests() {
        for scene in Scene::built_in() {
            let read = read(scene.source.as_bytes());
            match scene.name.as_str() {
                "hall" => assert_eq!(read.expect_err("too large").field, "bodies"),
                name => assert_eq!(read.map(|scene| scene.name), Ok("guest".to_owned()), "{name}"),
            }
        }
    }

    #[test]
    fn a_refusal_is_the_sentence_of_a_check_of_the_file() {
        let found = refused(text("Mine", "players = 65"));
        assert_eq!(found, "guest.toml:4: limits.players: found 65 players; allowed: at most 64");
        let long = text("Mine", "") + &"#".repeat(limits::GUEST_SCENE_BYTES_MAX);
        let sentence = format!("guest.toml:1: file: found {} bytes; allowed: at most", long.len());
        assert!(refused(long).starts_with(&sentence));
        assert_eq!(
            refused(b"title = \"a\"\n\xff"),
            "guest.toml:2: file: found bytes that are not UTF-8; allowed: UTF-8 text"
        );
        assert!(refused("title = 1").starts_with("guest.toml:1: title: found 1; allowed: a text"));
    }

    #[test]
    fn texts_that_others_are_shown_keep_to_the_rules_for_names() {
        assert!(read(text("Grüße an alle", "").as_bytes()).is_ok());
        let refused = |title| refused(text(title, ""));
        assert_eq!(
            refused("a\\u202Eb"),
            "guest.toml:1: title: found the character U+202E; allowed: visible characters, without control and \
             direction marks"
        );
        assert!(refused("\\u00a0").contains("found a text without a visible character"));
        assert!(refused("Arena\\u2800").contains("found the character U+2800"));
        assert!(refused("Pit \\ue000").contains("found the character U+E000"));
        let stacked = refused(&format!("a{}", "\\u0301".repeat(19)));
        assert!(stacked.contains("found the character U+0301"), "{stacked}");
    }
}
