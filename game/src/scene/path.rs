//! The path of a kinematic body, which moves back and forth between points. Its position depends only on the tick.

use glam::Vec2;
use jostle_sim::DT;
use jostle_sim::math::clamp_length;

/// Points that a kinematic body repeatedly visits from first to last and back.
#[derive(Clone, Debug, PartialEq)]
pub struct Path {
    points: Vec<Vec2>,
    /// Tick at which each point is reached on the way there, counted from 0.
    arrivals: Vec<u32>,
    phase_ticks: u32,
}

impl Path {
    /// Creates a path through at least two points, of which consecutive ones must differ. The body takes `half_ticks`
    /// from the first point to the last, and the same time to return. Every point is reached at a whole tick, so each
    /// leg needs at least one tick. At tick 0 the body is already `phase_ticks` along.
    pub fn new(points: Vec<Vec2>, half_ticks: u32, phase_ticks: u32) -> Path {
        assert!(points.len() >= 2, "a path needs two points");
        assert!(half_ticks as usize >= points.len() - 1, "a path needs a tick a leg");
        let lengths: Vec<f32> = points.windows(2).map(|leg| (leg[1] - leg[0]).length()).collect();
        let total: f32 = lengths.iter().sum();
        assert!(total > 0.0, "a path needs a length");
        let legs = lengths.len() as u32;
        let mut arrivals = vec![0];
        let mut covered = 0.0;
        for (index, length) in lengths.iter().enumerate() {
            covered += length;
            let exact = (half_ticks as f32 * (covered / total) + 0.5) as u32;
            let earliest = arrivals[index] + 1;
            let latest = half_ticks - (legs - 1 - index as u32);
            arrivals.push(exact.max(earliest).min(latest));
        }
        arrivals[lengths.len()] = half_ticks;
        Path { points, arrivals, phase_ticks }
    }

    /// Position of the body at the end of a tick.
    pub fn at(&self, tick: u32) -> Vec2 {
        let half = self.half_ticks();
        let in_period =
            ((u64::from(tick) + u64::from(self.phase_ticks)) % (2 * u64::from(half))) as u32;
        let elapsed = if in_period <= half { in_period } else { 2 * half - in_period };
        let leg = self.arrivals.partition_point(|&arrival| arrival <= elapsed).max(1) - 1;
        if leg + 1 == self.points.len() {
            return self.points[leg];
        }
        let (from, to) = (self.arrivals[leg], self.arrivals[leg + 1]);
        let share = (elapsed - from) as f32 / (to - from) as f32;
        self.points[leg] + (self.points[leg + 1] - self.points[leg]) * share
    }

    /// The velocity, units/s, that takes a body from `position` to where it should be on the path at the end of a
    /// tick. A body that a player has dragged off its path returns to it no faster than `speed_max`.
    pub fn velocity_to(&self, tick: u32, position: Vec2, speed_max: f32) -> Vec2 {
        clamp_length((self.at(tick) - position) / DT, speed_max)
    }

    /// Ticks from the first point to the last.
    pub fn half_ticks(&self) -> u32 {
        self.arrivals[self.arrivals.len() - 1]
    }

    /// The points in order.
    pub fn points(&self) -> &[Vec2] {
        &self.points
    }

    /// Speed on the fastest leg, units/s.
    pub fn speed_max(&self) -> f32 {
        let mut fastest = 0.0;
        for (leg, times) in self.points.windows(2).zip(self.arrivals.windows(2)) {
            let seconds = (times[1] - times[0]) as f32 * DT;
            fastest = jostle_sim::math::max(fastest, (leg[1] - leg[0]).length() / seconds);
        }
        fastest
    }
}
