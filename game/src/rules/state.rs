//! The rules' part of a game's state. The hash covers the saved bytes, subject by subject.

use super::body_notes::{BodyNote, BodyNotes, BodyRest};
use super::breakage::Breakage;
use super::clock::{Round, RoundPhase};
use super::core::Rules;
use super::signals::{OrderState, RelayState, SignalState, Signals, Walker};
use super::sling::Sling;
use super::verdict::{Claims, Teams};
use super::zones::{ZoneState, Zones};
use crate::input::Seat;
use crate::player::Player;
use crate::roster::Roster;
use crate::scene::{GRAVITY_SCALE_MAX, Levels, SEATS_MAX, Scene, SignalKind, SignalSpec};
use crate::side::{Side, SideState};
use crate::state::{held_state, seat_state};
use glam::Vec2;
use jostle_sim::state::Subject;
use jostle_sim::state::io::{Field, NOBODY, StateIo, plausible};
use jostle_sim::{Motion, World};

const BODY_BYTES: usize = 8;

impl Rules {
    /// Describes the rules and the players' state in the round. Reading starts from rules that have not begun.
    pub fn state<Io: StateIo>(
        &self,
        scene: &Scene,
        world: &World,
        roster: &Roster,
        io: &mut Io,
    ) -> (Rules, Vec<Player>) {
        let mut rules = self.round_state(scene, io);
        let count = self.teams.standings.len();
        rules.zones.states = io.each(&self.zones.states, |io, index, zone| {
            io.subject(Subject::Numbered("zone", index));
            zone_state(zone, scene, count, io)
        });
        let signals = self.signals.states.iter().zip(&scene.rules.signals);
        rules.signals.states = io.each(signals, |io, index, (signal, spec)| {
            io.subject(Subject::Numbered("signal", index));
            signal_state(signal, spec, count, io)
        });
        let notes = io.each(roster.actors(), |io, _, actor| {
            io.subject(Subject::Numbered("note of body", actor.id.index));
            note_state(self.notes.of_existing(actor.id, world), scene, world, io)
        });
        for note in notes {
            *rules.notes.of(note.id, world) = note;
        }
        if Io::READS {
            rules.notes.note_placed(world, roster);
        }
        let players = io.each(&roster.players, |io, _, player| {
            io.subject(Subject::Numbered("player in the round", u32::from(player.seat.0)));
            player_state(player.clone(), count, scene, world, io)
        });
        (rules, players)
    }

    fn round_state(&self, scene: &Scene, io: &mut impl StateIo) -> Rules {
        io.subject(Subject::One("round"));
        let phase = io.byte("phase of the round", self.round.phase as u8);
        let phase = io.checked("phase of the round", self.round.phase, || {
            RoundPhase::ALL.get(usize::from(phase)).copied()
        });
        let ticks = io.word("ticks of the round", self.round.ticks);
        let clock = io.word("clock", self.round.clock);
        // The clock of a countdown is at 1, and no path has stopped before it.
        let clock_min = u32::from(phase == RoundPhase::Countdown);
        io.check("clock", || clock >= clock_min);
        let [contested] = io.flags("contested", [self.teams.contested]);
        let mut levels = Levels {
            zones: io.long("zones", self.levels.zones),
            signals: io.long("signals", self.levels.signals),
            teams: io.byte("teams", self.levels.teams),
            sling: 0,
        };
        let teams = &self.teams.standings;
        let standings = io.each(teams, |io, _, team| standing_state(*team, io));
        let (count, blank) = (teams.len(), Side::Team(0));
        let winners = short_list("number of winners", &self.winners, blank, io, |io, _, it| {
            let side = side_state(Some(it), count, io);
            io.checked("winner", it, || side)
        });
        let goes_on = scene.rules.round.as_ref().is_some_and(|round| round.finish.is_some());
        let won_at = if goes_on { io.word("ticks to the win", self.won_at) } else { 0 };
        io.check("ticks to the win", || won_at <= ticks);
        let presence =
            io.each(self.notes.came.iter().zip(&self.notes.stood), |io, _, (&came, &stood)| {
                let [came] = io.flags("presence", [came]);
                let stood = io.word("ticks stood", stood);
                io.check("ticks stood", || stood <= clock - clock_min);
                (came, stood)
            });
        let (came, stood) = presence.into_iter().unzip();
        let layouts = io.generator("chance of layouts", &self.layouts);
        let sling = self.sling.map(|sling| {
            levels.sling = io.byte("sling", self.levels.sling);
            sling_state(sling, io)
        });
        Rules {
            round: Round { phase, ticks, clock },
            levels,
            zones: Zones::default(),
            signals: Signals::default(),
            teams: Teams { standings, contested },
            notes: BodyNotes::new(came, stood),
            sling,
            breakage: Breakage { is_on: self.breakage.is_on, ..Breakage::default() },
            winners,
            won_at,
            layouts,
            claims: Claims::default(),
        }
    }
}

/// Describes a zone. Bodies listed in it may be gone by now.
fn zone_state(it: &ZoneState, scene: &Scene, teams: usize, io: &mut impl StateIo) -> ZoneState {
    let (limits, given) = ([scene.world.bodies_max, BODY_BYTES], it.inside.iter().copied());
    let inside =
        io.list("bodies in a zone", limits, given, NOBODY, |io, _, id| io.id("body in a zone", id));
    let holder = side_state(it.holder, teams, io);
    let taking = side_state(it.taking.map(|(side, _)| side), teams, io);
    let ticks = io.word("ticks alone", it.taking.map_or(0, |(_, ticks)| ticks));
    ZoneState { inside, holder, taking: taking.map(|side| (side, ticks)) }
}

fn signal_state(
    it: &SignalState,
    spec: &SignalSpec,
    teams: usize,
    io: &mut impl StateIo,
) -> SignalState {
    match (it, &spec.kind) {
        (SignalState::Relay(it), SignalKind::Relay(_)) => {
            let (held, left) = (io.word("ticks held", it.held), io.word("ticks left", it.left));
            let [base, toggled] = io.flags("signal", [it.base, it.toggled]);
            SignalState::Relay(RelayState { held, left, base, toggled })
        }
        (SignalState::Order(it), SignalKind::Order(order)) => {
            let mut last = None;
            let blank = (Walker::All, 0);
            let done = short_list("progress", &it.done, blank, io, |io, _, (walker, steps)| {
                let side = side_state(walker.side(), teams, io);
                let walker = io.checked("progress", walker, || Walker::of(order.each, side));
                let steps = io.byte("steps done", steps);
                let fits = || (1..=order.steps.len()).contains(&usize::from(steps));
                io.check("steps done", || fits() && last < Some(walker));
                last = Some(walker);
                (walker, steps)
            });
            SignalState::Order(OrderState { done })
        }
        _ => SignalState::new(spec),
    }
}

fn sling_state(it: Sling, io: &mut impl StateIo) -> Sling {
    let shots = io.byte("shots", it.shots);
    io.check("shots", || shots <= it.shots);
    let shooter = seat_state("shooter", it.shooter, io);
    let [is_pulled] = io.flags("pull", [it.is_pulled]);
    let flight = io.word("flight", it.flight);
    io.check("flight", || flight < u32::MAX);
    Sling { shots, shooter, is_pulled, flight }
}

#[inline]
fn note_state(mut it: BodyNote, scene: &Scene, world: &World, io: &mut impl StateIo) -> BodyNote {
    it.start.position = place_state(["start.x", "start.y"], it.start.position, scene, io);
    let fields = ["start velocity.x", "start velocity.y"];
    it.start.velocity = io.vector(fields, it.start.velocity, plausible);
    it.touched_by = seat_state("touched by", it.touched_by, io);
    let [rests, is_cracked] = io.flags("rests", [it.rests.is_some(), it.is_cracked]);
    io.check("rests", || !rests || world.motion(it.id) != Motion::Static);
    it.is_cracked = is_cracked;
    it.rests = rests.then(|| {
        let BodyRest { ticks, gravity_scale } =
            it.rests.unwrap_or(BodyRest { ticks: 0, gravity_scale: 0.0 });
        let ticks = io.word("rest", ticks);
        BodyRest {
            ticks,
            gravity_scale: io.number("gravity scale", gravity_scale, is_gravity_scale),
        }
    });
    it
}

fn player_state(
    mut it: Player,
    teams: usize,
    scene: &Scene,
    world: &World,
    io: &mut impl StateIo,
) -> Player {
    let team = io.byte("team", it.team.unwrap_or(u8::MAX));
    let fits = if teams == 0 { team == u8::MAX } else { usize::from(team) < teams };
    it.team = io.checked("team", it.team, || fits.then_some((teams > 0).then_some(team)));
    it.standing = standing_state(it.standing, io);
    it.controls.stun = io.word("stun", it.controls.stun);
    it.home = place_state(["home.x", "home.y"], it.home, scene, io);
    let [has_checkpoint] = io.flags("checkpoint", [it.checkpoint.is_some()]);
    let (fields, checkpoint) =
        (["checkpoint.x", "checkpoint.y"], it.checkpoint.unwrap_or_default());
    let checkpoint = place_state(fields, checkpoint, scene, io);
    it.checkpoint = has_checkpoint.then_some(checkpoint);
    it.carried =
        held_state(["carried body", "gravity scale"], it.carried, is_gravity_scale, world, io);
    it
}

fn standing_state(it: SideState, io: &mut impl StateIo) -> SideState {
    let score = io.word("score", it.score as u32) as i32;
    let lives = io.word("lives", it.lives as u32) as i32;
    let [plays, out] = io.flags("standing", [it.plays, it.out]);
    SideState { score, lives, plays, out }
}

fn side_state(side: Option<Side>, teams: usize, io: &mut impl StateIo) -> Option<Side> {
    let tag = match side {
        None => 0,
        Some(Side::Team(_)) => 1,
        Some(Side::Player(_)) => 2,
    };
    let tag = io.byte("side", tag);
    match io.checked("side", side, || {
        [None, Some(Side::Team(0)), Some(Side::Player(Seat(0)))].get(usize::from(tag)).copied()
    })? {
        Side::Team(team) => {
            let team = io.byte("team", team);
            io.check("team", || usize::from(team) < teams);
            Some(Side::Team(team))
        }
        Side::Player(seat) => seat_state("seat", Some(seat), io).map(Side::Player),
    }
}

/// Describes a position in the region where bodies may be.
#[inline]
fn place_state(fields: [Field; 2], given: Vec2, scene: &Scene, io: &mut impl StateIo) -> Vec2 {
    let place = io.vector(fields, given, plausible);
    io.check(fields[0], || scene.world.kill_zone.contains(place));
    place
}

/// Whether a gravity scale is allowed in a scene file.
fn is_gravity_scale(scale: f32) -> bool {
    scale.abs() <= GRAVITY_SCALE_MAX
}

/// Describes a list with at most one entry per seat.
fn short_list<Io: StateIo, T: Clone>(
    field: Field,
    given: &[T],
    blank: T,
    io: &mut Io,
    entry: impl FnMut(&mut Io, u32, T) -> T,
) -> Vec<T> {
    let count = usize::from(io.short(field, given.len() as u16));
    let count = io.checked(field, 0, || Some(count).filter(|&count| count <= SEATS_MAX));
    io.entries(count, given.iter().cloned(), blank, entry)
}
