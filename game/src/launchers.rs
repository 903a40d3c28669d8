//! A scene's launchers, which make marbles, and ownerless packs that chase every player's hero.

use crate::packs::{self, PackTargets};
use crate::placing::is_clear;
use crate::roster::{Actor, Roster, Rule};
use crate::scene::{Condition, Kind, Launcher, Location, Scene};
use glam::Vec2;
use jostle_sim::{BodyDef, World};

/// Runs the launchers that are due in this tick. A launcher whose position is blocked skips its turn.
pub(crate) fn work(
    world: &mut World,
    roster: &mut Roster,
    scene: &Scene,
    prey: &PackTargets,
    tick: u32,
    allows: impl Fn(&Condition) -> bool,
) {
    for launcher in &scene.launchers {
        if !launcher.is_due(tick) || !allows(&launcher.condition) {
            continue;
        }
        let is_own = |actor: &&Actor| actor.kind == launcher.makes && actor.owner.is_none();
        let has_room = roster.has_room(world, scene);
        if roster.actors().filter(is_own).count() >= launcher.limit as usize || !has_room {
            continue;
        }
        let position = match launcher.location {
            Location::Point(point) => point,
            Location::Body(body) => match roster.placed[body] {
                Some(id) => world.position(id),
                None => continue,
            },
        };
        launch(world, roster, scene, prey, launcher, position);
    }
}

fn launch(
    world: &mut World,
    roster: &mut Roster,
    scene: &Scene,
    prey: &PackTargets,
    launcher: &Launcher,
    position: Vec2,
) {
    match launcher.makes {
        Kind::Pack => {
            let towards = launcher.velocity.or_else(|| {
                let target = prey.nearest_to(position, None, world, roster)?;
                Some(target - position)
            });
            packs::add(world, roster, scene, None, position, towards.unwrap_or_default());
        }
        _ => {
            let Some(marble) = &scene.marble else { return };
            let velocity = launcher.velocity.unwrap_or_default();
            let def = BodyDef { position, velocity, ..marble.body };
            if is_clear(world, scene, &def, position, world.ids()) {
                roster.add(world, &def, Kind::Marble, None, Rule::Still);
            }
        }
    }
}
