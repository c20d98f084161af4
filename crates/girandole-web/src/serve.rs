//! Serves a folder to browsers on this machine.

use anyhow::{Result, anyhow};
use percent_encoding::percent_decode_str;
use std::collections::BTreeMap;
use std::io::Cursor;
use std::path::{Component, Path, PathBuf};
use std::sync::Arc;
use std::thread::JoinHandle;
use tiny_http::{Header, Method, Request, Response};

/// Browsers ask for several files at once.
const THREADS: usize = 4;

/// What is served.
#[derive(Clone, Debug, Default)]
pub struct Site {
    folder: Option<PathBuf>,
    pages: BTreeMap<String, Vec<u8>>,
}

/// Serves a site until it is dropped.
pub struct Server {
    http: Arc<tiny_http::Server>,
    threads: Vec<JoinHandle<()>>,
    port: u16,
}

impl Site {
    /// All files in and below a folder; for a folder its `index.html`.
    pub fn folder(folder: &Path) -> Self {
        Self { folder: Some(folder.to_path_buf()), pages: BTreeMap::new() }
    }

    /// And a file of these bytes, by a path such as `test/page.html`.
    pub fn with(mut self, path: &str, bytes: impl Into<Vec<u8>>) -> Self {
        self.pages.insert(path.to_string(), bytes.into());
        self
    }

    /// The type and the bytes of what is at an address's path.
    fn get(&self, url: &str) -> Option<(&'static str, Vec<u8>)> {
        let path = relative(url)?;
        if let Some(bytes) = path.to_str().and_then(|path| self.pages.get(path)) {
            return Some((mime(&path), bytes.clone()));
        }
        let folder = self.folder.as_ref()?.canonicalize().ok()?;
        let mut file = folder.join(path).canonicalize().ok()?;
        if file.is_dir() {
            file = file.join("index.html").canonicalize().ok()?;
        }
        // A link may lead out of the folder.
        if !file.starts_with(&folder) {
            return None;
        }
        Some((mime(&file), std::fs::read(&file).ok()?))
    }
}

impl Server {
    /// Serves at a port of this machine, at a free one if it is 0.
    pub fn start(site: Site, port: u16) -> Result<Self> {
        let http = tiny_http::Server::http(("127.0.0.1", port))
            .map_err(|error| anyhow!("cannot serve at port {port}: {error}; choose another by --port"))?;
        let http = Arc::new(http);
        let port = http.server_addr().to_ip().map_or(port, |address| address.port());
        let site = Arc::new(site);
        let threads = (0..THREADS).map(|_| {
            let (http, site) = (http.clone(), site.clone());
            std::thread::spawn(move || {
                while let Ok(request) = http.recv() {
                    answer(&site, request);
                }
            })
        });
        Ok(Self { threads: threads.collect(), http, port })
    }

    /// Where the site is.
    pub fn address(&self) -> String {
        format!("http://127.0.0.1:{}/", self.port)
    }

    /// Serves until the program is ended.
    pub fn wait(mut self) {
        for thread in self.threads.drain(..) {
            // Its panic has been printed.
            let _ = thread.join();
        }
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        for _ in &self.threads {
            self.http.unblock();
        }
        for thread in self.threads.drain(..) {
            // Its panic has been printed.
            let _ = thread.join();
        }
    }
}

fn answer(site: &Site, request: Request) {
    let response = match request.method() {
        Method::Get | Method::Head => match site.get(request.url()) {
            Some((mime, bytes)) => response(200, mime, bytes),
            None => response(404, "text/plain; charset=utf-8", b"There is no such file.\n".to_vec()),
        },
        _ => response(405, "text/plain; charset=utf-8", b"Files can only be read.\n".to_vec()),
    };
    // A browser that went away is no error of the server.
    let _ = request.respond(response);
}

fn response(status: u16, mime: &str, bytes: Vec<u8>) -> Response<Cursor<Vec<u8>>> {
    let headers = [("Content-Type", mime), ("Cache-Control", "no-store")];
    headers.iter().filter_map(|(name, value)| Header::from_bytes(*name, *value).ok()).fold(
        // Its length is known: it is never sent in chunks.
        Response::from_data(bytes).with_status_code(status).with_chunked_threshold(usize::MAX),
        Response::with_header,
    )
}

/// The path that an address names below the folder; none if it leads out of it.
fn relative(url: &str) -> Option<PathBuf> {
    let path = url.split(['?', '#']).next()?.trim_start_matches('/');
    let path = PathBuf::from(percent_decode_str(path).decode_utf8().ok()?.into_owned());
    let inside = path.components().all(|part| matches!(part, Component::Normal(_) | Component::CurDir));
    inside.then_some(path)
}

fn mime(file: &Path) -> &'static str {
    let extension = file.extension().and_then(|extension| extension.to_str()).unwrap_or_default();
    match extension.to_ascii_lowercase().as_str() {
        "html" => "text/html; charset=utf-8",
        "js" | "mjs" => "text/javascript; charset=utf-8",
        "css" => "text/css; charset=utf-8",
        "json" | "map" => "application/json",
        "md" | "txt" | "ts" | "obj" => "text/plain; charset=utf-8",
        "wasm" => "application/wasm",
        "glb" => "model/gltf-binary",
        "gltf" => "model/gltf+json",
        "png" => "image/png",
        "jpg" | "jpeg" => "image/jpeg",
        "webp" => "image/webp",
        "svg" => "image/svg+xml",
        "ico" => "image/x-icon",
        _ => "application/octet-stream",
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::{Read, Write};
    use std::net::TcpStream;

    /// The whole answer to a request.
    fn ask(server: &Server, request: &str) -> String {
        let mut stream = TcpStream::connect(("127.0.0.1", server.port)).expect("a connection");
        write!(stream, "{request} HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n").expect("sent");
        let mut answer = Vec::new();
        stream.read_to_end(&mut answer).expect("an answer");
        String::from_utf8_lossy(&answer).into_owned()
    }

    fn folder() -> tempfile::TempDir {
        let folder = tempfile::tempdir().expect("a folder");
        std::fs::create_dir_all(folder.path().join("site/sub")).expect("a folder");
        std::fs::write(folder.path().join("secret.txt"), "secret").expect("a file");
        std::fs::write(folder.path().join("site/index.html"), "<p>root").expect("a file");
        std::fs::write(folder.path().join("site/sub/index.html"), "<p>sub").expect("a file");
        std::fs::write(folder.path().join("site/a b.wasm"), "wasm").expect("a file");
        folder
    }

    #[test]
    fn files_have_their_types_and_are_not_kept() {
        let folder = folder();
        let site = Site::folder(&folder.path().join("site")).with("own/page.js", "let a;");
        let server = Server::start(site, 0).expect("a server");
        assert!(server.address().starts_with("http://127.0.0.1:"));
        let wasm = ask(&server, "GET /a%20b.wasm?version=1");
        assert!(wasm.starts_with("HTTP/1.1 200") && wasm.ends_with("\r\n\r\nwasm"), "{wasm}");
        assert!(wasm.contains("Content-Type: application/wasm\r\n"), "{wasm}");
        assert!(wasm.contains("Cache-Control: no-store\r\n"), "{wasm}");
        assert!(ask(&server, "GET /").ends_with("<p>root"));
        assert!(ask(&server, "GET /sub/").ends_with("<p>sub"));
        let own = ask(&server, "GET /own/page.js");
        assert!(own.contains("text/javascript") && own.ends_with("let a;"), "{own}");
    }

    #[test]
    fn what_is_not_there_or_cannot_be_is_refused() {
        let folder = folder();
        let server = Server::start(Site::folder(&folder.path().join("site")), 0).expect("a server");
        assert!(ask(&server, "GET /none").starts_with("HTTP/1.1 404"));
        assert!(ask(&server, "PUT /index.html").starts_with("HTTP/1.1 405"));
        let head = ask(&server, "HEAD /index.html");
        assert!(head.starts_with("HTTP/1.1 200") && head.ends_with("\r\n\r\n"), "{head}");
    }

    #[test]
    fn no_path_leads_out_of_the_folder() {
        let folder = folder();
        let server = Server::start(Site::folder(&folder.path().join("site")), 0).expect("a server");
        let paths = [
            "/../secret.txt",
            "/%2e%2e/secret.txt",
            "/..%2fsecret.txt",
            "/sub/../../secret.txt",
            "//etc/passwd",
            "/%2fetc/passwd",
            "/a%00b",
            "/%ff",
        ];
        for path in paths {
            let answer = ask(&server, &format!("GET {path}"));
            assert!(answer.starts_with("HTTP/1.1 404") && !answer.contains("secret\r"), "{path}: {answer}");
        }
    }

    #[cfg(unix)]
    #[test]
    fn no_link_leads_out_of_the_folder() {
        let folder = folder();
        let site = folder.path().join("site");
        std::os::unix::fs::symlink(folder.path().join("secret.txt"), site.join("out.txt")).expect("a link");
        std::os::unix::fs::symlink(site.join("index.html"), site.join("in.html")).expect("a link");
        let site = Site::folder(&site);
        assert_eq!(site.get("/out.txt"), None);
        assert_eq!(site.get("/in.html").expect("a file").1, b"<p>root");
    }

    #[test]
    fn a_dropped_server_leaves_its_port() {
        let server = Server::start(Site::default(), 0).expect("a server");
        let port = server.port;
        drop(server);
        // Its last thread ends soon after.
        let start = std::time::Instant::now();
        while TcpStream::connect(("127.0.0.1", port)).is_ok() {
            assert!(start.elapsed().as_secs() < 10, "it still listens");
        }
    }
}
