//! Rejects names that the code has abandoned in favour of the field's established terms.

use super::finding::Finding;
use super::source::SourceFile;
use proc_macro2::{TokenStream, TokenTree};

/// Old names of modules, followed by old names shared by types and modules, each with its replacement.
const WORDS: [(&str, &str); 51] = [
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
    ("strays", "late_pairs"),
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
    ("Connects", "AddressRateLimiter"),
    ("Metered", "RateLimitedStream"),
    ("Stream", "SnapshotStream or MaybeTlsStream"),
    ("Sealer", "TokenSigner"),
    ("Order", "AdminCommand"),
    ("Facts", "ContactInfo or RoomInfo"),
    ("Tape", "RoomLog"),
    ("Reel", "ReplayFile"),
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
    ("Words", "StateIo"),
    ("Listing", "StateDump"),
];
/// Keywords that precede the name of a declaration.
const KEYWORDS: [&str; 5] = ["struct", "enum", "type", "trait", "mod"];

/// Reports files and declarations that have an old name.
pub fn check(sources: &[SourceFile]) -> Vec<Finding> {
    let mut findings = Vec::new();
    for source in sources {
        let mut declared = vec![(file_stem(&source.path).to_owned(), 0)];
        collect(source.tokens.clone(), &mut declared);
        for (name, line) in declared {
            let is_old = |old: &str| name == old || name == old.to_lowercase();
            let Some((_, word)) = WORDS.iter().find(|(old, _)| is_old(old)) else { continue };
            let text =
                format!("`{name}` is of the old vocabulary; the word is `{word}`; rename it");
            findings.push(Finding::at(&source.path, line, text));
        }
    }
    findings
}

/// The module name of a file: `step` for both `world/step.rs` and `world/step/mod.rs`.
fn file_stem(path: &str) -> &str {
    let path = path.trim_end_matches(".rs").trim_end_matches("/mod").trim_end_matches("/main");
    path.rsplit('/').next().unwrap_or(path)
}

/// Collects declared names with their line numbers.
fn collect(tokens: TokenStream, declared: &mut Vec<(String, usize)>) {
    let mut is_declaration = false;
    for token in tokens {
        match token {
            TokenTree::Ident(ident) => {
                let name = ident.to_string();
                let follows = std::mem::replace(&mut is_declaration, KEYWORDS.contains(&&*name));
                declared.extend(follows.then(|| (name, ident.span().start().line)));
            }
            TokenTree::Group(group) => collect(group.stream(), declared),
            TokenTree::Punct(_) | TokenTree::Literal(_) => {}
        }
    }
}

#[cfg(test)]
mod tests {
    use super::check;
    use crate::tidy::files::File;
    use crate::tidy::source::parse;

    fn messages(path: &str, text: &str) -> Vec<String> {
        let sources = parse(&[File::text(path, text)]).expect("parses");
        check(&sources).iter().map(ToString::to_string).collect()
    }

    #[test]
    fn an_old_name_is_found_wherever_one_is_declared() {
        for kind in ["struct Sight;", "enum Sight {}", "type Sight = u8;", "trait Sight {}"] {
            let said = messages("room/src/a.rs", &format!("\n{kind}\n"));
            let expected =
                "room/src/a.rs:2: `Sight` is of the old vocabulary; the word is `InterestArea`";
            assert!(said.len() == 1 && said[0].starts_with(expected), "{kind} {said:?}");
        }
        for (path, text) in
            [("a/src/sight.rs", ""), ("a/src/sight/mod.rs", ""), ("a/src/b.rs", "mod sight {}")]
        {
            assert_eq!(messages(path, text).len(), 1, "{path}");
        }
        assert_eq!(messages("room/src/interest.rs", "struct InterestArea;"), [""; 0]);
        assert_eq!(messages("room/src/a.rs", "fn sight(sight: u8) {}"), [""; 0]);
    }
}
