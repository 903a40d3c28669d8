use super::*;

/// Fourth-order Runge-Kutta for a pair (x, v), independent of the closed-form solutions.
fn integrate(acceleration: impl Fn(f64) -> f64, mut x: f64, mut v: f64, t: f64) -> (f64, f64) {
    let steps = 4000;
    let h = t / f64::from(steps);
    for _ in 0..steps {
        let a1 = acceleration(v);
        let a2 = acceleration(v + a1 * h / 2.0);
        let a3 = acceleration(v + a2 * h / 2.0);
        let a4 = acceleration(v + a3 * h);
        x += h * (v + h * (a1 + a2 + a3) / 6.0);
        v += h * (a1 + 2.0 * a2 + 2.0 * a3 + a4) / 6.0;
    }
    (x, v)
}

#[track_caller]
fn close(found: f64, expected: f64, tolerance: f64) {
    assert!((found - expected).abs() <= tolerance, "{found} is not {expected} +- {tolerance}");
}

#[test]
fn drags_agree_with_runge_kutta_and_with_each_other_where_drag_vanishes() {
    let (x, v) = integrate(|v| -50.0 - 2.0 * v, 0.0, 40.0, 3.0);
    let start = DVec2::ZERO;
    let (position, velocity) =
        linear_drag(start, DVec2::new(0.0, 40.0), DVec2::new(0.0, -50.0), 2.0, 3.0);
    close(position.y, x, 1e-9);
    close(velocity.y, v, 1e-9);
    let (x, v) = integrate(|v| 50.0 - 0.05 * v * v, 0.0, 0.0, 3.0);
    let (way, speed) = quadratic_fall(50.0, 0.05, 3.0);
    close(way, x, 1e-8);
    close(speed, v, 1e-8);
    let free = flight(start, DVec2::X, DVec2::NEG_Y, 2.0);
    let slow = linear_drag(start, DVec2::X, DVec2::NEG_Y, 1e-4, 2.0).0;
    close(slow.distance(free), 0.0, 1e-3);
    close(quadratic_fall(1.0, 1e-8, 2.0).0, 2.0, 1e-6);
}

#[test]
fn a_ball_bounces_at_the_right_times_and_heights() {
    let first = (2.0 * 20.0 / 50.0f64).sqrt();
    close(bounce(20.0, 50.0, 0.5, first), 0.0, 1e-9);
    // The next peak is at a time e t1 later and at a height of e^2 h.
    close(bounce(20.0, 50.0, 0.5, first * 1.5), 5.0, 1e-9);
    close(bounce(20.0, 50.0, 1.0, first * 6.0), 20.0, 1e-9);
    // Zeno: t1 + 2 t1 e / (1 - e) = 3 t1 for e = 1/2.
    close(bounce(20.0, 50.0, 0.5, first * 3.001), 0.0, 1e-9);
    assert!(bounce(20.0, 50.0, 0.5, first * 2.9) > 0.0);
}

#[test]
fn a_slide_stops_at_v2_over_2a() {
    close(slide(20.0, 15.0, 9.0), 400.0 / 30.0, 1e-12);
    close(slide(20.0, 15.0, 1.0), 12.5, 1e-12);
}

#[test]
fn collisions_keep_momentum_and_the_law_of_restitution() {
    let normal = DVec2::new(0.6, 0.8);
    let (masses, before) = ([3.0, 0.5], [DVec2::new(4.0, 1.0), DVec2::new(-2.0, 0.5)]);
    for (restitution, friction) in [(0.0, 0.0), (1.0, 0.0), (0.5, 0.3), (0.9, 10.0)] {
        let after = collision(masses, before, normal, restitution, friction);
        let momentum = |v: [DVec2; 2]| v[0] * masses[0] + v[1] * masses[1];
        close(momentum(after).distance(momentum(before)), 0.0, 1e-12);
        let normal_velocity = |v: [DVec2; 2]| (v[1] - v[0]).dot(normal);
        close(normal_velocity(after), -restitution * normal_velocity(before), 1e-12);
    }
    let apart = [DVec2::NEG_X, DVec2::X];
    assert_eq!(collision(masses, apart, DVec2::X, 1.0, 1.0), apart);
}
