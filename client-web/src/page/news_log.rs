//! The newest lines of news.

use crate::world::replica::News;
use std::collections::VecDeque;

/// Lines kept.
const LINES_MAX: usize = 6;

/// The newest news, the oldest first.
#[derive(Debug, Default)]
pub struct NewsLog {
    lines: VecDeque<News>,
    /// Lines ever added.
    added: usize,
}

impl NewsLog {
    /// Adds a line.
    pub fn push(&mut self, news: News) {
        if self.lines.len() == LINES_MAX {
            self.lines.pop_front();
        }
        self.lines.push_back(news);
        self.added += 1;
    }

    /// Lines ever added.
    pub fn added(&self) -> usize {
        self.added
    }

    /// The lines.
    pub fn lines(&self) -> impl Iterator<Item = &News> {
        self.lines.iter()
    }
}
