//! The page's files, embedded from `client-web/dist` by `build.rs`.

/// One embedded file.
pub struct File {
    /// Path below `dist`, like `sprites/hero.png`.
    pub name: &'static str,
    /// Content hash in quotes, as the header wants it.
    pub etag: &'static str,
    /// Content.
    pub bytes: &'static [u8],
}

include!(concat!(env!("OUT_DIR"), "/files.rs"));

/// Served instead of the page while there is none.
pub const NOT_BUILT: &str = include_str!("not_built.html");

/// The file of this name. Names are only compared, so no name leads anywhere else.
pub fn find(name: &str) -> Option<&'static File> {
    FILES.binary_search_by(|file| file.name.cmp(name)).ok().map(|index| &FILES[index])
}

/// The brotli variant of a file, if the build made one.
pub fn find_brotli(name: &str) -> Option<&'static File> {
    find(&format!("{name}.br"))
}

/// Content type by extension. Everything that is text is UTF-8.
pub fn content_type(name: &str) -> &'static str {
    let extension = name.rsplit_once('.').map_or("", |(_, extension)| extension);
    match extension {
        "css" => "text/css; charset=utf-8",
        "html" => "text/html; charset=utf-8",
        "ico" => "image/x-icon",
        "jpg" | "jpeg" => "image/jpeg",
        "js" | "mjs" => "text/javascript; charset=utf-8",
        "json" => "application/json",
        "mp3" => "audio/mpeg",
        "ogg" => "audio/ogg",
        "png" => "image/png",
        "svg" => "image/svg+xml",
        "toml" | "txt" => "text/plain; charset=utf-8",
        "wasm" => "application/wasm",
        "wav" => "audio/wav",
        "webmanifest" => "application/manifest+json",
        "webp" => "image/webp",
        "woff2" => "font/woff2",
        _ => "application/octet-stream",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_table_is_sorted_so_that_every_file_is_found() {
        for file in FILES {
            assert!(find(file.name).is_some_and(|found| found.etag == file.etag), "{}", file.name);
        }
        assert!(find("../Cargo.toml").is_none());
    }

    #[test]
    fn browsers_get_the_types_that_they_insist_on() {
        assert_eq!(content_type("client_bg.wasm"), "application/wasm");
        assert_eq!(content_type("client.js"), "text/javascript; charset=utf-8");
        assert_eq!(content_type("no-extension"), "application/octet-stream");
    }
}
