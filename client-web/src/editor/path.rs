//! Paths of bodies: made, and their points added and removed.

use super::edit::{Splice, apply, item_bytes};
use super::field::{self, Spot};
use super::number::{DECIMALS_MAX, rounded};
use super::state::{Editor, path_of};
use super::strings;
use super::text::{List, Piece, PieceId, Place, vector};
use jostle_sim::Vec2;

/// Half the length of a new path, steps of the world.
const REACH: f32 = 30.0;
/// Seconds there and back.
const PERIOD: &str = "4";

/// A leg of a piece's path: the piece, and the number of the leg's first point.
pub type Leg = (PieceId, usize);

impl Editor {
    /// The selected body, if it is one alone and may have a path.
    fn path_body(&self) -> Option<&Piece> {
        let [id] = self.selection[..] else { return None };
        let piece = self.sheet.piece(id).filter(|piece| piece.stuck.is_none() && self.is_toml)?;
        let has_place = matches!(piece.place, Some(Place::Center(_) | Place::Path(_)));
        (id.list == List::Bodies && has_place).then_some(piece)
    }

    /// The words of the button that makes a path, or adds a point to it.
    pub fn path_offer(&self) -> Option<&'static str> {
        let piece = self.path_body()?;
        Some(if path_of(piece).is_empty() { strings::ADD_PATH } else { strings::ADD_POINT })
    }

    /// Gives the selected body a path, or a further point in the middle of the longest leg.
    pub(super) fn extend_path(&mut self) {
        let Some(piece) = self.path_body() else { return };
        let points: Vec<Vec2> = path_of(piece).iter().map(vector).collect();
        let length = |leg: usize| (points[leg + 1] - points[leg]).length();
        let legs = 0..points.len().saturating_sub(1);
        match legs.max_by(|a, b| length(*a).total_cmp(&length(*b))) {
            Some(leg) => {
                let middle = self.on_unit((points[leg] + points[leg + 1]) * 0.5);
                self.add_point((piece.id, leg), middle);
            }
            None => {
                if let Some(text) = with_path(&self.text, piece, REACH * self.unit()) {
                    self.commit(text);
                }
            }
        }
    }

    /// Adds a point within a leg.
    pub(super) fn add_point(&mut self, (id, leg): Leg, at: Vec2) {
        let point = format!("{}.path[{leg}]", id.path());
        let Some(Spot::There { value, .. }) = field::find(&self.text, &point) else { return };
        let [x, y] = at.to_array().map(|part| rounded(part, DECIMALS_MAX - 1));
        self.change(vec![Splice::insert(value.end, format!(", [{x}, {y}]"))]);
    }

    /// Removes a point of the selected body's path; the last two stay.
    pub(super) fn remove_point(&mut self, index: usize) {
        let piece = self.path_body().filter(|piece| path_of(piece).len() > 2);
        let Some(piece) = piece else { return };
        let point = format!("{}.path[{index}]", piece.id.path());
        let Some(Spot::There { value, .. }) = field::find(&self.text, &point) else { return };
        self.change(vec![Splice::remove(item_bytes(&self.text, &value))]);
    }

    /// The leg of a path at a point.
    pub(super) fn leg_at(&self, at: Vec2, reach: f32) -> Option<Leg> {
        let legs = self.sheet.pieces.iter().flat_map(|piece| {
            let ends = path_of(piece).windows(2).enumerate();
            ends.map(|(leg, ends)| {
                let [from, to] = [vector(&ends[0]), vector(&ends[1])];
                let way = to - from;
                let share = (at - from).dot(way) / way.length_squared().max(f32::MIN_POSITIVE);
                let away = (at - from - way * share.clamp(0.0, 1.0)).length();
                (away, (piece.id, leg))
            })
        });
        let near = legs.filter(|(away, _)| *away <= 0.5 * reach);
        near.min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, leg)| leg)
    }
}

/// The text in which a body goes to and fro where it stood. Fields that a path decides go.
fn with_path(text: &str, piece: &Piece, reach: f32) -> Option<String> {
    let Some(Place::Center([x, y])) = &piece.place else { return None };
    let id = piece.id.path();
    let Spot::There { value, .. } = field::find(text, &format!("{id}.position"))? else {
        return None;
    };
    let key = text[..value.start].rfind("position")?;
    let [low, high] = [-reach, reach].map(|by| rounded(x.value + by, DECIMALS_MAX - 1));
    let y = &text[y.at.clone()];
    let splices = vec![
        Splice { at: key..key + "position".len(), with: "path".to_owned() },
        Splice { at: value, with: format!("[[{low}, {y}], [{high}, {y}]]") },
    ];
    let mut text = apply(text, splices);
    for decided in ["velocity", "motion"] {
        if let Some(splice) = field::unset(&text, &format!("{id}.{decided}")) {
            text = apply(&text, vec![splice]);
        }
    }
    let period = field::set(&text, &format!("{id}.period"), PERIOD)?;
    Some(apply(&text, vec![period]))
}
