//! What is opened and written beside, on a thread of its own: the window goes on meanwhile.

use super::camera::Eye;
use super::clock::Instant;
use super::pending::{self, Pending};
use super::session::{Session, Source, Start};
use super::waits::{Wait, What};
use crate::args::{EnvironmentArg, SceneArgs};
use crate::transfer::Transferred;
use anyhow::Result;
use girandole_core::scene::{Edits, Mesh, Scene, load_model};
use std::path::{Path, PathBuf};

/// What has come of it.
pub enum Opened {
    /// The scene of the command line.
    First(Box<First>),
    /// Another scene.
    Scene(Box<Another>),
    /// An object, and its file.
    Model(PathBuf, Box<Mesh>),
    /// A file was written: what there is to say of that.
    Written(String),
}

/// The scene of the command line, with all that its options say of it.
pub struct First {
    pub scene: Scene,
    pub edits: Edits,
    /// Objects that are lit by transfer.
    pub transferred: Vec<Transferred>,
    pub eye: Eye,
}

/// Another scene.
pub struct Another {
    pub source: Source,
    pub scene: Scene,
    pub edits: Edits,
    /// Where those were loaded from.
    pub edits_file: Option<PathBuf>,
    /// Whether one looks from where one did.
    pub keeps_eye: bool,
}

/// What is changed in a scene once it is loaded.
enum Changes {
    None,
    /// What a file says.
    In(PathBuf),
    These(Edits),
}

/// Opens one thing at a time; a later one takes its place.
#[derive(Default)]
pub struct Opener(Option<Job>);

struct Job {
    is_first: bool,
    doing: String,
    since: Instant,
    result: Pending<Result<Opened>>,
}

impl Opener {
    /// With the scene of the command line.
    pub fn first(name: &str, mut open: impl AsyncFnMut() -> Result<First> + Send + 'static) -> Self {
        let mut opener = Self::default();
        opener.begin(
            "Opening",
            name,
            pending::beside(async move || Ok(Opened::First(Box::new(open().await?)))),
        );
        opener.0.iter_mut().for_each(|job| job.is_first = true);
        opener
    }

    /// What is being waited for.
    pub fn wait(&self) -> Option<Wait> {
        let job = self.0.as_ref()?;
        Some(Wait { what: What::Opening, text: job.doing.clone(), since: job.since, share: None })
    }

    pub fn is_waiting(&self) -> bool {
        self.0.is_some()
    }

    /// Gives up what is being opened. What a thread is at, it ends in vain.
    pub fn cancel(&mut self) {
        self.0 = None;
    }

    /// What has come of it, once: when it is there; and whether it is the scene of the command line.
    pub fn take(&mut self) -> Option<(Result<Opened>, bool)> {
        let job = self.0.as_mut()?;
        let result = (job.result.take()?, job.is_first);
        self.0 = None;
        Some(result)
    }

    fn begin(&mut self, doing: &str, name: &str, result: Pending<Result<Opened>>) {
        let name = Path::new(name).file_name().unwrap_or_default().to_string_lossy();
        let job = Job { is_first: false, doing: format!("{doing} {name}"), since: Instant::now(), result };
        self.0 = Some(job);
    }
}

impl Opener {
    /// A file that was dropped: a scene, or an object, with Shift an object though it could be a scene; or a picture of all that is
    /// around the scene that is shown.
    pub fn drop(&mut self, path: &Path, inserts: bool, session: &Session) {
        let is_of = |kinds: &[&str]| {
            path.extension().is_some_and(|e| kinds.iter().any(|kind| e.eq_ignore_ascii_case(kind)))
        };
        if is_of(&["hdr", "exr"]) {
            let mut source = session.source.clone();
            source.load.environment = Some(EnvironmentArg::File(path.into()));
            self.load(source, Changes::These(session.edits.clone()), true);
        } else if inserts || is_of(&["ply", "obj"]) {
            self.add(path);
        } else {
            self.open(path);
        }
    }

    /// A scene, or a model as one.
    pub fn open(&mut self, path: &Path) {
        let source = Source { scene: path.to_string_lossy().into_owned(), ..Source::default() };
        self.load(source, Changes::None, false);
    }

    /// The scene that is shown, as it is in its file, with other edits.
    pub fn load_edits(&mut self, path: &Path, session: &Session) {
        self.load(session.source.clone(), Changes::In(path.into()), true);
    }

    fn load(&mut self, source: Source, changes: Changes, keeps_eye: bool) {
        let name = source.scene.clone();
        let load = async move || {
            let edits_file = if let Changes::In(file) = &changes { Some(file.clone()) } else { None };
            let seen =
                SceneArgs { edits: edits_file.clone(), load: source.load.clone(), ..SceneArgs::default() };
            let (mut scene, mut edits) =
                crate::scene::load_edited_in_slices(&source.scene, source.object.as_deref(), &seen).await?;
            if let Changes::These(these) = &changes {
                these.apply(&mut scene, &load_model)?;
                edits.clone_from(these);
            }
            scene.open();
            let source = source.clone();
            Ok(Opened::Scene(Box::new(Another { source, scene, edits, edits_file, keeps_eye })))
        };
        self.begin("Opening", &name, pending::beside(load));
    }

    /// A model, to be put into the scene that is shown.
    pub fn add(&mut self, path: &Path) {
        let file = path.to_owned();
        let load = async move || {
            let mesh = load_model(&file)?;
            Ok(Opened::Model(file.clone(), Box::new(mesh)))
        };
        self.begin("Reading", &path.to_string_lossy(), pending::beside(load));
    }

    /// Writes the scene as it stands.
    pub fn export(&mut self, path: &Path, session: &Session) {
        let (scene, file) = (session.scene.clone(), path.to_owned());
        let export = async move || Ok(Opened::Written(crate::export::write(&scene, &file)?));
        self.begin("Writing", &path.to_string_lossy(), pending::beside(export));
    }
}

impl Session {
    /// Before there is a scene.
    pub fn blank(start: Start) -> Self {
        let mut session = Self::new(start);
        session.is_blank = true;
        session
    }

    /// Shows the scene of the command line, by the settings that the window has by now.
    pub fn begin(&mut self, first: First, size: [u32; 2]) {
        let First { scene, edits, transferred, eye } = first;
        let (playback, source) = (self.playback, self.source.clone());
        self.replace_scene(source, scene, size);
        (self.playback, self.edits) = (playback, edits);
        self.transfers.hold(transferred);
        self.look_from(eye, size);
    }

    fn look_from(&mut self, eye: Eye, size: [u32; 2]) {
        self.eye = eye;
        if !self.light.views.is_empty() {
            self.light.views = vec![self.view(size)];
        }
    }

    /// Shows another scene.
    pub fn change_scene(&mut self, another: Another, size: [u32; 2]) {
        let Another { source, scene, edits, keeps_eye, .. } = another;
        let eye = Some(self.eye).filter(|eye| match eye {
            Eye::Camera(index) => keeps_eye && *index < scene.cameras.len(),
            Eye::Free(_) => keeps_eye,
        });
        self.replace_scene(source, scene, size);
        self.edits = edits;
        if let Some(eye) = eye {
            self.look_from(eye, size);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::clock::Duration;
    use super::super::session::Work;
    use super::super::session::tests::{SIZE, session};
    use super::*;
    use girandole::DebugView;
    use girandole_core::scene::Edit;
    use girandole_core::scene::builtin::{self, MovingObject};

    fn room(name: &str) -> Scene {
        let mut scene = builtin::build(name, MovingObject::Torus).expect("a room");
        scene.open();
        scene
    }

    /// What comes of it, within a minute.
    fn taken(opener: &mut Opener) -> (Result<Opened>, bool) {
        let start = Instant::now();
        loop {
            if let Some(taken) = opener.take() {
                return taken;
            }
            assert!(start.elapsed() < Duration::from_secs(60), "nothing comes of it");
            std::thread::sleep(Duration::from_millis(1));
        }
    }

    #[test]
    fn what_is_done_before_there_is_a_scene_counts() {
        let mut session = session();
        session.is_blank = true;
        assert_eq!(session.work(), Work::Nothing);
        session.settings.debug = Some(DebugView::Receivers);
        session.playback.playing = true;
        let (edits, eye) = (Edits::default(), Eye::Camera(1));
        session.begin(First { scene: room("table"), edits, transferred: Vec::new(), eye }, SIZE);
        assert_eq!((session.is_blank, session.work()), (false, Work::Renderer));
        assert_eq!((session.settings.debug, session.playback.playing), (Some(DebugView::Receivers), true));
        assert_eq!((session.scene.name.as_str(), session.eye), ("table", eye));
        assert_eq!(session.light.views, [session.view(SIZE)], "light is placed for what is seen");
    }

    #[test]
    fn other_edits_of_a_scene_are_seen_from_the_same_place() {
        let another = |keeps_eye| {
            let mut session = session();
            let eye = Eye::free(&session.view(SIZE)).expect("a view");
            session.eye = eye;
            let source = Source { scene: "table".into(), ..Source::default() };
            let (edits, edits_file) = (Edits::default(), None);
            session
                .change_scene(Another { source, scene: room("table"), edits, edits_file, keeps_eye }, SIZE);
            assert_eq!(session.light.views, [session.view(SIZE)]);
            session.eye == eye
        };
        assert!(another(true) && !another(false));
    }

    #[test]
    fn a_picture_that_is_dropped_is_all_around_and_changes_stay() {
        let folder = tempfile::tempdir().expect("a folder");
        let sky = folder.path().join("sky.hdr");
        std::fs::write(&sky, b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 1\n\x80\x80\x80\x81")
            .expect("written");
        let mut session = session();
        session.source = Source { scene: "table".into(), ..Source::default() };
        session.edits = Edits(vec![Edit::SetTime { seconds: 1.5 }]);
        let mut opener = Opener::default();
        opener.drop(&sky, false, &session);
        let (Ok(Opened::Scene(another)), false) = taken(&mut opener) else { panic!("no scene comes of it") };
        assert!(another.scene.environment.is_some() && another.keeps_eye);
        assert_eq!(another.source.load.environment, Some(EnvironmentArg::File(sky)));
        assert_eq!(another.edits, session.edits);
        for (name, inserts, doing) in [
            ("a.OBJ", false, "Reading a.OBJ"),
            ("a.glb", false, "Opening a.glb"),
            ("a.glb", true, "Reading a.glb"),
        ] {
            opener.drop(&folder.path().join(name), inserts, &session);
            assert_eq!(opener.wait().expect("it is waited for").text, doing);
        }
    }

    #[test]
    fn one_thing_is_opened_at_a_time() {
        let first = async || {
            let scene = room("gap");
            Ok(First { scene, edits: Edits::default(), transferred: Vec::new(), eye: Eye::Camera(0) })
        };
        let mut opener = Opener::first("rooms/gap.glb", first);
        assert_eq!(opener.wait().expect("it is waited for").text, "Opening gap.glb");
        assert!(matches!(taken(&mut opener), (Ok(Opened::First(_)), true)));
        assert!(!opener.is_waiting() && opener.take().is_none());
        let folder = tempfile::tempdir().expect("a folder");
        opener.open(&folder.path().join("nowhere.glb"));
        assert!(matches!(taken(&mut opener), (Err(_), false)), "a later one is not the first");
        let model = folder.path().join("model.obj");
        std::fs::write(&model, "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").expect("written");
        opener.open(&folder.path().join("nowhere.glb"));
        opener.add(&model);
        assert!(matches!(taken(&mut opener), (Ok(Opened::Model(path, _)), false) if path == model));
        opener.add(&model);
        opener.cancel();
        assert!(!opener.is_waiting());
        let written = folder.path().join("written.glb");
        opener.export(&written, &session());
        assert!(matches!(taken(&mut opener), (Ok(Opened::Written(said)), _) if said.starts_with("wrote")));
        opener.open(&written);
        let (opened, _) = taken(&mut opener);
        assert!(
            matches!(opened.expect("it opens"), Opened::Scene(another) if !another.scene.objects.is_empty())
        );
    }
}
