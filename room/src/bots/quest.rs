//! The zones that heroes have to touch to win, in the order in which the rules ask for them: plates that open doors,
//! and what is behind them.

use jostle_game::scene::{Condition, Each, SignalKind, Stays, Step, To, Trigger, ZoneArea};
use jostle_game::{RoundInfo, Scene};

/// The zones that heroes of a team have to touch, one after another.
#[derive(Clone, Debug, Default)]
pub struct Quest {
    /// The team that it is good for; `None` for all players.
    pub team: Option<u8>,
    pub steps: Vec<QuestStep>,
}

/// One zone to touch.
#[derive(Clone, Copy, Debug)]
pub struct QuestStep {
    /// The zone's index.
    pub zone: u8,
    /// The order to which the step belongs, by its signal, and the number of steps before it in the order.
    order: Option<(u8, u8)>,
    /// The step to go back to if the progress in the order is lost.
    pub first: usize,
    /// Number of ticks for which touching the zone lasts, if that ends.
    pub lasts: Option<u32>,
}

impl QuestStep {
    /// Returns whether the step only counts for as long as the steps before it last.
    pub fn is_of_order(&self) -> bool {
        self.order.is_some()
    }
}

impl Quest {
    /// All quests of a scene.
    pub fn all(scene: &Scene) -> Vec<Quest> {
        let rules = scene.rules.rules.iter();
        let quests = rules.filter_map(|rule| {
            let effects = &rule.effects;
            let team = match rule.to {
                To::Team(team) => Some(team),
                To::It | To::By | To::All => rule.team,
                _ => return None,
            };
            if effects.end != Some(true) && effects.score <= 0 {
                return None;
            }
            let mut plan = Planner::new(scene);
            match &rule.occasion {
                Trigger::On(condition) => plan.fulfil(condition),
                Trigger::Enter(zones) => {
                    plan.open_doors();
                    plan.fulfil(&rule.condition);
                    bits(*zones).take(1).for_each(|zone| plan.visit(zone, None, 0));
                }
                _ => {}
            }
            Some(Quest { team, steps: plan.steps }).filter(|quest| !quest.steps.is_empty())
        });
        quests.collect()
    }

    /// The step after `at`, considering what players can see of the round. It goes on to what is not done yet, and back
    /// if a wrong step or the time undid the steps before.
    pub fn resume(&self, at: usize, round: Option<&RoundInfo>) -> usize {
        let done = |step: &QuestStep| {
            step.order.map(|(signal, before)| {
                let count = round.map_or(0, |round| round.steps(signal, None));
                (count > before, count < before)
            })
        };
        let mut next = at;
        while let Some((true, _)) = self.steps.get(next).and_then(done) {
            next += 1;
        }
        match self.steps.get(next) {
            Some(step) if done(step).is_some_and(|(_, is_lost)| is_lost) => step.first,
            _ => next,
        }
    }
}

/// Collects the steps of a quest.
struct Planner<'a> {
    scene: &'a Scene,
    steps: Vec<QuestStep>,
    /// Signals that the steps switch on, and off, one bit each.
    on: u64,
    off: u64,
}

impl<'a> Planner<'a> {
    fn new(scene: &'a Scene) -> Planner<'a> {
        Planner { scene, steps: Vec::new(), on: 0, off: 0 }
    }

    /// Plans to make bodies go that signals take away, and come that signals bring.
    fn open_doors(&mut self) {
        for body in &self.scene.bodies {
            bits(body.presence.off.signals | body.presence.on.signals)
                .for_each(|signal| self.switch_on(signal));
        }
    }

    /// Plans to make a condition hold.
    fn fulfil(&mut self, condition: &Condition) {
        bits(condition.on.signals).for_each(|signal| self.switch_on(signal));
        bits(condition.off.signals).for_each(|signal| self.switch_off(signal));
        bits(condition.on.zones).for_each(|zone| self.visit(zone, None, 0));
    }

    /// Plans to keep a condition from holding.
    fn prevent(&mut self, condition: &Condition) {
        bits(condition.on.signals).for_each(|signal| self.switch_off(signal));
        bits(condition.off.signals).for_each(|signal| self.switch_on(signal));
    }

    fn switch_on(&mut self, index: u8) {
        if self.on >> index & 1 == 1 {
            return;
        }
        self.on |= 1 << index;
        let (scene, first) = (self.scene, self.steps.len());
        let signal = &scene.rules.signals[usize::from(index)];
        signal.until.iter().for_each(|until| self.prevent(until));
        match &signal.kind {
            SignalKind::Relay(relay) => {
                self.fulfil(&relay.when);
                if let (Stays::Ticks(ticks @ 1..), Some(step)) =
                    (relay.stays, self.steps.last_mut())
                {
                    step.lasts = Some(ticks);
                }
                if let Some(any) = &relay.any {
                    bits(any.on.zones).take(1).for_each(|zone| self.visit(zone, None, 0));
                    bits(any.on.signals).take(1).for_each(|signal| self.switch_on(signal));
                }
            }
            SignalKind::Order(order) if order.each == Each::All => {
                for (before, step) in (0..).zip(&order.steps) {
                    match *step {
                        Step::Zone(zone) => self.visit(zone, Some((index, before)), first),
                        Step::Signal(signal) => self.switch_on(signal),
                    }
                }
            }
            SignalKind::Order(_) => {}
        }
    }

    fn switch_off(&mut self, index: u8) {
        if self.off >> index & 1 == 1 {
            return;
        }
        self.off |= 1 << index;
        let scene = self.scene;
        if let SignalKind::Relay(relay) = &scene.rules.signals[usize::from(index)].kind {
            self.prevent(&relay.when);
        }
    }

    /// Adds a zone if heroes can touch it.
    fn visit(&mut self, zone: u8, order: Option<(u8, u8)>, first: usize) {
        let spec = &self.scene.rules.zones[usize::from(zone)];
        let heroes = self.scene.hero.as_ref().map_or(0, |hero| 1 << hero.body.group);
        let is_place = spec.follow.is_none() && spec.area != ZoneArea::Everywhere;
        let is_known = order.is_none() && self.steps.iter().any(|step| step.zone == zone);
        if spec.who & heroes != 0 && is_place && !is_known {
            self.steps.push(QuestStep { zone, order, first, lasts: None });
        }
    }
}

/// The indices of the bits that are set, ascending.
fn bits(bits: u64) -> impl Iterator<Item = u8> {
    (0..64).filter(move |index| bits >> index & 1 == 1)
}
