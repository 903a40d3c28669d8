//! The newest lines of news.

use crate::world::replica::News;
use std::collections::VecDeque;

const LINES_MAX: usize = 6;

/// The newest news, the oldest first.
#[derive(Debug, Default)]
pub struct NewsLog {
    /// The lines, numbered from 1.
    pub lines: VecDeque<(usize, News)>,
}

impl NewsLog {
    pub fn push(&mut self, news: News) {
        let number = self.lines.back().map_or(1, |newest| newest.0 + 1);
        if self.lines.len() == LINES_MAX {
            self.lines.pop_front();
        }
        self.lines.push_back((number, news));
    }
}
