//! The goals that a scene's rules give to bots.

use super::quest::Quest;
use jostle_game::scene::{
    Condition, Each, Placed, RuleSpec, SignalKind, Step, To, Trigger, ZoneArea, ZoneSpec,
};
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
    /// Things to carry to a zone.
    pub fetches: Vec<Errand>,
    /// Things that belong in a zone, and that a touch sends back there.
    pub guards: Vec<Errand>,
    /// Zones that heroes should touch in order.
    pub quests: Vec<Quest>,
    /// Groups of bodies that are worth touching, as a bit set.
    pub coins: u32,
    /// Groups of bodies that a sling should break, as a bit set.
    pub targets: u32,
    /// Whether dye packs can be fired.
    pub shoots: bool,
    /// Whether being hit by a dye pack costs a life or the round.
    pub fears_packs: bool,
}

/// A zone that a ball should enter, or should not.
#[derive(Clone, Copy, Debug)]
pub struct Goal {
    /// The zone's number.
    pub zone: u8,
    /// The balls' groups, as a bit set.
    pub balls: u32,
    /// The team for which having a ball in the zone is good or bad; `None` for all players.
    pub team: Option<u8>,
    pub is_good: bool,
    /// Whether balls must stay in the zone, instead of entering it once.
    pub keeps: bool,
}

/// Things that a team moves to a zone by touching them.
#[derive(Clone, Copy, Debug)]
pub struct Errand {
    pub team: Option<u8>,
    /// The things' groups, as a bit set.
    pub things: u32,
    pub zone: u8,
}

impl Goal {
    /// Returns whether a ball in the zone is good for a team.
    pub fn is_good_for(&self, team: Option<u8>) -> bool {
        (self.team.is_none() || self.team == team) == self.is_good
    }
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
        let mut aims = Aims {
            gates: gates.into_iter().next().unwrap_or_default(),
            hill: rules.rules.iter().find_map(held),
            shoots: scene.tools.contains(Tools::LAUNCH),
            quests: Quest::all(scene),
            coins: coins(scene),
            targets: targets(scene),
            fears_packs: rules.rules.iter().any(is_feared),
            ..Aims::default()
        };
        let heroes = heroes(scene);
        for goal in rules.rules.iter().flat_map(|rule| goals(scene, heroes, rule)) {
            let touched = |is_meant: fn(&RuleSpec) -> bool| {
                let touches = |rule: &&RuleSpec| {
                    let is_own = rule.team.is_none() || rule.team == goal.team;
                    is_meant(rule) && is_own && touches(rule, heroes, goal.balls)
                };
                goal.keeps && goal.is_good && rules.rules.iter().any(|rule| touches(&rule))
            };
            let errand = Errand { team: goal.team, things: goal.balls, zone: goal.zone };
            if touched(|rule| rule.effects.carry) {
                aims.fetches.push(errand);
            } else if touched(|rule| !rule.effects.reset.is_empty() || rule.effects.back.is_some())
            {
                aims.guards.push(errand);
            } else {
                aims.goals.push(goal);
            }
        }
        aims
    }
}

/// Returns whether a rule punishes the hero that a pack hits.
fn is_feared(rule: &RuleSpec) -> bool {
    let costs = rule.effects.life < 0 || rule.effects.end == Some(false);
    costs && rule.to == To::It && matches!(rule.occasion, Trigger::Burst)
}

/// The group of heroes, as a bit set.
fn heroes(scene: &Scene) -> u32 {
    scene.hero.as_ref().map_or(0, |hero| 1 << hero.body.group)
}

/// The groups of bodies for whose touch heroes get something.
fn coins(scene: &Scene) -> u32 {
    let heroes = heroes(scene);
    let groups = scene.rules.rules.iter().filter_map(|rule| match rule.occasion {
        Trigger::Touch(a, b) if rule.effects.score > 0 || rule.effects.end == Some(true) => {
            Some((1 << a | 1 << b) & !heroes).filter(|_| (heroes >> a | heroes >> b) & 1 == 1)
        }
        _ => None,
    });
    groups.fold(0, |all, group| all | group)
}

/// The groups of bodies that must break to win, or otherwise those that are worth most.
fn targets(scene: &Scene) -> u32 {
    let points = |body: &Placed| body.breaks.map_or(0, |breaks| breaks.points);
    let most = scene.bodies.iter().map(points).max().unwrap_or(0);
    let groups = |is_meant: &dyn Fn(&Placed) -> bool| {
        let bodies = scene.bodies.iter().filter(|body| body.breaks.is_some() && is_meant(body));
        bodies.fold(0, |all, body| all | 1u32 << body.def.group)
    };
    let wins = scene.rules.rules.iter().filter(|rule| rule.effects.end == Some(true));
    let emptied = wins.fold(0, |all, rule| match &rule.occasion {
        Trigger::On(condition) => all | condition.off.zones,
        _ => all,
    });
    let zones = (0..).zip(&scene.rules.zones).filter(|(index, _)| emptied >> index & 1 == 1);
    let who = zones.fold(0, |all, (_, zone): (u64, &ZoneSpec)| all | zone.who);
    match groups(&|body| who >> body.def.group & 1 == 1) {
        0 => groups(&|body| points(body) == most),
        groups => groups,
    }
}

/// Returns whether a rule is about a hero that touches one of these groups.
fn touches(rule: &RuleSpec, heroes: u32, groups: u32) -> bool {
    let Trigger::Touch(a, b) = rule.occasion else { return false };
    let is = |group: u8, groups: u32| groups >> group & 1 == 1;
    (is(a, heroes) && is(b, groups)) || (is(b, heroes) && is(a, groups))
}

/// The zones that a rule rewards or punishes balls for being in.
fn goals(scene: &Scene, heroes: u32, rule: &RuleSpec) -> Vec<Goal> {
    let effects = &rule.effects;
    let end = effects.end.map_or(0, |wins| if wins { 1 } else { -1 });
    let worth = effects.score.signum() + effects.life.signum() + end;
    let (zones, keeps) = match rule.occasion {
        Trigger::Enter(zones) => (zones, false),
        Trigger::On(condition) => (zones_of(scene, &condition, scene.rules.signals.len()), true),
        _ => (0, false),
    };
    let team = match rule.to {
        To::Team(team) => Some(team),
        To::It | To::All if keeps => None,
        _ => return Vec::new(),
    };
    let zones = (0..64u8).filter(|zone| zones >> zone & 1 == 1 && worth != 0);
    let goals = zones.filter_map(|zone| {
        let spec = &scene.rules.zones[usize::from(zone)];
        let balls = spec.who & !heroes;
        let is_place = spec.follow.is_none() && spec.area != ZoneArea::Everywhere;
        let goal = Goal { zone, balls, team, is_good: worth > 0, keeps };
        (balls != 0 && is_place).then_some(goal)
    });
    goals.collect()
}

/// The zones that must be on for a condition to hold, also through signals with an index below `above`.
fn zones_of(scene: &Scene, condition: &Condition, above: usize) -> u64 {
    let mut zones = condition.on.zones;
    for index in (0..above).filter(|index| condition.on.signals >> index & 1 == 1) {
        if let SignalKind::Relay(relay) = &scene.rules.signals[index].kind {
            zones |= zones_of(scene, &relay.when, index);
        }
    }
    zones
}

/// A zone of a scene by its number.
pub fn zone_of(scene: &Scene, zone: u8) -> &ZoneSpec {
    &scene.rules.zones[usize::from(zone)]
}

/// The middle of a stationary zone.
pub fn middle(zone: &ZoneSpec, size: Vec2) -> Vec2 {
    match zone.area {
        ZoneArea::Everywhere => size * 0.5,
        ZoneArea::Box(area) => (area.low + area.high) * 0.5,
        ZoneArea::Circle { center, .. } => center,
    }
}

/// The point nearest to `from` that is well inside a zone.
pub fn nearest_inside(zone: &ZoneSpec, size: Vec2, from: Vec2) -> Vec2 {
    const MARGIN: f32 = 12.0;
    match zone.area {
        ZoneArea::Box(area) => {
            let half = (area.high - area.low) * 0.5;
            let margin = Vec2::new(half.x.clamp(0.0, MARGIN), half.y.clamp(0.0, MARGIN));
            from.clamp(area.low + margin, area.high - margin)
        }
        _ => middle(zone, size),
    }
}
