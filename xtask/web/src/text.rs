//! Strips the page's text files of parts that browsers do not need.

/// Removes comments, except HTML ones, and indentation from a script, a style sheet or a document. Comments must start
/// at the beginning of a line, and strings and preformatted text must not contain newlines.
pub fn without_comments(text: &str) -> String {
    let mut kept = String::with_capacity(text.len());
    let mut in_comment = false;
    for mut line in text.lines().map(str::trim) {
        in_comment |= line.starts_with("/*");
        if in_comment {
            let after = line.split_once("*/").map(|(_, after)| after.trim_start());
            in_comment = after.is_none();
            line = after.unwrap_or_default();
        }
        if !line.is_empty() && !line.starts_with("//") {
            kept.push_str(line);
            kept.push('\n');
        }
    }
    kept
}

/// Removes unnecessary spaces and newlines from a style sheet. Its strings must not contain a colon or brace next to a
/// space.
pub fn squeezed(style: &str) -> String {
    let mut squeezed = style.replace(": ", ":").replace(" {", "{");
    for end in ["{", "}", ";"] {
        squeezed = squeezed.replace(&format!("{end}\n"), end);
    }
    squeezed
}
