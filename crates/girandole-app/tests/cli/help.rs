//! `--help` names everything.

use crate::{Girandole, stdout};

#[test]
fn help_names_every_option() {
    let girandole = Girandole::new();
    for (command, words) in [
        ("--help", "view render join submit compare info bench export --help --version Examples"),
        ("join", "PART exr --output -o --exposure --tonemap Examples"),
        (
            "submit",
            "slurm openjd SCENE --pieces --regions --folder --cores --sbatch --estimate --dry-run --print --frames --refine Examples",
        ),
        (
            "view",
            "SCENE --output -o --size --camera --object --lights --direct --placement --bounces --seed --termination --clamp \
             --shadow-map --map-size --pcf --memory --mode --light-maps --shading --lights-per-pass --tolerance --adapter \
             --exposure --tonemap --aa --refine Keys mouse Drag Wheel Space F1 F9 F12 Escape Ctrl Examples",
        ),
        (
            "render",
            "SCENE --output -o --size --camera --view EYE TARGET UP FOV --edits --environment sky --environment-strength --environment-rotation --light auto none studio --up --object --lights --direct --placement view scene --bounces --seed --termination --clamp \
             --shadow-map octahedral parabolic cube --map-size --pcf --memory --mode full vd-lp vd naive --light-maps on off \
             --shading fused multipass --lights-per-pass --tolerance --debug receivers states levels atlas --engine auto \
             gpu cpu path --paths --adapter --exposure --tonemap agx aces none --aa --stats --time --frames --overwrite --fps --rewalk off N all --refine --sets --region --part --fade --updates --max-map-age Examples area-lights table \
             living-room pillars block gap mirrors mirror-corridor blinds moulding shelf hall torus teapot balloon 1024x768",
        ),
        (
            "compare",
            "REF TEST --mask --edges --trim --max-rel-mse --max-rmse --max-flip --max-energy-error --out --json \
             Examples",
        ),
        (
            "export",
            "SCENE --output -o OUT glb --edits --time --object --scale --up --environment animations Examples",
        ),
        ("info", "SCENE --up --scale --require-adapter Examples"),
        (
            "bench",
            "SCENES --lights --modes full vd-lp vd naive --repeat --size --view --edits --object --aa --seed --adapter --csv --json \
             --light-maps --shading --lights-per-pass --clamp --map-size --memory Examples",
        ),
    ] {
        let arguments = if command == "--help" { vec!["--help"] } else { vec![command, "--help"] };
        let help = stdout(&girandole.succeed(&arguments));
        let is_separator = |c: char| !(c.is_alphanumeric() || c == '-');
        let said: Vec<&str> = help.split(is_separator).collect();
        for word in words.split_whitespace() {
            assert!(said.contains(&word), "{command} --help does not mention {word}:\n{help}");
        }
    }
    // The room that opens by default.
    for command in ["view", "render"] {
        assert!(
            stdout(&girandole.succeed(&[command, "--help"])).contains("[default: living-room]"),
            "{command}"
        );
    }
    assert!(stdout(&girandole.succeed(&["--help"])).contains("`living-room`"));
    assert!(stdout(&girandole.succeed(&["--version"])).starts_with("girandole "));
}
