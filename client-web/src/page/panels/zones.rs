//! Labels of zones over the canvas.

use crate::language::say;
use crate::page::app::App;
use crate::page::panels::players::color_var;
use crate::page::round::capital;
use crate::page::view::View;
use crate::view::frame::{self, ZoneLabel};
use jostle_sim::Vec2;

/// Minimum height of a zone whose label is at its upper edge instead of its centre, CSS pixels.
const ROOMY_CSS: f32 = 56.0;

/// The labels of all labelled zones, for a picture of this scale.
pub fn view(app: &App, view: &frame::View, css_per_pixel: f32) -> View {
    let labels =
        app.screen.pictured_replica().map(|replica| replica.picture.zone_labels(&replica.room));
    let items = labels.into_iter().flatten().enumerate().map(|(index, label)| {
        let ZoneLabel { text, center, half, color } = label;
        let [upper, lower] =
            [half.y, -half.y].map(|y| view.to_pixel(center + Vec2::new(0.0, y)) * css_per_pixel);
        let is_roomy = lower.y - upper.y >= ROOMY_CSS;
        let (at, up) =
            if is_roomy { (upper.y, "4px") } else { ((upper.y + lower.y) * 0.5, "-50%") };
        let transform = format!("translate({}px, {at}px) translate(-50%, {up})", upper.x);
        View::item("zone-item", index)
            .text("", capital(say(&text)))
            .style("", "transform", transform)
            .style("", "--color", color.map_or("var(--paper-1)".to_owned(), color_var))
    });
    View::panel("zones").list("#zone-labels", items)
}
