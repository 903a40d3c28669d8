//! All views of the page. Everything that they show follows from the app alone.

use crate::browser;
use crate::net::api::query_value;
use crate::net::simulated_link::NetworkConditions;
use crate::page::app::App;
use crate::page::dom;
use crate::page::dom::dialogs::{self, DialogsView};
use crate::page::dom::hud::Hud;
use crate::page::dom::lobby::LobbyView;
use crate::page::dom::network_panel::{self, NetworkPanel};
use crate::page::dom::replay_controls::ReplayControls;
use crate::page::dom::stage::{self, Stage};
use crate::page::dom::tags::Tags;
use crate::page::dom::touchpad::Touchpad;
use crate::page::event::Canvas;
use crate::page::queue::Events;
use crate::page::strings;
use crate::page::{app::Activity, app::Panels};
use crate::view::frame::View;
use crate::view::render::Made;
use web_sys::HtmlElement;

/// Time between two updates of the texts, milliseconds.
const TEXT_MS: f64 = 200.0;

/// The page as it was shown last.
pub struct Views {
    stage: Stage,
    dialogs: DialogsView,
    lobby: LobbyView,
    hud: Hud,
    network: NetworkPanel,
    replay: ReplayControls,
    tags: Tags,
    touchpad: Touchpad,
    root: Root,
    text_ms: f64,
    /// The canvas is to get the focus as soon as it is visible.
    focus_stage: bool,
}

/// The root element and single elements as they were shown last.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Root {
    state: &'static str,
    screen: u32,
    own_color: u8,
    world_shown: bool,
    copied: Option<bool>,
    panels: Panels,
    conditions: NetworkConditions,
}

impl Root {
    fn of(app: &App) -> Root {
        Root {
            state: app.state(),
            screen: app.screen,
            own_color: app.own_color,
            world_shown: app.world_shown,
            copied: app.copied,
            panels: app.panels,
            conditions: app.conditions,
        }
    }
}

impl Views {
    /// Views of a page that shows nothing yet.
    pub fn new(events: Events, app: &App) -> Views {
        let query = browser::window().location().search().unwrap_or_default();
        network_panel::fill(app);
        wear(app.own_color);
        Views {
            stage: Stage::new(events, query_value(&query, "sharp") == Some("1")),
            dialogs: DialogsView::default(),
            lobby: LobbyView::default(),
            hud: Hud::default(),
            network: NetworkPanel::new(),
            replay: ReplayControls::default(),
            tags: Tags::default(),
            touchpad: Touchpad::new(events),
            root: Root { state: "loading", ..Root::of(app) },
            text_ms: 0.0,
            focus_stage: false,
        }
    }

    /// Shows everything that an event may have changed.
    pub fn show(&mut self, app: &App) {
        let root = Root::of(app);
        if self.root != root {
            self.show_root(app, root);
        }
        if let Activity::Lobby = app.activity {
            self.lobby.show(app);
        }
        self.touchpad.show(app);
        if std::mem::take(&mut self.focus_stage) {
            let _ = dom::by_id::<HtmlElement>("stage").focus();
        }
        self.dialogs.show(app);
    }

    /// Gives the keyboard focus to the canvas, which may become visible only when shown next.
    pub fn focus_stage(&mut self) {
        self.focus_stage = true;
    }

    fn show_root(&mut self, app: &App, root: Root) {
        let before = std::mem::replace(&mut self.root, root);
        if before.screen != root.screen {
            self.begin_screen(app);
        }
        if before.state != root.state {
            let _ = dom::root().dataset().set("state", root.state);
        }
        if before.own_color != root.own_color {
            wear(root.own_color);
        }
        if before.world_shown != root.world_shown {
            dom::mark("world", root.world_shown);
            if root.world_shown {
                dialogs::rescue_focus();
            }
        }
        if before.copied != root.copied {
            show_copied(root.copied);
        }
        dom::show(&dom::by_id("figures"), root.panels.figures);
        self.network.show(root.panels.network);
        // The texts follow with the next frame.
        self.text_ms = 0.0;
    }

    fn begin_screen(&mut self, app: &App) {
        self.hud.clear();
        self.network.clear();
        self.tags.clear();
        self.stage.reset();
        if let Some(replay) = app.replay() {
            self.replay.adopt(replay);
        }
        if let Some(frozen) = app.frozen_demo {
            dom::set(&dom::root(), "data-hud", if frozen.hud { "yes" } else { "no" });
        }
    }

    /// The canvas of the next frame; `None` while nothing can be drawn.
    pub fn canvas(&mut self, app: &App) -> Option<Canvas> {
        let bottom_css = match app.replay() {
            Some(_) => {
                let covered = dom::by_id::<HtmlElement>("deck").get_bounding_client_rect();
                let stage_css = f64::from(dom::by_id::<HtmlElement>("stage").client_height());
                (stage_css - covered.top()).max(0.0) as f32
            }
            None => self.hud.bottom_css(),
        };
        self.stage.canvas(app, bottom_css)
    }

    /// Draws the picture if it has changed: `None` if not, `false` if there was nothing to draw on.
    pub fn draw(&mut self, app: &App) -> Option<bool> {
        let drawn = self.stage.draw(app)?;
        if let (Some(replica), Some(view)) = (app.replica(), view(app)) {
            self.tags.update(replica, view, stage::css_per_pixel(view.pixels));
        }
        Some(drawn)
    }

    /// Shows everything that may change with every frame.
    pub fn show_frame(&mut self, app: &App) {
        let now_ms = app.now_ms();
        if let Some(game) = app.game() {
            self.hud.show_news(&app.news);
            self.hud.show_frame(app, game);
            if let Some(replica) = game.replica() {
                let _ =
                    dom::root().dataset().set("tick", &format!("{:.0}", replica.display().floor()));
            }
            if now_ms - self.text_ms >= TEXT_MS {
                self.text_ms = now_ms;
                self.hud.show_texts(app, game);
                self.network.show_texts(game, now_ms);
            }
        } else if let Some(replay) = app.replay() {
            self.hud.show_news(&app.news);
            let _ = dom::root().dataset().set("tick", &replay.player.tick().to_string());
            self.replay.show(&replay.player, now_ms);
        }
    }

    /// Drops everything that was made with a lost drawing context.
    pub fn drop_graphics(&mut self) {
        self.stage.drop_graphics();
    }

    /// Everything that the graphics have made.
    pub fn made(&self) -> Option<Made> {
        self.stage.made()
    }
}

/// The view of the last frame.
pub fn view(app: &App) -> Option<&View> {
    match (app.game(), app.replay()) {
        (Some(game), _) => Some(game.view()),
        (_, Some(replay)) => Some(replay.view()),
        _ => None,
    }
}

/// The page takes the player's colour.
fn wear(color: u8) {
    dom::style(&dom::root(), "--own", &format!("var(--player-{color})"));
}

/// Says on the button whether the link was copied; `style.css` keeps it as wide as the longest of these
/// texts.
fn show_copied(copied: Option<bool>) {
    let button: HtmlElement = dom::by_id("copy");
    let (text, title) = strings::copied(copied);
    dom::set_text(&button, text);
    dom::set(&button, "title", title);
}
