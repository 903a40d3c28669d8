//! The goals that a scene's rules give to bots.

use jostle_game::scene::{Each, RuleSpec, SignalKind, Step, To, Trigger, ZoneArea, ZoneSpec};
use jostle_game::{Scene, Tools};
use jostle_sim::Vec2;

/// The things that a bot can do in a scene.
#[derive(Clone, Debug, Default)]
pub struct Aims {
    /// Zones to pass through in this order, over and over.
    pub gates: Vec<u8>,
    /// A zone to hold alone.
    pub hill: Option<u8>,
    /// Zones that a ball should enter, or should not.
    pub goals: Vec<Goal>,
    /// Whether dye packs can be fired.
    pub shoots: bool,
}

/// A zone that a ball should enter, or should not.
#[derive(Clone, Copy, Debug)]
pub struct Goal {
    /// The zone's number.
    pub zone: u8,
    /// The balls' groups, as a bit set.
    pub balls: u32,
    /// The team for which having a ball in the zone is good or bad.
    pub team: u8,
    pub is_good: bool,
}

impl Aims {
    /// Derives the aims from the scene's rules.
    pub fn of(scene: &Scene) -> Aims {
        let rules = &scene.rules;
        let orders = rules.signals.iter().filter_map(|signal| match &signal.kind {
            SignalKind::Order(order) if order.each != Each::All => Some(order),
            _ => None,
        });
        let gates = orders.map(|order| {
            let zones = order.steps.iter().filter_map(|step| match step {
                Step::Zone(zone) => Some(*zone),
                Step::Signal(_) => None,
            });
            zones.collect()
        });
        let held = |rule: &RuleSpec| match rule.to {
            To::Holder(zone) if rule.effects.score > 0 => Some(zone),
            _ => None,
        };
        let heroes = scene.hero.as_ref().map_or(0, |hero| 1 << hero.body.group);
        let balls = |zone: u8| rules.zones[usize::from(zone)].who & !heroes;
        let goals = rules.rules.iter().flat_map(|rule| {
            let (zones, team) = match (rule.occasion, rule.to) {
                (Trigger::Enter(zones), To::Team(team)) => (zones, team),
                _ => (0, 0),
            };
            let worth = rule.effects.score.signum() + rule.effects.life.signum();
            let zones = (0..64u8).filter(move |zone| zones >> zone & 1 == 1 && worth != 0);
            zones.map(move |zone| Goal { zone, balls: balls(zone), team, is_good: worth > 0 })
        });
        Aims {
            gates: gates.into_iter().next().unwrap_or_default(),
            hill: rules.rules.iter().find_map(held),
            goals: goals.filter(|goal| goal.balls != 0).collect(),
            shoots: scene.tools.contains(Tools::LAUNCH),
        }
    }
}

/// The middle of a stationary zone.
pub fn middle(zone: &ZoneSpec, size: Vec2) -> Vec2 {
    match zone.area {
        ZoneArea::Everywhere => size * 0.5,
        ZoneArea::Box(area) => (area.low + area.high) * 0.5,
        ZoneArea::Circle { center, .. } => center,
    }
}
