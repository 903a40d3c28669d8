//! Marks of the displayed moment: those without a lamp, and those that one shines on.

use super::Replica;
use crate::net::timeline::Sample;
use crate::view::frame::{FrameLamp, FrameMark};
use jostle_sim::Vec2;

impl Replica {
    /// Lists the lamps, and the marks that are to be seen.
    pub(super) fn lay_out_marks(&mut self) {
        let (mut marks, mut lamps) =
            (std::mem::take(&mut self.marks), std::mem::take(&mut self.lamps));
        marks.clear();
        lamps.clear();
        for mark in &self.scene.marks {
            let light = match mark.lamp {
                None => 1.0,
                Some(lamp) => {
                    let Some(center) = self.find_placed(lamp) else { continue };
                    let lamp = FrameLamp { center, reach: mark.reach };
                    if !lamps.contains(&lamp) {
                        lamps.push(lamp);
                    }
                    1.0 - center.distance(mark.position) / mark.reach
                }
            };
            if light > 0.0 {
                // Bright well before the lamp is there.
                let light = (2.0 * light).min(1.0);
                let (center, dots, size) = (mark.position, mark.dots, mark.size);
                marks.push(FrameMark { center, dots, size, light });
            }
        }
        (self.marks, self.lamps) = (marks, lamps);
    }

    /// Where a body of the scene is. Snapshots do not say which body of the file one is: the first that
    /// looks like it.
    pub(super) fn find_placed(&self, body: usize) -> Option<Vec2> {
        let placed = &self.scene.bodies[body];
        let is_it = |sample: &&Sample| {
            (sample.kind, sample.group, sample.shape)
                == (placed.kind, placed.def.group, placed.def.shape)
        };
        self.samples.iter().find(is_it).map(|sample| sample.center)
    }
}
