//! QR codes for links, which phone cameras can read from the screen.

use qrcodegen::{QrCode, QrCodeEcc, QrSegment, Version};
use std::fmt::Write;

/// Version of the largest code. It has 137 squares per side, each about a millimetre wide on a laptop, and holds 1732
/// bytes.
const VERSION_MAX: u8 = 30;
/// Width of the light margin that readers need to find a code, squares.
const QUIET: i32 = 4;

/// A QR code as an SVG path.
#[derive(Debug, PartialEq, Eq)]
pub struct Drawing {
    /// Squares per side, including the margin.
    pub side: i32,
    pub path: String,
}

/// Draws the QR code of a link; `None` if the link is too long.
pub fn draw(link: &str) -> Option<Drawing> {
    let segments = [QrSegment::make_bytes(link.as_bytes())];
    let code = QrCode::encode_segments_advanced(
        &segments,
        QrCodeEcc::Low,
        Version::MIN,
        Version::new(VERSION_MAX),
        None,
        true,
    );
    let code = code.ok()?;
    let mut path = String::new();
    for y in 0..code.size() {
        let mut x = 0;
        while x < code.size() {
            let dark = (x..code.size()).take_while(|x| code.get_module(*x, y)).count() as i32;
            if dark > 0 {
                let _ = write!(path, "M{} {}h{dark}v1h-{dark}z", x + QUIET, y + QUIET);
            }
            x += dark + 1;
        }
    }
    Some(Drawing { side: code.size() + 2 * QUIET, path })
}

#[cfg(test)]
mod tests {
    use super::*;
    use rqrr::PreparedImage;

    /// Reads the text from a drawing scaled to several pixels per square.
    fn read(drawing: &Drawing) -> String {
        const PIXELS: usize = 4;
        let side = drawing.side as usize;
        let mut dark = vec![false; side * side];
        for run in drawing.path.split_terminator('z') {
            let numbers: Vec<usize> = run
                .split(|c: char| !c.is_ascii_digit())
                .filter(|digits| !digits.is_empty())
                .map(|digits| digits.parse().expect("digits"))
                .collect();
            let [x, y, width, 1, _] = numbers[..] else { panic!("{run}") };
            dark[y * side + x..][..width].fill(true);
        }
        let mut image =
            PreparedImage::prepare_from_greyscale(side * PIXELS, side * PIXELS, |x, y| {
                if dark[y / PIXELS * side + x / PIXELS] { 0 } else { 255 }
            });
        let grids = image.detect_grids();
        let [grid] = &grids[..] else { panic!("{} codes", grids.len()) };
        grid.decode().expect("a code that can be read").1
    }

    #[test]
    fn a_reader_finds_the_link_in_the_drawing() {
        let room = "http://192.168.1.20:8080/swift-otter";
        for link in [room.to_owned(), format!("{room}#scene={}", "aZ-_09".repeat(270))] {
            let drawing = draw(&link).expect("it fits");
            assert_eq!(read(&drawing), link);
        }
    }

    #[test]
    fn light_squares_are_around_it() {
        let drawing = draw("http://localhost/x").expect("it fits");
        let is_inside = |at: i32| (QUIET..drawing.side - QUIET).contains(&at);
        for run in drawing.path.split_terminator('z') {
            let (at, width) = run[1..].split_once('h').expect("a run");
            let (x, y) = at.split_once(' ').expect("a point");
            let width = width.split_once('v').expect("a width").0;
            let [x, y, width] = [x, y, width].map(|digits| digits.parse().expect("digits"));
            assert!(is_inside(x) && is_inside(y) && is_inside(x + width - 1), "{run}");
        }
    }

    #[test]
    fn a_longer_link_has_no_code() {
        assert!(draw(&"x".repeat(1732)).is_some_and(|drawing| drawing.side == 137 + 2 * QUIET));
        assert!(draw(&"x".repeat(1733)).is_none());
    }
}
