//! The look of a scene. It is drawn only, and changes nothing in the simulation.

use super::table::Table;

/// Colours, ground, light and pattern with which a scene is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Theme {
    /// A workshop at night.
    #[default]
    Ink,
    /// Dunes at noon.
    Sand,
    /// A rink.
    Ice,
    /// Hills of grass.
    Meadow,
    /// Bright lines in the dark.
    Neon,
    /// A squared exercise book.
    Paper,
}

impl Theme {
    /// Every theme with its name in scene files, in the order of the enum.
    pub const NAMES: [(&str, Theme); 6] = [
        ("ink", Theme::Ink),
        ("sand", Theme::Sand),
        ("ice", Theme::Ice),
        ("meadow", Theme::Meadow),
        ("neon", Theme::Neon),
        ("paper", Theme::Paper),
    ];

    /// Reads a scene's theme.
    pub(super) fn read(root: &Table) -> Theme {
        root.get("theme").choice(&Theme::NAMES).unwrap_or_default()
    }
}
