//! The actions of the page's buttons, links and keys, under the names that the page's elements use.

macro_rules! page_actions {
    ($($name:literal $action:ident)*) => {
        /// The action triggered by a click on an element with `data-action` or by a key. Some actions have a value,
        /// `data-value`.
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        pub enum PageAction {
            $($action),*
        }

        impl PageAction {
            #[cfg(test)]
            pub const ALL: &[PageAction] = &[$(PageAction::$action),*];

            /// The action with this name.
            pub fn named(name: &str) -> Option<PageAction> {
                Some(match name {
                    $($name => PageAction::$action,)*
                    _ => return None,
                })
            }

            /// The action's name in `data-action`.
            pub fn name(self) -> &'static str {
                match self {
                    $(PageAction::$action => $name),*
                }
            }
        }
    };
}

page_actions! {
    "again" Again
    "ask-network" AskNetwork
    "bounds" Bounds
    "cancel" Cancel
    "choose-button" ChooseButton
    "choose-key" ChooseKey
    "clean" Clean
    "clip" Clip
    "close-room" CloseRoom
    "confirm" Confirm
    "copy" Copy
    "edit-copy" EditCopy
    "edit-delete" EditDelete
    "edit-duplicate" EditDuplicate
    "edit-error" EditError
    "edit-line" EditLine
    "edit-new" EditNew
    "edit-new-scene" EditNewScene
    "edit-path" EditPath
    "edit-place" EditPlace
    "edit-redo" EditRedo
    "edit-room" EditRoom
    "edit-rule" EditRule
    "edit-save" EditSave
    "edit-scene" EditScene
    "edit-toggle" EditToggle
    "edit-undo" EditUndo
    "edit-unrule" EditUnrule
    "emote" Emote
    "figures" Figures
    "follow" Follow
    "full-screen" FullScreen
    "go" Go
    "help" Help
    "highlights" Highlights
    "kick" Kick
    "leave" Leave
    "mute" Mute
    "network" Network
    "notice" Notice
    "notice-other" NoticeOther
    "open-file" OpenFile
    "open-private" OpenPrivate
    "open-scene" OpenScene
    "play-alone" PlayAlone
    "play-pause" PlayPause
    "qr-code" QrCode
    "records" Records
    "rename" Rename
    "reset-hands" ResetHands
    "settings" Settings
    "sound" Sound
    "step" Step
    "switch-team" SwitchTeam
    "watch" Watch
    "wheel" Wheel
}

impl PageAction {
    /// Whether the action shows a card that takes over the keys.
    pub fn shows_card(self) -> bool {
        use PageAction::{CloseRoom, Help, Kick, QrCode, Rename, Settings};
        matches!(self, CloseRoom | Help | Kick | QrCode | Rename | Settings)
    }
}

/// The use that a screen makes of a key.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum KeyUse {
    /// The key has no meaning, so the browser may handle it.
    Unused,
    Used,
    /// The page performs this action.
    Action(PageAction),
}

impl KeyUse {
    pub fn when(used: bool) -> KeyUse {
        if used { KeyUse::Used } else { KeyUse::Unused }
    }
}

#[cfg(test)]
mod tests {
    use super::PageAction;

    const PAGE: &str = include_str!("../../web/index.html");

    #[test]
    fn every_action_of_the_page_is_known() {
        let named =
            ["data-action=\"", "data-escape=\""].map(|attribute| PAGE.split(attribute).skip(1));
        for name in named
            .into_iter()
            .flatten()
            .filter_map(|rest| rest.split_once('"'))
            .map(|(name, _)| name)
        {
            assert!(PageAction::named(name).is_some(), "{name}");
        }
    }

    /// Actions that the page does not name belong to elements created by code, such as list entries and switches, or
    /// only to keys.
    #[test]
    fn the_page_names_every_action() {
        use PageAction::{
            Bounds, ChooseButton, ChooseKey, Clean, EditPlace, Figures, FullScreen, Mute,
        };
        let made = [Bounds, ChooseButton, ChooseKey, Clean, EditPlace, Figures, FullScreen, Mute];
        for action in PageAction::ALL {
            let name = format!("data-action=\"{}\"", action.name());
            assert_eq!(PAGE.contains(&name), !made.contains(action), "{action:?}");
        }
    }
}
