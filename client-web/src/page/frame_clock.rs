//! A clock that advances with every frame. To hide how fast a machine is, some browsers let their own clock advance in
//! steps of 100 ms, during which the picture would stand still.

/// Steps that are smoothed, milliseconds. Shorter ones are not seen, and longer ones are pauses of the page.
const STEP_MS: std::ops::RangeInclusive<f64> = 30.0..=300.0;
/// Fewest frames at the same time of a coarse clock. Other clocks give each frame a time of its own.
const FRAMES_MIN: u32 = 3;

#[derive(Debug, Default)]
pub struct FrameClock {
    /// The browser's time, and the number of frames since it last advanced.
    browser_ms: f64,
    frames: u32,
    /// Duration of a frame, milliseconds; 0 unless the browser's clock is coarse.
    frame_ms: f64,
    /// The number of frames in the last step.
    frames_max: u32,
    now_ms: f64,
}

impl FrameClock {
    /// The time of an event at the browser's time `browser_ms`.
    pub fn read(&mut self, browser_ms: f64, is_frame: bool) -> f64 {
        if browser_ms != self.browser_ms {
            let step = browser_ms - self.browser_ms;
            let is_coarse = self.frames >= FRAMES_MIN && STEP_MS.contains(&step);
            self.frame_ms = if is_coarse { step / f64::from(self.frames) } else { 0.0 };
            self.frames_max = self.frames;
            (self.browser_ms, self.frames) = (browser_ms, 0);
        }
        // The last frame of a step ends where the next step begins.
        let passed = f64::from(self.frames.min(self.frames_max)) * self.frame_ms;
        self.frames += u32::from(is_frame);
        self.now_ms = self.now_ms.max(browser_ms + passed);
        self.now_ms
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The times of frames at 60 Hz under a clock with steps of this length, in the fourth second.
    fn frames(step_ms: f64) -> Vec<f64> {
        let mut clock = FrameClock::default();
        let times = (0..240).map(|frame| (f64::from(frame) * 1000.0 / 60.0 / step_ms).floor());
        let times: Vec<f64> = times.map(|steps| clock.read(steps * step_ms, true)).collect();
        times[180..].to_vec()
    }

    #[test]
    fn a_coarse_clock_is_smoothed_and_others_are_left_alone() {
        for pair in frames(100.0).windows(2) {
            let passed = pair[1] - pair[0];
            assert!((12.0..21.0).contains(&passed), "{passed} ms");
        }
        for step_ms in [0.1, 1.0, 16.0] {
            for (index, time) in frames(step_ms).into_iter().enumerate() {
                let exact = (index + 180) as f64 * 1000.0 / 60.0;
                assert_eq!(time, (exact / step_ms).floor() * step_ms);
            }
        }
    }

    #[test]
    fn a_pause_is_no_coarse_clock_and_time_never_runs_back() {
        let mut clock = FrameClock::default();
        for time in [0.0, 16.0, 33.0, 233.0, 250.0] {
            assert_eq!(clock.read(time, true), time);
        }
        let mut last = 0.0;
        for frame in 0..100 {
            let now = clock.read(300.0 + f64::from(frame / (3 + frame % 4)) * 100.0, true);
            assert!(now >= last);
            last = now;
        }
    }
}
