//! A page's files. The default page is in `client-web/dist`; optimised builds embed it through `build.rs`, and debug
//! builds read it at first use.

#[cfg(page_on_disk)]
use super::dist;

#[derive(Debug)]
pub struct AssetFile {
    /// Path relative to `dist`, such as `sprites/hero.png`.
    pub name: &'static str,
    /// Content hash in quotes, as it appears in the ETag header.
    pub etag: &'static str,
    pub bytes: &'static [u8],
}

#[cfg(not(page_on_disk))]
include!(concat!(env!("OUT_DIR"), "/files.rs"));

/// All files of `client-web/dist`, sorted by name; empty if the page has not been built.
#[cfg(not(page_on_disk))]
pub fn files() -> &'static [AssetFile] {
    EMBEDDED
}

/// All files of `client-web/dist` at the time of the first call, sorted by name; empty if the page has not been built.
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

/// Served instead of the page if the page has not been built.
pub const NOT_BUILT: &str = include_str!("not_built.html");

/// Finds the file with this name in `files`, which are sorted. Names are only compared, so that no name can escape the
/// directory.
pub fn find(files: &'static [AssetFile], name: &str) -> Option<&'static AssetFile> {
    files.binary_search_by(|file| file.name.cmp(name)).ok().map(|index| &files[index])
}

/// The version that precedes file names in this build's addresses.
pub fn version(files: &'static [AssetFile]) -> Option<&'static str> {
    std::str::from_utf8(find(files, "version.txt")?.bytes).ok()
}

/// A file's address. If it contains a version, browsers may cache the file permanently; otherwise they must revalidate
/// it each time.
pub fn address(files: &'static [AssetFile], file: &AssetFile) -> String {
    let version = version(files).map_or(String::new(), |version| format!("{version}/"));
    format!("/assets/{version}{}", file.name)
}

/// Finds a file's brotli variant, if there is one.
pub fn find_brotli(files: &'static [AssetFile], name: &str) -> Option<&'static AssetFile> {
    find(files, &format!("{name}.br"))
}

/// The content type for an extension, covering the kinds of files that the page consists of. All text is UTF-8.
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
