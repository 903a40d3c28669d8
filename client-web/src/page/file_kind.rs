//! The kinds of files that players open.

use jostle_protocol::replay::MAGIC;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FileKind {
    Replay,
    Scene,
}

impl FileKind {
    /// The kind of a file. Mail programs and downloads change names (`yard.toml.txt`, `YARD.TOML`), so that without one
    /// of the two known extensions the contents decide: any text is a scene, possibly a wrong one.
    pub fn of(name: &str, bytes: &[u8]) -> FileKind {
        let is_replay = bytes.starts_with(&MAGIC)
            || has_extension(name, ".jostle")
            || bytes.contains(&0)
            || std::str::from_utf8(bytes).is_err();
        match is_replay && !is_scene_name(name) {
            true => FileKind::Replay,
            false => FileKind::Scene,
        }
    }
}

/// Whether a file's name is that of a scene, whatever the file contains.
pub fn is_scene_name(name: &str) -> bool {
    has_extension(name, ".toml")
}

fn has_extension(name: &str, extension: &str) -> bool {
    name.to_ascii_lowercase().ends_with(extension)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_is_a_scene_or_a_replay_by_its_name_or_else_by_its_contents() {
        let scene = b"title = \"Yard\"".as_slice();
        for name in ["yard.toml", "YARD.TOML", "yard.Toml", "yard.toml.txt", "yard.txt", "yard"] {
            assert_eq!(FileKind::of(name, scene), FileKind::Scene, "{name}");
        }
        let replay = [&MAGIC[..], &[1, 0]].concat();
        for name in ["game.jostle", "GAME.JOSTLE", "game.jostle.txt", "game (1)", "game.bin"] {
            assert_eq!(FileKind::of(name, &replay), FileKind::Replay, "{name}");
        }
        assert_eq!(FileKind::of("cut.jostle", b""), FileKind::Replay);
        assert_eq!(FileKind::of("yard.TOML", b"\xff"), FileKind::Scene, "with a line in its error");
        assert_eq!(FileKind::of("cat.gif", b"GIF89a\x01\0\x01\0"), FileKind::Replay);
        assert_eq!(FileKind::of("cat.jpg", b"\xff\xd8\xff"), FileKind::Replay);
    }
}
