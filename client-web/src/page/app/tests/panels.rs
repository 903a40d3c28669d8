//! Tests of the panels in every state of the page.

use super::*;
use crate::page::event::SettingsEvent;
use crate::page::panels;
use crate::page::view::{Set, View};
use crate::sound::task::SoundEvent;
use crate::view::frame;
use jostle_protocol::Refusal;
use jostle_protocol::replay::Record;
use std::collections::BTreeSet;

const PAGE: &str = include_str!("../../../../web/index.html");
const ROOMS: &str = r#"{"rooms":[
    {"code":"abc","scene":"arena","title":"Arena","players":2,"connected":1,"players_max":8},
    {"code":"xyz","scene":"hill","title":"Hill","players":4,"connected":4,"players_max":4}]}"#;

impl Browser {
    /// All panels in their current state.
    pub(super) fn panels(&self) -> Vec<View> {
        let app = &self.app;
        let all = panels::ALL.iter().chain(&panels::OF_FRAMES).chain(&panels::OF_NUMBERS);
        let mut views: Vec<View> = all.map(|panel| panel(app)).collect();
        let pixels = frame::View { pixels: [800, 600], ..frame_of(app) };
        views.push(panels::dialogs::view(app));
        views.push(panels::lobby::view(app, 1e9));
        views.push(panels::emotes::shown(app, &pixels, 1.0));
        views.push(panels::zones::view(app, &pixels, 1.0));
        views.extend(app.screen.edited().map(|screen| panels::editor::form(&screen.editor)));
        views
    }

    /// The panel with this name.
    pub(super) fn panel(&self, name: &str) -> View {
        let panel = self.panels().into_iter().find(|view| view.name == name);
        panel.unwrap_or_else(|| panic!("a panel {name}"))
    }

    pub(super) fn is_shown(&self, at: &str) -> bool {
        self.panels().iter().any(|view| view.attribute_of(at, "hidden") == Some(None))
    }

    pub(super) fn text_at(&self, at: &str) -> String {
        let panels = self.panels();
        let text = panels.iter().find_map(|view| view.text_of(at));
        text.unwrap_or_else(|| panic!("a text in {at}")).to_owned()
    }

    pub(super) fn entries(&self, at: &str) -> Vec<View> {
        let panels = self.panels();
        panels.iter().find_map(|view| view.items_of(at)).unwrap_or_else(|| panic!("{at}")).to_vec()
    }
}

fn frame_of(app: &App) -> frame::View {
    app.screen.game().map_or(frame::View::UNSEEN, |game| *game.view())
}

/// The document ids to which a panel refers.
fn ids(view: &View) -> BTreeSet<String> {
    let at = view.parts.iter().map(|(at, _)| *at).chain(view.focus);
    let ids = at.filter_map(|at| at.strip_prefix('#'));
    let end = |c: char| !(c.is_ascii_alphanumeric() || c == '-');
    ids.map(|id| id.split(end).next().unwrap_or_default().to_owned()).collect()
}

/// Collects the templates of all entries, including nested ones.
fn templates(view: &View, found: &mut BTreeSet<&'static str>) {
    for (_, set) in &view.parts {
        let Set::List(items) = set else { continue };
        for item in items {
            found.insert(item.name);
            templates(item, found);
        }
    }
}

fn crowded() -> Vec<Browser> {
    let mut lobby = Browser::open("/", "");
    lobby.say(Event::Answered(Request::Rooms, Some(ROOMS.into())));
    let mut game = Browser::open("/arena", "");
    game.accept_beside(3, "arena");
    game.wait(400);
    for code in ["F3", "F4"] {
        game.press(code, code);
    }
    let mut panels = Browser::playing();
    for action in ["settings", "wheel", "sound"] {
        panels.click(action);
    }
    let mut editor = Browser::open("/", "");
    editor.say(Event::Navigated(Address {
        path: "/".to_owned(),
        hash: "#edit=hill".to_owned(),
        ..Address::default()
    }));
    editor.wait(100);
    let mut help = Browser::playing();
    help.click("help");
    vec![lobby, game, panels, editor, help, replays::watching()]
}

#[test]
fn every_selector_and_template_of_a_panel_is_in_the_document() {
    let mut used = BTreeSet::new();
    for browser in crowded() {
        for view in browser.panels() {
            for id in ids(&view) {
                assert!(PAGE.contains(&format!("id=\"{id}\"")), "{}: {id}", view.name);
            }
            templates(&view, &mut used);
        }
    }
    for template in &used {
        assert!(PAGE.contains(&format!("<template id=\"{template}\">")), "{template}");
    }
    assert!(used.len() >= 12, "{used:?}");
}

#[test]
fn a_panel_is_equal_until_something_changes() {
    let mut browser = Browser::playing();
    browser.press("F4", "F4");
    assert_eq!(browser.panels(), browser.panels());
    let before = browser.panel("caps");
    browser.press("KeyD", "d");
    assert_ne!(browser.panel("caps"), before, "a key that is down is lit");
    browser.say(Event::KeyUp(key("KeyD", "d")));
    assert_eq!(browser.panel("caps"), before);
}

#[test]
fn a_frame_shows_no_way_to_the_lobby_but_one_to_its_own_tab() {
    let mut browser = Browser::open("/arena", "?lag=0,0");
    assert!(!browser.is_shown("#own-tab") && browser.is_shown("#notice-button"));
    browser.app.ctx.site.is_framed = true;
    assert!(browser.is_shown("#own-tab") && !browser.is_shown("#notice-button"));
    let page = browser.panel("page");
    assert_eq!(page.attribute_of("", "data-framed"), Some(Some("yes")));
    assert_eq!(page.attribute_of("#own-tab", "href"), Some(Some("/arena?lag=0,0")));
    browser.accept_beside(1, "arena");
    browser.socket(SocketEvent::Opened);
    let closed = SocketEvent::Closed { code: Refusal::NoSuchRoom.close_code() };
    browser.socket(closed);
    assert!(browser.is_shown("#notice-button") && !browser.is_shown("#notice-other"));
}

#[test]
fn the_lobby_lists_rooms_and_says_which_are_full() {
    let mut browser = Browser::open("/", "");
    assert!(!browser.is_shown("#no-rooms"), "nobody knows yet");
    browser.say(Event::Answered(Request::Rooms, Some(ROOMS.into())));
    let rooms = browser.entries("#room-list");
    let full = |room: &View| room.attribute_of("a", "aria-disabled").flatten().map(str::to_owned);
    assert_eq!(rooms.iter().map(full).collect::<Vec<_>>(), [None, Some("true".to_owned())]);
    assert_eq!(rooms[0].text_of(".seats span"), Some("2 of 8"));
    assert_eq!(rooms[1].attribute_of(".watch", "href"), Some(Some("/xyz?watch=1")));
    browser.say(Event::Answered(Request::Rooms, Some(r#"{"rooms":[]}"#.into())));
    assert!(browser.is_shown("#no-rooms"));
    browser.say(Event::PlayClicked(form("  ")));
    let lobby = browser.panel("lobby");
    assert_eq!(lobby.attribute_of("#lobby-note", "class"), Some(Some("note bad")));
    assert_eq!(lobby.attribute_of("#name", "aria-invalid"), Some(Some("true")));
}

#[test]
fn the_network_panel_shows_a_bad_network_and_the_badge_stays() {
    let mut browser = Browser::playing();
    assert!(!browser.is_shown("#network") && !browser.is_shown("#lag-badge"));
    browser.press("F4", "F4");
    assert!(browser.is_shown("#network"));
    browser.wait(1000);
    assert!(browser.text_at("#net-delay").ends_with(" ms"), "{}", browser.text_at("#net-delay"));
    let plot = browser.panel("connection");
    let plot = plot.attribute_of("#net-line-delay", "d").flatten().expect("a line");
    assert_eq!(plot.matches(['M', 'L']).count(), 6, "one for each pulse: {plot}");
    let bad = NetworkConditions::parse("150,30").expect("a network");
    browser.say(Event::ConditionsChosen(bad));
    browser.click("network");
    assert!(!browser.is_shown("#network") && browser.is_shown("#lag-badge"));
    assert!(browser.text_at("#lag-badge").contains("150"));
}

#[test]
fn a_page_without_sound_says_so() {
    let mut browser = Browser::playing();
    browser.say(Event::Sound(SoundEvent::Missing));
    assert!(!browser.is_shown("#sound-missing"), "the panel is closed");
    browser.click("sound");
    assert!(browser.is_shown("#sound") && browser.is_shown("#sound-missing"));
    assert!(browser.text_at("#sound-missing").contains("play sound"));
    assert_eq!(browser.text_at("#speaker-volume"), "0 %");
}

#[test]
fn the_focus_goes_to_the_topmost_card() {
    let mut browser = Browser::playing();
    let focus = |browser: &Browser| browser.panel("dialogs").focus;
    assert_eq!(focus(&browser), None);
    browser.click("help");
    assert_eq!(focus(&browser), Some("#help-close"));
    browser.click("settings");
    assert_eq!(focus(&browser), Some("#language"));
    assert_eq!(browser.panel("dialogs").attribute_of("#game", "inert"), Some(Some("")));
    browser.click("settings");
    browser.click("help");
    assert_eq!(focus(&browser), None);
    assert_eq!(browser.panel("dialogs").attribute_of("#game", "inert"), Some(None));
}

#[test]
fn fingers_have_no_key_caps_to_read_about() {
    let mut browser = Browser::playing();
    browser.click("help");
    let keys = |browser: &Browser| {
        let entries = browser.entries("#help-keys");
        entries.iter().filter_map(|entry| Some(entry.text_of("dt")?.to_owned())).collect::<Vec<_>>()
    };
    assert!(keys(&browser).contains(&"F4".to_owned()), "{:?}", keys(&browser));
    assert!(keys(&browser).iter().any(|key| key.contains("Space")), "{:?}", keys(&browser));
    browser.app.settings.touched = true;
    assert_eq!(keys(&browser), ["Drag on the left", "Tap"]);
}

#[test]
fn a_chosen_key_stands_on_its_cap_and_in_the_settings() {
    let mut browser = Browser::playing();
    browser.click("settings");
    browser.say(clicked("choose-key", "right"));
    let cap = |browser: &Browser| {
        let entries = browser.entries("#key-list");
        let entry = entries.into_iter().find(|entry| entry.key == "right").expect("an entry");
        entry.text_of("kbd").map(str::to_owned)
    };
    assert_eq!(cap(&browser).as_deref(), Some("\u{2026}"), "one is awaited");
    browser.press("KeyL", "l");
    assert_eq!(cap(&browser).as_deref(), Some("L"));
    let caps = browser.entries("#caps");
    assert!(caps.iter().any(|cap| cap.text_of("kbd") == Some("L")), "{caps:?}");
    browser.say(Event::Settings(SettingsEvent::PadConnected(true)));
    assert!(browser.is_shown("#pad-choices") && !browser.is_shown("#pad-none"));
}

#[test]
fn the_form_of_the_editor_has_a_control_for_each_field() {
    let mut browser = Browser::open("/", "");
    browser.say(Event::Navigated(Address {
        path: "/".to_owned(),
        hash: "#edit=hill".to_owned(),
        ..Address::default()
    }));
    browser.wait(100);
    let fields = browser.entries("#form-fields");
    let title = fields.iter().find(|field| field.key == "title").expect("a title");
    assert_eq!(title.attribute_of("", "class"), Some(Some("field given")));
    let controls = title.items_of(".set").expect("controls");
    let hill = Set::Typed("Hill".into());
    assert!(controls[0].parts.iter().any(|(_, set)| *set == hill), "{controls:?}");
    let panel = browser.panel("editor");
    assert_eq!(panel.attribute_of("#edit-undo", "disabled"), Some(Some("")), "nothing was done");
    assert_eq!(panel.attribute_of("", "data-editor"), Some(Some("edit")));
}

#[test]
fn the_form_explains_its_fields_and_has_a_rule_as_a_sentence() {
    let mut browser = Browser::open("/", "");
    let hash = "#edit=hill".to_owned();
    let address = Address { path: "/".to_owned(), hash, ..Address::default() };
    browser.say(Event::Navigated(address));
    let fields = include_str!("../../../../web/fields.txt").to_owned();
    browser.say(Event::WordsCame(["guide.html".to_owned(), fields]));
    browser.wait(100);
    let find = |browser: &Browser, list: &'static str, key: &str| {
        let found = browser.entries(list).into_iter().find(|entry| entry.key == key);
        found.unwrap_or_else(|| panic!("no {key} in {list}"))
    };
    let title = find(&browser, "#form-fields", "title");
    assert_eq!(title.text_of("span"), Some("Title"));
    assert_eq!(title.text_of("small span"), Some("Name shown to players."));
    assert_eq!(title.attribute_of("a", "href"), Some(Some("guide.html#top-level")));
    find(&browser, "#form-more-fields", "quantum");
    find(&browser, "#round-fields", "round.goal");
    find(&browser, "#round-more-fields", "round.pause");
    // A rule of the hill, and one more.
    let parts = |browser: &Browser, key| -> Vec<String> {
        let rule = find(browser, "#rules", key);
        let parts = rule.items_of("p").expect("parts").iter();
        let paths = parts.filter_map(|part| part.attribute_of("", "data-path").flatten());
        paths.map(str::to_owned).collect()
    };
    let blanks = ["#when", ".every", ".to", "#score", ".score", "#"];
    assert_eq!(parts(&browser, "0"), blanks.map(|blank| format!("rules[0]{blank}")));
    let before = browser.entries("#rules").len();
    browser.say(Event::Clicked(PageAction::EditRule, String::new()));
    assert_eq!(browser.entries("#rules").len(), before + 1);
    browser.say(Event::FieldChanged(format!("rules[{before}]#when"), vec!["burst".to_owned()]));
    assert!(parts(&browser, &before.to_string())[0].ends_with("#when"));
    browser.say(Event::Clicked(PageAction::EditUnrule, before.to_string()));
    assert_eq!(browser.entries("#rules").len(), before);
}

#[test]
fn a_bad_replay_and_its_place_are_on_the_card() {
    let mut browser = Browser::open("/", "");
    browser.say(Event::ReplayRead("cat.gif".into(), Ok(b"GIF89a".to_vec())));
    assert!(browser.is_shown("#notice") && browser.is_shown("#notice-detail"));
    assert_eq!(browser.text_at("#notice-title"), "Not a replay");
    assert!(browser.text_at("#notice-detail").contains("byte 0"));
    assert_eq!(browser.text_at("#notice-button"), "Open another file");
}

#[test]
fn a_verified_replay_says_how_far() {
    let mut browser = replays::watching();
    assert_eq!(browser.text_at("#length"), "0:05");
    browser.press("End", "End");
    browser.wait(200);
    let deck = browser.panel("deck");
    assert_eq!(deck.attribute_of("#check", "data-verdict"), Some(Some("whole")));
    assert_eq!(deck.text_of("#check-text"), Some("Fully verified"));
    let title = deck.attribute_of("#check", "title").flatten().expect("details");
    assert!(title.contains("300 of 300 ticks compared"), "{title}");
    assert_eq!(deck.items_of("#cast").map(<[View]>::len), Some(1));
}

#[test]
fn a_wrong_hash_is_said_with_its_time() {
    let mut records = replays::records();
    for record in &mut records {
        if let Record::Ticks(block) = record
            && (block.first..=block.last()).contains(&245)
        {
            block.ticks[(245 - block.first) as usize].hash ^= 1;
        }
    }
    let mut browser = replays::watching_file(replays::file(&records));
    browser.press("End", "End");
    browser.wait(200);
    let deck = browser.panel("deck");
    assert_eq!(deck.attribute_of("#check", "data-verdict"), Some(Some("differs")));
    assert_eq!(deck.text_of("#check-text"), Some("Doesn't match the recording after 0:04"));
    let title = deck.attribute_of("#check", "title").flatten().expect("details");
    assert!(title.ends_with("; differs from tick 245"), "{title}");
    assert_ne!(browser.panel("marks").attribute_of("#mark-wrong", "d"), Some(Some("")));
}

#[test]
fn a_cut_replay_plays_as_far_as_it_goes_and_says_so() {
    let whole = replays::file(&replays::records());
    let mut browser = Browser::open("/", "");
    let cut = whole[..whole.len() - 40].to_vec();
    browser.say(Event::ReplayRead("cut.jostle".into(), Ok(cut)));
    assert_eq!(browser.text_at("#notice-title"), "Incomplete replay");
    let detail = browser.text_at("#notice-detail");
    assert!(detail.contains("ends within a record"), "{detail}");
    browser.click("notice");
    assert!(!browser.is_shown("#notice") && browser.is_shown("#hint"));
    assert!(browser.text_at("#hint").starts_with("Incomplete: plays to 0:0"));
    assert_eq!(browser.app.state(), "replay");
}

#[test]
fn a_damaged_replay_is_explained_and_leads_back_to_the_lobby() {
    let mut damaged = replays::file(&replays::records());
    damaged[40] ^= 1;
    let mut browser = Browser::open("/", "");
    browser.say(Event::ReplayRead("damaged.jostle".into(), Ok(damaged)));
    assert_eq!(browser.text_at("#notice-title"), "Damaged replay");
    let detail = browser.text_at("#notice-detail");
    assert!(detail.contains("byte 10") && detail.contains("checksum"), "{detail}");
    browser.click("notice-other");
    assert!(!browser.is_shown("#notice"));
    assert_eq!(browser.app.state(), "lobby");
}

#[test]
fn a_zone_says_what_it_is_and_how_many_are_in() {
    let mut browser = Browser::open("/herd", "");
    browser.accept("herd");
    browser.wait(200);
    let labels = browser.entries("#zone-labels");
    assert_eq!(
        labels.iter().map(|label| label.text_of("")).collect::<Vec<_>>(),
        [Some("Pen 0 / 5")]
    );
}

#[test]
fn a_full_room_is_explained() {
    let mut browser = Browser::open("/impulse", "");
    browser.accept("impulse");
    browser.server_says(&ServerMessage::Refused { refusal: Refusal::RoomFull });
    assert!(browser.is_shown("#notice"));
    assert_eq!(browser.text_at("#notice-text"), Refusal::RoomFull.message());
}

#[test]
fn who_watches_is_offered_to_join_in() {
    let playing = Browser::playing();
    assert!(!playing.is_shown("#join-room"));
    let mut watching = Browser::open("/arena", "?watch=1");
    watching.accept("arena");
    assert!(watching.is_shown("#join-room"));
    watching.click("help");
    let entries = watching.entries("#help-keys");
    let keys = entries.iter().filter_map(|entry| entry.text_of("dt"));
    assert_eq!(keys.take(3).collect::<Vec<_>>(), ["1 to 9", "0", "H"]);
    assert_eq!(playing.panel("page").text_of("#copy span"), Some("Copy link"));
}
