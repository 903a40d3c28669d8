//! The round over the canvas: score board, clock, task, countdown and result.

use crate::language::{fill, say};
use crate::page::app::App;
use crate::page::dom;
use crate::page::dom::list::{Item, List};
use crate::page::game::GameScreen;
use crate::page::panels::players::color_var;
use crate::page::round::{LIVES_SHOWN_MAX, Looked, ResultView, RoundView, SideView};
use crate::world::replica::Replica;
use jostle_game::Side;

/// The round as it was shown last.
pub struct RoundBoard {
    sides: List,
    result: List,
    shown: Option<RoundView>,
}

impl RoundBoard {
    pub fn new() -> RoundBoard {
        RoundBoard { sides: List::new("sides"), result: List::new("result-sides"), shown: None }
    }

    /// Shows the round of the displayed moment; hides everything where there is none.
    pub fn show(&mut self, replica: Option<&Replica>) {
        let view = replica.and_then(view_of);
        if self.shown == view {
            return;
        }
        dom::show("round", view.is_some());
        let round = view.clone().unwrap_or_default();
        dom::text("round-clock", &round.clock);
        dom::set(&dom::html("round-clock"), "data-late", round.is_late.then_some("yes"));
        dom::text("round-task", &round.task);
        dom::text_or_hide("round-progress", round.progress.map(steps).as_deref());
        dom::show("switch-team", round.switches);
        dom::set(&dom::html("round"), "data-task", round.is_task_new.then_some("new"));
        dom::text("round-said", &round.spoken);
        dom::text_or_hide("round-large", Some(&*round.large).filter(|large| !large.is_empty()));
        let goal =
            |side: &SideView| side.goal.map_or_else(String::new, |goal| format!(" / {goal}"));
        let sides = round.sides.iter();
        self.sides.show(sides.map(|side| entry("side-item", side).text(".goal", goal(side))));
        self.show_result(round.result.as_ref());
        self.shown = view;
    }

    fn show_result(&mut self, result: Option<&ResultView>) {
        dom::show("result", result.is_some());
        let Some(result) = result else { return self.result.show([]) };
        dom::text("result-title", &result.title);
        let stars =
            result.stars.map(|stars| "\u{2605}".repeat(stars) + &"\u{2606}".repeat(3 - stars));
        dom::text_or_hide("result-stars", stars.as_deref());
        let sentence = match result.goes_on {
            true => say("Waiting for the others: {count} s"),
            false => say("Next round: {count} s"),
        };
        dom::text("result-next", &fill(sentence, &[("count", &result.next_s.to_string())]));
        dom::set(&dom::html("again"), "disabled", result.goes_on.then_some(""));
        self.result.show(result.sides.iter().map(|side| entry("result-item", side)));
    }
}

/// Shows what the highlights are at, in place of the result.
pub fn show_highlights(app: &App) {
    let game = app.game();
    dom::show("highlights", game.is_some_and(GameScreen::has_highlights));
    let showing = game.and_then(|game| game.showing.as_ref());
    dom::mark("highlights", showing.is_some());
    let text = showing.map(|showing| {
        let [number, count] = [showing.player.number, showing.player.count].map(|n| n.to_string());
        fill("Highlight {number} of {count}", &[("number", &number), ("count", &count)])
    });
    dom::show("highlight-bar", text.is_some());
    dom::text("highlight", &text.unwrap_or_default());
}

fn view_of(replica: &Replica) -> Option<RoundView> {
    let looked = Looked {
        scene: &replica.scene,
        round: replica.round()?,
        players: replica.players(),
        own: replica.seat,
        tick: replica.display,
    };
    looked.view()
}

fn entry(template: &'static str, side: &SideView) -> Item {
    let (key, emblem) = match side.side {
        Side::Team(team) => (u32::from(team), Some(team.to_string())),
        Side::Player(seat) => (1000 + u32::from(seat.0), None),
    };
    let class = match (side.is_own, side.is_in) {
        (true, true) => "own",
        (true, false) => "own out",
        (false, true) => "",
        (false, false) => "out",
    };
    let score = side.score.map_or_else(String::new, |score| score.to_string());
    Item::new(template, key)
        .with("", "class", class.to_owned())
        .with("", "--color", color_var(side.color))
        .with("i", "data-emblem", emblem)
        .text("bdi", &*side.name)
        .text(".steps", side.progress.map_or_else(String::new, steps))
        .text(".score", score)
        .text(".lives", side.lives.map_or_else(String::new, lives))
}

/// A full dot for each step that was taken, and an empty one for each that is left.
fn steps((done, all): (usize, usize)) -> String {
    "\u{25cf}".repeat(done.min(all)) + &"\u{25cb}".repeat(all.saturating_sub(done))
}

/// A heart for each life, as long as they can be seen at a glance.
fn lives(lives: i32) -> String {
    match lives {
        ..=0 => String::new(),
        1..=LIVES_SHOWN_MAX => "\u{2665}".repeat(lives as usize),
        many => format!("\u{2665} {many}"),
    }
}
