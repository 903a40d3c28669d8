//! Entering a game: the lobby, its rooms and links, and the layout on a phone.

use anyhow::{Result, ensure};
use jostle_tests::runner::Stage;
use jostle_tests::state::State;
use jostle_tests::tab::Screen;
use std::sync::Arc;

pub async fn the_lobby_opens_a_room_and_copies_its_link(stage: Arc<Stage>) -> Result<()> {
    let ada = stage.visit("/", Screen::LAPTOP).await?;
    ada.until("the lobby", |s| s.state == "lobby").await?;
    ada.until_true("document.querySelectorAll('#scenes li').length >= 20").await?;
    // Pictures are loaded as they come into view.
    ensure!(ada.eval::<bool>("!!document.querySelector('#game-list img:not([src])')").await?);
    ada.until_true(
        "[...document.querySelectorAll('#game-list img')].every(i => { \
         if (!i.src) i.scrollIntoView(); return i.complete && i.naturalWidth; })",
    )
    .await?;
    ada.fill("#name", "Ada").await?;
    ada.click_on("#playground-list [data-value=arena]").await?;
    ada.until("a hero of one's own", State::plays).await?;
    let link = ada.link().await?;
    ensure!(link.len() > stage.server.link("/").len(), "{link} names a room");

    // Clipboard permission cannot be granted to a headless page.
    ada.eval::<bool>(
        "(navigator.clipboard.writeText = text => { window.copied = text; return Promise.resolve(); \
         }, true)",
    )
    .await?;
    ada.click_on("#copy").await?;
    ada.until_true("window.copied").await?;
    let copied: String = ada.eval("window.copied").await?;
    assert_eq!(copied, link);

    let bob = stage.visit_link(&copied, Screen::SMALL).await?;
    bob.until("two players", |s| s.plays() && s.connected() == 2).await?;
    bob.until_true("document.querySelector('#game').innerText.includes('Ada')").await?;
    ada.click_on("#leave").await?;
    ada.until("the lobby", |s| s.state == "lobby").await?;
    bob.until("Ada gone", |s| s.connected() == 1).await?;
    Ok(())
}

pub async fn play_joins_the_room_with_players(stage: Arc<Stage>) -> Result<()> {
    let bob = stage.play("arena", Screen::SMALL).await?;
    let ada = stage.visit("/", Screen::PHONE).await?;
    ada.until("the lobby", |s| s.state == "lobby").await?;
    ada.until_true("document.querySelector('#room-list').innerText.includes('1')").await?;
    ada.click_on("#play").await?;
    ada.until("a hero of one's own", State::plays).await?;
    assert_eq!(ada.link().await?, bob.link().await?);
    bob.until("two players", |s| s.connected() == 2).await?;
    Ok(())
}

pub async fn the_help_takes_the_focus_and_gives_it_back(stage: Arc<Stage>) -> Result<()> {
    let tab = stage.play("impulse", Screen::SMALL).await?;
    let focused = "document.activeElement.id";
    tab.eval::<bool>("(document.querySelector('#signal').focus(), true)").await?;
    tab.key_down("?").await?;
    tab.key_up("?").await?;
    tab.until_true(&format!("{focused} === 'help-close'")).await?;
    tab.until_true("document.querySelector('#game').inert").await?;
    tab.key_down("Escape").await?;
    tab.key_up("Escape").await?;
    tab.until_true(&format!("{focused} === 'signal'")).await?;
    tab.until_true("!document.querySelector('#game').inert").await?;

    // After the click, key presses go to the game and not to the button.
    tab.click_on("#help-button").await?;
    tab.until_true(&format!("{focused} === 'help-close'")).await?;
    tab.click_on("#help-close").await?;
    tab.until_true(&format!("{focused} === 'stage'")).await?;
    Ok(())
}

pub async fn a_phone_has_a_stick_and_nothing_scrolls(stage: Arc<Stage>) -> Result<()> {
    let tab = stage.play("arena", Screen::PHONE).await?;
    let screen = tab.screen();
    let middle = tab.middle_of("#stick").await?;
    ensure!(middle[0] < f64::from(screen.width) / 2.0, "the stick is under the left thumb");
    ensure!(middle[1] > f64::from(screen.height) / 2.0, "and low: {middle:?}");
    let tools = tab.middle_of("#tools button, #tools > *").await?;
    ensure!(tools[0] > f64::from(screen.width) / 2.0, "tools under the right: {tools:?}");
    tab.until_true(
        "document.documentElement.scrollWidth <= innerWidth && \
         document.documentElement.scrollHeight <= innerHeight",
    )
    .await?;
    let x = |s: &State| s.own_hero().map_or(f32::NAN, |hero| hero.pos[0]);
    let before = x(&tab.state().await?);
    let to = if before < 160.0 { 40.0 } else { -40.0 };
    tab.touch(middle, false).await?;
    tab.touch([middle[0] + to, middle[1]], true).await?;
    tab.until("the stick steering", |s| (x(s) - before) * to.signum() as f32 > 3.0).await?;
    tab.lift().await?;

    // If there is no F4 key, the signal icon opens the network panel.
    tab.click_on("#signal").await?;
    tab.until_true(
        "(() => { const panel = document.querySelector('#network').getBoundingClientRect(); \
         return panel.height > 200 && panel.left >= 0 && panel.right <= innerWidth \
         && panel.bottom <= innerHeight; })()",
    )
    .await?;
    tab.keep("phone-network").await?;
    tab.click_on("#net-close").await?;
    tab.until_true("document.querySelector('#network').hidden").await
}

/// Maximum number of bytes that a first visit to the lobby downloads, excluding the lists of rooms and replays, whose
/// length varies.
const COLD_BYTES_MAX: u64 = 1_060_000;

/// Checks that a first visit downloads little, and that a second one requests only the document and the lists.
pub async fn the_lobby_is_downloaded_once(stage: Arc<Stage>) -> Result<()> {
    let tab = stage.visit("/", Screen::LAPTOP).await?;
    let loaded = "document.querySelectorAll('#game-list img').length > 5 && [...document.images]\
                  .filter(i => i.getBoundingClientRect().top < innerHeight).every(i => i.src && i.complete)";
    tab.until("the lobby", |s| s.state == "lobby").await?;
    tab.until_true(loaded).await?;
    let bytes = "['navigation', 'resource'].flatMap(t => performance.getEntriesByType(t))\
                 .filter(entry => !/api.(rooms|replays)/.test(entry.name))\
                 .reduce((sum, entry) => sum + entry.encodedBodySize, 0)";
    let cold: u64 = tab.eval(bytes).await?;
    ensure!((700_000..=COLD_BYTES_MAX).contains(&cold), "{cold} bytes");
    tab.go(&stage.server.link("/")).await?;
    tab.until("the lobby", |s| s.state == "lobby").await?;
    tab.until_true(loaded).await?;
    let asked = "performance.getEntriesByType('resource').filter(entry => entry.transferSize > 0)\
                 .map(entry => new URL(entry.name).pathname).filter(path => !path.startsWith('/api/'))";
    let asked: Vec<String> = tab.eval(asked).await?;
    ensure!(asked.is_empty(), "asked again for {asked:?}");
    let warm = "['navigation', 'resource'].flatMap(t => performance.getEntriesByType(t))\
                .reduce((sum, entry) => sum + entry.transferSize, 0)";
    let warm: u64 = tab.eval(warm).await?;
    stage.note(format!("{cold} bytes cold, {warm} bytes warm"));
    Ok(())
}
