//! Why a scene was refused.

/// Why a scene was refused. Displays as `file:line: field: found ..., allowed ...`.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{file}:{line}: {field}: found {found}; allowed: {allowed}")]
pub struct SceneError {
    /// File, or the name given by the caller.
    pub file: String,
    /// Line of the field, from 1.
    pub line: usize,
    /// Path of the field, like `bodies[3].radius`.
    pub field: String,
    /// Content of the file there.
    pub found: String,
    /// Contents that are allowed there.
    pub allowed: String,
}

/// The line of a byte of a text, from 1; of one past the end, the last line.
pub fn line_at(text: &[u8], at: usize) -> usize {
    1 + text.iter().take(at).filter(|&&byte| byte == b'\n').count()
}
