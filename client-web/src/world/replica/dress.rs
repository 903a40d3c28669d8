//! Samples become the bodies of a frame: their age, the gaze of heroes, and which of them are
//! hot or marked. The body that X would grab, or a press would select, is lit before that.

use super::{Eye, Replica, age};
use crate::net::timeline::Sample;
use crate::view::frame::FrameBody;
use crate::world::overlap;
use crate::world::predict::placed;
use jostle_game::{Kind, RoundInfo, Scene, Seat, Tools, selectable_at};
use jostle_protocol::PlayerState;
use jostle_sim::{BodyId, Motion, Shape, Vec2};

/// Palette index of rings: the palest colour.
const PIECE: u8 = 7;

impl Replica {
    /// Turns samples into bodies of the frame.
    pub(super) fn dress(&mut self, eye: Eye) {
        let snapshot = self.timeline.at_or_before(self.display);
        let players: &[PlayerState] = snapshot.map_or(&[], |s| &s.players);
        let round = snapshot.and_then(|s| s.round.as_ref());
        let cracked = round.map_or(&[][..], |round| &round.cracked);
        let teams = &self.scene.rules.teams;
        let color_of = |player: &PlayerState| {
            let team = round.and_then(|round| round.player(player.seat)?.team);
            let team = team.and_then(|team| teams.get(usize::from(team)));
            team.map_or(player.appearance.color, |team| team.color)
        };
        let own = players.iter().find(|p| p.seat == self.seat);
        let selecting = self.scene.tools.contains(Tools::SELECT);
        let selected = own.and_then(|p| p.selected).filter(|_| selecting);
        let hot = eye.pointer.and_then(|at| match selecting {
            true => selectable_at(self.samples.iter().map(outline), selected, at),
            false => hot_body(&self.scene, &self.samples, players, own, at),
        });
        self.bodies.clear();
        for sample in &self.samples {
            let player = sample.owner.and_then(|seat| players.iter().find(|p| p.seat == seat));
            let gaze = gaze(sample, player, self.seat, eye.pointer, self.scene.world.quantum);
            let held = players.iter().any(|p| p.held == Some(sample.id));
            self.bodies.push(FrameBody {
                id: sample.id,
                kind: sample.kind,
                color: player.map(color_of),
                shape: sample.shape,
                center: sample.center,
                velocity: sample.velocity,
                age: age(&self.births, sample.id, self.display),
                gaze,
                touching: false,
                hidden: selected == Some(sample.id),
                hot: held || hot == Some(sample.id),
                cracked: cracked.binary_search(&sample.id.index).is_ok(),
                ring: round.and_then(|round| ring(&self.scene, round, sample)),
                squash: None,
            });
        }
        if eye.bounds || selecting {
            self.mark_touching(selected);
        }
    }

    /// In a scene of selecting, what the selected body touches is marked; elsewhere all overlaps.
    fn mark_touching(&mut self, selected: Option<BodyId>) {
        let Replica { samples, bodies, scene, .. } = self;
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
}

/// The ring around what a game is about: bodies other than heroes that one of its zones counts. In a zone that
/// is drawn it has the colour of that.
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

fn outline(sample: &Sample) -> (BodyId, Kind, Shape, Vec2) {
    (sample.id, sample.kind, sample.shape, sample.center)
}

/// Gaze of a hero. The player's own follows the pointer without a round trip to the server.
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

/// The body that X would grab at a point: the first loose one there that is not held, as the
/// room's rule says. A player who holds one grabs no other.
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

/// Whether a body of its kind can be grabbed and moves freely. Snapshots do not tell how a body
/// moves; the scene does.
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

/// Whether the rules of the scene let two bodies collide.
fn meet(scene: &Scene, a: &Sample, b: &Sample) -> bool {
    scene.world.meets[usize::from(a.group)] >> b.group & 1 == 1
}
