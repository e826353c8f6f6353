//! The page's files, inside the program: it works without a network, and the same sources make the same program.

use std::borrow::Cow;

use rust_embed::RustEmbed;

/// Everything below `host/page/site`.
#[derive(RustEmbed)]
#[folder = "page/site/"]
struct Site;

/// A file and its type, by its path on the server without the leading slash.
pub(super) fn file(path: &str) -> Option<(Cow<'static, [u8]>, &'static str)> {
    let path = if path.is_empty() { "index.html" } else { path };
    let kind = kind(path)?;
    Site::get(path).map(|file| (file.data, kind))
}

fn kind(path: &str) -> Option<&'static str> {
    match path.rsplit_once('.')?.1 {
        "html" => Some("text/html; charset=utf-8"),
        "js" => Some("text/javascript; charset=utf-8"),
        "css" => Some("text/css; charset=utf-8"),
        "svg" => Some("image/svg+xml"),
        "txt" => Some("text/plain; charset=utf-8"),
        _ => None,
    }
}
