//! Adaptive resolution, which draws fewer pixels if the machine cannot draw all of them in time. A reduction that does
//! not help is reverted, because the bottleneck must be elsewhere.

/// Shares of the full resolution, from sharpest to fastest.
const STEPS: [f64; 3] = [1.0, 0.75, 0.5];
/// Average frame time above which drawing is too slow, milliseconds.
const SLOW_MS: f64 = 34.0;
/// The time over which frames are averaged, milliseconds.
const WINDOW_MS: f64 = 1500.0;
/// Maximum time between frames that is counted, milliseconds. Longer gaps come from a hidden page or a hiccup.
const PAUSE_MS: f64 = 250.0;
/// A reduction is kept only if it shortens the frame time to this share.
const GAIN: f64 = 0.85;

/// Chooses the resolution from the measured frame times.
#[derive(Debug, Default)]
pub struct Quality {
    step: usize,
    settled: bool,
    last_ms: Option<f64>,
    total_ms: f64,
    frames: u32,
    /// Mean frame time before the most recent reduction.
    before_ms: Option<f64>,
}

impl Quality {
    /// Records that a frame begins at `now_ms`; returns the share of the full resolution for it.
    pub fn frame(&mut self, now_ms: f64) -> f64 {
        let pause = self.last_ms.replace(now_ms).map(|last| now_ms - last);
        if let Some(elapsed) = pause.filter(|elapsed| *elapsed < PAUSE_MS) {
            self.total_ms += elapsed;
            self.frames += 1;
        }
        if self.total_ms >= WINDOW_MS && !self.settled {
            self.judge(self.total_ms / f64::from(self.frames));
            (self.total_ms, self.frames) = (0.0, 0);
        }
        STEPS[self.step]
    }

    fn judge(&mut self, mean_ms: f64) {
        if self.before_ms.is_some_and(|before| mean_ms > before * GAIN) {
            self.step -= 1;
            self.settled = true;
            return;
        }
        self.before_ms = None;
        if mean_ms > SLOW_MS && self.step + 1 < STEPS.len() {
            self.before_ms = Some(mean_ms);
            self.step += 1;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Draws for ten seconds on a machine with frame times given by `frame_ms(share)`.
    fn settle(frame_ms: impl Fn(f64) -> f64) -> f64 {
        let mut quality = Quality::default();
        let (mut now, mut share) = (0.0, 1.0);
        while now < 10_000.0 {
            share = quality.frame(now);
            now += frame_ms(share);
        }
        share
    }

    #[test]
    fn a_fast_machine_draws_all_pixels() {
        assert_eq!(settle(|_| 16.7), 1.0);
    }

    #[test]
    fn a_slow_screen_gets_fewer_pixels_until_it_keeps_up() {
        assert_eq!(settle(|share| 5.0 + 45.0 * share * share), 0.75);
        assert_eq!(settle(|share| 5.0 + 180.0 * share * share), 0.5);
    }

    #[test]
    fn pixels_are_not_given_up_for_nothing() {
        assert_eq!(settle(|_| 60.0), 1.0);
    }

    #[test]
    fn a_hidden_page_is_not_slow() {
        let mut quality = Quality::default();
        for second in 0..60 {
            assert_eq!(quality.frame(f64::from(second) * 1000.0), 1.0);
        }
    }
}
