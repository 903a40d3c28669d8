//! What zones, signals and a tick of the rules keep in mind.

use crate::input::Seat;
use crate::scene::{Each, Levels, RelaySpec, Scene, SignalKind, SignalSpec, Stays};
use crate::side::Side;
use jostle_sim::BodyId;

/// What a zone knows.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct ZoneState {
    /// Who was in it in the last tick, in id order.
    pub inside: Vec<BodyId>,
    pub holder: Option<Side>,
    /// The side that is alone in it, and for how many ticks.
    pub taking: Option<(Side, u32)>,
}

/// Who entered and left in a tick: zones in file order, bodies in id order.
#[derive(Clone, Debug, Default)]
pub(super) struct Changes {
    pub entered: Vec<(u8, BodyId)>,
    pub left: Vec<(u8, BodyId)>,
    pub inside: Vec<BodyId>,
}

/// What a signal counts.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum SignalState {
    Relay(RelayState),
    /// Of steps in an order.
    Order(OrderState),
}

/// What a signal made of levels counts.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct RelayState {
    /// Ticks in a row for which its condition has held.
    pub held: u32,
    /// Ticks for which it stays on without it.
    pub left: u32,
    /// Whether it is on, or would come on if it did not toggle.
    pub base: bool,
    /// Whether a toggle is on.
    pub toggled: bool,
}

/// Progress in an order.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct OrderState {
    /// Steps done by each who makes progress, those without any left out, in order.
    pub done: Vec<(Walker, u8)>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Walker {
    All,
    Side(Side),
    Player(Seat),
}

impl Walker {
    /// As what it is saved.
    pub fn side(self) -> Option<Side> {
        match self {
            Walker::All => None,
            Walker::Side(side) => Some(side),
            Walker::Player(seat) => Some(Side::Player(seat)),
        }
    }

    /// What was saved as this side.
    pub fn of(each: Each, side: Option<Side>) -> Option<Walker> {
        match (each, side) {
            (Each::All, None) => Some(Walker::All),
            (Each::Side, Some(side)) => Some(Walker::Side(side)),
            (Each::Player, Some(Side::Player(seat))) => Some(Walker::Player(seat)),
            _ => None,
        }
    }
}

/// A lap: an order of each side or player that one of them completed in this tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Lap {
    pub signal: u8,
    pub walker: Walker,
    pub body: BodyId,
}

impl SignalState {
    /// Off, without any memory.
    pub fn new(spec: &SignalSpec) -> SignalState {
        match spec.kind {
            SignalKind::Relay(_) => SignalState::Relay(RelayState::default()),
            SignalKind::Order(_) => SignalState::Order(OrderState::default()),
        }
    }

    /// Its level at the start of a round.
    pub fn settle(&mut self, spec: &SignalSpec, levels: Levels) -> bool {
        match (self, &spec.kind) {
            (SignalState::Relay(state), SignalKind::Relay(relay)) if !is_off(spec, levels) => {
                state.advance(relay, levels);
                state.toggled = false;
                state.level(relay)
            }
            _ => false,
        }
    }
}

/// Whether its `until` holds.
pub(super) fn is_off(spec: &SignalSpec, levels: Levels) -> bool {
    spec.until.is_some_and(|until| until.all(levels))
}

impl RelayState {
    pub fn advance(&mut self, spec: &RelaySpec, levels: Levels) {
        let holds = spec.when.all(levels) && spec.any.is_none_or(|any| any.any(levels));
        self.held = if holds { self.held.saturating_add(1) } else { 0 };
        let before = self.base;
        if self.held > spec.after {
            self.base = true;
            self.left = match spec.stays {
                Stays::Ticks(ticks) => ticks,
                Stays::Ever => u32::MAX,
            };
        } else if self.left > 0 {
            self.left -= u32::from(self.left != u32::MAX);
        } else {
            self.base = false;
        }
        self.toggled ^= self.base && !before;
    }

    pub fn level(&self, spec: &RelaySpec) -> bool {
        if spec.toggles { self.toggled } else { self.base }
    }
}

/// Ends of the round that were claimed in a tick.
#[derive(Clone, Debug, Default)]
pub(super) struct Claims {
    pub won: Vec<Side>,
    pub lost: Vec<Side>,
}

/// A body that broke in this tick.
#[derive(Clone, Copy, Debug)]
pub(super) struct Broken {
    pub body: BodyId,
    pub group: u8,
    pub by: Option<Seat>,
}

/// What a sling is at.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Sling {
    /// Shots left, the one in the sling included.
    pub shots: u8,
    /// Who pulls, or pulled last.
    pub shooter: Option<Seat>,
    /// Whether the shooter holds the ball.
    pub is_pulled: bool,
    /// Ticks since the ball was let go; 0 while it is in the sling.
    pub flight: u32,
}

impl Sling {
    /// The sling at the start of a round.
    pub fn at_start(scene: &Scene) -> Option<Sling> {
        scene.sling.map(|spec| Sling { shots: spec.shots, ..Sling::default() })
    }

    /// Returns whether the last shot is over.
    pub fn is_spent(&self) -> bool {
        self.shots == 0 && self.flight == 0
    }

    /// What conditions may ask of it.
    pub fn levels(&self) -> Levels {
        let on = |holds, level| if holds { level } else { Levels::default() };
        on(self.is_spent(), Levels::SPENT).or(on(self.flight > 0, Levels::FLYING))
    }
}
