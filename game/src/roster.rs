//! The roster lists the players and the roles of the World's bodies.

use crate::input::Seat;
use crate::player::Player;
use crate::scene::{Kind, Scene, Tools};
use crate::side::Side;
use glam::Vec2;
use jostle_sim::{BodyDef, BodyId, World};

/// A body's role in the game.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Actor {
    pub id: BodyId,
    pub kind: Kind,
    pub owner: Option<Seat>,
    pub rule: Rule,
}

/// How a body moves by itself.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Rule {
    Still,
    Wander {
        heading: Vec2,
        /// Units/s, positive.
        speed: f32,
        /// Whether a dye pack has pushed the body off its path, so that it has to return.
        is_pushed: bool,
    },
    Chase {
        /// Direction of the pack's own motion, a unit vector.
        front: Vec2,
        /// Velocity added to the pack's own motion by contacts, units/s.
        drift: Vec2,
        /// Velocity set for this step, units/s.
        driven: Vec2,
        life: u32,
    },
}

/// The players, and the roles of the bodies.
#[derive(Clone, Debug, Default)]
pub(crate) struct Roster {
    /// Roles by body index.
    pub actors: Vec<Option<Actor>>,
    /// Players in seat order.
    pub players: Vec<Player>,
    /// Ids of the bodies in [`Scene::bodies`], in that order; `None` once a body is gone.
    pub placed: Vec<Option<BodyId>>,
    /// Number of positions tried for heroes in the latest tick; not part of the state.
    pub positions_tried: u32,
}

impl Roster {
    /// Returns whether this seat has a player whose connection is closed or silent.
    pub fn is_away(&self, seat: Option<Seat>) -> bool {
        self.players.iter().any(|player| Some(player.seat) == seat && player.controls.is_away)
    }

    /// Adds a body with its role; `None` if the world is full.
    pub fn add(
        &mut self,
        world: &mut World,
        def: &BodyDef,
        kind: Kind,
        owner: Option<Seat>,
        rule: Rule,
    ) -> Option<BodyId> {
        let id = world.add(def)?;
        let index = id.index as usize;
        if index >= self.actors.len() {
            self.actors.resize(index + 1, None);
        }
        self.actors[index] = Some(Actor { id, kind, owner, rule });
        Some(id)
    }

    /// Removes a body from the world and the roster.
    pub fn remove(&mut self, world: &mut World, id: BodyId) {
        self.remove_all(world, &[id]);
    }

    /// Removes all bodies for which `matches` returns true.
    pub fn remove_matching(&mut self, world: &mut World, matches: &dyn Fn(&Actor) -> bool) {
        let mut ids: Vec<BodyId> = Vec::new();
        for actor in self.actors.iter().flatten() {
            if matches(actor) {
                ids.push(actor.id);
            }
        }
        self.remove_all(world, &ids);
    }

    /// Removes bodies from the world and the roster.
    pub fn remove_all(&mut self, world: &mut World, ids: &[BodyId]) {
        world.remove_all(ids);
        for &id in ids {
            self.forget(id);
        }
    }

    /// Forgets a body that the world has already removed.
    pub fn forget(&mut self, id: BodyId) -> Option<Actor> {
        for player in &mut self.players {
            player.forget(id);
        }
        if let Some(placed) = self.placed.iter_mut().find(|placed| **placed == Some(id)) {
            *placed = None;
        }
        self.actors[id.index as usize].take_if(|actor| actor.id == id)
    }

    /// The role of a body; `None` if the body is gone.
    pub fn actor(&self, id: BodyId) -> Option<&Actor> {
        self.actors.get(id.index as usize)?.as_ref().filter(|actor| actor.id == id)
    }

    /// The player who owns a body; `None` if the body is gone.
    pub fn owner_of(&self, id: BodyId) -> Option<Seat> {
        self.actor(id)?.owner
    }

    /// The side of a seated player.
    pub fn side_of(&self, seat: Seat) -> Side {
        let player = self.players.iter().find(|player| player.seat == seat);
        player.and_then(|player| player.team).map_or(Side::Player(seat), Side::Team)
    }

    /// The team with the fewest players among those with a free place; in a tie, the first one.
    pub fn team_for(&self, scene: &Scene) -> Option<u8> {
        let teams = (0..).zip(&scene.rules.teams).map(|(index, team): (u8, _)| {
            let players = self.players.iter().filter(|player| player.team == Some(index)).count();
            (players >= usize::from(team.players_max), players, index)
        });
        teams.min().map(|(_, _, index)| index)
    }

    /// The next open team with a free place after this player's team, in file order.
    pub fn team_after(
        &self,
        scene: &Scene,
        slot: usize,
        is_open: impl Fn(u8) -> bool,
    ) -> Option<u8> {
        let own = self.players[slot].team?;
        let teams = &scene.rules.teams;
        let count = teams.len() as u8;
        let has_place = |team: u8| {
            let players = self.players.iter().filter(|player| player.team == Some(team)).count();
            players < usize::from(teams[usize::from(team)].players_max)
        };
        let others = (1..count).map(|step| (own + step) % count);
        others.into_iter().find(|&team| is_open(team) && has_place(team))
    }

    /// Number of players of the same team in lower seats.
    pub fn place_in_team(&self, slot: usize) -> usize {
        let team = self.players[slot].team;
        self.players[..slot].iter().filter(|player| player.team == team).count()
    }

    /// All bodies with a role, in index order.
    pub fn actors(&self) -> impl Iterator<Item = &Actor> {
        self.actors.iter().flatten()
    }

    /// The first body of a kind in the scene file, which H, M or P selects.
    pub fn first_of(&self, scene: &Scene, kind: Kind) -> Option<BodyId> {
        if !scene.tools.contains(Tools::SELECT) {
            return None;
        }
        let index = scene.bodies.iter().position(|body| body.kind == kind)?;
        self.placed[index]
    }

    /// Returns whether tools may make another body. Room is reserved for heroes that have yet to appear.
    pub fn has_room(&self, world: &World, scene: &Scene) -> bool {
        let heroes = self.players.iter().filter(|player| player.hero.is_some()).count();
        let reserved = match scene.hero {
            Some(_) => usize::from(scene.players_max).saturating_sub(heroes),
            None => 0,
        };
        world.body_count() + reserved < scene.world.bodies_max
    }
}
