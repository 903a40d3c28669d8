//! The files of a page. Those of the usual one come from `client-web/dist`: optimised builds embed them, by
//! `build.rs`, and debug builds read them at their first use.

#[cfg(page_on_disk)]
use super::dist;

#[derive(Debug)]
pub struct AssetFile {
    /// Path below `dist`, like `sprites/hero.png`.
    pub name: &'static str,
    /// Content hash in quotes, as in the ETag header.
    pub etag: &'static str,
    pub bytes: &'static [u8],
}

#[cfg(not(page_on_disk))]
include!(concat!(env!("OUT_DIR"), "/files.rs"));

/// Every file of `client-web/dist`, sorted by name; none before the page was built.
#[cfg(not(page_on_disk))]
pub fn files() -> &'static [AssetFile] {
    EMBEDDED
}

/// Every file of `client-web/dist` when this was first called, sorted by name; none before the page was built.
#[cfg(page_on_disk)]
pub fn files() -> &'static [AssetFile] {
    static FILES: std::sync::LazyLock<Vec<AssetFile>> = std::sync::LazyLock::new(|| {
        let dir = concat!(env!("CARGO_MANIFEST_DIR"), "/../client-web/dist");
        let found = dist::files(dir.as_ref()).unwrap_or_default();
        let read = |(name, path): (String, std::path::PathBuf)| {
            let bytes: &[u8] = std::fs::read(path).ok()?.leak();
            Some(AssetFile { name: name.leak(), etag: dist::etag(bytes).leak(), bytes })
        };
        found.into_iter().filter_map(read).collect()
    });
    &FILES
}

/// Served instead of the page while there is none.
pub const NOT_BUILT: &str = include_str!("not_built.html");

/// Finds the file of this name among `files`, which are sorted. Names are only compared, so no name leads
/// anywhere else.
pub fn find(files: &'static [AssetFile], name: &str) -> Option<&'static AssetFile> {
    files.binary_search_by(|file| file.name.cmp(name)).ok().map(|index| &files[index])
}

/// The word that stands before the names of files in the addresses of this build.
pub fn version(files: &'static [AssetFile]) -> Option<&'static str> {
    std::str::from_utf8(find(files, "version.txt")?.bytes).ok()
}

/// The address under which browsers keep a file for good, or have to ask again each time if the page has
/// no version.
pub fn address(files: &'static [AssetFile], file: &AssetFile) -> String {
    let version = version(files).map_or(String::new(), |version| format!("{version}/"));
    format!("/assets/{version}{}", file.name)
}

/// Finds the brotli variant of a file, if there is one.
pub fn find_brotli(files: &'static [AssetFile], name: &str) -> Option<&'static AssetFile> {
    find(files, &format!("{name}.br"))
}

/// Content type by extension, of the kinds of files that the page has. Everything that is text is UTF-8.
pub fn content_type(name: &str) -> &'static str {
    let extension = name.rsplit_once('.').map_or("", |(_, extension)| extension);
    match extension {
        "webp" => "image/webp",
        "css" => "text/css; charset=utf-8",
        "html" => "text/html; charset=utf-8",
        "js" => "text/javascript; charset=utf-8",
        "json" => "application/json",
        "png" => "image/png",
        "svg" => "image/svg+xml",
        "txt" => "text/plain; charset=utf-8",
        "wasm" => "application/wasm",
        "webmanifest" => "application/manifest+json",
        _ => "application/octet-stream",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_table_is_sorted_so_that_every_file_is_found() {
        for file in files() {
            let found = find(files(), file.name);
            assert!(found.is_some_and(|found| found.etag == file.etag), "{}", file.name);
        }
        assert!(find(files(), "../Cargo.toml").is_none());
    }

    #[test]
    fn browsers_get_the_content_types_they_require() {
        assert_eq!(content_type("client_bg.wasm"), "application/wasm");
        assert_eq!(content_type("client.js"), "text/javascript; charset=utf-8");
        assert_eq!(content_type("manifest.webmanifest"), "application/manifest+json");
        assert_eq!(content_type("de.txt"), "text/plain; charset=utf-8");
        assert_eq!(content_type("no-extension"), "application/octet-stream");
    }
}
