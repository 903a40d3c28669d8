//! Sharing edited scenes and games: rooms with custom scenes, QR codes, and invalid links.

use super::editor::{errors_of, open, text};
use anyhow::{Context, Result, ensure};
use jostle_client_web::net::scene_link;
use jostle_game::Scene;
use jostle_tests::picture::Picture;
use jostle_tests::runner::Stage;
use jostle_tests::state::State;
use jostle_tests::tab::{Screen, Tab};
use rqrr::PreparedImage;
use std::sync::Arc;

/// A custom scene that has heroes.
const YARD: &str = r#"title = "Yard"
size = [320, 180]
tools = ["steer"]
groups = ["hero", "platform"]
pairs = [["hero", "platform"], ["hero", "hero"]]

[hero]
size = [12, 12]
spawns = [[100, 40], [200, 40]]

# The floor.
[[bodies]]
kind = "wall"
position = [160, 10]
size = [320, 20]
"#;

/// Reads the text of the only QR code in a screenshot.
fn read_code(picture: &Picture) -> Result<String> {
    let [width, height] = [picture.width, picture.height].map(|side| side as usize);
    let mut image = PreparedImage::prepare_from_greyscale(width, height, |x, y| {
        let [red, green, blue] = picture.pixel(x as f64, y as f64).map(u16::from);
        ((red + green + blue) / 3) as u8
    });
    let grids = image.detect_grids();
    let grid = grids.first().context("no code on the page")?;
    Ok(grid.decode()?.1)
}

pub async fn a_room_with_the_edited_scene_is_opened(stage: Arc<Stage>) -> Result<()> {
    let ada = open(&stage, "#edit", Screen::LAPTOP.sharp()).await?;
    ada.click_on("#tab-text").await?;
    ada.fill("#text", YARD).await?;
    ada.until_true("!document.querySelector('#edit-room').disabled").await?;
    ada.keep("sharing-editor").await?;
    ada.click_on("#edit-room").await?;
    ada.until("a hero of one's own", State::plays).await?;
    ada.until_true("!document.querySelector('#close-room').hidden").await?;
    ada.until_true("document.querySelector('#room-title').textContent === 'Yard'").await?;
    ada.keep("sharing-room").await?;

    // A phone scans the code, and its user joins.
    ada.click_on("#qr-code").await?;
    ada.until_true("!document.querySelector('#notice-code').hidden").await?;
    ada.keep_on_all_screens("sharing-code").await?;
    let link = read_code(&ada.steady_picture().await?)?;
    assert_eq!(link, ada.link().await?);
    let bob = stage.visit_link(&link, Screen::PHONE.sharp()).await?;
    bob.until("two players", |s| s.plays() && s.connected() == 2).await?;
    bob.click_on("#menu").await?;
    bob.click_on("#qr-code").await?;
    bob.until_true("!document.querySelector('#notice-code').hidden").await?;
    bob.keep("sharing-code-phone").await?;
    assert_eq!(read_code(&bob.steady_picture().await?)?, link);
    ada.press("Escape").await?;
    ada.until_true("document.querySelector('#notice').hidden").await?;
    // Keys go to the game again, and there is no ring around anything.
    ada.until_true("document.activeElement.id === 'stage'").await?;
    let ring = "[...document.querySelectorAll(':focus-visible')]\
                .some(e => getComputedStyle(e).outlineStyle !== 'none')";
    ensure!(!ada.eval::<bool>(ring).await?, "a ring stays");

    // Going back returns to the editor with unchanged text.
    ada.eval::<bool>("(history.back(), true)").await?;
    ada.until("the editor", |s| s.state == "editing").await?;
    assert_eq!(text(&ada).await?, YARD);
    Ok(())
}

pub async fn a_scene_that_the_server_refuses_shows_why_at_its_place(
    stage: Arc<Stage>,
) -> Result<()> {
    let tab = open(&stage, "#edit", Screen::LAPTOP).await?;
    let large = YARD.replace("[320, 180]", "[32000, 18000]");
    tab.click_on("#tab-text").await?;
    tab.fill("#text", &large).await?;
    tab.until_true("document.querySelector('#edit-error').hidden").await?;
    tab.click_on("#edit-room").await?;
    tab.until_true("!document.querySelector('#edit-error').hidden").await?;
    let [sentence, underlined] = errors_of(&tab).await?;
    ensure!(sentence.starts_with("my-scene.toml:2: size: found a world of 32000"), "{sentence}");
    assert_eq!(underlined, "size = [32000, 18000]");
    tab.keep_on_all_screens("sharing-refused").await?;
    tab.fill("#text", YARD).await?;
    tab.until_true("document.querySelector('#edit-error').hidden").await?;
    tab.ignore_errors(|error| error.contains("422"));
    Ok(())
}

pub async fn the_code_of_an_edited_scene_is_its_link(stage: Arc<Stage>) -> Result<()> {
    let tab = open(&stage, "#edit", Screen::LAPTOP.sharp()).await?;
    tab.click_on("#tab-text").await?;
    tab.fill("#text", YARD).await?;
    tab.click_on("#edit-qr").await?;
    tab.until_true("!document.querySelector('#notice-code').hidden").await?;
    tab.keep("sharing-code-scene").await?;
    let link = read_code(&tab.steady_picture().await?)?;
    assert_eq!(link, stage.server.link(&format!("/#scene={}", scene_link::encode(YARD))));
    let other = stage.visit_link(&link, Screen::SMALL).await?;
    other.until("the scene, played", |s| s.state == "playing" && s.ticks() > 5).await?;
    Ok(())
}

pub async fn a_link_with_an_error_leads_to_it(stage: Arc<Stage>) -> Result<()> {
    let wrong = YARD.replace("size = [12, 12]", "size = [12, -12]");
    let told = Scene::parse("my-scene.toml", &wrong).err().context("it is wrong")?.to_string();
    let tab: Tab =
        stage.visit(&format!("/#scene={}", scene_link::encode(&wrong)), Screen::LAPTOP).await?;
    tab.until_true("document.querySelector('#notice-button').textContent === 'Edit'").await?;
    tab.keep("sharing-wrong-link").await?;
    tab.click_on("#notice-button").await?;
    tab.until("the editor", |s| s.state == "editing").await?;
    tab.until_true("document.activeElement.id === 'text'").await?;
    assert_eq!(text(&tab).await?, wrong);
    tab.until_true("document.querySelector('#underlay mark').textContent !== ''").await?;
    let [sentence, underlined] = errors_of(&tab).await?;
    assert_eq!((sentence, underlined), (told, "-12".to_owned()));
    let before: String =
        tab.eval("(t => t.value.slice(0, t.selectionStart))(document.activeElement)").await?;
    ensure!(before.ends_with("[hero]\nsize = [12, "), "the caret is after {before:?}");
    Ok(())
}
