//! Views by numbers, edits, and the command that makes the same picture again.

use crate::Girandole;
use crate::pixels::differ;

const SMALL: [&str; 10] =
    ["render", "table", "--size", "32x24", "--lights", "16", "--engine", "cpu", "-o", "p.exr"];

impl Girandole {
    /// The small picture with more options.
    fn picture(&self, more: &[&str]) -> Vec<u8> {
        self.succeed(&[&SMALL[..], more].concat());
        self.bytes("p.exr")
    }

    fn write(&self, name: &str, content: &str) {
        let path = self.path().join(name);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(path, content).unwrap();
    }
}

fn list(edits: &[&str]) -> String {
    format!(r#"{{"version": 1, "edits": [{}]}}"#, edits.join(", "))
}

#[test]
fn views_are_given_by_numbers() {
    let girandole = Girandole::new();
    let picture = |view: &str| girandole.picture(&["--view", view]);
    let plain = picture("1,1.6,1.5,0,0.8,0,0,1,0,60");
    assert!(plain == picture("1.0,16e-1,1.5,0,.8,0,0,1,0,6e1"), "other spellings");
    assert!(plain == picture("1,1.6,1.5,0,0.8,0,0,3,0,60"), "what is up is a direction");
    for other in [
        "1.1,1.6,1.5,0,0.8,0,0,1,0,60",
        "-1,1.6,1.5,0,0.8,0,0,1,0,60",
        "1,1.6,1.5,0,0.8,0.3,0,1,0,60",
        "1,1.6,1.5,0,0.8,0,1,1,0,60",
        "1,1.6,1.5,0,0.8,0,0,1,0,50",
        "1,1.6,1.5,0,0.8,0,0,1,0,2m",
    ] {
        assert!(differ(&plain, &picture(other)), "{other}");
    }
}

#[test]
fn edits_change_the_picture() {
    let girandole = Girandole::new();
    let plain = girandole.picture(&[]);
    let edited = |edits: &[&str], more: &[&str]| {
        girandole.write("edits.json", &list(edits));
        girandole.picture(&[&["--edits", "edits.json"], more].concat())
    };
    assert!(plain == edited(&[], &[]), "no edits");
    let later = r#"{"set_time": {"seconds": 1.25}}"#;
    let at_that_time = girandole.picture(&["--time", "1.25"]);
    assert!(at_that_time == edited(&[later], &[]) && differ(&at_that_time, &plain));
    assert!(plain == edited(&[later], &["--time", "0"]), "--time comes after edits");
    let torus = r#"{"insert_object": {"name": "ring", "shape": "torus", "dynamic": true}}"#;
    let ring = edited(&[torus], &[]);
    assert!(differ(&ring, &plain));
    assert!(differ(&ring, &edited(&[torus, later], &[])));
}

#[test]
fn models_are_looked_for_beside_the_edits() {
    let girandole = Girandole::new();
    girandole.write(
        "deep/models/wall.obj",
        "v -1 0 0.4\nv 1 0 0.4\nv 1 2 0.4\nv -1 2 0.4\nf 1 2 3 4\nf 4 3 2 1\n",
    );
    let wall = r#"{"insert_object": {"name": "wall", "shape": {"file": "models/wall.obj"}}}"#;
    girandole.write("deep/edits.json", &list(&[wall]));
    assert!(differ(&girandole.picture(&[]), &girandole.picture(&["--edits", "deep/edits.json"])));
}

#[test]
fn sequences_are_edited_and_viewed_too() {
    let girandole = Girandole::new();
    girandole.write("edits.json", &list(&[r#"{"insert_object": {"name": "ring", "shape": "torus"}}"#]));
    let small =
        ["render", "table", "--size", "16x12", "--lights", "8", "--engine", "cpu", "--frames", "0..1"];
    let frames = |pattern: &str, more: &[&str]| {
        girandole.succeed(&[&small[..], &["-o", pattern], more].concat());
        ["0", "1"].map(|n| girandole.bytes(&pattern.replace('#', n)))
    };
    let plain = frames("a#.exr", &[]);
    let edited = frames("b#.exr", &["--edits", "edits.json"]);
    let viewed = frames("c#.exr", &["--view", "1,1.6,1.5,0,0.8,0,0,1,0,60"]);
    for i in [0, 1] {
        let pairs = [(&plain, &edited), (&plain, &viewed), (&edited, &viewed)];
        assert!(pairs.iter().all(|(a, b)| differ(&a[i], &b[i])));
    }
}

#[cfg(unix)]
#[test]
fn the_command_in_the_statistics_makes_the_same_picture() {
    let girandole = Girandole::new();
    let [edits, output] = ["it's $(touch oops).json", "-a \"b\"\n`c`.exr"];
    girandole.write(edits, &list(&[r#"{"insert_object": {"name": "ring", "shape": "torus"}}"#]));
    let view = "-1,1.6,1.5,0.1,0.8,-1e-7,0,1,0,60.123456789012345";
    let options = ["--engine=cpu", "--size=32x24", "--lights=16", "--stats=s.json", "--exposure=-1"];
    let files = [format!("--view={view}"), format!("--edits={edits}"), format!("--output={output}")];
    let words = ["render", "table"].into_iter().chain(options).chain(files.iter().map(String::as_str));
    girandole.succeed(&words.collect::<Vec<_>>());
    let before = (girandole.bytes(output), girandole.files());
    let command = girandole.json("s.json")["command"].as_str().unwrap().to_owned();
    assert!(command.starts_with("girandole render table "), "{command}");
    std::fs::remove_file(girandole.path().join(output)).unwrap();
    let program = std::path::Path::new(env!("CARGO_BIN_EXE_girandole")).parent().unwrap();
    let path = format!("{}:{}", program.display(), std::env::var("PATH").unwrap());
    let mut shell = std::process::Command::new("sh");
    let again =
        shell.args(["-c", &command]).env("PATH", path).current_dir(girandole.path()).output().unwrap();
    assert!(again.status.success(), "{command}: {}", crate::stderr(&again));
    assert!(before == (girandole.bytes(output), girandole.files()), "{command}");
}
