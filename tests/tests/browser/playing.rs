//! Players' actions: steering, throwing, dropping, grabbing, shaking, clearing, selecting and spraying.

use anyhow::{Context, Result, bail};
use jostle_tests::picture::Picture;
use jostle_tests::runner::Stage;
use jostle_tests::state::{Body, State};
use jostle_tests::tab::{Screen, Tab};
use std::sync::Arc;

/// Maximum number of attempts to observe a complete burst.
const BURSTS_MAX: u32 = 30;

pub async fn a_key_in_one_page_moves_the_hero_seen_in_another(stage: Arc<Stage>) -> Result<()> {
    let ada = stage.play("impulse", Screen::SMALL).await?;
    let bob = stage.play("impulse", Screen::SMALL).await?;
    let seat = ada.state().await?.seat.context("a player has a seat")?;
    let seen = bob.until("both players", |s| s.connected() == 2 && s.hero(seat).is_some()).await?;
    assert_ne!(seen.seat, Some(seat), "each player has a seat of their own");
    let before = x_of(&seen, seat);
    ada.key_down("d").await?;
    bob.until("Ada's hero to the right", |s| x_of(s, seat) > before + 8.0).await?;
    ada.key_up("d").await?;
    let turned = x_of(&bob.state().await?, seat);
    ada.key_down("a").await?;
    bob.until("Ada's hero on its way back", |s| x_of(s, seat) < turned - 2.0).await?;
    ada.key_up("a").await?;
    for tab in [&ada, &bob] {
        let drawn = tab.state().await?.drawn_frames;
        tab.until("both pages drawing", |s| s.drawn_frames > drawn + 10).await?;
    }
    Ok(())
}

fn x_of(state: &State, seat: u16) -> f32 {
    state.hero(seat).map_or(f32::NAN, |hero| hero.pos[0])
}

pub async fn two_tabs_of_one_visitor_are_two_players(stage: Arc<Stage>) -> Result<()> {
    let first = stage.play("impulse", Screen::SMALL).await?;
    let seat = first.state().await?.seat;
    let visitor = stage.last_visitor().context("somebody is here")?;
    let second = stage.visit_as(&visitor, "/impulse", Screen::SMALL).await?;
    second.until("a hero of one's own", State::plays).await?;
    let plays_on = |s: &State| s.plays() && s.connected() == 2;
    let state = first.until("the first tab in a game of two players", plays_on).await?;
    assert_eq!(state.seat, seat, "the first tab keeps its seat");
    assert_ne!(state.seat, second.state().await?.seat);
    Ok(())
}

pub async fn a_pack_reaches_the_hero_and_bursts(stage: Arc<Stage>) -> Result<()> {
    let tab = stage.play("emitters", Screen::SMALL.sharp()).await?;
    let [x, y] = resting_hero(&tab).await?;
    let at = tab.to_page([x, y]).await?;
    let saturated = |picture: &Picture| {
        picture
            .count_near(at[0], at[1], 60.0, |pixel| pixel.into_iter().any(|channel| channel >= 250))
    };
    let dark = saturated(&tab.picture().await?);

    // A slow page draws few frames of a burst and may miss its peak, so more bursts are tried.
    for _ in 0..BURSTS_MAX {
        tab.record().await?;
        let target = tab.aim([x + 30.0, y]).await?;
        let before = tab.state().await?;
        tab.mouse_down(target).await?;
        // The press itself must be enough, because the button is released before the next tick.
        tab.mouse_up(target).await?;
        let exploded = |s: &State| s.emitter_events > before.emitter_events;
        let started = tab.until("an explosion", exploded).await?;
        let mut brightest = 0;
        loop {
            brightest = brightest.max(saturated(&tab.picture().await?));
            let state = tab.state().await?;
            let out = state.of_kind("pack").is_empty() && state.particles == 0;
            // An event is displayed at most half a second after it is received.
            if out && state.ticks() > started.ticks() + 60 {
                break;
            }
        }
        let seen = tab.recorded().await?;
        assert!(seen.most_of("pack") <= 1, "one click, one pack: {seen:?}");
        assert!(seen.particles <= 200, "at most 200 particles at once: {seen:?}");
        if seen.most_of("pack") == 1
            && seen.emitters >= 1
            && seen.particles >= 150
            && brightest > dark + 50
        {
            return Ok(());
        }
    }
    bail!("no burst of about 200 particles, with 50 more saturated pixels than the {dark} before")
}

/// Waits until the player's hero rests on the floor and returns its position.
async fn resting_hero(tab: &Tab) -> Result<[f32; 2]> {
    loop {
        let before = tab.state().await?;
        let after = tab.ticks(10).await?;
        let (Some(old), Some(new)) = (before.own_hero(), after.own_hero()) else { continue };
        if distance(old, new.pos) < 0.01 {
            return Ok(new.pos);
        }
    }
}

fn distance(body: &Body, [x, y]: [f32; 2]) -> f32 {
    (body.pos[0] - x).hypot(body.pos[1] - y)
}

pub async fn impulse_tools(stage: Arc<Stage>) -> Result<()> {
    let tab = stage.play("impulse", Screen::SMALL).await?;
    tab.key_down("z").await?;
    let eight = |s: &State| s.of_kind("dumb").len() >= 8;
    tab.until_aimed([100.0, 20.0], false, "eight dumb minions", eight).await?;
    tab.key_up("z").await?;
    let count = tab.ticks(120).await?.of_kind("dumb").len();
    assert_eq!(tab.ticks(30).await?.of_kind("dumb").len(), count, "no more once Z is up");

    grab(&tab).await.context("X")?;

    let at_rest = settled(&tab).await?;
    tab.key_down("c").await?;
    tab.until("half of them shaken away", |s| 2 * moved(&at_rest, s, 3.0) >= count).await?;
    tab.key_up("c").await?;

    tab.hold_key("v", 3).await?;
    tab.until("no dumb minion", |s| s.of_kind("dumb").is_empty()).await?;
    Ok(())
}

/// Lifts a marble with X and the mouse, and drops it.
async fn grab(tab: &Tab) -> Result<()> {
    tab.ticks(120).await?;
    let state = tab.state().await?;
    let (body, goal) = way_out(&state).context("a dumb minion with a way out of the heap")?;
    tab.aim(body.pos).await?;
    tab.key_down("x").await?;
    tab.ticks(3).await?;
    let held = |s: &State| {
        let held = s.own_player()?.held?;
        s.bodies.iter().find(|body| body.id == held).cloned()
    };
    let at_pointer = |s: &State| held(s).is_some_and(|body| distance(&body, goal) < 2.0);
    let taken = tab.until_aimed(goal, false, "a dumb minion at the pointer", at_pointer).await?;
    assert_eq!(held(&taken).context("it is held")?.kind, "dumb");
    let later = taken.ticks() + 30;
    let stays = |s: &State| s.ticks() > later && at_pointer(s);
    tab.until_aimed(goal, false, "it still at the pointer while X is down", stays).await?;
    tab.key_up("x").await?;
    tab.until("it let go", |s| held(s).is_none()).await?;
    Ok(())
}

/// Finds a marble and a point that it can reach unobstructed. Platforms differ from room to room, and on a slow machine
/// the heap contains more bodies.
fn way_out(state: &State) -> Option<(Body, [f32; 2])> {
    let goals = (20..=180).step_by(4).flat_map(|x| (14..=98).step_by(4).map(move |y| [x, y]));
    let goals: Vec<[f32; 2]> = goals.map(|goal| goal.map(|part| part as f32)).collect();
    let mut dumb = state.of_kind("dumb");
    dumb.sort_by(|a, b| b.pos[1].total_cmp(&a.pos[1]));
    dumb.into_iter().find_map(|body| {
        let leads_out = |goal: &&[f32; 2]| {
            let apart = distance(body, **goal);
            (8.0..30.0).contains(&apart) && is_open(state, body, **goal)
        };
        goals.iter().find(leads_out).map(|goal| (body.clone(), *goal))
    })
}

/// Whether no other body is in a body's way to a point.
fn is_open(state: &State, moved: &Body, goal: [f32; 2]) -> bool {
    // Half the size of a platform and a marble, plus a margin.
    let apart = [22.5, 8.5];
    let others: Vec<&Body> =
        state.of_kind("dumb").into_iter().filter(|b| b.id != moved.id).collect();
    let platforms = state.of_kind("platform");
    (1..=20).all(|step| {
        let share = step as f32 / 20.0;
        let [x, y] = [0, 1].map(|axis| moved.pos[axis] + share * (goal[axis] - moved.pos[axis]));
        let beside = |b: &&Body| (b.pos[0] - x).abs() > apart[0] || (b.pos[1] - y).abs() > apart[1];
        // The body may move away from bodies that it touches, but must not come near others.
        let away = |b: &&Body| {
            let (was, is) = (distance(b, moved.pos), distance(b, [x, y]));
            is > 12.5 || is > was
        };
        platforms.iter().all(beside) && others.iter().all(away)
    })
}

/// Waits until all marbles are at rest.
async fn settled(tab: &Tab) -> Result<State> {
    let mut before = tab.state().await?;
    loop {
        let after = tab.ticks(20).await?;
        if moved(&before, &after, 0.05) == 0 {
            return Ok(after);
        }
        before = after;
    }
}

/// Number of marbles that moved further than `apart`.
fn moved(before: &State, after: &State, apart: f32) -> usize {
    let was = before.of_kind("dumb");
    let is_away =
        |body: &&&Body| was.iter().any(|old| old.id == body.id && distance(old, body.pos) > apart);
    after.of_kind("dumb").iter().filter(is_away).count()
}

pub async fn bounds_selection(stage: Arc<Stage>) -> Result<()> {
    let tab = stage.visit("/bounds", Screen::SMALL).await?;
    tab.until("the scene", |s| s.state == "playing" && s.bodies.len() >= 15).await?;
    let picks = [
        ("m", "minion", [150.0, 90.0]),
        ("p", "platform", [100.0, 60.0]),
        ("h", "hero", [110.0, 20.0]),
    ];
    for (key, kind, goal) in picks {
        let picked = |s: &State| {
            let selected = s.own_player()?.selected?;
            s.bodies.iter().find(|body| body.id == selected && body.kind == kind).cloned()
        };
        tab.hold_key(key, 3).await?;
        let before = tab.until(&format!("a {kind} picked"), |s| picked(s).is_some()).await?;
        let selected = picked(&before).context("it is picked")?;

        let there = |s: &State| picked(s).is_some_and(|body| distance(&body, goal) < 1.0);
        let start = tab.aim(selected.pos).await?;
        tab.mouse_down(start).await?;
        let wanted = format!("the {kind} at the pointer");
        let after = tab.until_aimed(goal, true, &wanted, there).await?;
        tab.mouse_up(tab.to_page(goal).await?).await?;
        for body in after.bodies.iter().filter(|body| body.id != selected.id) {
            let old = before.bodies.iter().find(|old| old.id == body.id).context("it was there")?;
            assert!(distance(old, body.pos) < 0.1, "only the selected body moves, not {body:?}");
        }
        tab.aim([30.0, 60.0]).await?;
        let later = tab.ticks(10).await?;
        assert!(there(&later), "it stays when the button is up; before {after:?}, now {later:?}");
    }
    // A press on a body selects it. Positions are random, and some are under the page's buttons.
    let state = tab.state().await?;
    let chosen = state.own_player().and_then(|player| player.selected);
    let mut other = None;
    for body in state.bodies.iter().filter(|body| Some(body.id) != chosen) {
        let apart = state.bodies.iter().filter(|near| distance(near, body.pos) < 25.0).count();
        if apart == 1 && tab.is_open(body.pos).await? {
            other = Some(body.clone());
            break;
        }
    }
    let other = other.context("a body by itself")?;
    let start = tab.aim(other.pos).await?;
    tab.mouse_down(start).await?;
    let is_selected = |s: &State| s.own_player().is_some_and(|p| p.selected == Some(other.id));
    let after = tab.until("the pressed body selected", is_selected).await?;
    for body in &after.bodies {
        let old = state.bodies.iter().find(|old| old.id == body.id).context("it was there")?;
        assert!(distance(old, body.pos) < 0.1, "a press moves nothing: {body:?}");
    }
    tab.mouse_up(start).await?;
    Ok(())
}

/// Checks that the buttons show which shape is selected on a touch screen.
pub async fn bounds_by_touch(stage: Arc<Stage>) -> Result<()> {
    let tab = stage.visit("/bounds", Screen::PHONE).await?;
    tab.until("the scene", |s| s.state == "playing" && s.bodies.len() >= 15).await?;
    let pressed = "[...document.querySelectorAll('#tools [aria-pressed=\"true\"]')]\
                   .map(button => button.textContent).join()";
    tab.until_true(&format!("{pressed} === 'hero'")).await?;
    for kind in ["minion", "platform", "hero"] {
        let button = format!(
            "(() => {{ for (const button of document.querySelectorAll('#tools button')) \
             button.toggleAttribute('data-wanted', button.textContent === '{kind}'); \
             return true; }})()"
        );
        tab.until_true(&button).await?;
        tab.touch(tab.middle_of("#tools [data-wanted]").await?, false).await?;
        tab.until_true(&format!("{pressed} === '{kind}'")).await?;
        tab.lift().await?;
    }
    Ok(())
}

pub async fn bounds_colors(stage: Arc<Stage>) -> Result<()> {
    let tab = stage.visit("/bounds", Screen::SMALL.sharp()).await?;
    tab.until("the scene", |s| s.state == "playing" && s.bodies.len() >= 15).await?;
    // The hero selected by H and the platform selected by P overlap at first.
    let [x, y] = tab.to_page([20.0, 30.0]).await?;
    let red = move |picture: &Picture| {
        picture.count_near(x, y, 45.0, |[r, g, b]| r > 180 && g < 90 && b < 90)
    };
    tab.hold_key("h", 3).await?;
    tab.until_seen("red bounds where the picked hero touches", |p| red(p) > 30).await?;
    tab.hold_key("p", 3).await?;
    tab.mouse_down(tab.aim([20.0, 30.0]).await?).await?;
    let away = tab.to_page([100.0, 60.0]).await?;
    tab.move_to(away, true).await?;
    tab.ticks(5).await?;
    tab.mouse_up(away).await?;
    tab.hold_key("h", 3).await?;
    tab.until_seen("no red bounds around the hero any more", |p| red(p) == 0).await?;
    Ok(())
}

pub async fn particles_spray(stage: Arc<Stage>) -> Result<()> {
    let tab = stage.play("particles", Screen::SMALL).await?;
    assert_eq!(tab.state().await?.particles, 0);
    tab.key_down("z").await?;
    let spray = |s: &State| s.particles >= 40;
    tab.until_aimed([100.0, 20.0], false, "a spray", spray).await?;
    tab.key_up("z").await?;
    tab.until("the spray gone", |s| s.particles == 0).await?;
    Ok(())
}
