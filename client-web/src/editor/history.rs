//! The edit history of a text, with unlimited undo and redo.

use std::ops::Range;

/// Maximum pause in typing before a new history entry starts, milliseconds.
const PAUSE_MS: f64 = 1000.0;

/// One step: the text at a byte offset before and after the change.
#[derive(Clone, Debug, PartialEq, Eq)]
struct EditStep {
    at: usize,
    before: String,
    after: String,
}

/// The steps that undo and redo every change.
#[derive(Clone, Debug, Default)]
pub struct History {
    done: Vec<EditStep>,
    undone: Vec<EditStep>,
    /// The time of the last step, if it was typed.
    typed_ms: Option<f64>,
}

impl EditStep {
    /// The difference between two texts; `None` if they are equal.
    fn between(before: &str, after: &str) -> Option<EditStep> {
        if before == after {
            return None;
        }
        let same = before.bytes().zip(after.bytes()).take_while(|(a, b)| a == b).count();
        let start = floor(before, after, same);
        let rest = before.len().min(after.len()) - start;
        let ends = before.bytes().rev().zip(after.bytes().rev()).take(rest);
        let mut tail = ends.take_while(|(a, b)| a == b).count();
        while !before.is_char_boundary(before.len() - tail)
            || !after.is_char_boundary(after.len() - tail)
        {
            tail -= 1;
        }
        Some(EditStep {
            at: start,
            before: before[start..before.len() - tail].to_owned(),
            after: after[start..after.len() - tail].to_owned(),
        })
    }

    fn undo(&self, text: &mut String) -> Range<usize> {
        text.replace_range(self.at..self.at + self.after.len(), &self.before);
        self.at..self.at + self.before.len()
    }

    fn redo(&self, text: &mut String) -> Range<usize> {
        text.replace_range(self.at..self.at + self.before.len(), &self.after);
        self.at..self.at + self.after.len()
    }
}

/// The bytes of a text that differ from the text before.
pub fn changed(before: &str, after: &str) -> Range<usize> {
    EditStep::between(before, after).map_or(0..0, |step| step.at..step.at + step.after.len())
}

/// The last offset up to `same` that is a character boundary in both texts.
fn floor(before: &str, after: &str, mut same: usize) -> usize {
    while !before.is_char_boundary(same) || !after.is_char_boundary(same) {
        same -= 1;
    }
    same
}

impl History {
    /// Records that `before` became `after` in one step.
    pub fn note(&mut self, before: &str, after: &str) {
        if let Some(step) = EditStep::between(before, after) {
            self.done.push(step);
            self.undone.clear();
            self.typed_ms = None;
        }
    }

    /// Replaces the last step with one from `before` to `after`.
    pub fn note_again(&mut self, before: &str, after: &str) {
        self.done.pop();
        self.note(before, after);
    }

    /// Records a change made by typing. Letters of one word typed without a pause form one step.
    pub fn note_typed(&mut self, before: &str, after: &str, now_ms: f64) {
        let Some(step) = EditStep::between(before, after) else { return };
        self.undone.clear();
        let went_on = self.typed_ms.is_some_and(|typed| now_ms - typed <= PAUSE_MS);
        self.typed_ms = Some(now_ms);
        if let Some(last) = self.done.last_mut().filter(|_| went_on)
            && step.before.is_empty()
            && step.at == last.at + last.after.len()
            && !begins_word(&last.after, &step.after)
        {
            last.after.push_str(&step.after);
            return;
        }
        if let Some(last) = self.done.last_mut().filter(|_| went_on)
            && step.after.is_empty()
            && last.after.is_empty()
            && step.at + step.before.len() == last.at
        {
            last.before.insert_str(0, &step.before);
            last.at = step.at;
            return;
        }
        self.done.push(step);
    }

    /// Undoes the last step and returns the changed bytes.
    pub fn undo(&mut self, text: &mut String) -> Option<Range<usize>> {
        let step = self.done.pop()?;
        let changed = step.undo(text);
        self.undone.push(step);
        self.typed_ms = None;
        Some(changed)
    }

    /// Redoes the last undone step and returns the changed bytes.
    pub fn redo(&mut self, text: &mut String) -> Option<Range<usize>> {
        let step = self.undone.pop()?;
        let changed = step.redo(text);
        self.done.push(step);
        self.typed_ms = None;
        Some(changed)
    }

    /// Whether undo and redo are possible, in this order.
    pub fn can(&self) -> [bool; 2] {
        [!self.done.is_empty(), !self.undone.is_empty()]
    }
}

/// Whether the newly typed text starts a new word after the previously typed text.
fn begins_word(before: &str, now: &str) -> bool {
    let blank = |letter: Option<char>| letter.is_some_and(char::is_whitespace);
    blank(before.chars().next_back()) && !blank(now.chars().next())
}
