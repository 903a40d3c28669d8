//! The rules' part of a game's state. Its hash digests the saved bytes, part by part.

use super::book::Rules;
use super::clock::{Round, RoundPhase};
use super::memory::{OrderState, RelayState, SignalState, Sling, Walker, ZoneState};
use super::notes::{Note, Rest, Start};
use crate::player::{Held, Player};
use crate::roster::Roster;
use crate::scene::{GRAVITY_SCALE_MAX, Levels, SEATS_MAX, Scene, SignalKind, SignalSpec};
use crate::side::{Side, Standing};
use crate::state::{read_rng, read_seat, save_seat};
use glam::Vec2;
use jostle_sim::state::bytes::{StateReader, StateWriter};
use jostle_sim::state::{StateVisitor, Subject};
use jostle_sim::{BodyId, Motion, StateError, World};

/// Stands for nobody where a side may be.
const NO_SIDE: u8 = 0;
const TEAM: u8 = 1;
const PLAYER: u8 = 2;
const BODY_BYTES: usize = 8;

impl Rules {
    /// Visits all of it in a fixed order.
    pub fn visit(&self, world: &World, roster: &Roster, visitor: &mut impl StateVisitor) {
        let mut out = StateWriter::default();
        let mut part = |subject, save: &dyn Fn(&mut StateWriter)| {
            out.0.clear();
            save(&mut out);
            for chunk in out.0.chunks(4) {
                let mut word = [0; 4];
                word[..chunk.len()].copy_from_slice(chunk);
                visitor.bits(subject, "state", u32::from_le_bytes(word));
            }
        };
        part(Subject::One("round"), &|out| self.save_round(out));
        for (index, zone) in (0..).zip(&self.zones) {
            part(Subject::Numbered("zone", index), &|out| zone.save(out));
        }
        for (index, signal) in (0..).zip(&self.signals) {
            part(Subject::Numbered("signal", index), &|out| signal.save(out));
        }
        for actor in roster.actors() {
            let note = self.notes.of_existing(actor.id, world);
            part(Subject::Numbered("note of body", actor.id.index), &|out| note.save(out));
        }
        for player in &roster.players {
            let seat = u32::from(player.seat.0);
            part(Subject::Numbered("player in the round", seat), &|out| save_player(player, out));
        }
    }

    /// Saves all of it.
    pub fn save(&self, world: &World, roster: &Roster, out: &mut StateWriter) {
        self.save_round(out);
        self.zones.iter().for_each(|zone| zone.save(out));
        self.signals.iter().for_each(|signal| signal.save(out));
        roster.actors().for_each(|actor| self.notes.of_existing(actor.id, world).save(out));
        roster.players.iter().for_each(|player| save_player(player, out));
    }

    fn save_round(&self, out: &mut StateWriter) {
        let Round { phase, ticks, clock } = self.round;
        out.byte(phase as u8);
        out.word(ticks);
        out.word(clock);
        out.byte(u8::from(self.contested));
        out.long(self.levels.zones);
        out.long(self.levels.signals);
        out.byte(self.levels.teams);
        self.teams.iter().for_each(|team| save_standing(team, out));
        out.short(self.winners.len() as u16);
        self.winners.iter().for_each(|&side| save_side(Some(side), out));
        for (&came, &stood) in self.came.iter().zip(&self.stood) {
            out.byte(u8::from(came));
            out.word(stood);
        }
        self.layouts.state().into_iter().for_each(|half| out.long(half));
        if let Some(sling) = &self.sling {
            out.byte(self.levels.sling);
            sling.save(out);
        }
    }

    /// Restores what [`Rules::save`] saved, into rules that have not begun.
    pub fn restore(
        mut self,
        scene: &Scene,
        world: &World,
        roster: &mut Roster,
        bytes: &mut StateReader,
    ) -> Result<Rules, StateError> {
        self.read_round(bytes)?;
        let teams = self.teams.len();
        for zone in &mut self.zones {
            *zone = read_zone(scene, teams, bytes)?;
        }
        for (signal, spec) in self.signals.iter_mut().zip(&scene.rules.signals) {
            *signal = read_signal(spec, teams, bytes)?;
        }
        let ids: Vec<BodyId> = roster.actors().map(|actor| actor.id).collect();
        for id in ids {
            let note = read_note(id, scene, world, bytes)?;
            *self.notes.of(id, world) = note;
        }
        for (body, &id) in roster.placed.iter().enumerate() {
            if let Some(id) = id {
                self.notes.of(id, world).placed = Some(body);
            }
        }
        for player in &mut roster.players {
            read_player(player, teams, scene, world, bytes)?;
        }
        Ok(self)
    }

    fn read_round(&mut self, bytes: &mut StateReader) -> Result<(), StateError> {
        let phase = usize::from(bytes.byte("phase of the round")?);
        let phase = RoundPhase::ALL.get(phase).copied();
        let phase = phase.ok_or_else(|| bytes.wrong("phase of the round"))?;
        let (ticks, clock) = (bytes.word("ticks of the round")?, bytes.word("clock")?);
        // A countdown's clock stands at 1, and no path has stood still before it.
        let clock_min = u32::from(phase == RoundPhase::Countdown);
        bytes.check(clock >= clock_min, "clock")?;
        self.round = Round { phase, ticks, clock };
        self.contested = read_truth("contested", bytes)?;
        self.levels = Levels {
            zones: bytes.long("zones")?,
            signals: bytes.long("signals")?,
            teams: bytes.byte("teams")?,
            sling: 0,
        };
        for team in &mut self.teams {
            *team = read_standing(bytes)?;
        }
        let teams = self.teams.len();
        let winners = bytes.short("number of winners")?;
        bytes.check(usize::from(winners) <= SEATS_MAX, "number of winners")?;
        self.winners.clear();
        for _ in 0..winners {
            let side = read_side(teams, bytes)?.ok_or_else(|| bytes.wrong("winner"))?;
            self.winners.push(side);
        }
        for (came, stood) in self.came.iter_mut().zip(&mut self.stood) {
            *came = read_truth("presence", bytes)?;
            *stood = bytes.word("ticks stood")?;
            bytes.check(*stood <= clock - clock_min, "ticks stood")?;
        }
        self.layouts = read_rng(bytes)?;
        if let Some(sling) = &mut self.sling {
            self.levels.sling = bytes.byte("sling")?;
            *sling = read_sling(sling.shots, bytes)?;
        }
        Ok(())
    }
}

impl ZoneState {
    fn save(&self, out: &mut StateWriter) {
        out.word(self.inside.len() as u32);
        self.inside.iter().for_each(|&id| out.body(Some(id)));
        save_side(self.holder, out);
        save_side(self.taking.map(|(side, _)| side), out);
        out.word(self.taking.map_or(0, |(_, ticks)| ticks));
    }
}

fn read_zone(
    scene: &Scene,
    teams: usize,
    bytes: &mut StateReader,
) -> Result<ZoneState, StateError> {
    // Some may be gone by now.
    let count = bytes.count(scene.world.bodies_max, BODY_BYTES, "bodies in a zone")?;
    let mut inside = Vec::new();
    for _ in 0..count {
        let id = bytes.body("body in a zone")?.ok_or_else(|| bytes.wrong("body in a zone"))?;
        inside.push(id);
    }
    let holder = read_side(teams, bytes)?;
    let taking = read_side(teams, bytes)?;
    let ticks = bytes.word("ticks alone")?;
    Ok(ZoneState { inside, holder, taking: taking.map(|side| (side, ticks)) })
}

impl SignalState {
    fn save(&self, out: &mut StateWriter) {
        match self {
            SignalState::Relay(RelayState { held, left, base, toggled }) => {
                out.word(*held);
                out.word(*left);
                out.byte(u8::from(*base) | u8::from(*toggled) << 1);
            }
            SignalState::Order(OrderState { done }) => {
                out.short(done.len() as u16);
                for &(walker, steps) in done {
                    save_side(walker.side(), out);
                    out.byte(steps);
                }
            }
        }
    }
}

fn read_signal(
    spec: &SignalSpec,
    teams: usize,
    bytes: &mut StateReader,
) -> Result<SignalState, StateError> {
    let SignalKind::Order(order) = &spec.kind else {
        let (held, left) = (bytes.word("ticks held")?, bytes.word("ticks left")?);
        let flags = bytes.byte("signal")?;
        bytes.check(flags < 4, "signal")?;
        let (base, toggled) = (flags & 1 == 1, flags & 2 == 2);
        return Ok(SignalState::Relay(RelayState { held, left, base, toggled }));
    };
    let count = bytes.short("progress")?;
    bytes.check(usize::from(count) <= SEATS_MAX, "progress")?;
    let mut done: Vec<(Walker, u8)> = Vec::new();
    for _ in 0..count {
        let walker = Walker::of(order.each, read_side(teams, bytes)?);
        let walker = walker.ok_or_else(|| bytes.wrong("progress"))?;
        let steps = bytes.byte("steps done")?;
        let fits = (1..=order.steps.len()).contains(&usize::from(steps));
        let ordered = done.last().is_none_or(|(last, _)| *last < walker);
        bytes.check(fits && ordered, "steps done")?;
        done.push((walker, steps));
    }
    Ok(SignalState::Order(OrderState { done }))
}

impl Note {
    fn save(&self, out: &mut StateWriter) {
        out.vector(self.start.position);
        out.vector(self.start.velocity);
        save_seat(self.touched_by, out);
        out.byte(u8::from(self.rests.is_some()) | u8::from(self.is_cracked) << 1);
        if let Some(Rest { ticks, gravity_scale }) = self.rests {
            out.word(ticks);
            out.number(gravity_scale);
        }
    }
}

impl Sling {
    fn save(&self, out: &mut StateWriter) {
        out.byte(self.shots);
        save_seat(self.shooter, out);
        out.byte(u8::from(self.is_pulled));
        out.word(self.flight);
    }
}

fn read_sling(shots_max: u8, bytes: &mut StateReader) -> Result<Sling, StateError> {
    let shots = bytes.byte("shots")?;
    bytes.check(shots <= shots_max, "shots")?;
    let shooter = read_seat("shooter", bytes)?;
    let is_pulled = read_truth("pull", bytes)?;
    let flight = bytes.word("flight")?;
    bytes.check(flight < u32::MAX, "flight")?;
    Ok(Sling { shots, shooter, is_pulled, flight })
}

fn read_note(
    id: BodyId,
    scene: &Scene,
    world: &World,
    bytes: &mut StateReader,
) -> Result<Note, StateError> {
    let position = read_place("start", scene, bytes)?;
    let velocity = bytes.plausible("start velocity")?;
    let touched_by = read_seat("touched by", bytes)?;
    let mut rests = None;
    let flags = bytes.byte("rests")?;
    bytes.check(flags < 4, "rests")?;
    if flags & 1 == 1 {
        bytes.check(world.motion(id) != Motion::Static, "rests")?;
        let (ticks, gravity_scale) = (bytes.word("rest")?, read_gravity_scale(bytes)?);
        rests = Some(Rest { ticks, gravity_scale });
    }
    let mut note = Note::new(id, world);
    note.start = Start { position, velocity };
    note.touched_by = touched_by;
    note.rests = rests;
    note.is_cracked = flags & 2 == 2;
    Ok(note)
}

fn save_player(player: &Player, out: &mut StateWriter) {
    out.byte(player.team.map_or(u8::MAX, |team| team));
    save_standing(&player.standing, out);
    out.word(player.stun);
    out.vector(player.home);
    out.byte(u8::from(player.checkpoint.is_some()));
    out.vector(player.checkpoint.unwrap_or_default());
    out.body(player.carried.map(|carried| carried.body));
    out.number(player.carried.map_or(0.0, |carried| carried.gravity_scale));
}

fn read_player(
    player: &mut Player,
    teams: usize,
    scene: &Scene,
    world: &World,
    bytes: &mut StateReader,
) -> Result<(), StateError> {
    let team = bytes.byte("team")?;
    let fits = if teams == 0 { team == u8::MAX } else { usize::from(team) < teams };
    bytes.check(fits, "team")?;
    player.team = (teams > 0).then_some(team);
    player.standing = read_standing(bytes)?;
    player.stun = bytes.word("stun")?;
    player.home = read_place("home", scene, bytes)?;
    let has_checkpoint = read_truth("checkpoint", bytes)?;
    let checkpoint = read_place("checkpoint", scene, bytes)?;
    player.checkpoint = has_checkpoint.then_some(checkpoint);
    let body = bytes.body("carried body")?;
    let loose = |id| world.contains(id) && world.motion(id) == Motion::Dynamic;
    bytes.check(body.is_none_or(loose), "carried body")?;
    let gravity_scale = read_gravity_scale(bytes)?;
    player.carried = body.map(|body| Held { body, gravity_scale });
    Ok(())
}

fn save_standing(standing: &Standing, out: &mut StateWriter) {
    out.word(standing.score as u32);
    out.word(standing.lives as u32);
    out.byte(u8::from(standing.plays) | u8::from(standing.out) << 1);
}

fn read_standing(bytes: &mut StateReader) -> Result<Standing, StateError> {
    let (score, lives) = (bytes.word("score")? as i32, bytes.word("lives")? as i32);
    let flags = bytes.byte("standing")?;
    bytes.check(flags < 4, "standing")?;
    Ok(Standing { score, lives, plays: flags & 1 == 1, out: flags & 2 == 2 })
}

fn save_side(side: Option<Side>, out: &mut StateWriter) {
    match side {
        None => out.byte(NO_SIDE),
        Some(Side::Team(team)) => {
            out.byte(TEAM);
            out.byte(team);
        }
        Some(Side::Player(seat)) => {
            out.byte(PLAYER);
            save_seat(Some(seat), out);
        }
    }
}

fn read_side(teams: usize, bytes: &mut StateReader) -> Result<Option<Side>, StateError> {
    match bytes.byte("side")? {
        NO_SIDE => Ok(None),
        TEAM => {
            let team = bytes.byte("team")?;
            bytes.check(usize::from(team) < teams, "team")?;
            Ok(Some(Side::Team(team)))
        }
        PLAYER => Ok(read_seat("seat", bytes)?.map(Side::Player)),
        _ => Err(bytes.wrong("side")),
    }
}

/// Reads a place where bodies may be.
fn read_place(
    field: &'static str,
    scene: &Scene,
    bytes: &mut StateReader,
) -> Result<Vec2, StateError> {
    let place = bytes.plausible(field)?;
    bytes.check(scene.world.kill_zone.contains(place), field)?;
    Ok(place)
}

/// Reads a gravity scale that a scene file may give.
fn read_gravity_scale(bytes: &mut StateReader) -> Result<f32, StateError> {
    let scale = bytes.plausible_number("gravity scale")?;
    bytes.check(scale.abs() <= GRAVITY_SCALE_MAX, "gravity scale")?;
    Ok(scale)
}

fn read_truth(field: &'static str, bytes: &mut StateReader) -> Result<bool, StateError> {
    let byte = bytes.byte(field)?;
    bytes.check(byte <= 1, field)?;
    Ok(byte == 1)
}
