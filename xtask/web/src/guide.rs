//! The guide to scene files as a page, to which the editor's form links.

/// The document around the guide. The page's files are all in one folder.
const HEAD: &str = "<!doctype html>\n<html lang=\"en\">\n<meta charset=\"utf-8\">\n\
    <meta name=\"viewport\" content=\"width=device-width\">\n<title>Scene files</title>\n\
    <link rel=\"stylesheet\" href=\"palette.css\">\n<link rel=\"stylesheet\" href=\"guide.css\">\n<main>\n";

/// Turns the Markdown of the guide into a page: headings, paragraphs, lists, tables and code.
pub fn page(markdown: &str) -> String {
    let mut page = HEAD.to_owned();
    let mut headings = Vec::new();
    let mut lines = markdown.lines().peekable();
    while let Some(line) = lines.next() {
        if line.is_empty() || line.starts_with("<!--") {
            continue;
        }
        if line.starts_with("```") {
            let code: Vec<String> =
                lines.by_ref().take_while(|line| !line.starts_with("```")).map(escaped).collect();
            page += &format!("<pre>{}</pre>\n", code.join("\n"));
        } else if let Some((marks, heading)) =
            line.split_once("# ").filter(|_| line.starts_with('#'))
        {
            let level = marks.len() + 1;
            let id = link_to(heading, &mut headings);
            page += &format!("<h{level} id=\"{id}\">{}</h{level}>\n", inline(heading));
        } else {
            // A paragraph, a list or a table ends at an empty line or a comment.
            let mut block = vec![line];
            while let Some(next) =
                lines.next_if(|line| !line.is_empty() && !line.starts_with("<!--"))
            {
                block.push(next);
            }
            page += &match line.as_bytes()[0] {
                b'|' => table(&block),
                b'-' => list(&block),
                _ => format!("<p>{}</p>\n", inline(&block.join(" "))),
            };
        }
    }
    page + "</main>\n"
}

/// The id of a heading: its letters, digits and dashes, and a number if an earlier heading has the same.
fn link_to(heading: &str, headings: &mut Vec<String>) -> String {
    let kept = |c: &char| c.is_alphanumeric() || matches!(c, ' ' | '-' | '_');
    let link = heading.to_lowercase().chars().filter(kept).collect::<String>().replace(' ', "-");
    let numbered = (1..).map(|number| format!("{link}-{number}"));
    let free = std::iter::once(link.clone()).chain(numbered).find(|link| !headings.contains(link));
    headings.extend(free.clone());
    free.unwrap_or(link)
}

fn table(lines: &[&str]) -> String {
    let row = |(number, line): (usize, &&str)| {
        let cell = if number == 0 { "th" } else { "td" };
        let cells = line.trim_matches('|').split(" | ");
        let cells = cells.map(|text| format!("<{cell}>{}</{cell}>", inline(text.trim())));
        format!("<tr>{}</tr>\n", cells.collect::<String>())
    };
    let rows = lines.iter().filter(|line| !line.starts_with("| ---")).enumerate();
    format!("<div><table>\n{}</table></div>\n", rows.map(row).collect::<String>())
}

fn list(lines: &[&str]) -> String {
    let text = lines.iter().map(|line| match line.strip_prefix("- ") {
        Some(item) => format!("\n{item}"),
        None => format!(" {}", line.trim()),
    });
    let text: String = text.collect();
    let items = text.trim_start().lines().map(|item| format!("<li>{}</li>\n", inline(item)));
    format!("<ul>\n{}</ul>\n", items.collect::<String>())
}

/// Text with code, links and bold words.
fn inline(text: &str) -> String {
    let parts = text.split('`').enumerate().map(|(number, part)| match number % 2 {
        0 => part.to_owned(),
        _ => format!("<code>{}</code>", escaped(part)),
    });
    let text = linked(&parts.collect::<String>());
    let bold = text.split("**").enumerate().map(|(number, part)| match number % 2 {
        0 => part.to_owned(),
        _ => format!("<b>{part}</b>"),
    });
    bold.collect()
}

/// Links within the guide, and to other sites. The other documents are not part of the page.
fn linked(text: &str) -> String {
    let mut out = String::new();
    let mut rest = text;
    while let Some((before, after)) = rest.split_once("](") {
        let (Some((start, name)), Some((target, end))) =
            (before.rsplit_once('['), after.split_once(')'))
        else {
            break;
        };
        out += start;
        out += &match target.starts_with('#') || target.starts_with("https:") {
            true => format!("<a href=\"{target}\">{name}</a>"),
            false => name.to_owned(),
        };
        rest = end;
    }
    out + rest
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;")
}

#[cfg(test)]
mod tests {
    use super::page;

    #[test]
    fn a_guide_becomes_a_page() {
        let guide = "# Files\n\nSee [the list](#a-list), *x*\nand [others](b.md).\n\n<!-- fields -->\n\
                     | `a` | b |\n| --- | --- |\n| `[[x, y]]` | **1 < 2** |\n<!-- end -->\n\n\
                     ## A list\n\n- One\n  more\n- `Two`\n\n```\n# <code>\n```\n## A list\n";
        let body = "<h2 id=\"files\">Files</h2>\n<p>See <a href=\"#a-list\">the list</a>, *x* and others.</p>\n\
                    <div><table>\n<tr><th><code>a</code></th><th>b</th></tr>\n\
                    <tr><td><code>[[x, y]]</code></td><td><b>1 < 2</b></td></tr>\n</table></div>\n\
                    <h3 id=\"a-list\">A list</h3>\n<ul>\n<li>One more</li>\n<li><code>Two</code></li>\n</ul>\n\
                    <pre># &lt;code></pre>\n<h3 id=\"a-list-1\">A list</h3>\n</main>\n";
        let page = page(guide);
        assert_eq!(page.split_once("<main>\n").map(|(_, body)| body), Some(body));
    }

    #[test]
    fn each_field_of_the_form_is_described_in_the_section_that_it_links_to() {
        let page = page(include_str!("../../../docs/scenes.md"));
        for line in include_str!("../../../client-web/web/fields.txt").lines() {
            let mut parts = line.split('\t');
            let (paths, section) = (parts.next().unwrap_or(""), parts.next().unwrap_or(""));
            let after = page.split_once(&format!(" id=\"{section}\">")).map(|(_, after)| after);
            let body = after.and_then(|after| after.split("<h").next()).unwrap_or("");
            let key = paths.rsplit('.').next().unwrap_or("");
            assert!(body.contains(&format!("<td><code>{key}</code></td>")), "{paths} in {section}");
        }
    }
}
