//! Names that the code no longer uses, since the field has words for what they stood for.

use super::finding::{Fault, Finding};
use super::source::Source;
use proc_macro2::Ident;
use syn::visit::{self, Visit};
use syn::{ItemEnum, ItemMod, ItemStruct, ItemTrait, ItemType};

/// Old names of modules, then of types and the modules of the same name; and the words for them.
const WORDS: [(&str, &str); 53] = [
    ("ask", "confirm"),
    ("words", "strings"),
    ("told", "encode"),
    ("look", "appearance"),
    ("lines", "chains"),
    ("trees", "spanning_forest"),
    ("pools", "pava"),
    ("travel", "integrate"),
    ("places", "position_correction"),
    ("walls", "static_clamp"),
    ("guard", "energy_guard"),
    ("doubts", "ccd_recheck"),
    ("strays", "late_pairs"),
    ("squeezes", "held_after_impact"),
    ("gap", "separation"),
    ("Sight", "InterestArea"),
    ("Feed", "SnapshotChannel"),
    ("Press", "BufferPool"),
    ("Pen", "EncodeScratch"),
    ("Young", "recent_joiners"),
    ("Flying", "LiveParticles"),
    ("Trail", "PositionHistory"),
    ("Heard", "Decoded"),
    ("Lag", "AckLag or NetworkConditions"),
    ("Lane", "SimulatedLink"),
    ("Outflow", "InputSender"),
    ("Door", "Admission"),
    ("Peers", "ConnectionLimits"),
    ("Connects", "ConnectRateLimiter"),
    ("Metered", "RateLimitedStream"),
    ("Stream", "SnapshotStream or MaybeTlsStream"),
    ("Sealer", "TokenSigner"),
    ("Order", "AdminCommand"),
    ("Facts", "ContactInfo or RoomInfo"),
    ("Tape", "RoomRecording"),
    ("Reel", "RecordingFile"),
    ("Shelf", "ReplayStore"),
    ("Film", "ReplayPlayer"),
    ("Deck", "ReplayControls"),
    ("Screening", "ReplayScreen"),
    ("Anchor", "AuthoritativeSim"),
    ("Lead", "PredictedSim"),
    ("Way", "NoticeAction or OrderedChannel"),
    ("Canary", "JitterProbe"),
    ("Beside", "JitterProbe"),
    ("Still", "JitterProbe or StaticGrid"),
    ("Tally", "Histogram"),
    ("Hands", "BotInput"),
    ("Repeater", "ScheduledEmitter"),
    ("Dormant", "SleepingIsland"),
    ("Sort", "BodyPrototype"),
    ("Words", "StateVisitor"),
    ("Listing", "StateDump"),
];
/// Old names that are still in the code, one a line. This list only shrinks.
pub const LEFT: &str = include_str!("old_words.txt");
const LEFT_PATH: &str = "xtask/src/tidy/old_words.txt";

/// Reports old names that are not listed as left, and listed ones that are gone.
pub fn check(sources: &[Source], left: &str) -> Vec<Finding> {
    let mut names = Vec::new();
    for source in sources {
        let mut reader = Names { path: &source.path, names };
        source.items.iter().for_each(|item| reader.visit_item(item));
        reader.name(file_stem(&source.path), 0);
        names = reader.names;
    }
    let is_left = |old: &OldName| left.lines().any(|left| left == old.name);
    let found = names
        .iter()
        .filter(|old| !is_left(old))
        .map(|old| Fault::OldWord(old.name.clone(), old.word).at(old.path, old.line));
    let gone = left.lines().enumerate().filter(|(_, left)| names.iter().all(|n| n.name != *left));
    let gone = gone.map(|(index, left)| Fault::MendedWord(left.into()).at(LEFT_PATH, index + 1));
    found.chain(gone).collect()
}

/// `world/step.rs` and `world/step/mod.rs` are both of the name `step`.
fn file_stem(path: &str) -> &str {
    let path = path.trim_end_matches(".rs").trim_end_matches("/mod").trim_end_matches("/main");
    path.rsplit('/').next().unwrap_or(path)
}

/// An old name where it is declared.
struct OldName<'a> {
    name: String,
    word: &'static str,
    path: &'a str,
    line: usize,
}

/// Collects the old names that a file declares.
struct Names<'a> {
    path: &'a str,
    names: Vec<OldName<'a>>,
}

impl Names<'_> {
    fn declared(&mut self, ident: &Ident) {
        self.name(&ident.to_string(), ident.span().start().line);
    }

    fn name(&mut self, name: &str, line: usize) {
        let is_old = |old: &str| name == old || name == old.to_lowercase();
        if let Some((_, word)) = WORDS.iter().find(|(old, _)| is_old(old)) {
            self.names.push(OldName { name: name.to_owned(), word, path: self.path, line });
        }
    }
}

impl<'ast> Visit<'ast> for Names<'_> {
    fn visit_item_struct(&mut self, item: &'ast ItemStruct) {
        self.declared(&item.ident);
    }

    fn visit_item_enum(&mut self, item: &'ast ItemEnum) {
        self.declared(&item.ident);
    }

    fn visit_item_type(&mut self, item: &'ast ItemType) {
        self.declared(&item.ident);
    }

    fn visit_item_trait(&mut self, item: &'ast ItemTrait) {
        self.declared(&item.ident);
        visit::visit_item_trait(self, item);
    }

    /// A module of its own file is found by that file's name.
    fn visit_item_mod(&mut self, item: &'ast ItemMod) {
        if item.content.is_some() {
            self.declared(&item.ident);
        }
        visit::visit_item_mod(self, item);
    }
}

#[cfg(test)]
mod tests {
    use super::check;
    use crate::tidy::files::File;
    use crate::tidy::source::parse;

    fn messages(path: &str, text: &str, left: &str) -> Vec<String> {
        let sources = parse(&[File::text(path, text)]).expect("parses");
        check(&sources, left).iter().map(ToString::to_string).collect()
    }

    #[test]
    fn an_old_name_is_found_wherever_one_is_declared() {
        for kind in ["struct Sight;", "enum Sight {}", "type Sight = u8;", "trait Sight {}"] {
            let said = messages("room/src/a.rs", &format!("\n{kind}\n"), "");
            let expected =
                "room/src/a.rs:2: `Sight` is of the old vocabulary; the word is `InterestArea`";
            assert!(said.len() == 1 && said[0].starts_with(expected), "{kind} {said:?}");
        }
        for (path, text) in
            [("a/src/sight.rs", ""), ("a/src/sight/mod.rs", ""), ("a/src/b.rs", "mod sight {}")]
        {
            assert_eq!(messages(path, text, "").len(), 1, "{path}");
        }
        assert_eq!(messages("room/src/interest.rs", "struct InterestArea;", ""), [""; 0]);
        assert_eq!(messages("room/src/a.rs", "fn sight(sight: u8) {}", ""), [""; 0]);
    }

    #[test]
    fn names_that_are_left_only_shrink() {
        assert_eq!(messages("room/src/a.rs", "struct Sight;", "Feed\nSight\n").len(), 1);
        assert_eq!(messages("room/src/a.rs", "struct Sight;", "Sight\n"), [""; 0]);
        let said = messages("room/src/a.rs", "", "Sight\n");
        assert!(
            said[0].starts_with("xtask/src/tidy/old_words.txt:1: `Sight` is no longer"),
            "{said:?}"
        );
    }
}
