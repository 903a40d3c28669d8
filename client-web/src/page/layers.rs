//! Which layer of the page is on top: the game or lobby, or a card that must be answered first.
//! Everything below it is inert, so that neither Tab nor a click nor a screen reader gets there.

/// Layers, from the bottom.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Layer {
    Page,
    Help,
    /// Keys, gamepad, language.
    Settings,
    /// A question before something is done.
    Ask,
    Notice,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Layers {
    pub help: bool,
    pub settings: bool,
    /// A question is open.
    pub ask: bool,
    /// A notice is open that does not go away by itself; one that does leaves the page alone.
    pub notice: bool,
}

impl Layers {
    /// The layer that takes keys and clicks.
    pub fn top(self) -> Layer {
        match self {
            Layers { notice: true, .. } => Layer::Notice,
            Layers { ask: true, .. } => Layer::Ask,
            Layers { settings: true, .. } => Layer::Settings,
            Layers { help: true, .. } => Layer::Help,
            _ => Layer::Page,
        }
    }

    /// Whether a layer is out of reach. A notice that goes away by itself is, under the help.
    pub fn is_inert(self, layer: Layer) -> bool {
        let top = self.top();
        top != layer && !(top == Layer::Page && layer == Layer::Notice)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use Layer::{Ask, Help, Notice, Page};

    #[test]
    fn only_the_topmost_card_can_be_reached() {
        let reached = |help, ask, notice| {
            let layers = Layers { help, settings: false, ask, notice };
            let reach = |layer: &Layer| !layers.is_inert(*layer);
            (layers.top(), [Page, Help, Ask, Notice].into_iter().filter(reach).collect::<Vec<_>>())
        };
        assert_eq!(reached(true, false, false), (Help, vec![Help]));
        assert_eq!(reached(false, true, false), (Ask, vec![Ask]));
        assert_eq!(reached(false, false, true), (Notice, vec![Notice]));
        assert_eq!(reached(true, true, true), (Notice, vec![Notice]));
        let passing = reached(false, false, false);
        assert_eq!(passing, (Page, vec![Page, Notice]), "it goes away by itself");
    }
}
