//! The picture of a room at the displayed moment: bodies with their ages, their gazes and the ways in which they are
//! highlighted; zones in their holders' colours, marks, the sling, and flashes.

use super::room::RoomView;
use crate::language::say;
use crate::net::timeline::Sample;
use crate::view::frame::{
    Effect, EffectKind, FrameBody, FrameLamp, FrameMark, FrameRoom, FrameSling, FrameZone,
    ZoneLabel, ZoneSign,
};
use crate::world::overlap;
use crate::world::predict::placed;
use jostle_game::scene::{Each, Need, Step, ZoneArea, ZoneSpec};
use jostle_game::{
    Kind, RoundInfo, RoundPhase, Scene, Seat, Side, Tools, selectable_at, sling_path,
};
use jostle_protocol::PlayerState;
use jostle_sim::{BodyId, Motion, Shape, TICKS_PER_SECOND, Vec2};
use std::collections::VecDeque;

/// Duration of a flash, ticks.
const EFFECT_TICKS: f64 = TICKS_PER_SECOND as f64;
/// Maximum number of simultaneous flashes; the oldest are dropped first.
const EFFECTS_MAX: usize = 256;
/// Palette index of rings: the palest colour.
const PIECE: u8 = 7;
/// A zone whose length is more than this times its width is a gate.
const GATE_LENGTH: f32 = 8.0;
/// Length of the displayed path, and distance between its dots, ticks.
const PATH_TICKS: u32 = 75;
const DOT_TICKS: usize = 3;

/// The player-dependent inputs to a frame.
#[derive(Clone, Copy, Debug, Default)]
pub struct Eye {
    /// The player's pointer in world units.
    pub pointer: Option<Vec2>,
    /// Whether the bounds view is on.
    pub bounds: bool,
}

#[derive(Clone, Copy, Debug)]
struct Flash {
    tick: u32,
    effect: Effect,
}

/// The picture of a room.
#[derive(Default)]
pub struct RoomPicture {
    /// The picture as part of a frame.
    pub drawn: FrameRoom,
    flashes: VecDeque<Flash>,
}

impl RoomPicture {
    /// Draws the displayed moment.
    pub fn lay_out(&mut self, room: &RoomView, eye: Eye) {
        self.drawn.theme = room.scene.theme;
        self.dress(room, eye);
        self.lay_out_zones(room);
        self.lay_out_marks(room);
        self.drawn.sling = find_sling(room);
        self.collect_effects(room.display);
    }

    /// Turns samples into the bodies of the frame.
    fn dress(&mut self, room: &RoomView, eye: Eye) {
        let snapshot = room.timeline.at_or_before(room.display);
        let players: &[PlayerState] = snapshot.map_or(&[], |s| &s.players);
        let round = snapshot.and_then(|s| s.round.as_ref());
        let cracked = round.map_or(&[][..], |round| &round.cracked);
        let teams = &room.scene.rules.teams;
        let color_of = |player: &PlayerState| {
            let team = round.and_then(|round| round.player(player.seat)?.team);
            let team = team.and_then(|team| teams.get(usize::from(team)));
            team.map_or(player.appearance.color, |team| team.color)
        };
        let own = players.iter().find(|p| p.seat == room.seat);
        let selecting = room.scene.tools.contains(Tools::SELECT);
        let selected = own.and_then(|p| p.selected).filter(|_| selecting);
        let hot = eye.pointer.and_then(|at| match selecting {
            true => selectable_at(room.samples.iter().map(selectable), selected, at),
            false => hot_body(&room.scene, &room.samples, players, own, at),
        });
        self.drawn.bodies.clear();
        for sample in &room.samples {
            let player = sample.owner.and_then(|seat| players.iter().find(|p| p.seat == seat));
            let gaze = gaze(sample, player, room.seat, eye.pointer, room.scene.world.quantum);
            let held = players.iter().any(|p| p.held == Some(sample.id));
            self.drawn.bodies.push(FrameBody {
                id: sample.id,
                kind: sample.kind,
                color: player.map(color_of),
                shape: sample.shape,
                center: sample.center,
                velocity: sample.velocity,
                age: room.age(sample.id),
                gaze,
                touching: false,
                hidden: selected == Some(sample.id),
                hot: held || hot == Some(sample.id),
                cracked: cracked.binary_search(&sample.id.index).is_ok(),
                ring: round.and_then(|round| ring(&room.scene, round, sample)),
                squash: None,
            });
        }
        if eye.bounds || selecting {
            self.mark_touching(room, selected);
        }
    }

    /// Marks overlapping bodies; in a scene with selection, only those that overlap the selected body.
    fn mark_touching(&mut self, room: &RoomView, selected: Option<BodyId>) {
        let (RoomView { samples, scene, .. }, bodies) = (room, &mut self.drawn.bodies);
        if scene.tools.contains(Tools::SELECT) {
            let Some(id) = selected else { return };
            let Some(chosen) = samples.iter().find(|s| s.id == id) else { return };
            for (body, sample) in bodies.iter_mut().zip(samples.iter()) {
                body.touching = sample.id != id
                    && meet(scene, chosen, sample)
                    && overlap::touching(chosen, sample);
            }
            return;
        }
        let meets = |i: usize, j: usize| meet(scene, &samples[i], &samples[j]);
        overlap::pairs(samples, meets, |i, j| {
            bodies[i].touching = true;
            bodies[j].touching = true;
        });
    }

    /// Collects the zones at the displayed moment.
    fn lay_out_zones(&mut self, room: &RoomView) {
        self.drawn.zones.clear();
        let Some(round) = room.round() else { return };
        let specs = room.scene.rules.zones.iter().enumerate();
        let drawn =
            specs.filter(|(index, spec)| spec.is_drawn() && round.resting >> index & 1 == 0);
        self.drawn.zones.extend(drawn.filter_map(|(index, spec)| zone(room, index, spec, round)));
    }

    /// Collects the lamps and the visible marks.
    fn lay_out_marks(&mut self, room: &RoomView) {
        let FrameRoom { marks, lamps, .. } = &mut self.drawn;
        marks.clear();
        lamps.clear();
        for mark in &room.scene.marks {
            let light = match mark.lamp {
                None => 1.0,
                Some(lamp) => {
                    let Some(center) = room.find_placed(lamp) else { continue };
                    let lamp = FrameLamp { center, reach: mark.reach };
                    if !lamps.contains(&lamp) {
                        lamps.push(lamp);
                    }
                    1.0 - center.distance(mark.position) / mark.reach
                }
            };
            if light > 0.0 {
                // Full brightness is reached well before the lamp arrives.
                let light = (2.0 * light).min(1.0);
                let (center, dots, size) = (mark.position, mark.dots, mark.size);
                marks.push(FrameMark { center, dots, size, light });
            }
        }
    }

    /// Starts showing a flash.
    pub fn flash(
        &mut self,
        tick: u32,
        kind: EffectKind,
        point: Vec2,
        color: Option<u8>,
        strength: f32,
        body: Option<BodyId>,
    ) {
        if self.flashes.len() == EFFECTS_MAX {
            self.flashes.pop_front();
        }
        let effect = Effect { kind, point, age: 0.0, color, strength, body };
        self.flashes.push_back(Flash { tick, effect });
    }

    fn collect_effects(&mut self, display: f64) {
        while self
            .flashes
            .front()
            .is_some_and(|flash| display - f64::from(flash.tick) > EFFECT_TICKS)
        {
            self.flashes.pop_front();
        }
        self.drawn.effects.clear();
        self.drawn.effects.extend(self.flashes.iter().map(|flash| {
            let ticks = (display - f64::from(flash.tick)).max(0.0);
            Effect { age: (ticks / f64::from(TICKS_PER_SECOND)) as f32, ..flash.effect }
        }));
    }

    /// The labels of the zones at the displayed moment: their text, and the current and required number of bodies if a
    /// zone needs several. A sling that reloads has one too.
    pub fn zone_labels(&self, room: &RoomView) -> impl Iterator<Item = ZoneLabel> {
        let zones = self.drawn.zones.iter().filter_map(|zone| {
            let spec = &room.scene.rules.zones[usize::from(zone.index)];
            let (mut text, count) = (spec.label.clone(), count_in(room, spec));
            if let Some((inside, needed)) = count {
                text = format!("{text} {inside} / {needed}");
            }
            let half = zone.shape.half_extent();
            let color = zone.color;
            (!text.is_empty()).then_some(ZoneLabel { text, center: zone.center, half, color })
        });
        zones.chain(reloading(room))
    }
}

/// The label at a sling whose ball is on its way, so that pulling does nothing.
fn reloading(room: &RoomView) -> Option<ZoneLabel> {
    let round = room.round().filter(|round| round.phase == RoundPhase::Running)?;
    let (spec, info) = (room.scene.sling?, round.sling?);
    let center = room.scene.bodies[spec.ball].def.position;
    (info.is_flying && info.shots > 0).then(|| ZoneLabel {
        text: say("Reloading…").to_owned(),
        center,
        half: Vec2::ZERO,
        color: None,
    })
}

/// A zone as it is drawn.
fn zone(room: &RoomView, index: usize, spec: &ZoneSpec, round: &RoundInfo) -> Option<FrameZone> {
    let (shape, center) = outline(spec.area)?;
    // The position of a zone that follows a body is relative to that body.
    let offset = match spec.follow {
        None => Vec2::ZERO,
        Some(body) => room.find_placed(body)?,
    };
    let holder = round.holders.get(index).copied().flatten();
    let mut color = holder.map(|side| room.color_of_side(side)).or(spec.color);
    let mut on = round.zones >> index & 1 == 1;
    if is_next(room, index as u8, round) {
        (color, on) = (room.own_color().or(color), true);
    }
    let taken = taken(room, index as u8, spec, round);
    let (index, center, sign) = (index as u8, center + offset, sign(room.scene.size, spec));
    Some(FrameZone { index, shape, center, sign, color, on, taken })
}

/// The kind of a zone, as far as its area shows it.
pub(super) fn sign(world: Vec2, spec: &ZoneSpec) -> ZoneSign {
    match spec.area {
        _ if spec.follow.is_some() => ZoneSign::Flag,
        ZoneArea::Box(area) if area.low.min(world - area.high).min_element() < 0.0 => {
            ZoneSign::Goal
        }
        ZoneArea::Box(area) if !spec.touch => {
            let extent = area.high - area.low;
            let is_thin = extent.max_element() > GATE_LENGTH * extent.min_element();
            if is_thin { ZoneSign::Gate } else { ZoneSign::Area }
        }
        _ => ZoneSign::Area,
    }
}

/// The current and required number of bodies in a zone, if it needs more than one.
fn count_in(room: &RoomView, spec: &ZoneSpec) -> Option<(usize, usize)> {
    let counted = room.samples.iter().filter(|sample| spec.who >> sample.group & 1 == 1);
    let needed = match spec.need {
        Need::All => counted.clone().count(),
        Need::Count(needed) => needed as usize,
    };
    let inside = counted.filter(|sample| spec.follow.is_none() && spec.holds(sample.center));
    (needed > 1).then(|| (inside.count(), needed))
}

/// Whether a zone is the next step of an order, such as a lap, for the player or the player's team. Orders shared
/// by all players are excluded, because players may have to discover them.
fn is_next(room: &RoomView, zone: u8, round: &RoundInfo) -> bool {
    let signals = (0..).zip(&room.scene.rules.signals);
    signals.filter_map(|(index, signal)| signal.order().map(|order| (index, order))).any(
        |(index, order)| {
            let side = match order.each {
                Each::All => return false,
                Each::Side => round.side_of(room.seat),
                Each::Player => Side::Player(room.seat),
            };
            let next = order.steps.get(usize::from(round.steps(index, Some(side))));
            next == Some(&Step::Zone(zone))
        },
    )
}

/// The colour of the side that is capturing a zone, and the share of the required time that has passed.
fn taken(room: &RoomView, zone: u8, spec: &ZoneSpec, round: &RoundInfo) -> Option<(u8, f32)> {
    let taking = round.takings.iter().find(|taking| taking.zone == zone)?;
    let ticks = room.display - f64::from(taking.since);
    let share = ticks / f64::from(spec.take?.ticks.max(1));
    Some((room.color_of_side(taking.side), share.clamp(0.0, 1.0) as f32))
}

/// Shape and centre of an area; `None` for an area that is everywhere.
fn outline(area: ZoneArea) -> Option<(Shape, Vec2)> {
    match area {
        ZoneArea::Everywhere => None,
        ZoneArea::Box(area) => {
            let half = (area.high - area.low) * 0.5;
            Some((Shape::Box { half }, area.low + half))
        }
        ZoneArea::Circle { center, radius } => Some((Shape::Circle { radius }, center)),
    }
}

/// The sling, the position of its ball, and the path along which the ball would fly.
fn find_sling(room: &RoomView) -> Option<FrameSling> {
    let (spec, info) = (room.scene.sling?, room.round()?.sling?);
    let start = room.scene.bodies[spec.ball].def.position;
    let ball = room.find_placed(spec.ball).filter(|_| !info.is_flying);
    // A ball that was just released is already in flight in the newest snapshot.
    let ball = ball.filter(|at| at.distance(start) <= spec.pull + 0.5);
    let path = ball.map(|ball| sling_path(&room.scene, ball - start, PATH_TICKS));
    let path = path.unwrap_or_default().into_iter().step_by(DOT_TICKS).collect();
    Some(FrameSling { start, ball, shots: info.shots, path })
}

/// The ring around an important object of the game: a body other than a hero that a zone counts. Inside a visible zone
/// it has that zone's colour.
fn ring(scene: &Scene, round: &RoundInfo, sample: &Sample) -> Option<u8> {
    if sample.kind == Kind::Hero {
        return None;
    }
    let zones = (0..).zip(&scene.rules.zones);
    let counting = zones.filter(|(_, zone)| zone.who >> sample.group & 1 == 1);
    let mut is_counted = false;
    for (index, zone) in counting.filter(|(_, zone)| zone.slower.is_none()) {
        is_counted = true;
        let is_in_force = round.resting >> index & 1 == 0;
        if is_in_force && zone.is_drawn() && zone.follow.is_none() && zone.holds(sample.center) {
            return zone.color.or(Some(PIECE));
        }
    }
    is_counted.then_some(PIECE)
}

fn selectable(sample: &Sample) -> (BodyId, Kind, Shape, Vec2) {
    (sample.id, sample.kind, sample.shape, sample.center)
}

/// A hero's gaze. The player's own hero follows the pointer without a round trip to the server.
fn gaze(
    sample: &Sample,
    player: Option<&PlayerState>,
    own_seat: Seat,
    own_pointer: Option<Vec2>,
    quantum: f32,
) -> Option<Vec2> {
    let player = player.filter(|_| sample.kind == Kind::Hero)?;
    let sent = player.pointer.map(|q| Vec2::new(q[0] as f32, q[1] as f32) * quantum);
    if player.seat == own_seat { own_pointer.or(sent) } else { sent }
}

/// The body that X would grab at this point. As in the room, it is the first loose one there that is not held. A player
/// who already holds a body cannot grab another.
fn hot_body(
    scene: &Scene,
    samples: &[Sample],
    players: &[PlayerState],
    own: Option<&PlayerState>,
    point: Vec2,
) -> Option<BodyId> {
    if !scene.tools.contains(Tools::HOLD) || own.is_some_and(|player| player.held.is_some()) {
        return None;
    }
    let taken = |id: BodyId| players.iter().any(|player| player.held == Some(id));
    let grabbed =
        |s: &&Sample| s.shape.contains(point - s.center) && is_loose(scene, s) && !taken(s.id);
    samples.iter().find(grabbed).map(|s| s.id)
}

/// Whether a body moves freely and is of a kind that can be grabbed. Snapshots do not contain a body's type of motion,
/// but the scene does.
fn is_loose(scene: &Scene, sample: &Sample) -> bool {
    if !matches!(sample.kind, Kind::Marble | Kind::Block) {
        return false;
    }
    if let Some(placed) = placed(scene, sample.id) {
        return placed.def.motion == Motion::Dynamic;
    }
    let fixed = scene.layouts.iter().filter(|layout| layout.def.motion != Motion::Dynamic);
    let mut alike = fixed.filter(|l| l.kind == sample.kind && l.def.group == sample.group);
    !alike.any(|layout| layout.shapes.contains(&sample.shape))
}

/// Whether two bodies may collide in this scene.
fn meet(scene: &Scene, a: &Sample, b: &Sample) -> bool {
    scene.world.meets[usize::from(a.group)] >> b.group & 1 == 1
}
