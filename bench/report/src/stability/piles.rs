//! Cases with large mass ratios, towers between walls and honeycombs.

use super::watch::{Run, largest};
use super::{Case, Outcome, SLOP, Subject, outcome};
use crate::scene::{Body, Scene, Shape};
use crate::shape::overlaps;
use glam::DVec2;

const GRAVITY: f64 = 10.0;
const SECONDS: f64 = 20.0;

pub const CASES: [Case; 3] = [
    Case { id: "S6", title: "Heavy and light boxes in one stack", run: mixed },
    Case { id: "S7", title: "Large box on two small ones; pyramid with a heavy cap", run: capped },
    Case { id: "S9", title: "Column of discs between walls; honeycomb in a box", run: packed },
];

fn ground() -> Scene {
    let mut scene = Scene::new(GRAVITY);
    scene.floor(500.0, 0.3, 0.0);
    scene
}

fn block(x: f64, y: f64, mass: f64) -> Body {
    Body::new(Shape::rect(0.5, 0.5), x, y).of_mass(mass)
}

fn mixed(subject: &Subject) -> Outcome {
    outcome(|out| {
        let alternating: Vec<f64> =
            (0..50).map(|i| if i % 2 == 0 { 1.0 } else { 1000.0 }).collect();
        let mut under = vec![1.0; 10];
        under.push(1000.0);
        let stacks = [
            ("1:1000 in turns, 50", alternating),
            ("10 light under 1000", under),
            ("1 on 1000", vec![1000.0, 1.0]),
        ];
        for (variant, masses) in stacks {
            let mut scene = ground();
            for (row, mass) in masses.into_iter().enumerate() {
                scene.add(block(0.0, 0.5 + row as f64, mass));
            }
            let run = subject.watch(&scene, SECONDS)?;
            out.check(variant, "height lost, units", 2.0 * SLOP, run.loss());
            out.check(variant, "rms speed at the end, units/s", 1e-4, run.jitter());
            out.draw(variant, &run);
        }
        let error = momentum_error(subject)?;
        out.check("1000 thrown at 10 light, no gravity", "relative momentum error", 1e-6, error);
        Ok(())
    })
}

/// A heavy box hits a row of touching light ones; no other forces act.
fn momentum_error(subject: &Subject) -> Result<f64, String> {
    let mut scene = Scene::new(0.0);
    scene.add(block(-3.0, 0.0, 1000.0).moving(5.0, 0.0));
    for column in 0..10 {
        scene.add(block(f64::from(column), 0.0, 1.0));
    }
    let run = subject.watch(&scene, 2.0)?;
    let momenta =
        run.last.iter().zip(&scene.bodies).map(|(state, body)| state.velocity * body.mass);
    let sum: DVec2 = momenta.sum();
    Ok(sum.distance(DVec2::new(5000.0, 0.0)) / 5000.0)
}

fn capped(subject: &Subject) -> Outcome {
    outcome(|out| {
        let mut scene = ground();
        scene.add(block(-9.5, 0.5, 1.0));
        scene.add(block(9.5, 0.5, 1.0));
        scene.add(Body::new(Shape::rect(10.0, 10.0), 0.0, 11.0));
        judge(subject, out, "20 by 20 on two 1 by 1", &scene, 21.0)?;
        for cap in [100.0, 200.0, 300.0] {
            let mut scene = ground();
            for row in 0..10 {
                for k in 0..10 - row {
                    let x = (f64::from(k) - f64::from(9 - row) / 2.0) * 1.1;
                    let mass = if row == 9 { cap } else { 1.0 };
                    scene.add(block(x, 0.5 + f64::from(row), mass));
                }
            }
            judge(subject, out, &format!("pyramid of 10, cap {cap}"), &scene, 10.0)?;
        }
        Ok(())
    })
}

fn judge(
    subject: &Subject,
    out: &mut Outcome,
    variant: &str,
    scene: &Scene,
    height: f64,
) -> Result<(), String> {
    let run = subject.watch(scene, SECONDS)?;
    out.check(variant, "height lost, share", 0.01, run.loss() / height);
    out.check(variant, "settled after, s", 3.0, run.settled_s());
    out.check(variant, "largest displacement, units", 1.0, run.largest_shift());
    out.draw(variant, &run);
    Ok(())
}

fn packed(subject: &Subject) -> Outcome {
    outcome(|out| {
        let mut column = ground();
        for side in [-1.0, 1.0] {
            column.add(Body::fixed(Shape::rect(1.0, 100.0), side * 1.75, 100.0));
        }
        for row in 0..100 {
            let side = if row % 2 == 0 { -0.25 } else { 0.25 };
            let y = 0.5 + f64::from(row) * 0.75f64.sqrt();
            column.add(Body::new(Shape::Circle { radius: 0.5 }, side, y));
        }
        settle(out, "column of 100", &subject.watch(&column, SECONDS)?);
        let (columns, rows) = if subject.quick { (25, 20) } else { (50, 40) };
        let mut box_of = Scene::new(GRAVITY);
        box_of.contain(f64::from(columns) + 0.5, f64::from(rows) + 5.0, 0.3, 0.0);
        for row in 0..rows {
            for column in 0..columns {
                let shift = if row % 2 == 0 { 0.5 } else { 1.0 };
                let y = 0.5 + f64::from(row) * 0.75f64.sqrt();
                box_of.add(Body::new(Shape::Circle { radius: 0.5 }, f64::from(column) + shift, y));
            }
        }
        let run = subject.watch(&box_of, SECONDS)?;
        settle(out, &format!("honeycomb of {}", columns * rows), &run);
        out.draw("honeycomb", &run);
        Ok(())
    })
}

fn settle(out: &mut Outcome, variant: &str, run: &Run) {
    let mut depths = overlaps(&run.scene.bodies, &run.last);
    depths.sort_by(f64::total_cmp);
    let p99 = depths.get(depths.len() * 99 / 100).copied().unwrap_or(0.0);
    let lost = run.last.iter().any(|state| !state.position.is_finite());
    out.check(
        variant,
        "overlap at the end, 99 % of the pairs, units",
        2.0 * SLOP,
        if lost { f64::NAN } else { p99 },
    );
    out.check(variant, "deepest overlap ever, units", 0.025, run.deepest());
    out.check(variant, "rms speed at the end, units/s", 1e-3, run.jitter());
    out.check(variant, "settled after, s", 10.0, largest([run.settled_s()].into_iter()));
}
