//! Texts of the page without what browsers do not need.

/// A script, a style sheet or a document without its comments (but for those of HTML) and indents. Comments begin lines, and
/// strings and preformatted text hold no newline.
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

/// A style sheet without the spaces and line ends that it does not need. Its strings hold neither a colon nor a brace
/// beside a space.
pub fn squeezed(style: &str) -> String {
    let mut squeezed = style.replace(": ", ":").replace(" {", "{");
    for end in ["{", "}", ";"] {
        squeezed = squeezed.replace(&format!("{end}\n"), end);
    }
    squeezed
}
