//! The page without a server, as a folder below a path on a plain file server. It plays alone and with bots exactly as
//! a native room does, bit for bit, opens scene links and replays, and requests nothing outside its folder.

use super::replay::{drop_file, file, records, until};
use anyhow::{Context, Result, anyhow, bail, ensure};
use jostle_client_web::net::scene_link;
use jostle_game::{Input, Scene};
use jostle_protocol::Appearance;
use jostle_protocol::replay::Replay;
use jostle_room::Room;
use jostle_tests::files::{FileServer, static_page};
use jostle_tests::runner::{Case, Stage};
use jostle_tests::scripts::HASTE;
use jostle_tests::state::State;
use jostle_tests::tab::{Screen, Tab};
use serde_json::Value;
use std::collections::BTreeSet;
use std::sync::Arc;

/// URL path of the folder.
const BELOW: &str = "/jostle/";
/// Number of cases that share the shipped scenes.
const PARTS: usize = 4;
/// Number of ticks after which games are compared; by then rounds have begun and bots are active.
const TICKS: u32 = 300;
/// Number of ticks after which games with an idle player and no bots are compared.
const IDLE_TICKS: u32 = 100;
const SEED: u64 = 7;
/// Maximum number of bots.
const BOTS: u16 = 5;
/// A scene that is not shipped.
const YARD: &str = r#"title = "Yard"
size = [320, 180]
tools = ["steer"]
groups = ["hero", "ball"]
pairs = [["hero", "ball"], ["hero", "hero"]]

[hero]
size = [12, 12]
spawns = [[20, 20], [60, 20], [100, 20]]

[[bodies]]
kind = "block"
group = "ball"
radius = 8
position = [200, 120]
velocity = [30, 0]
"#;

pub fn cases() -> Vec<Case> {
    let scenes = (0..PARTS).map(|part| {
        let name = format!("the_page_without_a_server_plays_scenes_{}_of_{PARTS}", part + 1);
        Case::new(name, move |stage| the_page_without_a_server_plays_scenes(stage, part))
    });
    let others = [
        Case::new(
            "the_page_without_a_server_opens_links_and_files",
            the_page_without_a_server_opens_links_and_files,
        ),
        Case::new(
            "a_clip_of_the_page_without_a_server_verifies_there",
            a_clip_of_the_page_without_a_server_verifies_there,
        ),
        Case::new(
            "a_scene_element_plays_a_file_once_it_is_seen",
            a_scene_element_plays_a_file_once_it_is_seen,
        ),
        Case::new(
            "a_scene_is_played_alone_in_a_lobby_without_a_server",
            a_scene_is_played_alone_in_a_lobby_without_a_server,
        ),
        Case::new(
            "a_scene_is_played_alone_in_the_lobby_of_a_server",
            a_scene_is_played_alone_in_the_lobby_of_a_server,
        ),
    ];
    scenes.chain(others).collect()
}

async fn host(more: Vec<(String, Vec<u8>)>) -> Result<FileServer> {
    FileServer::start(static_page(), BELOW, more).await
}

fn shipped(name: &str) -> Result<Scene> {
    let found = Scene::built_in().into_iter().find(|scene| scene.name == name);
    found.with_context(|| format!("no scene {name}"))
}

/// Returns the state hash of a native room with one idle player and `bots` bots after `ticks` ticks.
fn native_hash(scene: Scene, seed: u64, bots: u16, ticks: u32) -> Result<Option<String>> {
    let mut room = Room::filled("native", Arc::new(scene), seed, bots + 1);
    let look = Appearance::new("Native", 0).map_err(|error| anyhow!("{error}"))?;
    let joined = room.join(look, None).map_err(|refusal| anyhow!("{refusal:?}"))?;
    for tick in 0..ticks {
        // Without any input, the player would be considered away.
        room.input(joined.claim.seat, tick + 1, Input::default());
        room.tick();
    }
    ensure!(room.bots() == usize::from(bots), "{} bots, not {bots}", room.bots());
    Ok(Some(format!("{:016x}", room.game().hash())))
}

/// Waits until a game has been played long enough and compares it with a native one.
async fn compare(tab: &Tab, scene: Scene, seed: u64, bots: u16) -> Result<()> {
    let ticks = if bots == 0 { IDLE_TICKS } else { TICKS };
    let played = |s: &State| s.state == "playing" && s.hash_tick.unwrap_or(0) >= ticks;
    let state = tab.until(&format!("{ticks} ticks of {}", scene.name), played).await?;
    ensure!(state.players.len() == usize::from(bots) + 1, "{}: {:?}", scene.name, state.players);
    let (name, tick) = (scene.name.clone(), state.hash_tick.context("a tick")?);
    let native = native_hash(scene, seed, bots, tick)?;
    ensure!(state.hash == native, "{name}, {bots} bots, tick {tick}: {:?}, {native:?}", state.hash);
    Ok(())
}

/// Fails if anything outside the folder was requested, from this server or another.
async fn check_requests(server: &FileServer, tab: &Tab) -> Result<()> {
    let asked = server.asked();
    let outside: Vec<_> = asked.iter().filter(|path| !path.starts_with(BELOW)).collect();
    ensure!(outside.is_empty(), "outside of the folder: {outside:?}");
    let loaded: Vec<String> =
        tab.eval("performance.getEntriesByType('resource').map(entry => entry.name)").await?;
    let folder = server.link(BELOW);
    let elsewhere: Vec<_> = loaded.iter().filter(|name| !name.starts_with(&folder)).collect();
    ensure!(!loaded.is_empty() && elsewhere.is_empty(), "from elsewhere: {elsewhere:?}");
    Ok(())
}

/// Plays every scene, alone if a round needs only one player and with bots if players have heroes. One page plays all
/// scenes of a part as fast as it can.
async fn the_page_without_a_server_plays_scenes(stage: Arc<Stage>, part: usize) -> Result<()> {
    let server = host(Vec::new()).await?;
    let tab = stage.visit_link_changed(HASTE, &server.link(BELOW), Screen::TINY).await?;
    let mut wrong = Vec::new();
    for scene in Scene::built_in().into_iter().skip(part).step_by(PARTS) {
        let needed = scene.rules.round.as_ref().map_or(0, |round| round.players_min.max(1) - 1);
        let most = if scene.hero.is_some() { (scene.players_max - 1).min(BOTS) } else { 0 };
        for bots in BTreeSet::from([needed.min(most), most]) {
            let name = &scene.name;
            tab.go_within(&format!("{BELOW}#alone={name}&bots={bots}&seed={SEED}")).await?;
            if let Err(error) = compare(&tab, shipped(name)?, SEED, bots).await {
                stage.note(format!("{name}, {bots} bots: {error:#}"));
                wrong.push(format!("{name} with {bots} bots"));
            }
        }
    }
    ensure!(wrong.is_empty(), "played differently than natively: {}", wrong.join(", "));
    check_requests(&server, &tab).await
}

async fn the_page_without_a_server_opens_links_and_files(stage: Arc<Stage>) -> Result<()> {
    let records = records()?;
    let server = host(vec![("games/arena.jostle".into(), file(&records))]).await?;
    let yard = || Scene::parse("scene.toml", YARD).map_err(|error| anyhow!("{error}"));
    let link = format!("{BELOW}#scene={}", scene_link::encode(YARD));
    let tab = stage.visit_link(&server.link(&format!("{link}&bots=2")), Screen::SMALL).await?;
    compare(&tab, yard()?, 1, 2).await?;
    let sent = server.asked();
    ensure!(sent.iter().all(|path| !path.contains("scene=")), "the text was sent: {sent:?}");

    tab.go(&server.link(&format!("{BELOW}#replay=games/arena.jostle"))).await?;
    let watched = |s: &State| s.state == "replay" && s.replay.as_ref().is_some_and(|r| r.tick > 5);
    tab.until("the replay of the address", watched).await?;
    tab.until_true("!document.querySelector('#copy').hidden").await?;
    tab.click_on("#menu").await?;
    tab.click_on("#leave").await?;
    tab.until("the lobby", |s| s.state == "lobby").await?;
    assert_eq!(tab.link().await?, server.link(BELOW));
    drop_file(&tab, "game.jostle", &file(&records)).await?;
    tab.until("the dropped replay", watched).await?;

    // A dropped scene file replaces the game, and its link appears in the address bar.
    drop_file(&tab, "scene.toml", YARD.as_bytes()).await?;
    compare(&tab, yard()?, 1, 0).await?;
    assert_eq!(tab.link().await?, server.link(&link));
    let wrong = YARD.replace("radius = 8", "radius = -8");
    let error = Scene::parse("wrong.toml", &wrong).err().context("an error")?.to_string();
    drop_file(&tab, "wrong.toml", wrong.as_bytes()).await?;
    let shown = serde_json::to_string(&error)?;
    tab.until_true(&format!("document.querySelector('#notice-detail').textContent === {shown}"))
        .await?;
    tab.keep_on_all_screens("alone-wrong").await?;
    tab.click_on("#notice-other").await?;
    tab.until_true("document.querySelector('#notice').hidden").await?;
    check_requests(&server, &tab).await
}

/// Saves the last few seconds as a file by touch, and opens it in the same page.
async fn a_clip_of_the_page_without_a_server_verifies_there(stage: Arc<Stage>) -> Result<()> {
    let server = host(Vec::new()).await?;
    let hash = format!("{BELOW}#alone=arena&bots=2&seed={SEED}");
    let link = server.link(&hash);
    let tab = stage.visit_link_changed(HASTE, &link, Screen::PHONE).await?;
    let later = |s: &State| s.state == "playing" && s.hash_tick.unwrap_or(0) >= TICKS;
    tab.until("a game", later).await?;
    let keep =
        "(HTMLAnchorElement.prototype.click = function () { window.saved = this.href; }, true)";
    tab.eval::<bool>(keep).await?;
    tab.click_on("#menu").await?;
    tab.click_on("#keep-clip").await?;
    tab.until_true("!document.querySelector('#clip').hidden").await?;
    tab.keep("clip-phone").await?;
    let saved = "[...atob(saved.split(',')[1])].map(letter => letter.charCodeAt(0))";
    let clip: Vec<u8> = tab.eval(saved).await?;
    let replay = Replay::read(clip.clone())?;
    let (first, last) = (replay.first_tick(), replay.last_tick());
    ensure!(last >= TICKS, "it ends at tick {last}");
    stage.note(format!("{} bytes", clip.len()));
    drop_file(&tab, "clip.jostle", &clip).await?;
    let shown = until(&tab, "all compared", |shown| shown.compared == last - first).await?;
    assert_eq!((shown.differs_at, shown.agrees_until), (None, last));
    check_requests(&server, &tab).await
}

/// A JavaScript expression for the window of an element's frame, if the frame is there.
fn window_of(element: &str) -> String {
    format!(
        "document.querySelector('#{element}').shadowRoot.querySelector('iframe')?.contentWindow"
    )
}

/// Shows the example page, in which two elements play the same file.
async fn a_scene_element_plays_a_file_once_it_is_seen(stage: Arc<Stage>) -> Result<()> {
    let server = host(Vec::new()).await?;
    let link = server.link(&format!("{BELOW}example.html"));
    let tab = stage.visit_link(&link, Screen::LAPTOP).await?;
    let (small, large) = (window_of("small"), window_of("large"));
    let plays = |window: &str, players: usize| {
        format!(
            "(state => state && JSON.stringify(state).includes('playing') \
             && (typeof state === 'string' ? JSON.parse(state) : state).players.length === {players})\
             ({window}?.jostle?.state())"
        )
    };
    tab.until_true(&plays(&small, 1)).await?;
    let shown = |window: &str, id: &str| {
        format!("{window}.document.querySelector('{id}').checkVisibility()")
    };
    ensure!(!tab.eval::<bool>(&shown(&small, "#help-button")).await?, "buttons without controls");
    ensure!(tab.eval::<bool>(&format!("!{large}")).await?, "a frame before it is seen");
    tab.keep("element").await?;

    tab.eval::<bool>("(document.querySelector('#large').scrollIntoView(), true)").await?;
    tab.until_true(&plays(&large, 3)).await?;
    tab.until_true(&shown(&large, "#help-button")).await?;
    tab.keep("element-controls").await?;

    // A file that is missing is named.
    tab.eval::<bool>("(document.querySelector('#large').setAttribute('src', 'none.toml'), true)")
        .await?;
    let note = "document.querySelector('#large').shadowRoot.querySelector('p')?.textContent";
    tab.until_true(&format!("{note}.includes('none.toml answers 404')")).await?;
    tab.ignore_errors(|error| error.contains("404"));
    check_requests(&server, &tab).await
}

/// Returns the seed in the page's address.
async fn seed_of(tab: &Tab) -> Result<u64> {
    let link = tab.link().await?;
    let seed = link.rsplit_once("&seed=").with_context(|| link.clone())?.1;
    seed.parse().with_context(|| link.clone())
}

async fn a_scene_is_played_alone_in_a_lobby_without_a_server(stage: Arc<Stage>) -> Result<()> {
    let server = host(Vec::new()).await?;
    let tab = stage.visit_link_changed(HASTE, &server.link(BELOW), Screen::PHONE).await?;
    tab.until_true("document.querySelectorAll('#scenes li').length >= 20").await?;
    tab.until_true("document.documentElement.scrollWidth <= innerWidth").await?;
    tab.until_true("document.querySelector('#rooms').getBoundingClientRect().height === 0").await?;
    tab.keep_on_all_screens("alone-lobby").await?;
    tab.eval::<bool>("(document.querySelector('#scenes').scrollIntoView(), true)").await?;
    tab.keep_on_all_screens("alone-scenes").await?;
    tab.click_on("#game-list [data-value=hockey]").await?;
    compare(&tab, shipped("hockey")?, seed_of(&tab).await?, 3).await?;
    tab.keep_on_all_screens("alone-game").await?;

    // After a reload, the same game starts.
    tab.reload().await?;
    compare(&tab, shipped("hockey")?, seed_of(&tab).await?, 3).await?;
    tab.eval::<bool>("(history.back(), true)").await?;
    tab.until("the lobby", |s| s.state == "lobby").await?;
    check_requests(&server, &tab).await
}

/// Checks that the lobby offers the same scenes as the page without a server.
async fn a_scene_is_played_alone_in_the_lobby_of_a_server(stage: Arc<Stage>) -> Result<()> {
    let tab = stage.visit_changed(HASTE, "/").await?;
    tab.until_true("document.querySelectorAll('#scenes li').length >= 20").await?;
    let without: Value = serde_json::from_slice(&scenes_of_the_static_page()?)?;
    let list = "fetch('/api/scenes').then(answer => answer.text())";
    let with: Value = serde_json::from_str(&tab.eval::<String>(list).await?)?;
    assert_eq!(without_pictures(with), without_pictures(without));
    tab.eval::<bool>("(document.querySelector('#scenes').scrollIntoView(), true)").await?;
    tab.keep_on_all_screens("served-lobby").await?;
    // Play a scene alone, using the keyboard.
    let button = "document.querySelector('#game-list .alone[data-value=hill]')";
    tab.eval::<bool>(&format!("({button}.focus(), true)")).await?;
    tab.key_down(" ").await?;
    tab.key_up(" ").await?;
    tab.until("a game", |s| s.state == "playing").await?;
    compare(&tab, shipped("hill")?, seed_of(&tab).await?, 3).await?;
    tab.keep_on_all_screens("served-alone").await
}

/// Reads the list of scenes next to the page, in a directory whose name is a hash.
fn scenes_of_the_static_page() -> Result<Vec<u8>> {
    let assets = static_page().join("assets");
    for entry in std::fs::read_dir(&assets).with_context(|| assets.display().to_string())? {
        let list = entry?.path().join("scenes.json");
        if list.is_file() {
            return std::fs::read(&list).with_context(|| list.display().to_string());
        }
    }
    bail!("no scenes.json below {}", assets.display())
}

/// Removes the URLs of pictures from a list of scenes.
fn without_pictures(mut list: Value) -> Value {
    let mut scenes = list["scenes"].take();
    for scene in scenes.as_array_mut().into_iter().flatten() {
        assert!(scene["picture"].is_string(), "{scene}");
        scene["picture"] = Value::Null;
    }
    scenes
}
