//! All views of the page. Everything that they show follows from the app alone.

use crate::browser;
use crate::language::say;
use crate::net::api::query_value;
use crate::page::app::{Activity, App};
use crate::page::dom;
use crate::page::dom::dialogs::{self, DialogsView};
use crate::page::dom::editor::EditorView;
use crate::page::dom::emotes::EmotesView;
use crate::page::dom::help;
use crate::page::dom::hud::Hud;
use crate::page::dom::language::Translated;
use crate::page::dom::lobby::LobbyView;
use crate::page::dom::network_panel::{self, NetworkPanel};
use crate::page::dom::patch::Patch;
use crate::page::dom::replay_controls::ReplayControls;
use crate::page::dom::settings::SettingsSheet;
use crate::page::dom::stage::{self, Stage};
use crate::page::dom::tags::Tags;
use crate::page::dom::touchpad::Touchpad;
use crate::page::dom::zone_labels::ZoneLabels;
use crate::page::event::Canvas;
use crate::page::game::GameScreen;
use crate::page::panels::{players, round, sound};
use crate::page::queue::Events;
use crate::view::frame::View;

/// Time between two updates of the texts, milliseconds.
const TEXT_MS: f64 = 200.0;

/// The page as it was shown last.
pub struct Views {
    pub stage: Stage,
    patch: Patch,
    dialogs: DialogsView,
    lobby: LobbyView,
    hud: Hud,
    network: NetworkPanel,
    replay: ReplayControls,
    settings: SettingsSheet,
    emotes: EmotesView,
    translated: Translated,
    tags: Tags,
    zone_labels: ZoneLabels,
    touchpad: Touchpad,
    pub editor: EditorView,
    /// Number of the screen.
    screen: u32,
    text_ms: f64,
    /// The canvas is to get the focus as soon as it is visible.
    pub focus_stage: bool,
    /// The text that is edited is to get it, at this byte.
    pub focus_text: Option<usize>,
}

impl Views {
    /// Views of a page that shows nothing yet.
    pub fn new(events: Events, app: &App) -> Views {
        let query = browser::window().location().search().unwrap_or_default();
        network_panel::fill(app);
        Views {
            stage: Stage::new(events, query_value(&query, "sharp") == Some("1")),
            patch: Patch::default(),
            dialogs: DialogsView::default(),
            lobby: LobbyView::new(),
            hud: Hud::new(),
            network: NetworkPanel::new(),
            replay: ReplayControls::new(),
            settings: SettingsSheet::new(),
            emotes: EmotesView::new(),
            translated: Translated::collect(),
            tags: Tags::default(),
            zone_labels: ZoneLabels::default(),
            touchpad: Touchpad::new(),
            editor: EditorView::default(),
            screen: app.screen,
            text_ms: 0.0,
            focus_stage: false,
            focus_text: None,
        }
    }

    /// Shows everything that an event may have changed.
    pub fn show(&mut self, app: &App) {
        let is_told = self.translated.show(&app.settings.spoken);
        if is_told {
            self.patch.forget();
            self.lobby.clear();
            self.editor.retell();
            self.dialogs.retell();
        }
        if self.screen != app.screen || is_told {
            self.screen = app.screen;
            self.begin_screen(app);
        }
        let root = dom::root();
        dom::set(&root, "data-state", Some(app.state()));
        // The page takes the player's colour.
        let own = format!("var(--player-{})", app.own_color);
        dom::style(&root, "--own", &own);
        dom::mark("calm", app.settings.calm);
        dom::mark("clean", app.panels.clean);
        dom::mark("watching", app.game().is_some_and(GameScreen::watches));
        if dom::mark("world", app.world_shown) && app.world_shown {
            dialogs::rescue_focus();
        }
        show_copied(app.copied);
        let figures_shown = !dom::html("figures").hidden();
        if figures_shown != app.panels.figures {
            dom::show("figures", app.panels.figures);
            // Its texts follow with the next frame.
            self.text_ms = 0.0;
        }
        if self.network.show(app.panels.network) {
            self.text_ms = 0.0;
        }
        if let Activity::Lobby = app.activity {
            self.lobby.show(app);
        }
        self.touchpad.show(app);
        self.patch.show(sound::view(app));
        self.settings.show(app);
        self.emotes.show(app);
        self.editor.show(app);
        if std::mem::take(&mut self.focus_stage) {
            dom::focus_stage();
        }
        self.dialogs.show(app);
        if let Some(at) = self.focus_text.take() {
            self.editor.focus_text(at);
        }
    }

    fn begin_screen(&mut self, app: &App) {
        self.text_ms = 0.0;
        self.hud.clear();
        self.patch.show(players::view(app));
        self.patch.show(round::view(app));
        self.touchpad.clear();
        self.network.clear();
        self.tags.clear();
        self.emotes.clear();
        self.zone_labels.clear();
        self.stage.reset();
        if let Some(replay) = app.replay() {
            self.replay.adopt(replay);
            help::fill_for_replay(&mut self.hud.help, replay.player.scene());
        }
        if let Some(hud) = app.frozen_hud {
            dom::set(&dom::root(), "data-hud", Some(if hud { "yes" } else { "no" }));
        }
    }

    /// The canvas of the next frame; `None` while nothing can be drawn.
    pub fn canvas(&mut self, app: &App) -> Option<Canvas> {
        let covered_css = match app.replay() {
            Some(_) => {
                let covered = dom::html("deck").get_bounding_client_rect();
                let stage_css = f64::from(dom::html("stage").client_height());
                [0.0, (stage_css - covered.top()).max(0.0) as f32]
            }
            // What is edited and played is one picture.
            None if app.edited().is_some() => [0.0; 2],
            // The style hides the controls only after the first picture.
            None if app.frozen_hud == Some(false) => [0.0; 2],
            None => self.hud.covered_css,
        };
        self.stage.canvas(app, covered_css)
    }

    /// Draws the picture if it has changed: `None` if not, `false` if there was nothing to draw on.
    pub fn draw(&mut self, app: &App) -> Option<bool> {
        let drawn = self.stage.draw(app)?;
        if let (Some(replica), Some(view)) = (app.pictured_replica(), view(app)) {
            let css_per_pixel = stage::css_per_pixel(view.pixels);
            self.tags.update(replica, view, css_per_pixel);
            self.emotes.update(app, view, css_per_pixel);
            self.zone_labels.update(replica, view, css_per_pixel);
        }
        Some(drawn)
    }

    /// Shows everything that may change with every frame.
    pub fn show_frame(&mut self, app: &App) {
        let now_ms = app.now_ms();
        let tick = if let Some(game) = app.game() {
            self.hud.show_frame(app, game);
            if now_ms - self.text_ms >= TEXT_MS {
                self.text_ms = now_ms;
                self.hud.show_texts(app, game);
                self.patch.show(players::view(app));
                self.network.show_texts(game, now_ms);
            }
            game.replica().map(|replica| format!("{:.0}", replica.display.floor()))
        } else if let Some(replay) = app.replay() {
            self.replay.show(&replay.player, now_ms);
            Some(replay.player.tick().to_string())
        } else if let Some(screen) = app.edit_screen() {
            self.editor.show_frame(screen);
            Some("0".to_owned())
        } else {
            return;
        };
        self.hud.show_news(&app.news);
        self.patch.show(round::view(app));
        self.patch.show(round::highlights(app));
        self.patch.show(round::record(app));
        self.patch.show(sound::captions(app));
        if tick.is_some() {
            dom::set(&dom::root(), "data-tick", tick.as_deref());
        }
    }
}

/// The view of the last frame.
pub fn view(app: &App) -> Option<&View> {
    match (app.game(), app.replay()) {
        (Some(game), _) => Some(game.view()),
        (_, Some(replay)) => Some(&replay.view),
        _ => app.edit_screen().map(|screen| &screen.view),
    }
}

/// Says on the button whether the link was copied; `style.css` keeps it as wide as the longest of these
/// texts.
fn show_copied(copied: Option<bool>) {
    let (text, title) = match copied {
        None => (say("Copy link"), ""),
        Some(true) => (say("Copied"), ""),
        Some(false) => (say("Couldn't copy"), say("Copy the link from the address bar.")),
    };
    for id in ["copy", "edit-copy"] {
        dom::text(id, text);
        dom::set(&dom::html(id), "title", Some(title));
    }
}
